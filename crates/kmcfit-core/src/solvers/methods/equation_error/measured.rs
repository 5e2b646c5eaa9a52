//! States and inputs of records, estimated from the samples without a simulation.

use super::robust::MAD_TO_SIGMA;
use crate::functions::Parameterization;
use crate::objective::SimulatedRecord;
use crate::problem::Problem;
use crate::record::{Channel, ChannelKind, Experiment, Loss};
use crate::signal::{SecondOrder, median, zero_phase};
use crate::simd::sum::rms;
use crate::simulate::Trajectory;
use crate::solvers::reason::{MissingMeasurement, UnsupportedRecord};
use crate::solvers::state_estimation::{
    Differences, Kinematics, PassBand, fine_differences, unsensed,
};
use crate::system::{Grid, InputSample, NodalCoefficients, StageSamples, TimePoint};
use std::ops::Range;

/// Dominant periods omitted at either end of a record with known force or base motion: transients of the filter there are as
/// large as the response and decay to a tenth in one period. Without a known input, the unknown input is the larger error.
const SETTLING: f64 = 2.0;
/// Smallest fraction of a record (1 / n) that may be omitted at either end.
const MOST_LEFT_OUT: usize = 4;
/// Difference of two spacings, relative to them, up to which they count as equal: times on a grid have rounding errors, gaps a
/// spacing or more.
const SAME_SPACING: f64 = 1e-3;
/// Distance of an outlier from the median of itself and its neighbours, in robust standard deviations of these distances: one of a
/// normal distribution in two million.
const OUTLYING: f64 = 5.0;
/// Neighbours on either side of a sample in that median.
const NEIGHBOURS: usize = 2;

/// State of an experiment at some times, with force and base acceleration.
pub(super) struct Measured {
    pub places: Vec<TimePoint>,
    /// Index of the first time among the samples, if the times are those of one channel.
    first: usize,
    /// Displacement, m.
    pub y: Vec<f64>,
    /// Velocity, m/s.
    pub v: Vec<f64>,
    /// Acceleration `y''`, m/s^2.
    pub a: Vec<f64>,
    /// Force, N.
    pub force: Vec<f64>,
    /// Acceleration `b''` of the base, m/s^2.
    pub base: Vec<f64>,
    /// Weight of each time in the integral of the error, s.
    pub weight: f64,
    /// Dominant frequency, rad/s.
    pub frequency: f64,
    /// Corner of the filter that all series have passed, rad/s, if any.
    pub corner: Option<f64>,
    /// State and inputs at the same times without smoothing, for the linear terms of the weak form; `None` where only the smoothed
    /// ones exist.
    pub unsmoothed: Option<Unsmoothed>,
    /// Filter of the channels, which each term of the equation of motion passes; empty without one, and where all series have passed it.
    pub filter: Vec<SecondOrder>,
    /// Weight of the [smoothing](crate::solvers::state_estimation::smooth) of the state, where it is that of a series at these times.
    pub smoothing: Option<f64>,
    /// The same at the common times of several channels, with the state without smoothing, for the weak form; `None` where the times are
    /// these, or no such state exists.
    at_samples: Option<Box<Measured>>,
}

/// State and inputs without smoothing.
pub(super) struct Unsmoothed {
    /// Displacement (m), velocity (m/s) and acceleration (m/s^2) by differences of the samples, or of means of groups of them.
    pub state: Differences,
    /// Force, N, or its means over the groups.
    pub force: Vec<f64>,
    /// Acceleration of the base, m/s^2, or its means over the groups.
    pub base: Vec<f64>,
}

impl Measured {
    /// Estimates the state from the channels of an experiment, for the sensor parameters `scalars`.
    ///
    /// # Errors
    /// The missing measurement.
    fn of(
        problem: &Problem,
        experiment: &Experiment,
        scalars: &[f64],
    ) -> Result<Self, MissingMeasurement> {
        let estimated = |c: &Channel| c.sensor().is_estimated();
        if experiment.channels.iter().any(estimated) {
            return Err(MissingMeasurement::KnownSensors);
        }
        if let [channel] = experiment.channels.as_slice()
            && channel.kind() == ChannelKind::Acceleration
            && let Some(spacing) = equal_spacing(channel.times())
        {
            return Self::in_band(experiment, channel, spacing, scalars)
                .ok_or(MissingMeasurement::Oscillation);
        }
        let measured = match filtered_alike(experiment) {
            Some(before) => Self::before_filter(problem, &before, experiment, scalars)?,
            None => Self::unfiltered(problem, experiment, scalars)?,
        };
        let moves = measured.frequency > 0.0 && measured.frequency.is_finite();
        moves.then_some(measured).ok_or(MissingMeasurement::Motion)
    }

    /// From channels without a filter, or without an input that would have to pass it.
    fn unfiltered(
        problem: &Problem,
        experiment: &Experiment,
        scalars: &[f64],
    ) -> Result<Self, MissingMeasurement> {
        let anchored = |c: &Channel| c.kind() == ChannelKind::Displacement && c.filter().is_empty();
        if !experiment.is_free() && !experiment.channels.iter().any(anchored) {
            return Err(MissingMeasurement::FilteredDrive);
        }
        let cleaned = without_outliers(experiment);
        let kinematics = Kinematics::of(problem, &cleaned, scalars);
        let kinematics = kinematics.ok_or(MissingMeasurement::Samples)?;
        let mut measured = Self::at_nodes(problem, experiment, &kinematics);
        measured.unsmoothed = Unsmoothed::of_groups(problem, experiment, &kinematics);
        measured.smoothing = kinematics.grouping.and_then(|grouping| grouping.smoothing);
        if measured.unsmoothed.is_none() && have_common_times(experiment) {
            let sampled = measured.sampled(experiment, scalars, problem.system.grid.step());
            let sampled = sampled.filter(|sampled| sampled.unsmoothed.is_some());
            measured.at_samples = sampled.map(Box::new);
        }
        Ok(measured)
    }

    /// From channels with one filter: the state follows from the samples `before` it, at the times of the first channel, and each term
    /// of the equation of motion passes it.
    fn before_filter(
        problem: &Problem,
        before: &Experiment,
        experiment: &Experiment,
        scalars: &[f64],
    ) -> Result<Self, MissingMeasurement> {
        let at_nodes = Self::unfiltered(problem, before, scalars)?;
        let mut measured = at_nodes
            .sampled(before, scalars, problem.system.grid.step())
            .ok_or(MissingMeasurement::Samples)?;
        measured.filter = experiment.channels[0].filter().to_vec();
        Ok(measured)
    }

    /// State and inputs at the common, equally spaced times of the channels of an experiment without a filter, but two at each end, as
    /// far as the times of `self` reach.
    fn sampled(&self, experiment: &Experiment, scalars: &[f64], step: f64) -> Option<Self> {
        let channel = experiment.channels.first()?;
        let spacing = equal_spacing(channel.times())?;
        let position = |place: &TimePoint| place.step as f64 + place.fraction;
        let ends = [self.places.first()?, self.places.last()?].map(position);
        let inner = 2..channel.len().checked_sub(2)?;
        let within = |i: &usize| {
            let x = position(&channel.nominal_place(*i));
            ends[0] <= x && x <= ends[1]
        };
        let first = inner.clone().find(within)?;
        let count = (first..inner.end).take_while(within).count();
        let places: Vec<TimePoint> = channel.places().skip(first).take(count).collect();
        let [mut y, mut v, mut a] = [(); 3].map(|()| Vec::with_capacity(count));
        let mut i = 0;
        for place in &places {
            let x = position(place);
            while i + 1 < self.places.len() && position(&self.places[i + 1]) <= x {
                i += 1;
            }
            let since = (x - position(&self.places[i])) * step;
            let [at_y, at_v, at_a] = match self.places.get(i + 1) {
                Some(next) if since > 0.0 => self.between(
                    i,
                    since,
                    (position(next) - position(&self.places[i])) * step,
                ),
                _ => [self.y[i], self.v[i], self.a[i]],
            };
            y.push(at_y);
            v.push(at_v);
            a.push(at_a);
        }
        let excitation = experiment.excitation.as_ref();
        let inputs = (first..first + count).map(|i| channel.input_at_sample(excitation, i));
        let (force, base): (Vec<f64>, Vec<f64>) = inputs.map(|s| (s.force, s.base)).unzip();
        let state = unsmoothed(experiment, scalars, spacing, first..first + count);
        Some(Self {
            places,
            first,
            y,
            v,
            a,
            unsmoothed: state.map(|state| Unsmoothed {
                state,
                force: force.clone(),
                base: base.clone(),
            }),
            force,
            base,
            weight: spacing,
            frequency: self.frequency,
            corner: None,
            filter: Vec::new(),
            smoothing: (self.smoothing)
                .filter(|_| (self.weight / spacing - 1.0).abs() <= SAME_SPACING),
            at_samples: None,
        })
    }

    /// The response for the weak form.
    pub fn in_weak_form(&self) -> &Self {
        self.at_samples.as_deref().unwrap_or(self)
    }

    /// From accelerations alone: response, force and base pass the same filter.
    fn in_band(
        experiment: &Experiment,
        channel: &Channel,
        spacing: f64,
        scalars: &[f64],
    ) -> Option<Self> {
        let (values, _) = unsensed(channel, scalars);
        let band = PassBand::of(&values, spacing)?;
        let excitation = experiment.excitation.as_ref();
        let inputs = (0..channel.len()).map(|i| channel.input_at_sample(excitation, i));
        let (force, base): (Vec<f64>, Vec<f64>) = inputs.map(|s| (s.force, s.base)).unzip();
        let sensed = |part: Vec<f64>| match channel.filter() {
            [] => part,
            filter => zero_phase(filter, &part),
        };
        let (force, base) = (sensed(force), sensed(base));
        let [response, force, base] = band
            .responses(&[&values, &force, &base])?
            .try_into()
            .expect("one for each");
        let skipped = match experiment.is_free() {
            true => 1,
            false => {
                let periods = SETTLING * std::f64::consts::TAU / band.frequency;
                let samples = (periods / spacing).ceil() as usize;
                samples.clamp(1, channel.len() / MOST_LEFT_OUT)
            }
        };
        let kept = |series: Vec<f64>| series[skipped - 1..=series.len() - skipped].to_vec();
        Some(Self {
            places: (channel.places().skip(skipped))
                .take(channel.len() - 2 * skipped)
                .collect(),
            first: skipped,
            y: kept(response.y),
            v: kept(response.v),
            a: kept(response.a),
            force: kept(force.a),
            base: kept(base.a),
            weight: spacing,
            frequency: band.frequency,
            corner: Some(band.corner()),
            unsmoothed: None,
            filter: Vec::new(),
            smoothing: None,
            at_samples: None,
        })
    }

    /// From the nodes with a known response.
    pub fn at_nodes(problem: &Problem, experiment: &Experiment, kinematics: &Kinematics) -> Self {
        let excitation = experiment.excitation.as_ref();
        let parts = [
            excitation.and_then(|e| e.force.as_ref()),
            excitation.and_then(|e| e.base.as_ref()),
        ];
        let [force, base] = parts.map(|part| {
            let nodes = part.map(StageSamples::at_nodes);
            let at = |node: &usize| nodes.as_ref().map_or(0.0, |f| f[*node]);
            kinematics.nodes.iter().map(at).collect::<Vec<f64>>()
        });
        let stride = kinematics.nodes.windows(2).map(|w| w[1] - w[0]).min();
        let place = |node: &usize| TimePoint::node(*node, experiment.nodes);
        Self {
            places: kinematics.nodes.iter().map(place).collect(),
            first: 0,
            y: kinematics.y.clone(),
            v: kinematics.v.clone(),
            a: kinematics.a.clone(),
            force,
            base,
            weight: stride.unwrap_or(1) as f64 * problem.system.grid.step(),
            frequency: rms(&kinematics.v) / rms(&kinematics.y),
            corner: None,
            unsmoothed: None,
            filter: Vec::new(),
            smoothing: None,
            at_samples: None,
        }
    }

    /// Runs of equally spaced times; between them are gaps.
    pub fn runs(&self, step: f64) -> Vec<Range<usize>> {
        let at = |place: &TimePoint| (place.step as f64 + place.fraction) * step;
        let mut runs: Vec<Range<usize>> = Vec::new();
        for i in 0..self.places.len() {
            let is_next = i > 0 && {
                let gap = at(&self.places[i]) - at(&self.places[i - 1]);
                (gap - self.weight).abs() <= SAME_SPACING * self.weight
            };
            match runs.last_mut() {
                Some(run) if is_next => run.end = i + 1,
                _ => runs.push(i..i + 1),
            }
        }
        runs
    }

    /// A series at the times after the filter of the channels.
    pub fn filtered(&self, series: Vec<f64>) -> Vec<f64> {
        match self.filter.as_slice() {
            [] => series,
            filter => zero_phase(filter, &series),
        }
    }

    /// Factor of function `f` at time `i`: `y'' + b''` for the mass, `phi` for a term.
    pub fn response(&self, problem: &Problem, f: usize, i: usize) -> f64 {
        match f {
            0 => self.a[i] + self.base[i],
            term => problem.system.terms[term - 1].phi(self.y[i], self.v[i]),
        }
    }

    /// Residual `m (y'' + b'') + sum_j p_j phi_j(y, y') - f` of the equation of motion at all times, N.
    pub fn errors(&self, problem: &Problem, nodal: &NodalCoefficients) -> Vec<f64> {
        let error = |(i, place): (usize, &TimePoint)| {
            let forces = nodal.functions().enumerate();
            let force =
                |(f, values): (usize, &[f64])| blend(values, *place) * self.response(problem, f, i);
            forces
                .map(force)
                .fold(-self.force[i], |sum, force| sum + force)
        };
        self.places.iter().enumerate().map(error).collect()
    }

    /// Response on `nodes` nodes: cubic between times, extended harmonically with the dominant frequency beyond them.
    pub fn trajectory(&self, grid: &Grid, nodes: usize) -> Trajectory {
        let mut response = Trajectory::zeros(nodes);
        let at = |i: usize| self.places[i].step as f64 + self.places[i].fraction;
        let last = self.places.len() - 1;
        let mut i = 0;
        for node in 0..nodes {
            let x = node as f64;
            while i < last && at(i + 1) <= x {
                i += 1;
            }
            let since = (x - at(i)) * grid.step();
            let (y, v) = match i < last && since > 0.0 {
                true => {
                    let [y, v, _] = self.between(i, since, (at(i + 1) - at(i)) * grid.step());
                    (y, v)
                }
                false => self.swung_on(i, since),
            };
            response.displacement[node] = y;
            response.velocity[node] = v;
        }
        response
    }

    fn swung_on(&self, i: usize, since: f64) -> (f64, f64) {
        let (y, v, w) = (self.y[i], self.v[i], self.frequency);
        let (sine, cosine) = (w * since).sin_cos();
        (y * cosine + v / w * sine, v * cosine - w * y * sine)
    }

    /// Cubic Hermite polynomials through displacement and velocity, and velocity and acceleration.
    /// The acceleration is the derivative of the latter.
    fn between(&self, i: usize, since: f64, span: f64) -> [f64; 3] {
        let x = since / span;
        let cubic = |p: &[f64], d: &[f64]| {
            let (x2, x3) = (x * x, x * x * x);
            (1.0 - 3.0 * x2 + 2.0 * x3) * p[i]
                + span * (x - 2.0 * x2 + x3) * d[i]
                + (3.0 * x2 - 2.0 * x3) * p[i + 1]
                + span * (x3 - x2) * d[i + 1]
        };
        let (v, a) = (&self.v, &self.a);
        let slope = 6.0 * (x - x * x) / span * (v[i + 1] - v[i])
            + (1.0 - 4.0 * x + 3.0 * x * x) * a[i]
            + (3.0 * x * x - 2.0 * x) * a[i + 1];
        [cubic(&self.y, v), cubic(v, a), slope]
    }

    /// Predictions at this state.
    ///
    /// For an acceleration in a band, `y'' = (f - sum_j p_j phi_j)/m - b''` of the band plus the part of the sample that the
    /// filter removed; the residual is then minus the equation error over the mass. Omitted samples at the ends are their own
    /// predictions.
    pub fn predict(&self, problem: &Problem, channel: &Channel, view: SimulatedRecord) -> Vec<f64> {
        if self.corner.is_none() {
            return channel.predict(view);
        }
        let [gain, ..] = channel.sensor().values(view.scalars);
        let mut predicted = channel.observed().to_vec();
        for (i, error) in self.errors(problem, view.nodal).iter().enumerate() {
            predicted[self.first + i] -= gain * error / blend(&view.nodal.mass, self.places[i]);
        }
        predicted
    }
}

impl Unsmoothed {
    /// Differences of the samples of a single displacement at equally spaced nodes, in the groups of the smoothed state.
    fn of_groups(
        problem: &Problem,
        experiment: &Experiment,
        kinematics: &Kinematics,
    ) -> Option<Self> {
        let grouping = kinematics.grouping?;
        let [channel] = experiment.channels.as_slice() else {
            return None;
        };
        let spacing = (grouping.group * grouping.stride) as f64 * problem.system.grid.step();
        let state = fine_differences(&grouping.means(channel.observed()), spacing);
        let excitation = experiment.excitation.as_ref();
        let inputs = (0..channel.len()).map(|i| match excitation {
            Some(excitation) => excitation.input_at(channel.nominal_place(i)),
            None => InputSample::default(),
        });
        let (force, base): (Vec<f64>, Vec<f64>) = inputs.map(|s| (s.force, s.base)).unzip();
        // As the differences, without two groups at each end.
        let inner = |series: &[f64]| {
            let means = grouping.means(series);
            means[2..means.len() - 2].to_vec()
        };
        Some(Self {
            force: inner(&force),
            base: inner(&base),
            state,
        })
    }
}

/// State of some samples, without the first and last two, by differences of a measured displacement and with measured velocities and
/// accelerations in place of differences; of several channels of a kind the first. `None` without a displacement.
fn unsmoothed(
    experiment: &Experiment,
    scalars: &[f64],
    spacing: f64,
    samples: Range<usize>,
) -> Option<Differences> {
    let of = |kind: ChannelKind| {
        let channel = experiment.channels.iter().find(|c| c.kind() == kind)?;
        Some(unsensed(channel, scalars).0)
    };
    let inner = |series: &[f64]| series[samples.clone()].to_vec();
    let outer = samples.start - 2..samples.end + 2;
    let mut state = fine_differences(&of(ChannelKind::Displacement)?[outer.clone()], spacing);
    if let Some(velocity) = of(ChannelKind::Velocity) {
        state.a = fine_differences(&velocity[outer], spacing).v;
        state.v = inner(&velocity);
    }
    if let Some(acceleration) = of(ChannelKind::Acceleration) {
        state.a = inner(&acceleration);
    }
    Some(state)
}

/// True if all channels have equally spaced samples at the same times, and no filter.
fn have_common_times(experiment: &Experiment) -> bool {
    let [first, ..] = experiment.channels.as_slice() else {
        return false;
    };
    let is_alike = |c: &Channel| c.filter().is_empty() && c.times() == first.times();
    experiment.channels.iter().all(is_alike) && equal_spacing(first.times()).is_some()
}

/// The experiment with the samples of its channels before their filter, where all have one filter and equally spaced samples at the
/// same times; `None` without a filter, and where filters or times differ.
fn filtered_alike(experiment: &Experiment) -> Option<Experiment> {
    let [first, ..] = experiment.channels.as_slice() else {
        return None;
    };
    equal_spacing(first.times())?;
    let is_alike = |c: &Channel| c.filter() == first.filter() && c.times() == first.times();
    let before: Option<Vec<Channel>> = match first.filter() {
        [] => None,
        _ => (experiment.channels.iter())
            .map(|c| c.before_filter().filter(|_| is_alike(c)))
            .collect(),
    };
    let channels = before?;
    Some(Experiment {
        channels,
        ..experiment.clone()
    })
}

/// The experiment with outliers of channels with a robust loss replaced by the median of their neighbours. The smoothed state follows
/// from these samples; the residuals of the equation are those of the measured ones.
fn without_outliers(experiment: &Experiment) -> Experiment {
    let of_channel = |channel: &Channel| match channel.loss() {
        Loss::Squares => channel.clone(),
        Loss::Huber { .. } | Loss::StudentT { .. } => {
            channel.clone().with_samples(cleaned(channel.observed()))
        }
    };
    Experiment {
        channels: experiment.channels.iter().map(of_channel).collect(),
        ..experiment.clone()
    }
}

/// Samples with each outlier replaced by the median of itself and its neighbours.
fn cleaned(samples: &[f64]) -> Vec<f64> {
    let medians: Vec<f64> = (0..samples.len())
        .map(|i| {
            let end = (i + NEIGHBOURS + 1).min(samples.len());
            median(&samples[i.saturating_sub(NEIGHBOURS)..end])
        })
        .collect();
    let distances = samples.iter().zip(&medians).map(|(y, m)| (y - m).abs());
    let limit = OUTLYING * MAD_TO_SIGMA * median(&distances.collect::<Vec<f64>>());
    let pairs = samples.iter().zip(&medians);
    pairs
        .map(|(y, m)| if (y - m).abs() > limit { *m } else { *y })
        .collect()
}

/// Value of a function that is linear between nodes.
pub(super) fn blend(values: &[f64], place: TimePoint) -> f64 {
    let [left, right] = [values[place.step], values[place.step + 1]];
    match place.fraction {
        0.0 => left,
        1.0 => right,
        x => left * (1.0 - x) + right * x,
    }
}

/// Spacing of equally spaced times; `None` for other times.
fn equal_spacing(times: &[f64]) -> Option<f64> {
    let steps = times.len().checked_sub(1).filter(|steps| *steps > 0)?;
    let spacing = (times[steps] - times[0]) / steps as f64;
    let in_place = |(i, t): (usize, &f64)| {
        let distance = (t - times[0] - i as f64 * spacing).abs();
        distance <= TimePoint::SAME_TIME * spacing
    };
    times.iter().enumerate().all(in_place).then_some(spacing)
}

/// Responses of all experiments, estimated from their samples.
///
/// For a single channel of equally spaced accelerations the response is integrated in a band around its dominant frequency,
/// and force and base pass the same filter. For other channels a smooth curve through all samples is differentiated.
pub struct Measurements {
    /// One entry per experiment; `None` for an experiment without samples.
    pub(super) experiments: Vec<Option<Measured>>,
}

impl Measurements {
    /// Estimates from the samples of a problem, with scalars at their start.
    ///
    /// # Errors
    /// The first experiment whose samples do not provide a response.
    pub fn of(problem: &Problem) -> Result<Self, UnsupportedRecord> {
        Self::with_scalars(problem, problem.scalars(&problem.start()))
    }

    pub(super) fn with_scalars(
        problem: &Problem,
        scalars: &[f64],
    ) -> Result<Self, UnsupportedRecord> {
        let one = |(index, experiment): (usize, &Experiment)| {
            if experiment.channels.is_empty() {
                return Ok(None);
            }
            let measured = Measured::of(problem, experiment, scalars);
            measured.map(Some).map_err(|reason| UnsupportedRecord {
                experiment: index,
                name: experiment.name.clone(),
                reason,
            })
        };
        let experiments = problem.experiments.iter().enumerate().map(one);
        Ok(Self {
            experiments: experiments.collect::<Result<_, _>>()?,
        })
    }

    /// Notes on lost information: the filter that integrates an acceleration removes slow components, which biases forces not
    /// proportional to the response.
    pub fn remarks(&self, problem: &Problem) -> Vec<String> {
        let terms = problem.system.terms.iter();
        if terms.clone().all(|term| term.is_linear()) {
            return Vec::new();
        }
        let in_bands = problem.experiments.iter().zip(&self.experiments);
        let one = |(experiment, measured): (&Experiment, &Option<Measured>)| {
            let corner = measured.as_ref()?.corner? / std::f64::consts::TAU;
            Some(format!(
                "{}: the acceleration is integrated above {corner:.3} Hz alone, so forces that \
                 are not proportional to the response are biased, and a static force is not \
                 identifiable",
                experiment.name
            ))
        };
        in_bands.filter_map(one).collect()
    }

    /// Weight of a penalty on derivative `order` of function `index` for which the time constant of the smoother is one dominant
    /// period T at the mean amplitude of the response: `mean(phi^2) T^(2 order)`, summed over the experiments with the function.
    /// T is the mean of their periods.
    ///
    /// For fixed other functions, minimising `integral (phi p - g)^2 + weight p'^2 dt` smooths `p` by `exp(-|t|/T)/(2T)`.
    pub fn period_weight(&self, problem: &Problem, index: usize, order: usize) -> f64 {
        let mut squares = 0.0;
        let mut periods = Vec::new();
        for (f, measured) in self.with_function(problem, index) {
            squares += measured.mean_square(problem, f);
            periods.push(std::f64::consts::TAU / measured.frequency);
        }
        let period = periods.iter().sum::<f64>() / periods.len().max(1) as f64;
        squares * period.powi(2 * order as i32)
    }

    /// Largest value at `start` of each function of the list.
    pub(super) fn own_sizes(problem: &Problem, start: &[f64]) -> Vec<f64> {
        let values = problem.functions.values(start);
        let largest = |f: &Vec<f64>| f.iter().fold(0.0f64, |m, p| m.max(p.abs()));
        values.iter().map(largest).collect()
    }

    /// For each function of the list, the larger of its largest value at `start` and of the value whose force equals the inertia
    /// force.
    pub(super) fn sizes(&self, problem: &Problem, start: &[f64]) -> Vec<f64> {
        let sizes = Self::own_sizes(problem, start);
        let own = |index: usize| sizes[index];
        let natural = |index: usize| {
            let [mut inertia, mut response] = [0.0, 0.0];
            for (f, measured) in self.with_function(problem, index) {
                let mass = mass_of(&problem.functions, index).map_or(1.0, own);
                inertia += mass * mass * measured.mean_square(problem, 0);
                response += measured.mean_square(problem, f);
            }
            match response > 0.0 {
                true => f64::sqrt(inertia / response),
                false => 0.0,
            }
        };
        (0..sizes.len())
            .map(|index| own(index).max(natural(index)))
            .collect()
    }

    /// Experiments with function `index` of the list, and its position in their coefficient set.
    fn with_function<'a>(
        &'a self,
        problem: &'a Problem,
        index: usize,
    ) -> impl Iterator<Item = (usize, &'a Measured)> {
        let all = problem.experiments.iter().zip(&self.experiments);
        all.filter_map(move |(experiment, measured)| {
            let assembly = problem
                .functions
                .coefficient_set(experiment.coefficient_set);
            let (place, _) = assembly.parts().find(|(_, f)| *f == index)?;
            Some((place, measured.as_ref()?))
        })
    }
}

/// Mass of the first coefficient set with function `index`.
fn mass_of(functions: &Parameterization, index: usize) -> Option<usize> {
    let mut nodal_sets = functions.coefficient_sets().iter();
    let nodal = nodal_sets.find(|set| set.parts().any(|(_, f)| f == index))?;
    nodal.first().copied()
}

impl Measured {
    /// Mean square of the factor of function `f`.
    fn mean_square(&self, problem: &Problem, f: usize) -> f64 {
        let n = self.places.len();
        let squares = (0..n).map(|i| self.response(problem, f, i).powi(2));
        squares.sum::<f64>() / n.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 0.25;
    const NODES: usize = 24;

    fn grid() -> Grid {
        Grid::new(0.0, STEP * (NODES - 1) as f64, NODES).unwrap()
    }

    /// Measured states at some nodes and between some, of the response `state`: `y`, `y'`, `y''`.
    fn measured(frequency: f64, state: impl Fn(f64) -> [f64; 3]) -> Measured {
        let between = |step| TimePoint {
            step,
            fraction: 0.5,
        };
        let node = |i| TimePoint::node(i, NODES);
        let places = vec![node(3), node(5), between(6), between(9), node(12), node(18)];
        let time = |p: &TimePoint| (p.step as f64 + p.fraction) * STEP;
        let all: Vec<[f64; 3]> = places.iter().map(|p| state(time(p))).collect();
        let part = |j: usize| all.iter().map(|state| state[j]).collect::<Vec<f64>>();
        Measured {
            first: 0,
            y: part(0),
            v: part(1),
            a: part(2),
            force: vec![0.0; all.len()],
            base: vec![0.0; all.len()],
            weight: STEP,
            frequency,
            corner: None,
            unsmoothed: None,
            filter: Vec::new(),
            smoothing: None,
            at_samples: None,
            places,
        }
    }

    /// Largest difference of a response from the displacement and velocity of `state`.
    fn distance(
        response: &Trajectory,
        nodes: impl Iterator<Item = usize>,
        state: impl Fn(f64) -> [f64; 3],
    ) -> f64 {
        let one = |i: usize| {
            let [y, v, _] = state(i as f64 * STEP);
            let [of_y, of_v] = [response.displacement[i] - y, response.velocity[i] - v];
            of_y.abs() + of_v.abs()
        };
        // NaN counts as the largest.
        nodes.map(one).max_by(f64::total_cmp).unwrap()
    }

    /// Cubic polynomials through values and slopes are exact for cubics, at the times and between.
    #[test]
    fn a_cubic_response_is_interpolated_exactly() {
        let cubic = |t: f64| {
            [
                0.3 + t - 2.0 * t * t + 0.7 * t * t * t,
                1.0 - 4.0 * t + 2.1 * t * t,
                4.2 * t - 4.0,
            ]
        };
        let response = measured(1.0, cubic).trajectory(&grid(), NODES);
        let off = distance(&response, 3..=18, cubic);
        assert!(off < 1e-12, "{off}");
    }

    #[test]
    fn a_harmonic_response_is_extended_exactly() {
        let w = 1.7;
        let harmonic = |t: f64| {
            let (sine, cosine) = (w * t + 0.4).sin_cos();
            [2.0 * cosine, -2.0 * w * sine, -2.0 * w * w * cosine]
        };
        let response = measured(w, harmonic).trajectory(&grid(), NODES);
        let off = distance(&response, (0..=3).chain(18..NODES), harmonic);
        assert!(off < 1e-12, "{off}");
    }

    /// Equal spacing is recognised in every unit of time.
    #[test]
    fn equal_spacing_does_not_depend_on_the_unit() {
        for spacing in [1e-6, 1.0, 1e6] {
            let times = |off: f64| -> Vec<f64> {
                let late = |i: usize| if i == 3 { off } else { 0.0 };
                (0..8)
                    .map(|i| spacing * (7.0 + i as f64 + late(i)))
                    .collect()
            };
            let found = equal_spacing(&times(0.1 * TimePoint::SAME_TIME)).expect("equal");
            assert!((found / spacing - 1.0).abs() < 1e-12);
            assert_eq!(equal_spacing(&times(0.1)), None, "{spacing}");
        }
        assert_eq!(equal_spacing(&[1.0]), None);
    }
}
