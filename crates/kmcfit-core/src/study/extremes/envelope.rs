//! Envelopes of all coefficient functions and of `k/m` and `c/m`: smallest and largest values compatible with the data.

use super::{Extreme, ExtremePair, ExtremeStatus, MisfitLimit, extreme_pairs, values_at};
use crate::diagnostics::chi_square_one;
use crate::functions::Ratio;
use crate::identifiability::{Curve, Target};
use crate::objective::{Evaluation, channel_fit_percent};
use crate::problem::Problem;

/// Largest roughness of a system in an envelope, as a multiple of the optimum's.
const BUDGET: f64 = 2.0;
/// Fit, per cent, from which residuals are rounding errors.
const ROUNDED: f64 = 100.0 - 1e-7;
/// A misfit above this share of the limit counts as equal to the limit.
const AT_LEVEL: f64 = 0.999;

/// The extremes of one function or ratio at several times.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelope {
    /// Name of the function or ratio.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// The extremes at each time.
    pub bands: Vec<ExtremePair>,
}

impl MisfitLimit {
    /// The requested misfit limit, or that of a confidence level, with limits of roughness for each penalty of the fit.
    pub fn at(
        problem: &Problem,
        theta: &[f64],
        evaluation: &Evaluation,
        asked: Option<f64>,
        confidence: f64,
    ) -> Self {
        let quantile = chi_square_one(confidence);
        let has_sigma = problem.channels().all(|c| c.weighting().is_sigma());
        let mut level = Self::of(asked.unwrap_or_else(|| match has_sigma {
            true => evaluation.misfit + quantile,
            // The profile statistic `n ln J` rises by the quantile.
            false => evaluation.misfit * (quantile / problem.sample_count() as f64).exp(),
        }));
        level.budgets = (problem.penalties.iter())
            .map(|penalty| {
                let range = problem.functions.ranges()[penalty.function].clone();
                let now = penalty.roughness(&theta[range]);
                (penalty.clone(), BUDGET * now.max(f64::MIN_POSITIVE))
            })
            .collect();
        level
    }
}

/// True if the misfit and the roughness of an optimum are rounding errors, so that no limit of the misfit follows from them: samples without
/// sigma that the response matches to machine precision, and a penalty on every estimated function.
pub fn is_within_rounding(problem: &Problem, evaluation: &Evaluation) -> bool {
    let fits = problem.predicted(evaluation);
    let mut fits = fits.map(|(channel, predicted)| {
        (
            channel.weighting().sigma(0).is_some(),
            channel_fit_percent(channel, predicted),
        )
    });
    let is_exact = fits.all(|(has_sigma, fit)| !has_sigma && fit >= ROUNDED);
    let functions = &problem.functions;
    let mut estimated =
        (0..functions.ranges().len()).filter(|f| functions.get(*f).parameters() > 0);
    is_exact && estimated.all(|f| problem.penalties.iter().any(|p| p.function == f))
}

impl Extreme {
    /// Status of the search; a search without a feasible step whose misfit equals the limit has converged.
    pub fn ended_at(&self, level: &MisfitLimit) -> ExtremeStatus {
        match self.ended {
            ExtremeStatus::NoFeasibleStep if self.misfit >= AT_LEVEL * level.misfit => {
                ExtremeStatus::Converged
            }
            ended => ended,
        }
    }
}

/// Envelopes of all estimated functions and of k/m and c/m at `times` (s); empty where the optimum violates the misfit limit
/// or the constraints.
pub fn envelopes(
    problem: &Problem,
    theta: &[f64],
    level: &MisfitLimit,
    times: &[f64],
    threads: usize,
) -> Vec<Envelope> {
    let set = problem.functions.coefficient_set(0);
    let free = (set.iter()).filter(|f| problem.functions.get(**f).parameters() > 0);
    let mut curves: Vec<Curve> = free.map(|f| Curve::Function(*f)).collect();
    // Of sums with known parts the functions alone.
    if set.known_parts().is_empty() {
        let ratios = [Ratio::StiffnessOverMass, Ratio::DampingOverMass];
        curves.extend(ratios.map(Curve::Ratio));
    }
    let jobs = curves.into_iter().filter_map(|curve| {
        let terms = curve.terms(problem)?;
        Some((terms.name, terms.unit, values_at(problem, curve, times)))
    });
    let jobs: Vec<_> = jobs.collect();
    // One list of searches, so that the threads have work to the end.
    let all: Vec<Target> = jobs
        .iter()
        .flat_map(|(.., targets)| targets.clone())
        .collect();
    let found = extreme_pairs(problem, &[theta.to_vec()], &all, level, threads);
    let Some(mut found) = found.map(Vec::into_iter) else {
        return Vec::new();
    };
    let envelopes = jobs.into_iter().map(|(name, unit, targets)| Envelope {
        name,
        unit,
        bands: found.by_ref().take(targets.len()).collect(),
    });
    envelopes.collect()
}
