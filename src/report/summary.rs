//! Summary of a fit for the terminal.

use super::answer::answer_table;
use super::document::{
    ChannelSummary, NuisanceParameter, PenaltySummary, Prediction, ResultDocument,
};
use super::equation::equation_residual;
use super::extent::{extent, validation};
use super::findings;
use super::model_assumptions::{MASS_UNKNOWN, UNITS_ASSUMED};
use super::rule_names::rule_in_words;
use super::suggestions;
pub(crate) use super::text::count;
use crate::finding::Finding;
use crate::number_format::{resolved, significant};
use kmcfit_core::internals::assessment::ClassicalEstimate;
use kmcfit_core::internals::functions::WeightRule;
use std::fmt::Write;

/// Width of the interval of a classical frequency, relative to it, beyond which it is not shown.
const UNSHARP: f64 = 0.2;

/// The summary of a fit: verdict, estimates, fit of the samples, advice; `verbose` adds the end of the search, all findings, the
/// nuisance parameters and the constraints. `plot` stands below the estimates.
pub fn summary(document: &ResultDocument, verbose: bool, plot: Option<&str>) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_answer(&mut text, document, plot);
    if verbose {
        let _ = write_details(&mut text, document);
    }
    if !document.predictions.is_empty() {
        let table = prediction_table(&document.predictions, document.is_rotation());
        text += &format!("\n{table}");
    }
    text
}

/// The answer: title, verdict, estimates, fit, warnings about the data, advice.
fn write_answer(
    text: &mut String,
    document: &ResultDocument,
    plot: Option<&str>,
) -> std::fmt::Result {
    writeln!(text, "{}: {}", document.title, extent(document))?;
    if let Some(verdict) = &document.verdict {
        writeln!(text, "{}", verdict.lines())?;
    }
    if !document.estimates.is_empty() {
        write!(text, "\n{}", answer_table(document))?;
    }
    writeln!(text)?;
    if let Some(plot) = plot {
        writeln!(text, "{plot}")?;
    }
    let lists = [
        ("Mass", assumed(document, MASS_UNKNOWN)),
        ("Units", assumed(document, UNITS_ASSUMED)),
        ("Fit", fit(document)),
        ("Truth", truth(document).into_iter().collect()),
        ("Data", data_lines(document)),
        ("Next", Finding::texts(&document.advice)),
    ];
    for (heading, sentences) in lists {
        for (i, sentence) in sentences.iter().enumerate() {
            let heading = if i == 0 { heading } else { "" };
            writeln!(text, "{heading:<6} {sentence}")?;
        }
    }
    Ok(())
}

/// Assumptions of a kind.
fn assumed(document: &ResultDocument, kind: &str) -> Vec<String> {
    let all = document.verdict.iter().flat_map(|v| &v.assumptions);
    let of_kind = all.filter(|assumption| assumption.kind == kind);
    of_kind.map(|assumption| assumption.text.clone()).collect()
}

/// What was done with the data, in one line, and the warnings about them.
fn data_lines(document: &ResultDocument) -> Vec<String> {
    let is_done = |fact: &&Finding| {
        let action = fact.quantities.get("action").and_then(|a| a.as_str());
        action != Some("used") && fact.kind != "quantisation"
    };
    let mut done = document.data.iter().filter(is_done);
    let more = done.clone().count().saturating_sub(1);
    let line = done.next().map(|first| match more {
        0 => first.text.clone(),
        _ => format!("{}; {more} more in result.json", first.text),
    });
    let warnings = Finding::texts(&document.warnings);
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
fn write_details(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    let cost = &document.cost;
    let outcome = &document.outcome;
    writeln!(text, "\n{}: {}", outcome.status.name(), outcome.reason)?;
    write!(text, "J {:.6e} -> {:.6e}", cost.initial, cost.r#final)?;
    if document.has_ratio() {
        write!(text, ", J/J0 {:.4e}", cost.ratio)?;
    }
    let counts = &document.counts;
    let (others, what) = match (counts.adjoint, counts.tangent) {
        (0, tangent @ 1..) => (tangent, "tangent"),
        (adjoint, _) => (adjoint, "adjoint"),
    };
    writeln!(
        text,
        "; {}, {} forward and {}, {:.2} s",
        count(counts.iterations as usize, "iteration"),
        counts.forward,
        count(others as usize, &format!("{what} solve")),
        document.seconds
    )?;
    let assumed = document.verdict.iter().flat_map(|v| v.assumptions.clone());
    let assumed: Vec<Finding> = assumed.collect();
    for (heading, findings) in [
        ("Assumptions", assumed.iter().collect()),
        ("Identifiability", document.notes().collect::<Vec<_>>()),
        ("Warnings", document.fit_warnings().collect()),
    ] {
        for (i, finding) in findings.iter().enumerate() {
            let heading = if i == 0 { heading } else { "" };
            writeln!(text, "{heading:<15} {finding}")?;
        }
    }
    write_nuisance_parameters(text, &document.nuisance_parameters)?;
    write_constraints(text, document)?;
    write_attempts(text, document)
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
            fit_percent(worst),
            only.kind,
            significant(only.rms_residual, 3),
            only.unit
        ),
        (None, _) => format!("{} for the worst channel", fit_percent(worst)),
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
    let classical = classical.map(findings::classical);
    std::iter::once(text).chain(classical).collect()
}

fn fit_percent(fit: f64) -> String {
    suggestions::percent(fit, 2)
}

/// Nuisance parameters with their confidence intervals.
pub(super) fn write_nuisance_parameters(
    text: &mut String,
    parameters: &[NuisanceParameter],
) -> std::fmt::Result {
    for parameter in parameters {
        let (name, unit) = (&parameter.name, &parameter.unit);
        match parameter.half_width() {
            Some(half) => {
                let (low, high) = (parameter.value - half, parameter.value + half);
                let [value, low, high] = resolved([parameter.value, low, high], half);
                writeln!(text, "{name} = {value} {unit} (95 % CI {low} to {high})")?;
            }
            None => writeln!(text, "{name} = {} {unit}", significant(parameter.value, 6))?,
        }
    }
    Ok(())
}

pub(super) fn write_constraints(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    if let Some(weights) = &document.weights {
        let (rule, weight) = (rule_in_words(&weights.rule), weights.weight);
        write!(text, "penalty weight by {rule}: {weight:.3e}")?;
        let of_rule = |p: &&PenaltySummary| p.rule.as_ref() == Some(&weights.rule);
        let penalties = document.penalties.iter().filter(of_rule);
        let mut functions: Vec<&str> = penalties.map(|p| p.function.as_str()).collect();
        functions.dedup();
        match functions.len() {
            0 | 1 => writeln!(text)?,
            _ => writeln!(text, " (the same factor for {})", functions.join(", "))?,
        }
        if let Some(remark) = &weights.remark {
            writeln!(text, "{remark}")?;
        }
    }
    for penalty in &document.penalties {
        let rule = penalty.rule.as_deref();
        if rule == Some(WeightRule::RestrictedLikelihood.name()) {
            let of = match penalty.effective_parameters {
                Some(effective) => format!(
                    ": {effective:.1} effective parameters of {}",
                    penalty.parameters
                ),
                None => String::new(),
            };
            writeln!(text, "smoothness of {} by reml{of}", penalty.function)?;
        }
    }
    for slack in &document.constraints.slack {
        writeln!(
            text,
            "soft constraint `{}` is violated by up to {:.3e} on {}",
            slack.name,
            slack.largest,
            count(slack.rows, "row")
        )?;
    }
    for active in &document.constraints.active {
        writeln!(text, "{}", active.text)?;
    }
    Ok(())
}

/// The attempts, if there is more than one.
pub(super) fn write_attempts(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    if document.attempts.len() < 2 {
        return Ok(());
    }
    let with = match document.estimates_sigma() {
        true => " (before sigma is estimated)",
        false => "",
    };
    for attempt in &document.attempts {
        let cost = attempt
            .cost
            .map_or("no response".into(), |cost| format!("J {cost:.4e}{with}"));
        writeln!(
            text,
            "attempt from the {}: {cost} after {} ({})",
            attempt.start,
            count(attempt.iterations as usize, "iteration"),
            attempt.status.name()
        )?;
    }
    Ok(())
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
