//! Reasons of the verdict on a fit in words, each a clause of one line.

use super::document::{Estimates, Verdict};
use super::fit_assessment::ValidationRecord;
use super::model_assumptions::{assumed_units, unknown_mass};
use super::ratios;
use super::rivals::rival_in_words;
use super::run::FittedModel;
use super::suggestions::percent;
use super::text::and_list;
use crate::finding::Finding;
use crate::number_format::{significant, times_in_words};
use kmcfit_core::internals::assessment::{
    Estimate, EstimateStatus, Implausible, SampleFault, VerdictAssumption, VerdictLevel,
    VerdictReason, estimates, verdict_assumptions, verdict_level, verdict_reasons,
};
use kmcfit_core::internals::diagnostics::standard_deviation;
use kmcfit_core::internals::solvers::{EquationBalance, Status};
use std::collections::BTreeMap;

/// Kinds of the warnings on what a file states of units and scales.
const STATED_UNITS: [&str; 4] = [
    "scale_not_applied",
    "unknown_unit",
    "unit_of_name_unused",
    "volts",
];
/// Kinds of the warnings that show a wrong unit by the samples.
const DOUBTFUL_UNITS: [&str; 4] = [
    "implausible_magnitudes",
    "mains_hum",
    "suspicious_factor",
    "suspicious_mass",
];

impl FittedModel<'_> {
    /// Verdict on the fit: reasons from its assessment, the data and the validation records.
    pub(super) fn verdict(&self) -> Verdict {
        let problem = &self.model.problem;
        let assessment = self.run_assessment.assessment.as_ref();
        let mut reasons = verdict_reasons(problem, self.fit, assessment);
        let missing = self.run_assessment.missing_terms.iter();
        reasons.extend(missing.map(|term| VerdictReason::MissingTerm(*term)));
        if self.model.has_unknown_mass {
            // Ratios are what is reported.
            reasons.retain(|reason| !matches!(reason, VerdictReason::OnlyRatios));
        }
        // Codes in place of samples are no motion.
        let warnings = &self.model.warnings;
        let has_codes = warnings.iter().any(|w| w.kind == "missing_codes");
        let implausible = self.implausible().filter(|_| !has_codes);
        reasons.extend(implausible.map(VerdictReason::ImplausibleUnits));
        let has_units = |r: &VerdictReason| matches!(r, VerdictReason::ImplausibleUnits(_));
        // Implausible magnitudes are a reason already; what the file states is one in any case.
        let doubtful = |kinds: &[&str]| -> Vec<&str> {
            let of_kind = warnings.iter().filter(|w| kinds.contains(&w.kind.as_str()));
            let texts = of_kind.filter_map(|w| Some(w.text.split_once(": ")?.1));
            texts.collect()
        };
        let mut doubts = doubtful(&STATED_UNITS);
        doubts.dedup();
        if doubts.is_empty() && !reasons.iter().any(has_units) {
            doubts = doubtful(&DOUBTFUL_UNITS);
            doubts.truncate(1);
        }
        if !doubts.is_empty() {
            reasons.push(VerdictReason::DoubtfulUnits);
        }
        let balance = self.run_assessment.balance.as_ref();
        match self.run_assessment.lacks_force {
            true => reasons.push(VerdictReason::UnmeasuredForce),
            false => reasons.extend(balance.and_then(of_balance)),
        }
        let has_mode = |r: &VerdictReason| matches!(r, VerdictReason::SecondMode { .. });
        if !reasons.iter().any(has_mode) {
            reasons.extend(warnings.iter().find_map(two_modes));
        }
        reasons.extend(warnings.iter().filter_map(repeated_record));
        let faults: BTreeMap<String, VerdictReason> = (warnings.iter())
            .filter_map(faulty_samples)
            .map(|reason| (format!("{reason:?}"), reason))
            .collect();
        let is_stated = |reason: &VerdictReason| match reason {
            VerdictReason::Saturation { channel } => reasons.iter().any(
                |r| matches!(r, VerdictReason::Saturation { channel: other } if other == channel),
            ),
            _ => false,
        };
        let faults: Vec<VerdictReason> = faults.into_values().filter(|r| !is_stated(r)).collect();
        reasons.extend(faults);
        reasons.extend(self.coarse_inputs());
        reasons.extend(self.delays_at_limits());
        let poor = self.run_assessment.validation.iter();
        let poor = poor.filter_map(ValidationRecord::poor);
        reasons.extend(poor.map(|(name, fit_percent)| VerdictReason::NotPredicted {
            experiment: name.to_owned(),
            fit_percent,
        }));
        reasons.sort_by_key(|reason| std::cmp::Reverse(reason.level()));
        let outcome = &self.fit.outcome;
        let in_words = |reason: &VerdictReason| match reason {
            // The end of the search has its own reason.
            VerdictReason::Failed { status } | VerdictReason::NotConverged { status } => {
                Finding::of(reason, format!("{}: {}", status.name(), outcome.reason))
            }
            VerdictReason::RankDeficient { .. } if !problem.penalties.is_empty() => {
                let mut finding = reason_in_words(reason);
                finding.text += " from the samples; penalties and constraints determine the others";
                finding
            }
            VerdictReason::DoubtfulUnits => {
                let mut finding = reason_in_words(reason);
                finding.text = doubts.join("; ");
                finding
            }
            _ => reason_in_words(reason),
        };
        let level = verdict_level(&reasons);
        let assumptions = match level {
            VerdictLevel::Inadequate => Vec::new(),
            _ => verdict_assumptions(problem),
        };
        let stated = [unknown_mass(self.model), assumed_units(self.model)];
        Verdict {
            level,
            assumptions: (stated.into_iter().flatten())
                .chain(assumptions.iter().map(assumption))
                .collect(),
            reasons: reasons.iter().map(in_words).collect(),
            passed: match reasons.is_empty() {
                true => self.passed(),
                false => String::new(),
            },
        }
    }

    /// Inputs whose quantisation error, relative to the input, is not small beside the residuals, relative to the samples: intervals do not
    /// contain it.
    fn coarse_inputs(&self) -> impl Iterator<Item = VerdictReason> {
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
        self.model.data.iter().filter_map(move |fact| {
            let is_input = fact.kind == "quantisation" && fact.said("action")? == "used";
            let share = fact.number("share").filter(|_| is_input)?;
            let (experiment, channel) = (fact.said("experiment")?, fact.said("channel")?);
            let is_input = !problem.channels().any(|c| c.kind().name() == channel);
            let error_is_stated = (problem.experiments.iter())
                .any(|e| e.name == experiment && e.input_error.is_some());
            let is_coarse = is_input && !error_is_stated && share > COARSE * noise(&experiment)?;
            is_coarse.then_some(VerdictReason::FaultySamples {
                experiment,
                channel,
                fault: SampleFault::CoarseInput,
            })
        })
    }

    /// Estimated delays beyond their limits, where samples at the ends of the record are compared with its first or last node.
    fn delays_at_limits(&self) -> impl Iterator<Item = VerdictReason> {
        let values = &self.fit.best.evaluation.scalars;
        let scalars = self.model.problem.functions.scalars().iter().zip(values);
        let limit = |name: &str| {
            let mut limits = self.model.delay_limits.iter();
            limits.find(|l| l.parameter == name).map(|l| l.range)
        };
        scalars.filter_map(move |(scalar, value)| {
            let [least, most] = limit(&scalar.name)?;
            let is_outside = !(least..=most).contains(value);
            is_outside.then(|| VerdictReason::DelayAtLimit {
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
            true => vec![format!(
                "no significant autocorrelation of the residuals{noise}"
            )],
            false => Vec::new(),
        };
        let assessment = self.run_assessment.assessment.as_ref();
        let tests = assessment.map(|a| &a.model_tests);
        let checks = [
            (self.run_assessment.step_check().is_some(), "step-size"),
            (tests.is_some_and(|t| !t.bases.is_empty()), "refinement"),
            (
                tests.is_some_and(|t| !t.extensions.is_empty()),
                "missing-term",
            ),
        ];
        let names = checks.iter().filter(|(is_done, _)| *is_done);
        let names: Vec<String> = names.map(|(_, name)| (*name).to_owned()).collect();
        let checks = match names.as_slice() {
            [] => None,
            [only] => Some(format!("{only} check passed")),
            several => Some(format!("{} checks passed", and_list(several))),
        };
        let parts: Vec<String> = residuals.into_iter().chain(checks).collect();
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
        let mut found = estimates(problem, self.fit, self.run_assessment.means().as_ref());
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
fn of_balance(balance: &EquationBalance) -> Option<VerdictReason> {
    let shares = balance.parts.iter().map(|part| part.residual_share);
    let share = shares.fold(f64::INFINITY, f64::min);
    let is_large = share.is_finite() && share > LARGE_RESIDUAL;
    is_large.then_some(VerdictReason::EquationResidual { share })
}

/// True for the ratios among the estimates.
fn is_ratio(name: &str) -> bool {
    matches!(
        name,
        "natural_frequency" | "damping_ratio" | "k_over_m" | "c_over_m"
    )
}

/// Second mode from a warning about the data.
fn two_modes(warning: &Finding) -> Option<VerdictReason> {
    (warning.kind == "two_modes").then_some(())?;
    let frequencies = warning.quantities.get("frequencies")?.as_array()?;
    let frequencies: Vec<f64> = frequencies.iter().filter_map(|f| f.as_f64()).collect();
    Some(VerdictReason::SecondMode {
        frequencies: frequencies.try_into().ok()?,
    })
}

/// A record that is listed twice, from a warning about the data.
fn repeated_record(warning: &Finding) -> Option<VerdictReason> {
    (warning.kind == "repeated_record").then_some(())?;
    Some(VerdictReason::RepeatedRecord {
        experiment: warning.said("experiment")?,
        other: warning.said("other")?,
    })
}

/// Faulty samples from a warning about the data.
fn faulty_samples(warning: &Finding) -> Option<VerdictReason> {
    let text = |name: &str| warning.said(name);
    let fault = match warning.kind.as_str() {
        "saturation" => {
            let channel = text("channel")?;
            return Some(VerdictReason::Saturation { channel });
        }
        "missing_codes" => {
            let channels = warning.quantities.get("channels")?.as_array()?;
            return Some(VerdictReason::FaultySamples {
                experiment: text("experiment")?,
                channel: channels.first()?.as_str()?.to_owned(),
                fault: SampleFault::MissingCodes,
            });
        }
        "dropouts" => SampleFault::Dropouts,
        "spikes" | "outliers" => SampleFault::Spikes,
        "input_gaps" => SampleFault::InputGaps,
        _ => return None,
    };
    Some(VerdictReason::FaultySamples {
        experiment: text("experiment")?,
        channel: text("channel")?,
        fault,
    })
}

/// A reason as a clause.
pub fn reason_in_words(reason: &VerdictReason) -> Finding {
    let text = match reason {
        VerdictReason::Failed { status } => format!("the fit ended {}", status.name()),
        VerdictReason::NoSystem { reason } => super::findings::unidentified(reason).text,
        VerdictReason::PoorFit { fit_percent } => format!(
            "fit {}: the residuals are large and autocorrelated",
            percent(*fit_percent, 0)
        ),
        VerdictReason::BeyondSigma { times } => {
            format!("the residuals are {} times sigma", times_in_words(*times))
        }
        VerdictReason::CoarseSteps { times } => format!(
            "the error of the time steps is {} times the residuals",
            times_in_words(*times)
        ),
        VerdictReason::NotConverged { status } => {
            format!("the fit ended before it converged ({})", status.name())
        }
        VerdictReason::MissingTerm(missing) => format!(
            "the residuals show {} that the model does not have",
            missing.term.row().words
        ),
        VerdictReason::TimeOrAmplitude(rival) => rival_in_words(rival),
        VerdictReason::ResidualMean {
            experiment,
            channel,
        } => format!("the residuals of the {channel} of {experiment} have a mean"),
        VerdictReason::FrictionWidth { estimate, is_small } => match is_small {
            true => "a larger width of Coulomb friction fits better".to_owned(),
            false => format!("the {estimate} depends on the width of Coulomb friction"),
        },
        VerdictReason::SecondMode {
            frequencies: [first, second],
        } => format!(
            "the record has a second mode at {} Hz beside that at {} Hz",
            significant(*second, 3),
            significant(*first, 3)
        ),
        VerdictReason::RecordError(error) => super::findings::record_error(error),
        VerdictReason::ClassicalDisagrees(estimate) => super::findings::classical(estimate),
        VerdictReason::Saturation { channel } => {
            format!("the {channel} saturates: many samples equal the largest one")
        }
        VerdictReason::RepeatedRecord { experiment, other } => {
            format!("{experiment} has the samples of {other}, which the intervals count twice")
        }
        VerdictReason::FaultySamples {
            experiment,
            channel,
            fault,
        } => match fault {
            SampleFault::Dropouts => {
                format!(
                    "the {channel} of {experiment} is held at a constant value in part (dropouts)"
                )
            }
            SampleFault::MissingCodes => format!(
                "the {channel} of {experiment} has values that stand for missing samples (`missing`)"
            ),
            SampleFault::Spikes => format!("the {channel} of {experiment} has spikes"),
            SampleFault::CoarseInput => format!(
                "the quantisation error of the {channel} of {experiment} is not small beside the residuals"
            ),
            SampleFault::InputGaps => {
                format!("the {channel} of {experiment} has gaps, across which it is interpolated")
            }
        },
        VerdictReason::DelayAtLimit { parameter } => {
            format!("the {parameter} is beyond its limits")
        }
        VerdictReason::DisturbedInput { experiment, .. } => format!(
            "a disturbance enters through the equation of motion of {experiment}: force sensor, unmeasured drive or missing term"
        ),
        VerdictReason::CoherentResiduals {
            channel,
            input,
            share,
        } => format!(
            "{} of the variance of the {channel}'s residuals is coherent with the {}: dynamics are missing from the model",
            percent(100.0 * share, 0),
            input.name().replace('_', " ")
        ),
        VerdictReason::ContradictedInputSigma { experiment, input } => format!(
            "the residuals contradict the stated sigma of the {} of {experiment}",
            input.name().replace('_', " ")
        ),
        VerdictReason::NegligibleForce { experiment } => {
            format!("the force of {experiment} is negligible beside the inertia force")
        }
        VerdictReason::CoarseBasis { function } => {
            format!("the {function} varies more than its basis allows")
        }
        VerdictReason::FastVariation { functions } => format!(
            "the {} can vary within a period, which offsets, harmonics and second modes look like",
            and_list(functions)
        ),
        VerdictReason::Oscillates {
            function,
            frequency,
        } => super::findings::oscillates(function, *frequency),
        VerdictReason::InterpolationLoss { input, share } => format!(
            "lines between the samples of the {} lose {} of it at the natural frequency",
            input.name().replace('_', " "),
            percent(100.0 * share, 2)
        ),
        VerdictReason::ColouredResiduals => {
            "the residuals are autocorrelated beyond the noise model".to_owned()
        }
        VerdictReason::Aliased { per_period } => format!(
            "aliasing: with {per_period:.1} samples per period other frequencies fit equally well"
        ),
        VerdictReason::Negative { function } => {
            format!("the {function} is negative at most times")
        }
        VerdictReason::NotPredicted {
            experiment,
            fit_percent,
        } => format!(
            "validation record {experiment} is not predicted (fit {})",
            percent(*fit_percent, 0)
        ),
        VerdictReason::NotIdentified { functions } => format!(
            "the samples do not identify {} at all times",
            and_list(functions)
        ),
        VerdictReason::RankDeficient {
            rank_bound,
            parameters,
        } => {
            format!("at most {rank_bound} of {parameters} parameter combinations are identifiable")
        }
        VerdictReason::OnlyRatios => {
            "no force is measured: the samples determine ratios to the mass only".to_owned()
        }
        VerdictReason::ImplausibleUnits(implausible) => {
            let (quantity, value, unit) = match implausible {
                Implausible::NaturalFrequency { value } => ("natural frequency", value, "Hz"),
                Implausible::Velocity { value } => ("largest velocity", value, "m/s"),
                Implausible::Displacement { value } => ("largest displacement", value, "m"),
            };
            format!(
                "a {quantity} of {} {unit} is implausible: check the units of time and displacement",
                significant(*value, 2)
            )
        }
        VerdictReason::DoubtfulUnits => {
            "a unit may be wrong: the warnings about the data state what shows it".to_owned()
        }
        VerdictReason::UnmeasuredForce => {
            "no force is measured and an unknown one acts: the damping is not identifiable from this record by this method".to_owned()
        }
        VerdictReason::EquationResidual { share } => format!(
            "the residual of the equation of motion is {} of its largest force",
            percent(100.0 * share, 0)
        ),
        VerdictReason::EquationError => {
            "the equation error neglects the noise of the response, which biases the estimates"
                .to_owned()
        }
    };
    Finding::of(reason, text)
}

/// An assumption of a verdict as a sentence.
pub fn assumption(assumption: &VerdictAssumption) -> Finding {
    let text = match assumption {
        VerdictAssumption::Clock { experiment } => format!(
            "the clock of {experiment} is right: an error of its rate changes all frequencies by as much"
        ),
        VerdictAssumption::Unit {
            experiment,
            channel,
        } => format!(
            "the units of the {channel} and of the input of {experiment} are right: an error of either changes mass, damping and \
             stiffness by the same factor"
        ),
        VerdictAssumption::Scale { functions } => format!(
            "the {} fixed by the model is right: no force is measured, and the other coefficients scale with it",
            and_list(functions)
        ),
    };
    Finding::of(assumption, text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use kmcfit_core::internals::solvers::{EquationForm, EquationShare};

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
        let large = VerdictReason::EquationResidual { share: 0.48 };
        assert_eq!(reason(48.0), Some(large));
    }
}
