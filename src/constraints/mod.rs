//! Constraints: named linear rows and second-order cones on the parameters of all functions.

use crate::qp::{Cone, Rows};

/// Rows `lower <= g_i^T theta <= upper` that say one thing about the functions, at many times.
#[derive(Debug, Clone, PartialEq)]
pub struct RowGroup {
    /// What the rows say, as in `damping >= 0`.
    pub name: String,
    /// The rows in the parameters of all functions; their right-hand sides are the lower bounds.
    pub rows: Rows,
    /// The upper bounds; equal to the lower ones for an equality.
    pub upper: Vec<f64>,
    /// The span of time that each row speaks of, s.
    pub times: Vec<[f64; 2]>,
}

/// All constraints of a problem.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Constraints {
    /// Linear rows.
    pub groups: Vec<RowGroup>,
    /// Second-order cones.
    pub cones: Vec<Cone>,
}

impl RowGroup {
    /// Lower and upper bound of row `i`.
    pub fn bounds(&self, i: usize) -> (f64, f64) {
        (self.rows.right()[i], self.upper[i])
    }
}

impl Constraints {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty() && self.cones.is_empty()
    }
}
