//! The variables of a subproblem in time.

use crate::functions::{Design, Parameterization};
use std::ops::Range;

/// Which variables of a subproblem belong to which node of a time grid. With it the subproblem is a linear-quadratic
/// control problem: the state at node `i` holds the responses, the coefficients with their differences, and the
/// constants; the controls are the highest differences of the coefficients.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StageLayout {
    /// Number of nodes.
    pub nodes: usize,
    /// Coefficients with one variable at each node: their variables in time order.
    pub histories: Vec<Range<usize>>,
    /// Linearised responses.
    pub responses: Vec<ResponseVariables>,
    /// Variables that act at every node.
    pub constants: Vec<usize>,
}

/// The variables of one linearised response: the components of its state at every node after the first, node by node.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseVariables {
    /// First component at node 1; the others follow, then those at node 2.
    pub first: usize,
    /// Number of nodes, the first included.
    pub nodes: usize,
    /// Each component at node 0, where it is a variable.
    pub initial: Vec<Option<usize>>,
}

impl ResponseVariables {
    /// Number of components of the state.
    pub fn components(&self) -> usize {
        self.initial.len()
    }
}

/// Role and node of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VariableRole {
    /// History `f` at a node.
    History(usize, usize),
    /// Component of the responses, one response after the other, at a node.
    Response(usize, usize),
    /// Constant `c`.
    Constant(usize),
}

impl VariableRole {
    /// The first node at which the variable acts.
    pub fn node(self) -> usize {
        match self {
            Self::History(_, node) | Self::Response(_, node) => node,
            Self::Constant(_) => 0,
        }
    }
}

impl StageLayout {
    /// Number of components of all responses.
    pub(super) fn components(&self) -> usize {
        self.responses
            .iter()
            .map(ResponseVariables::components)
            .sum()
    }

    /// The parameters of `functions`; `None` if a function is neither nodal nor constant.
    pub fn of(functions: &Parameterization) -> Option<Self> {
        let mut layout = Self {
            nodes: functions.nodes(),
            ..Self::default()
        };
        for (function, range) in functions.iter().zip(functions.ranges()) {
            match function.design {
                Design::Identity => layout.histories.push(range.clone()),
                _ if range.len() <= 1 => layout.constants.extend(range.clone()),
                _ => return None,
            }
        }
        layout.constants.extend(functions.scalar_range());
        Some(layout)
    }

    /// The place of every variable; `None` unless each of the `variables` has exactly one.
    pub(super) fn positions(&self, variables: usize) -> Option<Vec<VariableRole>> {
        let mut positions = vec![None; variables];
        let mut put = |variable: usize, position: VariableRole| {
            let slot = positions.get_mut(variable)?;
            slot.is_none().then(|| *slot = Some(position))
        };
        for (f, history) in self.histories.iter().enumerate() {
            if history.len() != self.nodes {
                return None;
            }
            for (node, variable) in history.clone().enumerate() {
                put(variable, VariableRole::History(f, node))?;
            }
        }
        let mut base = 0;
        for response in &self.responses {
            if response.nodes == 0 || response.nodes > self.nodes {
                return None;
            }
            let components = response.components();
            for (q, initial) in response.initial.iter().enumerate() {
                if let Some(variable) = initial {
                    put(*variable, VariableRole::Response(base + q, 0))?;
                }
                for node in 1..response.nodes {
                    let variable = response.first + components * (node - 1) + q;
                    put(variable, VariableRole::Response(base + q, node))?;
                }
            }
            base += components;
        }
        for (c, variable) in self.constants.iter().enumerate() {
            put(*variable, VariableRole::Constant(c))?;
        }
        positions.into_iter().collect()
    }
}
