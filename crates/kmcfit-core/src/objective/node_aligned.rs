//! Predicted accelerations at nodes and their transpose, eight nodes at a time.

use super::SimulatedRecord;
use crate::record::{Channel, ChannelKind};
use crate::simd::{Arithmetic, Eight, Kernel, LANES, Row};
use crate::step::eight;
use crate::step::nodal_observations::{Accelerations, NodalObservations};
use crate::step::{CoefficientGradient, Trajectory};
use crate::system::{Excitation, FUNCTIONS};

impl Channel {
    /// True if sample `i` of every `i` is the acceleration at node `i`.
    pub(super) fn is_acceleration_on_nodes(&self) -> bool {
        self.is_on_every_node() && self.kind() == ChannelKind::Acceleration
    }

    /// Force and acceleration of the base at eight samples from sample `i`; undefined beyond the last sample.
    #[inline(always)]
    fn inputs_at_eight<A: Arithmetic>(
        &self,
        arithmetic: A,
        excitation: Option<&Excitation>,
        i: usize,
    ) -> [Eight<A>; 2] {
        if let Some(inputs) = self.inputs_at_samples() {
            return [0, 1].map(|part| match inputs[part].as_slice() {
                [] => Eight::splat(arithmetic, 0.0),
                values => eight(arithmetic, values, i),
            });
        }
        let mut rows = [[0.0; LANES]; 2];
        if excitation.is_some() {
            let [forces, bases] = &mut rows;
            let lanes = forces.iter_mut().zip(bases).enumerate();
            for (l, (force, base)) in lanes.take(self.len() - i) {
                let input = self.input_at_sample(excitation, i + l);
                (*force, *base) = (input.force, input.base);
            }
        }
        rows.map(|row| Eight::load(arithmetic, &row))
    }

    /// Accelerations at eight nodes from node `i`.
    #[inline(always)]
    pub(super) fn accelerations<A: Arithmetic>(
        &self,
        arithmetic: A,
        view: SimulatedRecord,
        i: usize,
        observed: &mut Accelerations,
    ) {
        let nodes = NodalObservations {
            system: view.system,
            nodal: view.nodal,
            states: view.response,
        };
        let inputs = self.inputs_at_eight(arithmetic, view.excitation, i);
        nodes.accelerations(arithmetic, i, inputs, observed);
    }
}

/// Appends the predicted samples of `channel` to `out`.
pub(super) struct Predict<'a> {
    pub channel: &'a Channel,
    pub view: SimulatedRecord<'a>,
    pub out: &'a mut Vec<f64>,
}

impl Kernel for Predict<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let Self { channel, view, out } = self;
        let [gain, offset, drift] = channel.sensor().values(view.scalars);
        let factor = Eight::splat(arithmetic, gain);
        let mut observed = Accelerations::NOTHING;
        for from in (0..channel.len()).step_by(LANES) {
            let count = LANES.min(channel.len() - from);
            channel.accelerations(arithmetic, view, from, &mut observed);
            let mut value = Eight::load(arithmetic, &observed.value);
            if !channel.base().is_empty() {
                value += eight(arithmetic, channel.base(), from);
            }
            let mut row = (factor * value).row();
            if (offset, drift) != (0.0, 0.0) {
                for (l, value) in row.iter_mut().enumerate().take(count) {
                    *value = *value + offset + drift * channel.elapsed_at(from + l);
                }
            }
            match count {
                LANES => out.extend(row),
                _ => out.extend_from_slice(&row[..count]),
            }
        }
    }
}

/// [`Channel::add_transpose`] for accelerations at nodes, after the filter.
pub(super) struct AddTranspose<'a, 'b> {
    pub channel: &'a Channel,
    pub view: SimulatedRecord<'a>,
    pub slopes: &'a [f64],
    pub source: &'a mut Trajectory,
    pub direct: &'a mut CoefficientGradient<'b>,
    pub scalars: &'a mut [f64],
}

impl Kernel for AddTranspose<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let Self {
            channel,
            view,
            slopes,
            source,
            direct,
            scalars,
        } = self;
        let [gain, ..] = channel.sensor().values(view.scalars);
        let sensor = channel.sensor();
        let seeks = sensor.is_estimated();
        let factor = Eight::splat(arithmetic, gain);
        let mut observed = Accelerations::NOTHING;
        let mut sums = [[0.0; LANES]; FUNCTIONS];
        for (from, slopes) in (0..).step_by(LANES).zip(slopes.chunks(LANES)) {
            channel.accelerations(arithmetic, view, from, &mut observed);
            let mut row = [0.0; LANES];
            row[..slopes.len()].copy_from_slice(slopes);
            let push = factor * Eight::load(arithmetic, &row);
            let [by_y, by_v] = &observed.states;
            let nodes = from..from + slopes.len();
            add_products(
                arithmetic,
                push,
                by_y,
                &mut source.component_mut(0)[nodes.clone()],
            );
            add_products(
                arithmetic,
                push,
                by_v,
                &mut source.component_mut(1)[nodes.clone()],
            );
            match direct {
                CoefficientGradient::AtNodes(nodal) => {
                    for (values, by) in nodal.functions_mut().zip(&observed.functions) {
                        add_products(arithmetic, push, by, &mut values[nodes.clone()]);
                    }
                }
                // Lanes without a sample have zero slope.
                CoefficientGradient::Summed(_) => {
                    for (sums, by) in sums.iter_mut().zip(&observed.functions) {
                        add_products(arithmetic, push, by, sums);
                    }
                }
            }
            if seeks {
                for (l, slope) in slopes.iter().enumerate() {
                    let i = from + l;
                    let value = observed.value[l] + channel.base_at(i);
                    let factors = channel.sensor_factors(view, i, value);
                    sensor.add_gradient(factors, *slope, scalars);
                }
            }
        }
        if let CoefficientGradient::Summed(all) = direct {
            for (sum, lanes) in all.iter_mut().zip(sums) {
                *sum += lanes.iter().sum::<f64>();
            }
        }
    }
}

/// Adds `push * by` to up to eight values.
#[inline(always)]
fn add_products<A: Arithmetic>(arithmetic: A, push: Eight<A>, by: &Row, values: &mut [f64]) {
    let products = push * Eight::load(arithmetic, by);
    match values.first_chunk_mut::<LANES>() {
        Some(row) => *row = (Eight::load(arithmetic, row) + products).row(),
        None => {
            for (value, product) in values.iter_mut().zip(products.row()) {
                *value += product;
            }
        }
    }
}
