//! Frontal matrix: the dense rows in which variables are eliminated, block after block.

use super::frontal_rows::{FrontalRows, add_multiple};
use super::triangular_rows::TriangularRows;
use std::mem::swap;
use std::ops::Range;

/// Smallest coefficient, in an equality scaled to 1, of a variable that the equality eliminates.
const FIRM: f64 = 1e-8;
/// Entries of scaled equalities below this are rounding errors.
const ZERO: f64 = 1e-13;
/// Share of its largest entry below which the rest of a column depends on the previous columns.
const INDEPENDENT: f64 = 1e-14;

/// Rows with entries in one block of variables; each has an entry for every column, followed by one for every right-hand side.
pub struct Front {
    sides: usize,
    /// Places of the variables; the first `own` are eliminated here, the others pass to the next front.
    columns: Vec<u32>,
    own: usize,
    /// Equalities and residuals.
    ties: FrontalRows,
    rows: FrontalRows,
    /// First row that passes to the next front.
    left: usize,
    before: Before,
    /// Last block of each variable, counted from 1, and its column there.
    met: Vec<u32>,
    column: Vec<u32>,
    /// Largest entry of each variable in a residual so far.
    size: Vec<f64>,
    block: u32,
    taken: Vec<bool>,
    active: Vec<usize>,
    sums: Vec<f64>,
}

/// The previous front; its remaining part starts at column `own` and row `left`.
#[derive(Default)]
struct Before {
    columns: Vec<u32>,
    own: usize,
    ties: FrontalRows,
    rows: FrontalRows,
    left: usize,
}

impl Front {
    /// The front before the first block.
    pub fn new(variables: usize, sides: usize) -> Self {
        Self {
            sides,
            columns: Vec::new(),
            own: 0,
            ties: FrontalRows::default(),
            rows: FrontalRows::default(),
            left: 0,
            before: Before::default(),
            met: vec![0; variables],
            column: vec![0; variables],
            size: vec![0.0; variables],
            block: 0,
            taken: Vec::new(),
            active: Vec::new(),
            sums: Vec::new(),
        }
    }

    /// Begins the block of the variables at the places `own`.
    pub fn begin(&mut self, own: Range<u32>) {
        let before = &mut self.before;
        swap(&mut self.columns, &mut before.columns);
        swap(&mut self.ties, &mut before.ties);
        swap(&mut self.rows, &mut before.rows);
        (before.own, before.left) = (self.own, self.left);
        self.block += 1;
        self.own = own.len();
        self.columns.clear();
        for position in own {
            self.meet(position);
        }
        for k in self.before.own..self.before.columns.len() {
            self.meet(self.before.columns[k]);
        }
    }

    /// Registers a variable of the following rows.
    pub fn meet(&mut self, position: u32) {
        if self.met[position as usize] != self.block {
            self.met[position as usize] = self.block;
            self.columns.push(position);
        }
    }

    /// Takes over the remaining rows of the previous front, once all variables are registered.
    pub fn settle(&mut self) {
        self.columns[self.own..].sort_unstable();
        for (k, position) in self.columns.iter().enumerate() {
            self.column[*position as usize] = k as u32;
        }
        let (n, sides) = (self.columns.len(), self.sides);
        let before = &self.before;
        let (first, end) = (before.own, before.columns.len());
        let take = |from: &[f64], to: &mut [f64]| {
            for (position, a) in before.columns[first..].iter().zip(&from[first..end]) {
                to[self.column[*position as usize] as usize] = *a;
            }
            to[n..].copy_from_slice(&from[end..end + sides]);
        };
        self.ties.clear(n + sides);
        for i in 0..before.ties.len() {
            take(before.ties.row(i), self.ties.add());
        }
        self.rows.clear(n + sides);
        for i in before.left..before.rows.len() {
            take(before.rows.row(i), self.rows.add());
        }
    }

    /// Adds an equality, scaled to 1.
    pub fn add_tie(&mut self, entries: impl Iterator<Item = (u32, f64)>, right: f64) {
        let n = self.columns.len();
        let row = self.ties.add();
        for (position, a) in entries {
            row[self.column[position as usize] as usize] = a;
        }
        row[n..].fill(right);
        let largest = row[..n].iter().fold(0.0f64, |most, a| most.max(a.abs()));
        if largest > 0.0 {
            row.iter_mut().for_each(|a| *a /= largest);
        }
    }

    /// Adds a residual.
    pub fn add_row(
        &mut self,
        entries: impl IntoIterator<Item = (u32, f64)>,
        right: impl Iterator<Item = f64>,
    ) {
        let n = self.columns.len();
        let row = self.rows.add();
        for (position, a) in entries {
            row[self.column[position as usize] as usize] = a;
            let size = &mut self.size[position as usize];
            *size = size.max(a.abs());
        }
        row[n..].iter_mut().zip(right).for_each(|(b, f)| *b = f);
    }

    /// Eliminates the block's own variables into `factor`; `None` if the rows do not determine them or the equalities contradict each
    /// other.
    pub fn eliminate(&mut self, factor: &mut TriangularRows) -> Option<()> {
        self.taken.clear();
        self.taken.resize(self.own, false);
        while let Some((tie, column)) = self.firmest_tie()? {
            self.substitute(tie, column, factor);
        }
        self.check_ties()?;
        let (mut top, mut left) = (0, 0);
        for column in 0..self.columns.len() {
            let own = column < self.own;
            if own && self.taken[column] {
                continue;
            }
            if self.triangulate(column, top) {
                top += 1;
            } else if own {
                return None;
            }
            if own {
                factor.push(column, &self.columns, self.rows.row(top - 1), false);
                left = top;
            }
        }
        // The rows below have no entries in the variable.
        self.rows.truncate(top);
        self.left = left;
        Some(())
    }

    /// Equality and column with the largest coefficient of an own variable; `Some(None)` if no equality has an own variable. `None` if
    /// the coefficient is too small.
    fn firmest_tie(&self) -> Option<Option<(usize, usize)>> {
        let mut firmest = (ZERO, None);
        for i in 0..self.ties.len() {
            for (column, a) in self.ties.row(i)[..self.own].iter().enumerate() {
                if a.abs() > firmest.0 {
                    firmest = (a.abs(), Some((i, column)));
                }
            }
        }
        match firmest {
            (size, Some(_)) if size < FIRM => None,
            (_, found) => Some(found),
        }
    }

    /// Eliminates the variable of `column` by an equality.
    fn substitute(&mut self, tie: usize, column: usize, factor: &mut TriangularRows) {
        let n = self.ties.len();
        self.ties.swap(tie, n - 1);
        let (rest, pivot) = self.ties.split_last();
        factor.push(column, &self.columns, pivot, true);
        for row in rest.chain(self.rows.iter_mut()) {
            let share = row[column] / pivot[column];
            if share != 0.0 {
                add_multiple(row, -share, pivot);
                row[column] = 0.0;
            }
        }
        self.ties.truncate(n - 1);
        self.taken[column] = true;
    }

    /// Clears rounding errors of own variables in the equalities and removes empty ones; `None` if an empty equality has a nonzero
    /// right-hand side.
    fn check_ties(&mut self) -> Option<()> {
        let n = self.columns.len();
        let mut kept = 0;
        for i in 0..self.ties.len() {
            let row = self.ties.row_mut(i);
            let zero = |a: &f64| a.abs() <= ZERO;
            if !row[..self.own].iter().all(zero) {
                // NaN counts as nonzero.
                return None;
            }
            row[..self.own].fill(0.0);
            if !row[..n].iter().all(zero) {
                self.ties.swap(kept, i);
                kept += 1;
            } else if !row[n..].iter().all(|b| b.abs() <= FIRM) {
                return None;
            }
        }
        self.ties.truncate(kept);
        Some(())
    }

    /// Reduces `column` of the rows from `top` on to row `top`; false if the column is zero.
    fn triangulate(&mut self, column: usize, top: usize) -> bool {
        let size = &mut self.size[self.columns[column] as usize];
        self.active.clear();
        let (mut largest, mut first, mut nan) = (0.0, 0, false);
        for i in top..self.rows.len() {
            let a = self.rows.row(i)[column].abs();
            if a != 0.0 {
                if a > largest {
                    (largest, first) = (a, self.active.len());
                }
                // NaN spreads to the solution, which is then rejected.
                nan |= a.is_nan();
                self.active.push(i);
            }
        }
        if largest <= INDEPENDENT * *size && !nan {
            return false;
        }
        *size = size.max(largest);
        if self.active.len() > 1 {
            // The largest entry as pivot loses fewest digits with rows of different magnitudes.
            self.active.swap(0, first);
            self.rows.reflect(&self.active, column, &mut self.sums);
        }
        self.rows.swap(top, self.active[0]);
        true
    }
}
