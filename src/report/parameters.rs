//! `parameters.json`: all parameters of a fit with their covariance, so that every printed interval can be computed again.

use super::document::{FORMAT, NoiseSummary, ResultDocument};
use super::run::FittedModel;
use crate::error::InputError;
use crate::text_io::{JSON, read_text_within};
use kmcfit_core::diagnostics::student_half_width;
use kmcfit_core::functions::{Basis, CoefficientFunction};
use kmcfit_core::identifiability::{CovarianceKind, Quantity};
use kmcfit_core::noise::{Correlation, CorrelationLaw};
use kmcfit_core::record::{Channel, NoiseEstimate, ScoreCovariance};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// Longest document, bytes.
const LONGEST: u64 = 1 << 26;

/// The document. Vectors and the covariance have one entry for each parameter: those of the functions in the order of `functions`, then
/// initial states and sensor parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParametersDocument {
    /// Version of the format.
    format: u32,
    /// Version of kmcfit.
    version: String,
    /// Names: `stiffness` for a constant, `stiffness[2]` for the third parameter of its basis.
    pub names: Vec<String>,
    /// Values, in the unit of the function or parameter.
    pub values: Vec<f64>,
    units: Vec<String>,
    /// Lower and upper bound of each parameter; `null` without one.
    bounds: Vec<[Option<f64>; 2]>,
    /// Covariance of the estimates; `null` with more than 64 parameters and where a combination is not identifiable.
    pub covariance: Option<Vec<Vec<f64>>>,
    /// Kind of the covariance: `information`, `penalised`, `bayesian` or `kernel`.
    pub covariance_kind: Option<CovarianceKind>,
    /// Start (s), length (s) and number of nodes of the time grid.
    pub grid: GridSummary,
    pub functions: Vec<FunctionBasis>,
    /// For each estimate of `result.json` with an interval, and each initial state and sensor parameter, what its half-width is made of.
    estimates: BTreeMap<String, EstimateError>,
    /// Noise of each channel.
    pub noise: Vec<ChannelNoise>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GridSummary {
    start: f64,
    duration: f64,
    nodes: usize,
}

/// Basis of a function and the place of its parameters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FunctionBasis {
    pub name: String,
    unit: String,
    /// Name of the basis as in a model file; `fixed` without parameters. A polynomial is a sum of Legendre polynomials on the record mapped to
    /// -1 to 1, a spline has the knots and three further ones at either end.
    pub basis: String,
    /// Times of the knots, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub knots: Option<Vec<f64>>,
    /// Index of the first parameter, and their number.
    pub first: usize,
    /// Number of parameters.
    pub count: usize,
    /// Value that is added to the basis, where it is the same at all times and not zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<f64>,
    /// True for jumps found by the rule `bic`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub has_jumps: bool,
}

/// The half-width of a 95 % interval is `quantile sqrt(g^T C g + basis_error^2)` with the gradient `g` and the covariance `C`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct EstimateError {
    /// Derivatives of the estimate in the parameters.
    gradient: Vec<f64>,
    /// Error of linear interpolation between knots.
    basis_error: f64,
    /// 97.5 % quantile of the t distribution of the estimate.
    quantile: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelNoise {
    experiment: String,
    channel: String,
    /// Standard deviation, where it is the same for all samples.
    pub sigma: Option<f64>,
    /// Correlation; `null` for white noise.
    pub correlation: Option<NoiseSummary>,
    /// Partial autocorrelations of an autoregressive process, from which its coefficients follow.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    partial_autocorrelations: Vec<f64>,
    /// Covariance of the estimated noise parameters: the logarithm of sigma, then the inverse hyperbolic tangents of the partial
    /// autocorrelations or the logarithm of the correlation time. The degrees of freedom of the intervals follow from it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    noise_covariance: Vec<Vec<f64>>,
    /// Covariance of the scores: `model`, or `kernel` for innovations that are not white.
    #[serde(default, skip_serializing_if = "is_model")]
    pub scores: ScoreCovariance,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_model(scores: &ScoreCovariance) -> bool {
    *scores == ScoreCovariance::Model
}

impl ParametersDocument {
    /// Reads the document of a run; also as JSON, with unknown keys.
    ///
    /// # Errors
    /// If it is missing or not one that `kmcfit fit` writes.
    pub fn read(folder: &Path) -> Result<(Self, Value), InputError> {
        const EXPECTED: &str = "the parameters of a run, as written by `kmcfit fit`";
        let path = folder.join("parameters.json");
        if !path.exists() {
            return Err(InputError::file(&path, "no such file")
                .expected(EXPECTED)
                .hint("fits with more than 10,000 parameters write none; fits of earlier versions must be repeated"));
        }
        let damaged = |error: serde_json::Error| {
            InputError::file(&path, "the parameters are damaged")
                .found(error)
                .expected(EXPECTED)
        };
        let text = read_text_within(&path, "the parameters of a run", LONGEST, JSON)?;
        let value: Value = serde_json::from_str(&text).map_err(damaged)?;
        let document = Self::deserialize(&value).map_err(damaged)?;
        let n = document.names.len();
        let is_square = |rows: &Vec<Vec<f64>>| rows.len() == n && rows.iter().all(|r| r.len() == n);
        let fits = document.values.len() == n
            && document.format == FORMAT
            && document.covariance.as_ref().is_none_or(is_square)
            && document.functions.iter().all(|f| f.first + f.count <= n);
        match fits {
            true => Ok((document, value)),
            false => Err(InputError::file(&path, "the parameters are damaged")
                .found(format!(
                    "lists of other lengths than {n}, the number of names"
                ))
                .expected(EXPECTED)),
        }
    }
}

impl FittedModel<'_> {
    /// All parameters with their covariance.
    pub(super) fn parameters(&self, document: &ResultDocument) -> ParametersDocument {
        let problem = &self.model.problem;
        let functions = &problem.functions;
        let grid = &problem.system.grid;
        let bands = self.bands();
        let (mut names, mut units, mut bases) = (Vec::new(), Vec::new(), Vec::new());
        for (f, (function, range)) in functions.iter().zip(functions.ranges()).enumerate() {
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
                basis: function.basis.as_ref().map_or("fixed", Basis::name).into(),
                knots: knots(function),
                first: range.start,
                count: range.len(),
                offset: offset(function),
                has_jumps: problem.jumps.iter().any(|jumps| jumps.function == f),
            });
        }
        names.extend(functions.scalars().iter().map(|s| s.name.clone()));
        units.extend(functions.scalars().iter().map(|s| s.unit.clone()));
        let covariance = bands.and_then(|bands| bands.covariance.as_ref());
        let kind = bands
            .filter(|_| covariance.is_some())
            .map(|bands| bands.quantities.kind);
        let estimates = match covariance.is_some() {
            true => self.estimate_errors(document, names.len()),
            false => BTreeMap::new(),
        };
        ParametersDocument {
            format: 1,
            version: env!("CARGO_PKG_VERSION").into(),
            values: self.fit.best.parameters.clone(),
            bounds: self.bounds(),
            covariance: covariance.map(|c| {
                let row = |i: usize| c.row(i).iter().copied().collect();
                (0..c.nrows()).map(row).collect()
            }),
            covariance_kind: kind,
            grid: GridSummary {
                start: grid.start(),
                duration: grid.duration(),
                nodes: grid.nodes(),
            },
            estimates,
            names,
            units,
            functions: bases,
            noise: noise(document, problem.channels().map(Channel::noise)),
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
        parameters: usize,
    ) -> BTreeMap<String, EstimateError> {
        let estimates = document.estimates.0.iter();
        let estimates = estimates.filter(|(_, estimate)| estimate.ci95.is_some());
        let estimates =
            estimates.filter_map(|(name, estimate)| Some((name, estimate.quantity.as_ref()?)));
        let scalars = document.nuisance_parameters.iter();
        let scalars = scalars.filter(|scalar| scalar.standard_error.is_finite());
        let error = |quantity: &Quantity| {
            let mut gradient = vec![0.0; parameters];
            quantity
                .gradient
                .iter()
                .for_each(|(j, slope)| gradient[*j] = *slope);
            EstimateError {
                gradient,
                basis_error: quantity.basis_error,
                quantile: student_half_width(quantity.degrees),
            }
        };
        let all = estimates.chain(scalars.map(|scalar| (&scalar.name, scalar)));
        all.map(|(name, quantity)| (name.clone(), error(quantity)))
            .collect()
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

fn noise<'a>(
    document: &ResultDocument,
    estimates: impl Iterator<Item = &'a NoiseEstimate>,
) -> Vec<ChannelNoise> {
    let channels = document.experiments.iter().flat_map(|experiment| {
        let channels = experiment.channels.iter();
        channels.map(|channel| (experiment.name.clone(), channel))
    });
    let each = channels
        .zip(estimates)
        .map(|((experiment, channel), noise)| {
            let rows = noise.covariance.row_iter();
            ChannelNoise {
                experiment,
                channel: channel.kind.clone(),
                sigma: channel.sigma,
                correlation: channel.noise.clone(),
                partial_autocorrelations: match noise.correlation.as_ref().map(Correlation::law) {
                    Some(CorrelationLaw::Autoregressive(process)) => process.partial().to_vec(),
                    _ => Vec::new(),
                },
                noise_covariance: rows.map(|row| row.iter().copied().collect()).collect(),
                scores: noise.scores,
            }
        });
    each.collect()
}
