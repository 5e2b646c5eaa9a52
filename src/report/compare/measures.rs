//! Compared quantities of one run.

use super::ComparedRun;
use super::likelihood::Likelihood;
use crate::report::document::level_in_words;
use kmcfit_core::assessment::{Estimate, TruthErrors, VerdictLevel};
use kmcfit_core::number_format::{resolved, significant};
use kmcfit_core::solvers::Status;
use serde::Serialize;

/// Width of an interval, relative to the estimate, below which it is not printed: samples without noise.
const EXACT: f64 = 2e-7;
/// Relative error below which the table says so.
const LEAST_ERROR: f64 = 1e-4;

/// Compared quantities of one run; `--json` prints them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measures {
    /// Name of the run in the comparison.
    pub name: String,
    /// Title of the model.
    pub title: String,
    /// Status.
    pub status: Status,
    /// Level of the verdict on the fit.
    pub verdict: Option<VerdictLevel>,
    /// Number of free parameters.
    pub parameters: usize,
    /// Part of J from the samples.
    pub misfit: f64,
    /// `J/J0`.
    pub cost_ratio: f64,
    /// Smallest fit of a channel, per cent; `null` if no channel has one.
    pub worst_fit: Option<f64>,
    /// Smallest fit of a channel of the validation records, per cent; `null` without any.
    pub validation_fit: Option<f64>,
    /// Likelihood and criteria; `null` without a likelihood.
    pub likelihood: Option<Likelihood>,
    /// BIC minus that of the best run; `null` without a likelihood, and where the runs have different records.
    pub bic_difference: Option<f64>,
    /// Natural frequency, Hz.
    pub natural_frequency: Option<Estimate>,
    /// Damping ratio.
    pub damping_ratio: Option<Estimate>,
    /// Errors relative to the true system, if known.
    pub errors: Option<TruthErrors>,
    /// Wall-clock time, s.
    pub seconds: f64,
    /// Assumptions of the model beside the records.
    pub assumptions: Vec<String>,
}

/// Headings of the table.
pub(super) const HEADINGS: [&str; 13] = [
    "model",
    "verdict",
    "parameters",
    "log-likelihood",
    "AICc",
    "BIC - best",
    "fit",
    "validation fit",
    "f_n, Hz (95 % CI)",
    "zeta (95 % CI)",
    "error of k/m",
    "error of c/m",
    "error of m",
];

impl Measures {
    /// Quantities of a run.
    pub fn of(run: &ComparedRun) -> Self {
        let document = &run.finished.document;
        let coefficients = &run.finished.coefficients;
        Self {
            name: run.name.clone(),
            title: document.title.clone(),
            status: document.outcome.status,
            verdict: document.verdict.as_ref().map(|verdict| verdict.level),
            parameters: document.model.parameters,
            misfit: document.cost.misfit,
            cost_ratio: document.cost.ratio,
            worst_fit: document.worst_fit(),
            validation_fit: (document.validation.iter().flat_map(|v| &v.channels))
                .map(|c| c.fit_percent)
                .filter(|fit| fit.is_finite())
                .reduce(f64::min),
            likelihood: Likelihood::of(document),
            bic_difference: None,
            natural_frequency: document.estimates.get("natural_frequency").cloned(),
            damping_ratio: document.estimates.get("damping_ratio").cloned(),
            errors: (run.finished.truth.as_ref())
                .map(|truth| TruthErrors::of(run.finished.system.laws(), coefficients, truth)),
            seconds: document.seconds,
            assumptions: document.identifiability.assumptions.clone(),
        }
    }

    /// Errors of k/m, c/m and m relative to those of the true system.
    fn relative_errors(&self) -> [Option<f64>; 3] {
        let errors = self.errors.as_ref();
        let all = errors.map(|e| [e.k_over_m_relative, e.c_over_m_relative, e.mass_relative]);
        all.map_or([None; 3], |errors| errors.map(Some))
    }

    /// The cells of [`HEADINGS`]; `–` for an unknown one.
    pub(super) fn row(&self) -> [String; HEADINGS.len()] {
        let or_unknown =
            |x: Option<f64>, text: &dyn Fn(f64) -> String| x.map_or_else(|| "–".to_owned(), text);
        let fixed = |x: f64| format!("{x:.1}");
        let percent = |x: f64| format!("{x:.1} %");
        let likelihood = self.likelihood;
        let parameters = likelihood.map_or(self.parameters as f64, |l| l.parameters);
        let [k, c, m] = self.relative_errors().map(|error| or_unknown(error, &size));
        [
            self.name.clone(),
            self.verdict.map_or("–", level_in_words).to_owned(),
            significant(parameters, 4),
            or_unknown(likelihood.map(|l| l.log_likelihood), &fixed),
            or_unknown(likelihood.map(|l| l.aicc), &fixed),
            or_unknown(self.bic_difference, &|d| match d == 0.0 {
                true => "0".to_owned(),
                false => format!("+{d:.1}"),
            }),
            or_unknown(self.worst_fit, &percent),
            or_unknown(self.validation_fit, &percent),
            interval(self.natural_frequency.as_ref()),
            interval(self.damping_ratio.as_ref()),
            k,
            c,
            m,
        ]
    }
}

/// A relative error as a percentage.
fn size(error: f64) -> String {
    match 100.0 * error {
        _ if error < LEAST_ERROR => "< 0.01 %".to_owned(),
        percent if !percent.is_finite() => "unbounded".to_owned(),
        percent if percent >= 1e4 => format!("a factor of {error:.0e}"),
        percent => format!("{} %", significant(percent, 2)),
    }
}

/// An estimate with its interval, to the digits of the interval.
fn interval(estimate: Option<&Estimate>) -> String {
    let Some(estimate) = estimate.filter(|e| e.value.is_finite()) else {
        return "–".into();
    };
    match estimate.ci95 {
        None => significant(estimate.value, 4),
        Some([low, high]) if (high - low).abs() <= EXACT * estimate.value.abs() => {
            significant(estimate.value, 7)
        }
        Some([low, high]) => {
            let half = 0.5 * (high - low).abs();
            let [value, low, high] = resolved([estimate.value, low, high], half);
            format!("{value} ({low} to {high})")
        }
    }
}
