//! The answer of a fit: estimates of natural frequency, damping ratio, coefficients and ratios with their confidence intervals.

use crate::functions::{CoefficientFunction, Ratios};
use crate::identifiability::{
    MeanOverRecord, Means, ScaleSource, mean_over_record, mean_weights, scale_source,
};
use crate::problem::Problem;
use crate::solvers::{Fit, number_or_nan};
use crate::system::NodalCoefficients;
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
}

/// A ratio of the shared coefficient set.
struct RatioName {
    name: &'static str,
    /// Name of its band.
    band: &'static str,
    unit: &'static str,
    /// Places of its coefficients: mass, damping, stiffness.
    places: &'static [usize],
}

const RATIOS: [RatioName; 4] = [
    RatioName {
        name: "natural_frequency",
        band: "natural frequency",
        unit: "Hz",
        places: &[0, 2],
    },
    RatioName {
        name: "damping_ratio",
        band: "damping ratio",
        unit: "",
        places: &[0, 1, 2],
    },
    RatioName {
        name: "k_over_m",
        band: "k/m",
        unit: "1/s^2",
        places: &[0, 2],
    },
    RatioName {
        name: "c_over_m",
        band: "c/m",
        unit: "1/s",
        places: &[0, 1],
    },
];

/// Estimates at the end of a fit with their names, the most important first: natural frequency (of the linear part, `sqrt(k/m)/(2 pi)`) and
/// damping ratio `c/(2 sqrt(k m))`, then the functions, then `k/m` and `c/m`; the ratios before the functions where the samples determine ratios
/// only.
pub fn estimates(
    problem: &Problem,
    fit: &Fit,
    means: Option<&Means<'_>>,
) -> Vec<(String, Estimate)> {
    let best = &fit.best;
    estimates_at(problem, &best.parameters, &best.evaluation.nodal, means)
}

/// [`estimates`] with the parameters `theta` and the coefficients of the shared set.
pub(super) fn estimates_at(
    problem: &Problem,
    theta: &[f64],
    nodal: &NodalCoefficients,
    means: Option<&Means<'_>>,
) -> Vec<(String, Estimate)> {
    let is_scaled = matches!(
        scale_source(problem),
        ScaleSource::Fixed(_) | ScaleSource::Model
    );
    let values = problem.functions.values(theta);
    let functions = problem.functions.iter().zip(&values).enumerate();
    let functions = functions.map(|(f, (function, values))| {
        let mean = means.map(|means| means.functions[f]);
        let status = match () {
            () if function.basis.is_none() || function.prior.is_some() => EstimateStatus::Fixed,
            () if is_scaled && is_coefficient_of_scale(function) => EstimateStatus::OnlyAsRatio,
            () => EstimateStatus::Estimated,
        };
        let unit = function.quantity.unit();
        (function.name(), estimate(values, mean, unit, status))
    });
    let functions: Vec<_> = functions.collect();
    drop(values);
    let nodal = Ratios::of(nodal);
    let curves = [
        nodal.frequency,
        nodal.damping_ratio,
        nodal.k_over_m,
        nodal.c_over_m,
    ];
    let is_fixed = |places: &[usize]| {
        let set = problem.functions.coefficient_set(0);
        let mut parts = set.parts().filter(|(place, _)| places.contains(place));
        parts.all(|(_, f)| problem.functions.get(f).basis.is_none())
    };
    let ratios = RATIOS.iter().zip(&curves).map(|(ratio, values)| {
        let mean = means.and_then(|means| means.ratio(ratio.band));
        let status = match is_fixed(ratio.places) {
            true => EstimateStatus::Fixed,
            false => EstimateStatus::Estimated,
        };
        let estimate = estimate(values, mean, ratio.unit, status);
        (ratio.name.to_owned(), estimate)
    });
    let mut first: Vec<_> = ratios.collect();
    let last = first.split_off(2);
    match is_scaled {
        true => [first, last, functions].concat(),
        false => [first, functions, last].concat(),
    }
}

/// True for functions that scale with the mass: all force terms and the mass.
fn is_coefficient_of_scale(function: &CoefficientFunction) -> bool {
    !function.is_known_part && function.prior.is_none()
}

fn estimate(
    values: &[f64],
    mean: Option<&MeanOverRecord>,
    unit: &str,
    status: EstimateStatus,
) -> Estimate {
    let value = mean_over_record(values, &mean_weights(values.len()));
    let half = mean.and_then(|mean| {
        let [low, high] = mean.interval()?;
        Some(0.5 * (high - low))
    });
    let is_defined = values.iter().all(|v| v.is_finite());
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Estimate {
        value,
        range: is_defined.then_some([least, most]),
        ci95: half
            .filter(|_| value.is_finite())
            .map(|half| [value - half, value + half]),
        unit: unit.to_owned(),
        status,
    }
}
