//! Summary of a fit for the terminal.

use super::answer::answer_table;
use super::document::{AttemptSummary, ChannelSummary, PenaltySummary, Prediction, ResultDocument};
use super::equation::equation_residual;
use super::extent::{extent, validation};
use super::rule_names::rule_in_words;
use kmcfit_core::assessment::{ClassicalEstimate, Doubt};
use kmcfit_core::finding::Finding;
use kmcfit_core::finding::Severity;
use kmcfit_core::functions::WeightRule;
use kmcfit_core::identifiability::Quantity;
use kmcfit_core::number_format::{count, percent, resolved, significant};
use std::fmt::Write;

/// Width of the interval of a classical frequency, relative to it, beyond which it is not shown.
const UNSHARP: f64 = 0.2;

/// The summary of a fit: verdict, estimates, fit of the samples, advice; `verbose` adds the end of the search, all findings, the
/// nuisance parameters and the constraints. `plot` stands below the estimates.
pub fn summary(document: &ResultDocument, verbose: bool, plot: Option<&str>) -> String {
    let mut text = answer(document, plot);
    if verbose {
        text += &details(document);
    }
    if !document.predictions.is_empty() {
        let table = prediction_table(&document.predictions, document.is_rotation());
        text += &format!("\n{table}");
    }
    text
}

/// Sentences below one another, the first of each list beside its heading.
fn under_headings<const N: usize>(lists: [(&str, Vec<String>); N], width: usize) -> String {
    let lists = lists.into_iter().flat_map(|(heading, sentences)| {
        let headings = std::iter::once(heading).chain(std::iter::repeat(""));
        let lines = headings.zip(sentences);
        lines.map(|(heading, sentence)| format!("{heading:<width$} {sentence}\n"))
    });
    lists.collect()
}

/// The answer: title, verdict, estimates, fit, warnings about the data, advice.
fn answer(document: &ResultDocument, plot: Option<&str>) -> String {
    let mut text = format!("{}: {}\n", document.title, extent(document));
    if let Some(verdict) = &document.verdict {
        text += &format!("{}\n", verdict.lines());
    }
    if !document.estimates.is_empty() {
        text += &format!("\n{}", answer_table(document));
    }
    text += "\n";
    text += &plot.map_or(String::new(), |plot| format!("{plot}\n"));
    let lists = [
        (
            "Mass",
            assumed(document, |doubt| matches!(doubt, Doubt::MassUnknown)),
        ),
        (
            "Units",
            assumed(document, |doubt| {
                matches!(doubt, Doubt::UnitsAssumed { .. })
            }),
        ),
        ("Fit", fit(document)),
        ("Truth", truth(document).into_iter().collect()),
        ("Data", data_lines(document)),
        ("Added", additions(document)),
        ("Next", Finding::texts(&document.advice)),
    ];
    text + &under_headings(lists, 6)
}

/// Assumptions of a kind.
fn assumed(document: &ResultDocument, is_meant: impl Fn(&Doubt) -> bool) -> Vec<String> {
    let all = document.verdict.iter().flat_map(|v| &v.assumptions);
    let of_kind = all.filter(|assumption| assumption.doubt.as_ref().is_some_and(&is_meant));
    of_kind.map(Finding::to_string).collect()
}

/// What `--select` added, with its gain.
pub(in crate::report) fn additions(document: &ResultDocument) -> Vec<String> {
    let steps = document.selection.iter();
    let each = steps.map(|step| format!("{} (gain {})", step.added, significant(step.gain, 2)));
    each.collect()
}

/// What was done with the data, in one line, and the warnings about them.
fn data_lines(document: &ResultDocument) -> Vec<String> {
    let data = document.data.iter();
    let mut done = data.filter(|fact| fact.severity > Severity::Detail);
    let more = done.clone().count().saturating_sub(1);
    let line = done.next().map(|first| match more {
        0 => first.sentence.clone(),
        _ => format!("{}; {more} more in result.json", first.sentence),
    });
    let warnings = document.other_warnings(document.warnings.iter());
    line.into_iter().chain(warnings).collect()
}

/// Largest errors against the true system, where it is known.
fn truth(document: &ResultDocument) -> Option<String> {
    let errors = document.all_functions().filter_map(|(name, f)| {
        let error = significant(f.truth_max_error?, 2);
        Some(format!("{name} {error} {}", f.unit))
    });
    let errors: Vec<String> = errors.collect();
    (!errors.is_empty()).then(|| format!("largest errors: {}", errors.join(", ")))
}

/// End of the search, cost and work, findings, nuisance parameters, constraints and attempts.
fn details(document: &ResultDocument) -> String {
    let (cost, outcome, counts) = (&document.cost, &document.outcome, &document.counts);
    let ratio = match document.estimates_sigma() {
        true => String::new(),
        false => format!(", J/J0 {:.4e}", cost.ratio),
    };
    let (others, what) = match (counts.adjoint, counts.tangent) {
        (0, tangent @ 1..) => (tangent, "tangent"),
        (adjoint, _) => (adjoint, "adjoint"),
    };
    let mut text = format!(
        "\n{}: {}\nJ {:.6e} -> {:.6e}{ratio}; {}, {} forward and {}, {:.2} s\n",
        outcome.status.name(),
        outcome.reason,
        cost.initial,
        cost.r#final,
        count(counts.iterations as usize, "iteration"),
        counts.forward,
        count(others as usize, &format!("{what} solve")),
        document.seconds
    );
    let assumptions = document.verdict.iter();
    let assumptions = assumptions.flat_map(|v| Finding::texts(&v.assumptions));
    let lists = [
        ("Assumptions", assumptions.collect()),
        (
            "Identifiability",
            document.notes().map(Finding::to_string).collect(),
        ),
        ("Warnings", document.other_warnings(document.fit_warnings())),
    ];
    text += &under_headings(lists, 15);
    let parameters = nuisance_parameters(&document.nuisance_parameters).into_iter();
    let lines = parameters
        .chain(constraints(document))
        .chain(attempts(document));
    lines.fold(text, |text, line| text + &line + "\n")
}

/// Fit of the channel or of the worst one, or for the equation error its residual; rejected outliers and the fit of the validation records.
fn fit(document: &ResultDocument) -> Vec<String> {
    let Some(worst) = document.worst_fit() else {
        return Vec::new();
    };
    let channels: Vec<&ChannelSummary> = document.channels().collect();
    let mut text = match (&document.equation, channels.as_slice()) {
        // Its response is the smoothed record, whose fit is no measure of the model.
        (Some(balance), _) => {
            equation_residual(balance, document.is_rotation(), document.model.mass_unknown)
        }
        (None, [only]) => format!(
            "{} of {}; residual {} {} rms",
            percent(worst, 2),
            only.kind,
            significant(only.rms_residual, 3),
            only.unit
        ),
        (None, _) => format!("{} for the worst channel", percent(worst, 2)),
    };
    let outliers = channels.iter().map(|c| c.outliers).sum::<usize>();
    if outliers > 0 {
        text += &format!("; {} rejected", count(outliers, "outlier"));
    }
    if let Some(result) = validation(document) {
        text += &format!("; {result}");
    }
    // An interval as wide as that says nothing.
    let is_sharp = |c: &&ClassicalEstimate| {
        let [low, high] = c.frequency_interval;
        !c.agrees || high - low <= UNSHARP * c.frequency
    };
    let classical = document.classical.as_ref().filter(is_sharp);
    let classical = classical.map(ClassicalEstimate::sentence);
    std::iter::once(text).chain(classical).collect()
}

/// Nuisance parameters with their intervals.
pub(super) fn nuisance_parameters(parameters: &[Quantity]) -> Vec<String> {
    let line = |parameter: &Quantity| {
        let (name, unit) = (&parameter.name, &parameter.unit);
        match parameter.interval() {
            Some([low, high]) => {
                let numbers = [parameter.value, low, high];
                let [value, low, high] = resolved(numbers, parameter.half_width());
                format!("{name} = {value} {unit} (95 % CI {low} to {high})")
            }
            None => format!("{name} = {} {unit}", significant(parameter.value, 6)),
        }
    };
    parameters.iter().map(line).collect()
}

/// Choice of the weight, effective parameters, violated soft constraints and active constraints.
pub(super) fn constraints(document: &ResultDocument) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(weights) = &document.weights {
        let (rule, weight) = (rule_in_words(&weights.rule), weights.weight);
        let of_rule = |p: &&PenaltySummary| p.rule.as_ref() == Some(&weights.rule);
        let penalties = document.penalties.iter().filter(of_rule);
        let mut functions: Vec<&str> = penalties.map(|p| p.function.as_str()).collect();
        functions.dedup();
        let of = match functions.len() {
            0 | 1 => String::new(),
            _ => format!(" (the same factor for {})", functions.join(", ")),
        };
        lines.push(format!("penalty weight by {rule}: {weight:.3e}{of}"));
        lines.extend(weights.remark.clone());
    }
    let reml = Some(WeightRule::RestrictedLikelihood.name());
    for penalty in (document.penalties.iter()).filter(|p| p.rule.as_deref() == reml) {
        let of = penalty.effective_parameters.map_or(String::new(), |found| {
            format!(
                ": {found:.1} effective parameters of {}",
                penalty.parameters
            )
        });
        lines.push(format!("smoothness of {} by reml{of}", penalty.function));
    }
    for slack in &document.constraints.slack {
        let (name, largest) = (&slack.name, slack.largest);
        let rows = count(slack.rows, "row");
        lines.push(format!(
            "soft constraint `{name}` is violated by up to {largest:.3e} on {rows}"
        ));
    }
    lines.extend(document.constraints.active.iter().map(|a| a.text.clone()));
    lines
}

/// The attempts from several starts; none if there was one.
pub(super) fn attempts(document: &ResultDocument) -> Vec<String> {
    if document.attempts.len() < 2 {
        return Vec::new();
    }
    let with = match document.estimates_sigma() {
        true => " (before sigma is estimated)",
        false => "",
    };
    let line = |attempt: &AttemptSummary| {
        let cost = attempt.cost.map(|cost| format!("J {cost:.4e}{with}"));
        format!(
            "attempt from the {}: {} after {} ({})",
            attempt.start,
            cost.unwrap_or_else(|| "no response".into()),
            count(attempt.iterations as usize, "iteration"),
            attempt.status.name()
        )
    };
    document.attempts.iter().map(line).collect()
}

/// Predictions as a table: the initial state and, if the true system is known, the cost relative to its response and the
/// energy of that response, else the largest and the last displacement.
pub fn prediction_table(predictions: &[Prediction], is_rotation: bool) -> String {
    let has_truth = predictions
        .iter()
        .any(|p| p.cost.is_some() || p.energy.is_some());
    let m = if is_rotation { "rad" } else { "m" };
    let [y, v] = [format!("y(0) ({m})"), format!("v(0) ({m}/s)")];
    let [one, other] = match has_truth {
        true => [
            format!("int (y - y_true)^2 dt ({m}² s)"),
            format!("int y_true^2 dt ({m}² s)"),
        ],
        false => [format!("peak |y| ({m})"), format!("y at end ({m})")],
    };
    let [width, last] = [&one, &other].map(|name| name.chars().count().max(14));
    let row =
        |[y, v, one, other]: [&str; 4]| format!("{y:>12} {v:>12} {one:>width$} {other:>last$}\n");
    let mut text = row([&y, &v, &one, &other]);
    for p in predictions {
        let [y, v] = [p.displacement, p.velocity].map(|x| significant(x, 6));
        let [one, other] = match has_truth {
            true => [p.cost, p.energy].map(|x| x.map(|x| format!("{x:.5e}"))),
            false => [p.largest, p.last].map(|x| x.map(|x| significant(x, 6))),
        }
        .map(|x| x.unwrap_or_else(|| "unknown".into()));
        text += &row([&y, &v, &one, &other]);
        if let Some(failure) = &p.failure {
            let _ = writeln!(text, "{:>12} no response: {failure}", "");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_have_singular_and_plural() {
        assert_eq!(count(1, "row"), "1 row");
        assert_eq!(count(0, "row"), "0 rows");
        assert_eq!(count(2, "row"), "2 rows");
    }
}
