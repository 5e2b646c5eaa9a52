//! Findings and warnings about a fit, from the typed results of the core.

use kmcfit_core::assessment::NoIntervals;
use kmcfit_core::finding::Finding;
use kmcfit_core::identifiability::{Classification, FunctionClassification, RankFinding};
use kmcfit_core::number_format::{count, resolved, significant};
use kmcfit_core::study::MultistartFinding;

/// A finding on the structural rank.
pub fn rank(finding: &RankFinding) -> Finding {
    let kind = serde_json::to_value(finding.kind).unwrap_or_default();
    Finding::new(kind.as_str().unwrap_or_default(), &*finding.sentence)
}

/// The classification of a function or ratio, with the half-width of its band relative to its scale, the identified
/// ratio, or the spans of time on which it is identified, s.
pub fn classification(function: &FunctionClassification) -> Finding {
    let verdict = &function.verdict;
    let finding = Finding::new(verdict.name().replace('-', "_"), &*function.sentence);
    let finding = finding.with("function", &function.name);
    match verdict {
        Classification::Identified { relative } => finding.with("relative_half_width", relative),
        Classification::Conditional { relative, on } => finding
            .with("relative_half_width", relative)
            .with("condition", on),
        Classification::OnlyRatio(ratio) => finding.with("ratio", ratio),
        Classification::PartlyIdentified(spans) => finding.with("spans", spans),
        Classification::NotIdentified | Classification::Fixed => finding,
    }
}

/// The bias of a fit of the equation error, and the reason why it has no confidence intervals, if it has none.
pub fn equation_error(reason: Option<&NoIntervals>) -> Finding {
    let intervals = match reason {
        None => ", and the intervals exclude this bias".to_owned(),
        Some(reason) => format!("; no confidence intervals: {}", no_intervals(*reason)),
    };
    let refine = match reason {
        // A simulation needs the force.
        Some(NoIntervals::UnmeasuredForce) => "",
        _ => "; refine the fit with `method: gauss-newton` and `initial: data`",
    };
    let text = format!(
        "noise of the measured response biases the estimates of the equation error{intervals}{refine}"
    );
    Finding::new("equation_error", text)
}

/// The reason why a fit of the equation error has no confidence intervals, in words.
fn no_intervals(reason: NoIntervals) -> &'static str {
    match reason {
        NoIntervals::ManyParameters => "more than 64 parameters",
        NoIntervals::ManySamples => "too many samples for a covariance of so many parameters",
        NoIntervals::ScaleOverTime => {
            "m, c and k are determined only up to a common factor at every time"
        }
        NoIntervals::NoMinimum => "no admissible minimum",
        NoIntervals::UnmeasuredForce => {
            "no force is measured, and one larger than that of the damping acts"
        }
    }
}

/// The covariance of a fit of the equation error.
pub fn kernel_covariance() -> Finding {
    Finding::new(
        "kernel_covariance",
        "intervals from a heteroscedasticity- and autocorrelation-consistent covariance",
    )
}

/// The jumps found in a function: its name, unit, and each level with its 95 % interval, where it has one.
pub fn jumps(name: &str, unit: &str, times: &[f64], levels: &[(f64, Option<[f64; 2]>)]) -> Finding {
    let level = |(value, interval): &(f64, Option<[f64; 2]>)| match interval {
        Some([low, high]) => {
            let half = 0.5 * (high - low);
            let [value, low, high] = resolved([*value, *low, *high], half);
            format!("{value} {unit} (95 % CI {low} to {high})")
        }
        None => format!("{} {unit}", significant(*value, 4)),
    };
    let jumps = match times.len() {
        0 => "no jump".to_owned(),
        some => count(some, "jump"),
    };
    let mut text = format!("{jumps} of {name} found: ");
    for (i, each) in levels.iter().enumerate() {
        if i > 0 {
            text += &format!("; from {} s ", significant(times[i - 1], 5));
        }
        text += &level(each);
    }
    let values: Vec<f64> = levels.iter().map(|(value, _)| *value).collect();
    let finding = Finding::new("jumps", text).with("function", name);
    finding.with("times", times).with("levels", values)
}

/// A finding of a multistart search with this number of starting points.
pub fn of_starts(finding: &MultistartFinding, starts: usize) -> Finding {
    use MultistartFinding as Starts;
    match finding {
        Starts::NoMinimum => {
            let text = format!("no fit from the {starts} starting points converged to a minimum");
            Finding::new("no_minimum", text)
        }
        Starts::Points {
            ended,
            different,
            lowest,
        } => {
            let text = match (*ended == starts, *different) {
                (true, 1) => format!(
                    "all {starts} starting points converged to the same minimum; lowest J = {lowest:.6e}"
                ),
                _ => format!(
                    "{ended} of {starts} starting points converged, to {different} different minima; lowest J = {lowest:.6e}"
                ),
            };
            let finding = Finding::new("minima", text);
            let finding = finding.with("ended", ended).with("starts", starts);
            finding.with("different", different).with("lowest", lowest)
        }
        Starts::Lower { cost, fit } => {
            let text = format!(
                "a starting point led to a lower J than the fit: {cost:.6e} instead of {fit:.6e}"
            );
            Finding::new("lower_minimum", text)
                .with("cost", cost)
                .with("fit", fit)
        }
        Starts::NotReached(fit) => {
            let text = format!(
                "no starting point converged to a cost as low as that of the fit (J = {fit:.6e})"
            );
            Finding::new("fit_not_reached", text).with("fit", fit)
        }
    }
}
