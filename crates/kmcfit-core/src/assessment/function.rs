//! Summary of each coefficient function of a fit.

use super::constant_probability;
use crate::functions::basis::physical_powers;
use crate::functions::{Basis, CoefficientFunction};
use crate::identifiability::{
    Bands, ClassificationKind, FunctionClassification, is_negligible, is_unhindered,
};
use crate::number_format::number_or_nan;
use crate::problem::Problem;
use crate::solvers::{Fit, Status};
use crate::system::NodalCoefficients;
use serde::{Deserialize, Serialize};

/// Errors of the estimates of a fit.
#[derive(Debug, Clone, Copy)]
pub struct EstimateErrors<'a> {
    /// Bands and covariance, where standard errors are meaningful.
    pub bands: Option<&'a Bands>,
    /// Classification of functions and ratios, functions first.
    pub classifications: &'a [FunctionClassification],
    /// Effective number of parameters of the function of each penalty, where there are penalties.
    pub effective_parameters: Option<&'a [f64]>,
    /// True if residuals that may be noise permit the test of a constant.
    pub tests_constants: bool,
}

/// Largest distance from an active bound, relative to its scale.
const NEAR: f64 = 1e-6;

/// One function at the best point.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FunctionSummary {
    /// SI unit, that of a translation unless replaced.
    #[serde(default)]
    pub unit: String,
    /// Smallest value at a node.
    #[serde(deserialize_with = "number_or_nan")]
    pub min: f64,
    /// Largest value at a node.
    #[serde(deserialize_with = "number_or_nan")]
    pub max: f64,
    /// For a polynomial the coefficients `a_0, a_1, ...` of `sum_i a_i t^i`, `t` in s as in the file, `a_i` in the unit of the
    /// function per s^i.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub powers: Option<Vec<f64>>,
    /// True if the function is zero to machine precision, relative to its natural scale.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub negligible: bool,
    /// True if the model fixes the function.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub fixed: bool,
    /// True for a constant at one of its bounds.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub at_bound: bool,
    /// Classification: `identified`, `only-ratio`, `partly-identified`, `not-identified` or `fixed`; for models with few parameters
    /// and meaningful standard errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<ClassificationKind>,
    /// Smallest and largest value over the nodes where the function is identified, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identified_range: Option<[f64; 2]>,
    /// Standard error of a constant from the linearised fit, without constraints, penalties and priors, where the samples determine
    /// all parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub standard_error: Option<f64>,
    /// Degrees of freedom of the t distribution of the estimate of a constant, where its noise was estimated with it; the normal
    /// distribution otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub degrees_of_freedom: Option<f64>,
    /// p-value of a constant function under noise alone, for a converged least-squares fit with residuals compatible with noise, whose
    /// samples alone determine all parameters, or penalties with weights chosen by restricted likelihood or cross-validation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub constant_p_value: Option<f64>,
    /// Largest error over the nodes, where the truth is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth_max_error: Option<f64>,
    /// Root-mean-square error over the nodes, where the truth is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth_rms_error: Option<f64>,
}

/// True if a bound of this parameter alone is active.
fn is_at_bound(problem: &Problem, theta: &[f64], parameter: usize) -> bool {
    problem.constraints.groups.iter().any(|group| {
        (0..group.rows.len()).any(|i| {
            let [low, high] = group.bounds(i);
            group.single(i).is_some_and(|(p, _)| p == parameter)
                && low < high
                && group.relative_violation(i, theta) >= -NEAR
        })
    })
}

/// Summaries of the functions of a fit, in their order; `truth` is the true system, where known.
pub fn function_summaries(
    problem: &Problem,
    fit: &Fit,
    errors: Option<EstimateErrors>,
    truth: Option<&NodalCoefficients>,
) -> Vec<FunctionSummary> {
    let theta = &fit.best.parameters;
    let sizes = problem.natural_scales(&fit.best.evaluation);
    let is_white = errors.is_some_and(|e| e.tests_constants);
    let is_minimum = fit.outcome.status == Status::Converged;
    let bands = errors.and_then(|e| e.bands);
    let covariance = bands.and_then(|bands| bands.covariance.as_ref());
    let free = covariance.filter(|_| is_white && is_minimum && is_unhindered(problem, theta));
    let values = problem.functions.values(theta);
    let functions = problem.functions.iter().zip(&values).enumerate();
    let summary = |(i, (function, values)): (usize, (&CoefficientFunction, &Vec<f64>))| {
        let range = problem.functions.ranges()[i].clone();
        // Classifications of the functions come first, in their order.
        let judged = errors.and_then(|e| e.classifications.get(i));
        let largest = values.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let truth = truth.and_then(|truth| truth.functions().nth(i));
        let differences = truth.map(|truth| -> Vec<f64> {
            let pairs = values.iter().zip(truth);
            pairs.map(|(a, b)| (a - b).abs()).collect()
        });
        let differences = differences.as_ref();
        let rms = |e: &Vec<f64>| (e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt();
        // Zero but for rounding where an equality holds the constant.
        let estimate = bands
            .filter(|_| covariance.is_some() && function.basis == Some(Basis::Constant))
            .map(|bands| &bands.quantities.functions[i])
            .filter(|estimate| estimate.standard_error > f64::EPSILON * largest);
        FunctionSummary {
            unit: function.quantity.unit().into(),
            min: values.iter().copied().fold(f64::INFINITY, f64::min),
            max: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            negligible: largest > 0.0 && is_negligible(largest, sizes[i]),
            fixed: function.basis.is_none(),
            at_bound: function.parameters() == 1 && is_at_bound(problem, theta, range.start),
            verdict: judged.map(|j| j.verdict.kind()),
            identified_range: judged.and_then(|j| j.identified_range),
            powers: match &function.basis {
                Some(Basis::Polynomial { .. }) => {
                    Some(physical_powers(&problem.system.grid, &theta[range.clone()]))
                }
                _ => None,
            },
            standard_error: estimate.map(|estimate| estimate.standard_error),
            degrees_of_freedom: (estimate.map(|estimate| estimate.degrees))
                .filter(|degrees| degrees.is_finite()),
            constant_p_value: free.and_then(|covariance| {
                let effective = effective(problem, i, errors);
                constant_probability(problem, i, theta, covariance, effective)
            }),
            truth_max_error: differences.map(|e| e.iter().copied().fold(0.0, f64::max)),
            truth_rms_error: differences.map(rms),
        }
    };
    functions.map(summary).collect()
}

/// Effective number of parameters of a penalised function.
fn effective(problem: &Problem, f: usize, errors: Option<EstimateErrors>) -> Option<f64> {
    let effective = errors?.effective_parameters?;
    let mut penalties = problem.penalties.iter().zip(effective);
    penalties
        .find(|(p, _)| p.function == f)
        .map(|(_, effective)| *effective)
}
