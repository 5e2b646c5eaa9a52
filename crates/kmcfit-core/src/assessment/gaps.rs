//! What the samples determine of functions within gaps of the records.
//!
//! Samples on both sides of a gap of a period or more determine the integral of the natural frequency across it up to whole cycles,
//! and no shape of the stiffness or mass: a narrow band there is the work of the basis or of the penalty.

use crate::identifiability::{Bands, IDENTIFIED};
use crate::problem::Problem;
use crate::solvers::{Fit, cycles, gaps, varying_function};
use serde::Serialize;

/// Number of cycles from which a varying stiffness or mass is not identified in a gap, however narrow its band is.
const AMBIGUOUS: f64 = 1.0;

/// A function within a gap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FunctionInGap {
    /// Index of the function.
    #[serde(skip)]
    pub index: usize,
    /// Name of the function.
    pub function: String,
    /// True if the samples outside the gap identify it there.
    pub is_identified: bool,
}

/// A gap of the records.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GapAssessment {
    /// Last sample before the gap and first sample after it, s.
    pub span: [f64; 2],
    /// Number of cycles of the undamped oscillation in it.
    pub cycles: f64,
    /// The functions that vary over time.
    pub functions: Vec<FunctionInGap>,
}

/// Assesses all gaps of the records of a fit; without `bands` nothing within them is identified.
pub(super) fn gap_assessments(
    problem: &Problem,
    fit: &Fit,
    bands: Option<&Bands>,
) -> Vec<GapAssessment> {
    let evaluation = &fit.best.evaluation;
    let spans = gaps(problem, &evaluation.nodal).into_iter();
    let each = spans.map(|span| {
        let cycles = cycles(problem, &evaluation.nodal, span);
        let all = 0..problem.functions.ranges().len();
        let varying = all.filter(|f| problem.functions.get(*f).parameters() > 1);
        let functions = varying.map(|index| {
            let is_ambiguous = cycles >= AMBIGUOUS && varying_function(problem) == Some(index);
            let size = problem.median_scales(evaluation)[index];
            FunctionInGap {
                index,
                function: problem.functions.get(index).name(),
                is_identified: !is_ambiguous
                    && bands.is_some_and(|bands| is_known(bands, index, size, span)),
            }
        });
        GapAssessment {
            span,
            cycles,
            functions: functions.collect(),
        }
    });
    each.collect()
}

/// True if the band of a function is narrow, relative to its size, at all nodes of a span.
fn is_known(bands: &Bands, index: usize, size: f64, [from, to]: [f64; 2]) -> bool {
    let own = &bands.functions[index];
    let inside = bands.times.iter().enumerate();
    let mut inside = inside.filter(|(_, time)| (from..=to).contains(*time));
    inside.all(|(i, _)| own.half_width(i) <= IDENTIFIED * size)
}
