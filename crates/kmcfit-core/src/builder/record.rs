//! Specification of one record: initial state, input and channels.

use super::BuildError;
use crate::functions::CoefficientKind;
use crate::model::{CoefficientSpec, ScalarSpec, SensorSpec};
use crate::noise::{HIGHEST_ORDER, uninterrupted_runs};
use crate::number_format::significant;
use crate::record::{
    BaseMotion, ChannelKind, Input, InputNoise, InputNoiseKind, Loss, NoiseModel, Waveform,
    Weighting,
};
use crate::signal::{Interpolation, SecondOrder, Signal, median_spacing};
use crate::system::InputQuantity;
use std::sync::Arc;

/// Specification of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelSpec {
    /// Measured quantity.
    pub kind: ChannelKind,
    /// Times of the samples, s, increasing.
    pub times: Arc<Vec<f64>>,
    /// Samples in the SI unit of the kind.
    pub values: Arc<Vec<f64>>,
    /// Weights of the residuals; `None` for `J = integral r^2 dt`.
    pub weighting: Option<Weighting>,
    /// Loss of a residual.
    pub loss: Loss,
    /// Correlation of the noise; used with a sigma.
    pub noise: NoiseModel,
    /// Gain, offset, drift and delay.
    pub sensor: SensorSpec,
    /// Quantisation step of the samples, in the SI unit of the kind; 0 where unknown.
    pub resolution: f64,
    /// Sections of a filter applied to samples and response.
    pub filter: Vec<SecondOrder>,
    /// First and last time of the record, s, missing samples included.
    pub span: [f64; 2],
    /// True for a rotation, which determines the names of units.
    pub angular: bool,
    /// What is observed of a structure: a coordinate, the second of two ends less the first, or the elongation of an element; the only
    /// coordinate where it is empty.
    pub at: Vec<String>,
}

impl ChannelSpec {
    /// Samples `values` (in the SI unit of `kind`) of an ideal sensor at `times` (s).
    pub fn new(kind: ChannelKind, times: &[f64], values: &[f64]) -> Self {
        let end = |time: Option<&f64>| time.copied().unwrap_or_default();
        Self {
            kind,
            times: Arc::new(times.to_vec()),
            values: Arc::new(values.to_vec()),
            weighting: None,
            loss: Loss::Squares,
            noise: NoiseModel::default(),
            sensor: SensorSpec::default(),
            resolution: 0.0,
            filter: Vec::new(),
            span: [end(times.first()), end(times.last())],
            angular: false,
            at: Vec::new(),
        }
    }

    /// Error for invalid samples; `record` is the key of the record.
    fn check(&self, record: &str) -> Result<(), BuildError> {
        let kind = self.kind.name();
        let columns = || format!("{record}.columns.{kind}");
        let increasing = self.times.windows(2).all(|pair| pair[0] < pair[1]);
        let finite = self
            .times
            .iter()
            .chain(self.values.iter())
            .all(|x| x.is_finite());
        if self.times.len() != self.values.len() {
            let problem = "the numbers of times and samples differ";
            return Err(BuildError::new(columns(), problem)
                .found(format!(
                    "{} values at {} times",
                    self.values.len(),
                    self.times.len()
                ))
                .expected("as many times as values"));
        }
        if self.times.len() < 2 {
            return Err(BuildError::new(columns(), "too few samples")
                .found(self.times.len())
                .expected("at least 2"));
        }
        if !finite || !increasing {
            return Err(BuildError::new(columns(), "invalid samples")
                .found(match finite {
                    true => "times that do not increase",
                    false => "a time or sample that is not a finite number",
                })
                .expected("finite values at increasing times"));
        }
        let sigmas = match &self.weighting {
            Some(Weighting::Sigma(sigma)) => std::slice::from_ref(sigma),
            Some(Weighting::Sigmas(sigmas)) => sigmas,
            _ => &[],
        };
        if let Some(sigma) = sigmas.iter().find(|s| !(s.is_finite() && **s > 0.0)) {
            let key = format!("{record}.sigma.{kind}");
            return Err(
                BuildError::new(key, "a standard deviation must be positive")
                    .found(sigma)
                    .expected("a number greater than 0, in SI units"),
            );
        }
        if self.weighting.is_none() && self.loss != Loss::Squares {
            let problem = "a robust loss needs a sigma to identify large residuals";
            return Err(BuildError::new(format!("{record}.loss.{kind}"), problem)
                .found("no `sigma`")
                .expected(format!("`sigma: {{{kind}: …}}`")));
        }
        self.check_noise(&format!("{record}.noise.{kind}.ar"))
    }

    /// Error for autoregressive noise that the samples cannot have; `key` is that of the order.
    fn check_noise(&self, key: &str) -> Result<(), BuildError> {
        let NoiseModel::Autoregressive { order } = self.noise else {
            return Ok(());
        };
        let kind = self.kind.name();
        let error = |problem: &str| BuildError::new(key, problem);
        if !(1..=HIGHEST_ORDER).contains(&order) {
            return Err(error("the order of the noise is outside its range")
                .found(order)
                .expected(format!("an integer from 1 to {HIGHEST_ORDER}")));
        }
        if self.weighting.is_none() {
            return Err(error("correlated noise needs a sigma")
                .found(format!("no `sigma.{kind}`"))
                .expected(format!(
                    "`sigma: {{{kind}: …}}`: a number, a column, or `estimate`"
                )));
        }
        if uninterrupted_runs(&self.times).is_none() {
            let problem = "autoregressive noise needs equally spaced samples";
            return Err(error(problem).found("irregular times").expected(
                "`auto`, which uses an exponential correlation for irregular times, or `white`",
            ));
        }
        Ok(())
    }
}

/// One record of the response, in SI units; corresponds to an entry of `experiments` in a model file.
///
/// Force and base acceleration are linear between their samples unless [`Record::interpolation`] is set. Under base excitation,
/// displacement and velocity are relative to the base, and an accelerometer measures `y'' + b''`.
#[derive(Debug, Clone)]
pub struct Record {
    pub(super) name: String,
    pub(super) initial: [ScalarSpec; 2],
    pub(super) initial_of: Vec<(String, [ScalarSpec; 2])>,
    pub(super) force_at: Option<String>,
    pub(super) channels: Vec<ChannelSpec>,
    pub(super) coefficients: Vec<(CoefficientKind, CoefficientSpec)>,
    pub(super) validation: bool,
    pub(super) input_error: Option<InputNoise>,
    input: Input,
    force: Option<[Vec<f64>; 2]>,
    base: Option<[Vec<f64>; 2]>,
    interpolation: Interpolation,
    pub(super) input_delay: Option<ScalarSpec>,
}

impl Record {
    /// A record whose initial state is estimated with the coefficient functions.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            initial: [ScalarSpec::ESTIMATED; 2],
            initial_of: Vec::new(),
            force_at: None,
            channels: Vec::new(),
            coefficients: Vec::new(),
            validation: false,
            input_error: None,
            input: Input::default(),
            force: None,
            base: None,
            interpolation: Interpolation::Linear,
            input_delay: None,
        }
    }

    /// Sets the delay of the recorded force or base motion relative to the response, s: positive for an input recorded late. Times of
    /// the coefficients are then those of the input.
    #[must_use]
    pub fn input_delay(mut self, delay: ScalarSpec) -> Self {
        self.input_delay = Some(delay);
        self
    }

    /// Sets a known initial state: displacement (m) and velocity (m/s) at the first time of all records, which share a time axis.
    #[must_use]
    pub fn from_state(self, displacement: f64, velocity: f64) -> Self {
        self.initial([displacement, velocity].map(ScalarSpec::Known))
    }

    /// Sets the initial displacement (m) and velocity (m/s), each known or estimated.
    #[must_use]
    pub fn initial(mut self, state: [ScalarSpec; 2]) -> Self {
        self.initial = state;
        self
    }

    /// Sets the initial displacement (m) and velocity (m/s) of a coordinate of a structure; others have those of [`Record::initial`].
    #[must_use]
    pub fn initial_of(mut self, coordinate: &str, state: [ScalarSpec; 2]) -> Self {
        self.initial_of.push((coordinate.to_owned(), state));
        self
    }

    /// Sets the coordinate of a structure on which the force acts; the first one unless set.
    #[must_use]
    pub fn force_at(mut self, coordinate: &str) -> Self {
        self.force_at = Some(coordinate.to_owned());
        self
    }

    /// Sets what the last channel observes of a structure, see [`ChannelSpec::at`].
    #[must_use]
    pub fn at(mut self, names: &[&str]) -> Self {
        if let Some(channel) = self.channels.last_mut() {
            channel.at = names.iter().map(|name| (*name).to_owned()).collect();
        }
        self
    }

    /// Sets a force (N) at `times` (s).
    #[must_use]
    pub fn force(mut self, times: &[f64], force: &[f64]) -> Self {
        self.force = Some([times.to_vec(), force.to_vec()]);
        self
    }

    /// Sets an acceleration of the base (m/s^2) at `times` (s).
    #[must_use]
    pub fn base_acceleration(mut self, times: &[f64], acceleration: &[f64]) -> Self {
        self.base = Some([times.to_vec(), acceleration.to_vec()]);
        self
    }

    /// Sets the interpolation of force and base between samples: a zero-order hold for the output of a converter, a cubic spline
    /// for a sampled smooth force.
    #[must_use]
    pub fn interpolation(mut self, interpolation: Interpolation) -> Self {
        self.interpolation = interpolation;
        self
    }

    /// States independent errors of standard deviation `sigma` (SI unit) of the samples of an input.
    #[must_use]
    pub fn input_error(
        mut self,
        quantity: InputQuantity,
        kind: InputNoiseKind,
        sigma: f64,
    ) -> Self {
        self.input_error = Some(InputNoise {
            quantity,
            kind,
            sigma,
            // Those of the input, when it is known.
            times: Vec::new(),
            interpolation: Interpolation::Linear,
        });
        self
    }

    /// Sets force and motion of the base.
    #[must_use]
    pub fn input(mut self, input: Input) -> Self {
        self.input = input;
        self
    }

    /// Adds displacements (m) at `times` (s).
    #[must_use]
    pub fn displacement(self, times: &[f64], values: &[f64]) -> Self {
        self.channel(ChannelSpec::new(ChannelKind::Displacement, times, values))
    }

    /// Adds velocities (m/s) at `times` (s).
    #[must_use]
    pub fn velocity(self, times: &[f64], values: &[f64]) -> Self {
        self.channel(ChannelSpec::new(ChannelKind::Velocity, times, values))
    }

    /// Adds accelerations (m/s^2) at `times` (s).
    #[must_use]
    pub fn acceleration(self, times: &[f64], values: &[f64]) -> Self {
        self.channel(ChannelSpec::new(ChannelKind::Acceleration, times, values))
    }

    /// Adds a channel.
    #[must_use]
    pub fn channel(mut self, channel: ChannelSpec) -> Self {
        self.channels.push(channel);
        self
    }

    /// Sets the standard deviation of the samples of the last channel, in its SI unit, which makes its part of J a chi-square;
    /// without it that part is `integral r^2 dt`.
    #[must_use]
    pub fn sigma(mut self, sigma: f64) -> Self {
        if let Some(channel) = self.channels.last_mut() {
            channel.weighting = Some(Weighting::Sigma(sigma));
        }
        self
    }

    /// Sets the loss of the last channel; a robust loss needs a sigma.
    #[must_use]
    pub fn loss(mut self, loss: Loss) -> Self {
        if let Some(channel) = self.channels.last_mut() {
            channel.loss = loss;
        }
        self
    }

    /// Sets a coefficient function of this record alone.
    #[must_use]
    pub fn coefficient(mut self, kind: CoefficientKind, spec: CoefficientSpec) -> Self {
        self.coefficients.push((kind, spec));
        self
    }

    /// Marks a validation record, which is predicted and scored but not fitted.
    #[must_use]
    pub fn validation(mut self) -> Self {
        self.validation = true;
        self
    }

    /// First and last time of the record, s; `None` without channels.
    pub(super) fn span(&self) -> Option<[f64; 2]> {
        let spans = self.channels.iter().map(|channel| channel.span);
        spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// Smallest median spacing of the channels, s.
    pub(super) fn spacing(&self) -> f64 {
        let spacings = self.channels.iter().map(|c| median_spacing(&c.times));
        spacings.fold(f64::INFINITY, f64::min)
    }

    /// Times of all samples, if equal for all channels.
    pub(super) fn common_times(&self) -> Option<&[f64]> {
        let (first, rest) = self.channels.split_first()?;
        let same = rest.iter().all(|c| c.times == first.times);
        same.then_some(&first.times)
    }

    /// Error for invalid records; `key` is that of the record. The equation error has no sum of misfits to check.
    pub(super) fn check(&self, key: &str, is_equation_error: bool) -> Result<(), BuildError> {
        self.channels.iter().try_for_each(|c| c.check(key))?;
        let states = self
            .initial_of
            .iter()
            .map(|(_, state)| state)
            .chain([&self.initial]);
        let named =
            |state| std::iter::zip::<&[ScalarSpec; 2], _>(state, ["displacement", "velocity"]);
        for (scalar, name) in states.flat_map(named) {
            if let ScalarSpec::Known(value) = scalar
                && !value.is_finite()
            {
                let key = format!("{key}.initial.{name}");
                return Err(BuildError::new(key, "not a finite number")
                    .found(value)
                    .expected("a finite number"));
            }
        }
        match is_equation_error {
            true => Ok(()),
            false => self.check_misfit(key),
        }
    }

    /// Error for a combination of channels without sigma: `J = integral r^2 dt` of the displacement has another unit than that of
    /// other channels.
    fn check_misfit(&self, key: &str) -> Result<(), BuildError> {
        let without = self.channels.iter().find(|c| c.weighting.is_none());
        let alone = self.channels.len() == 1;
        match without {
            Some(channel) if !(alone && channel.kind == ChannelKind::Displacement) => {
                let name = channel.kind.name();
                let problem = match alone {
                    true => format!("samples of the {name} need a sigma"),
                    false => "several channels each need a sigma".to_owned(),
                };
                Err(BuildError::new(key, problem)
                    .found(format!("no `sigma.{name}`"))
                    .expected(format!(
                        "`sigma: {{{name}: …}}`: a number in SI units, a column, or `estimate`"
                    )))
            }
            _ => Ok(()),
        }
    }

    /// Force and motion of the base, which must cover the span of the channels.
    pub(super) fn inputs(&self, key: &str) -> Result<Input, BuildError> {
        let signal = |samples: &Option<[Vec<f64>; 2]>, name: &str| {
            let Some([times, values]) = samples else {
                return Ok(None);
            };
            let signal = Signal::new(times.clone(), values.clone(), self.interpolation);
            signal.map(Some).ok_or_else(|| {
                let key = format!("{key}.columns.{name}");
                BuildError::new(key, "invalid samples")
                    .found(format!("{} values at {} times", values.len(), times.len()))
                    .expected("finite values at increasing times")
            })
        };
        let mut input = self.input.clone();
        if let Some(force) = signal(&self.force, "force")? {
            input.force = Some(Waveform::Samples(force));
        }
        if let Some(base) = signal(&self.base, "base_acceleration")? {
            input.base = Some(BaseMotion::Acceleration(base));
        }
        if let Some(span) = self.span() {
            check_cover(&input, key, span)?;
        }
        Ok(input)
    }
}

/// A time span with six significant digits.
fn seconds(start: f64, end: f64) -> String {
    format!("{} s to {} s", significant(start, 6), significant(end, 6))
}

/// Error if a force or a motion of the base does not cover the record.
fn check_cover(input: &Input, key: &str, [start, end]: [f64; 2]) -> Result<(), BuildError> {
    let force = match &input.force {
        Some(Waveform::Samples(signal)) => Some(("force", signal)),
        _ => None,
    };
    let base = input.base.as_ref().map(|base| match base {
        BaseMotion::Acceleration(signal) => ("base_acceleration", signal),
        BaseMotion::Displacement(signal) => ("base_displacement", signal),
    });
    let short = |(_, signal): &(&str, &Signal)| !signal.covers(start, end);
    match force.into_iter().chain(base).find(short) {
        Some((name, signal)) => {
            let problem = format!("the {} is shorter than the record", name.replace('_', " "));
            let times = signal.times();
            Err(BuildError::new(format!("{key}.columns.{name}"), problem)
                .found(seconds(times[0], times[times.len() - 1]))
                .expected(format!(
                    "at least {}: its values outside are unknown",
                    seconds(start, end)
                )))
        }
        None => Ok(()),
    }
}
