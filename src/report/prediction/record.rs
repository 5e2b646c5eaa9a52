//! The record of a prediction: its grid, excitation and channels with the sensors of the run.

use super::identified::SystemOfRun;
use crate::config::{MeasuredChannel, NewRecord};
use crate::error::InputError;
use crate::report::Run;
use kmcfit_core::functions::ScalarValue;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Input, Sensor, Weighting};
use kmcfit_core::system::{Grid, InputSample, State};

/// Most nodes of a prediction.
const MOST_NODES: usize = 5_000_000;

/// The grid of a prediction over the inputs: steps of at most those of the fit and of the samples of the inputs.
pub(super) fn grid(
    run: &Run,
    system: &SystemOfRun,
    record: &NewRecord,
) -> Result<Grid, InputError> {
    let of_fit = &system.identified.system.grid;
    let [from, to] = record.span;
    let file = record.files.first().cloned().unwrap_or_default();
    let (start, end) = (of_fit.start(), of_fit.start() + of_fit.duration());
    let slack = of_fit.step();
    if !system.identified.is_constant() && (from < start - slack || to > end + slack) {
        return Err(InputError::file(
            &file,
            "the coefficients vary with time and are identified over their record only",
        )
        .found(format!("inputs from {from} s to {to} s"))
        .expected(format!(
            "times from {start} s to {end} s, those of the record of {}",
            run.folder.display()
        )));
    }
    let step = of_fit.step().min(record.spacing);
    let nodes = ((to - from) / step).ceil() + 1.0;
    let grid = (nodes <= MOST_NODES as f64)
        .then(|| Grid::new(from, to - from, (nodes as usize).max(Grid::FEWEST_NODES)))
        .flatten();
    grid.ok_or_else(|| {
        InputError::file(&file, "too long for the time step of the run")
            .found(format!("{nodes} nodes with steps of {step:e} s"))
            .expected(format!("at most {MOST_NODES} nodes"))
    })
}

/// The record with its channels; true for those with measurements.
pub(super) fn experiment(
    system: &SystemOfRun,
    record: &NewRecord,
    state: State,
    kinds: &[ChannelKind],
    grid: &Grid,
) -> Result<(Experiment, Vec<bool>), InputError> {
    let nodes = grid.nodes();
    let mut experiment = Experiment::free("prediction", state, nodes);
    experiment.excitation = Some(record.input.on(grid, nodes));
    experiment.input = record.input.clone();
    let measured: Vec<ChannelKind> = record.measured.iter().map(|m| m.kind).collect();
    let kinds = match (kinds, measured.as_slice()) {
        ([], []) => vec![system.kind],
        ([], measured) => measured.to_vec(),
        (kinds, _) => kinds.to_vec(),
    };
    let mut is_measured = Vec::new();
    for kind in kinds {
        let samples = record.measured.iter().find(|m| m.kind == kind);
        let weighting = Weighting::Sigma(1.0);
        let channel = samples.and_then(|m| measured_channel(system, m, grid));
        is_measured.push(channel.is_some());
        // Without samples, the response itself.
        let at_nodes = || {
            let zeros = vec![0.0; nodes];
            Channel::new(kind, grid.times(), zeros, weighting.clone(), grid, nodes)
        };
        let is_absolute = match &channel {
            Some(_) => samples.is_some_and(|m| m.sensor.absolute),
            None => kind == ChannelKind::Acceleration,
        };
        let channel = channel.or_else(at_nodes);
        let channel = channel.map(|channel| with_inputs(channel, &record.input, is_absolute));
        let unknown = || {
            let file = record.files.last().cloned().unwrap_or_default();
            let name = kind.name();
            InputError::file(file, format!("the {name} of the base is not known"))
                .found(format!(
                    "its acceleration only, and a sensor of the absolute {name} in the run"
                ))
                .expected("the displacement of the base over time")
        };
        if let Some(channel) = channel {
            experiment.channels.push(channel.ok_or_else(unknown)?);
        }
    }
    Ok((experiment, is_measured))
}

/// Samples with their sensor, as in the run. A stated delay is in the times; samples that a delay moves out of the record are left out.
fn measured_channel(
    system: &SystemOfRun,
    measured: &MeasuredChannel,
    grid: &Grid,
) -> Option<Channel> {
    let sensor = system.sensor(&measured.sensor);
    let values: Vec<f64> = system.scalars.iter().map(|scalar| scalar.start).collect();
    let stated = |value: ScalarValue| match value {
        ScalarValue::Known(seconds) => seconds,
        ScalarValue::Estimated(_) => 0.0,
    };
    let rest = |value: ScalarValue| match value {
        ScalarValue::Known(_) => ScalarValue::Known(0.0),
        estimated @ ScalarValue::Estimated(_) => estimated,
    };
    let total = sensor.total_delay(&values);
    let shift = stated(sensor.delay) - stated(sensor.input_delay);
    let end = grid.start() + grid.duration();
    let near = 1e-6 * grid.step();
    let is_inside =
        |t: &f64| total == 0.0 || (*t >= grid.start() + total - near && *t <= end + total + near);
    let pairs = measured.times.iter().zip(&measured.values);
    let kept = pairs.filter(|(t, _)| is_inside(t));
    // A shift leaves a sample at an end there, rounding aside.
    let shifted = |t: f64| match shift == 0.0 {
        true => t,
        false => (t - shift).clamp(grid.start(), end),
    };
    let (times, values) = kept.map(|(t, x)| (shifted(*t), *x)).unzip();
    let weighting = Weighting::Sigma(1.0);
    let channel = Channel::new(measured.kind, times, values, weighting, grid, grid.nodes())?;
    Some(channel.with_sensor(Sensor {
        delay: rest(sensor.delay),
        input_delay: rest(sensor.input_delay),
        ..sensor
    }))
}

/// The channel with the inputs at its samples, and the motion of the base for an absolute one; `None` where that is not known.
fn with_inputs(channel: Channel, input: &Input, is_absolute: bool) -> Option<Channel> {
    let kind = channel.kind();
    let times = channel.times().to_vec();
    let bases = times.iter().map(|t| input.base_motion_at(kind, *t));
    let bases: Option<Vec<f64>> = bases.collect();
    let channel = match kind {
        ChannelKind::Acceleration => {
            let inputs = times.iter().map(|t| InputSample {
                force: input.force_at(*t),
                base: input.base_acceleration_at(*t),
            });
            channel.with_inputs_at_samples(inputs.collect())
        }
        _ => channel,
    };
    match is_absolute && input.base.is_some() {
        true => Some(channel.with_base(bases?)),
        false => Some(channel),
    }
}
