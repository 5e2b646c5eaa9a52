//! `kmcfit fit --select`: adds the candidate that is preferred to the model, fits, and asks again, until none is preferred.

use super::document::{ResultDocument, SelectionStep};
use super::suggestions::overrides_of;
use super::{CompletedFit, RequestedFiles};
use crate::config::{BuildMode, Model, ModelFile, Override, build};
use crate::fitting::{ModelFit, fit_model};
use kmcfit_core::assessment::{Doubt, VerdictLevel};
use kmcfit_core::candidates::Candidate;
use kmcfit_core::finding::Finding;
use kmcfit_core::solvers::{Initial, IterationRecord, Observer, Status};
use std::collections::BTreeMap;
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

/// Adds what is preferred to the model of a fit, as long as a key of the model file states it and the fit with it converges. What is as good as an
/// addition is a reason of the verdict, and the intervals are those of all of these models together.
pub fn select(file: &ModelFile, fit: CompletedFit, requested: RequestedFiles) -> Selected {
    let mut now = Selected::of(file, fit, requested);
    let mut steps: Vec<SelectionStep> = Vec::new();
    let mut others = Others::default();
    let mut count = 0;
    while let Some((best, as_good)) = preferred(&now.document) {
        count += best.additions.len();
        let interrupt = now.fit.model.settings.interrupt.as_ref();
        let is_stopped = interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed));
        if count > MOST || is_stopped {
            break;
        }
        let Some((next, mut step)) = with(&now, &best, requested) else {
            break;
        };
        step.as_good = as_good.iter().map(|other| other.words.clone()).collect();
        others.add(&now, &next, as_good);
        steps.push(step);
        now = next;
    }
    others.state(&mut now.document);
    now.document.selection = steps;
    now
}

/// The candidate that is preferred to the model of a document, and those that are as good.
fn preferred(document: &ResultDocument) -> Option<(Candidate, Vec<Candidate>)> {
    let mut ties = document.candidates.as_ref()?.ties().into_iter();
    Some((ties.next()?, ties.collect()))
}

/// Models that are as good as those with what was added.
#[derive(Default)]
struct Others {
    candidates: Vec<Candidate>,
    /// How far their intervals extend beyond both ends of those of the model, by the name of the estimate.
    beyond: BTreeMap<String, [f64; 2]>,
}

impl Others {
    /// Adds those that are as good as what leads from one model to the next.
    fn add(&mut self, now: &Selected, next: &Selected, as_good: Vec<Candidate>) {
        for other in as_good {
            self.widen(now, next, &other);
            self.candidates.push(other);
        }
    }

    fn widen(&mut self, now: &Selected, next: &Selected, other: &Candidate) -> Option<()> {
        let (_, mut model, _) = changed(now, other)?;
        // Its own candidates are not asked for.
        model.tests_bases = false;
        let fit = CompletedFit::of(converged(&model)?);
        let document = fit.fitted(RequestedFiles::default()).document();
        for (name, own) in &next.document.estimates.0 {
            let there = document.estimates.get(name).and_then(|there| there.ci95);
            if let (Some(own), Some(there)) = (own.ci95, there) {
                let beyond = self.beyond.entry(name.clone()).or_default();
                beyond[0] = beyond[0].min(there[0] - own[0]);
                beyond[1] = beyond[1].max(there[1] - own[1]);
            }
        }
        Some(())
    }

    /// Widens the intervals of a document, and adds the reason to its verdict.
    fn state(self, document: &mut ResultDocument) {
        if self.candidates.is_empty() {
            return;
        }
        for (name, estimate) in &mut document.estimates.0 {
            if let (Some([low, high]), Some(beyond)) = (&mut estimate.ci95, self.beyond.get(name)) {
                *low += beyond[0];
                *high += beyond[1];
            }
        }
        if let Some(verdict) = &mut document.verdict {
            let reason = Finding::from(Doubt::AsGood {
                candidates: self.candidates,
            });
            verdict.level = verdict.level.max(VerdictLevel::of(reason.severity));
            verdict.reasons.push(reason);
            verdict.passed.clear();
        }
    }
}

/// The model with a candidate, at the start of its fit, its file, and the overrides that add it.
fn changed(now: &Selected, candidate: &Candidate) -> Option<(ModelFile, Model, Vec<String>)> {
    let set = overrides_of(candidate, &now.document, &now.fit.model)?;
    let overrides = Override::parse_all(&set).ok()?;
    let file = now.file.clone().with_overrides(&overrides).ok()?;
    let mut model = build(&file, BuildMode::Fit).ok()?;
    let functions = &model.problem.functions;
    let start = match candidate.parameters_by_name.is_empty() {
        // Noise of an input changes no parameter.
        true => functions.start_at(
            &now.fit.model.problem.functions,
            &now.fit.fit.best.parameters,
        ),
        false => candidate.start(functions),
    };
    model.problem = (model.problem)
        .with(|parts| parts.functions.set_start(&start))
        .ok()?;
    model.settings.initial = Initial::Near;
    model.settings.interrupt = now.fit.model.settings.interrupt.clone();
    Some((file, model, set))
}

/// The fit of a model, if it converges.
fn converged(model: &Model) -> Option<ModelFit> {
    let mut ignore = |_: &IterationRecord| {};
    let found = fit_model(model, &mut Observer::new(&mut ignore)).ok()?;
    (found.fit.outcome.status == Status::Converged).then_some(found)
}

fn with(
    now: &Selected,
    best: &Candidate,
    requested: RequestedFiles,
) -> Option<(Selected, SelectionStep)> {
    let (file, model, set) = changed(now, best)?;
    let next = Selected::of(&file, CompletedFit::of(converged(&model)?), requested);
    let both = |name: &str| {
        let value = |document: &ResultDocument| document.estimates.get(name).map(|e| e.value);
        Some([value(&now.document)?, value(&next.document)?])
    };
    let step = SelectionStep {
        added: best.words.clone(),
        as_good: Vec::new(),
        gain: best.gain,
        estimates: best.estimates.clone(),
        set,
        natural_frequency: both("natural_frequency"),
        damping_ratio: both("damping_ratio"),
    };
    Some((next, step))
}
