//! Bases: representation of a function of time by parameters, `p(t) = sum_j theta_j b_j(t)`.
//!
//! A [`Basis`] is the choice of a user; its functions `b_j` are in one file per basis. The functions of all bases except
//! polynomials are nonnegative and sum to one, so that parameters have the unit and magnitude of the function.

mod b_spline;
mod constant;
mod differences;
mod knots;
mod legendre;
mod piecewise_constant;
mod piecewise_linear;
mod polynomial;
mod space;

pub use knots::uniform_knots;
pub use polynomial::{from_physical_powers, physical_powers};

use super::{Design, Gram};
use crate::rows::{Rows, merge_columns};
use crate::system::Grid;
use crate::system::quadrature::trapezoid_weights;
use space::{BasisFunctions, local, matrix};
use std::sync::Arc;

/// Passes of the iterative refinement of the normal equations in [`Basis::project`]; the second removes the rounding error of
/// the first.
const PROJECTION_PASSES: usize = 3;

/// Highest degree divided by sqrt(N) on N nodes: above it, polynomials on equally spaced nodes are linearly dependent in double
/// precision (measured for N from 50 to 1000).
const DEGREE_PER_ROOT_OF_NODES: f64 = 7.0;

/// A finite-dimensional space of functions of time on the record.
///
/// `knots` are times in s: at least two, increasing, the first and the last of them the ends of the
/// record. They need not fall on nodes.
#[derive(Debug, Clone, PartialEq)]
pub enum Basis {
    /// One value per node of the grid, linear in between.
    Nodal,
    /// One value for all times.
    Constant,
    /// One value per cell between two knots; at an inner knot the value of the cell after it, at a node the mean over the half steps beside it.
    PiecewiseConstant {
        /// Times in s at which the value may jump, and both ends.
        knots: Vec<f64>,
    },
    /// One value per knot, linear in between.
    PiecewiseLinear {
        /// Times in s at which the slope may jump, and both ends.
        knots: Vec<f64>,
    },
    /// Legendre polynomials `P_n(x)`, `n = 0..=degree`, on the record mapped to `x` in `[-1, 1]`.
    Polynomial {
        /// Highest power.
        degree: usize,
    },
    /// Cubic B-splines on a clamped knot sequence: twice continuously differentiable.
    BSpline {
        /// Times in s at which the third derivative may jump, and both ends.
        knots: Vec<f64>,
    },
}

impl Basis {
    /// Name in a model file.
    pub fn name(&self) -> &'static str {
        match self {
            Basis::Nodal => "nodal",
            Basis::Constant => "constant",
            Basis::PiecewiseConstant { .. } => "piecewise-constant",
            Basis::PiecewiseLinear { .. } => "piecewise-linear",
            Basis::Polynomial { .. } => "polynomial",
            Basis::BSpline { .. } => "b-spline",
        }
    }

    /// Functions of this basis on a record.
    fn on(&self, grid: &Grid) -> Box<dyn BasisFunctions> {
        match self {
            Basis::Nodal => Box::new(piecewise_linear::PiecewiseLinear::on_nodes(grid)),
            Basis::Constant => Box::new(constant::Constant::on(grid)),
            Basis::PiecewiseConstant { knots } => {
                Box::new(piecewise_constant::PiecewiseConstant::new(knots))
            }
            Basis::PiecewiseLinear { knots } => {
                Box::new(piecewise_linear::PiecewiseLinear::new(knots))
            }
            Basis::Polynomial { degree } => Box::new(polynomial::Legendre::on(grid, *degree)),
            Basis::BSpline { knots } => Box::new(b_spline::CubicSpline::new(knots)),
        }
    }

    /// Highest degree of a polynomial that is independent of lower ones on the nodes of a grid.
    pub fn highest_degree(grid: &Grid) -> usize {
        let nodes = grid.nodes();
        let stable = DEGREE_PER_ROOT_OF_NODES * (nodes as f64).sqrt();
        (nodes - 1).min(stable as usize)
    }

    /// Number of parameters: nodes (`nodal`), 1 (`constant`), knots - 1 (`piecewise-constant`),
    /// knots (`piecewise-linear`), degree + 1 (`polynomial`), knots + 2 (`b-spline`).
    pub fn parameters(&self, grid: &Grid) -> usize {
        match self {
            Basis::Nodal => grid.nodes(),
            Basis::Constant => 1,
            Basis::PiecewiseConstant { knots } => knots.len() - 1,
            Basis::PiecewiseLinear { knots } => knots.len(),
            Basis::Polynomial { degree } => degree + 1,
            Basis::BSpline { knots } => knots.len() + 2,
        }
    }

    /// Design matrix `B_ij = b_j(t_i)` at the nodes, `nodes x parameters`; dimensionless. For cells the mean of `b_j` over the half steps beside
    /// the node.
    pub fn design(&self, grid: &Grid) -> Design {
        match self {
            Basis::Nodal => Design::Identity,
            Basis::Constant => Design::Constant {
                nodes: grid.nodes(),
            },
            Basis::PiecewiseConstant { knots } => {
                let cells = piecewise_constant::PiecewiseConstant::new(knots);
                Design::Sparse(Arc::new(cells.at_nodes(grid)))
            }
            _ => Design::Sparse(Arc::new(local(self.on(grid).as_ref(), grid))),
        }
    }

    /// Derivatives `d^q b_j / dt^q` at `times` (s) within the record, `q = derivative`: `times.len() x parameters`, in 1/s^q.
    ///
    /// At a jump the value after the time is used, at the end of the record the one before. A time that differs from a knot by
    /// rounding counts as the knot. Times outside the record are moved to its ends.
    pub fn rows(&self, grid: &Grid, times: &[f64], derivative: usize) -> Rows {
        let space = self.on(grid);
        let row = |t: &f64| (*t, 1.0);
        matrix(space.as_ref(), times.iter().map(row), derivative)
    }

    /// The roughness `L` of order `q` in residual form, rows `x parameters`:
    /// `|L theta|^2 = integral (d^q p / dt^q)^2 dt` over the record, in (unit of p)^2 s^(1-2q).
    ///
    /// Exact for every function of the basis, by Gauss–Legendre quadrature of each cell. Where the derivative is not
    /// square-integrable — `nodal` and `piecewise-linear` with `q = 2`, `piecewise-constant` with `q >= 1` — it is the sum of
    /// `h (divided difference)^2` over the inner knots (for `piecewise-constant`: of differences between cell centres), `h` the
    /// mean of the two neighbouring spacings; with equal spacing `h ((p_{j-1} - 2 p_j + p_{j+1}) / h^2)^2`. The half cells at the
    /// ends are omitted. A derivative that is zero has no rows.
    pub fn roughness(&self, grid: &Grid, order: usize) -> Rows {
        self.on(grid).roughness(order)
    }

    /// Times (s) at which the formula of the function may change: the nodes, the knots, or the ends of the record.
    pub fn knot_times(&self, grid: &Grid) -> Vec<f64> {
        match self {
            Basis::Nodal => grid.times(),
            Basis::Constant | Basis::Polynomial { .. } => uniform_knots(grid, 2),
            Basis::PiecewiseConstant { knots }
            | Basis::PiecewiseLinear { knots }
            | Basis::BSpline { knots } => knots.clone(),
        }
    }

    /// True if positive parameters make the function positive at all times: for all bases except polynomials of degree 1 and more.
    pub fn positive_parameters(&self) -> bool {
        !matches!(self, Basis::Polynomial { degree: 1.. })
    }

    /// Parameters of the constant function `value`.
    pub fn constant(&self, grid: &Grid, value: f64) -> Vec<f64> {
        let mut theta = vec![0.0; self.parameters(grid)];
        match self {
            Basis::Polynomial { .. } => theta[0] = value,
            _ => theta.fill(value),
        }
        theta
    }

    /// Changes of the function between neighbouring knots, cells or nodes, rows x parameters; the sum of their absolute values is
    /// the total variation.
    pub fn changes(&self, grid: &Grid) -> Rows {
        let knots = self.knot_times(grid);
        let times: Vec<f64> = match self {
            Basis::PiecewiseConstant { .. } => {
                knots.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect()
            }
            Basis::Nodal | Basis::PiecewiseLinear { .. } => knots,
            Basis::Constant => Vec::new(),
            Basis::Polynomial { .. } | Basis::BSpline { .. } => grid.times(),
        };
        let values = self.rows(grid, &times, 0);
        let mut changes = Rows::of_width(self.parameters(grid));
        for i in 1..times.len() {
            let before = values.row(i - 1).map(|(j, value)| (j, -value));
            let mut entries: Vec<_> = values.row(i).chain(before).collect();
            merge_columns(&mut entries);
            changes.push(entries, 0.0);
        }
        changes
    }

    /// Parameters of the function closest to the values `nodal` at the nodes, `min sum_i w_i (p(t_i) - nodal_i)^2` with trapezoid
    /// weights `w_i` (s). `None` if the basis functions are linearly dependent at the nodes.
    ///
    /// # Panics
    /// If there is not one value per node.
    pub fn project(&self, grid: &Grid, nodal: &[f64]) -> Option<Vec<f64>> {
        assert_eq!(nodal.len(), grid.nodes(), "one value per node");
        if *self == Basis::Nodal {
            return Some(nodal.to_vec());
        }
        let design = self.design(grid);
        let weights = trapezoid_weights(grid.nodes(), grid.step());
        let gram = Gram::new(&design, &weights)?;
        // Starting from a constant, which makes constants exact.
        let mut theta = self.constant(grid, nodal[0]);
        let mut correction = theta.clone();
        for _ in 0..PROJECTION_PASSES {
            let values = design.multiply(&theta, grid.nodes());
            let misses = nodal.iter().zip(&values).zip(&weights);
            let weighted: Vec<f64> = misses.map(|((n, v), w)| w * (n - v)).collect();
            let mut dual = vec![0.0; theta.len()];
            design.transpose_multiply_add(&weighted, &mut dual);
            gram.solve(&dual, &mut correction);
            theta.iter_mut().zip(&correction).for_each(|(t, c)| *t += c);
        }
        Some(theta)
    }
}
