//! Predicted samples of a channel of a structure, their tangent and its transpose.

use super::{RecordTangent, SimulatedRecord};
use crate::record::{Channel, ChannelKind, Sensor};
use crate::signal::zero_phase;
use crate::step::{CoefficientGradient, RowObservation, RowObserver, Trajectory};
use crate::system::{InputQuantity, TimePoint};

/// The samples of a channel, observed in the response of a structure.
pub(crate) struct RowSamples<'a> {
    channel: &'a Channel,
    view: SimulatedRecord<'a>,
    observer: RowObserver<'a>,
}

impl<'a> RowSamples<'a> {
    pub fn new(channel: &'a Channel, view: SimulatedRecord<'a>) -> Self {
        let observer = RowObserver::new(view.driven(), view.response);
        Self {
            channel,
            view,
            observer,
        }
    }

    /// Motion of the base that a sensor of absolute motion adds to sample `i`, at `position`.
    fn base(&self, i: usize, position: TimePoint) -> f64 {
        let channel = self.channel;
        let is_moved = channel.sensor().is_delayed() && channel.kind() == ChannelKind::Acceleration;
        match (channel.base().get(i), self.view.excitation) {
            (Some(_), Some(excitation)) if is_moved => {
                let entries = channel.row().entries().iter();
                let of =
                    |(j, factor): &(usize, f64)| Some(factor * excitation.frame(*j)?.at(position));
                entries.filter_map(of).sum()
            }
            (base, _) => base.copied().unwrap_or(0.0),
        }
    }

    fn value_at(&mut self, i: usize, position: TimePoint) -> f64 {
        let channel = self.channel;
        self.base(i, position) + self.observer.value(channel.kind(), channel.row(), position)
    }

    /// Value at sample `i`, before gain, offset and drift.
    pub fn value(&mut self, i: usize) -> f64 {
        self.value_at(i, self.channel.position(self.view, i))
    }

    /// [`RowSamples::value`] with its derivatives; the value is without the motion of the base.
    pub fn observe(&mut self, i: usize) -> &RowObservation {
        let position = self.channel.position(self.view, i);
        (self.observer).observe(self.channel.kind(), self.channel.row(), position)
    }

    /// Derivative of sample `i`, an acceleration, by an input at its time that acts on some coordinates.
    pub fn by_input(&mut self, i: usize, quantity: InputQuantity, acting: &[usize]) -> f64 {
        let (channel, position) = (self.channel, self.channel.position(self.view, i));
        let [forces, frames] = (self.observer).acceleration_by_inputs(channel.row(), position);
        let is_absolute = !channel.base().is_empty();
        let of_frame = |j: &usize| {
            let entries = channel.row().entries().iter();
            let own: f64 = entries
                .filter(|(k, _)| k == j)
                .map(|(_, factor)| factor)
                .sum();
            frames[*j] + if is_absolute { own } else { 0.0 }
        };
        match quantity {
            InputQuantity::Force => acting.iter().map(|j| forces[*j]).sum(),
            InputQuantity::BaseAcceleration => acting.iter().map(of_frame).sum(),
        }
    }

    /// Derivatives of sample `i` in the parameters of its sensor ([`Channel::sensor_factors`]).
    pub fn sensor_factors(&mut self, i: usize) -> [f64; Sensor::PARAMETERS] {
        let (channel, view) = (self.channel, self.view);
        let value = self.value(i);
        channel.factors(view, i, value, |position| self.value_at(i, position))
    }

    pub fn predict_into(&mut self, out: &mut Vec<f64>) {
        let channel = self.channel;
        let [gain, offset, drift] = channel.sensor().values(self.view.scalars);
        let model = |i: usize| gain * self.value(i) + offset + drift * channel.elapsed_at(i);
        out.extend((0..channel.len()).map(model));
    }

    /// [`Channel::predict_tangent`] along several changes, before the filter.
    pub fn predict_tangents(&mut self, along: &[RecordTangent]) -> Vec<Vec<f64>> {
        let (channel, scalars) = (self.channel, self.view.scalars);
        let [gain, ..] = channel.sensor().values(scalars);
        let mut out = vec![Vec::with_capacity(channel.len()); along.len()];
        for i in 0..channel.len() {
            let TimePoint { step, .. } = channel.position(self.view, i);
            let factors = channel
                .sensor()
                .is_estimated()
                .then(|| self.sensor_factors(i));
            let sensed = self.observe(i);
            for (out, along) in out.iter_mut().zip(along) {
                let by_sensor = factors.map_or(0.0, |f| channel.sensor().change(f, along.scalars));
                out.push(gain * change(sensed, step, *along) + by_sensor);
            }
        }
        out
    }

    /// [`Channel::add_transpose`] after the filter.
    pub fn add_transpose(
        &mut self,
        slopes: &[f64],
        source: &mut Trajectory,
        direct: &mut CoefficientGradient,
        scalars: &mut [f64],
    ) {
        let channel = self.channel;
        let [gain, ..] = channel.sensor().values(self.view.scalars);
        for (i, slope) in slopes.iter().enumerate() {
            let TimePoint { step, .. } = channel.position(self.view, i);
            if channel.sensor().is_estimated() {
                let factors = self.sensor_factors(i);
                channel.sensor().add_gradient(factors, *slope, scalars);
            }
            let sensed = self.observe(i);
            for side in 0..2 {
                for (c, by) in sensed.states[side].iter().enumerate() {
                    source.component_mut(c)[step + side] += gain * slope * by;
                }
                for (f, by) in sensed.functions[side].iter().enumerate() {
                    direct.add(f, step + side, gain * slope * by);
                }
            }
        }
    }
}

/// Directional derivative of an observation.
fn change(sensed: &RowObservation, step: usize, along: RecordTangent) -> f64 {
    let mut sum = 0.0;
    for side in 0..2 {
        for (c, by) in sensed.states[side].iter().enumerate() {
            sum += by * along.response.component(c)[step + side];
        }
        for (values, by) in along.nodal.functions().zip(&sensed.functions[side]) {
            sum += by * values[step + side];
        }
    }
    sum
}

impl Channel {
    /// [`Channel::predict_tangent`] along several changes of the response of a structure.
    pub(super) fn row_tangents(
        &self,
        view: SimulatedRecord,
        along: &[RecordTangent],
    ) -> Vec<Vec<f64>> {
        let all = RowSamples::new(self, view).predict_tangents(along);
        match self.filter().is_empty() {
            true => all,
            false => all
                .iter()
                .map(|out| zero_phase(self.filter(), out))
                .collect(),
        }
    }
}
