//! Dependence of the estimates on the width of Coulomb friction, and the width that the residuals prefer.
//!
//! The change of the predictions where the width `w` is halved is a further column beside the derivatives of the model. The residuals
//! ask for `s` times this change: to first order they are least at the width `w (1 - s/2)`. A width with smaller residuals than its half is
//! that of the system, and no artefact of the smoothing.

use super::Doubt;
use crate::alternatives::Span;
use crate::functions::CoefficientKind;
use crate::objective::Evaluation;
use crate::problem::Problem;

/// Smallest `|t|` of a larger width that is no noise: of 4000 standard normal numbers one has a larger value by chance.
const SIGNIFICANT: f64 = 4.5;
/// Smallest shift of an estimate by half the width that is a warning, in standard errors.
const NOTICEABLE: f64 = 0.5;
/// Increase of the sum of squares by half the width, in units of the variance, from which the residuals prefer the whole: odds of 20 to 1
/// (6 = 2 ln 20).
const PREFERRED: f64 = 6.0;
/// Largest ratio of a better width to the given one, and its inverse.
const MOST: f64 = 16.0;

/// Warning where half the width of Coulomb friction shifts an estimate other than friction by more than half a standard error and the
/// residuals do not prefer the whole, or where they ask for a larger one; names the estimate with the largest shift.
pub(super) fn width_warning(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Option<Doubt> {
    let width = problem.system.friction_width()?;
    let changes = problem.changes_by_width(evaluation)?;
    let better = better_width(problem, evaluation, &changes, width);
    let shifts = problem.shifts_by(theta, evaluation, changes)?;
    let functions = &problem.functions;
    let function_of = |j: usize| {
        let mut all = functions.iter().zip(functions.ranges());
        all.find(|(_, range)| range.contains(&j)).map(|(f, _)| f)
    };
    let in_errors = shifts.iter().map(|[shift, error]| shift.abs() / error);
    let in_errors: Vec<f64> = in_errors.collect();
    let is_other =
        |j: usize| function_of(j).is_none_or(|f| f.quantity != CoefficientKind::COULOMB_FRICTION);
    let others = (0..shifts.len()).filter(|j| is_other(*j) && in_errors[*j].is_finite());
    let worst = others.max_by(|a, b| in_errors[*a].total_cmp(&in_errors[*b]))?;
    let (estimate, unit) = match function_of(worst) {
        Some(function) => {
            let is_constant = function.parameters() == 1;
            let unit = is_constant.then(|| function.quantity.unit().to_owned());
            (function.name(), unit)
        }
        None => {
            let scalar = &functions.scalars()[worst - functions.scalar_range().start];
            (scalar.name.clone(), Some(scalar.unit.clone()))
        }
    };
    let better = better?;
    (in_errors[worst] > NOTICEABLE || better > width).then(|| Doubt::FrictionWidth {
        estimate,
        shift: unit.is_some().then_some(shifts[worst][0]),
        unit: unit.unwrap_or_default(),
        errors: in_errors[worst],
        width,
        better,
    })
}

/// A width that the residuals prefer to `width`, or the smallest one that they do not exclude; `None` where they prefer `width` to its half.
fn better_width(
    problem: &Problem,
    evaluation: &Evaluation,
    changes: &[Vec<f64>],
    width: f64,
) -> Option<f64> {
    let pairs = problem.predicted(evaluation).zip(changes);
    let columns = pairs.flat_map(|((channel, predicted), changes)| {
        let changed: Vec<f64> = predicted.iter().zip(changes).map(|(p, c)| p + c).collect();
        let [here, there] = [predicted, &changed].map(|p| channel.majorant(p).weighted);
        there
            .into_iter()
            .zip(here)
            .map(|(there, here)| there - here)
    });
    let at = |changes: f64| (width * (1.0 - 0.5 * changes)).clamp(width / MOST, MOST * width);
    let Some((changes, t)) = Span::score(problem, evaluation, columns.collect()) else {
        // The residuals say nothing.
        return Some(width / MOST);
    };
    let error = changes / t;
    match (1.0 - 2.0 * changes) / (error * error) {
        _ if t < -SIGNIFICANT => Some(at(changes)),
        increase if increase > PREFERRED => None,
        _ => Some(at((changes + 2.0 * error).max(1.0))),
    }
}
