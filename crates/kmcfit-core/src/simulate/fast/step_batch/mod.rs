//! Costs of many systems along a search ray, one per SIMD lane: the paper's trial steps.
//!
//! The search needs the trial of least cost and its response, bit-identical with
//! [`forward`](crate::simulate::reference::forward()). Responses are not stored: eight states along the record are, from
//! which [`reconstruct()`] computes the response of the best trial, eight parts in parallel. The order of summation differs
//! from that of the integral; trials whose cost is within a margin far above the rounding error of the sums are candidates.

mod reconstruct;
mod rows;
#[cfg(test)]
mod tests;

use crate::simd::{self, LANES, Row};
use crate::system::State;
use std::ops::Range;

pub(crate) use reconstruct::reconstruct;

/// Systems `p - a g` in linear free response by the midpoint rule, with a sample at every node.
#[derive(Clone, Copy)]
pub(crate) struct SearchRay<'a> {
    /// Mass, damping, stiffness at the nodes.
    pub functions: [&'a [f64]; 3],
    /// Search direction `g`, subtracted per unit of `a`.
    pub direction: [&'a [f64]; 3],
    /// State at the first node.
    pub initial: State,
    /// Displacement samples at the nodes, m.
    pub samples: &'a [f64],
    /// Step, s.
    pub step: f64,
}

/// Largest number of rows computed together: enough to hide the latency of divisions, few enough for the registers.
pub(crate) const ROWS: usize = 4;

/// Relative margin between a cost summed in SIMD lanes and in sequential order. Two sums of `n` nonnegative terms differ by
/// at most `n EPSILON`, which is smaller up to 10^5 nodes (and is taken beyond).
const MARGIN: f64 = 1e-10;

/// Assignment of trials to rows and lanes.
#[derive(Debug, Default)]
pub(crate) struct LaneLayout {
    /// Number of leading trials without a positive mass at all nodes.
    without_mass: usize,
    /// Trials in the first row, which is padded with its first trial.
    in_first: usize,
    rows: Vec<Row>,
    nodes: usize,
}

impl LaneLayout {
    /// Layout of the systems at `lengths`, in decreasing order.
    pub fn new(ray: SearchRay, lengths: &[f64]) -> Self {
        let without_mass = ray.first_with_mass(lengths);
        let lengths = &lengths[without_mass..];
        let in_first = match lengths.len() % LANES {
            0 => LANES.min(lengths.len()),
            rest => rest,
        };
        let (first, others) = lengths.split_at(in_first);
        let row = |part: &[f64]| std::array::from_fn(|lane| *part.get(lane).unwrap_or(&part[0]));
        let first = (!first.is_empty()).then(|| row(first));
        Self {
            nodes: ray.samples.len(),
            without_mass,
            in_first,
            rows: first
                .into_iter()
                .chain(others.chunks(LANES).map(row))
                .collect(),
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Row and lane of a trial.
    pub fn place(&self, which: usize) -> (usize, usize) {
        let which = which - self.without_mass;
        match which.checked_sub(self.in_first) {
            None => (0, which),
            Some(others) => (1 + others / LANES, others % LANES),
        }
    }

    /// Trials that may have the least cost `integral (y - y_obs)^2 dt`, by the sums of squares of all rows. All others have a
    /// higher cost, no positive mass, or a response that is not finite.
    pub fn lowest(&self, costs: &[Row]) -> Vec<usize> {
        let of = |which: &usize| {
            let (row, lane) = self.place(*which);
            costs[row][lane]
        };
        let others = LANES * self.rows.len().saturating_sub(1);
        let trials = self.without_mass..self.without_mass + self.in_first + others;
        let lowest = trials
            .clone()
            .map(|which| of(&which))
            .fold(f64::INFINITY, f64::min);
        let margin = MARGIN.max(4.0 * f64::EPSILON * self.nodes as f64);
        let may_be = |which: &usize| of(which).is_finite() && of(which) <= lowest * (1.0 + margin);
        trials.filter(may_be).collect()
    }
}

/// Displacements and velocities of a row at the starts of the eight parts of the record.
type States = [[Row; 2]; LANES];

/// Storage for the trials of up to [`ROWS`] rows.
#[derive(Default)]
pub(crate) struct StepBatch {
    rows: Range<usize>,
    states: Vec<States>,
    costs: Vec<Row>,
}

impl StepBatch {
    /// Computes the trials of some rows.
    ///
    /// # Panics
    /// If there are more than [`ROWS`] rows.
    pub fn run(&mut self, ray: SearchRay, layout: &LaneLayout, rows: Range<usize>) {
        assert!(rows.len() <= ROWS, "{} rows at once", rows.len());
        let lengths = &layout.rows[rows.clone()];
        self.states
            .resize(lengths.len(), [[[0.0; LANES]; 2]; LANES]);
        self.costs.resize(lengths.len(), [0.0; LANES]);
        match lengths.len() {
            0 => {}
            1 => self.of_rows::<1>(ray, lengths),
            2 => self.of_rows::<2>(ray, lengths),
            3 => self.of_rows::<3>(ray, lengths),
            _ => self.of_rows::<4>(ray, lengths),
        }
        self.rows = rows;
    }

    /// Sums of squares of the rows.
    pub fn costs(&self) -> &[Row] {
        &self.costs
    }

    /// Displacements and velocities of a lane at the starts of its parts; `None` for rows not computed here.
    pub fn states(&self, (row, lane): (usize, usize)) -> Option<[Row; 2]> {
        let states = self.states.get(row.checked_sub(self.rows.start)?)?;
        let of = |which: usize| std::array::from_fn(|part| states[part][which][lane]);
        Some([of(0), of(1)])
    }

    fn of_rows<const R: usize>(&mut self, ray: SearchRay, lengths: &[Row]) {
        let (states, costs) = (self.states.first_chunk_mut(), self.costs.first_chunk_mut());
        if let (Some(lengths), Some(states), Some(costs)) = (lengths.first_chunk(), states, costs) {
            simd::run(rows::BatchRows::<R> {
                ray,
                lengths,
                states,
                costs,
            });
        }
    }
}

/// Nodes per part of a response; the last part may be shorter or empty.
fn part(nodes: usize) -> usize {
    nodes.div_ceil(LANES)
}

impl SearchRay<'_> {
    /// Index of the first of `lengths` whose mass is positive at all nodes; then that of every shorter length is too, also after
    /// rounding.
    fn first_with_mass(self, lengths: &[f64]) -> usize {
        // All nodes are checked: a loop without early exit is faster.
        let has_mass = |a: &f64| {
            let pairs = self.functions[0].iter().zip(self.direction[0]);
            pairs.fold(true, |so_far, (p, g)| so_far & (p - a * g > 0.0))
        };
        lengths.iter().position(has_mass).unwrap_or(lengths.len())
    }
}
