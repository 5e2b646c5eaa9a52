//! Coefficient functions: a sparse design matrix times parameters plus a fixed part.
//!
//! Nodal values are `p_j(t_i) = (B_j theta_j)_i + b_j,i` at the nodes `t_i`. Gradients with respect to parameters are `B_j^T`
//! times gradients with respect to nodal values, and the L2 inner product of two functions is `theta^T (B^T W B) theta'` with
//! trapezoid weights `W`.

pub(crate) mod basis;
mod coefficient_set;
mod design;
mod gram;
mod local_rows;
mod parameterization;
mod penalty;
mod ratio;
mod scalar;
mod total_variation;

pub(crate) use crate::structure::CoefficientKind;
pub use basis::{Basis, from_physical_powers, physical_powers, uniform_knots};
pub use coefficient_set::CoefficientSet;
pub(crate) use design::Design;
pub(crate) use gram::Gram;
pub(crate) use local_rows::LocalRows;
pub use parameterization::Parameterization;
pub use penalty::{Penalty, WeightRule};
pub use ratio::Ratio;
pub(crate) use ratio::{Formula, MOST_COEFFICIENTS};
pub use scalar::{Prior, ScalarParameter, ScalarValue};
pub use total_variation::TotalVariation;

use crate::system::Grid;
use std::sync::Arc;

/// One coefficient function with its start.
#[derive(Debug, Clone)]
pub struct CoefficientFunction {
    /// Kind.
    pub quantity: CoefficientKind,
    /// Name of the element, or of the mass of a coordinate, in a structure; `None` for that of the kind.
    pub label: Option<String>,
    /// Name of the experiment with its own function; `None` for a function of the shared coefficient set.
    pub owner: Option<String>,
    /// True for a known part, which a coefficient set adds to another function of the same kind.
    pub is_known_part: bool,
    /// Prior of the parameter of a constant function: a known value with its standard deviation.
    pub prior: Option<Prior>,
    /// Basis; `None` for a fixed function.
    pub basis: Option<Basis>,
    /// Design matrix.
    pub design: Design,
    /// Fixed part at the nodes, in the unit of the quantity; empty if zero.
    pub offset: Arc<Vec<f64>>,
    /// Start of the parameters, in the unit of the quantity.
    pub start: Vec<f64>,
    /// True if positive parameters make the function positive at all times (nonnegative basis functions without a fixed part), so
    /// that a search may use their logarithms.
    pub positive_parameters: bool,
}

impl CoefficientFunction {
    /// A fixed function, without parameters.
    pub fn fixed(quantity: CoefficientKind, values: Vec<f64>) -> Self {
        Self {
            quantity,
            label: None,
            owner: None,
            is_known_part: false,
            prior: None,
            basis: None,
            design: Design::Empty,
            offset: Arc::new(values),
            start: Vec::new(),
            positive_parameters: false,
        }
    }

    /// A function in `basis` on `grid`, with start parameters `start`.
    ///
    /// # Panics
    /// If `start` has another number of parameters than the basis.
    pub fn free(quantity: CoefficientKind, basis: Basis, grid: &Grid, start: Vec<f64>) -> Self {
        assert_eq!(
            start.len(),
            basis.parameters(grid),
            "one start per parameter"
        );
        let design = basis.design(grid);
        Self::with_design(quantity, basis, design, start)
    }

    /// A nodal function with start `start`.
    pub fn nodal(quantity: CoefficientKind, start: Vec<f64>) -> Self {
        Self::with_design(quantity, Basis::Nodal, Design::Identity, start)
    }

    /// A constant function on `nodes` nodes with start `start`.
    pub fn constant(quantity: CoefficientKind, start: f64, nodes: usize) -> Self {
        let design = Design::Constant { nodes };
        Self::with_design(quantity, Basis::Constant, design, vec![start])
    }

    fn with_design(
        quantity: CoefficientKind,
        basis: Basis,
        design: Design,
        start: Vec<f64>,
    ) -> Self {
        Self {
            quantity,
            label: None,
            owner: None,
            is_known_part: false,
            prior: None,
            design,
            offset: Arc::default(),
            start,
            positive_parameters: basis.positive_parameters(),
            basis: Some(basis),
        }
    }

    /// A constant on `nodes` nodes, known as `prior`.
    pub fn uncertain(quantity: CoefficientKind, prior: Prior, nodes: usize) -> Self {
        Self {
            prior: Some(prior),
            ..Self::constant(quantity, prior.mean, nodes)
        }
    }

    /// Fixed part at node `i`, in the unit of the quantity.
    #[inline]
    pub fn fixed_at(&self, i: usize) -> f64 {
        self.offset.get(i).copied().unwrap_or(0.0)
    }

    /// Name in reports: that of its element, or its kind, and, if any, its experiment.
    pub fn name(&self) -> String {
        let part = match self.is_known_part {
            true => "known part of ",
            false => "",
        };
        let name = self.label.as_deref().unwrap_or(self.quantity.name());
        match &self.owner {
            None => format!("{part}{name}"),
            Some(owner) => format!("{part}{name} of {owner}"),
        }
    }

    /// The function on another grid: linear between the nodes of `from`, constant beyond its ends.
    #[must_use]
    pub fn resampled(&self, from: &Grid, to: &Grid) -> Self {
        let last = from.nodes() - 1;
        let position = |i: usize| {
            let x = (to.time(i) - from.start()) / from.step();
            let x = x.clamp(0.0, last as f64);
            let step = (x as usize).min(last - 1);
            (step, x - step as f64)
        };
        let fixed_at =
            |(step, x): (usize, f64)| self.fixed_at(step) * (1.0 - x) + self.fixed_at(step + 1) * x;
        let offset = match self.offset.is_empty() {
            true => Vec::new(),
            false => (0..to.nodes()).map(position).map(fixed_at).collect(),
        };
        let design = match &self.design {
            Design::Empty => Design::Empty,
            Design::Constant { .. } => Design::Constant { nodes: to.nodes() },
            Design::Identity | Design::Sparse(_) => {
                let entries = |step: usize, x: f64| -> Vec<(usize, f64)> {
                    let left = self.design.row(step).map(|(j, b)| (j, (1.0 - x) * b));
                    let right = self.design.row(step + 1).map(|(j, b)| (j, x * b));
                    left.chain(right).collect()
                };
                let span = |step: usize| {
                    let columns = entries(step, 0.5).into_iter().map(|(j, _)| j);
                    columns
                        .clone()
                        .max()
                        .zip(columns.min())
                        .map_or(1, |(end, first)| end - first + 1)
                };
                let span = (0..last).map(span).max().unwrap_or(1);
                let mut rows = LocalRows::new(self.parameters(), span);
                for (step, x) in (0..to.nodes()).map(position) {
                    rows.push(entries(step, x).into_iter());
                }
                Design::Sparse(Arc::new(rows))
            }
        };
        Self {
            offset: Arc::new(offset),
            design,
            ..self.clone()
        }
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.start.len()
    }

    /// Fixed part and design entry, if both are equal at all nodes.
    fn flat(&self) -> Option<[f64; 2]> {
        let is_flat = self.offset.windows(2).all(|pair| pair[0] == pair[1]);
        let (_, entry) = self.design.row(0).next()?;
        (self.design.is_constant() && is_flat).then_some([self.fixed_at(0), entry])
    }

    /// Value at node `i` for the parameters `theta`.
    pub(crate) fn value_at(&self, theta: &[f64], i: usize) -> f64 {
        self.fixed_at(i) + self.design.product_at(theta, i)
    }

    /// Computes the nodal values for the parameters `theta`.
    pub fn values_into(&self, theta: &[f64], values: &mut [f64]) {
        match &self.design {
            // A nodal function without a fixed part is copied, which preserves all bits.
            Design::Identity => values.copy_from_slice(theta),
            Design::Empty => values.copy_from_slice(&self.offset),
            Design::Sparse(_) | Design::Constant { .. } => {
                match self.offset.as_slice() {
                    [] => values.fill(0.0),
                    offset => values.copy_from_slice(offset),
                }
                self.design.multiply_add(theta, values);
            }
        }
    }
}
