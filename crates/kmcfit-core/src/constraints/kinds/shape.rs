//! Monotone, convex and concave functions.

use super::linear_form::{LinearForm, group};
use super::sampling::DerivativeTerm;
use super::slope::slopes;
use super::{All, ConstraintError};
use crate::constraints::RowGroup;
use crate::functions::Basis;

/// Shape of a function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// Monotonically non-increasing.
    NonIncreasing,
    /// Monotonically non-decreasing.
    NonDecreasing,
    /// Convex: its slope never falls.
    Convex,
    /// Concave: its slope never rises.
    Concave,
}

impl Shape {
    /// Name in a model file and in names of rows.
    pub fn name(self) -> &'static str {
        match self {
            Shape::NonIncreasing => "non-increasing",
            Shape::NonDecreasing => "non-decreasing",
            Shape::Convex => "convex",
            Shape::Concave => "concave",
        }
    }
}

/// Nonnegative and nonpositive values.
pub(super) const UP: [f64; 2] = [0.0, f64::INFINITY];
pub(super) const DOWN: [f64; 2] = [f64::NEG_INFINITY, 0.0];

pub(super) fn build(all: &All<'_>, j: usize, shape: Shape) -> Result<RowGroup, ConstraintError> {
    let (forms, bounds) = match shape {
        Shape::NonIncreasing => (slopes(all, j), DOWN),
        Shape::NonDecreasing => (slopes(all, j), UP),
        Shape::Convex => (curvatures(all, j), UP),
        Shape::Concave => (curvatures(all, j), DOWN),
    };
    let name = format!("{} {}", all.name(j), shape.name());
    group(name, &forms, |_| bounds)
}

/// Curvature of a function or, where it is not square-integrable, divided differences times the root of their spacing.
fn curvatures(all: &All<'_>, j: usize) -> Vec<LinearForm> {
    match &all.list[j].basis {
        Some(
            basis
            @ (Basis::Nodal | Basis::PiecewiseLinear { .. } | Basis::PiecewiseConstant { .. }),
        ) => {
            let rows = basis.roughness(all.grid, 2);
            let knots = basis.knot_times(all.grid);
            // Rows belong to the inner knots, or to the inner cells.
            let middle = |i: usize| match basis {
                Basis::PiecewiseConstant { .. } => 0.5 * (knots[i + 1] + knots[i + 2]),
                _ => knots[i + 1],
            };
            let times: Vec<f64> = (0..rows.len()).map(middle).collect();
            all.matrix_forms(j, &rows, &times)
        }
        _ => {
            let curvature = DerivativeTerm {
                function: j,
                derivative: 2,
                factor: 1.0,
            };
            all.sum(&[curvature], &[])
        }
    }
}
