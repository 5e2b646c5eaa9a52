//! One record: input, initial state and channels.

use super::{Channel, Input};
use crate::system::{Excitation, Grid, State};

/// One record of a system's response.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Name for reports.
    pub name: String,
    /// Displacement and velocity at the first node; where they are estimated, the start of the search.
    pub initial: State,
    /// The scalars that displacement and velocity at the first node are, where they are estimated.
    pub initial_parameters: [Option<usize>; 2],
    /// What drives the response, on the grid; `None` is free response.
    pub excitation: Option<Excitation>,
    /// What it was made from; empty where it was given on the grid.
    pub drive: Input,
    /// Number of nodes of its response: a record may end before the grid does.
    pub nodes: usize,
    /// Which system of [`Parameterization::assemblies`](crate::functions::Parameterization::assemblies) moves.
    pub coefficient_set: usize,
    /// What was measured; none for an experiment that is only simulated.
    pub channels: Vec<Channel>,
}

impl Experiment {
    /// Free response of the shared coefficient set over `nodes` nodes from a known state, without samples.
    pub fn free(name: impl Into<String>, initial: State, nodes: usize) -> Self {
        Self {
            name: name.into(),
            initial,
            initial_parameters: [None; 2],
            excitation: None,
            drive: Input::default(),
            nodes,
            coefficient_set: 0,
            channels: Vec::new(),
        }
    }

    /// With one more channel of samples.
    #[must_use]
    pub fn with_channel(mut self, channel: Channel) -> Self {
        self.channels.push(channel);
        self
    }

    /// Under an excitation.
    #[must_use]
    pub fn with_excitation(mut self, excitation: Excitation) -> Self {
        self.excitation = Some(excitation);
        self
    }

    /// The state at the first node, for the values `scalars` of all scalars.
    pub fn initial_state(&self, scalars: &[f64]) -> State {
        let value = |estimated: Option<usize>, known: f64| estimated.map_or(known, |i| scalars[i]);
        State {
            displacement: value(self.initial_parameters[0], self.initial.displacement),
            velocity: value(self.initial_parameters[1], self.initial.velocity),
        }
    }

    /// The same experiment on a grid of half the step; `None` if its samples are not on it. An
    /// excitation that was given on the old grid is linear between its stages.
    pub fn halved(&self, grid: &Grid) -> Option<Self> {
        let nodes = 2 * self.nodes - 1;
        let channels: Option<Vec<Channel>> =
            self.channels.iter().map(|c| c.on(grid, nodes)).collect();
        let excitation = self
            .excitation
            .as_ref()
            .map(|old| match self.drive == Input::default() {
                false => self.drive.on(grid, nodes),
                true => old.halved(),
            });
        Some(Self {
            channels: channels?,
            excitation,
            nodes,
            ..self.clone()
        })
    }

    /// Whether nothing drives the response.
    pub fn is_free(&self) -> bool {
        self.excitation.as_ref().is_none_or(Excitation::is_zero)
    }

    /// Whether anything was measured.
    pub fn is_read(&self) -> bool {
        !self.channels.is_empty()
    }

    /// Number of samples of all channels.
    pub fn sample_count(&self) -> usize {
        self.channels.iter().map(Channel::len).sum()
    }
}
