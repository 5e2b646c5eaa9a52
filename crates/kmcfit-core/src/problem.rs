//! Definition of a problem: system, functions, records, penalties and constraints, checked for consistency.

use crate::constraints::{ConeGroup, Constraints, RowGroup};
use crate::functions::{CoefficientKind, Parameterization, Penalty, TotalVariation};
use crate::record::{Channel, Experiment, Measurements, Weighting};
use crate::rows::Rows;
use crate::system::System;
use std::ops::{Deref, Range};
use std::sync::{Arc, OnceLock};
use thiserror::Error;

/// Number of parameters up to which Jacobians use one tangent solve each, and covariances and bands are computed with every fit.
pub const FEW_PARAMETERS: usize = 64;

/// Number of nodes and samples up to which measured states are kept with their problem: at most thirteen numbers for each, a tenth of a
/// gigabyte.
const MOST_KEPT: usize = 1_000_000;

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

/// A consistent problem; its parts are read-only.
#[derive(Debug, Clone)]
pub struct Problem {
    parts: ProblemParts,
    /// Measured states for the scalars they were estimated with, shared with copies whose records are the same.
    measurements: Arc<OnceLock<(Vec<f64>, Arc<Measurements>)>>,
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

impl Deref for Problem {
    type Target = ProblemParts;

    fn deref(&self) -> &ProblemParts {
        &self.parts
    }
}

impl ProblemParts {
    /// Checks the consistency of all parts.
    fn check(&self) -> Result<(), ProblemError> {
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

    fn check_penalty(&self, function: usize, rows: &Rows) -> Result<(), ProblemError> {
        let parameters = self.functions.ranges().get(function).map(Range::len);
        match parameters.is_some_and(|n| rows.width() == n) {
            true => Ok(()),
            false => Err(ProblemError::Penalty { function }),
        }
    }

    fn check_rows<'a>(
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

impl Problem {
    /// A problem without penalties or constraints.
    ///
    /// # Errors
    /// A [`ProblemError`] if the parts do not fit each other.
    pub fn new(
        system: System,
        functions: Parameterization,
        experiments: Vec<Experiment>,
    ) -> Result<Self, ProblemError> {
        let parts = ProblemParts {
            system,
            functions,
            experiments,
            penalties: Vec::new(),
            variations: Vec::new(),
            constraints: Constraints::default(),
            soft: Vec::new(),
            jumps: Vec::new(),
        };
        parts.check().map(|()| Self {
            parts,
            measurements: Arc::default(),
        })
    }

    /// Changes the parts of the problem.
    ///
    /// # Errors
    /// A [`ProblemError`] if the changed parts are inconsistent.
    pub fn with(mut self, change: impl FnOnce(&mut ProblemParts)) -> Result<Self, ProblemError> {
        change(self.parts_mut());
        self.parts.check().map(|()| self)
    }

    /// Adds constraints; groups with a penalty weight are soft.
    ///
    /// # Errors
    /// A [`ProblemError`] if a parameter index is out of range; then no constraint is added.
    pub fn constrain(&mut self, mut rows: Constraints) -> Result<(), ProblemError> {
        self.check_rows(rows.groups.iter(), &rows.cones)?;
        self.parts.soft.extend(rows.take_soft());
        self.parts.constraints.extend(rows);
        Ok(())
    }

    /// Adds a Tikhonov penalty.
    ///
    /// # Errors
    /// A [`ProblemError`] if the function index is out of range, or the number of parameters is wrong.
    pub fn penalize(&mut self, penalty: Penalty) -> Result<(), ProblemError> {
        self.check_penalty(penalty.function, &penalty.rows)?;
        self.parts.penalties.push(penalty);
        Ok(())
    }

    /// Adds a total-variation penalty.
    ///
    /// # Errors
    /// As [`Problem::penalize`].
    pub fn penalize_variation(&mut self, variation: TotalVariation) -> Result<(), ProblemError> {
        self.check_penalty(variation.function, &variation.rows)?;
        self.parts.variations.push(variation);
        Ok(())
    }

    /// Mutable parts, for changes that keep them consistent.
    pub(crate) fn parts_mut(&mut self) -> &mut ProblemParts {
        self.measurements = Arc::default();
        &mut self.parts
    }

    /// Measured states of the records for the sensor parameters `scalars`: those of an earlier call, or as `estimate` finds them.
    ///
    /// # Errors
    /// Those of `estimate`.
    pub(crate) fn measurements<E>(
        &self,
        scalars: &[f64],
        estimate: impl FnOnce() -> Result<Measurements, E>,
    ) -> Result<Arc<Measurements>, E> {
        if let Some((of, known)) = self.measurements.get()
            && of == scalars
        {
            return Ok(Arc::clone(known));
        }
        let found = Arc::new(estimate()?);
        let nodes: usize = self.experiments.iter().map(|e| e.nodes).sum();
        if nodes + self.sample_count() <= MOST_KEPT {
            // Another thread may have been first, with the same numbers or other scalars.
            let _ = self
                .measurements
                .set((scalars.to_vec(), Arc::clone(&found)));
        }
        Ok(found)
    }

    /// Number of parameters of functions and scalars.
    pub fn parameters(&self) -> usize {
        self.functions.parameters()
    }

    /// Nodal values of the coefficient `kind` of the shared coefficient set at the parameters `theta`, in its SI unit, with known
    /// parts; `None` if the system has no such coefficient.
    ///
    /// # Panics
    /// If `theta` has another number of parameters.
    pub fn coefficient(&self, kind: CoefficientKind, theta: &[f64]) -> Option<Vec<f64>> {
        let functions = &self.functions;
        let mut shared = functions.coefficient_set(0).iter();
        let position = shared.position(|f| functions.get(*f).quantity == kind)?;
        let nodal = functions.nodal(theta);
        nodal.functions().nth(position).map(<[f64]>::to_vec)
    }

    /// Start parameters.
    pub fn start(&self) -> Vec<f64> {
        self.functions.start()
    }

    /// Sets the start.
    ///
    /// # Panics
    /// If `theta` has another number of parameters.
    pub fn start_from(&mut self, theta: &[f64]) {
        self.parts.functions.set_start(theta);
    }

    /// Scalars of the parameters `theta`.
    pub fn scalars<'a>(&self, theta: &'a [f64]) -> &'a [f64] {
        &theta[self.functions.scalar_range()]
    }

    /// Positions of the samples of each channel among all samples.
    pub(crate) fn channel_samples(&self) -> Vec<Range<usize>> {
        let mut first = 0;
        let each = self.channels().map(|channel| {
            let samples = first..first + channel.len();
            first = samples.end;
            samples
        });
        each.collect()
    }

    /// All channels of all experiments.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.experiments.iter().flat_map(|e| &e.channels)
    }

    /// Number of samples of all experiments.
    pub fn sample_count(&self) -> usize {
        self.channels().map(Channel::len).sum()
    }

    /// Misfit of zero response.
    pub fn zero_response_misfit(&self) -> f64 {
        let silence = |c: &Channel| c.cost(&vec![0.0; c.len()]);
        self.channels().map(silence).sum()
    }

    /// The problem with the samples of the first `share` of each record's time, and the response up to the last of them. With delays or
    /// errors of the input the response is that of the whole record.
    #[must_use]
    pub fn truncated(&self, share: f64) -> Self {
        let mut part = self.clone();
        let grid = &self.system.grid;
        for experiment in &mut part.parts_mut().experiments {
            let length = (experiment.nodes - 1) as f64 * grid.step();
            let end = grid.start() + share * length;
            for channel in &mut experiment.channels {
                let count = channel.times().partition_point(|t| *t <= end);
                *channel = channel.first(count.max(2));
            }
            let is_delayed = |c: &Channel| c.sensor().is_delayed();
            if experiment.input_error.is_some() || experiment.channels.iter().any(is_delayed) {
                continue;
            }
            let positions = experiment.channels.iter().flat_map(Channel::positions);
            // Three nodes at least, for the curvature of a response.
            let steps = positions
                .map(|position| position.step + 1)
                .fold(2, usize::max);
            experiment.nodes = experiment.nodes.min(steps + 1);
            experiment.excitation = (experiment.excitation.as_ref()).map(|all| all.first(steps));
        }
        part
    }

    /// True if the continuous adjoint of Eq. 13 applies: the integral cost and one displacement sample per node over the whole grid.
    pub fn supports_continuous(&self) -> bool {
        let nodes = self.system.grid.nodes();
        let fits = |c: &Channel| {
            c.stride() == Some(1)
                && c.len() == nodes
                && matches!(c.weighting(), Weighting::Integral { .. })
        };
        let one =
            |e: &Experiment| e.nodes == nodes && e.channels.len() == 1 && fits(&e.channels[0]);
        self.experiments.iter().all(one)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::model::CoefficientSpec;

    /// One estimate serves a problem, and its copies until a part of theirs is changed.
    #[test]
    fn measured_states_are_estimated_once() {
        let times: Vec<f64> = (0..20).map(|i| 0.1 * f64::from(i)).collect();
        let samples: Vec<f64> = times.iter().map(|t| t.cos()).collect();
        let record = Record::new("decay").displacement(&times, &samples);
        let parts = [
            CoefficientSpec::fixed(1.0),
            CoefficientSpec::fixed(0.1),
            CoefficientSpec::constant(2.0),
        ];
        let built = Builder::new(parts).record(record).build();
        let problem = built.expect("a problem");
        let mut count = 0;
        let mut estimated = |problem: &Problem, scalars: &[f64]| {
            let before = count;
            let estimate = || {
                count += 1;
                Ok::<_, ()>(Measurements::default())
            };
            problem.measurements(scalars, estimate).expect("states");
            count - before
        };
        assert_eq!(estimated(&problem, &[]), 1);
        assert_eq!(estimated(&problem, &[]), 0);
        assert_eq!(estimated(&problem, &[1.0]), 1);
        let mut copy = problem.clone();
        copy.start_from(&[3.0, 1.0, 0.0]);
        assert_eq!(estimated(&copy, &[]), 0);
        copy.parts_mut().experiments[0].initial.components_mut()[0] = 0.5;
        assert_eq!(estimated(&copy, &[]), 1);
        assert_eq!(estimated(&problem, &[]), 0);
        let changed = problem.with(|parts| parts.jumps.clear());
        assert_eq!(estimated(&changed.expect("consistent"), &[]), 1);
    }
}
