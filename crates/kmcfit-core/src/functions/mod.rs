//! Coefficient functions: a sparse design matrix times parameters plus a fixed part.
//!
//! `p_j(t_i) = (B_j theta_j)_i + b_j,i` at the nodes `t_i`. So gradients with respect to parameters are
//! `B_j^T` times gradients with respect to nodal values, and the L2 inner product of two functions
//! is `theta^T (B^T W B) theta'` with the trapezoid weights `W`.

pub mod basis;
mod coefficient_kind;
mod design;
mod gram;
mod parameterization;
mod penalty;
mod ratios;
mod scalar;
mod total_variation;

pub use basis::Basis;
pub use coefficient_kind::CoefficientKind;
pub use design::Design;
pub use gram::Gram;
pub use parameterization::Parameterization;
pub use penalty::Penalty;
pub use ratios::Ratios;
pub use scalar::{Prior, ScalarParameter, ScalarValue};
pub use total_variation::TotalVariation;

use crate::system::Grid;

/// One coefficient function and where its search starts.
#[derive(Debug, Clone)]
pub struct CoefficientFunction {
    /// Which function this is.
    pub quantity: CoefficientKind,
    /// The experiment that has it for itself; `None` if it belongs to the shared coefficient set.
    pub owner: Option<String>,
    /// The space that the function is estimated in; `None` if it is fixed.
    pub basis: Option<Basis>,
    /// How parameters become values at the nodes.
    pub design: Design,
    /// Fixed part at the nodes, in the unit of the quantity.
    pub offset: Vec<f64>,
    /// Start of the parameters, in the unit of the quantity.
    pub start: Vec<f64>,
    /// Whether positive parameters make the function positive everywhere (a basis of non-negative
    /// functions without a fixed part), so that a search may run in their logarithms.
    pub positive_parameters: bool,
}

impl CoefficientFunction {
    /// A function known at all nodes: no parameters.
    pub fn fixed(quantity: CoefficientKind, values: Vec<f64>) -> Self {
        Self {
            quantity,
            owner: None,
            basis: None,
            design: Design::Empty,
            offset: values,
            start: Vec::new(),
            positive_parameters: false,
        }
    }

    /// A function of `basis` on `grid`, starting from the parameters `start`.
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
        Self::with_design(quantity, basis, design, grid.nodes(), start)
    }

    /// One value per node, starting from `start`.
    pub fn nodal(quantity: CoefficientKind, start: Vec<f64>) -> Self {
        let nodes = start.len();
        Self::with_design(quantity, Basis::Nodal, Design::Identity, nodes, start)
    }

    /// One value for all `nodes` nodes, starting from `start`.
    pub fn constant(quantity: CoefficientKind, start: f64, nodes: usize) -> Self {
        let design = Design::ones(nodes);
        Self::with_design(quantity, Basis::Constant, design, nodes, vec![start])
    }

    fn with_design(
        quantity: CoefficientKind,
        basis: Basis,
        design: Design,
        nodes: usize,
        start: Vec<f64>,
    ) -> Self {
        Self {
            quantity,
            owner: None,
            design,
            offset: vec![0.0; nodes],
            start,
            positive_parameters: basis.positive_parameters(),
            basis: Some(basis),
        }
    }

    /// What reports call it: its quantity, and the experiment that has it for itself.
    pub fn name(&self) -> String {
        match &self.owner {
            None => self.quantity.name().to_owned(),
            Some(owner) => format!("{} of {owner}", self.quantity.name()),
        }
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.start.len()
    }

    /// The value of the fixed part and the entry of the design, if both are the same at every node.
    fn flat(&self) -> Option<[f64; 2]> {
        let is_flat = self.offset.windows(2).all(|pair| pair[0] == pair[1]);
        let (_, entry) = self.design.row(0).next()?;
        (self.design.is_constant() && is_flat).then_some([*self.offset.first()?, entry])
    }

    /// Values at the nodes for the parameters `theta`.
    pub fn values_into(&self, theta: &[f64], values: &mut [f64]) {
        match &self.design {
            // One value per node without a fixed part: a copy, so that no bit changes.
            Design::Identity => values.copy_from_slice(theta),
            Design::Empty => values.copy_from_slice(&self.offset),
            Design::Sparse(_) => {
                values.copy_from_slice(&self.offset);
                self.design.multiply_add(theta, values);
            }
        }
    }
}
