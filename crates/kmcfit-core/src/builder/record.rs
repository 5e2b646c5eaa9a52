//! One record: where the motion begins, what drives it, what was read.

use super::BuildError;
use crate::functions::ScalarParameter;
use crate::objective::state_scales;
use crate::record::{
    BaseMotion, Channel, ChannelKind, Experiment, Input, Loss, Waveform, Weighting, integral_over,
};
use crate::signal::{Interpolation, Signal};
use crate::signal::{even_spacing, median_spacing};
use crate::system::{Excitation, Grid, InputSample, State};

/// Readings of one kind.
#[derive(Debug, Clone, PartialEq)]
struct Readings {
    kind: ChannelKind,
    times: Vec<f64>,
    values: Vec<f64>,
    sigma: Option<f64>,
    loss: Loss,
}

/// One record of the device's motion, in SI units; the counterpart of one entry of `experiments` in a
/// model file.
///
/// A force is linear between its samples unless [`Record::interpolation`] says otherwise, and so is the
/// acceleration of a base, relative to which displacement and velocity count; an accelerometer then
/// reads `y'' + b''`.
#[derive(Debug, Clone)]
pub struct Record {
    name: String,
    initial: Option<State>,
    force: Option<[Vec<f64>; 2]>,
    base: Option<[Vec<f64>; 2]>,
    interpolation: Interpolation,
    readings: Vec<Readings>,
}

impl Record {
    /// A record of a motion whose initial state is to be found with the functions.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            initial: None,
            force: None,
            base: None,
            interpolation: Interpolation::Linear,
            readings: Vec::new(),
        }
    }

    /// From a known state: displacement (m) and velocity (m/s) at the first time of all records, which count
    /// time alike.
    #[must_use]
    pub fn from_state(mut self, displacement: f64, velocity: f64) -> Self {
        self.initial = Some(State {
            displacement,
            velocity,
        });
        self
    }

    /// Under a force (N) at `times` (s).
    #[must_use]
    pub fn force(mut self, times: &[f64], force: &[f64]) -> Self {
        self.force = Some([times.to_vec(), force.to_vec()]);
        self
    }

    /// On a base with this acceleration (m/s^2) at `times` (s).
    #[must_use]
    pub fn base_acceleration(mut self, times: &[f64], acceleration: &[f64]) -> Self {
        self.base = Some([times.to_vec(), acceleration.to_vec()]);
        self
    }

    /// With another rule for force and base between their samples: a converter holds its output, a
    /// sampled smooth force is nearer to a cubic spline than to lines.
    #[must_use]
    pub fn interpolation(mut self, interpolation: Interpolation) -> Self {
        self.interpolation = interpolation;
        self
    }

    /// With displacements (m) at `times` (s).
    #[must_use]
    pub fn displacement(self, times: &[f64], values: &[f64]) -> Self {
        self.readings(ChannelKind::Displacement, times, values)
    }

    /// With velocities (m/s) at `times` (s).
    #[must_use]
    pub fn velocity(self, times: &[f64], values: &[f64]) -> Self {
        self.readings(ChannelKind::Velocity, times, values)
    }

    /// With accelerations (m/s^2) at `times` (s).
    #[must_use]
    pub fn acceleration(self, times: &[f64], values: &[f64]) -> Self {
        self.readings(ChannelKind::Acceleration, times, values)
    }

    fn readings(mut self, kind: ChannelKind, times: &[f64], values: &[f64]) -> Self {
        self.readings.push(Readings {
            kind,
            times: times.to_vec(),
            values: values.to_vec(),
            sigma: None,
            loss: Loss::Squares,
        });
        self
    }

    /// The standard deviation of the readings given last: their part of J is then a chi-square. Without it
    /// it is `integral r^2 dt`.
    #[must_use]
    pub fn sigma(mut self, sigma: f64) -> Self {
        if let Some(readings) = self.readings.last_mut() {
            readings.sigma = Some(sigma);
        }
        self
    }

    /// What a residual of the readings given last costs; other than squares it needs a sigma.
    #[must_use]
    pub fn loss(mut self, loss: Loss) -> Self {
        if let Some(readings) = self.readings.last_mut() {
            readings.loss = loss;
        }
        self
    }

    /// The times that it spans; `None` without readings.
    pub(super) fn span(&self) -> Option<[f64; 2]> {
        let ends = |r: &Readings| Some([*r.times.first()?, *r.times.last()?]);
        let spans = self.readings.iter().filter_map(ends);
        spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// The times of all readings, if they are the same for every kind.
    pub(super) fn common_times(&self) -> Option<&[f64]> {
        let (first, rest) = self.readings.split_first()?;
        let same = rest.iter().all(|r| r.times == first.times);
        same.then_some(&first.times)
    }

    fn refuse(&self, problem: impl Into<String>) -> BuildError {
        BuildError::new(format!("record `{}`", self.name), problem)
    }

    /// Refuses what is no record.
    pub(super) fn check(&self) -> Result<(), BuildError> {
        if self.readings.is_empty() {
            return Err(self.refuse("there are no readings"));
        }
        for Readings {
            kind,
            times,
            values,
            sigma,
            loss,
        } in &self.readings
        {
            let kind = kind.name();
            let increasing = times.windows(2).all(|pair| pair[0] < pair[1]);
            let finite = times.iter().chain(values).all(|x| x.is_finite());
            let problem = if times.len() != values.len() {
                format!("{} values at {} times", values.len(), times.len())
            } else if times.len() < 2 {
                "fewer than two readings".into()
            } else if !finite {
                "a time or reading is not a finite number".into()
            } else if !increasing {
                "the times do not increase".into()
            } else if sigma.is_some_and(|s| !(s.is_finite() && s > 0.0)) {
                "sigma is not a positive number".into()
            } else if sigma.is_none() && *loss != Loss::Squares {
                "a robust loss needs a sigma".into()
            } else {
                continue;
            };
            return Err(self.refuse(format!("{kind}: {problem}")));
        }
        match self.initial {
            Some(s) if !(s.displacement.is_finite() && s.velocity.is_finite()) => {
                Err(self.refuse("the initial state is not finite"))
            }
            _ => Ok(()),
        }
    }

    /// On a grid; what is sought of the initial state is added to `scalars`.
    pub(super) fn on(
        &self,
        grid: &Grid,
        scalars: &mut Vec<ScalarParameter>,
    ) -> Result<Experiment, BuildError> {
        let drive = Input {
            force: self
                .signal("force", self.force.as_ref(), grid)?
                .map(Waveform::Samples),
            base: self
                .signal("base acceleration", self.base.as_ref(), grid)?
                .map(BaseMotion::Acceleration),
        };
        let nodes = grid.nodes();
        let mut experiment = Experiment::free(&self.name, State::default(), nodes);
        experiment.excitation = (drive != Input::default()).then(|| drive.on(grid, nodes));
        match self.initial {
            Some(state) => experiment.initial = state,
            None => experiment.sought = self.seek_initial(scalars),
        }
        for readings in &self.readings {
            let channel = self.channel(readings, &drive, experiment.excitation.as_ref(), grid)?;
            experiment.channels.push(channel);
        }
        experiment.drive = drive;
        Ok(experiment)
    }

    fn signal(
        &self,
        what: &str,
        samples: Option<&[Vec<f64>; 2]>,
        grid: &Grid,
    ) -> Result<Option<Signal>, BuildError> {
        let Some([times, values]) = samples else {
            return Ok(None);
        };
        let signal = Signal::new(times.clone(), values.clone(), self.interpolation);
        let signal = signal.ok_or_else(|| {
            self.refuse(format!(
                "{what}: as many finite values as increasing times are needed"
            ))
        })?;
        let [from, to] = [grid.start(), grid.time(grid.nodes() - 1)];
        match signal.covers(from, to) {
            true => Ok(Some(signal)),
            false => Err(self.refuse(format!("{what}: it does not cover {from} s to {to} s"))),
        }
    }

    fn channel(
        &self,
        readings: &Readings,
        drive: &Input,
        excitation: Option<&Excitation>,
        grid: &Grid,
    ) -> Result<Channel, BuildError> {
        let Readings {
            kind,
            times,
            values,
            sigma,
            loss,
        } = readings;
        let weighting = match sigma {
            Some(sigma) => Weighting::Sigma(*sigma),
            None => integral(times),
        };
        let channel = Channel::new(
            *kind,
            times.clone(),
            values.clone(),
            weighting,
            grid,
            grid.nodes(),
        );
        let channel = channel
            .ok_or_else(|| self.refuse(format!("{}: readings outside the grid", kind.name())))?;
        let mut channel = channel.with_loss(*loss);
        if *kind == ChannelKind::Acceleration && excitation.is_some() {
            let around = |t: &f64| InputSample {
                force: drive.force_at(*t),
                base: drive.base_acceleration_at(*t),
            };
            channel = channel.with_surroundings(times.iter().map(around).collect());
        }
        if *kind == ChannelKind::Acceleration && drive.base.is_some() {
            let base = times.iter().map(|t| drive.base_acceleration_at(*t));
            channel = channel.with_base(base.collect());
        }
        Ok(channel)
    }

    fn seek_initial(&self, scalars: &mut Vec<ScalarParameter>) -> [Option<usize>; 2] {
        let nearest = self.readings.iter().min_by_key(|r| r.kind);
        let sizes = nearest.map_or([1.0; 2], |r| {
            state_scales(r.kind, &r.values, median_spacing(&r.times))
        });
        let parts = [("displacement", "m"), ("velocity", "m/s")];
        let mut sought = [None; 2];
        for (((name, unit), size), sought) in parts.into_iter().zip(sizes).zip(&mut sought) {
            *sought = Some(scalars.len());
            scalars.push(ScalarParameter {
                name: format!("initial {name} of {}", self.name),
                unit: unit.into(),
                start: 0.0,
                size,
                prior: None,
            });
        }
        sought
    }
}

/// The integral cost: the paper's where the times are equally spaced.
fn integral(times: &[f64]) -> Weighting {
    match even_spacing(times) {
        Some(spacing) => Weighting::Integral { spacing },
        None => integral_over(times),
    }
}
