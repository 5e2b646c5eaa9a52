//! Fits with what is preferred to their models added, as `--select` adds it.

use kmcfit_core::assessment::{
    Doubt, Estimate, FitAssessment, VerdictLevel, estimates, verdict_reasons,
};
use kmcfit_core::candidates::Candidate;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{Fit, FitSettings, Initial, Status, fit_with_noise};

/// Most additions by `--select`.
const MOST_ADDITIONS: usize = 5;

/// A fit with its assessment.
pub struct Fitted {
    pub problem: Problem,
    pub fit: Fit,
    pub assessment: FitAssessment,
}

impl Fitted {
    pub fn of(problem: &Problem) -> Option<Self> {
        Self::with(problem, &FitSettings::default())
    }

    fn with(problem: &Problem, settings: &FitSettings) -> Option<Self> {
        let start = problem.start();
        let (problem, fit) = fit_with_noise(problem, &start, settings, &mut |_| {}).ok()?;
        (fit.outcome.status == Status::Converged).then_some(())?;
        let assessment = FitAssessment::of(&problem, &fit, true);
        Some(Self {
            problem,
            fit,
            assessment,
        })
    }

    /// The fit with what is preferred added, as `--select` adds it, and the number of additions.
    pub fn selected(problem: &Problem) -> Option<(Self, usize)> {
        let (mut now, mut problem) = (Self::of(problem)?, problem.clone());
        let settings = FitSettings {
            initial: Initial::Near,
            ..FitSettings::default()
        };
        let mut count = 0;
        while let Some(best) = now.preferred() {
            if count + best.additions.len() > MOST_ADDITIONS {
                break;
            }
            let Some(changed) = best.added_to(&problem) else {
                break;
            };
            let Some(next) = Self::with(&changed, &settings) else {
                break;
            };
            count += best.additions.len();
            (now, problem) = (next, changed);
        }
        Some((now, count))
    }

    fn preferred(&self) -> Option<Candidate> {
        self.assessment.candidates.as_ref()?.preferred().cloned()
    }

    pub fn level(&self) -> VerdictLevel {
        let reasons = verdict_reasons(&self.problem, &self.fit, Some(&self.assessment));
        let most = reasons.iter().map(Doubt::severity).max();
        VerdictLevel::of(most.unwrap_or_default())
    }

    pub fn estimate(&self, name: &str) -> Option<Estimate> {
        let all = estimates(&self.problem, &self.fit, self.assessment.quantities());
        let mut all = all.into_iter().filter(|(known, _)| known == name);
        all.next().map(|(_, estimate)| estimate)
    }

    /// Error of an estimate over half the width of its interval; `None` without one.
    pub fn error(&self, name: &str, truth: f64) -> Option<f64> {
        let estimate = self.estimate(name)?;
        let [low, high] = estimate.ci95?;
        Some((estimate.value - truth) / (0.5 * (high - low)))
    }
}
