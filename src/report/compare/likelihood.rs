//! Likelihood of a run and its information criteria.
//!
//! With the sum `S` of squared innovations of the `n` samples of a channel, their share `s` of the noise and an estimated sigma profiled out,
//!
//! ```text
//! -2 log L = n (ln(2 pi S/n) + 1) + 2 n ln s,      with a given sigma  J + n ln(2 pi sigma^2) + 2 n ln s,
//! AICc = -2 log L + 2 k + 2 k (k + 1)/(n - k - 1),    BIC = -2 log L + k ln n
//! ```
//!
//! for `k` parameters: those of the model, of penalised functions their effective number, and the coefficients of autoregressive noise.

use crate::report::CostKind;
use crate::report::document::{ChannelSummary, ResultDocument};
use kmcfit_core::solvers::Status;
use serde::Serialize;
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
