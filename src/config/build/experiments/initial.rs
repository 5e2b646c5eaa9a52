//! The state at the beginning of an experiment.

use super::Record;
use super::value::{Named, value};
use crate::config::ModelFile;
use crate::config::scalar::{Estimate, NumberOrEstimate, ScalarOr};
use crate::config::spec::{EstimateValue, InitialSpec};
use crate::error::InputError;
use kmcfit_core::internals::functions::{ScalarParameter, Value};
use kmcfit_core::internals::objective::state_scales;
use kmcfit_core::internals::record::ChannelKind;
use kmcfit_core::internals::system::State;

/// The initial state, and which scalars it is where it is sought.
pub fn build(
    file: &ModelFile,
    i: usize,
    record: Option<&Record>,
    scalars: &mut Vec<ScalarParameter>,
) -> Result<(State, [Option<usize>; 2]), InputError> {
    let estimate: EstimateValue = ScalarOr::Scalar(NumberOrEstimate::Estimate);
    let given: [&EstimateValue; 2] = match &file.spec.experiments[i].initial {
        InitialSpec::Scalar(Estimate) => [&estimate, &estimate],
        InitialSpec::Map(state) => [&state.displacement, &state.velocity],
    };
    let sizes = record.map_or([1.0; 2], sizes);
    let first = record.and_then(|r| {
        r.channels
            .iter()
            .find(|c| c.kind == ChannelKind::Displacement)
    });
    let starts = [first.map_or(0.0, |c| c.values[0]), 0.0];
    let names = ["displacement", "velocity"];
    let angular = record.is_some_and(|r| r.channels.iter().any(|c| c.unit.is_angular()));
    let mut state = [0.0; 2];
    let mut sought = [None; 2];
    for q in 0..2 {
        let named = Named {
            key: format!("experiments[{i}].initial.{}", names[q]),
            name: format!("initial {} of {}", names[q], file.experiment_name(i)),
            unit: [ChannelKind::Displacement, ChannelKind::Velocity][q].unit_of(angular),
            start: starts[q],
            size: sizes[q],
        };
        match value(file, &named, given[q], scalars)? {
            Value::Known(number) => state[q] = number,
            Value::Sought(index) => {
                sought[q] = Some(index);
                state[q] = scalars[index].start;
            }
        }
    }
    let [displacement, velocity] = state;
    let state = State {
        displacement,
        velocity,
    };
    Ok((state, sought))
}

/// How large displacement and velocity are, from the channel nearest to a displacement.
fn sizes(record: &Record) -> [f64; 2] {
    match record.channels.iter().min_by_key(|c| c.kind) {
        Some(c) => state_scales(c.kind, &c.values, c.median_spacing),
        None => [1.0; 2],
    }
}
