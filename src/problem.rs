//! The validated, immutable problem that everything below the configuration works on.

use crate::constraints::{Constraints, RowGroup};
use crate::dynamics::{Oscillator, State};
use crate::functions::{Functions, Penalty, Variation};
use crate::objective::{Readings, Weighting};

/// One record of the device's motion.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Name for reports.
    pub name: String,
    /// Displacement and velocity at the first node.
    pub initial: State,
    /// Force at the nodes, N; `None` is free motion.
    pub force: Option<Vec<f64>>,
    /// What was measured; `None` for an experiment that is only simulated.
    pub readings: Option<Readings>,
}

/// What is fitted: an oscillator, how its functions are represented, and the records.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Grid, stepper and terms.
    pub oscillator: Oscillator,
    /// Mass and one function per term.
    pub functions: Functions,
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
    pub fn new(oscillator: Oscillator, functions: Functions, experiments: Vec<Experiment>) -> Self {
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

    /// The misfit of no motion at all: what there is to explain.
    pub fn misfit_of_silence(&self) -> f64 {
        let silence = vec![0.0; self.oscillator.grid.nodes()];
        let readings = self.experiments.iter().filter_map(|e| e.readings.as_ref());
        readings.map(|r| r.cost(&silence)).sum()
    }

    /// The same problem with only the first part of the readings, `share` of each record.
    #[must_use]
    pub fn first_part(&self, share: f64) -> Self {
        let mut part = self.clone();
        for experiment in &mut part.experiments {
            if let Some(readings) = &mut experiment.readings {
                let count = (readings.values().len() as f64 * share).ceil() as usize;
                readings.truncate(count.max(2));
            }
        }
        part
    }

    /// Whether the continuous adjoint of Eq. 13 applies: the integral cost, one reading per node.
    pub fn supports_continuous(&self) -> bool {
        let fits =
            |r: &Readings| r.stride() == 1 && matches!(r.weighting(), Weighting::Integral { .. });
        self.experiments
            .iter()
            .all(|e| e.readings.as_ref().is_some_and(fits))
    }
}
