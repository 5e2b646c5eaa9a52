//! The state at the beginning of an experiment.

use super::value::{Named, value};
use super::{Record, name};
use crate::config::ModelFile;
use crate::config::scalar::{Estimate, NumberOrEstimate, ScalarOr};
use crate::config::spec::{EstimateValue, InitialSpec};
use crate::dynamics::{ChannelKind, State};
use crate::error::InputError;
use crate::functions::{Scalar, Value};
use crate::signal::Spectrum;
use std::f64::consts::TAU;

/// The initial state, and which scalars it is where it is sought.
pub fn build(
    file: &ModelFile,
    i: usize,
    record: Option<&Record>,
    scalars: &mut Vec<Scalar>,
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
    let mut state = [0.0; 2];
    let mut sought = [None; 2];
    for q in 0..2 {
        let named = Named {
            key: format!("experiments[{i}].initial.{}", names[q]),
            name: format!("initial {} of {}", names[q], name(file, i)),
            unit: ["m", "m/s"][q],
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
    let Some(channel) = record.channels.iter().min_by_key(|c| c.kind) else {
        return [1.0; 2];
    };
    let mean = channel.values.iter().sum::<f64>() / channel.values.len() as f64;
    let centred: Vec<f64> = channel.values.iter().map(|v| v - mean).collect();
    let rms = (centred.iter().map(|v| v * v).sum::<f64>() / centred.len() as f64).sqrt();
    let spectrum = Spectrum::of(&centred, channel.median_spacing);
    let omega = TAU * spectrum.map_or(1.0, |s| s.dominant());
    let omega = if omega > 0.0 { omega } else { 1.0 };
    let displacement = match channel.kind {
        ChannelKind::Displacement => rms,
        ChannelKind::Velocity => rms / omega,
        ChannelKind::Acceleration => rms / (omega * omega),
    };
    [displacement, displacement * omega]
}
