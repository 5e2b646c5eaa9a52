//! Constraints that free records cannot feel.
//!
//! Without a force, `(m, c, k)` and `s(t) (m, c, k)` move alike for every positive `s(t)`. Passivity
//! and a monotone mass or stiffness are not kept by that change: unless something else holds `s(t)`,
//! they can be met by choosing it and say nothing about the device.

use crate::config::ModelFile;
use crate::config::build::functions::slots;
use crate::config::scalar::NumberOrColumn;
use crate::config::spec::FunctionSpec;
use kmcfit_core::internals::constraints::{Shape, Statement};
use kmcfit_core::internals::functions::{Basis, CoefficientFunction, CoefficientKind};
use kmcfit_core::internals::problem::Problem;

/// A warning where `statement`, which stands at `key`, means nothing.
pub(super) fn says_nothing(
    file: &ModelFile,
    problem: &Problem,
    statement: &Statement,
    key: &str,
) -> Option<String> {
    let what = match statement {
        Statement::Passive => "passivity",
        Statement::Shape {
            of: CoefficientKind::Mass,
            shape: Shape::NonIncreasing | Shape::NonDecreasing,
        } => "a monotone mass",
        Statement::Shape {
            of: CoefficientKind::Stiffness,
            shape: Shape::NonIncreasing | Shape::NonDecreasing,
        } => "a monotone stiffness",
        Statement::Slope { of, min, max } if one_way(*min, *max) => match of {
            CoefficientKind::Mass => "a slope of the mass in one direction",
            CoefficientKind::Stiffness => "a slope of the stiffness in one direction",
            _ => return None,
        },
        _ => return None,
    };
    let forced = problem.experiments.iter().any(|e| !e.is_free());
    let held = problem.functions.iter().any(holds_scale);
    let smoothed = problem.penalties.iter().any(|p| p.weight > 0.0)
        || problem.variations.iter().any(|v| v.weight > 0.0);
    if forced || held || smoothed || bounded_on_both_sides(file) {
        return None;
    }
    Some(format!(
        "{key}: {what} says nothing about the device here. Without a force the motion shows only \
         k/m and c/m, and any s(t) may multiply all three functions; fix a function, bound the \
         functions on both sides, or smooth them"
    ))
}

/// Whether limits of a slope leave one sign to it and no size.
fn one_way(min: Option<f64>, max: Option<f64>) -> bool {
    matches!((min, max), (None, Some(0.0)) | (Some(0.0), None))
}

/// Whether a function cannot follow a change of the common scale `s(t)`: it is known and not zero,
/// or of a basis that is not closed under it.
fn holds_scale(function: &CoefficientFunction) -> bool {
    match &function.basis {
        None => function.offset.iter().any(|p| *p != 0.0),
        Some(Basis::Constant | Basis::Polynomial { .. }) => true,
        Some(
            Basis::Nodal
            | Basis::PiecewiseConstant { .. }
            | Basis::PiecewiseLinear { .. }
            | Basis::BSpline { .. },
        ) => false,
    }
}

/// Whether bounds keep the common scale from falling and from rising.
fn bounded_on_both_sides(file: &ModelFile) -> bool {
    let positive = |limit: &NumberOrColumn| match limit {
        NumberOrColumn::Number(value) => value.0 > 0.0,
        NumberOrColumn::Column(_) => true,
    };
    let slots = slots(file);
    let own: Vec<&FunctionSpec> = slots.iter().map(|slot| slot.spec).collect();
    let listed = || file.spec.constraints.iter().flatten();
    let below = own.iter().filter_map(|f| f.min.as_ref());
    let above = own.iter().filter_map(|f| f.max.as_ref());
    let below = below.chain(listed().filter_map(|c| c.min.as_ref()));
    let above = above.chain(listed().filter_map(|c| c.max.as_ref()));
    below.into_iter().any(positive) && above.into_iter().any(positive)
}
