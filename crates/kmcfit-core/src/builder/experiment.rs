//! Builds the experiments of a problem from records: initial state, force and base motion, sensors, and the scalar parameters
//! to be estimated.

use super::record::{ChannelSpec, Record};
use super::{BuildError, Builder};
use crate::functions::{ScalarParameter, ScalarValue};
use crate::model::{DelayValue, EstimateSpec, ScalarSpec, SensorSpec};
use crate::objective::state_scales;
use crate::record::{Channel, ChannelKind, Experiment, Input, Sensor, Weighting, integral_over};
use crate::signal::{even_spacing, median_spacing};
use crate::system::{Grid, State, TimePoint};
use std::sync::Arc;

/// Record and settings from which an experiment is built.
pub(super) struct ExperimentBuilder<'a> {
    /// Key of the experiment in the model file, e.g. `experiments[0]`, for error messages.
    pub key: String,
    /// Record with the samples.
    pub record: &'a Record,
    /// Grid of the problem.
    pub grid: &'a Grid,
    /// Index of the coefficient set.
    pub coefficient_set: usize,
    /// The specification. Of a simulation only the response is wanted: no channels are built, and the samples define the span and start
    /// values only.
    pub builder: &'a Builder,
}

/// A scalar that may be fixed or estimated.
struct PendingScalar<'a> {
    /// Key in the model file, for error messages.
    key: String,
    /// Name in the results.
    name: String,
    /// SI unit; empty if dimensionless.
    unit: &'a str,
    /// Initial value if neither a start nor a prior is given.
    start: f64,
    /// Typical magnitude of a change, in `unit`; 1 if zero.
    scale: f64,
}

impl PendingScalar<'_> {
    /// Returns the fixed value, or a new parameter added to `scalars`.
    fn value(
        self,
        spec: ScalarSpec,
        scalars: &mut Vec<ScalarParameter>,
    ) -> Result<ScalarValue, BuildError> {
        let (start, prior) = match spec {
            ScalarSpec::Known(number) => return Ok(ScalarValue::Known(number)),
            ScalarSpec::Estimate(_) => (None, None),
            ScalarSpec::Estimated(EstimateSpec { start, prior }) => (start, prior),
        };
        if let Some(prior) = prior.filter(|prior| prior.sigma <= 0.0 || !prior.sigma.is_finite()) {
            let key = format!("{}.prior.sigma", self.key);
            return Err(
                BuildError::new(key, "a standard deviation must be positive")
                    .found(prior.sigma)
                    .expected("a number greater than 0"),
            );
        }
        scalars.push(ScalarParameter {
            name: self.name,
            unit: self.unit.to_owned(),
            start: start.or(prior.map(|p| p.mean)).unwrap_or(self.start),
            size: if self.scale > 0.0 { self.scale } else { 1.0 },
            prior,
        });
        Ok(ScalarValue::Estimated(scalars.len() - 1))
    }
}

impl ExperimentBuilder<'_> {
    /// Builds the experiment; its estimated parameters are added to `scalars`.
    pub fn build(&self, scalars: &mut Vec<ScalarParameter>) -> Result<Experiment, BuildError> {
        let record = self.record;
        let mut input = record.inputs(&self.key)?;
        input.last = self.coordinates() - 1;
        if let Some(name) = &record.force_at {
            let key = format!("{}.forces[0].at", self.key);
            input.coordinate = self.builder.coordinate(&key, name)?;
        }
        let nodes = match record.span() {
            Some([_, end]) => nodes_until(self.grid, end),
            None => self.grid.nodes(),
        };
        for (name, _) in &record.initial_of {
            let key = format!("{}.initial.{name}", self.key);
            self.builder.coordinate(&key, name)?;
        }
        let (initial, estimated) = self.initial(scalars)?;
        let mut experiment = Experiment::free(&record.name, initial, nodes);
        experiment.initial_parameters = estimated;
        experiment.coefficient_set = self.coefficient_set;
        experiment.excitation =
            (input.force.is_some() || input.base.is_some()).then(|| input.on(self.grid, nodes));
        experiment.input_error = record.error_of(&input, &self.key)?;
        experiment.input = input;
        let compared = match self.builder.is_simulation {
            true => &[][..],
            false => &record.channels,
        };
        let input_delay = match compared {
            [] => ScalarValue::Known(0.0),
            _ => self.input_delay(&experiment.input, scalars)?,
        };
        for (i, channel) in compared.iter().enumerate() {
            let channel = self.channel((i, channel), &experiment, input_delay, scalars)?;
            experiment.channels.push(channel);
        }
        self.check_delays(&experiment, scalars)?;
        Ok(experiment)
    }

    /// Returns the delay of the input, s.
    fn input_delay(
        &self,
        input: &Input,
        scalars: &mut Vec<ScalarParameter>,
    ) -> Result<ScalarValue, BuildError> {
        let Some(spec) = self.record.input_delay else {
            return Ok(ScalarValue::Known(0.0));
        };
        let name = match (&input.force, &input.base) {
            (Some(_), None) => "force",
            (None, Some(_)) => "base motion",
            _ => {
                let problem = "the delay of an input needs one input";
                return Err(BuildError::new(format!("{}.sensors", self.key), problem)
                    .found(match input.force {
                        Some(_) => "a force and a motion of the base",
                        None => "no input",
                    })
                    .expected("one input, or delays of the channels"));
            }
        };
        let scalar = PendingScalar {
            key: format!("{}.sensors.{}.delay", self.key, name.replace(' ', "_")),
            name: format!("delay of the {name} of {}", self.record.name),
            unit: "s",
            start: 0.0,
            scale: self.spacing(),
        };
        scalar.value(spec, scalars)
    }

    /// Smallest median spacing of the samples, s.
    fn spacing(&self) -> f64 {
        let each = self.record.channels.iter();
        let each = each.map(|c| median_spacing(&c.times));
        each.fold(f64::INFINITY, f64::min)
    }

    /// Error for delays of all channels and the input: only their differences affect the samples.
    fn check_delays(
        &self,
        experiment: &Experiment,
        scalars: &[ScalarParameter],
    ) -> Result<(), BuildError> {
        let open = |value: ScalarValue| value.index().is_some_and(|i| scalars[i].prior.is_none());
        let channels = &experiment.channels;
        let of_input = channels.first().map(|c| open(c.sensor().input_delay));
        let of_input = of_input.filter(|_| !experiment.is_free());
        let is_open = channels.iter().all(|c| open(c.sensor().delay)) && of_input.unwrap_or(true);
        match is_open && !channels.is_empty() {
            false => Ok(()),
            true => Err(BuildError::new(
                format!("{}.sensors", self.key),
                "the delays of all channels cannot be estimated: only their differences are identifiable",
            )
            .found(match of_input {
                Some(_) => "estimated delays of the input and of every channel",
                None => "estimated delays of every channel of a record without an input",
            })
            .expected("one channel or an input without a delay")),
        }
    }

    /// Returns the initial state, and the scalar parameters of its estimated components.
    ///
    /// The lowest derivative measured sets the scales of displacement (m or rad) and velocity (m/s or rad/s). The displacement
    /// starts at the first displacement sample, not corrected for sensor gain and offset, else 0; the velocity starts at 0. The
    /// builder later replaces these starts by states estimated from the samples, where there are any.
    fn initial(
        &self,
        scalars: &mut Vec<ScalarParameter>,
    ) -> Result<(State, Vec<Option<usize>>), BuildError> {
        let channels = &self.record.channels;
        let lowest = channels.iter().min_by_key(|c| c.kind);
        let initial = &self.record.initial;
        let are_known = initial.iter().all(|s| matches!(s, ScalarSpec::Known(_)));
        let scales = lowest.filter(|_| !are_known).map_or([1.0; 2], |c| {
            state_scales(c.kind, &c.values, median_spacing(&c.times))
        });
        let is_one = self.coordinates() == 1;
        let displacement = lowest.filter(|c| is_one && c.kind == ChannelKind::Displacement);
        let starts = [displacement.map_or(0.0, |c| c.values[0]), 0.0];
        let angular = channels.iter().any(|c| c.angular);
        let kinds = [ChannelKind::Displacement, ChannelKind::Velocity];
        let (mut state, mut estimated) = (Vec::new(), Vec::new());
        for (q, kind) in kinds.into_iter().enumerate() {
            for j in 0..self.coordinates() {
                let coordinate = self.builder.coordinates.get(j);
                let part = coordinate
                    .map(|name| format!(".{name}"))
                    .unwrap_or_default();
                let of = coordinate
                    .map(|name| format!(" of {name}"))
                    .unwrap_or_default();
                let own = self.record.initial_of.iter();
                let own = own
                    .filter(|(name, _)| Some(name) == coordinate)
                    .map(|(_, state)| state);
                let scalar = PendingScalar {
                    key: format!("{}.initial{part}.{}", self.key, kind.name()),
                    name: format!("initial {}{of} of {}", kind.name(), self.record.name),
                    unit: kind.unit_of(angular),
                    start: starts[q],
                    scale: scales[q],
                };
                let value = scalar.value(own.last().unwrap_or(initial)[q], scalars)?;
                estimated.push(value.index());
                state.push(match value {
                    ScalarValue::Known(number) => number,
                    ScalarValue::Estimated(index) => scalars[index].start,
                });
            }
        }
        Ok((State::from(state), estimated))
    }

    /// Number of coordinates.
    fn coordinates(&self) -> usize {
        self.builder.coordinates.len().max(1)
    }

    /// Key of the sensor of channel `i`.
    fn channel_key(&self, i: usize, channel: &ChannelSpec) -> String {
        match self.builder.coordinates.is_empty() {
            true => format!("{}.sensors.{}", self.key, channel.kind.name()),
            false => format!("{}.channels[{i}]", self.key),
        }
    }

    /// Builds one channel, with the inputs and the base motion at its samples.
    fn channel(
        &self,
        (i, spec): (usize, &ChannelSpec),
        experiment: &Experiment,
        input_delay: ScalarValue,
        scalars: &mut Vec<ScalarParameter>,
    ) -> Result<Channel, BuildError> {
        let (grid, times) = (self.grid, &*spec.times);
        // Without sigma the misfit is `integral r^2 dt` by the trapezoid rule (Buchta, Eq. 1), also for unequally spaced times.
        let weighting = match (&spec.weighting, even_spacing(times)) {
            (Some(weighting), _) => weighting.clone(),
            (None, Some(spacing)) => Weighting::Integral { spacing },
            (None, None) => integral_over(times),
        };
        let sensor = Sensor {
            input_delay,
            ..self.sensor((i, spec), scalars)?
        };
        let (shared, values) = (Arc::clone(&spec.times), Arc::clone(&spec.values));
        let nodes = experiment.nodes;
        let channel = Channel::of_shared(spec.kind, shared, values, weighting, grid, nodes);
        let channel = channel.ok_or_else(|| {
            BuildError::new("grid", "samples lie outside the time span of the grid")
                .found(format!("samples until {} s", times[times.len() - 1]))
                .expected(format!(
                    "a grid from {} s to {} s",
                    grid.start(),
                    grid.start() + grid.duration()
                ))
        })?;
        let mut channel = channel
            .with_loss(spec.loss)
            .with_noise_model(spec.noise)
            .with_sensor(sensor)
            .observing(self.builder.row(&self.channel_key(i, spec), &spec.at, 1)?)
            .with_resolution(spec.resolution);
        let input = &experiment.input;
        // Inputs at the samples are those of one coordinate.
        let has_inputs = experiment.excitation.is_some() && self.coordinates() == 1;
        if spec.kind == ChannelKind::Acceleration && has_inputs {
            channel = channel.with_shared_inputs(input.inputs_at(times));
        }
        if let Some(base) = self.base_motion(spec, input)? {
            if sensor.is_delayed() && spec.kind != ChannelKind::Acceleration {
                return Err(self.delay_of_absolute_motion(spec.kind));
            }
            channel = channel.with_base(base);
        }
        if !spec.filter.is_empty() {
            channel = channel.with_filter(spec.filter.clone());
        }
        Ok(channel)
    }

    fn delay_of_absolute_motion(&self, kind: ChannelKind) -> BuildError {
        let (key, kind) = (&self.key, kind.name());
        let problem = format!("the delay of an absolute {kind} cannot be estimated");
        BuildError::new(format!("{key}.sensors.{kind}"), problem)
            .found("`absolute: true` and an estimated delay")
            .expected("a delay in s, or a sensor of relative motion")
    }

    /// Returns the base motion (in the unit of the channel, one value per sample) to be added to the relative response; `None` for
    /// a relative sensor or a fixed base. Accelerometers are absolute by default.
    fn base_motion(
        &self,
        spec: &ChannelSpec,
        input: &Input,
    ) -> Result<Option<Vec<f64>>, BuildError> {
        let (kind, asked) = (spec.kind, spec.sensor.absolute);
        let key = format!("{}.sensors.{}.absolute", self.key, kind.name());
        if input.base.is_none() {
            let problem = "the base is at rest, so relative and absolute motion are equal";
            return match asked {
                None => Ok(None),
                Some(_) => Err(BuildError::new(key, problem)
                    .found("`absolute` without a motion of the base")
                    .expected("no `absolute`")),
            };
        }
        let is_absolute = kind == ChannelKind::Acceleration && spec.at.len() < 2;
        if !asked.unwrap_or(is_absolute) {
            return Ok(None);
        }
        let response = spec.times.iter().map(|t| input.base_motion_at(kind, *t));
        let response: Option<Vec<f64>> = response.collect();
        response.map(Some).ok_or_else(|| {
            BuildError::new(key, format!("the {} of the base is not known", kind.name()))
                .found("the acceleration of the base only")
                .expected("`columns: {base_displacement: …}`, or no `absolute: true`")
        })
    }

    /// Returns gain, offset (in the unit of the channel) and drift (per s) of a sensor.
    fn sensor(
        &self,
        (i, channel): (usize, &ChannelSpec),
        scalars: &mut Vec<ScalarParameter>,
    ) -> Result<Sensor, BuildError> {
        let SensorSpec {
            gain,
            offset,
            drift,
            delay,
            ..
        } = channel.sensor;
        // Limits of a delay concern the samples that are used.
        let delay = delay.map(|delay| match delay {
            DelayValue::Known(delay) => ScalarSpec::Known(delay),
            DelayValue::Estimate(word) => ScalarSpec::Estimate(word),
            DelayValue::Estimated(spec) => ScalarSpec::Estimated(EstimateSpec {
                start: spec.start,
                prior: None,
            }),
        });
        let (kind, values) = (channel.kind.name(), &channel.values);
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares = values.iter().map(|v| (v - mean) * (v - mean));
        let deviation = (squares.sum::<f64>() / count).sqrt();
        let unit = channel.kind.unit_of(channel.angular);
        let per_second = format!("{unit}/s");
        let key = self.channel_key(i, channel);
        let of = match channel.at.as_slice() {
            [] => String::new(),
            names => format!(" at {}", names.join(" and ")),
        };
        let mut value =
            |part: &str, spec: Option<ScalarSpec>, unit, [default, start, scale]: [f64; 3]| {
                let scalar = PendingScalar {
                    key: format!("{key}.{part}"),
                    name: format!("{part} of the {kind}{of} of {}", self.record.name),
                    unit,
                    start,
                    scale,
                };
                scalar.value(spec.unwrap_or(ScalarSpec::Known(default)), scalars)
            };
        let sensor = Sensor {
            gain: value("gain", gain, "", [1.0; 3])?,
            offset: value("offset", offset, unit, [0.0, mean, deviation])?,
            // Scale of the drift: the standard deviation of the samples per 1 s.
            drift: value("drift", drift, &per_second, [0.0, 0.0, deviation])?,
            delay: value(
                "delay",
                delay,
                "s",
                [0.0, 0.0, median_spacing(&channel.times)],
            )?,
            input_delay: ScalarValue::Known(0.0),
        };
        if sensor.gain == ScalarValue::Known(0.0) {
            let problem = "the gain of a sensor must not be 0";
            return Err(BuildError::new(format!("{key}.gain"), problem)
                .found("0")
                .expected("another number, or `estimate`"));
        }
        if self.builder.is_equation_error() && sensor.is_estimated() {
            let problem = "the method `equation-error` needs sensors with known parameters";
            return Err(BuildError::new(key, problem)
                .found("`estimate`")
                .expected("numbers, or another method"));
        }
        Ok(sensor)
    }
}

/// Number of nodes of a response until the time `end`, s.
fn nodes_until(grid: &Grid, end: f64) -> usize {
    let steps = (end - grid.start()) / grid.step();
    let steps = (steps - TimePoint::SAME_TIME).ceil().max(0.0);
    (steps as usize + 1).clamp(Grid::FEWEST_NODES, grid.nodes())
}
