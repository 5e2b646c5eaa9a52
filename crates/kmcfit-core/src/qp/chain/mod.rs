//! Least squares with equalities by orthogonal elimination along time.
//!
//! The variables of a problem in time are ordered, and each row couples a few neighbouring ones. Elimination from the last variable
//! to the first needs only a small dense front: the rows with entries in the variables being eliminated, and the rows that remain of
//! them. An equality eliminates its variable with the largest coefficient; Householder reflections eliminate the others. Neither
//! `F^T F` nor a regularisation costs digits, whatever the magnitudes of the rows, and time and memory are proportional to the
//! number of variables.

mod banded_factor;
mod front;
mod frontal_rows;
mod triangular_rows;

pub use banded_factor::BandedFactor;

use super::Subproblem;
use crate::constraints::Rows;
use front::Front;
use triangular_rows::TriangularRows;

/// Largest number of variables in a front; wider problems are left to the sparse factorisation.
const WIDEST: usize = 48;

/// Minimisers of `|F z - f|^2 + sum d z^2` subject to `E z = e` for each `f`; `None` without an elimination order, with too wide
/// fronts, or if the minimum is not unique.
pub fn minimise(sub: &Subproblem, targets: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let chain = Chain::of(sub)?;
    let mut factor = TriangularRows::new(sub.variables, targets.len());
    let mut front = Front::new(sub.variables, targets.len());
    for block in 0..chain.blocks() {
        chain.assemble(block, &mut front, targets);
        front.eliminate(&mut factor)?;
    }
    let solutions = (0..targets.len()).map(|side| chain.in_order(&factor.substitute(side)));
    solutions.collect()
}

/// Elimination order; variables are numbered by their places in it.
struct Chain<'a> {
    sub: &'a Subproblem,
    /// VariableRole of each variable.
    positions: Vec<u32>,
    /// Variables by place.
    variables: Vec<u32>,
    /// First place of each block, and one past the last.
    firsts: Vec<u32>,
    residuals: Buckets,
    equalities: Buckets,
}

/// Rows by the block in which they enter.
struct Buckets {
    starts: Vec<u32>,
    rows: Vec<u32>,
}

impl Buckets {
    /// Sorts `items` by the block of each.
    fn new(blocks: usize, items: &[u32]) -> Self {
        let mut starts = vec![0u32; blocks + 1];
        items.iter().for_each(|b| starts[*b as usize + 1] += 1);
        (0..blocks).for_each(|b| starts[b + 1] += starts[b]);
        let mut next = starts.clone();
        let mut rows = vec![0u32; items.len()];
        for (i, b) in items.iter().enumerate() {
            let position = &mut next[*b as usize];
            rows[*position as usize] = i as u32;
            *position += 1;
        }
        Self { starts, rows }
    }

    fn of(&self, block: usize) -> impl Iterator<Item = usize> + '_ {
        let range = self.starts[block] as usize..self.starts[block + 1] as usize;
        self.rows[range].iter().map(|i| *i as usize)
    }
}

impl<'a> Chain<'a> {
    fn of(sub: &'a Subproblem) -> Option<Self> {
        if sub.elimination_order.len() != sub.variables {
            return None;
        }
        let last = *sub.elimination_order.iter().max()?;
        let blocks = last as usize + 1;
        let own: Vec<u32> = sub
            .elimination_order
            .iter()
            .map(|station| last - station)
            .collect();
        let variables = Buckets::new(blocks, &own);
        let mut positions = vec![0u32; sub.variables];
        for (position, j) in variables.rows.iter().enumerate() {
            positions[*j as usize] = position as u32;
        }
        let entry = |rows: &Rows| -> Vec<u32> {
            let first = |i| rows.row(i).map(|(j, _)| own[j]).min().unwrap_or(0);
            (0..rows.len()).map(first).collect()
        };
        let (residuals, equalities) = (entry(&sub.residuals), entry(&sub.equalities));
        let mut entered = own.clone();
        for (rows, blocks) in [(&sub.residuals, &residuals), (&sub.equalities, &equalities)] {
            for (i, block) in blocks.iter().enumerate() {
                rows.row(i)
                    .for_each(|(j, _)| entered[j] = entered[j].min(*block));
            }
        }
        let width = widest(blocks, &entered, &own);
        (width <= WIDEST).then(|| Self {
            sub,
            positions,
            firsts: variables.starts,
            variables: variables.rows,
            residuals: Buckets::new(blocks, &residuals),
            equalities: Buckets::new(blocks, &equalities),
        })
    }

    fn blocks(&self) -> usize {
        self.firsts.len() - 1
    }

    /// Assembles the `front` of `block` from its rows and those remaining from the previous front.
    fn assemble(&self, block: usize, front: &mut Front, targets: &[Vec<f64>]) {
        let sub = self.sub;
        let position = |(j, a): (usize, f64)| (self.positions[j], a);
        front.begin(self.firsts[block]..self.firsts[block + 1]);
        for i in self.residuals.of(block) {
            sub.residuals
                .row(i)
                .for_each(|(j, _)| front.meet(self.positions[j]));
        }
        for i in self.equalities.of(block) {
            sub.equalities
                .row(i)
                .for_each(|(j, _)| front.meet(self.positions[j]));
        }
        front.settle();
        for i in self.equalities.of(block) {
            let right = sub.equalities.right()[i];
            front.add_tie(sub.equalities.row(i).map(position), right);
        }
        for i in self.residuals.of(block) {
            let right = targets.iter().map(|f| f[i]);
            front.add_row(sub.residuals.row(i).map(position), right);
        }
        for &j in self.variables_of(block) {
            let d = sub.proximal[j as usize];
            if d > 0.0 {
                let row = [(self.positions[j as usize], d.sqrt())];
                front.add_row(row, targets.iter().map(|_| 0.0));
            }
        }
    }

    fn variables_of(&self, block: usize) -> &[u32] {
        &self.variables[self.firsts[block] as usize..self.firsts[block + 1] as usize]
    }

    /// Values by variable, from values by place.
    fn in_order(&self, by_place: &[f64]) -> Option<Vec<f64>> {
        let values = self
            .positions
            .iter()
            .map(|position| by_place[*position as usize]);
        let values: Vec<f64> = values.collect();
        values.iter().all(|z| z.is_finite()).then_some(values)
    }
}

/// Largest number of variables in a front, if each enters in one block and is eliminated in its own.
fn widest(blocks: usize, entered: &[u32], own: &[u32]) -> usize {
    let mut change = vec![0i64; blocks + 1];
    for (from, to) in entered.iter().zip(own) {
        change[*from as usize] += 1;
        change[*to as usize + 1] -= 1;
    }
    let mut width = 0;
    let widths = change.iter().map(|c| {
        width += c;
        width
    });
    widths.max().unwrap_or(0) as usize
}
