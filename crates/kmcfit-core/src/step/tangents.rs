//! Forward sensitivities: tangents along many directions, eight per group in SIMD lanes.
//!
//! The directions share the linearised steps, which are computed eight at a time. Integration proceeds in tiles of
//! [`TILE`] steps, so that neither directions nor tangents are stored for the whole record.

use super::Trajectory;
use super::engine::{Driven, Maps};
use super::maps::Wanted;
use crate::simd::{self, Aligned, Arithmetic, Eight, Kernel, LANES, Row};
use crate::system::FUNCTIONS;
use std::ops::Range;

/// Steps per tile.
pub(crate) const TILE: usize = 64;
/// Nodes per tile; the last node is the first of the next tile.
pub(crate) const TILE_NODES: usize = TILE + 1;

/// A function that varies along directions of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slot {
    /// Group of directions.
    pub group: usize,
    /// Function, mass first.
    pub function: usize,
}

/// Perturbation of a constant function along one direction of a group.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConstantPerturbation {
    /// Lane of the direction.
    pub lane: usize,
    /// Perturbation, equal at all nodes.
    pub value: f64,
}

/// Perturbation of a function in a tile.
#[derive(Clone, Copy)]
pub(crate) struct FunctionPerturbation<'a> {
    /// Function, mass first.
    pub function: usize,
    /// Perturbations at the nodes of the tile.
    pub rows: &'a [Row; TILE_NODES],
    /// Constant perturbation, if equal at all nodes.
    pub steady: Option<ConstantPerturbation>,
}

impl FunctionPerturbation<'_> {
    /// True unless the perturbation is constant.
    pub fn varies(&self) -> bool {
        self.steady.is_none()
    }
}

/// Tangents at the nodes of one tile.
pub(crate) struct Tangents {
    slots: Vec<Slot>,
    of_group: Vec<Range<usize>>,
    changes: Vec<Aligned<[Row; TILE_NODES]>>,
    /// True for slots whose function is perturbed in this tile.
    moves: Vec<bool>,
    /// Constant perturbations of slots.
    steady: Vec<Option<ConstantPerturbation>>,
    states: Vec<Aligned<[[Row; 2]; TILE_NODES]>>,
    /// True for groups with nonzero tangents.
    begun: Vec<bool>,
    /// Contributions of constant perturbations to displacement and velocity of each group over eight steps, one direction per
    /// row.
    held: Vec<Aligned<[[Row; LANES]; 2]>>,
    maps: Maps,
}

impl Tangents {
    /// Tangents from the initial perturbations `initial` (displacement and velocity of each group), with the functions of
    /// `slots`, ordered by group.
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
            maps: Maps::NOTHING,
            states,
        }
    }

    /// Marks a slot's function as unperturbed in the next tile.
    pub fn clear(&mut self, slot: usize) {
        if self.moves[slot] {
            self.changes[slot].fill([0.0; LANES]);
            self.moves[slot] = false;
        }
    }

    /// Perturbation of a slot's function at the nodes of the next tile, for each direction of its group.
    pub fn changes_mut(&mut self, slot: usize) -> &mut [Row; TILE_NODES] {
        self.moves[slot] = true;
        &mut self.changes[slot]
    }

    /// Sets an equal perturbation of a slot's function at all nodes, along one direction.
    pub fn set_constant(&mut self, slot: usize, steady: ConstantPerturbation) {
        let mut row = [0.0; LANES];
        row[steady.lane] = steady.value;
        self.changes_mut(slot).fill(row);
        self.steady[slot] = Some(steady);
    }

    /// Perturbed functions of a group.
    pub fn changes(&self, group: usize) -> impl Iterator<Item = FunctionPerturbation<'_>> {
        let slots = self.of_group[group].clone();
        let moving = slots.filter(|slot| self.moves[*slot]);
        moving.map(|slot| FunctionPerturbation {
            function: self.slots[slot].function,
            rows: &self.changes[slot],
            steady: self.steady[slot],
        })
    }

    /// True if the tangents of a group are nonzero at some node so far.
    pub fn has_begun(&self, group: usize) -> bool {
        self.begun[group]
    }

    /// Number of groups up to the last one with nonzero tangents.
    pub fn begun_groups(&self) -> usize {
        let last = self.begun.iter().rposition(|begun| *begun);
        last.map_or(0, |last| last + 1)
    }

    /// Displacement and velocity at the nodes of the tile, for each direction of a group.
    pub fn states(&self, group: usize) -> &[[Row; 2]; TILE_NODES] {
        &self.states[group]
    }

    /// Integrates over the next tile, the steps `steps` (at most [`TILE`], each once), about the response `response`.
    pub fn advance(&mut self, driven: Driven, response: &Trajectory, steps: Range<usize>) {
        for (g, states) in self.states.iter_mut().enumerate() {
            states[0] = states[TILE];
            self.begun[g] |= self.of_group[g].clone().any(|slot| self.moves[slot]);
        }
        let (first, count) = (steps.start, steps.len().min(TILE));
        let mut wanted = Wanted::default();
        for (slot, steady) in self.slots.iter().zip(&self.steady) {
            match steady {
                Some(_) => wanted.sum[slot.function] = true,
                None => wanted.ends[slot.function] = true,
            }
        }
        for from in (0..count).step_by(LANES) {
            driven.linearise(response, first + from, &wanted, &mut self.maps);
            simd::run(Carry {
                steps: from..(from + LANES).min(count),
                tangents: self,
            });
        }
    }
}

/// Integrates all groups over up to eight steps.
struct Carry<'a> {
    steps: Range<usize>,
    tangents: &'a mut Tangents,
}

impl Kernel for Carry<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let Self { steps, tangents } = self;
        let maps = &tangents.maps;
        for (g, range) in tangents.of_group.iter().enumerate() {
            if !tangents.begun[g] {
                continue;
            }
            // A group has at most one slot for each function that varies.
            let mut moving = [0; FUNCTIONS];
            let mut count = 0;
            let held = &mut tangents.held[g];
            let mut holds = false;
            for slot in range.clone() {
                match tangents.steady[slot] {
                    _ if !tangents.moves[slot] => {}
                    None => {
                        moving[count] = slot;
                        count += 1;
                    }
                    Some(steady) => {
                        let function = tangents.slots[slot].function;
                        hold(arithmetic, maps, function, steady, held);
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
            carry(
                arithmetic,
                maps,
                pushes,
                &mut tangents.states[g],
                steps.clone(),
            );
        }
    }
}

/// Contributions of eight steps, one per lane, along the direction in which a constant varies.
#[inline(always)]
fn hold<A: Arithmetic>(
    arithmetic: A,
    maps: &Maps,
    function: usize,
    steady: ConstantPerturbation,
    held: &mut [[Row; LANES]; 2],
) {
    let change = Eight::splat(arithmetic, steady.value);
    for (end, held) in held.iter_mut().enumerate() {
        let sum = Eight::load(arithmetic, &maps.sum[function][end]);
        held[steady.lane] = (sum * change).row();
    }
}

/// Perturbed functions of a group.
#[derive(Clone, Copy)]
struct Pushes<'a> {
    /// Contributions of constants to displacement and velocity in each step.
    held: &'a [[Row; LANES]; 2],
    /// Slots of all other functions.
    moving: &'a [usize],
    slots: &'a [Slot],
    changes: &'a [Aligned<[Row; TILE_NODES]>],
}

/// Integrates a group over up to eight steps.
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
