//! Doubts about a fit in words, each a clause that stands alone.

use super::suggestions::percent;
use super::text::and_list;
use crate::finding::Finding;
use crate::number_format::{count, resolved, significant, times_in_words};
use kmcfit_core::assessment::{
    ClassicalEstimate, ClassicalMethod, CoarseBasis, Doubt, Implausible, RecordError, Unidentified,
};
use kmcfit_core::identifiability::span_words;
use kmcfit_core::record::ScoreCovariance;

/// A doubt about a fit as a clause.
pub fn doubt(doubt: &Doubt) -> Finding {
    let text = match doubt {
        Doubt::BeyondSigma { times } => format!(
            "the residuals are {} times sigma: the model does not explain the record, or sigma is too small",
            times_in_words(*times)
        ),
        Doubt::CoarseSteps { times } => format!(
            "the error of the time steps is {} times the residuals",
            times_in_words(*times)
        ),
        Doubt::PoorFit { fit_percent } => format!(
            "fit {}: the residuals are large and autocorrelated",
            percent(*fit_percent, 0)
        ),
        Doubt::Coloured {
            covariance: ScoreCovariance::Model,
        } => {
            "the residuals are autocorrelated beyond the noise model: the true confidence intervals are wider".to_owned()
        }
        Doubt::Coloured {
            covariance: ScoreCovariance::Kernel,
        } => {
            "the residuals are autocorrelated beyond the noise model; the confidence intervals are heteroscedasticity- and \
             autocorrelation-consistent"
                .to_owned()
        }
        Doubt::Correlated => {
            "the residuals are autocorrelated: the confidence intervals assume correlated noise; a term missing from the model \
             leaves such residuals too"
                .to_owned()
        }
        Doubt::Aliased {
            per_period,
            frequency,
        } => format!(
            "aliasing: with {per_period:.1} samples per period at {frequency:.3} Hz other frequencies fit equally well; sample faster or at \
             unequal intervals"
        ),
        Doubt::CoarseBasis(basis) => coarse_basis(basis),
        Doubt::FastVariation {
            functions,
            per_period,
        } => format!(
            "the {} can vary within a period (up to {} parameters in one), which offsets, harmonics and second modes look like",
            and_list(functions),
            significant(*per_period, 2)
        ),
        Doubt::Oscillates {
            function,
            frequency,
        } => format!(
            "the {function} oscillates at {} Hz, as a second mode that beats with the first makes it",
            significant(*frequency, 2)
        ),
        Doubt::InterpolationLoss {
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
        Doubt::DisturbedInput {
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
        Doubt::CoherentResiduals {
            channel,
            input,
            share,
            ..
        } => format!(
            "{} of the variance of the {channel}'s residuals is coherent with the {}: dynamics are missing from the model",
            percent(100.0 * share, 0),
            input.name().replace('_', " ")
        ),
        Doubt::ContradictedInputSigma {
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
        Doubt::MissingTerm(missing) => format!(
            "the residuals show {} that the model does not have, of {} {} (t = {}, {} of the largest term): the estimates are biased by it",
            missing.term.row().words,
            significant(missing.value, 3),
            missing.term.unit(),
            significant(missing.t, 2),
            percent(100.0 * missing.share, 1),
        ),
        Doubt::TimeOrAmplitude(rival) => super::rivals::rival_in_words(rival),
        Doubt::SecondMode {
            frequencies: [first, second],
            ..
        } => format!(
            "the record has a second mode at {} Hz beside that at {} Hz",
            significant(*second, 3),
            significant(*first, 3)
        ),
        Doubt::RecordError(error) => record_error(error),
        Doubt::ClassicalDisagrees(estimate) => classical(estimate),
        Doubt::ResidualMean {
            experiment,
            channel,
            t,
            share,
            or_static_force,
            ..
        } => format!(
            "the residuals of the {channel} of {experiment} have a mean of {} standard deviations (t = {}): an offset of the sensor{}",
            significant(*share, 2),
            significant(*t, 2),
            if *or_static_force { " or a static force" } else { "" }
        ),
        Doubt::FrictionWidth {
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
        Doubt::FrictionWidth { width, better, .. } => format!(
            "a larger width of Coulomb friction than {} m/s fits better: about {} m/s",
            significant(*width, 3),
            significant(*better, 2)
        ),
        Doubt::Negative { function } => {
            format!("the {function} is negative at most times: the system is not passive")
        }
        Doubt::NegligibleForce { experiment } => format!(
            "the force of {experiment} is negligible beside the inertia force; check its unit"
        ),
        Doubt::Failed { status } => format!("the fit ended {}", status.name()),
        Doubt::NoSystem { reason } => unidentified(reason).text,
        Doubt::NotConverged { status } => {
            format!("the fit ended before it converged ({})", status.name())
        }
        Doubt::Saturation { channel } => {
            format!("the {channel} saturates: many samples equal the largest one")
        }
        Doubt::CoarseInput {
            experiment,
            channel,
        } => format!(
            "the quantisation error of the {channel} of {experiment} is not small beside the residuals"
        ),
        Doubt::DelayAtLimit { parameter } => {
            format!("the {parameter} is beyond its limits")
        }
        Doubt::NotPredicted {
            experiment,
            fit_percent,
        } => format!(
            "validation record {experiment} is not predicted (fit {})",
            percent(*fit_percent, 0)
        ),
        Doubt::NotIdentified { functions } => format!(
            "the samples do not identify {} at all times",
            and_list(functions)
        ),
        Doubt::RankDeficient {
            rank_bound,
            parameters,
        } => {
            format!("at most {rank_bound} of {parameters} parameter combinations are identifiable")
        }
        Doubt::OnlyRatios => {
            "no force is measured: the samples determine ratios to the mass only".to_owned()
        }
        Doubt::UnmeasuredForce => {
            "no force is measured and an unknown one acts: the damping is not identifiable from this record by this method".to_owned()
        }
        Doubt::Stopped { not_done } => {
            format!("stopped; not done: {}", not_done.join(", "))
        }
        Doubt::EquationError => {
            "the equation error neglects the noise of the response, which biases the estimates"
                .to_owned()
        }
        Doubt::EquationResidual { share } => format!(
            "the residual of the equation of motion is {} of its largest force",
            percent(100.0 * share, 0)
        ),
        Doubt::ImplausibleUnits(implausible) => {
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
    };
    let finding = Finding::of(doubt, text).rated(doubt.severity());
    finding.about(doubt.clone())
}

/// A classical estimate beside that of the fit, as a clause.
pub fn classical(estimate: &ClassicalEstimate) -> String {
    let [names, of_damping] = match estimate.method {
        ClassicalMethod::LogarithmicDecrement => ["extremes of the decay", "logarithmic decrement"],
        ClassicalMethod::FrequencyResponse => ["FRF peak", "half-power width"],
    };
    let number = |value: f64, [low, high]: [f64; 2]| {
        let [value, ..] = resolved([value, low, high], 0.5 * (high - low));
        value
    };
    let damping = estimate.damping_ratio.zip(estimate.damping_interval);
    let damping = damping.map(|(value, interval)| {
        format!(", damping ratio {} ({of_damping})", number(value, interval))
    });
    format!(
        "{names} {} Hz{}: {}",
        number(estimate.frequency, estimate.frequency_interval),
        damping.unwrap_or_default(),
        match estimate.agrees {
            true => "agree with the estimates",
            false => "disagree with the estimates beyond both intervals",
        }
    )
}

/// An error of a record that explains the residuals, as a clause.
pub fn record_error(error: &RecordError) -> String {
    match error {
        RecordError::Delay {
            experiment,
            delay,
            samples,
        } => format!(
            "the response of {experiment} {} its input by {} s ({} samples)",
            if *delay > 0.0 { "lags" } else { "leads" },
            significant(delay.abs(), 3),
            significant(samples.abs(), 3)
        ),
        RecordError::ClockDifference {
            experiment,
            percent,
        } => format!(
            "the clocks of input and response of {experiment} differ: the times of the response are {} % too {}",
            significant(percent.abs(), 3),
            if *percent > 0.0 { "short" } else { "long" }
        ),
        RecordError::InputPulses {
            experiment,
            count: pulses,
            time,
            error,
        } => format!(
            "the force of {experiment} has errors at {}, as by spikes, cut peaks or unmeasured impacts, the largest of about {} N near {} s",
            count(*pulses, "sample"),
            significant(*error, 2),
            significant(*time, 6)
        ),
        RecordError::InputJump {
            experiment,
            input,
            between: [from, to],
            jump,
        } => format!(
            "the {} of {experiment} jumps by {} {} between its samples at {} and {} s, and its interpolation does not have the time of the jump",
            input.name().replace('_', " "),
            significant(*jump, 3),
            input.unit(),
            significant(*from, 6),
            significant(*to, 6)
        ),
        RecordError::InputSign { experiment } => {
            format!("the input of {experiment} has the wrong sign")
        }
        RecordError::ChannelFactor {
            experiment,
            channel,
            factor,
            beside_others,
        } => format!(
            "the {channel} of {experiment} is {} times {}",
            significant(*factor, 4),
            match beside_others {
                true => "what its other channels and the model give",
                false => "what its input and the model give",
            }
        ),
    }
}

fn p_in_words(p: f64) -> String {
    match p < 1e-6 {
        true => "p < 1e-6".to_owned(),
        false => format!("p = {}", significant(p, 2)),
    }
}

fn coarse_basis(basis: &CoarseBasis) -> String {
    let CoarseBasis {
        function, p_value, ..
    } = basis;
    let p = p_in_words(*p_value);
    match (basis.halves, basis.knots) {
        (Some([first, second]), _) => format!(
            "the {function} is not constant: {} {unit} in the first half of the record, {} {unit} in the second ({p})",
            significant(first, 4),
            significant(second, 4),
            unit = basis.unit
        ),
        (None, knots) => format!(
            "the basis of the {function} is too coarse ({p}): {} changes it by up to {:.0} % on {}",
            knots.map_or("a finer one".to_owned(), |knots| format!(
                "one of {knots} knots"
            )),
            100.0 * basis.change,
            span_words(&basis.spans)
        ),
    }
}

/// The reason for which an optimum identifies no system.
pub fn unidentified(reason: &Unidentified) -> Finding {
    let why = match reason {
        Unidentified::Failed => "the fit failed".to_owned(),
        Unidentified::NoResponseOnHalfStep { error } => {
            format!("the simulation with half the step fails: {error}")
        }
        Unidentified::StepDependent => {
            "halving the step changes the response by more than 10 % of its peak".into()
        }
        Unidentified::Unrelated => {
            "the residuals exceed twice the variation of every channel".into()
        }
        Unidentified::Noise => "the model would fit white noise equally well".into(),
    };
    Finding::of(reason, format!("no system identified: {why}"))
}
