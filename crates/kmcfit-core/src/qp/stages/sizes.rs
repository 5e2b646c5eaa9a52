//! Numbers of states and controls of a subproblem, and the stage of each of its rows.

use crate::constraints::{Cone, Rows};
use crate::qp::Subproblem;
use crate::qp::layout::{StageLayout, VariableRole};

/// Highest difference of a coefficient in the state.
const HIGHEST_ORDER: usize = 3;

/// Number of states and controls that a subproblem needs, and the order of the differences of each history.
pub(super) struct Sizes {
    pub states: usize,
    pub controls: usize,
    /// Order of the highest difference of each history.
    pub orders: Vec<usize>,
    /// VariableRole of each variable.
    pub positions: Vec<VariableRole>,
}

impl Sizes {
    /// `None` if a row reaches over too many nodes, or an equality is no step of a response.
    pub fn of(sub: &Subproblem, layout: &StageLayout) -> Option<Self> {
        if layout.nodes < 2 {
            return None;
        }
        let positions = layout.positions(sub.variables)?;
        let mut orders = vec![1; layout.histories.len()];
        let mut reach = |stage: usize, j: usize| {
            if let VariableRole::History(f, node) = positions[j] {
                orders[f] = orders[f].max(node - stage);
            }
        };
        for rows in [
            &sub.residuals,
            &sub.absolute,
            &sub.equalities,
            &sub.inequalities,
        ] {
            for i in 0..rows.len() {
                let stage = stage_of(rows, i, &positions);
                nonzero(rows, i).for_each(|j| reach(stage, j));
            }
        }
        for cone in &sub.cones {
            let stage = stage_of_cone(cone, &positions);
            let rows = (0..cone.rows.len()).flat_map(|i| nonzero(&cone.rows, i));
            rows.for_each(|j| reach(stage, j));
        }
        if orders.iter().any(|order| *order > HIGHEST_ORDER) {
            return None;
        }
        Some(Self {
            states: layout.components() + orders.iter().sum::<usize>() + layout.constants.len(),
            controls: orders.len(),
            orders,
            positions,
        })
    }
}

/// The variables of row `i` with a coefficient other than zero.
fn nonzero(rows: &Rows, i: usize) -> impl Iterator<Item = usize> + '_ {
    let entries = rows.row(i).filter(|(_, a)| *a != 0.0);
    entries.map(|(j, _)| j)
}

/// The first node at which a variable of row `i` acts: constants act at all, and come into play only where there is nothing else.
pub(super) fn stage_of(rows: &Rows, i: usize, positions: &[VariableRole]) -> usize {
    first_node(nonzero(rows, i), positions)
}

/// The first node at which a variable of a cone acts.
pub(super) fn stage_of_cone(cone: &Cone, positions: &[VariableRole]) -> usize {
    let rows = 0..cone.rows.len();
    first_node(rows.flat_map(|i| nonzero(&cone.rows, i)), positions)
}

fn first_node(variables: impl Iterator<Item = usize>, positions: &[VariableRole]) -> usize {
    let nodes = variables.filter_map(|j| match positions[j] {
        VariableRole::Constant(_) => None,
        position => Some(position.node()),
    });
    nodes.min().unwrap_or(0)
}
