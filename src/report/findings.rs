//! Sentences about a fit: its plausibility, and further fits beside it.

use kmcfit_core::internals::assessment::{FitWarning, Unidentified};
use kmcfit_core::internals::study::multistart::Finding;

/// Why the optimum identifies no system.
pub fn unidentified(why: &Unidentified) -> String {
    let why = match why {
        Unidentified::Failed => "the fit failed".to_owned(),
        Unidentified::NoResponseOnHalfStep(breakdown) => {
            format!("on half the step there is no motion: {breakdown}")
        }
        Unidentified::StepDependent => {
            "on half the step the model's readings change by more than a tenth of the largest one"
                .into()
        }
        Unidentified::Unrelated => {
            "its motion misses the readings by more than twice what they vary".into()
        }
        Unidentified::Noise => {
            "noise of the size of these readings would be matched as well".into()
        }
    };
    format!("the device is not identified: {why}")
}

/// A record that took no part in the fit and is matched to so many per cent only.
pub fn unpredicted((record, percent): (&str, f64)) -> String {
    format!(
        "the record `{record}`, which was held out, is matched to {} only: the device does not predict it",
        super::advice::percent(percent, 0)
    )
}

/// A warning.
pub fn warning(warning: &FitWarning) -> String {
    match warning {
        FitWarning::BeyondSigma { times } => format!(
            "how sure the functions are is not known: the residuals are {times:.1} times sigma, so the device does not \
             explain the readings, or sigma is too small"
        ),
        FitWarning::CoarseSteps { times } => format!(
            "how sure the functions are is not known: half the step changes the model's readings by {times:.1} times the \
             residuals"
        ),
        FitWarning::PoorFit => {
            "how sure the functions are is not known: what the device leaves of the readings is large, and not white"
                .into()
        }
        FitWarning::Coloured => {
            "by how much the errors are too small is not known: they hold for white residuals, and these are not"
                .into()
        }
        FitWarning::Aliased {
            per_period,
            frequency,
        } => format!(
            "devices of other frequencies may match as well: with {per_period:.1} readings in a period of {frequency:.3} \
             Hz its aliases do; read more often, or at uneven times"
        ),
        FitWarning::Negative { function } => {
            format!("the {function} is negative at most times, as that of no passive device")
        }
        FitWarning::NegligibleForce { experiment } => format!(
            "the force of {experiment} is nothing beside those of the device: as if it did not act"
        ),
    }
}

/// A finding of fits from so many starts.
pub fn of_starts(finding: &Finding, starts: usize) -> String {
    match finding {
        Finding::Nowhere => format!("none of {starts} starts led anywhere"),
        Finding::Points {
            ended,
            different,
            lowest,
        } => format!(
            "{ended} of {starts} starts led to {different} different points; the lowest cost is {lowest:.6e}"
        ),
        Finding::OneValley(true) => {
            "the two lowest are ends of one valley: a path between them hardly rises".into()
        }
        Finding::OneValley(false) => {
            "between the two lowest the cost rises on the straight path and along the gauge: no path without a rise was \
             found"
                .into()
        }
        Finding::Lower { cost, fit } => {
            format!("a start led lower than the fit: {cost:.6e} instead of {fit:.6e}")
        }
        Finding::NotReached(fit) => {
            format!("no start reached the fit, whose cost is {fit:.6e}: they were too far off, or got stuck")
        }
    }
}
