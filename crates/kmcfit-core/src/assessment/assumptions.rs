//! Assumptions of a verdict that the records cannot test.

use crate::identifiability::{ScaleSource, scale_source};
use crate::problem::Problem;
use serde::Serialize;

/// An assumption of a verdict that the records cannot test.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum VerdictAssumption {
    /// The clock of a record, on which all its columns are.
    Clock {
        /// Name of the experiment.
        experiment: String,
    },
    /// The unit of the only channel of a record with an input.
    Unit {
        /// Name of the experiment.
        experiment: String,
        /// Kind of the channel.
        channel: String,
    },
    /// The values of the fixed functions that determine the scale of mass, damping and stiffness, which the samples leave open.
    Scale {
        /// Names of the functions.
        functions: Vec<String>,
    },
}

/// Assumptions of the verdict on a fit: an error of the clock scales all frequencies, and one of the unit of an only channel the mass, the
/// damping and the stiffness; fixed functions scale the others.
pub fn verdict_assumptions(problem: &Problem) -> Vec<VerdictAssumption> {
    let each = problem
        .experiments
        .iter()
        .filter(|e| e.has_samples())
        .flat_map(|e| {
            let clock = VerdictAssumption::Clock {
                experiment: e.name.clone(),
            };
            let unit = match (e.is_free(), e.channels.as_slice()) {
                (false, [channel]) => Some(VerdictAssumption::Unit {
                    experiment: e.name.clone(),
                    channel: channel.kind().name().to_owned(),
                }),
                _ => None,
            };
            std::iter::once(clock).chain(unit)
        });
    let scale = match scale_source(problem) {
        ScaleSource::Fixed(functions) => Some(VerdictAssumption::Scale { functions }),
        _ => None,
    };
    each.chain(scale).collect()
}
