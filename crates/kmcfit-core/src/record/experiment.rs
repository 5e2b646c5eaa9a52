//! Experiments: input, initial state and channels of one record.

use super::{Channel, Input, InputNoise};
use crate::system::{Excitation, Grid, State};
use std::ops::Range;

/// One record of a system.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Name for reports.
    pub name: String,
    /// State at the first node; starts where estimated.
    pub initial: State,
    /// Scalar parameters of the components of that state, where estimated.
    pub initial_parameters: Vec<Option<usize>>,
    /// Excitation on the grid; `None` for a free response.
    pub excitation: Option<Excitation>,
    /// Input from which the excitation was sampled; empty where the excitation was given on the grid.
    pub input: Input,
    /// Errors of the input, if stated.
    pub input_error: Option<InputNoise>,
    /// Number of nodes of the response; a record may be shorter than the grid.
    pub nodes: usize,
    /// Index of the coefficient set in
    /// [`Parameterization::coefficient_sets`](crate::functions::Parameterization::coefficient_sets).
    pub coefficient_set: usize,
    /// Measured channels; empty for a simulation.
    pub channels: Vec<Channel>,
}

impl Experiment {
    /// Free response with the shared coefficient set over `nodes` nodes from a known state, without samples.
    pub fn free(name: impl Into<String>, initial: State, nodes: usize) -> Self {
        Self {
            name: name.into(),
            initial_parameters: vec![None; initial.components().len()],
            initial,
            excitation: None,
            input: Input::default(),
            input_error: None,
            nodes,
            coefficient_set: 0,
            channels: Vec::new(),
        }
    }

    /// Adds a channel.
    #[must_use]
    pub fn with_channel(mut self, channel: Channel) -> Self {
        self.channels.push(channel);
        self
    }

    /// Sets the excitation.
    #[must_use]
    pub fn with_excitation(mut self, excitation: Excitation) -> Self {
        self.excitation = Some(excitation);
        self
    }

    /// State at the first node, given the values `scalars` of all scalars.
    pub fn initial_state(&self, scalars: &[f64]) -> State {
        let components = self
            .initial_parameters
            .iter()
            .zip(self.initial.components());
        let values = components.map(|(estimated, known)| estimated.map_or(*known, |i| scalars[i]));
        State::of_components(self.initial.coordinates(), values.collect())
    }

    /// True where no component of the state at the first node is estimated.
    pub fn begins_known(&self) -> bool {
        self.initial_parameters.iter().all(Option::is_none)
    }

    /// The steps `steps` and the samples within them before their filters, from the state `initial`, on a grid of half the step that
    /// begins with them; `None` if a sample does not lie on it. An excitation given on the old grid is linear between its stages.
    pub(crate) fn halved(&self, steps: Range<usize>, initial: State, grid: &Grid) -> Option<Self> {
        let nodes = 2 * steps.len() + 1;
        let part = |channel: &Channel| {
            let samples = channel.count_within(steps.start)..channel.count_within(steps.end);
            channel.part(samples, grid, nodes)
        };
        let channels: Option<Vec<Channel>> = self.channels.iter().map(part).collect();
        let excitation = self
            .excitation
            .as_ref()
            .map(|old| match self.input == Input::default() {
                false => self.input.on(grid, nodes),
                true => old.halved(steps.clone()),
            });
        Some(Self {
            channels: channels?,
            excitation,
            nodes,
            initial,
            initial_parameters: vec![None; self.initial_parameters.len()],
            ..self.clone()
        })
    }

    /// True without excitation.
    pub fn is_free(&self) -> bool {
        self.excitation.as_ref().is_none_or(Excitation::is_zero)
    }

    /// True with samples.
    pub fn has_samples(&self) -> bool {
        !self.channels.is_empty()
    }

    /// Number of samples of all channels.
    pub fn sample_count(&self) -> usize {
        self.channels.iter().map(Channel::len).sum()
    }
}
