//! Likelihood of a run, its information criteria, and likelihood-ratio tests of nested models.
//!
//! With the sum `S` of squared innovations of the `n` samples of a channel, their share `s` of the noise and an estimated sigma profiled out,
//!
//! ```text
//! -2 log L = n (ln(2 pi S/n) + 1) + 2 n ln s,      with a given sigma  J + n ln(2 pi sigma^2) + 2 n ln s,
//! AICc = -2 log L + 2 k + 2 k (k + 1)/(n - k - 1),    BIC = -2 log L + k ln n
//! ```
//!
//! for `k` parameters: those of the model, of penalised functions their effective number, and the coefficients of autoregressive noise.

use super::run::ComparedRun;
use crate::report::CostKind;
use crate::report::document::{ChannelSummary, ResultDocument};
use crate::report::parameters::{FunctionBasis, ParametersDocument};
use kmcfit_core::internals::solvers::Status;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::TAU;

/// Likelihood and criteria of one run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Likelihood {
    /// Logarithm of the likelihood, estimated sigmas profiled out.
    pub log_likelihood: f64,
    /// Number of parameters `k`.
    pub parameters: f64,
    /// Akaike information criterion, corrected for small samples.
    pub aicc: f64,
    /// Bayesian information criterion.
    pub bic: f64,
}

/// Likelihood-ratio test of a model against one that contains it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LikelihoodRatio {
    /// Name of the restricted model.
    pub restricted: String,
    /// Name of the model that contains it.
    pub general: String,
    /// Twice the difference of the logarithms of the likelihood.
    pub statistic: f64,
    /// Difference of the numbers of parameters.
    pub degrees_of_freedom: f64,
    /// Probability of at least this statistic under the restricted model, by the chi-square distribution.
    pub p_value: f64,
}

impl Likelihood {
    /// The likelihood of a run; `None` for the equation error, robust losses, and noise whose determinant the document does not have.
    pub fn of(document: &ResultDocument) -> Option<Self> {
        let is_search = !matches!(document.outcome.status, Status::Failed | Status::Infeasible);
        let is_likelihood = document.model.cost_kind != CostKind::EquationError;
        (is_search && is_likelihood).then_some(())?;
        let is_integral = document.model.cost_kind == CostKind::Integral;
        let deviances = document.channels().map(|c| deviance(c, is_integral));
        let deviance: f64 = deviances.sum::<Option<f64>>()?;
        let samples = document.channels().map(|c| c.samples).sum::<usize>() as f64;
        let k = parameters(document)?;
        let left = samples - k - 1.0;
        (deviance.is_finite() && left > 0.0).then(|| Self {
            log_likelihood: -0.5 * deviance,
            parameters: k,
            aicc: deviance + 2.0 * k + 2.0 * k * (k + 1.0) / left,
            bic: deviance + k * samples.ln(),
        })
    }
}

fn parameters(document: &ResultDocument) -> Option<f64> {
    let held = document
        .penalties
        .iter()
        .map(|penalty| Some(penalty.parameters as f64 - penalty.effective_parameters?));
    let held: f64 = held.sum::<Option<f64>>()?;
    let orders = document.channels().filter_map(|c| c.noise.as_ref());
    let orders: usize = orders.map(|noise| noise.coefficients.len()).sum();
    Some(document.model.parameters as f64 - held + orders as f64)
}

/// Minus twice the logarithm of the likelihood of a channel.
fn deviance(channel: &ChannelSummary, is_integral: bool) -> Option<f64> {
    let n = channel.samples as f64;
    let share = match &channel.noise {
        None => 1.0,
        Some(noise) if !noise.coefficients.is_empty() => noise.innovation_share,
        Some(_) => return None,
    };
    (!channel.robust && n > 0.0).then_some(())?;
    let determinant = 2.0 * n * share.ln();
    Some(match channel.sigma {
        Some(sigma) if channel.sigma_estimated => {
            n * ((TAU * sigma * sigma * channel.cost / n).ln() + 1.0) + determinant
        }
        Some(sigma) => channel.cost + n * (TAU * sigma * sigma).ln() + determinant,
        None if is_integral => n * ((TAU * channel.rms_residual.powi(2)).ln() + 1.0),
        None => channel.cost + n * TAU.ln(),
    })
}

/// Tests of all pairs of runs of which one contains the other. Penalties, which hold parameters, allow no such test.
pub(super) fn likelihood_ratios(
    runs: &[ComparedRun],
    likelihoods: &[Option<Likelihood>],
) -> Vec<LikelihoodRatio> {
    let parameters: Vec<Option<ParametersDocument>> = (runs.iter())
        .map(|run| Some(ParametersDocument::read(&run.finished.folder).ok()?.0))
        .collect();
    let mut tests = Vec::new();
    for (a, restricted) in runs.iter().enumerate() {
        for (b, general) in runs.iter().enumerate() {
            let pair = [a, b].map(|i| likelihoods[i].zip(parameters[i].as_ref()));
            let [Some((first, of_first)), Some((second, of_second))] = pair else {
                continue;
            };
            let documents = [restricted, general].map(|run| &run.finished.document);
            let is_plain = documents.iter().all(|d| d.penalties.is_empty());
            let degrees = second.parameters - first.parameters;
            if !is_plain || degrees < 1.0 || !contains(documents, [of_first, of_second]) {
                continue;
            }
            let statistic = 2.0 * (second.log_likelihood - first.log_likelihood);
            let law = ChiSquared::new(degrees);
            tests.extend(law.ok().map(|law| LikelihoodRatio {
                restricted: restricted.name.clone(),
                general: general.name.clone(),
                statistic,
                degrees_of_freedom: degrees,
                p_value: law.sf(statistic.max(0.0)),
            }));
        }
    }
    tests
}

/// True if every function of the first model is in the space of the second, whose further terms have a free coefficient.
fn contains(
    [first, second]: [&ResultDocument; 2],
    [of_first, of_second]: [&ParametersDocument; 2],
) -> bool {
    let same_terms = first
        .model
        .terms
        .iter()
        .all(|term| second.model.terms.contains(term));
    let known = |function: &FunctionBasis| {
        let name = &function.name;
        let other = of_second.functions.iter().find(|f| f.name == *name);
        let values = [first, second].map(|document| document.functions.get(name));
        let (Some(other), [Some(a), Some(b)]) = (other, values) else {
            return false;
        };
        let is_flat = a.min == a.max;
        match (function.basis.as_str(), other.basis.as_str()) {
            ("fixed", "fixed") => (a.min, a.max) == (b.min, b.max),
            (_, "fixed") => false,
            ("fixed" | "constant", _) => is_flat,
            ("polynomial", "polynomial") => function.count <= other.count,
            (one, two) if one == two => has_knots(function, other),
            _ => false,
        }
    };
    // The scalars, after the functions, are initial states and sensors.
    let scalars = |document: &ParametersDocument| -> Vec<String> {
        let functions: usize = document.functions.iter().map(|f| f.count).sum();
        document.names.iter().skip(functions).cloned().collect()
    };
    let further = scalars(of_second);
    same_terms
        && of_first.functions.iter().all(known)
        && scalars(of_first).iter().all(|name| further.contains(name))
}

fn has_knots(function: &FunctionBasis, other: &FunctionBasis) -> bool {
    let (Some(knots), Some(all)) = (&function.knots, &other.knots) else {
        return function.count == other.count;
    };
    let span = all
        .last()
        .zip(all.first())
        .map_or(0.0, |(last, first)| last - first);
    let is_there = |t: &f64| all.iter().any(|other| (t - other).abs() <= 1e-9 * span);
    knots.iter().all(is_there)
}
