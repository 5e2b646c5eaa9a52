//! Functions and identifiability of a fit, for its result document.

use super::assumptions::assumptions;
use super::document::{FindingLevel, FitFinding, IdentifiabilitySummary};
use super::findings;
use super::fit_assessment::ValidationRecord;
use super::run::FittedModel;
use crate::finding::Finding;
use crate::number_format::resolved;
use kmcfit_core::internals::assessment::{FitWarning, FunctionSummary, function_summaries};
use kmcfit_core::internals::diagnostics::student_half_width;
use kmcfit_core::internals::functions::CoefficientKind;
use kmcfit_core::internals::identifiability::{
    Classification, FunctionClassification, structural_rank,
};
use kmcfit_core::internals::problem::Jumps;
use std::collections::BTreeMap;

/// Findings in the order of their addition.
#[derive(Default)]
struct Findings(Vec<FitFinding>);

impl Findings {
    fn add(&mut self, is_warning: bool, finding: Finding) {
        let level = match is_warning {
            true => FindingLevel::Warning,
            false => FindingLevel::Note,
        };
        self.0.push(FitFinding { level, finding });
    }

    fn warn(&mut self, finding: Finding) {
        self.add(true, finding);
    }
}

impl FittedModel<'_> {
    /// Findings and warnings on identifiability: the structural rank, the classification of the functions and the
    /// plausibility of the fit. A fit of the equation error simulates no response and has the classification alone.
    pub(super) fn identifiability(&self) -> (IdentifiabilitySummary, Vec<FitFinding>) {
        let problem = &self.model.problem;
        let mut summary = IdentifiabilitySummary {
            parameters: problem.parameters(),
            assumptions: assumptions(self.model),
            covariance: (self.run_assessment.bands())
                .map(|bands| bands.covariance_kind)
                .or(self.large_covariance().map(|large| large.kind))
                .unwrap_or_default(),
            ..IdentifiabilitySummary::default()
        };
        let Some(assessment) = &self.run_assessment.assessment else {
            let mut found = Findings::default();
            self.add_equation_error(&mut found);
            return (summary, found.0);
        };
        let mut found = Findings::default();
        let count = structural_rank(problem);
        summary.rank_bound = count.rank_bound;
        let plausibility = &assessment.plausibility;
        if let Some(reason) = &plausibility.unidentified {
            summary.unidentified = true;
            found.warn(findings::unidentified(reason));
            return (summary, found.0);
        }
        let classifications = &assessment.classifications;
        // Constraints and penalties may determine what the records do not.
        let all_identified = !classifications.is_empty()
            && !classifications.iter().any(FunctionClassification::is_open);
        if count.rank_bound < count.parameters && !all_identified {
            let finding = Finding::new("rank_bound", count.headline());
            let finding = finding.with("rank_bound", count.rank_bound);
            found.warn(finding.with("parameters", count.parameters));
        }
        for finding in &count.findings {
            found.add(finding.is_warning(), findings::rank(finding));
        }
        for jumps in &problem.jumps {
            found.add(false, self.jumps(jumps));
        }
        for classification in classifications {
            if classification.verdict != Classification::Fixed {
                found.add(
                    classification.is_open(),
                    findings::classification(classification),
                );
            }
        }
        let negative = self.negative_damping();
        // The warning with the interval replaces that on most times.
        let is_replaced = |warning: &&FitWarning| {
            let damping = CoefficientKind::DAMPING.name();
            let is_damping =
                matches!(warning, FitWarning::Negative { function } if function == damping);
            is_damping && negative.is_some()
        };
        let warnings = plausibility.warnings.iter().filter(|w| !is_replaced(w));
        warnings.for_each(|warning| found.warn(findings::warning(warning)));
        negative.clone().into_iter().for_each(|n| found.warn(n));
        let poor = self.run_assessment.validation.iter();
        let poor = poor.filter_map(ValidationRecord::poor);
        poor.for_each(|record| found.warn(findings::not_predicted(record)));
        (summary, found.0)
    }

    /// The jumps found in a function, with the levels between them.
    fn jumps(&self, jumps: &Jumps) -> Finding {
        let problem = &self.model.problem;
        let function = problem.functions.get(jumps.function);
        let range = problem.functions.ranges()[jumps.function].clone();
        let theta = &self.fit.best.parameters[range.clone()];
        let errors = self.run_assessment.errors();
        let interval = |(value, j): (&f64, usize)| {
            let errors = errors?;
            let covariance = errors.covariance?;
            let error = covariance[(j, j)].sqrt();
            let half = student_half_width(errors.degrees_of_freedom[j]) * error;
            Some([value - half, value + half])
        };
        let levels = theta.iter().zip(range);
        let levels: Vec<_> = levels
            .map(|(value, j)| (*value, interval((value, j))))
            .collect();
        findings::jumps(&function.name(), self.unit(function), &jumps.times, &levels)
    }

    /// Adds the classification of a fit of the equation error, and the bias of its estimates.
    fn add_equation_error(&self, found: &mut Findings) {
        let Some(equation) = &self.run_assessment.equation else {
            return;
        };
        found.warn(findings::equation_error(equation.as_ref().err()));
        let missing = self.run_assessment.missing_terms.iter();
        let missing = missing.map(|term| findings::warning(&FitWarning::MissingTerm(*term)));
        missing.for_each(|warning| found.warn(warning));
        let Ok(intervals) = equation else {
            return;
        };
        found.add(false, findings::kernel_covariance());
        let judged = intervals.classifications.iter();
        let judged = judged.filter(|c| c.verdict != Classification::Fixed);
        judged.for_each(|judged| found.warn(findings::classification(judged)));
    }

    /// Warning where the whole confidence interval of a constant damping is negative.
    fn negative_damping(&self) -> Option<Finding> {
        let summaries = self.function_summaries();
        let damping = summaries.get(CoefficientKind::DAMPING.name())?;
        let (value, half) = (damping.min, damping.half_width()?);
        let is_constant = damping.max == value && !damping.negligible;
        (is_constant && value + half < 0.0).then(|| {
            let [low, high] = resolved([value - half, value + half], half);
            let text = format!(
                "c is negative (95 % CI {low} to {high} {}): the system gains energy",
                damping.unit
            );
            let finding = Finding::new("negative_damping", text);
            finding.with("value", value).with("half_width", half)
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
