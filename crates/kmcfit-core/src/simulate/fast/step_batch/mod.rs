//! The costs of many systems along a ray, one a lane: the paper's trial steps.
//!
//! What is wanted of them is which is lowest, and its response, with the bits that it would have by itself
//! ([`forward`](crate::simulate::reference::forward())). So no response is kept: of each eight states along the record are, from
//! which the lowest one's is made again, eight parts at once ([`reconstruct()`]). The costs are sums in another order than that of
//! the integral; those who may have the lowest cost are told from all others by a margin far above its rounding.

mod reconstruct;
mod rows;
#[cfg(test)]
mod tests;

use crate::simd::{self, LANES, Row};
use crate::system::State;
use std::ops::Range;

pub(crate) use reconstruct::reconstruct;

/// BatchCoefficients `p - a g` in linear free response by the midpoint rule, seen at every node.
#[derive(Clone, Copy)]
pub(crate) struct SearchRay<'a> {
    /// Mass, damping, stiffness at the nodes.
    pub functions: [&'a [f64]; 3],
    /// What is taken away from them, per unit of `a`.
    pub direction: [&'a [f64]; 3],
    /// State at the first node.
    pub initial: State,
    /// Displacements read at the nodes, m.
    pub samples: &'a [f64],
    /// Step, s.
    pub step: f64,
}

/// Most rows at once: enough that the divisions of one row hide behind those of the others, and few
/// enough for the registers.
pub(crate) const ROWS: usize = 4;

/// How far a cost that is summed in lanes, relative to itself, may be from the one that is summed in order. Of `n` terms
/// that are not negative two sums are within `n EPSILON`, which is less up to 10^5 nodes (and is taken beyond).
const MARGIN: f64 = 1e-10;

/// In which rows and lanes the trials at some lengths are.
#[derive(Debug, Default)]
pub(crate) struct LaneLayout {
    /// Trials before the first that has mass everywhere.
    without_mass: usize,
    /// Trials in the first row, which may be less than full: it is filled up with its first.
    in_first: usize,
    rows: Vec<Row>,
    nodes: usize,
}

impl LaneLayout {
    /// That of the systems at `lengths`, which fall.
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

    /// The trials that may have the lowest cost `integral (y - y_obs)^2 dt`, by the sums of squares of all rows: those of
    /// all others are higher, or there is no mass, or the response leaves the finite numbers.
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

/// Displacements and velocities of a row where the eight parts of the record begin.
type States = [[Row; 2]; LANES];

/// The trials of some rows, at most [`ROWS`]: storage that is used again and again.
#[derive(Default)]
pub(crate) struct StepBatch {
    rows: Range<usize>,
    states: Vec<States>,
    costs: Vec<Row>,
}

impl StepBatch {
    /// Does the trials of some rows.
    ///
    /// # Panics
    /// If they are too many.
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

    /// The sums of squares of the rows.
    pub fn costs(&self) -> &[Row] {
        &self.costs
    }

    /// Displacements and velocities of a lane where its parts begin, if the row is one of these.
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

/// Nodes in each of the eight parts of a response, the last of which may be shorter, or empty.
fn part(nodes: usize) -> usize {
    nodes.div_ceil(LANES)
}

impl SearchRay<'_> {
    /// The first of `lengths` whose system has mass at all nodes: then so has every shorter one, also
    /// after rounding.
    fn first_with_mass(self, lengths: &[f64]) -> usize {
        // All are looked at: a loop without a way out is the faster one.
        let has_mass = |a: &f64| {
            let pairs = self.functions[0].iter().zip(self.direction[0]);
            pairs.fold(true, |so_far, (p, g)| so_far & (p - a * g > 0.0))
        };
        lengths.iter().position(has_mass).unwrap_or(lengths.len())
    }
}
