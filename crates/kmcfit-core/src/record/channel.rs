//! One channel of a record: the samples of one sensor.

use super::sample_positions::SamplePositions;
use super::{ChannelKind, Loss, NoiseEstimate, NoiseModel, Sensor, Weighting};
use crate::signal::{SecondOrder, zero_phase};
use crate::structure::{Ends, Structure};
use crate::system::{Excitation, Grid, InputQuantity, InputSample, TimePoint};
use std::ops::Range;
use std::sync::Arc;

/// The samples of one sensor.
///
/// The model of sample `i` is `gain * (h_i + b_i) + offset + drift * (t_i - t_0)`. Here `h_i` is a combination of displacements,
/// velocities or accelerations of the response ([`observe`](crate::step::observe())) at `t_i - delay`, `b_i` the same of the base for
/// a sensor of absolute motion, and `t_0` the time of the first sample. A filter, if any, is applied to model and samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    kind: ChannelKind,
    /// Combination of coordinates that is observed.
    row: Ends,
    // Shared by copies: problems are copied often.
    times: Arc<Vec<f64>>,
    /// Time from which a drift counts, s.
    origin: f64,
    positions: SamplePositions,
    observed: Arc<Vec<f64>>,
    /// Samples before the filter; empty without a filter.
    unfiltered: Arc<Vec<f64>>,
    weighting: Weighting,
    loss: Loss,
    pub(super) noise_model: NoiseModel,
    pub(super) noise: NoiseEstimate,
    sensor: Sensor,
    /// Forces (N) and base accelerations (m/s^2) at the samples, if given; empty if zero.
    inputs_at_samples: Option<[Arc<Vec<f64>>; 2]>,
    /// Added to the response; empty if zero.
    base: Arc<Vec<f64>>,
    filter: Vec<SecondOrder>,
    /// Quantisation step of the samples, in the SI unit of the kind; 0 where unknown.
    resolution: f64,
}

impl Channel {
    /// A channel of samples `values` (in the SI unit of `kind`) at `times` (s, increasing), for a response over the first `nodes` nodes
    /// of `grid`; `None` unless there is at least one sample, one time for each, and all times are within the response.
    pub fn new(
        kind: ChannelKind,
        times: Vec<f64>,
        values: Vec<f64>,
        weighting: Weighting,
        grid: &Grid,
        nodes: usize,
    ) -> Option<Self> {
        let (times, values) = (Arc::new(times), Arc::new(values));
        Self::of_shared(kind, times, values, weighting, grid, nodes)
    }

    /// [`Channel::new`] of shared samples.
    pub(crate) fn of_shared(
        kind: ChannelKind,
        times: Arc<Vec<f64>>,
        values: Arc<Vec<f64>>,
        weighting: Weighting,
        grid: &Grid,
        nodes: usize,
    ) -> Option<Self> {
        let fits = times.len() == values.len() && !values.is_empty();
        let positions = SamplePositions::of(&times, grid, nodes)?;
        fits.then(|| Self {
            kind,
            row: Ends::ground(0),
            positions,
            origin: times[0],
            times,
            observed: values,
            unfiltered: Arc::default(),
            weighting,
            loss: Loss::Squares,
            noise_model: NoiseModel::default(),
            noise: NoiseEstimate::default(),
            sensor: Sensor::default(),
            inputs_at_samples: None,
            base: Arc::default(),
            filter: Vec::new(),
            resolution: 0.0,
        })
    }

    /// A channel of displacements `values` (m) at the nodes `0, stride, 2 stride, ...` of `grid`.
    ///
    /// # Panics
    /// If `stride` is zero, there are no values, or they do not fit on the grid.
    pub fn displacement_at_nodes(
        values: Vec<f64>,
        stride: usize,
        weighting: Weighting,
        grid: &Grid,
    ) -> Self {
        let times = (0..values.len()).map(|i| grid.time(i * stride)).collect();
        let kind = ChannelKind::Displacement;
        let channel = Self::new(kind, times, values, weighting, grid, grid.nodes());
        let channel = channel.expect("samples on the nodes of the grid");
        assert!(stride > 0, "samples advance");
        channel
    }

    /// Sets the combination of coordinates and supports that is observed; the first coordinate unless set.
    #[must_use]
    pub fn observing(mut self, row: Ends) -> Self {
        self.row = row;
        self
    }

    /// The combination of coordinates and supports that is observed.
    pub fn row(&self) -> &Ends {
        &self.row
    }

    /// The coordinate that is observed, where it is a single one.
    pub(crate) fn coordinate(&self) -> Option<usize> {
        match self.row.entries() {
            [(j, 1.0)] => Some(*j),
            _ => None,
        }
    }

    /// True if its row has only coordinates and supports of a structure.
    pub(crate) fn observes(&self, structure: &Structure) -> bool {
        let count = structure.coordinates() + structure.supports();
        let mut entries = self.row.entries().iter();
        entries.all(|(j, _)| *j < count)
    }

    /// Sets the loss; a robust loss needs samples with a sigma.
    ///
    /// # Panics
    /// If the loss is robust and the samples have no sigma.
    #[must_use]
    pub fn with_loss(mut self, loss: Loss) -> Self {
        assert!(
            loss == Loss::Squares || self.weighting.is_sigma(),
            "a robust loss needs a sigma"
        );
        self.loss = loss;
        self
    }

    /// Sets gain, offset, drift and delay.
    #[must_use]
    pub fn with_sensor(mut self, sensor: Sensor) -> Self {
        self.sensor = sensor;
        self
    }

    /// Sets the quantisation step `q` of the samples (SI unit of the kind): an estimated sigma is then at least `q / sqrt(12)`.
    #[must_use]
    pub fn with_resolution(mut self, resolution: f64) -> Self {
        self.resolution = resolution;
        self
    }

    /// Quantisation step of the samples, in the SI unit of the kind; 0 where unknown.
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// Sets force (N) and base acceleration (m/s^2) at the samples, on which accelerations depend; otherwise both are linear over
    /// each step.
    ///
    /// # Panics
    /// If there is not one for each sample.
    #[must_use]
    pub fn with_inputs_at_samples(self, inputs: Vec<InputSample>) -> Self {
        assert_eq!(inputs.len(), self.times.len(), "one for each sample");
        let forces = inputs.iter().map(|input| input.force).collect();
        let bases = inputs.iter().map(|input| input.base).collect();
        self.with_shared_inputs([Arc::new(forces), Arc::new(bases)])
    }

    /// [`Channel::with_inputs_at_samples`] of shared forces and base accelerations, which may be empty where they are zero.
    #[must_use]
    pub(crate) fn with_shared_inputs(mut self, inputs: [Arc<Vec<f64>>; 2]) -> Self {
        self.inputs_at_samples = Some(inputs.map(|part| match part.iter().all(|x| *x == 0.0) {
            true => Arc::default(),
            false => part,
        }));
        self
    }

    /// Adds the motion of the base (of the channel's kind) to the relative one, for a sensor of absolute motion.
    ///
    /// # Panics
    /// If there is not one for each sample.
    #[must_use]
    pub fn with_base(mut self, base: Vec<f64>) -> Self {
        assert_eq!(base.len(), self.times.len(), "one for each sample");
        self.base = Arc::new(base);
        self
    }

    /// Sets a zero-phase filter for samples and model, and filters the samples.
    #[must_use]
    pub fn with_filter(mut self, filter: Vec<SecondOrder>) -> Self {
        if self.unfiltered.is_empty() {
            self.unfiltered = std::mem::take(&mut self.observed);
        }
        self.filter = filter;
        self.filter_samples();
        self
    }

    /// The channel without its filter and with the samples as they were before it; the channel itself without a filter. `None` where
    /// these samples are unknown.
    pub(crate) fn before_filter(&self) -> Option<Self> {
        if self.filter.is_empty() {
            return Some(self.clone());
        }
        (!self.unfiltered.is_empty()).then(|| Self {
            observed: Arc::clone(&self.unfiltered),
            unfiltered: Arc::default(),
            filter: Vec::new(),
            ..self.clone()
        })
    }

    /// The channel with other samples, which are not filtered.
    ///
    /// # Panics
    /// If there is not one in place of each.
    #[must_use]
    pub fn with_samples(mut self, samples: Vec<f64>) -> Self {
        assert_eq!(samples.len(), self.len(), "one in place of each");
        self.observed = Arc::new(samples);
        self.unfiltered = Arc::default();
        self
    }

    /// The channel with changes of the input at its samples (N, or m/s^2), and of the response that is compared with its samples:
    /// `changes` are subtracted from the response in the unit of the kind.
    ///
    /// # Panics
    /// If there is not one of each for every sample.
    #[must_use]
    pub fn with_input_change(
        mut self,
        quantity: InputQuantity,
        inputs: &[f64],
        changes: &[f64],
    ) -> Self {
        assert_eq!(inputs.len(), self.len(), "one for each sample");
        assert_eq!(changes.len(), self.len(), "one for each sample");
        if let Some(parts) = &mut self.inputs_at_samples {
            let part = &mut parts[usize::from(quantity == InputQuantity::BaseAcceleration)];
            let part = Arc::make_mut(part);
            part.resize(self.observed.len(), 0.0);
            part.iter_mut().zip(inputs).for_each(|(a, b)| *a += b);
        }
        let base = Arc::make_mut(&mut self.base);
        base.resize(self.observed.len(), 0.0);
        let pairs = base.iter_mut().zip(changes);
        pairs.for_each(|(base, change)| *base -= change);
        self
    }

    fn filter_samples(&mut self) {
        if !self.unfiltered.is_empty() {
            self.observed = Arc::new(zero_phase(&self.filter, &self.unfiltered));
        }
    }

    /// Replaces the weighting.
    #[must_use]
    pub fn with_weighting(mut self, weighting: Weighting) -> Self {
        self.weighting = weighting;
        self
    }

    /// The first `count` samples, at least one, filtered without the later ones.
    #[must_use]
    pub fn first(&self, count: usize) -> Self {
        let count = count.max(1);
        let short = |list: &[f64]| list[..count.min(list.len())].to_vec();
        let mut weighting = self.weighting.clone();
        weighting.truncate(count);
        let mut noise = self.noise.clone();
        noise.correlation = noise.correlation.map(|c| c.first(count));
        let mut part = Self {
            noise_model: self.noise_model,
            noise,
            kind: self.kind,
            row: self.row.clone(),
            times: Arc::new(short(&self.times)),
            origin: self.origin,
            positions: self.positions.first(count),
            observed: Arc::new(short(&self.observed)),
            unfiltered: Arc::new(short(&self.unfiltered)),
            weighting,
            loss: self.loss,
            sensor: self.sensor,
            inputs_at_samples: (self.inputs_at_samples.as_ref())
                .map(|parts| parts.each_ref().map(|p| Arc::new(short(p)))),
            base: Arc::new(short(&self.base)),
            filter: self.filter.clone(),
            resolution: self.resolution,
        };
        part.filter_samples();
        part
    }

    /// Samples within the first `steps` steps, if any; a sample at their last node belongs to the next step.
    pub(crate) fn within(&self, steps: usize) -> Option<Self> {
        let count = self.count_within(steps);
        (count > 0).then(|| self.first(count))
    }

    /// Number of samples of [`Channel::within`].
    pub(crate) fn count_within(&self, steps: usize) -> usize {
        self.positions.count_within(steps)
    }

    /// The samples `samples` before the filter, for a response over the first `nodes` nodes of another grid; `None` if one does not lie
    /// on it.
    pub(crate) fn part(&self, samples: Range<usize>, grid: &Grid, nodes: usize) -> Option<Self> {
        let positions = SamplePositions::of(&self.times[samples.clone()], grid, nodes)?;
        let cut = |list: &Arc<Vec<f64>>| match list.len() == samples.len() || list.is_empty() {
            true => Arc::clone(list),
            false => Arc::new(list[samples.clone()].to_vec()),
        };
        let inputs = self.inputs_at_samples.as_ref();
        Some(Self {
            positions,
            times: cut(&self.times),
            observed: cut(&self.observed),
            base: cut(&self.base),
            inputs_at_samples: inputs.map(|inputs| inputs.each_ref().map(cut)),
            unfiltered: Arc::default(),
            filter: Vec::new(),
            ..self.clone()
        })
    }

    /// Measured quantity.
    pub fn kind(&self) -> ChannelKind {
        self.kind
    }

    /// Times of the samples, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Positions of the times of the samples on the grid, without a delay.
    pub fn positions(&self) -> impl ExactSizeIterator<Item = TimePoint> + Clone + '_ {
        self.positions.iter()
    }

    /// Position of the time of sample `i` on the grid, without a delay.
    #[inline(always)]
    pub fn nominal_position(&self, i: usize) -> TimePoint {
        self.positions.get(i)
    }

    /// Samples, filtered if the channel has a filter, in the SI unit of the kind.
    pub fn observed(&self) -> &[f64] {
        &self.observed
    }

    /// Number of samples; at least one.
    pub fn len(&self) -> usize {
        self.observed.len()
    }

    /// False: a channel has at least one sample.
    pub fn is_empty(&self) -> bool {
        self.observed.is_empty()
    }

    /// Weights of the residuals.
    pub fn weighting(&self) -> &Weighting {
        &self.weighting
    }

    /// Loss of a residual.
    pub fn loss(&self) -> Loss {
        self.loss
    }

    /// Gain, offset, drift and delay.
    pub fn sensor(&self) -> Sensor {
        self.sensor
    }

    /// Sections of the filter; empty without a filter.
    pub fn filter(&self) -> &[SecondOrder] {
        &self.filter
    }

    /// Force and base acceleration at sample `i`: as given, or linear over the step.
    pub(crate) fn input_at_sample(&self, excitation: Option<&Excitation>, i: usize) -> InputSample {
        match (&self.inputs_at_samples, excitation) {
            (Some(inputs), _) => InputSample {
                force: inputs[0].get(i).copied().unwrap_or(0.0),
                base: inputs[1].get(i).copied().unwrap_or(0.0),
            },
            (None, Some(excitation)) => excitation.input_at(self.positions.get(i)),
            (None, None) => InputSample::default(),
        }
    }

    /// [`Channel::base_at`] for every sample; empty if zero.
    #[inline(always)]
    pub(crate) fn base(&self) -> &[f64] {
        &self.base
    }

    /// Motion of the base that a sensor of absolute motion adds to sample `i`; zero for other sensors.
    pub fn base_at(&self, i: usize) -> f64 {
        self.base.get(i).copied().unwrap_or(0.0)
    }

    /// Sets the time from which a drift counts, s.
    #[must_use]
    pub(crate) fn with_origin(mut self, origin: f64) -> Self {
        self.origin = origin;
        self
    }

    /// Time from which a drift counts, s.
    pub(crate) fn origin(&self) -> f64 {
        self.origin
    }

    /// Time since the first sample, s.
    pub fn elapsed_at(&self, i: usize) -> f64 {
        self.times[i] - self.origin
    }

    /// True for displacements of one coordinate by an ideal sensor without a filter.
    pub(crate) fn is_plain(&self) -> bool {
        self.kind == ChannelKind::Displacement
            && self.coordinate().is_some()
            && self.sensor == Sensor::default()
            && self.base.is_empty()
            && self.filter.is_empty()
    }

    /// True if all samples are displacements at nodes.
    pub(crate) fn is_displacement_at_nodes(&self) -> bool {
        let all = || self.positions.iter().all(|p| p.as_node().is_some());
        self.kind == ChannelKind::Displacement
            && !self.sensor.is_delayed()
            && (self.positions.are_nodes() || all())
    }

    /// True if sample `i` lies on node `i`.
    pub(crate) fn is_on_every_node(&self) -> bool {
        self.positions.are_nodes() && !self.sensor.is_delayed()
    }

    /// Forces (N) and base accelerations (m/s^2) at the samples, if given; empty if zero.
    #[inline(always)]
    pub(crate) fn inputs_at_samples(&self) -> Option<&[Arc<Vec<f64>>; 2]> {
        self.inputs_at_samples.as_ref()
    }

    /// Filtered series of values at the samples.
    pub(crate) fn filtered(&self, series: &[f64]) -> Vec<f64> {
        zero_phase(&self.filter, series)
    }

    /// Number of nodes between samples, for unfiltered displacements of an ideal sensor at the nodes `0, stride, 2 stride, ...`.
    pub fn stride(&self) -> Option<usize> {
        if self.is_plain() && self.positions.are_nodes() {
            return Some(1);
        }
        if !self.is_plain() || self.positions.get(0).as_node() != Some(0) {
            return None;
        }
        let stride = match self.len() {
            1 => 1,
            _ => self.positions.get(1).as_node()?,
        };
        let in_place = |(i, position): (usize, TimePoint)| position.as_node() == Some(i * stride);
        (self.positions.iter().enumerate().all(in_place)).then_some(stride)
    }
}
