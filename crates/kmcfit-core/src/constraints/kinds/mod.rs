//! Rows and cones of constraints on the coefficient functions.
//!
//! A constraint on functions that are linear between their knots is imposed at the ends of all pieces and
//! holds **at all times**: `nodal`, `constant`, `piecewise-constant` and `piecewise-linear` functions, lines, slopes of
//! parabolas, and curvatures of cubic splines. Values and slopes of other polynomials and of splines are constrained at every
//! node, where the equation of motion uses them, but **not between nodes**.
//!
//! A row on a single parameter (a value at a knot) remains a bound, so that clipping is exact.

mod bounds;
mod damping_ratio;
mod equal;
mod frequency;
mod linear_form;
mod passive;
mod sampling;
mod shape;
mod slope;
mod totals;
mod values;

pub use shape::Shape;

use super::Constraints;
use crate::functions::{CoefficientFunction, CoefficientKind, Parameterization};
use crate::system::Grid;
use std::fmt;

/// Values of a fixed function, a bound or a reference over time, in the unit of the function.
#[derive(Debug, Clone, PartialEq)]
pub enum TimeHistory {
    /// Equal at all times.
    Constant(f64),
    /// Values at the nodes, linear in between.
    Nodal {
        /// Name in rows and messages.
        name: String,
        /// One value per node.
        values: Vec<f64>,
    },
}

impl TimeHistory {
    /// Value at node `i`.
    pub fn at(&self, i: usize) -> f64 {
        match self {
            TimeHistory::Constant(value) => *value,
            TimeHistory::Nodal { values, .. } => values[i],
        }
    }

    /// Smallest value.
    pub fn least(&self) -> f64 {
        match self {
            TimeHistory::Constant(value) => *value,
            TimeHistory::Nodal { values, .. } => {
                values.iter().copied().fold(f64::INFINITY, f64::min)
            }
        }
    }
}

impl fmt::Display for TimeHistory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TimeHistory::Constant(value) => write!(f, "{value}"),
            TimeHistory::Nodal { name, .. } => f.write_str(name),
        }
    }
}

/// A constraint on the coefficient functions.
#[derive(Debug, Clone, PartialEq)]
pub enum Constraint {
    /// `min <= p(t) <= max`, in the unit of the function.
    Bounds {
        /// The function `p`.
        of: CoefficientKind,
        /// Smallest value.
        min: Option<TimeHistory>,
        /// Largest value.
        max: Option<TimeHistory>,
    },
    /// `min <= p'(t) <= max`, in (unit of p)/s; for `piecewise-constant` functions of the divided
    /// differences between the centres of neighbouring cells.
    Slope {
        /// The function `p`.
        of: CoefficientKind,
        /// Smallest slope.
        min: Option<f64>,
        /// Largest slope.
        max: Option<f64>,
    },
    /// Monotone, convex or concave.
    Shape {
        /// Function.
        of: CoefficientKind,
        /// Shape.
        shape: Shape,
    },
    /// `p(at) = value`; a time within 1e-6 steps of a knot is that knot.
    Value {
        /// The function `p`.
        of: CoefficientKind,
        /// Time, s.
        at: f64,
        /// Value, in the unit of the function.
        value: f64,
    },
    /// `1/T integral p dt = value`, exactly.
    Mean {
        /// The function `p`.
        of: CoefficientKind,
        /// Value, in the unit of the function.
        value: f64,
    },
    /// `integral p dt = value` over the record, exactly.
    Integral {
        /// The function `p`.
        of: CoefficientKind,
        /// Value, in (unit of the function) s.
        value: f64,
    },
    /// `first(t) = ratio * second(t)` as numbers in their units: at all times where both are linear between knots or have the
    /// same basis, otherwise at the nodes.
    Equal {
        /// First function.
        first: CoefficientKind,
        /// Second function.
        second: CoefficientKind,
        /// Factor of the second.
        ratio: f64,
    },
    /// The stored energy of a free system never grows: `c - m'/2 >= 0` and `k' <= 0`. In every cell, `c` at both ends is at least
    /// half the slope of `m`; a `piecewise-constant` mass must not jump up.
    Passive,
    /// `w_min^2 m <= k <= w_max^2 m` with `w = 2 pi f`: bounds of the natural frequency about the rest position, in Hz.
    Frequency {
        /// Lowest frequency, Hz.
        min: Option<f64>,
        /// Highest frequency, Hz.
        max: Option<f64>,
    },
    /// `c^2 <= 4 zeta^2 m k` with `m + k >= 0`: the damping ratio is at most `zeta`, as the
    /// second-order cone `|(c/zeta, s m - k/s)| <= s m + k/s`.
    ///
    /// This is equivalent to `|(c/zeta, m - k)| <= m + k` for any `m, k >= 0` and `s > 0`. `s` is the power of two nearest to
    /// `sqrt(k/m)` at the start, which balances the magnitudes of kg and N/m.
    DampingRatio {
        /// Largest damping ratio.
        max: f64,
    },
}

/// Reason for which a constraint has no rows.
#[derive(Debug, Clone, PartialEq)]
pub enum ConstraintError {
    /// The system has no such function.
    Absent(CoefficientKind),
    /// All functions of the constraint are fixed.
    Fixed(Vec<CoefficientKind>),
    /// Fixed functions violate a row, which no parameters can change.
    Broken {
        /// Name of the group.
        name: String,
        /// Time of the violation, s.
        time: f64,
    },
}

impl Constraint {
    /// Kinds of the constrained functions.
    pub fn functions(&self) -> Vec<CoefficientKind> {
        match self {
            Constraint::Bounds { of, .. }
            | Constraint::Slope { of, .. }
            | Constraint::Shape { of, .. }
            | Constraint::Value { of, .. }
            | Constraint::Mean { of, .. }
            | Constraint::Integral { of, .. } => vec![*of],
            Constraint::Equal { first, second, .. } => vec![*first, *second],
            Constraint::Frequency { .. } => vec![CoefficientKind::MASS, CoefficientKind::STIFFNESS],
            Constraint::Passive | Constraint::DampingRatio { .. } => {
                vec![
                    CoefficientKind::MASS,
                    CoefficientKind::DAMPING,
                    CoefficientKind::STIFFNESS,
                ]
            }
        }
    }

    /// Rows and cones in the parameters of all `functions`; contributions of fixed functions are moved to the bounds. A constraint
    /// that holds for all parameters has no rows.
    ///
    /// # Errors
    /// If all its functions are fixed, or no parameters satisfy one of its rows.
    pub fn build(
        &self,
        grid: &Grid,
        functions: &Parameterization,
    ) -> Result<Constraints, ConstraintError> {
        self.build_for(grid, functions, 0)
    }

    /// [`Constraint::build`] for the functions of one coefficient set of [`Parameterization::coefficient_sets`].
    ///
    /// # Errors
    /// As [`Constraint::build`].
    pub fn build_for(
        &self,
        grid: &Grid,
        functions: &Parameterization,
        set: usize,
    ) -> Result<Constraints, ConstraintError> {
        let all = All::new(grid, functions, set);
        let about = self.functions();
        let indices: Vec<usize> = (about.iter())
            .map(|q| all.index(*q))
            .collect::<Result<_, _>>()?;
        self.rows_of(&all, &indices)
    }

    /// [`Constraint::build_for`] of the function with this index.
    pub(crate) fn build_of(
        &self,
        grid: &Grid,
        functions: &Parameterization,
        set: usize,
        function: usize,
    ) -> Result<Constraints, ConstraintError> {
        self.rows_of(&All::new(grid, functions, set), &[function])
    }

    /// Its rows for the functions with these indices.
    fn rows_of(&self, all: &All<'_>, indices: &[usize]) -> Result<Constraints, ConstraintError> {
        if indices.iter().all(|&j| all.list[j].parameters() == 0) {
            return Err(ConstraintError::Fixed(self.functions()));
        }
        let mut found = Constraints::default();
        match (self, indices) {
            (Constraint::Bounds { min, max, .. }, &[j]) => {
                found.groups = bounds::build(all, j, min.as_ref(), max.as_ref())?;
            }
            (Constraint::Slope { min, max, .. }, &[j]) => {
                found.groups = slope::build(all, j, *min, *max)?;
            }
            (Constraint::Shape { shape, .. }, &[j]) => {
                found.groups = vec![shape::build(all, j, *shape)?];
            }
            (Constraint::Value { at, value, .. }, &[j]) => {
                found.groups = vec![values::build(all, j, *at, *value)?];
            }
            (Constraint::Mean { value, .. }, &[j]) => {
                found.groups = vec![totals::mean(all, j, *value)?];
            }
            (Constraint::Integral { value, .. }, &[j]) => {
                found.groups = vec![totals::integral(all, j, *value)?];
            }
            (Constraint::Equal { ratio, .. }, &[a, b]) => {
                found.groups = vec![equal::build(all, [a, b], *ratio)?];
            }
            (Constraint::Passive, &[m, c, k]) => found.groups = passive::build(all, [m, c, k])?,
            (Constraint::Frequency { min, max }, &[m, k]) => {
                found.groups = frequency::build(all, [m, k], *min, *max)?;
            }
            (Constraint::DampingRatio { max }, &[m, c, k]) => {
                found.cones = vec![damping_ratio::build(all, [m, c, k], *max)];
            }
            _ => unreachable!("one index for each function of a statement"),
        }
        found.groups.retain(|group| !group.rows.is_empty());
        found.cones.retain(|group| !group.cones.is_empty());
        Ok(found)
    }
}

/// Functions of a coefficient set on their grid.
struct All<'a> {
    grid: &'a Grid,
    functions: &'a Parameterization,
    list: Vec<&'a CoefficientFunction>,
    assembly: &'a [usize],
}

impl<'a> All<'a> {
    fn new(grid: &'a Grid, functions: &'a Parameterization, set: usize) -> Self {
        Self {
            grid,
            functions,
            list: functions.iter().collect(),
            assembly: functions.coefficient_set(set),
        }
    }

    fn index(&self, quantity: CoefficientKind) -> Result<usize, ConstraintError> {
        let is_meant = |f: &&usize| self.list[**f].quantity == quantity;
        let found = self.assembly.iter().find(is_meant);
        found.copied().ok_or(ConstraintError::Absent(quantity))
    }

    fn name(&self, j: usize) -> String {
        self.list[j].name()
    }

    /// Start and end of the record, s.
    fn ends(&self) -> [f64; 2] {
        [self.grid.start(), self.grid.time(self.grid.nodes() - 1)]
    }
}
