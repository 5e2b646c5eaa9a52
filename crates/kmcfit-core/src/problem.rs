//! The validated, immutable problem that everything below the configuration works on.

use crate::constraints::{Constraints, RowGroup};
use crate::functions::{Parameterization, Penalty, Variation};
use crate::record::{Channel, Experiment, Weighting};
use crate::system::System;

/// What is fitted: an oscillator, how its functions are represented, and the records.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Grid, stepper and terms.
    pub oscillator: System,
    /// Mass and one function per term.
    pub functions: Parameterization,
    /// The records.
    pub experiments: Vec<Experiment>,
    /// What the functions pay for being rough.
    pub penalties: Vec<Penalty>,
    /// What the functions pay for jumping.
    pub variations: Vec<Variation>,
    /// What the functions must satisfy.
    pub constraints: Constraints,
    /// What the functions may break at a price.
    pub soft: Vec<RowGroup>,
}

impl Problem {
    /// A problem without regularisation or constraints.
    pub fn new(
        oscillator: System,
        functions: Parameterization,
        experiments: Vec<Experiment>,
    ) -> Self {
        Self {
            oscillator,
            functions,
            experiments,
            penalties: Vec::new(),
            variations: Vec::new(),
            constraints: Constraints::default(),
            soft: Vec::new(),
        }
    }

    /// Number of parameters of functions and scalars.
    pub fn parameters(&self) -> usize {
        self.functions.parameters()
    }

    /// The start of the search.
    pub fn start(&self) -> Vec<f64> {
        self.functions.start()
    }

    /// The part of `theta` that belongs to the scalars.
    pub fn scalars<'a>(&self, theta: &'a [f64]) -> &'a [f64] {
        &theta[self.functions.scalar_range()]
    }

    /// All channels of all experiments.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.experiments.iter().flat_map(|e| &e.channels)
    }

    /// Number of readings of all experiments.
    pub fn reading_count(&self) -> usize {
        self.channels().map(Channel::len).sum()
    }

    /// The misfit of no motion at all: what there is to explain.
    pub fn zero_response_misfit(&self) -> f64 {
        let silence = |c: &Channel| c.cost(&vec![0.0; c.len()]);
        self.channels().map(silence).sum()
    }

    /// The same problem with only the first part of the readings, `share` of the time of each
    /// record.
    #[must_use]
    pub fn truncated(&self, share: f64) -> Self {
        let mut part = self.clone();
        let grid = &self.oscillator.grid;
        for experiment in &mut part.experiments {
            let length = (experiment.nodes - 1) as f64 * grid.step();
            let end = grid.start() + share * length;
            for channel in &mut experiment.channels {
                let count = channel.times().partition_point(|t| *t <= end);
                *channel = channel.first(count.max(2));
            }
        }
        part
    }

    /// Whether the continuous adjoint of Eq. 13 applies: the integral cost, one reading of the
    /// displacement per node, over the whole grid.
    pub fn supports_continuous(&self) -> bool {
        let nodes = self.oscillator.grid.nodes();
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
