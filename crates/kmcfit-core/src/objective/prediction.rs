//! Predicted samples of a channel, their tangent and its transpose.

use super::node_aligned::{AddTranspose, Predict};
use super::{RecordTangent, SimulatedRecord};
use crate::record::{Channel, ChannelKind, Sensor};
use crate::signal::{zero_phase, zero_phase_transpose};
use crate::simd;
use crate::simulate::reference::{Observation, observe};
use crate::simulate::{CoefficientGradient, Trajectory};
use crate::system::TimePoint;

impl Channel {
    /// Observation at sample `i` with its derivatives, before gain, offset and drift.
    pub fn sensed(&self, view: SimulatedRecord, i: usize) -> Observation {
        let mut sensed = observe(
            view.system,
            self.kind(),
            view.nodal,
            view.excitation,
            view.response,
            self.places()[i],
            self.input_at_sample(view.excitation, i),
        );
        if let Some(base) = self.base().get(i) {
            sensed.value += base;
        }
        sensed
    }

    /// Value of [`Channel::sensed`].
    fn observed_value(&self, view: SimulatedRecord, i: usize) -> f64 {
        match (
            self.kind(),
            self.places()[i].as_node(),
            self.base().is_empty(),
        ) {
            (ChannelKind::Displacement, Some(node), true) => view.response.displacement[node],
            _ => self.sensed(view, i).value,
        }
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
        if self.is_on_every_node() && self.is_plain() {
            out.extend_from_slice(&view.response.displacement[..self.len()]);
            return;
        }
        if self.is_acceleration_on_nodes() {
            let channel = self;
            out.reserve_exact(self.len());
            simd::run(Predict { channel, view, out });
        } else if self.sensor() == Sensor::default() {
            out.extend((0..self.len()).map(|i| self.observed_value(view, i)));
        } else {
            let [gain, offset, drift] = self.sensor().values(view.scalars);
            let model =
                |i: usize| gain * self.observed_value(view, i) + offset + drift * self.age(i);
            out.extend((0..self.len()).map(model));
        }
        if !self.filter().is_empty() {
            *out = zero_phase(self.filter(), out);
        }
    }

    /// Directional derivative of [`Channel::predict`].
    pub fn predict_tangent(&self, view: SimulatedRecord, along: RecordTangent) -> Vec<f64> {
        let [gain, ..] = self.sensor().values(view.scalars);
        let [by_gain, by_offset, by_drift] = self.sensor().changes(along.scalars);
        let model = |i: usize| {
            let sensed = self.sensed(view, i);
            let TimePoint { step, .. } = self.places()[i];
            let mut change = gain * answer(&sensed, step, along);
            if by_gain != 0.0 {
                change += by_gain * sensed.value;
            }
            change + by_offset + by_drift * self.age(i)
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
        if self.is_on_every_node() && self.is_plain() {
            let pairs = source.displacement.iter_mut().zip(slopes);
            pairs.for_each(|(source, slope)| *source += slope);
            return;
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
        let indices = self.sensor().indices();
        let simple = self.kind() == ChannelKind::Displacement && indices == [None; 3];
        for (i, slope) in slopes.iter().enumerate() {
            let place = self.places()[i];
            if let (true, Some(node)) = (simple, place.as_node()) {
                source.displacement[node] += gain * slope;
                continue;
            }
            let sensed = self.sensed(view, i);
            spread(&sensed, place.step, gain * slope, source, direct);
            let factors = [sensed.value, 1.0, self.age(i)];
            self.sensor().add_gradient(factors, *slope, scalars);
        }
    }

    /// True if the predictions depend on the functions also at fixed states, as accelerations do.
    pub fn sees_functions(&self) -> bool {
        match self.kind() {
            ChannelKind::Displacement => false,
            ChannelKind::Velocity => self.places().iter().any(|p| p.as_node().is_none()),
            ChannelKind::Acceleration => true,
        }
    }
}

/// Directional derivative of an observation.
fn answer(sensed: &Observation, step: usize, along: RecordTangent) -> f64 {
    let (y, v) = (&along.response.displacement, &along.response.velocity);
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
        source.displacement[step + side] += slope * sensed.states[2 * side];
        source.velocity[step + side] += slope * sensed.states[2 * side + 1];
    }
    for f in 0..direct.functions() {
        for side in 0..2 {
            direct.add(f, step + side, slope * sensed.functions[side][f]);
        }
    }
}
