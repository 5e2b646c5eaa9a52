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
use crate::number_format::{at_most, resolved, significant};
use kmcfit_core::internals::assessment::ClassicalEstimate;
use kmcfit_core::internals::functions::WeightRule;
use kmcfit_core::internals::identifiability::ClassificationKind;
use std::fmt::Write;

/// Width of the interval of a classical frequency, relative to it, beyond which it is not shown.
const UNSHARP: f64 = 0.2;

/// The summary of a fit: verdict, estimates, fit of the samples, advice; `verbose` adds the solver, each channel, all findings and the
/// constraints. `plot` stands below the estimates.
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

/// Everything besides the answer: end of the search, cost and work, findings, channels, statistics, functions, constraints, attempts.
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
        iterations(document),
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
    for (name, channel) in document.records() {
        write_channel(text, &name, channel)?;
    }
    for out in &document.validation {
        if let Some(failure) = &out.failure {
            writeln!(text, "{}: no response: {failure}", out.title())?;
        }
    }
    write_statistics(text, document)?;
    writeln!(text)?;
    write_functions(text, document)?;
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
        (Some(balance), _) => equation_residual(balance, document.is_rotation()),
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

/// Fit of one channel.
pub(super) fn write_channel(
    text: &mut String,
    name: &str,
    channel: &ChannelSummary,
) -> std::fmt::Result {
    write!(
        text,
        "{name}: {}, rms residual {:.4e} {}, {}, {}",
        channel.kind,
        channel.rms_residual,
        channel.unit,
        fit_in_words(channel.fit_percent),
        count(channel.samples, "sample")
    )?;
    if channel.outliers > 0 {
        write!(text, "; {} rejected", count(channel.outliers, "outlier"))?;
    }
    for ignored in &channel.ignored {
        write!(text, "; {} not used ({})", ignored.samples, ignored.reason)?;
    }
    writeln!(text)?;
    if let (Some(sigma), true) = (channel.sigma, channel.sigma_estimated) {
        writeln!(text, "  sigma estimated: {sigma:.4e} {}", channel.unit)?;
    }
    if let Some(noise) = &channel.noise {
        writeln!(text, "  {}", noise.sentence())?;
    }
    // Without a sigma the residuals are not assumed to be noise.
    if channel.sigma.is_some() {
        writeln!(text, "  {}", channel.whiteness)?;
    }
    Ok(())
}

/// Fit of a channel in per cent; samples that are all equal have none.
pub(super) fn fit_in_words(percent: f64) -> String {
    match percent.is_finite() {
        true => format!("fit {}", fit_percent(percent)),
        false => "fit undefined".into(),
    }
}

/// Statistics of all samples and the step-size check.
pub(super) fn write_statistics(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    let statistics = &document.statistics;
    if let Some(reduced) = statistics.reduced_chi_square {
        write!(
            text,
            "chi-square per degree of freedom {} ({} samples, {} parameters)",
            significant(reduced, 4),
            statistics.samples,
            statistics.parameters
        )?;
        match (statistics.aic, statistics.bic) {
            (Some(aic), Some(bic)) => {
                let [aic, bic] = [aic, bic].map(|x| significant(x, 5));
                writeln!(text, ", AIC {aic}, BIC {bic}")?;
            }
            _ => writeln!(text)?,
        }
    }
    match &document.step_check {
        Some(half) if !half.change_per_sample.is_finite() => {
            writeln!(text, "step-size check: the response is zero")
        }
        Some(half) => writeln!(
            text,
            "step-size check: halving the step changes the response by at most {} % of its peak",
            at_most(100.0 * half.change_per_sample, 2)
        ),
        None if !document.is_simulated() => Ok(()),
        None => writeln!(text, "step-size check: no response with half the step"),
    }
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

/// Iterations in all, and in parentheses those of the reported fit and of the others: along the path of weights, or from other
/// starting points.
pub(super) fn iterations(document: &ResultDocument) -> String {
    let last = document.counts.iterations;
    let attempts = document.attempts.iter().map(|attempt| attempt.iterations);
    let (others, what) = match &document.weights {
        Some(weights) => {
            let fits = count(weights.path.len(), "weight");
            (weights.iterations(), format!("along the path of {fits}"))
        }
        None if document.attempts.len() < 2 => (0, String::new()),
        // Sigma is estimated after the attempts.
        None if document.estimates_sigma() => (attempts.sum(), "before sigma was estimated".into()),
        None => (
            attempts.sum::<u64>().saturating_sub(last),
            "in other attempts".into(),
        ),
    };
    let all = count((last + others) as usize, "iteration");
    match what.is_empty() {
        true => all,
        false => format!("{all} ({last} in the final fit, {others} {what})"),
    }
}

/// Numbers with five decimals, or in powers of ten if the largest is below 0.01 or at least 10^6. Zero has no sign.
pub(super) fn alike<const N: usize>(numbers: [f64; N]) -> [String; N] {
    let largest = numbers.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    match largest == 0.0 || (1e-2..1e6).contains(&largest) {
        true => numbers.map(decimals),
        false => numbers.map(|x| format!("{x:.5e}")),
    }
}

fn decimals(x: f64) -> String {
    let text = format!("{x:.5}");
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|b| b == b'0' || b == b'.') => zero.into(),
        _ => text,
    }
}

fn write_functions(text: &mut String, document: &ResultDocument) -> std::fmt::Result {
    let has_truth = document
        .functions
        .values()
        .any(|f| f.truth_max_error.is_some());
    let longest = document.functions.keys().map(String::len).max();
    let width = longest.unwrap_or(0).max(10);
    write!(text, "{:<width$} {:>12} {:>12}", "function", "min", "max")?;
    if has_truth {
        write!(text, " {:>14} {:>14}", "max error", "rms error")?;
    }
    writeln!(text)?;
    for (name, function) in document.all_functions() {
        let [min, max] = match function.negligible {
            true => [0.0; 2].map(decimals),
            false => alike([function.min, function.max]),
        };
        write!(text, "{name:<width$} {min:>12} {max:>12}")?;
        if let (Some(most), Some(rms)) = (function.truth_max_error, function.truth_rms_error) {
            write!(text, " {most:>14.3e} {rms:>14.3e}")?;
        }
        let is_identifiable = function.verdict != Some(ClassificationKind::NotIdentified);
        match function.standard_error.filter(|_| !function.negligible) {
            _ if !is_identifiable => write!(text, "  not identifiable")?,
            Some(error) => write!(text, "  s.e. {error:.2e}")?,
            None => {}
        }
        writeln!(text)?;
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
    fn zero_has_no_sign() {
        assert_eq!(decimals(-1e-9), "0.00000");
        assert_eq!(decimals(-0.0), "0.00000");
        assert_eq!(decimals(-1e-5), "-0.00001");
        assert_eq!(decimals(-0.09917), "-0.09917");
        assert_eq!(decimals(12.0), "12.00000");
    }

    #[test]
    fn counts_have_singular_and_plural() {
        assert_eq!(count(1, "row"), "1 row");
        assert_eq!(count(0, "row"), "0 rows");
        assert_eq!(count(2, "row"), "2 rows");
    }
}
