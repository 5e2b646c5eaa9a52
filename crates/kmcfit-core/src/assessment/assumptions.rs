//! Assumptions of a verdict that the records cannot test.

use super::Doubt;
use crate::identifiability::{ScaleSource, scale_source};
use crate::problem::Problem;

/// Assumptions of the verdict on a fit: an error of the clock scales all frequencies, and one of the unit of an only channel the mass, the
/// damping and the stiffness; fixed functions scale the others.
pub fn verdict_assumptions(problem: &Problem) -> Vec<Doubt> {
    let each = problem
        .experiments
        .iter()
        .filter(|e| e.has_samples())
        .flat_map(|e| {
            let clock = Doubt::Clock {
                experiment: e.name.clone(),
            };
            let unit = match (e.is_free(), e.channels.as_slice()) {
                (false, [channel]) => Some(Doubt::Unit {
                    experiment: e.name.clone(),
                    channel: channel.kind().name().to_owned(),
                }),
                _ => None,
            };
            std::iter::once(clock).chain(unit)
        });
    let scale = match scale_source(problem) {
        ScaleSource::Fixed(functions) => Some(Doubt::Scale { functions }),
        _ => None,
    };
    each.chain(scale).collect()
}
