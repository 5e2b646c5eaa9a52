//! Tangents along many directions at once, eight in the lanes of a group.
//!
//! What the directions share, the linearised steps, is computed once, in eight steps at a time. The
//! motion is gone through in tiles of [`TILE`] steps, so that neither the directions nor the tangents
//! are ever in memory as a whole.

use super::maps::{self, FUNCTIONS, Maps};
use super::stages::Rhs;
use super::{Device, Excitation, Method, Oscillator, Trajectory};
use crate::lanes::{self, Arithmetic, Eight, Kernel, LANES, Row};
use std::ops::Range;

/// Steps of a tile.
pub(crate) const TILE: usize = 64;
/// Nodes of a tile: its last node is the first of the next.
pub(crate) const TILE_NODES: usize = TILE + 1;

/// A function of the device that changes along directions of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slot {
    /// Group of directions.
    pub group: usize,
    /// Function, mass first.
    pub function: usize,
}

/// The tangents at the nodes of one tile.
pub(crate) struct Tangents {
    slots: Vec<Slot>,
    of_group: Vec<Range<usize>>,
    wanted: [bool; FUNCTIONS],
    changes: Vec<[Row; TILE_NODES]>,
    /// Whether a slot's function changes in this tile.
    moves: Vec<bool>,
    states: Vec<[[Row; 2]; TILE_NODES]>,
    /// Whether a group has been anything but zero.
    begun: Vec<bool>,
}

/// A motion to go through.
#[derive(Clone, Copy)]
pub(crate) struct Course<'a> {
    pub oscillator: &'a Oscillator,
    pub device: &'a Device,
    pub excitation: Option<&'a Excitation>,
    pub motion: &'a Trajectory,
}

impl Tangents {
    /// Tangents that start from `initial` (displacement and velocity of each group), with the functions
    /// of `slots`, which must be in the order of their groups.
    pub fn new(slots: Vec<Slot>, initial: &[[Row; 2]]) -> Self {
        let groups = 0..initial.len();
        let range = |g: usize| {
            slots.partition_point(|s| s.group < g)..slots.partition_point(|s| s.group <= g)
        };
        let mut states = vec![[[[0.0; LANES]; 2]; TILE_NODES]; initial.len()];
        for (states, initial) in states.iter_mut().zip(initial) {
            states[TILE] = *initial;
        }
        Self {
            of_group: groups.map(range).collect(),
            wanted: std::array::from_fn(|f| slots.iter().any(|s| s.function == f)),
            changes: vec![[[0.0; LANES]; TILE_NODES]; slots.len()],
            moves: vec![false; slots.len()],
            slots,
            begun: (initial.iter())
                .map(|states| states.as_flattened().iter().any(|x| *x != 0.0))
                .collect(),
            states,
        }
    }

    /// A slot's function does not change in the tile to come.
    pub fn rest(&mut self, slot: usize) {
        if self.moves[slot] {
            self.changes[slot].fill([0.0; LANES]);
            self.moves[slot] = false;
        }
    }

    /// The change of a slot's function at the nodes of the tile to come, along each direction of its group.
    pub fn changes_mut(&mut self, slot: usize) -> &mut [Row; TILE_NODES] {
        self.moves[slot] = true;
        &mut self.changes[slot]
    }

    /// The functions that change along a direction of a group, and their changes at the nodes of the tile.
    pub fn changes(&self, group: usize) -> impl Iterator<Item = (usize, &[Row; TILE_NODES])> {
        let slots = self.of_group[group].clone();
        let moving = slots.filter(|slot| self.moves[*slot]);
        moving.map(|slot| (self.slots[slot].function, &self.changes[slot]))
    }

    /// Whether the tangents of a group have been anything but zero.
    pub fn has_begun(&self, group: usize) -> bool {
        self.begun[group]
    }

    /// Displacement and velocity at the nodes of the tile, along each direction of a group.
    pub fn states(&self, group: usize) -> &[[Row; 2]; TILE_NODES] {
        &self.states[group]
    }

    /// Goes on by a tile: over the steps `steps`, at most [`TILE`] and not the same as before.
    pub fn advance(&mut self, course: Course, steps: Range<usize>) {
        let Course {
            oscillator,
            device,
            excitation,
            motion,
        } = course;
        lanes::run(Advance {
            rhs: oscillator.rhs(device, excitation, motion.nodes()),
            method: oscillator.method,
            motion,
            steps,
            tangents: self,
        });
    }
}

struct Advance<'a> {
    rhs: Rhs<'a>,
    method: Method,
    motion: &'a Trajectory,
    steps: Range<usize>,
    tangents: &'a mut Tangents,
}

impl Kernel for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let tangents = self.tangents;
        for (g, states) in tangents.states.iter_mut().enumerate() {
            states[0] = states[TILE];
            tangents.begun[g] |= tangents.of_group[g]
                .clone()
                .any(|slot| tangents.moves[slot]);
        }
        let mut maps = Maps::NOTHING;
        let (first, count) = (self.steps.start, self.steps.len().min(TILE));
        let mut from = 0;
        while from < count {
            let (rhs, wanted) = (&self.rhs, &tangents.wanted);
            maps::linearise(
                arithmetic,
                self.method,
                rhs,
                self.motion,
                first + from,
                wanted,
                &mut maps,
            );
            let to = (from + LANES).min(count);
            for (g, range) in tangents.of_group.iter().enumerate() {
                if !tangents.begun[g] {
                    continue;
                }
                // A group has at most one slot for each function.
                let mut moving = [0; FUNCTIONS];
                let mut count = 0;
                for slot in range.clone().filter(|slot| tangents.moves[*slot]) {
                    moving[count] = slot;
                    count += 1;
                }
                let pushes = Pushes {
                    moving: &moving[..count],
                    slots: &tangents.slots,
                    changes: &tangents.changes,
                };
                carry(arithmetic, &maps, pushes, &mut tangents.states[g], from..to);
            }
            from = to;
        }
    }
}

/// The functions that change along the directions of a group.
#[derive(Clone, Copy)]
struct Pushes<'a> {
    moving: &'a [usize],
    slots: &'a [Slot],
    changes: &'a [[Row; TILE_NODES]],
}

/// Carries a group over up to eight steps.
#[inline(always)]
fn carry<A: Arithmetic>(
    arithmetic: A,
    maps: &Maps,
    pushes: Pushes,
    states: &mut [[Row; 2]; TILE_NODES],
    steps: Range<usize>,
) {
    let [y, v] = &states[steps.start];
    let (mut y, mut v) = (Eight::load(arithmetic, y), Eight::load(arithmetic, v));
    for (l, i) in steps.enumerate() {
        let mut push = [Eight::splat(arithmetic, 0.0); 2];
        for &slot in pushes.moving {
            let (change, function) = (&pushes.changes[slot], pushes.slots[slot].function);
            let here = Eight::load(arithmetic, &change[i]);
            let next = Eight::load(arithmetic, &change[i + 1]);
            let (left, right) = (&maps.left[function], &maps.right[function]);
            for end in 0..2 {
                push[end] += Eight::splat(arithmetic, left[end][l]) * here
                    + Eight::splat(arithmetic, right[end][l]) * next;
            }
        }
        let mut increment = push;
        for (increment, [by_y, by_v]) in increment.iter_mut().zip(&maps.growth) {
            *increment +=
                Eight::splat(arithmetic, by_y[l]) * y + Eight::splat(arithmetic, by_v[l]) * v;
        }
        y += increment[0];
        v += increment[1];
        states[i + 1] = [y.row(), v.row()];
    }
}
