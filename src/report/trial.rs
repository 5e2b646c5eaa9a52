//! Advice is tried before it is given: each change of the model is fitted, and recommended only if the verdict or the criterion improves.
//!
//! A trial of other functions or nodes, or of another interpolation, starts at the estimates of a fit that is converged and not inadequate. All trials together have the
//! iterations of the fit and those that take the time of its assessment, counted at the nodes of its grid; what does not fit into these is
//! *not tried*. The number of iterations, not the time, is the limit: the same input gives the same advice on every machine.

use super::document::{ResultDocument, level_in_words};
use super::fit_assessment::RunAssessment;
use super::run::{FittedModel, RequestedFiles};
use super::suggestions::{MOST, Step, is_unexplained, suggestions};
use crate::config::{BuildMode, Model, ModelFile, Override, build};
use crate::fitting::fit_model;
use kmcfit_core::assessment::VerdictLevel;
use kmcfit_core::finding::Finding;
use kmcfit_core::number_format::significant;
use kmcfit_core::solvers::{Fit, Initial, IterationRecord, Observer, Status};
use std::cmp::Ordering::Equal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Iterations that take the time of an assessment: its refits, tests and a response with half the step.
const ASSESSMENT: usize = 20;
/// Iterations times nodes that take a few hundredths of a second, which nobody waits for.
const SHORT: usize = 100_000;
/// Decrease of BIC from which a change is worth it: odds of 20 to 1 (6 = 2 ln 20).
const BETTER: f64 = 6.0;

/// Most nodes of records with errors of an input in a trial: their filter costs about 0.15 ms a node in all iterations of a fit.
const MOST_FILTERED: usize = 8192;

/// How much a change improves the fit: the levels of the verdict, then the decrease of the criterion.
#[derive(PartialEq, PartialOrd)]
struct Gain(u8, f64);

/// Result of a trial.
enum Outcome {
    /// What became better.
    Better(Gain, String),
    /// The change cannot be made, or nothing became better.
    Worse,
    /// It would take longer than the fit.
    TooLong,
}

/// Advice on a fit: its suggestions, those that change the model tried.
pub fn advice(
    file: &ModelFile,
    model: &Model,
    fit: &Fit,
    document: &ResultDocument,
) -> Vec<Finding> {
    let searches = fit.attempts.iter().map(|attempt| attempt.history.len());
    let iterations = ASSESSMENT + searches.sum::<usize>() + fit.history.len();
    let mut left = SHORT.max(iterations * nodes(model));
    let mut better: Vec<(Gain, Finding)> = Vec::new();
    let mut others: Vec<Finding> = Vec::new();
    for suggestion in suggestions(document, model) {
        match &suggestion.step {
            Step::Outside => others.push(suggestion.finding(None)),
            Step::Untried => others.push(suggestion.finding(Some("not tried"))),
            Step::Change(overrides) => {
                match tried(file, model, fit, document, overrides, &mut left) {
                    Outcome::Better(gain, words) => {
                        let words = format!("tried: {words}");
                        better.push((gain, suggestion.finding(Some(&words))));
                    }
                    Outcome::TooLong => others.push(suggestion.finding(Some("not tried"))),
                    Outcome::Worse => {}
                }
            }
        }
    }
    // The sort is stable: equal ones keep the order of the suggestions.
    better.sort_by(|(a, _), (b, _)| b.partial_cmp(a).unwrap_or(Equal));
    let mut found: Vec<Finding> = better.into_iter().map(|(_, finding)| finding).collect();
    found.extend(others);
    found.truncate(MOST);
    if found.is_empty() && is_unexplained(document) {
        found.push(match document.has_two_modes() {
            true => Finding::new(
                "two_modes",
                "one oscillator cannot have two modes: measure or excite where one of them is at rest, or fit a part of the record in which one alone moves",
            ),
            false => Finding::new(
                "unexplained",
                "nothing that was tried explains the residuals: look at their figures in report.html, and measure again where a sensor or a force is in doubt",
            ),
        });
    }
    found
}

/// Nodes of the records with errors of an input.
fn filtered_nodes(model: &Model) -> usize {
    let experiments = model.problem.experiments.iter();
    let filtered = experiments.filter(|experiment| experiment.input_error.is_some());
    filtered.map(|experiment| experiment.nodes).sum()
}

/// Nodes of all records.
fn nodes(model: &Model) -> usize {
    let experiments = model.problem.experiments.iter();
    experiments.map(|experiment| experiment.nodes).sum()
}

/// Fits the changed model in at most `left` iterations times nodes, which are counted down.
fn tried(
    file: &ModelFile,
    before: &Model,
    fit: &Fit,
    document: &ResultDocument,
    overrides: &[String],
    left: &mut usize,
) -> Outcome {
    let stop = before.settings.interrupt.clone();
    let is_stopped = || {
        stop.as_ref()
            .is_some_and(|stop| stop.load(Ordering::Relaxed))
    };
    if *left == 0 || is_stopped() {
        return Outcome::TooLong;
    }
    let changed = Override::parse_all(overrides)
        .and_then(|overrides| file.clone().with_overrides(&overrides))
        .and_then(|file| build(&file, BuildMode::Fit));
    let Ok(mut model) = changed else {
        return Outcome::Worse;
    };
    if filtered_nodes(&model) > filtered_nodes(before) + MOST_FILTERED {
        return Outcome::TooLong;
    }
    let functions = &before.problem.functions;
    let start = (model.problem.functions).start_at(functions, &fit.best.parameters);
    let near = (model.problem.clone()).with(|parts| parts.functions.set_start(&start));
    let level = document.verdict.as_ref().map(|verdict| verdict.level);
    let of_model = |o: &String| {
        o.starts_with("functions.") || o.starts_with("grid.") || o.contains(".force.interpolation=")
    };
    let is_near = fit.outcome.status == Status::Converged
        && level != Some(VerdictLevel::Inadequate)
        && overrides.iter().all(of_model);
    if let (Ok(near), true) = (near, is_near) {
        model.problem = near;
        model.settings.initial = Initial::Near;
    }
    let each = nodes(&model);
    let limit = Arc::new(AtomicBool::new(false));
    model.settings.interrupt = Some(Arc::clone(&limit));
    let mut count = |_: &IterationRecord| {
        *left = left.saturating_sub(each);
        if *left == 0 || is_stopped() {
            limit.store(true, Ordering::Relaxed);
        }
    };
    let fitted = fit_model(&model, &mut Observer::new(&mut count));
    if limit.load(Ordering::Relaxed) {
        return Outcome::TooLong;
    }
    let Ok(found) = fitted else {
        return Outcome::Worse;
    };
    let assessment = RunAssessment::of(&found.model, &found.fit);
    if !assessment.not_done.is_empty() {
        return Outcome::TooLong;
    }
    let fitted = FittedModel {
        model: &found.model,
        fit: &found.fit,
        predictions: &[],
        weights: None,
        run_assessment: &assessment,
        requested: RequestedFiles::default(),
        computed: Default::default(),
    };
    let level = fitted.verdict().level;
    let level_before = document.verdict.as_ref().map(|verdict| verdict.level);
    let bic = assessment
        .assessment
        .as_ref()
        .and_then(|a| a.statistics.bic);
    // Sigmas, losses and filters change what the criterion compares.
    let changes = [".sigma.", ".loss.", ".band."];
    let is_comparable = !overrides
        .iter()
        .any(|o| changes.iter().any(|key| o.contains(key)));
    let gain = document.statistics.bic.zip(bic).filter(|_| is_comparable);
    let gain = gain.map(|(before, after)| before - after);
    match (level_before, gain) {
        (Some(before), _) if level < before => {
            let steps = before as u8 - level as u8;
            Outcome::Better(
                Gain(steps, gain.unwrap_or(0.0)),
                level_in_words(level).to_owned(),
            )
        }
        (Some(before), Some(gain)) if level == before && gain > BETTER => {
            Outcome::Better(Gain(0, gain), format!("BIC {} lower", significant(gain, 2)))
        }
        _ => Outcome::Worse,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_better_verdict_precedes_a_better_criterion() {
        assert!(Gain(1, -5.0) > Gain(0, 300.0));
        assert!(Gain(1, 9.0) > Gain(1, 8.0));
    }
}
