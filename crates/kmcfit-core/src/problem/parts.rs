//! Parts of a problem, and their check for consistency.

use crate::constraints::{ConeGroup, Constraints, RowGroup};
use crate::functions::{Parameterization, Penalty, TotalVariation};
use crate::record::Experiment;
use crate::rows::Rows;
use crate::system::System;
use std::ops::Range;
use thiserror::Error;

/// Parts of a problem, checked for consistency by [`Problem::new`] and [`Problem::with`].
#[derive(Debug, Clone)]
pub struct ProblemParts {
    /// Grid, stepper and terms.
    pub system: System,
    /// Coefficient functions and scalars.
    pub functions: Parameterization,
    /// Records.
    pub experiments: Vec<Experiment>,
    /// Tikhonov penalties.
    pub penalties: Vec<Penalty>,
    /// Total-variation penalties.
    pub variations: Vec<TotalVariation>,
    /// Constraints.
    pub constraints: Constraints,
    /// Soft constraints.
    pub soft: Vec<RowGroup>,
    /// Jumps found in functions, on which all estimates are conditional.
    pub jumps: Vec<Jumps>,
}

/// Jumps found in a function by the rule `bic` of its total variation.
#[derive(Debug, Clone, PartialEq)]
pub struct Jumps {
    /// Index of the function, mass 0.
    pub function: usize,
    /// Times of the jumps, s; none for a constant.
    pub times: Vec<f64>,
}

/// Inconsistency of the parts of a problem.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ProblemError {
    /// Functions and grid have different numbers of nodes.
    #[error("the functions have {functions} nodes, the grid {grid}")]
    Nodes {
        /// Nodes of the functions.
        functions: usize,
        /// Nodes of the grid.
        grid: usize,
    },
    /// A coefficient set does not have one function for each inertia and each coefficient of the elements.
    #[error(
        "{inertias} inertias and {elements} coefficients need one function each; found {found}"
    )]
    Functions {
        /// Number of functions.
        found: usize,
        /// Number of inertias.
        inertias: usize,
        /// Number of coefficients of the elements.
        elements: usize,
    },
    /// A record does not fit the grid or the functions.
    #[error("record `{name}`: {reason}")]
    Record {
        /// Name of the record.
        name: String,
        /// Inconsistency.
        reason: &'static str,
    },
    /// A penalty has a function index out of range, or a wrong number of parameters.
    #[error(
        "a penalty does not match the number of parameters of function {function}, or there is no such function"
    )]
    Penalty {
        /// Index of the function.
        function: usize,
    },
    /// A constraint has a parameter index out of range.
    #[error("constraint `{name}` refers to a parameter that does not exist")]
    Constraint {
        /// Name of the constraint.
        name: String,
    },
}

impl ProblemParts {
    /// Checks the consistency of all parts.
    pub(super) fn check(&self) -> Result<(), ProblemError> {
        let (functions, grid) = (self.functions.nodes(), self.system.grid.nodes());
        if functions != grid {
            return Err(ProblemError::Nodes { functions, grid });
        }
        let structure = &self.system.structure;
        let inertias = structure.inertias().len();
        let elements = structure.functions() - inertias;
        for set in self.functions.coefficient_sets() {
            let found = set.len();
            if (set.inertias(), found) != (inertias, inertias + elements) {
                return Err(ProblemError::Functions {
                    found,
                    inertias,
                    elements,
                });
            }
        }
        for experiment in &self.experiments {
            if let Some(reason) = self.mismatch(experiment) {
                let name = experiment.name.clone();
                return Err(ProblemError::Record { name, reason });
            }
        }
        let penalties = self.penalties.iter().map(|p| (p.function, &p.rows));
        let variations = self.variations.iter().map(|v| (v.function, &v.rows));
        for (function, rows) in penalties.chain(variations) {
            self.check_penalty(function, rows)?;
        }
        let groups = self.constraints.groups.iter().chain(&self.soft);
        self.check_rows(groups, &self.constraints.cones)
    }

    pub(super) fn check_penalty(&self, function: usize, rows: &Rows) -> Result<(), ProblemError> {
        let parameters = self.functions.ranges().get(function).map(Range::len);
        match parameters.is_some_and(|n| rows.width() == n) {
            true => Ok(()),
            false => Err(ProblemError::Penalty { function }),
        }
    }

    pub(super) fn check_rows<'a>(
        &self,
        groups: impl Iterator<Item = &'a RowGroup>,
        cones: &'a [ConeGroup],
    ) -> Result<(), ProblemError> {
        let groups = groups.map(|group| (&group.name, &group.rows));
        let each = |group: &'a ConeGroup| group.cones.iter().map(|cone| (&group.name, &cone.rows));
        let mut all = groups.chain(cones.iter().flat_map(each));
        match all.find(|(_, rows)| rows.width() > self.functions.parameters()) {
            Some((name, _)) => Err(ProblemError::Constraint { name: name.clone() }),
            None => Ok(()),
        }
    }

    /// Inconsistency of a record with the grid or the functions, if any.
    fn mismatch(&self, record: &Experiment) -> Option<&'static str> {
        let scalars = self.functions.scalars().len();
        let sensors = record.channels.iter().flat_map(|c| c.sensor().indices());
        let mut indices = sensors
            .chain(record.initial_parameters.iter().copied())
            .flatten();
        let mut positions = record.channels.iter().flat_map(|c| c.positions());
        let excitation = record.excitation.as_ref();
        let structure = &self.system.structure;
        let components = structure.components();
        let has_state = [
            record.initial.components().len(),
            record.initial_parameters.len(),
        ] == [components; 2];
        match () {
            () if !has_state => Some("an initial state of another number of coordinates"),
            () if excitation.map_or(structure.supports() > 0, |e| !e.acts_on(structure)) => {
                Some("forces, frames or supports of another structure")
            }
            () if record.channels.iter().any(|c| !c.observes(structure)) => {
                Some("a sensor on a coordinate that is not there")
            }
            () if !(2..=self.system.grid.nodes()).contains(&record.nodes) => {
                Some("fewer than two nodes, or more than the grid has")
            }
            () if record.coefficient_set >= self.functions.coefficient_sets().len() => {
                Some("a set of functions that is not there")
            }
            () if indices.any(|i| i >= scalars) => Some("a nuisance parameter that is not there"),
            () if excitation.is_some_and(|e| !e.covers(record.nodes)) => {
                Some("a force or base that ends before it does")
            }
            () if positions.any(|position| position.step + 1 >= record.nodes) => {
                Some("a measurement after its last node")
            }
            () => None,
        }
    }
}
