//! Dependence of the estimates on the width of Coulomb friction.

use super::FitWarning;
use crate::functions::CoefficientKind;
use crate::objective::Evaluation;
use crate::problem::Problem;

/// Smallest shift of an estimate by half the width that is a warning, in standard errors.
const NOTICEABLE: f64 = 0.5;

/// Warning where half the width of Coulomb friction shifts an estimate other than friction by more than half a standard error; names
/// that with the largest shift.
pub(super) fn width_warning(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
) -> Option<FitWarning> {
    let width = problem.system.friction_width()?;
    let shifts = problem.shifts_by_width(theta, evaluation)?;
    let functions = &problem.functions;
    let function_of = |j: usize| {
        let mut all = functions.iter().zip(functions.ranges());
        all.find(|(_, range)| range.contains(&j)).map(|(f, _)| f)
    };
    let in_errors = shifts.iter().map(|[shift, error]| shift.abs() / error);
    let in_errors: Vec<f64> = in_errors.collect();
    let is_other =
        |j: usize| function_of(j).is_none_or(|f| f.quantity != CoefficientKind::CoulombFriction);
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
    (in_errors[worst] > NOTICEABLE).then(|| FitWarning::FrictionWidth {
        estimate,
        shift: unit.is_some().then_some(shifts[worst][0]),
        unit: unit.unwrap_or_default(),
        errors: in_errors[worst],
        width,
    })
}
