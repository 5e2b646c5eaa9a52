//! Specification of a basis, and its construction on a grid.

use super::BuildError;
use crate::functions::basis::uniform_knots;
use crate::functions::{Basis, Design, Gram};
use crate::system::Grid;
use crate::system::quadrature::trapezoid_weights;

/// Largest distance, in steps, of the first and last knot from the ends of the record.
const SAME_TIME: f64 = 1e-6;

/// Knots of a basis.
#[derive(Debug, Clone, PartialEq)]
pub enum Knots {
    /// Number of knots, equally spaced over the record, both ends included.
    Count(usize),
    /// Times of the knots, s: increasing, both ends of the record included.
    Times(Vec<f64>),
    /// About 40 intervals, and a penalty on the curvature whose weight the data choose.
    Auto,
}

/// Basis of a coefficient function, independent of the grid.
#[derive(Debug, Clone, PartialEq)]
pub enum BasisSpec {
    /// One value per node.
    Nodal,
    /// One value for all times.
    Constant,
    /// One value per cell between knots.
    PiecewiseConstant(Knots),
    /// One value per knot, linear in between.
    PiecewiseLinear(Knots),
    /// A cubic spline.
    BSpline(Knots),
    /// A polynomial over the whole record.
    Polynomial {
        /// Degree.
        degree: usize,
    },
}

impl BasisSpec {
    /// Constructs the basis on a grid; errors name keys below `key`.
    pub(super) fn on(&self, key: &str, grid: &Grid) -> Result<Basis, BuildError> {
        let nodes = grid.nodes();
        let at = |given: &Knots, most: usize| given.on(&format!("{key}.knots"), grid, most);
        let basis = match self {
            BasisSpec::Nodal => Basis::Nodal,
            BasisSpec::Constant => Basis::Constant,
            BasisSpec::PiecewiseConstant(knots) => {
                let knots = at(knots, nodes + 1)?;
                Basis::PiecewiseConstant { knots }
            }
            BasisSpec::PiecewiseLinear(knots) => {
                let knots = at(knots, nodes)?;
                Basis::PiecewiseLinear { knots }
            }
            BasisSpec::BSpline(knots) => {
                let knots = at(knots, nodes.saturating_sub(2))?;
                Basis::BSpline { knots }
            }
            BasisSpec::Polynomial { degree } => {
                let (degree, most) = (*degree, Basis::highest_degree(grid));
                if degree > most {
                    let problem = "the degree is too high for the grid";
                    return Err(BuildError::new(format!("{key}.degree"), problem)
                        .found(format!("{degree} on {nodes} nodes"))
                        .expected(format!("at most {most}")));
                }
                Basis::Polynomial { degree }
            }
        };
        check_independent(key, &basis, grid)?;
        Ok(basis)
    }
}

impl Knots {
    /// Times of the knots, s; the first and last are exactly the ends of the record.
    fn on(&self, key: &str, grid: &Grid, most: usize) -> Result<Vec<f64>, BuildError> {
        let count = match self {
            Knots::Count(count) => *count,
            Knots::Times(times) => times.len(),
            // Replaced by a number before.
            Knots::Auto => 0,
        };
        if count < 2 {
            return Err(BuildError::new(key, "there are fewer than two knots")
                .found(count)
                .expected("2 or more, both ends of the record included"));
        }
        if count > most {
            return Err(BuildError::new(key, "there are more parameters than nodes")
                .found(format!("{count} knots on {} nodes", grid.nodes()))
                .expected(format!("at most {most} knots")));
        }
        match self {
            Knots::Times(times) => listed(key, times, grid),
            Knots::Count(_) | Knots::Auto => Ok(uniform_knots(grid, count)),
        }
    }
}

fn listed(key: &str, given: &[f64], grid: &Grid) -> Result<Vec<f64>, BuildError> {
    let (start, end) = (grid.start(), grid.time(grid.nodes() - 1));
    let slack = SAME_TIME * grid.step();
    let at =
        |i: usize, problem: &str| BuildError::new(format!("{key}[{i}]"), problem).found(given[i]);
    for (i, &t) in given.iter().enumerate() {
        // False for NaN.
        if !(t >= start - slack && t <= end + slack) {
            return Err(at(i, "this knot lies outside the record").expected(format!(
                "a time from {start} s to {} s",
                grid.round_time(end)
            )));
        }
        if i > 0 && t <= given[i - 1] {
            let before = given[i - 1];
            return Err(at(i, "the knots do not increase")
                .found(format!("{t} after {before}"))
                .expected(format!("a time greater than {before} s")));
        }
    }
    let mut times = given.to_vec();
    let last = times.len() - 1;
    for (i, bound, problem) in [
        (0, start, "the first knot is not at the start of the record"),
        (last, end, "the last knot is not at the end of the record"),
    ] {
        if (times[i] - bound).abs() > slack {
            return Err(at(i, problem)
                .expected(format!("{bound} s"))
                .hint("a list of knots includes both ends of the record"));
        }
        times[i] = bound;
    }
    Ok(times)
}

/// Steps in a cell between knots with which the functions of a basis are independent.
const NODES_OF_CELL: f64 = 5.0;

/// Error if a basis function is zero at all nodes, or basis functions are linearly dependent at the nodes.
fn check_independent(key: &str, basis: &Basis, grid: &Grid) -> Result<(), BuildError> {
    let is_local = !matches!(basis, Basis::Polynomial { .. } | Basis::Nodal);
    let knots = match is_local {
        true => basis.knot_times(grid),
        false => Vec::new(),
    };
    let mut cells = knots.windows(2).map(|ends| ends[1] - ends[0]);
    // As many nodes in each cell as functions that are nonzero there.
    if is_local && cells.all(|width| width > NODES_OF_CELL * grid.step()) {
        return Ok(());
    }
    let design = basis.design(grid);
    let Design::Sparse(rows) = &design else {
        return Ok(());
    };
    let mut at_nodes = vec![false; basis.parameters(grid)];
    for i in 0..rows.len() {
        rows.row(i).for_each(|(j, _)| at_nodes[j] = true);
    }
    if let Some(absent) = at_nodes.iter().position(|there| !there) {
        // Function j is nonzero between the knots j - reach and j + 1.
        let knots = basis.knot_times(grid);
        let reach = (at_nodes.len() + 1).saturating_sub(knots.len());
        let from = knots[absent.saturating_sub(reach)];
        let to = knots[(absent + 1).min(knots.len() - 1)];
        let problem = "the knots are closer than the nodes";
        return Err(BuildError::new(format!("{key}.knots"), problem)
            .found(format!(
                "no node for a parameter between {from} s and {to} s"
            ))
            .expected(format!(
                "knots further apart than the step of {} s",
                grid.step()
            )));
    }
    let weights = trapezoid_weights(grid.nodes(), grid.step());
    if Gram::new(&design, &weights).is_some() {
        return Ok(());
    }
    let (own, fewer) = match basis {
        Basis::Polynomial { .. } => ("degree", "a lower degree, or more nodes"),
        _ => ("knots", "fewer knots, or more nodes"),
    };
    let problem = "the functions of this basis are linearly dependent at the nodes";
    Err(BuildError::new(format!("{key}.{own}"), problem)
        .found(format!(
            "{} parameters on {} nodes",
            at_nodes.len(),
            grid.nodes()
        ))
        .expected(fewer))
}
