//! Functions and identifiability of a run, for its result document.

use super::document::{FunctionSummary, IdentifiabilitySummary};
use super::findings;
use super::knowledge::knowledge;
use super::known::HeldOut;
use super::run::FittedModel;
use kmcfit_core::internals::assessment::{constant_probability, standard_error};
use kmcfit_core::internals::functions::Basis;
use kmcfit_core::internals::functions::basis::physical_powers;
use kmcfit_core::internals::identifiability::{
    Judgement, Verdict, count, is_rounding, is_unhindered,
};
use kmcfit_core::internals::solvers::Status;
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
        let problem = &self.model.problem;
        let list = self.named_functions().into_iter().enumerate();
        let best = &self.fit.best;
        let sizes = problem.natural_scales(&best.evaluation);
        let assessment = self.known.assessment.as_ref();
        let is_white = assessment.is_some_and(|a| !a.plausibility.is_coloured);
        let is_minimum = self.fit.outcome.status == Status::Converged;
        let free = self.known.covariance();
        let free =
            free.filter(|_| is_white && is_minimum && is_unhindered(problem, &best.parameters));
        list.map(|(i, (function, values))| {
            let largest = values.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            let range = problem.functions.ranges()[i].clone();
            // The judgements on the functions come first, in their order.
            let judged = self.known.judgements().get(i);
            let summary = FunctionSummary {
                unit: self.unit(function).into(),
                is_rounding: largest > 0.0 && is_rounding(largest, sizes[i]),
                verdict: judged.map(|j| (&j.verdict).into()),
                known_range: judged.and_then(|j| j.known_range),
                powers: self.powers(i),
                standard_error: standard_error(function, range.start, self.known.covariance()),
                constant_p_value: free.and_then(|covariance| {
                    constant_probability(problem, i, &best.parameters, covariance)
                }),
                ..summarise(&values, self.true_function(i))
            };
            (function.name(), summary)
        })
        .collect()
    }

    /// The factors of the powers of t, if function `index` is a free polynomial.
    fn powers(&self, index: usize) -> Option<Vec<f64>> {
        let problem = &self.model.problem;
        let function = problem.functions.iter().nth(index)?;
        let Some(Basis::Polynomial { .. }) = &function.basis else {
            return None;
        };
        let range = problem.functions.ranges()[index].clone();
        let theta = &self.fit.best.parameters[range];
        Some(physical_powers(&problem.oscillator.grid, theta))
    }
}

fn summarise(values: &[f64], truth: Option<&[f64]>) -> FunctionSummary {
    let errors = |truth: &[f64]| -> Vec<f64> {
        values
            .iter()
            .zip(truth)
            .map(|(a, b)| (a - b).abs())
            .collect()
    };
    let errors = truth.map(errors);
    FunctionSummary {
        min: values.iter().copied().fold(f64::INFINITY, f64::min),
        max: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        truth_max_error: errors
            .as_ref()
            .map(|e| e.iter().copied().fold(0.0, f64::max)),
        unit: String::new(),
        is_rounding: false,
        verdict: None,
        known_range: None,
        powers: None,
        standard_error: None,
        constant_p_value: None,
        truth_rms_error: errors
            .map(|e| (e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt()),
    }
}
