//! Channels on the grid, with their sensors.

use super::super::value::{Named, value};
use super::{RawChannel, Spec, spec_of};
use crate::config::ModelFile;
use crate::config::spec::ExperimentSpec;
use crate::error::InputError;
use kmcfit_core::internals::functions::{ScalarParameter, Value};
use kmcfit_core::internals::record::{
    Channel, ChannelKind, Experiment, Input, Sensor, Weighting, integral_over,
};
use kmcfit_core::internals::signal::even_spacing;
use kmcfit_core::internals::system::{Grid, InputSample};

/// Puts a channel on the grid.
pub fn place(
    file: &ModelFile,
    (i, spec): (usize, &ExperimentSpec),
    raw: RawChannel,
    grid: &Grid,
    experiment: &Experiment,
    scalars: &mut Vec<ScalarParameter>,
) -> Result<Channel, InputError> {
    let of_kind = spec_of(spec, raw.kind);
    let weighting = match (raw.weighting, raw.spacing) {
        (Some(weighting), _) => weighting,
        (None, Some(_)) => Weighting::Integral {
            // As the paper's: the length over the intervals.
            spacing: even_spacing(&raw.times).unwrap_or(raw.median_spacing),
        },
        (None, None) => integral_over(&raw.times),
    };
    let sensor = sensor(
        file,
        (i, raw.unit.is_angular()),
        &of_kind,
        &raw.values,
        scalars,
    )?;
    let times = raw.times.clone();
    let channel = Channel::new(
        raw.kind,
        raw.times,
        raw.values,
        weighting,
        grid,
        experiment.nodes,
    );
    let channel = channel.ok_or_else(|| {
        file.error_at("grid", "the readings do not lie on the grid")
            .found(format!("readings until {} s", times[times.len() - 1]))
            .expected(format!(
                "a grid from {} s to {} s",
                grid.start(),
                grid.start() + grid.duration()
            ))
    })?;
    let mut channel = channel.with_loss(raw.loss).with_sensor(sensor);
    let drive = &experiment.drive;
    if raw.kind == ChannelKind::Acceleration && experiment.excitation.is_some() {
        let around = |t: &f64| InputSample {
            force: drive.force_at(*t),
            base: drive.base_acceleration_at(*t),
        };
        channel = channel.with_surroundings(times.iter().map(around).collect());
    }
    if let Some(base) = base_motion(file, i, &of_kind, drive, &times)? {
        channel = channel.with_base(base);
    }
    if !raw.filter.is_empty() {
        channel = channel.with_filter(raw.filter);
    }
    Ok(channel)
}

/// The motion of the base at the times of a sensor that measures the motion in space.
fn base_motion(
    file: &ModelFile,
    i: usize,
    of_kind: &Spec,
    drive: &Input,
    times: &[f64],
) -> Result<Option<Vec<f64>>, InputError> {
    let kind = of_kind.kind;
    let asked = of_kind.sensor.and_then(|s| s.absolute);
    let key = format!("experiments[{i}].sensors.{}.absolute", kind.name());
    if drive.base.is_none() {
        return match asked {
            None => Ok(None),
            Some(_) => Err(file
                .error_at(
                    &key,
                    "the base does not move, so there is only one motion to measure",
                )
                .found("`absolute` without a motion of the base")
                .expected("no `absolute`")),
        };
    }
    if !asked.unwrap_or(kind == ChannelKind::Acceleration) {
        return Ok(None);
    }
    let motion = times.iter().map(|t| drive.base_motion_at(kind, *t));
    let motion: Option<Vec<f64>> = motion.collect();
    motion.map(Some).ok_or_else(|| {
        file.error_at(
            &key,
            format!("the {} of the base is not known", kind.name()),
        )
        .found("the acceleration of the base only")
        .expected("`columns: {base_displacement: …}`, or no `absolute: true`")
    })
}

fn sensor(
    file: &ModelFile,
    (i, angular): (usize, bool),
    of_kind: &Spec,
    values: &[f64],
    scalars: &mut Vec<ScalarParameter>,
) -> Result<Sensor, InputError> {
    let Some(spec) = of_kind.sensor else {
        return Ok(Sensor::default());
    };
    let kind = of_kind.kind;
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let size =
        (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / values.len() as f64).sqrt();
    let unit = kind.unit_of(angular);
    let per_second = format!("{unit}/s");
    let parts = [
        ("gain", &spec.gain, "", 1.0, 1.0),
        ("offset", &spec.offset, unit, mean, size),
        ("drift", &spec.drift, per_second.as_str(), 0.0, size),
    ];
    let mut found = [Value::Known(1.0), Value::Known(0.0), Value::Known(0.0)];
    for ((part, given, unit, start, size), found) in parts.into_iter().zip(&mut found) {
        if let Some(given) = given {
            let named = Named {
                key: format!("experiments[{i}].sensors.{}.{part}", kind.name()),
                name: format!(
                    "{part} of the {} of {}",
                    kind.name(),
                    file.experiment_name(i)
                ),
                unit,
                start,
                size,
            };
            *found = value(file, &named, given, scalars)?;
        }
    }
    if found[0] == Value::Known(0.0) {
        return Err(file
            .error_at(
                &format!("experiments[{i}].sensors.{}.gain", kind.name()),
                "a sensor with gain 0 sees nothing",
            )
            .found("0")
            .expected("another number, or `estimate`"));
    }
    if super::super::is_equation_error(file) && found.iter().any(|v| v.index().is_some()) {
        return Err(file
            .error_at(
                &format!("experiments[{i}].sensors.{}", kind.name()),
                "the method `equation-error` needs sensors that are known",
            )
            .found("`estimate`")
            .expected("numbers, or another method"));
    }
    Ok(Sensor {
        gain: found[0],
        offset: found[1],
        drift: found[2],
    })
}
