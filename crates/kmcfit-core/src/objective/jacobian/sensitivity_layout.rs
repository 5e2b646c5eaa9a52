//! Assigns each estimated parameter, i.e. each Jacobian column, to a group of eight columns and a SIMD lane, and supplies the
//! perturbations dp/dtheta of the coefficient functions.

use crate::functions::{Design, Parameterization};
use crate::record::Experiment;
use crate::simd::LANES;
use crate::step::tangents::{ConstantPerturbation, Slot, TILE_NODES, Tangents};

/// Functions of the coefficient set of one experiment, with the group and lane of each of their parameters.
pub(super) struct SensitivityLayout<'a> {
    functions: Vec<FunctionLayout<'a>>,
    /// Pairs of column group and function, by group, then function.
    slots: Vec<Slot>,
    /// Number of groups of eight columns.
    groups: usize,
    /// Estimated initial states as (0 for displacement or 1 for velocity, column).
    initial_states: Vec<(usize, usize)>,
    /// Number of columns.
    columns: usize,
}

/// One function of the coefficient set.
struct FunctionLayout<'a> {
    /// Basis values `b_j(t_i)`, nodes x parameters of the function.
    design: &'a Design,
    /// Indices into the slots (pairs of column group and function) of this function.
    slots: Vec<usize>,
    /// Index of the slot, and lane, of each parameter.
    lanes: Vec<(usize, usize)>,
    /// True if the function is equal at all nodes for every parameter value.
    is_constant: bool,
}

impl<'a> SensitivityLayout<'a> {
    /// Lays out the sensitivities for one experiment; `order[column]` is the parameter of a column ([`Problem::places`]), and
    /// [`LANES`] consecutive columns form a group.
    ///
    /// [`Problem::places`]: crate::problem::Problem::places
    pub fn new(functions: &'a Parameterization, order: &[usize], experiment: &Experiment) -> Self {
        let mut column_of = vec![0; order.len()];
        for (column, j) in order.iter().enumerate() {
            column_of[*j] = column;
        }
        let scalars = functions.scalar_range().start;
        let estimated = experiment.initial_parameters.iter().copied().enumerate();
        let initial_states =
            estimated.filter_map(|(state, index)| Some((state, column_of[scalars + index?])));
        let assembly = functions.coefficient_set(experiment.coefficient_set);
        // A known part, which is constant, and the function that it is added to have slots of their own in a group.
        let slot_of = |(position, f): (usize, usize), j: usize| (column_of[j] / LANES, position, f);
        let mut slots: Vec<(usize, usize, usize)> = (assembly.parts())
            .flat_map(|part| (functions.ranges()[part.1].clone()).map(move |j| (part, j)))
            .map(|(part, j)| slot_of(part, j))
            .collect();
        slots.sort_unstable();
        slots.dedup();
        let layout = |(position, f): (usize, usize)| {
            let lane = |j: usize| {
                let slot = slots.partition_point(|slot| *slot < slot_of((position, f), j));
                (slot, column_of[j] % LANES)
            };
            let own = (0..slots.len()).filter(|slot| slots[*slot].2 == f);
            FunctionLayout {
                design: &functions.get(f).design,
                slots: own.collect(),
                lanes: functions.ranges()[f].clone().map(lane).collect(),
                is_constant: functions.is_constant(f),
            }
        };
        let functions = assembly.parts().map(layout).collect();
        let slots = slots.into_iter();
        Self {
            functions,
            initial_states: initial_states.collect(),
            slots: slots
                .map(|(group, function, _)| Slot { group, function })
                .collect(),
            groups: order.len().div_ceil(LANES),
            columns: order.len(),
        }
    }

    /// Returns tangents that start with unit derivatives with respect to the estimated initial states, and zero otherwise.
    pub fn tangents(&self) -> Tangents {
        let mut initial = vec![[[0.0; LANES]; 2]; self.groups];
        for &(state, column) in &self.initial_states {
            initial[column / LANES][state][column % LANES] = 1.0;
        }
        Tangents::new(self.slots.clone(), &initial)
    }

    /// Returns tangents that start at a later step; two further columns after the others are the derivatives with respect to
    /// displacement and velocity at that step.
    pub fn tangents_from_any_state(&self) -> Tangents {
        let mut initial = vec![[[0.0; LANES]; 2]; (self.columns + 2).div_ceil(LANES)];
        for (column, state) in (self.columns..).zip([0, 1]) {
            initial[column / LANES][state][column % LANES] = 1.0;
        }
        Tangents::new(self.slots.clone(), &initial)
    }

    /// Writes the basis values b_j(t_i) at the nodes of the tile starting at node `first` into the lanes of their parameters;
    /// constant functions are written in the first tile only, for which `is_first` is true.
    pub fn set_perturbations(&self, tangents: &mut Tangents, first: usize, is_first: bool) {
        for function in &self.functions {
            if !function.is_constant {
                (function.slots.iter()).for_each(|slot| tangents.clear(*slot));
                function.set_perturbations(tangents, first);
            } else if is_first {
                function.set_constant(tangents);
            }
        }
    }
}

impl FunctionLayout<'_> {
    /// Writes the perturbation of a constant function, equal at all nodes.
    fn set_constant(&self, tangents: &mut Tangents) {
        for ((_, value), &(slot, lane)) in self.design.row(0).zip(&self.lanes) {
            tangents.set_constant(slot, ConstantPerturbation { lane, value });
        }
    }

    /// Writes the basis values at the nodes of the tile starting at node `first` into the lanes of their parameters.
    fn set_perturbations(&self, tangents: &mut Tangents, first: usize) {
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
            Design::Constant { nodes } => {
                (0..TILE_NODES.min(nodes - first)).for_each(|node| set(node, 0, 1.0));
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
