//! The time grid: from the model, or one node per reading.

use super::Purpose;
use super::experiments::Record;
use crate::config::ModelFile;
use crate::config::spec::StepMethod;
use crate::dynamics::{Grid, Method};
use crate::error::{InputError, Place};

/// Most nodes: at about 400 bytes a node a run then takes 4 GB.
const MOST_NODES: usize = 10_000_000;

pub(super) fn build(
    file: &ModelFile,
    purpose: Purpose,
    records: &[Option<Record>],
) -> Result<Grid, InputError> {
    let spec = file.spec.grid.as_ref();
    let asked = spec.and_then(|g| g.nodes.as_ref()).map(|n| n.0);
    let nodes = purpose.nodes().or(asked);
    let (start, duration, readings) = span(file, records)?;
    let nodes = nodes.or(readings).ok_or_else(|| {
        file.error_at("grid", "the number of nodes is missing")
            .expected("`nodes`, since there are no readings to take it from")
    })?;
    if !(Grid::FEWEST_NODES..=MOST_NODES).contains(&nodes) {
        let problem = "this number of nodes cannot be used";
        let error = match purpose.nodes() {
            Some(_) => InputError::new(Place::Argument("--nodes".into()), problem),
            None => file.error_at("grid.nodes", problem),
        };
        return Err(error
            .found(nodes)
            .expected(format!("{} to {MOST_NODES}", Grid::FEWEST_NODES)));
    }
    Grid::new(start, duration, nodes).ok_or_else(|| {
        file.error_at("grid", "the times make no grid")
            .found(format!("{nodes} nodes over {duration} s"))
            .expected("a positive duration whose steps are not zero")
    })
}

/// First time, length and number of readings of the records; the length from the model without.
fn span(
    file: &ModelFile,
    records: &[Option<Record>],
) -> Result<(f64, f64, Option<usize>), InputError> {
    let asked = file.spec.grid.as_ref().and_then(|g| g.duration.as_ref());
    if let Some(duration) = asked
        && duration.0 <= 0.0
    {
        return Err(file
            .error_at("grid.duration", "the duration is not positive")
            .found(duration.0)
            .expected("a length of time in s, greater than 0"));
    }
    let Some(first) = records.iter().flatten().next() else {
        let duration = asked.ok_or_else(|| {
            file.error_at("grid", "the length of the motion is missing")
                .expected("`duration` in s, since there are no readings to take it from")
        })?;
        return Ok((0.0, duration.0, None));
    };
    if let Some(asked) = asked
        && (asked.0 - first.duration).abs() > first.spacing * 1e-6
    {
        return Err(file
            .error_at("grid.duration", "the duration is not that of the readings")
            .found(asked.0)
            .expected(format!("{} (or leave it out)", first.duration)));
    }
    let duration = asked.map_or(first.duration, |asked| asked.0);
    Ok((first.start, duration, Some(first.values.len())))
}

/// The stepper; classical Runge–Kutta unless the model says otherwise.
pub(super) fn method(file: &ModelFile) -> Method {
    match file.spec.grid.as_ref().and_then(|g| g.method) {
        Some(StepMethod::Midpoint) => Method::Midpoint,
        Some(StepMethod::Rk4) | None => Method::Rk4,
    }
}
