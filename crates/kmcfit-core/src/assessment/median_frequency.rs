//! Natural frequency of a fit as one number.

use crate::functions::Ratios;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::signal::median;
use crate::structure::Law;

/// Median natural frequency at the optimum, Hz; `None` without one mass and a stiffness that define one.
pub(super) fn median_frequency(problem: &Problem, evaluation: &Evaluation) -> Option<f64> {
    let terms = problem.system.laws();
    let is_one = problem.system.structure.is_one();
    (is_one && terms.len() > 1 && terms[..2] == [Law::Damping, Law::Stiffness]).then_some(())?;
    let mut defined = Ratios::of(&evaluation.nodal).frequency;
    defined.retain(|f| f.is_finite());
    let frequency = (!defined.is_empty()).then(|| median(defined))?;
    (frequency > 0.0).then_some(frequency)
}
