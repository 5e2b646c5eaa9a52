//! A basis on a grid.

use super::BuildError;
use crate::functions::basis::uniform_knots;
use crate::functions::{Basis, Design, Gram};
use crate::model::{BasisName, CoefficientSpec, KnotSpec};
use crate::system::Grid;
use crate::system::quadrature::trapezoid_weights;

/// Largest distance, in steps, of the first and last knot from the ends of the record.
const SAME_TIME: f64 = 1e-6;

/// The key of a basis beside its name.
fn own_key(basis: BasisName) -> Option<&'static str> {
    match basis {
        BasisName::Nodal | BasisName::Constant => None,
        BasisName::Polynomial => Some("degree"),
        BasisName::PiecewiseConstant | BasisName::PiecewiseLinear | BasisName::BSpline => {
            Some("knots")
        }
    }
}

impl CoefficientSpec {
    /// Refuses `knots` and `degree` where the basis does not use them.
    pub(super) fn check_basis_keys(&self, key: &str) -> Result<(), BuildError> {
        let given = [
            ("knots", self.knots.is_some()),
            ("degree", self.degree.is_some()),
        ];
        let own = self.basis.and_then(own_key);
        let Some((unused, _)) = given.iter().find(|(k, given)| *given && own != Some(*k)) else {
            return Ok(());
        };
        let problem = match self.basis {
            Some(basis) => format!("the basis `{basis}` does not use this key"),
            None => "this key needs a basis that uses it".to_owned(),
        };
        Err(BuildError::new(format!("{key}.{unused}"), problem)
            .found(format!("`{unused}`"))
            .expected(match (self.basis, own) {
                (_, Some(own)) => format!("`{own}`"),
                (Some(_), None) => "neither `knots` nor `degree`".to_owned(),
                (None, None) => "`basis` beside it".to_owned(),
            })
            .hint(match *unused {
                "knots" => "piecewise-constant, piecewise-linear and b-spline have knots",
                _ => "polynomial has a degree",
            }))
    }

    /// Constructs the basis on a grid; errors name keys below `key`.
    pub(super) fn basis_on(
        &self,
        name: BasisName,
        key: &str,
        grid: &Grid,
    ) -> Result<Basis, BuildError> {
        let nodes = grid.nodes();
        let missing = |what: &str, expected: &str| {
            BuildError::new(key, format!("the basis `{name}` needs {what}")).expected(expected)
        };
        let knots = |most: usize| match &self.knots {
            Some(knots) => knots_on(knots, &format!("{key}.knots"), grid, most),
            None => Err(missing(
                "knots",
                "`knots`: `auto`, the number of equally spaced knots, or a list of times in s",
            )),
        };
        let basis = match name {
            BasisName::Nodal => Basis::Nodal,
            BasisName::Constant => Basis::Constant,
            BasisName::PiecewiseConstant => Basis::PiecewiseConstant {
                knots: knots(nodes + 1)?,
            },
            BasisName::PiecewiseLinear => Basis::PiecewiseLinear {
                knots: knots(nodes)?,
            },
            BasisName::BSpline => Basis::BSpline {
                knots: knots(nodes.saturating_sub(2))?,
            },
            BasisName::Polynomial => {
                let degree = self.degree.ok_or_else(|| {
                    missing("a degree", "`degree`: an integer, for instance `degree: 1`")
                })?;
                let most = Basis::highest_degree(grid);
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

/// Times of the knots, s; the first and last are exactly the ends of the record.
fn knots_on(knots: &KnotSpec, key: &str, grid: &Grid, most: usize) -> Result<Vec<f64>, BuildError> {
    let count = match knots {
        KnotSpec::Count(count) => *count,
        KnotSpec::Times(times) => times.len(),
        // Replaced by a number before.
        KnotSpec::Auto(_) => 0,
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
    match knots {
        KnotSpec::Times(times) => listed(key, times, grid),
        KnotSpec::Count(_) | KnotSpec::Auto(_) => Ok(uniform_knots(grid, count)),
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
