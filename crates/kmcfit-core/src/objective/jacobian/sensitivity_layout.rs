//! Layout of forward sensitivities: assignment of parameters to groups of eight directions (lanes).

use crate::functions::{Design, Parameterization};
use crate::record::Experiment;
use crate::simd::LANES;
use crate::simulate::fast::sensitivities::{ConstantPerturbation, Slot, TILE_NODES, Tangents};

/// Estimated functions of an experiment's coefficient set and the columns of their parameters.
pub(super) struct SensitivityLayout<'a> {
    parts: Vec<FunctionLayout<'a>>,
    slots: Vec<Slot>,
    groups: usize,
    /// Estimated initial states, as pairs of state and column.
    seeds: Vec<(usize, usize)>,
    /// Number of columns.
    places: usize,
}

struct FunctionLayout<'a> {
    design: &'a Design,
    /// Slots of the groups of the function.
    slots: Vec<usize>,
    /// Slot and lane of each parameter.
    lanes: Vec<(usize, usize)>,
    constant: bool,
}

impl<'a> SensitivityLayout<'a> {
    /// Layout for the parameters `order` of the columns, [`LANES`] columns per group.
    pub fn new(functions: &'a Parameterization, order: &[usize], experiment: &Experiment) -> Self {
        let mut places = vec![0; order.len()];
        for (place, j) in order.iter().enumerate() {
            places[*j] = place;
        }
        let scalars = functions.scalar_range().start;
        let estimated = experiment.initial_parameters.into_iter().enumerate();
        let seeds = estimated.filter_map(|(state, index)| Some((state, places[scalars + index?])));
        let assembly = functions.coefficient_set(experiment.coefficient_set);
        let slot_of = |function: usize, j: usize| Slot {
            group: places[j] / LANES,
            function,
        };
        let mut slots: Vec<Slot> = (assembly.iter().enumerate())
            .flat_map(|(function, f)| functions.ranges()[*f].clone().map(move |j| (function, j)))
            .map(|(function, j)| slot_of(function, j))
            .collect();
        slots.sort_unstable_by_key(|s| (s.group, s.function));
        slots.dedup();
        let find = |slot: Slot| {
            slots.partition_point(|s| (s.group, s.function) < (slot.group, slot.function))
        };
        let part = |(function, &f): (usize, &usize)| {
            let design = &functions.get(f).design;
            let lane = |j: usize| (find(slot_of(function, j)), places[j] % LANES);
            let own = (0..slots.len()).filter(|s| slots[*s].function == function);
            FunctionLayout {
                design,
                slots: own.collect(),
                lanes: functions.ranges()[f].clone().map(lane).collect(),
                constant: functions.is_constant(f),
            }
        };
        Self {
            parts: assembly.iter().enumerate().map(part).collect(),
            seeds: seeds.collect(),
            slots,
            groups: order.len().div_ceil(LANES),
            places: order.len(),
        }
    }

    pub fn tangents(&self) -> Tangents {
        let mut initial = vec![[[0.0; LANES]; 2]; self.groups];
        for &(state, place) in &self.seeds {
            initial[place / LANES][state][place % LANES] = 1.0;
        }
        Tangents::new(self.slots.clone(), &initial)
    }

    /// Tangents from an arbitrary initial state, which has two columns behind the others.
    pub fn tangents_from_any_state(&self) -> Tangents {
        let mut initial = vec![[[0.0; LANES]; 2]; (self.places + 2).div_ceil(LANES)];
        for (place, state) in (self.places..).zip([0, 1]) {
            initial[place / LANES][state][place % LANES] = 1.0;
        }
        Tangents::new(self.slots.clone(), &initial)
    }

    /// Sets the perturbations of the functions in the tile that starts at node `first`; `is_first` marks the first tile.
    pub fn fill(&self, tangents: &mut Tangents, first: usize, is_first: bool) {
        for part in &self.parts {
            if !part.constant {
                part.slots.iter().for_each(|slot| tangents.rest(*slot));
                part.fill(tangents, first);
            } else if is_first {
                part.hold(tangents);
            }
        }
    }
}

impl FunctionLayout<'_> {
    /// Sets the perturbation of a constant function, equal at all nodes.
    fn hold(&self, tangents: &mut Tangents) {
        for ((_, value), &(slot, lane)) in self.design.row(0).zip(&self.lanes) {
            tangents.hold(slot, ConstantPerturbation { lane, value });
        }
    }

    fn fill(&self, tangents: &mut Tangents, first: usize) {
        let mut set = |node: usize, parameter: usize, value: f64| {
            let (slot, lane) = self.lanes[parameter];
            tangents.changes_mut(slot)[node][lane] = value;
        };
        match self.design {
            Design::Empty => {}
            Design::Identity => {
                for node in 0..TILE_NODES.min(self.lanes.len() - first) {
                    set(node, first + node, 1.0);
                }
            }
            Design::Sparse(rows) => {
                let last = (first + TILE_NODES).min(rows.len());
                for (node, i) in (first..last).enumerate() {
                    rows.row(i).for_each(|(j, b)| set(node, j, b));
                }
            }
        }
    }
}
