//! Forward sensitivities: tangents along many directions at once, eight in the lanes of a group.
//!
//! Each equals [`tangent`](crate::simulate::reference::tangent()) to 40 machine precisions of the largest value for each
//! step.
//! The linearised steps, which the directions share, are computed once, in eight steps at a time. The
//! response is gone through in tiles of [`TILE`] steps, so that neither the directions nor the tangents
//! are ever in memory as a whole.

use super::step_linearisation::{self, RequestedDerivatives, StepLinearisation};
use crate::simd::{self, Aligned, Arithmetic, Eight, Kernel, LANES, Row};
use crate::simulate::Trajectory;
use crate::simulate::reference::equation::EquationOfMotion;
use crate::system::{Excitation, FUNCTIONS, Method, NodalCoefficients, System};
use std::ops::Range;

/// Steps of a tile.
pub(crate) const TILE: usize = 64;
/// Nodes of a tile: its last node is the first of the next.
pub(crate) const TILE_NODES: usize = TILE + 1;

/// A function of the system that changes along directions of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slot {
    /// Group of directions.
    pub group: usize,
    /// Function, mass first.
    pub function: usize,
}

/// A constant that changes along one direction of a group: by how much.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Steady {
    /// The direction's lane.
    pub lane: usize,
    /// The change, at every node.
    pub value: f64,
}

/// What a slot's function does in a tile.
#[derive(Clone, Copy)]
pub(crate) struct Change<'a> {
    /// The function, mass first.
    pub function: usize,
    /// Its changes at the nodes of the tile.
    pub rows: &'a [Row; TILE_NODES],
    /// What they are, if they are the same everywhere.
    pub steady: Option<Steady>,
}

impl Change<'_> {
    /// Whether it is not that of a constant.
    pub fn varies(&self) -> bool {
        self.steady.is_none()
    }
}

/// The tangents at the nodes of one tile.
pub(crate) struct Tangents {
    slots: Vec<Slot>,
    of_group: Vec<Range<usize>>,
    changes: Vec<Aligned<[Row; TILE_NODES]>>,
    /// Whether a slot's function changes in this tile.
    moves: Vec<bool>,
    /// The slots whose functions change by the same in all tiles.
    steady: Vec<Option<Steady>>,
    states: Vec<Aligned<[[Row; 2]; TILE_NODES]>>,
    /// Whether a group has been anything but zero.
    begun: Vec<bool>,
    /// What constants push displacement and velocity of each group by in eight steps: one direction a row.
    held: Vec<Aligned<[[Row; LANES]; 2]>>,
    maps: StepLinearisation,
}

/// The response about which tangents are taken.
#[derive(Clone, Copy)]
pub(crate) struct BaseTrajectory<'a> {
    pub system: &'a System,
    pub nodal: &'a NodalCoefficients,
    pub excitation: Option<&'a Excitation>,
    pub response: &'a Trajectory,
}

impl Tangents {
    /// Tangents that start from `initial` (displacement and velocity of each group), with the functions
    /// of `slots`, which must be in the order of their groups.
    pub fn new(slots: Vec<Slot>, initial: &[[Row; 2]]) -> Self {
        let groups = 0..initial.len();
        let range = |g: usize| {
            slots.partition_point(|s| s.group < g)..slots.partition_point(|s| s.group <= g)
        };
        let mut states = vec![Aligned([[[0.0; LANES]; 2]; TILE_NODES]); initial.len()];
        for (states, initial) in states.iter_mut().zip(initial) {
            states[TILE] = *initial;
        }
        Self {
            of_group: groups.map(range).collect(),
            changes: vec![Aligned([[0.0; LANES]; TILE_NODES]); slots.len()],
            moves: vec![false; slots.len()],
            steady: vec![None; slots.len()],
            slots,
            begun: (initial.iter())
                .map(|states| states.as_flattened().iter().any(|x| *x != 0.0))
                .collect(),
            held: vec![Aligned([[[0.0; LANES]; LANES]; 2]); initial.len()],
            maps: StepLinearisation::NOTHING,
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

    /// A slot's function changes by the same at all nodes, along one direction only.
    pub fn hold(&mut self, slot: usize, steady: Steady) {
        let mut row = [0.0; LANES];
        row[steady.lane] = steady.value;
        self.changes_mut(slot).fill(row);
        self.steady[slot] = Some(steady);
    }

    /// The functions that change along a direction of a group.
    pub fn changes(&self, group: usize) -> impl Iterator<Item = Change<'_>> {
        let slots = self.of_group[group].clone();
        let moving = slots.filter(|slot| self.moves[*slot]);
        moving.map(|slot| Change {
            function: self.slots[slot].function,
            rows: &self.changes[slot],
            steady: self.steady[slot],
        })
    }

    /// Whether the tangents of a group have been anything but zero.
    pub fn has_begun(&self, group: usize) -> bool {
        self.begun[group]
    }

    /// The groups up to the last one that has been anything but zero.
    pub fn begun_groups(&self) -> usize {
        let last = self.begun.iter().rposition(|begun| *begun);
        last.map_or(0, |last| last + 1)
    }

    /// Displacement and velocity at the nodes of the tile, along each direction of a group.
    pub fn states(&self, group: usize) -> &[[Row; 2]; TILE_NODES] {
        &self.states[group]
    }

    /// Goes on by a tile: over the steps `steps`, at most [`TILE`] and not the same as before.
    pub fn advance(&mut self, course: BaseTrajectory, steps: Range<usize>) {
        let BaseTrajectory {
            system,
            nodal,
            excitation,
            response,
        } = course;
        simd::run(Advance {
            equation: EquationOfMotion::new(system, nodal, excitation, response.nodes()),
            method: system.method,
            response,
            steps,
            tangents: self,
        });
    }
}

struct Advance<'a> {
    equation: EquationOfMotion<'a>,
    method: Method,
    response: &'a Trajectory,
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
        let (first, count) = (self.steps.start, self.steps.len().min(TILE));
        let mut wanted = RequestedDerivatives::default();
        for (slot, steady) in tangents.slots.iter().zip(&tangents.steady) {
            match steady {
                Some(_) => wanted.sum[slot.function] = true,
                None => wanted.ends[slot.function] = true,
            }
        }
        let mut from = 0;
        while from < count {
            step_linearisation::linearise(
                arithmetic,
                self.method,
                &self.equation,
                self.response,
                first + from,
                &wanted,
                &mut tangents.maps,
            );
            let to = (from + LANES).min(count);
            let maps = &tangents.maps;
            for (g, range) in tangents.of_group.iter().enumerate() {
                if !tangents.begun[g] {
                    continue;
                }
                // A group has at most one slot for each function.
                let mut moving = [0; FUNCTIONS];
                let mut count = 0;
                let held = &mut tangents.held[g];
                let mut holds = false;
                for slot in range.clone().filter(|slot| tangents.moves[*slot]) {
                    match tangents.steady[slot] {
                        None => {
                            moving[count] = slot;
                            count += 1;
                        }
                        Some(steady) => {
                            hold(
                                arithmetic,
                                maps,
                                tangents.slots[slot].function,
                                steady,
                                held,
                            );
                            holds = true;
                        }
                    }
                }
                let held = match holds {
                    true => Aligned([
                        simd::transposed(arithmetic, &held[0]),
                        simd::transposed(arithmetic, &held[1]),
                    ]),
                    false => *held,
                };
                let pushes = Pushes {
                    held: &held,
                    moving: &moving[..count],
                    slots: &tangents.slots,
                    changes: &tangents.changes,
                };
                carry(arithmetic, maps, pushes, &mut tangents.states[g], from..to);
            }
            from = to;
        }
    }
}

/// The pushes of eight steps, one a lane, to the direction along which a constant changes.
#[inline(always)]
fn hold<A: Arithmetic>(
    arithmetic: A,
    maps: &StepLinearisation,
    function: usize,
    steady: Steady,
    held: &mut [[Row; LANES]; 2],
) {
    let change = Eight::splat(arithmetic, steady.value);
    for (end, held) in held.iter_mut().enumerate() {
        let sum = Eight::load(arithmetic, &maps.sum[function][end]);
        held[steady.lane] = (sum * change).row();
    }
}

/// The functions that change along the directions of a group.
#[derive(Clone, Copy)]
struct Pushes<'a> {
    /// What constants push displacement and velocity by in each step.
    held: &'a [[Row; LANES]; 2],
    /// The slots of all other functions.
    moving: &'a [usize],
    slots: &'a [Slot],
    changes: &'a [Aligned<[Row; TILE_NODES]>],
}

/// Carries a group over up to eight steps.
#[inline(always)]
fn carry<A: Arithmetic>(
    arithmetic: A,
    maps: &StepLinearisation,
    pushes: Pushes,
    states: &mut [[Row; 2]; TILE_NODES],
    steps: Range<usize>,
) {
    let [y, v] = &states[steps.start];
    let (mut y, mut v) = (Eight::load(arithmetic, y), Eight::load(arithmetic, v));
    for (l, i) in steps.enumerate() {
        let [to_y, to_v] = pushes.held;
        let mut push = [
            Eight::load(arithmetic, &to_y[l & (LANES - 1)]),
            Eight::load(arithmetic, &to_v[l & (LANES - 1)]),
        ];
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
