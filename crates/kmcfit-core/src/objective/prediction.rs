//! Predicted samples of a channel, their tangent and its transpose.

use super::node_aligned::{AddTranspose, Predict};
use super::row_prediction::RowSamples;
use super::{RecordTangent, SimulatedRecord};
use crate::record::{Channel, ChannelKind, Sensor};
use crate::signal::{zero_phase, zero_phase_transpose};
use crate::simd;
use crate::step::{CoefficientGradient, Trajectory};
use crate::step::{Observation, observe, observe_value};
use crate::system::{InputSample, TimePoint};

/// Share of a step by which a sample is moved for its derivative in time.
const FRACTION: f64 = 1e-4;

impl Channel {
    /// Position of sample `i` on the grid, that of `t_i - delay`; the first or last node where that is before or after the response.
    pub(crate) fn position(&self, view: SimulatedRecord, i: usize) -> TimePoint {
        match self.sensor().is_delayed() {
            false => self.nominal_position(i),
            true => self.delayed_position(view, i).0,
        }
    }

    /// [`Channel::position`] of a delayed sample, and true if it lies within the response.
    fn delayed_position(&self, view: SimulatedRecord, i: usize) -> (TimePoint, bool) {
        let (grid, nodes) = (&view.system.grid, view.response.nodes());
        let end = grid.time(nodes - 1);
        let time = self.times()[i] - self.sensor().total_delay(view.scalars);
        let inside = (grid.start()..=end).contains(&time);
        let position = TimePoint::of(grid, time.clamp(grid.start(), end));
        let position = position.unwrap_or(self.nominal_position(i));
        let position = match position.as_node() {
            Some(node) => TimePoint::node(node, nodes),
            None => position,
        };
        (position, inside)
    }

    /// Observation at sample `i` with its derivatives, before gain, offset and drift.
    pub fn sensed(&self, view: SimulatedRecord, i: usize) -> Observation {
        self.sensed_at(view, i, self.position(view, i))
    }

    fn sensed_at(&self, view: SimulatedRecord, i: usize, position: TimePoint) -> Observation {
        let (input, base) = self.inputs_at(view, i, position);
        let mut sensed = observe(
            view.system,
            self.kind(),
            view.nodal,
            view.excitation,
            view.response,
            position,
            input,
        );
        sensed.value += base;
        sensed
    }

    /// Value of [`Channel::sensed_at`].
    fn value_at(&self, view: SimulatedRecord, i: usize, position: TimePoint) -> f64 {
        let (input, base) = self.inputs_at(view, i, position);
        base + observe_value(
            view.system,
            self.kind(),
            view.nodal,
            view.excitation,
            view.response,
            position,
            input,
        )
    }

    /// Input at sample `i`, and the motion of the base in its value.
    fn inputs_at(
        &self,
        view: SimulatedRecord,
        i: usize,
        position: TimePoint,
    ) -> (InputSample, f64) {
        let is_delayed = self.sensor().is_delayed();
        let input = match (is_delayed, view.excitation) {
            (false, excitation) => self.input_at_sample(excitation, i),
            (true, Some(excitation)) => excitation.input_at(position),
            (true, None) => InputSample::default(),
        };
        let moves = is_delayed && self.kind() == ChannelKind::Acceleration;
        let base = match self.base().get(i) {
            Some(_) if moves => input.base,
            Some(base) => *base,
            None => 0.0,
        };
        (input, base)
    }

    /// Time derivative of sample `i` before gain, offset and drift, in its unit per s; zero outside the response.
    ///
    /// Central difference of the interpolation within the step, a polynomial for displacement and velocity: its error is of the order
    /// `FRACTION^2` of the third derivative.
    fn sensed_rate(
        &self,
        view: SimulatedRecord,
        i: usize,
        mut value_at: impl FnMut(TimePoint) -> f64,
    ) -> f64 {
        let (position, inside) = self.delayed_position(view, i);
        if !inside {
            return 0.0;
        }
        let mut at = |by: f64| {
            let fraction = position.fraction + by;
            value_at(TimePoint {
                fraction,
                ..position
            })
        };
        (at(FRACTION) - at(-FRACTION)) / (2.0 * FRACTION * view.system.grid.step())
    }

    /// Derivatives of sample `i` in the parameters of its sensor, in the order of [`Sensor::indices`]; `value` is that of
    /// [`Channel::sensed`].
    pub(crate) fn sensor_factors(
        &self,
        view: SimulatedRecord,
        i: usize,
        value: f64,
    ) -> [f64; Sensor::PARAMETERS] {
        self.factors(view, i, value, |position| self.value_at(view, i, position))
    }

    /// [`Channel::sensor_factors`] with the value of sample `i` at any place.
    pub(super) fn factors(
        &self,
        view: SimulatedRecord,
        i: usize,
        value: f64,
        value_at: impl FnMut(TimePoint) -> f64,
    ) -> [f64; Sensor::PARAMETERS] {
        let [gain, ..] = self.sensor().values(view.scalars);
        let [.., delay, input_delay] = self.sensor().indices();
        let rate = match delay.or(input_delay) {
            Some(_) => gain * self.sensed_rate(view, i, value_at),
            None => 0.0,
        };
        [value, 1.0, self.elapsed_at(i), -rate, rate]
    }

    /// Value of [`Channel::sensed`].
    pub(crate) fn observed_value(&self, view: SimulatedRecord, i: usize) -> f64 {
        match (
            self.kind(),
            self.position(view, i).as_node(),
            self.base().is_empty(),
        ) {
            (ChannelKind::Displacement, Some(node), true) => view.response.displacement(0)[node],
            _ => self.value_at(view, i, self.position(view, i)),
        }
    }

    /// The coordinate whose displacements at all nodes the predicted samples are, if they are.
    fn displacement_of_nodes(&self) -> Option<usize> {
        let is_plain = self.is_on_every_node() && self.is_plain();
        is_plain.then(|| self.coordinate()).flatten()
    }

    /// Predicted samples.
    pub fn predict(&self, view: SimulatedRecord) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.len());
        self.predict_into(view, &mut out);
        out
    }

    /// [`Channel::predict`] into existing storage.
    pub fn predict_into(&self, view: SimulatedRecord, out: &mut Vec<f64>) {
        out.clear();
        if let Some(j) = self.displacement_of_nodes() {
            out.extend_from_slice(&view.response.displacement(j)[..self.len()]);
            return;
        }
        if !view.system.structure.is_one() {
            RowSamples::new(self, view).predict_into(out);
        } else if self.is_acceleration_on_nodes() {
            let channel = self;
            out.reserve_exact(self.len());
            simd::run(Predict { channel, view, out });
        } else if self.sensor() == Sensor::default() {
            out.extend((0..self.len()).map(|i| self.observed_value(view, i)));
        } else {
            let [gain, offset, drift] = self.sensor().values(view.scalars);
            let model = |i: usize| {
                gain * self.observed_value(view, i) + offset + drift * self.elapsed_at(i)
            };
            out.extend((0..self.len()).map(model));
        }
        if !self.filter().is_empty() {
            *out = zero_phase(self.filter(), out);
        }
    }

    /// Directional derivative of [`Channel::predict`].
    pub fn predict_tangent(&self, view: SimulatedRecord, along: RecordTangent) -> Vec<f64> {
        if !view.system.structure.is_one() {
            return self.row_tangents(view, &[along]).remove(0);
        }
        let [gain, ..] = self.sensor().values(view.scalars);
        let model = |i: usize| {
            let sensed = self.sensed(view, i);
            let TimePoint { step, .. } = self.position(view, i);
            let factors = self.sensor_factors(view, i, sensed.value);
            gain * answer(&sensed, step, along) + self.sensor().change(factors, along.scalars)
        };
        let out: Vec<f64> = (0..self.len()).map(model).collect();
        match self.filter().is_empty() {
            true => out,
            false => zero_phase(self.filter(), &out),
        }
    }

    /// Transpose of [`Channel::predict_tangent`]. Given derivatives of a cost with respect to the predictions, adds those with
    /// respect to the states to `source`, to the functions at fixed states to `direct`, and to the scalars to `scalars`.
    pub fn add_transpose(
        &self,
        view: SimulatedRecord,
        slopes: &[f64],
        source: &mut Trajectory,
        direct: &mut CoefficientGradient,
        scalars: &mut [f64],
    ) {
        let filtered;
        let slopes = match self.filter().is_empty() {
            true => slopes,
            false => {
                filtered = zero_phase_transpose(self.filter(), slopes);
                &filtered
            }
        };
        if let Some(j) = self.displacement_of_nodes() {
            let pairs = source.component_mut(j).iter_mut().zip(slopes);
            pairs.for_each(|(source, slope)| *source += slope);
            return;
        }
        if !view.system.structure.is_one() {
            return RowSamples::new(self, view).add_transpose(slopes, source, direct, scalars);
        }
        if self.is_acceleration_on_nodes() {
            return simd::run(AddTranspose {
                channel: self,
                view,
                slopes,
                source,
                direct,
                scalars,
            });
        }
        let [gain, ..] = self.sensor().values(view.scalars);
        let simple = self.kind() == ChannelKind::Displacement && !self.sensor().is_estimated();
        for (i, slope) in slopes.iter().enumerate() {
            let position = self.position(view, i);
            if let (true, Some(node)) = (simple, position.as_node()) {
                source.component_mut(0)[node] += gain * slope;
                continue;
            }
            let sensed = self.sensed(view, i);
            spread(&sensed, position.step, gain * slope, source, direct);
            let factors = self.sensor_factors(view, i, sensed.value);
            self.sensor().add_gradient(factors, *slope, scalars);
        }
    }
}

/// Directional derivative of an observation.
fn answer(sensed: &Observation, step: usize, along: RecordTangent) -> f64 {
    let (y, v) = (along.response.displacement(0), along.response.velocity(0));
    let by_states = sensed.states[0] * y[step]
        + sensed.states[1] * v[step]
        + sensed.states[2] * y[step + 1]
        + sensed.states[3] * v[step + 1];
    let mut change = by_states;
    for (f, values) in along.nodal.functions().enumerate() {
        for side in 0..2 {
            let slope = sensed.functions[side][f];
            if slope != 0.0 {
                change += slope * values[step + side];
            }
        }
    }
    change
}

/// Transpose of [`answer`].
fn spread(
    sensed: &Observation,
    step: usize,
    slope: f64,
    source: &mut Trajectory,
    direct: &mut CoefficientGradient,
) {
    for side in 0..2 {
        source.component_mut(0)[step + side] += slope * sensed.states[2 * side];
        source.component_mut(1)[step + side] += slope * sensed.states[2 * side + 1];
    }
    for f in 0..direct.functions() {
        for side in 0..2 {
            direct.add(f, step + side, slope * sensed.functions[side][f]);
        }
    }
}
