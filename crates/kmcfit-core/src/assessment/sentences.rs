//! Doubts about a fit in words, each a clause that stands alone.

use super::{Doubt, Implausible, Unidentified};
use crate::candidates::Candidate;
use crate::number_format::{and_list, percent, significant, times_in_words};
use crate::record::ScoreCovariance;
use serde_json::json;

impl Doubt {
    /// The doubt as a clause.
    pub fn sentence(&self) -> String {
        match self {
        Self::BeyondSigma { times } => format!(
            "the residuals are {} times sigma: the model does not explain the record, or sigma is too small",
            times_in_words(*times)
        ),
        Self::CoarseSteps { times } => format!(
            "the error of the time steps is {} times the residuals",
            times_in_words(*times)
        ),
        Self::PoorFit { fit_percent } => format!(
            "fit {}: the residuals are large and autocorrelated",
            percent(*fit_percent, 0)
        ),
        Self::Coloured {
            covariance: ScoreCovariance::Model,
        } => {
            "the residuals are autocorrelated beyond the noise model: the true confidence intervals are wider".to_owned()
        }
        Self::Coloured {
            covariance: ScoreCovariance::Kernel,
        } => {
            "the residuals are autocorrelated beyond the noise model; the confidence intervals are heteroscedasticity- and \
             autocorrelation-consistent"
                .to_owned()
        }
        Self::Correlated => {
            "the residuals are autocorrelated: the confidence intervals assume correlated noise; a term missing from the model \
             leaves such residuals too"
                .to_owned()
        }
        Self::Aliased {
            per_period,
            frequency,
        } => format!(
            "aliasing: with {per_period:.1} samples per period at {frequency:.3} Hz other frequencies fit equally well; sample faster or at \
             unequal intervals"
        ),
        Self::Preferred { candidates } => preferred(candidates),
        Self::AsGood { candidates } => {
            let words: Vec<&str> = candidates.iter().map(|c| c.words.as_str()).collect();
            format!("{} explain the samples as well as the model", words.join(", or "))
        }
        Self::FastVariation {
            functions,
            per_period,
        } => format!(
            "the {} can vary within a period (up to {} parameters in one), which offsets, harmonics and second modes look like",
            and_list(functions),
            significant(*per_period, 2)
        ),
        Self::Oscillates {
            function,
            frequency,
        } => format!(
            "the {function} oscillates at {} Hz, as a second mode that beats with the first makes it",
            significant(*frequency, 2)
        ),
        Self::InterpolationLoss {
            input,
            share,
            errors,
            ..
        } => format!(
            "lines between the samples of the {} lose {} of it at the natural frequency, up to {} standard errors of an estimate",
            input.name().replace('_', " "),
            percent(100.0 * share, 2),
            significant(*errors, 2)
        ),
        Self::DisturbedInput {
            experiment,
            input,
            share,
            ..
        } => format!(
            "a disturbance enters through the equation of motion of {experiment}: noise of the {} sensor ({} of it would do), an unmeasured \
             drive, or a missing term; the intervals exclude it",
            input.name().replace('_', " "),
            percent(100.0 * share, 1)
        ),
        Self::CoherentResiduals {
            channel,
            input,
            share,
            ..
        } => format!(
            "{} of the variance of the {channel}'s residuals is coherent with the {}: dynamics are missing from the model",
            percent(100.0 * share, 0),
            input.name().replace('_', " ")
        ),
        Self::ContradictedInputSigma {
            experiment,
            input,
            given,
            likely,
        } => format!(
            "the residuals contradict the stated sigma of the {} of {experiment}, {}: {} {} is most likely",
            input.name().replace('_', " "),
            significant(*given, 3),
            significant(*likely, 3),
            input.unit()
        ),
        Self::MissingTerm(missing) => format!(
            "the residuals show {} that the model does not have, of {} {} (t = {}, {} of the largest term): the estimates are biased by it",
            missing.term.row().words,
            significant(missing.value, 3),
            missing.term.unit(),
            significant(missing.t, 2),
            percent(100.0 * missing.share, 1),
        ),
        Self::SecondMode {
            frequencies: [first, second],
            ..
        } => format!(
            "the record has a second mode at {} Hz beside that at {} Hz",
            significant(*second, 3),
            significant(*first, 3)
        ),
        Self::RecordError(error) => error.sentence(),
        Self::ClassicalDisagrees(estimate) => estimate.sentence(),
        Self::FrictionWidth {
            estimate,
            shift,
            unit,
            errors,
            width,
            better,
        } if better <= width => {
            let errors = significant(*errors, 2);
            let shift = match shift {
                Some(shift) => format!("{} {unit} ({errors} standard errors)", significant(*shift, 2)),
                None => format!("{errors} standard errors"),
            };
            format!(
                "the {estimate} depends on the width of Coulomb friction: half of {} m/s shifts it by {shift}",
                significant(*width, 3)
            )
        }
        Self::FrictionWidth { width, better, .. } => format!(
            "a larger width of Coulomb friction than {} m/s fits better: about {} m/s",
            significant(*width, 3),
            significant(*better, 2)
        ),
        Self::Negative { function } => {
            format!("the {function} is negative at most times: the system is not passive")
        }
        Self::NegligibleForce { experiment } => format!(
            "the force of {experiment} is negligible beside the inertia force; check its unit"
        ),
        Self::Failed { status } => format!("the fit ended {}", status.name()),
        Self::NoSystem { reason } => reason.sentence(),
        Self::NotConverged { status } => {
            format!("the fit ended before it converged ({})", status.name())
        }
        Self::MissingCodes {
            channels, codes, ..
        } => {
            let all: Vec<String> = codes.iter().map(|code| format!("{code:?}")).collect();
            format!(
                "the {} holds the value {} far outside the others, which stands for a missing sample: `missing: {}`",
                channels.join(" and the "),
                all.join(" and "),
                json!(codes)
            )
        }
        Self::Outliers { experiment, channel } => {
            format!("the {channel} of {experiment} has samples far from the others")
        }
        Self::KeptUp { channel, .. } => format!(
            "no force is measured, and the {channel} does not decay: an unmeasured force acts, with which neither a free response nor the \
             equation error determines the damping; `fit: {{method: equation-error}}` gives the natural frequency"
        ),
        Self::MassUnknown => {
            "the mass is unknown: all coefficients are ratios to it; `--set functions.mass.fixed=4.5` (kg) states it".to_owned()
        }
        Self::UnitsAssumed { units } => format!(
            "{}: assumed, the file does not state it; `units` in the model file does",
            and_list(units)
        ),
        Self::Clock { experiment } => format!(
            "the clock of {experiment} is right: an error of its rate changes all frequencies by as much"
        ),
        Self::Unit {
            experiment,
            channel,
        } => format!(
            "the units of the {channel} and of the input of {experiment} are right: an error of either changes mass, damping and \
             stiffness by the same factor"
        ),
        Self::Scale { functions } => format!(
            "the {} fixed by the model is right: no force is measured, and the other coefficients scale with it",
            and_list(functions)
        ),
        Self::Saturation { channel } => {
            format!("the {channel} saturates: many samples equal the largest one")
        }
        Self::CoarseInput {
            experiment,
            channel,
            ..
        } => format!(
            "the quantisation error of the {channel} of {experiment} is not small beside the residuals"
        ),
        Self::DelayAtLimit { parameter } => {
            format!("the {parameter} is beyond its limits")
        }
        Self::NotPredicted {
            experiment,
            fit_percent,
        } => format!(
            "validation record {experiment} is not predicted (fit {})",
            percent(*fit_percent, 0)
        ),
        Self::NotIdentified { functions } => format!(
            "the samples do not identify {} at all times",
            and_list(functions)
        ),
        Self::RankDeficient {
            rank_bound,
            parameters,
        } => {
            format!("at most {rank_bound} of {parameters} parameter combinations are identifiable")
        }
        Self::OnlyRatios => {
            "no force is measured: the samples determine ratios to the mass only".to_owned()
        }
        Self::UnmeasuredForce => {
            "no force is measured and an unknown one acts: the damping is not identifiable from this record by this method".to_owned()
        }
        Self::Stopped { not_done } => {
            format!("stopped; not done: {}", not_done.join(", "))
        }
        Self::EquationError => {
            "the equation error neglects the noise of the response, which biases the estimates"
                .to_owned()
        }
        Self::EquationResidual { share } => format!(
            "the residual of the equation of motion is {} of its largest force",
            percent(100.0 * share, 0)
        ),
        Self::ImplausibleUnits(implausible) => {
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
    }
    }
}

/// The best candidate, and those that the record does not tell from it.
fn preferred(candidates: &[Candidate]) -> String {
    let Some((best, others)) = candidates.split_first() else {
        return String::new();
    };
    let gain = significant(best.gain, 2);
    let names: Vec<&str> = others.iter().map(|c| c.words.as_str()).collect();
    let others = match names.is_empty() {
        true => String::new(),
        false => format!("; as good: {}", names.join("; ")),
    };
    format!(
        "the model lacks {}, which explains the samples better (gain {gain}) and biases the estimates{others}",
        best.words
    )
}

impl Unidentified {
    /// The reason as a clause.
    pub fn sentence(&self) -> String {
        let why = match self {
            Self::Failed => "the fit failed".to_owned(),
            Self::NoResponseOnHalfStep { error } => {
                format!("the simulation with half the step fails: {error}")
            }
            Self::StepDependent => {
                "halving the step changes the response by more than 10 % of its peak".into()
            }
            Self::Unrelated => "the residuals exceed twice the variation of every channel".into(),
            Self::Noise => "the model would fit white noise equally well".into(),
        };
        format!("no system identified: {why}")
    }
}
