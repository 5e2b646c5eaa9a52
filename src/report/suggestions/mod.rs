//! Suggestions: changes of the model that may explain what the fit does not, and steps outside the model, the most urgent first. A change is
//! [tried](super::trial) before it is recommended.

mod candidates;
mod records;
mod residuals;
mod terms;

use super::document::{ExperimentSummary, ResultDocument};
use crate::config::{AutomaticGrid, Model};
use crate::escape::shell_quoted;
use candidates::about_candidates;
pub use candidates::overrides_of;
use kmcfit_core::assessment::{Doubt, EXACT, POOR};
use kmcfit_core::diagnostics::SIGNIFICANCE;
use kmcfit_core::finding::Finding;
use kmcfit_core::number_format::significant;
use kmcfit_core::problem::FEW_PARAMETERS;
use kmcfit_core::solvers::{Solver, StartStrategy, Status};
use records::{about_disturbance, about_error, about_interpolation};
use residuals::{about_misfit, about_patterns};
use serde_json::json;
use terms::{about_term, about_width};

/// Most pieces of advice.
pub const MOST: usize = 3;
/// Largest change of the response by halving the step, relative to its peak.
const COARSE: f64 = 1e-3;

/// What a suggestion asks for.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// Something outside the model, or nothing.
    Outside,
    /// A change of the model that takes longer than the fit, or of a file.
    Untried,
    /// A change of the model: overrides as for `--set`.
    Change(Vec<String>),
}

/// A suggestion.
#[derive(Debug, Clone, PartialEq)]
pub struct Suggestion {
    kind: &'static str,
    text: String,
    /// What it asks for.
    pub step: Step,
}

impl Suggestion {
    /// Something to be done outside the model, or a statement that nothing is to be done.
    fn outside(kind: &'static str, text: impl Into<String>) -> Self {
        let text = text.into();
        Self {
            kind,
            text,
            step: Step::Outside,
        }
    }

    /// A change of a file, or of the model, that is not tried.
    fn untried(kind: &'static str, text: impl Into<String>) -> Self {
        Self {
            step: Step::Untried,
            ..Self::outside(kind, text)
        }
    }

    /// A change of the model by overrides.
    fn change(kind: &'static str, text: impl Into<String>, overrides: Vec<String>) -> Self {
        Self {
            step: Step::Change(overrides),
            ..Self::outside(kind, text)
        }
    }

    /// With the experiments by their numbers in the file, given those of the experiments of the document.
    fn in_file(mut self, positions: &[usize]) -> Self {
        let number = |text: &str| {
            let (i, key) = text.strip_prefix("experiments.")?.split_once('.')?;
            let position = positions.get(i.parse::<usize>().ok()?)?;
            Some(format!("experiments.{position}.{key}"))
        };
        if let Step::Change(overrides) = &mut self.step {
            for text in overrides {
                *text = number(text).unwrap_or_else(|| std::mem::take(text));
            }
        }
        self
    }

    /// The suggestion as a finding, with what is known of the change: `tried: Adequate`, `not tried`.
    pub fn finding(&self, outcome: Option<&str>) -> Finding {
        let mut text = self.text.clone();
        let mut finding = Finding::new(self.kind, "");
        if let Step::Change(overrides) = &self.step {
            let set = overrides
                .iter()
                .map(|o| format!("--set {}", shell_quoted(o)));
            let set: Vec<String> = set.collect();
            text += &format!(": `{}`", set.join(" "));
            finding = finding.with("set", overrides);
        }
        if let Some(outcome) = outcome {
            text += &format!(" ({outcome})");
            finding = finding.with("tried", outcome);
        }
        Finding {
            sentence: text,
            ..finding
        }
    }
}

/// The suggestions of a document of a fit of the model: what ended the search, and the steps; the advice of each doubt, in the order of the reasons of the verdict, which has what is
/// most severe first, and causes before what they leave in the residuals; then what the residuals and the estimates ask for without a doubt.
pub fn suggestions(document: &ResultDocument, model: &Model) -> Vec<Suggestion> {
    if let Some(codes) = about_codes(model) {
        // They spoil all else.
        return vec![codes];
    }
    let of_doubts = document.doubts().flat_map(|doubt| match doubt {
        Doubt::Preferred { candidates } => about_candidates(candidates, true, document, model),
        Doubt::AsGood { candidates } => about_candidates(candidates, false, document, model),
        _ => about_doubt(doubt, document, model).into_iter().collect(),
    });
    let steps = (about_ending(document).into_iter())
        .chain(about_steps(document, model))
        .chain(of_doubts)
        .chain(about_patterns(document))
        .chain(about_misfit(document, model))
        .chain(about_constants(document))
        .chain(about_rank(document));
    let mut in_file: Vec<Suggestion> = Vec::new();
    for step in steps.map(|step| step.in_file(&model.positions)) {
        // Several findings may ask for one change.
        let is_new = |known: &Suggestion| match step.step {
            Step::Outside => *known != step,
            _ => known.step != step.step,
        };
        if in_file.iter().all(is_new) {
            in_file.push(step);
        }
    }
    in_file
}

/// The advice of a doubt.
fn about_doubt(doubt: &Doubt, document: &ResultDocument, model: &Model) -> Option<Suggestion> {
    match doubt {
        Doubt::RecordError(error) => about_error(error, document, model),
        Doubt::MissingTerm(missing) => Some(about_term(missing)),
        Doubt::FrictionWidth {
            width,
            better,
            errors,
            ..
        } => Some(about_width(*width, *better, *errors)),
        Doubt::DisturbedInput {
            experiment,
            input,
            sigma,
            ..
        } => about_disturbance(document, model, experiment, input.name(), *sigma),
        Doubt::InterpolationLoss {
            experiment, input, ..
        } => about_interpolation(document, experiment, *input),
        _ => None,
    }
}

/// The suggestions as advice without trials, where the model file is not at hand.
pub fn untried(document: &ResultDocument, model: &Model) -> Vec<Finding> {
    let all = suggestions(document, model).into_iter().take(MOST);
    let stated = |suggestion: Suggestion| match suggestion.step {
        Step::Outside => suggestion.finding(None),
        _ => suggestion.finding(Some("not tried")),
    };
    all.map(stated).collect()
}

/// Overrides of a key in each experiment with this channel.
fn of_channel(
    document: &ResultDocument,
    channel: &str,
    change: impl Fn(usize) -> Vec<String>,
) -> Vec<String> {
    let experiments = document.experiments.iter().enumerate();
    let has_channel = |e: &ExperimentSummary| e.channels.iter().any(|c| c.kind == channel);
    experiments
        .filter(|(_, e)| has_channel(e))
        .flat_map(|(i, _)| change(i))
        .collect()
}

/// Number of the experiment with this name.
fn position(document: &ResultDocument, experiment: &str) -> Option<usize> {
    document
        .experiments
        .iter()
        .position(|e| e.name == experiment)
}

/// Text of a number for a model file: digits that a start or a width needs.
fn written(value: f64) -> String {
    let rounded: f64 = significant(value, 3).parse().unwrap_or(value);
    format!("{rounded:?}")
}

/// Statement of the codes that stand for missing samples.
fn about_codes(model: &Model) -> Option<Suggestion> {
    let overrides = model.doubts().filter_map(|doubt| {
        let Doubt::MissingCodes {
            experiment, codes, ..
        } = doubt
        else {
            return None;
        };
        let mut experiments = model.problem.experiments.iter();
        let i = experiments.position(|e| e.name == *experiment)?;
        let i = model.positions.get(i)?;
        Some(format!("experiments.{i}.missing={}", json!(codes)))
    });
    let overrides: Vec<String> = overrides.collect();
    (!overrides.is_empty()).then(|| {
        let what = "state the values that stand for missing samples";
        Suggestion::change("missing_codes", what, overrides)
    })
}

fn about_ending(document: &ResultDocument) -> Option<Suggestion> {
    let is_newton = document.model.method == Solver::GaussNewton.name();
    let tried = |start: StartStrategy| document.attempts.iter().any(|a| a.start == start.name());
    match document.outcome.status {
        Status::MaxIterations => Some(Suggestion::untried(
            "more_iterations",
            "iteration limit reached: raise it with fit.stop.iterations",
        )),
        Status::TimeLimit => Some(Suggestion::untried(
            "more_time",
            "time limit reached: raise it with fit.stop.seconds",
        )),
        Status::Stalled if !is_newton => Some(Suggestion::change(
            "another_method",
            "the search stalled: use another method",
            vec![format!("fit.method={}", Solver::GaussNewton.name())],
        )),
        // The minimum of an equation error does not depend on the start.
        Status::Infeasible if !document.is_simulated() => None,
        Status::Stalled | Status::Failed if !tried(StartStrategy::EquationError) => {
            Some(Suggestion::change(
                "start_from_data",
                "start from the record",
                vec!["fit.initial=data".to_owned()],
            ))
        }
        Status::Stalled | Status::Infeasible | Status::Failed => Some(Suggestion::untried(
            "another_start",
            "use another starting point (other `start` values) or soft constraints (`soft`)",
        )),
        Status::Interrupted | Status::Converged | Status::Completed => None,
    }
}

/// A finer grid where the step-size check fails; an automatic number of nodes where a fit refines it.
fn about_steps(document: &ResultDocument, model: &Model) -> Option<Suggestion> {
    let half = document.step_check.as_ref()?;
    let is_exact = document.worst_fit().is_some_and(|worst| worst > EXACT);
    let beside_residuals = match is_exact {
        true => 0.0,
        false => half.change_per_residual,
    };
    // A coefficient that varies within a period is rough on every grid.
    let is_fast = document
        .doubts()
        .any(|doubt| matches!(doubt, Doubt::FastVariation { .. }));
    if is_fast || half.change_per_sample <= COARSE && beside_residuals <= 1.0 {
        return None;
    }
    let summary = &document.model;
    let refines = [Solver::GaussNewton, Solver::ProjectedGradient];
    let is_refined = refines.iter().any(|solver| summary.method == solver.name());
    let is_chosen = model.grid.as_ref().is_some_and(AutomaticGrid::is_chosen);
    // The steps of a chosen grid are not why a model does not fit.
    if is_chosen && document.worst_fit().is_some_and(is_poor) {
        return None;
    }
    let automatic = is_refined && summary.parameters <= FEW_PARAMETERS && !is_chosen;
    let nodes = match automatic {
        true => "auto".to_owned(),
        false => (2 * summary.nodes - 1).to_string(),
    };
    Some(Suggestion::change(
        "finer_steps",
        "the time step is too coarse: use more nodes",
        vec![format!("grid.nodes={nodes}")],
    ))
}

/// The function whose constancy is not rejected at the level [`SIGNIFICANCE`], with the largest p-value.
fn about_constants(document: &ResultDocument) -> Option<Suggestion> {
    let functions = document.functions.iter();
    let probable = functions.filter_map(|(name, f)| Some((name, f.constant_p_value?)));
    let (name, p) = probable.max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    let is_shared = !name.contains(' ');
    (p >= SIGNIFICANCE && is_shared).then(|| {
        Suggestion::change(
            "constant",
            format!(
                "a constant {name} is not rejected (Wald test, p = {})",
                significant(p, 1)
            ),
            vec![format!("functions.{name}={{basis: constant}}")],
        )
    })
}

/// A study of a model whose parameters are not all identifiable.
fn about_rank(document: &ResultDocument) -> Option<Suggestion> {
    let known = &document.identifiability;
    // Constraints may determine what the records do not.
    let is_open = known.rank_bound < known.parameters && document.fit_warnings().next().is_some();
    let is_smooth = document.cost.regularisation > 0.0;
    let is_constant = document.functions.values().all(|f| f.min == f.max);
    (document.is_simulated() && is_open).then(|| {
        let simpler = match is_smooth || is_constant {
            true => "",
            false => "use fewer parameters (`knots`) or add a `penalty`; ",
        };
        Suggestion::outside(
            "study_unidentifiable",
            format!("{simpler}`kmcfit study` lists the identifiable parameter combinations"),
        )
    })
}

/// True where the fit leaves residuals that no noise explains.
pub(super) fn is_unexplained(document: &ResultDocument) -> bool {
    document
        .doubts()
        .any(|doubt| matches!(doubt, Doubt::PoorFit { .. } | Doubt::Coloured { .. }))
        && document.worst_fit().is_some_and(|worst| worst < EXACT)
}

/// True for a fit below [`POOR`].
fn is_poor(fit_percent: f64) -> bool {
    fit_percent.is_finite() && fit_percent < POOR
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_a_text_for_the_command_line_with_its_outcome() {
        let overrides = vec!["functions.cubic_stiffness={start: 1.0}".to_owned()];
        let change = Suggestion::change("add_term", "add the missing term", overrides.clone());
        let finding = change.finding(Some("tried: Adequate"));
        assert_eq!(
            finding.sentence,
            "add the missing term: `--set 'functions.cubic_stiffness={start: 1.0}'` (tried: Adequate)"
        );
        assert_eq!(finding.quantities["set"], serde_json::json!(overrides));
        assert_eq!(finding.quantities["tried"], "tried: Adequate");
        let outside = Suggestion::outside("noise_limited", "noise limits the fit").finding(None);
        assert_eq!(outside.sentence, "noise limits the fit");
        assert!(outside.quantities.is_empty());
    }

    #[test]
    fn experiments_have_their_numbers_in_the_file() {
        let overrides = ["experiments.1.initial=estimate", "fit.initial=data"];
        let change = Suggestion::change("a", "b", overrides.map(str::to_owned).to_vec());
        let expected = ["experiments.2.initial=estimate", "fit.initial=data"];
        assert_eq!(
            change.in_file(&[0, 2]).step,
            Step::Change(expected.map(str::to_owned).to_vec())
        );
    }

    #[test]
    fn numbers_for_a_model_have_few_digits() {
        assert_eq!(written(49_876.4), "49900.0");
        assert_eq!(written(-2.004e-5), "-2e-5");
    }
}
