//! `parameters.json`: all parameters of a fit with their covariance, so that every printed interval can be computed again.

use super::document::{NoiseSummary, ResultDocument};
use super::run::FittedModel;
use kmcfit_core::internals::diagnostics::student_half_width;
use kmcfit_core::internals::functions::{Basis, CoefficientFunction};
use kmcfit_core::internals::identifiability::{Band, CovarianceKind};
use serde::Serialize;
use std::collections::BTreeMap;

/// The document. Vectors and the covariance have one entry for each parameter: those of the functions in the order of `functions`, then
/// initial states and sensor parameters.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParametersDocument {
    /// Version of the format.
    format: u32,
    /// Version of kmcfit.
    version: &'static str,
    /// Names: `stiffness` for a constant, `stiffness[2]` for the third parameter of its basis.
    names: Vec<String>,
    /// Values, in the unit of the function or parameter.
    values: Vec<f64>,
    units: Vec<String>,
    /// Lower and upper bound of each parameter; `null` without one.
    bounds: Vec<[Option<f64>; 2]>,
    /// Covariance of the estimates; `null` with more than 64 parameters and where a combination is not identifiable.
    covariance: Option<Vec<Vec<f64>>>,
    /// Kind of the covariance: `information`, `penalised`, `bayesian` or `kernel`.
    covariance_kind: Option<CovarianceKind>,
    /// Start (s), length (s) and number of nodes of the time grid.
    grid: GridSummary,
    functions: Vec<FunctionBasis>,
    /// For each estimate of `result.json` with an interval, and each initial state and sensor parameter, what its half-width is made of.
    estimates: BTreeMap<String, EstimateError>,
    /// Noise of each channel.
    noise: Vec<ChannelNoise>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct GridSummary {
    start: f64,
    duration: f64,
    nodes: usize,
}

/// Basis of a function and the place of its parameters.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct FunctionBasis {
    name: String,
    unit: String,
    /// Name of the basis as in a model file; `fixed` without parameters. A polynomial is a sum of Legendre polynomials on the record mapped to
    /// -1 to 1, a spline has the knots and three further ones at either end.
    basis: &'static str,
    /// Times of the knots, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    knots: Option<Vec<f64>>,
    /// Index of the first parameter, and their number.
    first: usize,
    count: usize,
    /// Value that is added to the basis, where it is the same at all times and not zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    offset: Option<f64>,
}

/// The half-width of a 95 % interval is `quantile sqrt(g^T C g + basis_error^2)` with the gradient `g` and the covariance `C`.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct EstimateError {
    /// Derivatives of the estimate in the parameters.
    gradient: Vec<f64>,
    /// Error of linear interpolation between knots.
    basis_error: f64,
    /// 97.5 % quantile of the t distribution of the estimate.
    quantile: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct ChannelNoise {
    experiment: String,
    channel: String,
    /// Standard deviation, where it is the same for all samples.
    sigma: Option<f64>,
    /// Correlation; `null` for white noise.
    correlation: Option<NoiseSummary>,
}

impl FittedModel<'_> {
    /// All parameters with their covariance.
    pub(super) fn parameters(&self, document: &ResultDocument) -> ParametersDocument {
        let problem = &self.model.problem;
        let functions = &problem.functions;
        let grid = &problem.system.grid;
        let bands = self.bands();
        let (mut names, mut units, mut bases) = (Vec::new(), Vec::new(), Vec::new());
        for (function, range) in functions.iter().zip(functions.ranges()) {
            let unit = self.unit(function).to_owned();
            let name = |i: usize| match range.len() {
                1 => function.name(),
                _ => format!("{}[{i}]", function.name()),
            };
            names.extend((0..range.len()).map(name));
            units.extend(range.clone().map(|_| unit.clone()));
            bases.push(FunctionBasis {
                name: function.name(),
                unit,
                basis: function.basis.as_ref().map_or("fixed", Basis::name),
                knots: knots(function),
                first: range.start,
                count: range.len(),
                offset: offset(function),
            });
        }
        names.extend(functions.scalars().iter().map(|s| s.name.clone()));
        units.extend(functions.scalars().iter().map(|s| s.unit.clone()));
        let covariance = bands.and_then(|bands| bands.covariance.as_ref());
        ParametersDocument {
            format: 1,
            version: env!("CARGO_PKG_VERSION"),
            values: self.fit.best.parameters.clone(),
            bounds: self.bounds(),
            covariance: covariance.map(|c| {
                let row = |i: usize| c.row(i).iter().copied().collect();
                (0..c.nrows()).map(row).collect()
            }),
            covariance_kind: bands
                .filter(|_| covariance.is_some())
                .map(|bands| bands.covariance_kind),
            grid: GridSummary {
                start: grid.start(),
                duration: grid.duration(),
                nodes: grid.nodes(),
            },
            estimates: match covariance {
                Some(_) => self.estimate_errors(document, &names),
                None => BTreeMap::new(),
            },
            names,
            units,
            functions: bases,
            noise: noise(document),
        }
    }

    /// Bounds of single parameters.
    fn bounds(&self) -> Vec<[Option<f64>; 2]> {
        let problem = &self.model.problem;
        let mut bounds = vec![[None; 2]; problem.parameters()];
        for group in &problem.constraints.groups {
            for i in 0..group.rows.len() {
                let Some((j, factor)) = group.single(i) else {
                    continue;
                };
                let mut ends = group.bounds(i).map(|bound| bound / factor);
                ends.sort_by(f64::total_cmp);
                for (bound, end) in bounds[j].iter_mut().zip(ends) {
                    *bound = Some(end).filter(|end| end.is_finite()).or(*bound);
                }
            }
        }
        bounds
    }

    fn estimate_errors(
        &self,
        document: &ResultDocument,
        names: &[String],
    ) -> BTreeMap<String, EstimateError> {
        let mut errors = BTreeMap::new();
        let Some(bands) = self.bands() else {
            return errors;
        };
        let ratio = |name: &str| match name {
            "natural_frequency" => bands.ratio("natural frequency"),
            "damping_ratio" => bands.ratio("damping ratio"),
            "k_over_m" => bands.ratio("k/m"),
            "c_over_m" => bands.ratio("c/m"),
            _ => None,
        };
        let function = |name: &str| bands.functions.iter().find(|band| band.name == name);
        let error = |band: &Band| EstimateError {
            gradient: band.mean.gradient.clone(),
            basis_error: band.mean.basis_error,
            quantile: student_half_width(band.mean.degrees),
        };
        for (name, estimate) in &document.estimates.0 {
            let band = ratio(name).or_else(|| function(name));
            if let (Some(band), Some(_)) = (band, estimate.ci95) {
                errors.insert(name.clone(), error(band));
            }
        }
        for parameter in &document.nuisance_parameters {
            let index = names.iter().position(|name| *name == parameter.name);
            if let (Some(index), Some(_)) = (index, parameter.standard_error) {
                let mut gradient = vec![0.0; names.len()];
                gradient[index] = 1.0;
                let degrees = parameter.degrees_of_freedom.unwrap_or(f64::INFINITY);
                let error = EstimateError {
                    gradient,
                    basis_error: 0.0,
                    quantile: student_half_width(degrees),
                };
                errors.insert(parameter.name.clone(), error);
            }
        }
        errors
    }
}

fn knots(function: &CoefficientFunction) -> Option<Vec<f64>> {
    match function.basis.as_ref()? {
        Basis::PiecewiseConstant { knots }
        | Basis::PiecewiseLinear { knots }
        | Basis::BSpline { knots } => Some(knots.clone()),
        Basis::Nodal | Basis::Constant | Basis::Polynomial { .. } => None,
    }
}

fn offset(function: &CoefficientFunction) -> Option<f64> {
    let first = *function.offset.first()?;
    let is_same = function.offset.iter().all(|value| *value == first);
    (is_same && first != 0.0).then_some(first)
}

fn noise(document: &ResultDocument) -> Vec<ChannelNoise> {
    let each = document.experiments.iter().flat_map(|experiment| {
        experiment.channels.iter().map(|channel| ChannelNoise {
            experiment: experiment.name.clone(),
            channel: channel.kind.clone(),
            sigma: channel.sigma,
            correlation: channel.noise.clone(),
        })
    });
    each.collect()
}
