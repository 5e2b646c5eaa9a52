//! Interface of a basis on a record.

use super::legendre;
use crate::functions::LocalRows;
use crate::rows::Rows;
use crate::system::Grid;

/// Functions `b_j` of a basis on a record: polynomials between break points.
pub(super) trait BasisFunctions {
    /// Number of functions.
    fn parameters(&self) -> usize;

    /// Highest degree between break points.
    fn degree(&self) -> usize;

    /// Times (s) between which the functions are polynomials, both ends included.
    fn breaks(&self) -> Vec<f64>;

    /// Appends index and `derivative`-th derivative (1/s^derivative) of every function that is nonzero near the time `t` (s).
    fn row(&self, t: f64, derivative: usize, entries: &mut Vec<(usize, f64)>);

    /// Roughness rows, see [`Basis::roughness`](super::Basis::roughness); the default is for functions with square-integrable
    /// derivative.
    fn roughness(&self, order: usize) -> Rows {
        square_integral(self, order)
    }
}

/// Matrix with one row per time and factor: `factor * d^derivative b_j / dt^derivative`.
pub(super) fn matrix<S: BasisFunctions + ?Sized>(
    space: &S,
    rows: impl Iterator<Item = (f64, f64)>,
    derivative: usize,
) -> Rows {
    let mut matrix = Rows::of_width(space.parameters());
    let mut entries = Vec::new();
    for (t, factor) in rows {
        entries.clear();
        space.row(t, derivative, &mut entries);
        let nonzero = entries.iter().filter(|(_, value)| *value != 0.0);
        matrix.push(nonzero.map(|(j, value)| (*j, factor * value)), 0.0);
    }
    matrix
}

/// Functions at the nodes of a grid.
pub(super) fn local(space: &dyn BasisFunctions, grid: &Grid) -> LocalRows {
    let span = (space.degree() + 1).min(space.parameters());
    let mut rows = LocalRows::new(space.parameters(), span);
    rows.reserve(grid.nodes());
    let mut entries = Vec::new();
    for i in 0..grid.nodes() {
        entries.clear();
        space.row(grid.time(i), 0, &mut entries);
        rows.push(entries.iter().copied());
    }
    rows
}

/// Rows `L` with `|L theta|^2 = integral (d^order p / dt^order)^2 dt`, by the shortest exact Gauss rule: `degree - order + 1`
/// rows per cell.
pub(super) fn square_integral<S: BasisFunctions + ?Sized>(space: &S, order: usize) -> Rows {
    let Some(rest) = space.degree().checked_sub(order) else {
        return Rows::of_width(space.parameters());
    };
    let rule = legendre::gauss_rule(rest + 1);
    let breaks = space.breaks();
    let cells = breaks.windows(2);
    let points: Vec<(f64, f64)> = cells
        .flat_map(|cell| {
            let (middle, half) = (0.5 * (cell[0] + cell[1]), 0.5 * (cell[1] - cell[0]));
            rule.iter()
                .map(move |(x, w)| (middle + half * x, (half * w).sqrt()))
        })
        .collect();
    matrix(space, points.into_iter(), order)
}
