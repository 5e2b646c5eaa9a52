//! Functions and identifiability of a run, for its result document.

use super::document::IdentifiabilitySummary;
use super::findings;
use super::knowledge::knowledge;
use super::known::HeldOut;
use super::run::FittedModel;
use kmcfit_core::internals::assessment::{FunctionSummary, function_summaries};
use kmcfit_core::internals::identifiability::{Judgement, Verdict, count};
use std::collections::BTreeMap;

impl FittedModel<'_> {
    /// What was known before the fit, and what its optimum tells, if that is a device at all; the equation error has no
    /// simulated motion to count about.
    pub(super) fn identifiability(&self) -> IdentifiabilitySummary {
        let problem = &self.model.problem;
        let knowledge = knowledge(problem);
        let Some(assessment) = &self.known.assessment else {
            let sentence = "how sure the functions are is not known: the equation error simulates no motion, and noise \
                            biases it; method: gauss-newton, with initial: data, goes on from it";
            return IdentifiabilitySummary {
                of: problem.parameters(),
                open: vec![sentence.into()],
                knowledge,
                ..IdentifiabilitySummary::default()
            };
        };
        let count = count(problem);
        let mut summary = IdentifiabilitySummary {
            seen: count.seen_at_most,
            of: count.of,
            knowledge,
            ..IdentifiabilitySummary::default()
        };
        let plausibility = &assessment.plausibility;
        if let Some(why) = &plausibility.unidentified {
            summary.open.push(findings::unidentified(why));
            return summary;
        }
        let judgements = &assessment.judgements;
        // Where constraints hold what the readings do not show, nothing of that is open.
        let all_known = !judgements.is_empty() && !judgements.iter().any(Judgement::is_open);
        if count.seen_at_most < count.of && !all_known {
            summary.open.push(count.headline());
        }
        let mut say = |is_open: bool, sentence: &String| match is_open {
            true => summary.open.push(sentence.clone()),
            false => summary.settled.push(sentence.clone()),
        };
        for statement in &count.statements {
            say(statement.is_open, &statement.sentence);
        }
        for judgement in judgements {
            if judgement.verdict != Verdict::Fixed {
                say(judgement.is_open(), &judgement.sentence);
            }
        }
        let warnings = plausibility.warnings.iter();
        summary.open.extend(warnings.map(findings::warning));
        let poor = self.known.held_out.iter().filter_map(HeldOut::poor);
        summary.open.extend(poor.map(findings::unpredicted));
        summary
    }

    pub(super) fn function_summaries(&self) -> BTreeMap<String, FunctionSummary> {
        let (problem, truth) = (&self.model.problem, self.model.truth.as_ref());
        let assessment = self.known.assessment.as_ref();
        let summaries = function_summaries(problem, self.fit, assessment, truth);
        let named = problem.functions.iter().zip(summaries);
        named
            .map(|(function, summary)| {
                let unit = self.unit(function).into();
                (function.name(), FunctionSummary { unit, ..summary })
            })
            .collect()
    }
}
