//! Functions and identifiability of a fit, for its result document.

use super::assumptions::assumptions;
use super::document::IdentifiabilitySummary;
use super::findings;
use super::fit_assessment::ValidationRecord;
use super::run::FittedModel;
use kmcfit_core::assessment::{Doubt, FunctionSummary, function_summaries};
use kmcfit_core::finding::Finding;
use kmcfit_core::finding::Severity;
use kmcfit_core::identifiability::{
    Classification, FunctionClassification, Target, structural_rank,
};
use kmcfit_core::number_format::resolved;
use kmcfit_core::problem::Jumps;
use kmcfit_core::structure::CoefficientKind;
use std::collections::BTreeMap;

impl FittedModel<'_> {
    /// Findings and warnings on identifiability: the structural rank, the classification of the functions and the
    /// plausibility of the fit. A fit of the equation error simulates no response and has the classification alone.
    pub(super) fn identifiability(&self) -> (IdentifiabilitySummary, Vec<Finding>) {
        let problem = &self.model.problem;
        let mut summary = IdentifiabilitySummary {
            parameters: problem.parameters(),
            assumptions: assumptions(self.model),
            covariance: (self.run_assessment.quantities())
                .map(|quantities| quantities.kind)
                .unwrap_or_default(),
            ..IdentifiabilitySummary::default()
        };
        let Some(assessment) = &self.run_assessment.assessment else {
            let mut found = Vec::new();
            self.add_equation_error(&mut found);
            return (summary, found);
        };
        let mut found = Vec::new();
        let count = structural_rank(problem);
        summary.rank_bound = count.rank_bound;
        let plausibility = &assessment.plausibility;
        if let Some(reason) = &plausibility.unidentified {
            summary.unidentified = true;
            found.push(Finding::of(reason, reason.sentence()).rated(Severity::Inadequate));
            return (summary, found);
        }
        let classifications = &assessment.classifications;
        // Constraints and penalties may determine what the records do not.
        let all_identified = !classifications.is_empty()
            && !classifications.iter().any(FunctionClassification::is_open);
        if count.rank_bound < count.parameters && !all_identified {
            let finding = Finding::new("rank_bound", count.headline());
            let finding = finding.with("rank_bound", count.rank_bound);
            let finding = finding.with("parameters", count.parameters);
            found.push(finding.rated(Severity::Warning));
        }
        for finding in &count.findings {
            found.push(findings::rank(finding).rated(warning_if(finding.is_warning())));
        }
        for jumps in &problem.jumps {
            found.push(self.jumps(jumps));
        }
        for classification in classifications {
            if classification.verdict != Classification::Fixed {
                let severity = warning_if(classification.is_open());
                found.push(findings::classification(classification).rated(severity));
            }
        }
        let negative = self.negative_damping();
        // The warning with the interval replaces that on most times.
        let is_replaced = |warning: &&Doubt| {
            let damping = CoefficientKind::DAMPING.name();
            let is_damping = matches!(warning, Doubt::Negative { function } if function == damping);
            is_damping && negative.is_some()
        };
        let warnings = plausibility.warnings.iter().filter(|w| !is_replaced(w));
        found.extend(warnings.cloned().map(Finding::from));
        found.extend(negative.clone());
        let poor = self.run_assessment.validation.iter();
        let poor = poor.filter_map(ValidationRecord::poor);
        found.extend(poor.map(Finding::from));
        (summary, found)
    }

    /// The jumps found in a function, with the levels between them.
    fn jumps(&self, jumps: &Jumps) -> Finding {
        let problem = &self.model.problem;
        let function = problem.functions.get(jumps.function);
        let range = problem.functions.ranges()[jumps.function].clone();
        let bands = self.run_assessment.bands();
        let level = |j: usize| {
            let level = Target::parameter(j).at(problem, &self.fit.best.parameters)?;
            let value = level.value;
            let with_error = bands.and_then(|bands| {
                let covariance = bands.covariance.as_ref()?;
                Some(level.with_covariance(covariance, bands.degrees_of_freedom[j]))
            });
            Some((value, with_error.and_then(|level| level.interval())))
        };
        let levels: Vec<_> = range.filter_map(level).collect();
        findings::jumps(&function.name(), self.unit(function), &jumps.times, &levels)
    }

    /// Adds the classification of a fit of the equation error, and the bias of its estimates.
    fn add_equation_error(&self, found: &mut Vec<Finding>) {
        let Some(equation) = &self.run_assessment.equation else {
            return;
        };
        let biased = findings::equation_error(equation.as_ref().err());
        found.push(biased.rated(Severity::Warning));
        let missing = self.run_assessment.missing_terms.iter();
        found.extend(missing.map(|term| Finding::from(Doubt::MissingTerm(*term))));
        let Ok(intervals) = equation else {
            return;
        };
        found.push(findings::kernel_covariance());
        let judged = intervals.classifications.iter();
        let judged = judged.filter(|c| c.verdict != Classification::Fixed);
        let judged = judged.map(findings::classification);
        found.extend(judged.map(|finding| finding.rated(Severity::Warning)));
    }

    /// Warning where the whole confidence interval of a constant damping is negative.
    fn negative_damping(&self) -> Option<Finding> {
        let summaries = self.function_summaries();
        let damping = summaries.get(CoefficientKind::DAMPING.name())?;
        damping.standard_error?;
        let means = &self.run_assessment.quantities()?.functions;
        let mean = means
            .iter()
            .find(|mean| mean.name == CoefficientKind::DAMPING.name())?;
        let ([low, high], half) = (mean.interval()?, mean.half_width());
        (high < 0.0 && !damping.negligible).then(|| {
            let [low, high] = resolved([low, high], half);
            let text = format!(
                "c is negative (95 % CI {low} to {high} {}): the system gains energy",
                damping.unit
            );
            let finding = Finding::new("negative_damping", text).rated(Severity::Warning);
            finding.with("value", mean.value).with("half_width", half)
        })
    }

    pub(super) fn function_summaries(&self) -> BTreeMap<String, FunctionSummary> {
        let (problem, truth) = (&self.model.problem, self.model.truth.as_ref());
        let errors = self.run_assessment.errors();
        let summaries = function_summaries(problem, self.fit, errors, truth);
        let named = problem.functions.iter().zip(summaries);
        named
            .map(|(function, summary)| {
                let unit = self.unit(function).into();
                (function.name(), FunctionSummary { unit, ..summary })
            })
            .collect()
    }
}

fn warning_if(is_warning: bool) -> Severity {
    match is_warning {
        true => Severity::Warning,
        false => Severity::Note,
    }
}
