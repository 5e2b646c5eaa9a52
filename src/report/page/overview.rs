//! Status, key figures, and the tables of coefficients and records.

use super::table::{list, number, table};
use crate::report::FittedModel;
use crate::report::document::{ChannelSummary, ResultDocument};
use crate::report::text::prose;
use kmcfit_core::assessment::FunctionSummary;
use kmcfit_core::functions::Ratio;
use kmcfit_core::identifiability::ClassificationKind;
use kmcfit_core::number_format::count;
use kmcfit_core::solvers::Status;

/// Status of the solver as a coloured word, and the reason.
pub(super) fn state(document: &ResultDocument) -> String {
    let outcome = &document.outcome;
    let colour = match outcome.status {
        Status::Converged | Status::Completed => "good",
        Status::Failed | Status::Infeasible => "bad",
        _ => "warn",
    };
    format!(
        "<p><span class=\"state {colour}\">{}</span> {}</p>\n",
        outcome.status.name(),
        prose(&outcome.reason)
    )
}

/// Table of the functions that vary, in the order of the equation of motion, then those of single experiments: constants stand in the
/// answer. With a known true system all functions with their errors.
pub(super) fn functions(document: &ResultDocument) -> String {
    let is_new =
        |f: &FunctionSummary| f.truth_max_error.is_some() || (f.min != f.max && !f.negligible);
    let functions = document.all_functions().filter(|(_, f)| is_new(f));
    let functions: Vec<(&str, &FunctionSummary)> = functions.collect();
    let has_truth = functions.iter().any(|(_, f)| f.truth_max_error.is_some());
    let has_error = functions
        .iter()
        .any(|(_, f)| f.standard_error.is_some() && !f.negligible);
    let has_verdict = functions.iter().any(|(_, f)| f.verdict.is_some());
    let mut headings = vec!["function", "smallest", "largest", "unit"];
    headings.extend(has_error.then_some("standard error"));
    headings.extend(has_verdict.then_some("identified"));
    if has_truth {
        headings.extend(["max error", "rms error"]);
    }
    let known = |x: Option<f64>| x.map_or(String::new(), number);
    let row = |(name, f): &(&str, &FunctionSummary)| {
        let is_identifiable = f.verdict != Some(ClassificationKind::NotIdentified);
        let [low, high] = match (is_identifiable, f.negligible) {
            (false, _) => [String::new(), String::new()],
            (true, true) => [number(0.0), number(0.0)],
            (true, false) => [number(f.min), number(f.max)],
        };
        let error = f
            .standard_error
            .filter(|_| is_identifiable && !f.negligible);
        let mut cells = vec![name.to_string(), low, high, f.unit.clone()];
        cells.extend(has_error.then(|| known(error)));
        cells.extend(has_verdict.then(|| verdict_in_words(f.verdict).to_owned()));
        if has_truth {
            cells.extend([known(f.truth_max_error), known(f.truth_rms_error)]);
        }
        cells
    };
    let rows: Vec<Vec<String>> = functions.iter().map(row).collect();
    table("Coefficients", &headings, &rows)
}

/// Table of undamped natural frequency and damping ratio of each record, means over it, where records have coefficients of their own.
pub(super) fn ratios_of_records(run: &FittedModel) -> String {
    let problem = &run.model.problem;
    if problem.functions.coefficient_sets().len() < 2 {
        return String::new();
    }
    let mean = |values: &[f64]| number(values.iter().sum::<f64>() / values.len().max(1) as f64);
    let rows = problem.experiments.iter().map(|experiment| {
        let nodal = run.fit.best.evaluation.nodal_of(experiment.coefficient_set);
        let mean = |ratio: Ratio| mean(&ratio.at_nodes(problem.system.laws(), nodal));
        vec![
            experiment.name.clone(),
            format!("{} Hz", mean(Ratio::NaturalFrequency)),
            mean(Ratio::DampingRatio),
        ]
    });
    let headings = ["record", "undamped natural frequency", "damping ratio"];
    table("Records", &headings, &rows.collect::<Vec<_>>())
}

/// A classification as an entry of the table.
fn verdict_in_words(verdict: Option<ClassificationKind>) -> &'static str {
    match verdict {
        Some(ClassificationKind::Identified) => "yes",
        Some(ClassificationKind::Conditional) => "for this smoothness",
        Some(ClassificationKind::OnlyRatio) => "ratio only",
        Some(ClassificationKind::PartlyIdentified) => "partly",
        Some(ClassificationKind::NotIdentified) => "no",
        Some(ClassificationKind::Fixed) => "fixed",
        None => "",
    }
}

/// Table of the fit of each channel, validation records included.
pub(super) fn records(document: &ResultDocument) -> String {
    let mut rows = Vec::new();
    let mut notes = Vec::new();
    for (name, channel) in document.records() {
        rows.push(record(&name, channel));
        let about = format!("{name}, {}", channel.kind);
        notes.extend(channel.ignored.iter().map(|ignored| {
            let samples = count(ignored.samples, "sample");
            format!("{about}: {samples} not used: {}", ignored.reason)
        }));
    }
    for out in &document.validation {
        let failure = out.failure.as_ref();
        notes.extend(failure.map(|f| format!("{}: no response: {f}", out.title())));
    }
    let headings = [
        "record",
        "channel",
        "fit",
        "rms residual",
        "sigma",
        "samples",
    ];
    table("Fit of each channel", &headings, &rows) + &list(&notes)
}

fn record(name: &str, channel: &ChannelSummary) -> Vec<String> {
    let with_unit = |x: f64| format!("{} {}", number(x), channel.unit);
    let sigma = channel
        .sigma
        .map_or("–".into(), |sigma| match channel.sigma_estimated {
            true => format!("{}, estimated", with_unit(sigma)),
            false => with_unit(sigma),
        });
    vec![
        name.into(),
        channel.kind.clone(),
        match channel.fit_percent.is_finite() {
            true => format!("{:.2} %", channel.fit_percent),
            false => "–".into(),
        },
        with_unit(channel.rms_residual),
        sigma,
        channel.samples.to_string(),
    ]
}
