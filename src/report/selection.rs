//! `kmcfit fit --select`: adds the candidate that is preferred to the model, fits, and asks again, until none is preferred.

use super::document::{ResultDocument, SelectionStep};
use super::suggestions::overrides_of;
use super::{CompletedFit, RequestedFiles};
use crate::config::{BuildMode, ModelFile, Override, build};
use crate::fitting::fit_model;
use kmcfit_core::candidates::Candidate;
use kmcfit_core::solvers::{Initial, IterationRecord, Observer, Status};
use std::sync::atomic::Ordering;

/// Most additions; a pair is two.
const MOST: usize = 5;

/// A fit with its model file and document.
pub struct Selected {
    /// The model file with the additions.
    pub file: ModelFile,
    /// The fit.
    pub fit: CompletedFit,
    /// Its document, with the steps.
    pub document: ResultDocument,
}

impl Selected {
    /// A fit without additions.
    pub fn of(file: &ModelFile, fit: CompletedFit, requested: RequestedFiles) -> Self {
        let document = fit.fitted(requested).document_and_figures();
        Self {
            file: file.clone(),
            fit,
            document,
        }
    }
}

/// Adds what is preferred to the model of a fit, as long as a key of the model file states it and the fit with it converges.
pub fn select(file: &ModelFile, fit: CompletedFit, requested: RequestedFiles) -> Selected {
    let mut now = Selected::of(file, fit, requested);
    let mut steps: Vec<SelectionStep> = Vec::new();
    let mut count = 0;
    while let Some(best) = preferred(&now.document) {
        count += best.additions.len();
        let interrupt = now.fit.model.settings.interrupt.as_ref();
        let is_stopped = interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed));
        if count > MOST || is_stopped {
            break;
        }
        let Some((next, step)) = with(&now, &best, requested) else {
            break;
        };
        steps.push(step);
        now = next;
    }
    now.document.selection = steps;
    now
}

/// The candidate that is preferred to the model of a document.
fn preferred(document: &ResultDocument) -> Option<Candidate> {
    document.candidates.as_ref()?.preferred().cloned()
}

fn with(
    now: &Selected,
    best: &Candidate,
    requested: RequestedFiles,
) -> Option<(Selected, SelectionStep)> {
    let set = overrides_of(best, &now.document, &now.fit.model)?;
    let overrides = Override::parse_all(&set).ok()?;
    let file = now.file.clone().with_overrides(&overrides).ok()?;
    let mut model = build(&file, BuildMode::Fit).ok()?;
    let functions = &model.problem.functions;
    let start = match best.parameters_by_name.is_empty() {
        // Noise of an input changes no parameter.
        true => functions.start_at(
            &now.fit.model.problem.functions,
            &now.fit.fit.best.parameters,
        ),
        false => best.start(functions),
    };
    model.problem = (model.problem)
        .with(|parts| parts.functions.set_start(&start))
        .ok()?;
    model.settings.initial = Initial::Near;
    model.settings.interrupt = now.fit.model.settings.interrupt.clone();
    let mut ignore = |_: &IterationRecord| {};
    let found = fit_model(&model, &mut Observer::new(&mut ignore)).ok()?;
    (found.fit.outcome.status == Status::Converged).then_some(())?;
    let next = Selected::of(&file, CompletedFit::of(found), requested);
    let both = |name: &str| {
        let value = |document: &ResultDocument| document.estimates.get(name).map(|e| e.value);
        Some([value(&now.document)?, value(&next.document)?])
    };
    let step = SelectionStep {
        added: best.words.clone(),
        gain: best.gain,
        estimates: best.estimates.clone(),
        set,
        natural_frequency: both("natural_frequency"),
        damping_ratio: both("damping_ratio"),
    };
    Some((next, step))
}
