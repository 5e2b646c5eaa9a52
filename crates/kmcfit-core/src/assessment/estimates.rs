//! The answer of a fit: estimates of natural frequency, damping ratio, coefficients and ratios with their confidence intervals.

use crate::functions::{CoefficientFunction, Ratio};
use crate::identifiability::{Curve, Quantities, Quantity, ScaleSource, scale_source};
use crate::number_format::number_or_nan;
use crate::problem::Problem;
use crate::solvers::Fit;
use serde::{Deserialize, Serialize};

/// How an estimate was obtained.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EstimateStatus {
    /// From the samples.
    Estimated,
    /// Not determined by the samples with the method of the fit.
    NotIdentifiable,
    /// Fixed by the model; with an interval where its standard deviation is stated.
    Fixed,
    /// The samples determine ratios only: mass, damping and stiffness scale with a value that the model assumes.
    OnlyAsRatio,
}

/// An estimated quantity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Mean over the record `1/T integral p dt`, by the trapezoid rule over the nodes; NaN where the quantity is not defined, as a natural
    /// frequency with a negative stiffness.
    #[serde(deserialize_with = "number_or_nan")]
    pub value: f64,
    /// Smallest and largest value over the record; `None` where the quantity is not defined at some time.
    pub range: Option<[f64; 2]>,
    /// 95 % confidence interval of the mean; `None` for a fixed quantity without a standard deviation, one that is not identifiable, and
    /// without intervals.
    pub ci95: Option<[f64; 2]>,
    /// Unit; empty if dimensionless.
    pub unit: String,
    /// Status.
    pub status: EstimateStatus,
    /// The mean with its standard error; not in files.
    #[serde(skip)]
    pub quantity: Option<Quantity>,
}

/// Estimates at the end of a fit with their names, the most important first: natural frequency (of the linear part, `sqrt(k/m)/(2 pi)`) and
/// damping ratio `c/(2 sqrt(k m))`, then the functions, then `k/m` and `c/m`; the ratios before the functions where the samples determine ratios
/// only. Without `quantities` with standard errors they have no intervals.
pub fn estimates(
    problem: &Problem,
    fit: &Fit,
    quantities: Option<&Quantities>,
) -> Vec<(String, Estimate)> {
    let theta = &fit.best.parameters;
    let quantities = match quantities {
        Some(quantities) => quantities.clone(),
        None => Quantities::at(problem, theta),
    };
    let is_scaled = matches!(
        scale_source(problem),
        ScaleSource::Fixed(_) | ScaleSource::Model
    );
    let values = problem.functions.values(theta);
    let functions = problem.functions.iter().zip(&values);
    let functions = functions.zip(quantities.functions);
    let functions = functions.map(|((function, values), mean)| {
        let status = match () {
            () if function.basis.is_none() || function.prior.is_some() => EstimateStatus::Fixed,
            () if is_scaled && is_coefficient_of_scale(function) => EstimateStatus::OnlyAsRatio,
            () => EstimateStatus::Estimated,
        };
        (function.name(), Estimate::of(mean, values, status))
    });
    let functions: Vec<_> = functions.collect();
    let nodal = &fit.best.evaluation.nodal;
    let ratio = |ratio: Ratio| {
        let terms = Curve::Ratio(ratio).terms(problem)?;
        let mut functions = terms.coefficients.iter().flatten();
        let status = match functions.all(|f| problem.functions.get(*f).basis.is_none()) {
            true => EstimateStatus::Fixed,
            false => EstimateStatus::Estimated,
        };
        let values = ratio.at_nodes(problem.system.laws(), nodal);
        let mean = quantities
            .ratios
            .iter()
            .find(|mean| mean.name == ratio.name())?;
        let estimate = Estimate::of(mean.clone(), &values, status);
        Some((ratio.key().to_owned(), estimate))
    };
    let first = [Ratio::NaturalFrequency, Ratio::DampingRatio];
    let last = [Ratio::StiffnessOverMass, Ratio::DampingOverMass];
    let [first, last] = [first, last].map(|ratios| ratios.into_iter().filter_map(ratio).collect());
    match is_scaled {
        true => [first, last, functions].concat(),
        false => [first, functions, last].concat(),
    }
}

/// True for functions that scale with the mass: all force terms and the mass.
fn is_coefficient_of_scale(function: &CoefficientFunction) -> bool {
    !function.is_known_part && function.prior.is_none()
}

impl Estimate {
    /// An estimate with this mean of these values over the record.
    fn of(mean: Quantity, values: &[f64], status: EstimateStatus) -> Self {
        let is_defined = values.iter().all(|v| v.is_finite());
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self {
            value: mean.value,
            range: is_defined.then_some([least, most]),
            ci95: mean.interval(),
            unit: mean.unit.clone(),
            status,
            quantity: Some(mean),
        }
    }
}
