//! Reasons of the verdict on a fit in words, each a clause of one line.

use super::document::{Estimates, Verdict};
use super::fit_assessment::ValidationRecord;
use super::ratios;
use super::run::FittedModel;
use kmcfit_core::assessment::{
    Doubt, Estimate, EstimateStatus, Implausible, VerdictLevel, estimates, verdict_assumptions,
    verdict_reasons,
};
use kmcfit_core::diagnostics::{SIGNIFICANCE, standard_deviation};
use kmcfit_core::finding::Finding;
use kmcfit_core::finding::Severity;
use kmcfit_core::functions::Ratio;
use kmcfit_core::number_format::significant;
use kmcfit_core::solvers::{EquationBalance, Status};

impl FittedModel<'_> {
    /// Verdict on the fit: reasons from its assessment, the data and the validation records.
    pub(super) fn verdict(&self) -> Verdict {
        let problem = &self.model.problem;
        let assessment = self.run_assessment.assessment.as_ref();
        let mut reasons = verdict_reasons(problem, self.fit, assessment);
        let missing = self.run_assessment.missing_terms.iter();
        reasons.extend(missing.map(|term| Doubt::MissingTerm(*term)));
        if self.model.has_unknown_mass {
            // Ratios are what is reported.
            reasons.retain(|reason| !matches!(reason, Doubt::OnlyRatios));
        }
        // Codes in place of samples are no motion.
        let warnings = &self.model.warnings;
        let is_code = |doubt: &Doubt| matches!(doubt, Doubt::MissingCodes { .. });
        let has_codes = self.model.doubts().any(is_code);
        let implausible = self.implausible().filter(|_| !has_codes);
        reasons.extend(implausible.map(Doubt::ImplausibleUnits));
        let balance = self.run_assessment.balance.as_ref();
        match self.run_assessment.lacks_force {
            true => reasons.push(Doubt::UnmeasuredForce),
            false => reasons.extend(balance.and_then(of_balance)),
        }
        reasons.extend(self.coarse_inputs());
        reasons.extend(self.delays_at_limits());
        let not_done = &self.run_assessment.not_done;
        reasons.extend((!not_done.is_empty()).then(|| Doubt::Stopped {
            not_done: not_done.clone(),
        }));
        let validation = self.run_assessment.validation.iter();
        reasons.extend(validation.filter_map(ValidationRecord::poor));
        let outcome = &self.fit.outcome;
        let in_words = |reason: Doubt| match reason {
            // The end of the search has its own reason.
            Doubt::Failed { status } | Doubt::NotConverged { status } => {
                let sentence = format!("{}: {}", status.name(), outcome.reason);
                Finding {
                    sentence,
                    ..Finding::from(reason)
                }
            }
            Doubt::RankDeficient { .. } if !problem.penalties.is_empty() => {
                let mut finding = Finding::from(reason);
                finding.sentence +=
                    " from the samples; penalties and constraints determine the others";
                finding
            }
            _ => reason.into(),
        };
        let mut reasons: Vec<Finding> = reasons.into_iter().map(in_words).collect();
        // What the fit shows as well has its own reason.
        let is_shown = |of_data: &Doubt| {
            let mut shown = reasons.iter().filter_map(|reason| reason.doubt.as_ref());
            shown.any(|shown| match (shown, of_data) {
                (Doubt::SecondMode { .. }, Doubt::SecondMode { .. }) => true,
                _ => shown == of_data,
            })
        };
        let of_data = warnings.iter().filter(|w| w.severity >= Severity::Check);
        let of_data = of_data.filter(|w| !w.doubt.as_ref().is_some_and(is_shown));
        let of_data: Vec<Finding> = of_data.cloned().collect();
        reasons.extend(of_data);
        reasons.sort_by_key(|reason| std::cmp::Reverse(reason.severity));
        let most = reasons.iter().map(|reason| reason.severity).max();
        let level = VerdictLevel::of(most.unwrap_or_default());
        let assumptions = match level {
            VerdictLevel::Inadequate => Vec::new(),
            _ => verdict_assumptions(problem),
        };
        Verdict {
            level,
            assumptions: (self.model.assumptions().chain(assumptions))
                .map(Finding::from)
                .collect(),
            passed: match reasons.is_empty() {
                true => self.passed(),
                false => String::new(),
            },
            reasons,
        }
    }

    /// Inputs whose quantisation error, relative to the input, is not small beside the residuals, relative to the samples: intervals do not
    /// contain it.
    fn coarse_inputs(&self) -> impl Iterator<Item = Doubt> {
        let problem = &self.model.problem;
        let noise = move |name: &str| {
            let of_record = problem.experiments.iter().position(|e| e.name == name)?;
            let predictions = &self.fit.best.evaluation.predictions[of_record];
            let channels = problem.experiments[of_record].channels.iter();
            let shares = channels.zip(predictions).map(|(channel, predicted)| {
                let residuals: Vec<f64> = channel.residuals(predicted).collect();
                standard_deviation(&residuals) / standard_deviation(channel.observed())
            });
            shares.reduce(f64::min)
        };
        self.model.doubts().filter_map(move |doubt| match doubt {
            Doubt::CoarseInput {
                experiment, share, ..
            } => {
                let error_is_stated = (problem.experiments.iter())
                    .any(|e| e.name == *experiment && e.input_error.is_some());
                let is_coarse = !error_is_stated && *share > COARSE * noise(experiment)?;
                is_coarse.then(|| doubt.clone())
            }
            _ => None,
        })
    }

    /// Estimated delays beyond their limits, where samples at the ends of the record are compared with its first or last node.
    fn delays_at_limits(&self) -> impl Iterator<Item = Doubt> {
        let values = &self.fit.best.evaluation.scalars;
        let scalars = self.model.problem.functions.scalars().iter().zip(values);
        let limit = |name: &str| {
            let mut limits = self.model.delay_limits.iter();
            limits.find(|l| l.parameter == name).map(|l| l.range)
        };
        scalars.filter_map(move |(scalar, value)| {
            let [least, most] = limit(&scalar.name)?;
            let is_outside = !(least..=most).contains(value);
            is_outside.then(|| Doubt::DelayAtLimit {
                parameter: scalar.name.clone(),
            })
        })
    }

    /// A quantity outside the range of mechanical systems, where the fit identifies a system.
    fn implausible(&self) -> Option<Implausible> {
        let assessment = self.run_assessment.assessment.as_ref()?;
        let is_system = assessment.plausibility.unidentified.is_none();
        let estimates = is_system.then(|| self.estimates())?;
        let mut all = estimates.0.iter();
        let frequency = all.find(|(name, _)| name == "natural_frequency")?.1.value;
        // A system without a spring has none.
        let frequency = if frequency == 0.0 {
            f64::NAN
        } else {
            frequency
        };
        let largest = |list: &[f64]| list.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let responses = self.fit.best.evaluation.trajectories.iter();
        let response = responses.fold([0.0f64; 2], |most, response| {
            [
                most[0].max(largest(response.displacement(0))),
                most[1].max(largest(response.velocity(0))),
            ]
        });
        Implausible::of(frequency, (!self.is_rotation()).then_some(response))
    }

    /// Autocorrelation of the residuals that is no reason of the verdict.
    fn autocorrelation(&self) -> String {
        let tests = self.run_assessment.diagnostics.iter().flatten();
        let least = tests
            .map(|found| found.whiteness.p_value)
            .fold(1.0, f64::min);
        match least < SIGNIFICANCE {
            true => format!(
                "weak autocorrelation of the residuals (p = {})",
                significant(least, 2)
            ),
            false => "no significant autocorrelation of the residuals".to_owned(),
        }
    }

    /// The tests that a fit without reasons passed.
    fn passed(&self) -> String {
        let problem = &self.model.problem;
        let orders = problem.channels().filter_map(|c| c.correlation());
        let order = orders.map(|correlation| correlation.order()).max();
        let noise = match order {
            Some(order) if order > 0 => format!(" (AR({order}) noise model)"),
            _ => String::new(),
        };
        let residuals = match problem.channels().all(|c| c.weighting().is_sigma()) {
            true => vec![self.autocorrelation() + &noise],
            false => Vec::new(),
        };
        let assessment = self.run_assessment.assessment.as_ref();
        let candidates = assessment.and_then(|a| a.candidates.as_ref());
        let step_size = self.run_assessment.step_check();
        let step_size = step_size.map(|_| "step-size check passed".to_owned());
        let candidates = candidates.map(|_| "no candidate is preferred to the model".to_owned());
        let parts = residuals.into_iter().chain(step_size).chain(candidates);
        let parts: Vec<String> = parts.collect();
        parts.join("; ")
    }

    /// Estimates of the fit, with an unknown mass as ratios to it; none where it failed.
    pub(super) fn estimates(&self) -> Estimates {
        let all = self.all_estimates().iter().cloned();
        let stated = all.filter_map(|(name, mut estimate)| {
            if self.model.has_unknown_mass && estimate.status == EstimateStatus::OnlyAsRatio {
                estimate.status = EstimateStatus::Estimated;
            }
            Some((self.stated_name(&name)?, estimate))
        });
        Estimates(stated.collect())
    }

    /// Name under which an estimate is stated: with an unknown mass that of the ratio to it, and `None` for the mass itself.
    pub(super) fn stated_name(&self, name: &str) -> Option<String> {
        match self.model.has_unknown_mass && !is_ratio(name) {
            true => ratios::name(name),
            false => Some(name.to_owned()),
        }
    }

    /// Estimates of the fit with the names of the core.
    pub(super) fn all_estimates(&self) -> &[(String, Estimate)] {
        (self.computed.estimates).get_or_init(|| self.compute_estimates())
    }

    fn compute_estimates(&self) -> Vec<(String, Estimate)> {
        let status = self.fit.outcome.status;
        if matches!(status, Status::Failed | Status::Infeasible) {
            return Vec::new();
        }
        let problem = &self.model.problem;
        let mut found = estimates(problem, self.fit, self.run_assessment.quantities());
        for ((_, estimate), function) in (found.iter_mut())
            .filter(|(name, _)| !is_ratio(name))
            .zip(problem.functions.iter())
        {
            self.unit(function).clone_into(&mut estimate.unit);
        }
        if self.run_assessment.lacks_force {
            let is_damping = |name: &str| matches!(name, "damping" | "damping_ratio" | "c_over_m");
            for (_, estimate) in found.iter_mut().filter(|(name, _)| is_damping(name)) {
                estimate.value = f64::NAN;
                estimate.range = None;
                estimate.status = EstimateStatus::NotIdentifiable;
            }
        }
        found
    }
}

/// Quantisation error of an input, relative to the residuals, above which it is not small.
const COARSE: f64 = 0.25;

/// Smallest share of the largest force that is a large residual of the equation of motion.
const LARGE_RESIDUAL: f64 = 0.3;

/// Reason from the residual of the equation of motion.
fn of_balance(balance: &EquationBalance) -> Option<Doubt> {
    let shares = balance.parts.iter().map(|part| part.residual_share);
    let share = shares.fold(f64::INFINITY, f64::min);
    let is_large = share.is_finite() && share > LARGE_RESIDUAL;
    is_large.then_some(Doubt::EquationResidual { share })
}

/// True for the ratios among the estimates.
fn is_ratio(name: &str) -> bool {
    Ratio::named(name).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kmcfit_core::solvers::{EquationForm, EquationShare};

    #[test]
    fn a_residual_is_judged_beside_the_largest_force() {
        let reason = |residual: f64| {
            let share = |part: &str, rms| EquationShare {
                part: part.to_owned(),
                rms,
                residual_share: residual / rms,
            };
            of_balance(&EquationBalance {
                form: EquationForm::Weak,
                bump_lengths: Vec::new(),
                residual_rms: residual,
                parts: vec![share("damping", 5.0), share("inertia", 100.0)],
            })
        };
        // More than the damping, but a tenth of the inertia.
        assert_eq!(reason(10.0), None);
        let large = Doubt::EquationResidual { share: 0.48 };
        assert_eq!(reason(48.0), Some(large));
    }
}
