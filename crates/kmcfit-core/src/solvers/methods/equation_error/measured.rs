//! States and inputs of records, estimated from the samples without a simulation.

use super::outliers::without_outliers;
use crate::problem::Problem;
use crate::record::{Channel, ChannelKind, Differences, Experiment, Measured, Unsmoothed};
use crate::signal::zero_phase;
use crate::simd::sum::rms;
use crate::solvers::reason::MissingMeasurement;
use crate::solvers::state_estimation::{Kinematics, PassBand, fine_differences, unsensed};
use crate::system::{InputSample, StageSamples, TimePoint};
use std::ops::Range;

/// Dominant periods omitted at either end of a record with known force or base motion: transients of the filter there are as
/// large as the response and decay to a tenth in one period. Without a known input, the unknown input is the larger error.
const SETTLING: f64 = 2.0;
/// Smallest fraction of a record (1 / n) that may be omitted at either end.
const MOST_LEFT_OUT: usize = 4;
/// Difference of two spacings, relative to them, up to which they count as equal: times on a grid have rounding errors, gaps a
/// spacing or more.
pub(super) const SAME_SPACING: f64 = 1e-3;

impl Measured {
    /// Estimates the state from the channels of an experiment, for the sensor parameters `scalars`.
    ///
    /// # Errors
    /// The missing measurement.
    pub(super) fn of(
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
        let ends = [self.positions.first()?, self.positions.last()?].map(position);
        let inner = 2..channel.len().checked_sub(2)?;
        let within = |i: &usize| {
            let x = position(&channel.nominal_position(*i));
            ends[0] <= x && x <= ends[1]
        };
        let first = inner.clone().find(within)?;
        let count = (first..inner.end).take_while(within).count();
        let positions: Vec<TimePoint> = channel.positions().skip(first).take(count).collect();
        let [mut y, mut v, mut a] = [(); 3].map(|()| Vec::with_capacity(count));
        let mut i = 0;
        for place in &positions {
            let x = position(place);
            while i + 1 < self.positions.len() && position(&self.positions[i + 1]) <= x {
                i += 1;
            }
            let since = (x - position(&self.positions[i])) * step;
            let [at_y, at_v, at_a] = match self.positions.get(i + 1) {
                Some(next) if since > 0.0 => self.between(
                    i,
                    since,
                    (position(next) - position(&self.positions[i])) * step,
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
            positions,
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
            positions: (channel.positions().skip(skipped))
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
    pub(super) fn at_nodes(
        problem: &Problem,
        experiment: &Experiment,
        kinematics: &Kinematics,
    ) -> Self {
        let excitation = experiment.excitation.as_ref();
        let parts = [
            excitation.and_then(|e| e.force(0)),
            excitation.and_then(|e| e.frame(0)),
        ];
        let [force, base] = parts.map(|part| {
            let nodes = part.map(StageSamples::at_nodes);
            let at = |node: &usize| nodes.as_ref().map_or(0.0, |f| f[*node]);
            kinematics.nodes.iter().map(at).collect::<Vec<f64>>()
        });
        let stride = kinematics.nodes.windows(2).map(|w| w[1] - w[0]).min();
        let place = |node: &usize| TimePoint::node(*node, experiment.nodes);
        Self {
            positions: kinematics.nodes.iter().map(place).collect(),
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
            Some(excitation) => excitation.input_at(channel.nominal_position(i)),
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

#[cfg(test)]
mod tests {
    use super::*;

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
