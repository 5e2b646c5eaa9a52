//! Natural frequency of a fit as one number.

use crate::functions::Ratio;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::signal::median;

/// Median natural frequency at the optimum, Hz; `None` without one mass and a stiffness that define one.
pub(super) fn median_frequency(problem: &Problem, evaluation: &Evaluation) -> Option<f64> {
    let mut defined = Ratio::NaturalFrequency.at_nodes(problem.system.laws(), &evaluation.nodal);
    defined.retain(|f| f.is_finite());
    let frequency = (!defined.is_empty()).then(|| median(defined))?;
    (frequency > 0.0).then_some(frequency)
}
