//! Definition of a problem: system, functions, records, penalties and constraints, checked for consistency.

mod parts;

pub use parts::Jumps;
pub(crate) use parts::{ProblemError, ProblemParts};

use crate::constraints::Constraints;
use crate::functions::{CoefficientKind, Parameterization, Penalty, TotalVariation};
use crate::record::{Channel, Experiment, Measurements, Weighting};
use crate::system::System;
use std::ops::{Deref, Range};
use std::sync::{Arc, OnceLock};

/// Number of parameters up to which Jacobians use one tangent solve each, and covariances and bands are computed with every fit.
pub const FEW_PARAMETERS: usize = 64;

/// Number of nodes and samples up to which measured states are kept with their problem: at most thirteen numbers for each, a tenth of a
/// gigabyte.
const MOST_KEPT: usize = 1_000_000;

/// A consistent problem; its parts are read-only.
#[derive(Debug, Clone)]
pub struct Problem {
    parts: ProblemParts,
    /// Measured states for the scalars they were estimated with, shared with copies whose records are the same.
    measurements: Arc<OnceLock<(Vec<f64>, Arc<Measurements>)>>,
}

impl Deref for Problem {
    type Target = ProblemParts;

    fn deref(&self) -> &ProblemParts {
        &self.parts
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
