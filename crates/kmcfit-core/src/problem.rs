//! The validated, immutable problem that everything below the configuration works on.

use crate::constraints::{Constraints, RowGroup};
use crate::dynamics::{ChannelKind, Excitation, Grid, Oscillator, State, Stepwise};
use crate::functions::{Functions, Penalty, Variation};
use crate::objective::{Channel, Weighting};
use crate::signal::{Shape, Signal};

/// Steps from which on a record is long: it is then worth being gone through in parts.
pub(crate) const LONG: usize = 1 << 15;

/// A force over time.
#[derive(Debug, Clone, PartialEq)]
pub enum Waveform {
    /// Measured, N.
    Samples(Signal),
    /// A formula, N.
    Shape(Shape),
}

/// A measured motion of the base.
#[derive(Debug, Clone, PartialEq)]
pub enum BaseMotion {
    /// Its acceleration, m/s^2.
    Acceleration(Signal),
    /// Its displacement, m, as a smooth function: it is differentiated twice.
    Displacement(Signal),
}

/// What drives a motion, at any time: from it the excitation on any grid is made.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drive {
    /// The force.
    pub force: Option<Waveform>,
    /// The motion of the base.
    pub base: Option<BaseMotion>,
}

impl Drive {
    /// The excitation at the stages of the steps of a motion over the first `nodes` nodes of `grid`.
    pub fn on(&self, grid: &Grid, nodes: usize) -> Excitation {
        let sample = |at: &dyn Fn(f64) -> f64, before: &dyn Fn(f64) -> f64| {
            let step = |i: usize| {
                let (left, right) = (grid.time(i), grid.time(i + 1));
                [at(left), at(0.5 * (left + right)), before(right)]
            };
            Stepwise::new((0..nodes - 1).map(step).collect())
        };
        Excitation {
            force: self.force.as_ref().map(|force| match force {
                Waveform::Samples(s) => sample(&|t| s.value(t), &|t| s.value_before(t)),
                Waveform::Shape(s) => sample(&|t| s.value(t), &|t| s.value_before(t)),
            }),
            base: self.base.as_ref().map(|base| match base {
                BaseMotion::Acceleration(s) => sample(&|t| s.value(t), &|t| s.value_before(t)),
                BaseMotion::Displacement(s) => {
                    sample(&|t| s.second_derivative(t), &|t| s.second_derivative(t))
                }
            }),
        }
    }

    /// The force at time `t` (s), N.
    pub fn force_at(&self, t: f64) -> f64 {
        match &self.force {
            None => 0.0,
            Some(Waveform::Samples(signal)) => signal.value(t),
            Some(Waveform::Shape(shape)) => shape.value(t),
        }
    }

    /// The acceleration of the base at time `t` (s), m/s^2.
    pub fn base_acceleration_at(&self, t: f64) -> f64 {
        self.base_motion_at(ChannelKind::Acceleration, t)
            .unwrap_or(0.0)
    }

    /// The motion of the base at time `t` (s) in the SI unit of `kind`; `None` where it is not known.
    pub fn base_motion_at(&self, kind: ChannelKind, t: f64) -> Option<f64> {
        match (&self.base, kind) {
            (None, _) => Some(0.0),
            (Some(BaseMotion::Acceleration(signal)), ChannelKind::Acceleration) => {
                Some(signal.value(t))
            }
            (Some(BaseMotion::Acceleration(_)), _) => None,
            (Some(BaseMotion::Displacement(signal)), kind) => Some(match kind {
                ChannelKind::Displacement => signal.value(t),
                ChannelKind::Velocity => signal.derivative(t),
                ChannelKind::Acceleration => signal.second_derivative(t),
            }),
        }
    }
}

/// One record of a device's motion.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Name for reports.
    pub name: String,
    /// Displacement and velocity at the first node; where they are sought, the start of the search.
    pub initial: State,
    /// The scalars that displacement and velocity at the first node are, where they are sought.
    pub sought: [Option<usize>; 2],
    /// What drives the motion, on the grid; `None` is free motion.
    pub excitation: Option<Excitation>,
    /// What it was made from; empty where it was given on the grid.
    pub drive: Drive,
    /// Number of nodes of its motion: a record may end before the grid does.
    pub nodes: usize,
    /// Which device of [`Functions::assemblies`] moves.
    pub device: usize,
    /// What was measured; none for an experiment that is only simulated.
    pub channels: Vec<Channel>,
}

impl Experiment {
    /// Free motion of the main device over `nodes` nodes from a known state, without readings.
    pub fn free(name: impl Into<String>, initial: State, nodes: usize) -> Self {
        Self {
            name: name.into(),
            initial,
            sought: [None; 2],
            excitation: None,
            drive: Drive::default(),
            nodes,
            device: 0,
            channels: Vec::new(),
        }
    }

    /// With one more channel of readings.
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
        let value = |sought: Option<usize>, known: f64| sought.map_or(known, |i| scalars[i]);
        State {
            displacement: value(self.sought[0], self.initial.displacement),
            velocity: value(self.sought[1], self.initial.velocity),
        }
    }

    /// The same experiment on a grid of half the step; `None` if its readings are not on it. An
    /// excitation that was given on the old grid is linear between its stages.
    pub fn halved(&self, grid: &Grid) -> Option<Self> {
        let nodes = 2 * self.nodes - 1;
        let channels: Option<Vec<Channel>> =
            self.channels.iter().map(|c| c.on(grid, nodes)).collect();
        let excitation = self
            .excitation
            .as_ref()
            .map(|old| match self.drive == Drive::default() {
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

    /// Whether nothing drives the motion.
    pub fn is_free(&self) -> bool {
        self.excitation.as_ref().is_none_or(Excitation::is_zero)
    }

    /// Whether anything was measured.
    pub fn is_read(&self) -> bool {
        !self.channels.is_empty()
    }

    /// Number of readings of all channels.
    pub fn reading_count(&self) -> usize {
        self.channels.iter().map(Channel::len).sum()
    }
}

/// What is fitted: an oscillator, how its functions are represented, and the records.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Grid, stepper and terms.
    pub oscillator: Oscillator,
    /// Mass and one function per term.
    pub functions: Functions,
    /// The records.
    pub experiments: Vec<Experiment>,
    /// What the functions pay for being rough.
    pub penalties: Vec<Penalty>,
    /// What the functions pay for jumping.
    pub variations: Vec<Variation>,
    /// What the functions must satisfy.
    pub constraints: Constraints,
    /// What the functions may break at a price.
    pub soft: Vec<RowGroup>,
}

impl Problem {
    /// A problem without regularisation or constraints.
    pub fn new(oscillator: Oscillator, functions: Functions, experiments: Vec<Experiment>) -> Self {
        Self {
            oscillator,
            functions,
            experiments,
            penalties: Vec::new(),
            variations: Vec::new(),
            constraints: Constraints::default(),
            soft: Vec::new(),
        }
    }

    /// Number of parameters of functions and scalars.
    pub fn parameters(&self) -> usize {
        self.functions.parameters()
    }

    /// The start of the search.
    pub fn start(&self) -> Vec<f64> {
        self.functions.start()
    }

    /// The part of `theta` that belongs to the scalars.
    pub fn scalars<'a>(&self, theta: &'a [f64]) -> &'a [f64] {
        &theta[self.functions.scalar_range()]
    }

    /// All channels of all experiments.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.experiments.iter().flat_map(|e| &e.channels)
    }

    /// Number of readings of all experiments.
    pub fn reading_count(&self) -> usize {
        self.channels().map(Channel::len).sum()
    }

    /// The misfit of no motion at all: what there is to explain.
    pub fn misfit_of_silence(&self) -> f64 {
        let silence = |c: &Channel| c.cost(&vec![0.0; c.len()]);
        self.channels().map(silence).sum()
    }

    /// The same problem with only the first part of the readings, `share` of the time of each
    /// record.
    #[must_use]
    pub fn first_part(&self, share: f64) -> Self {
        let mut part = self.clone();
        let grid = &self.oscillator.grid;
        for experiment in &mut part.experiments {
            let length = (experiment.nodes - 1) as f64 * grid.step();
            let end = grid.start() + share * length;
            for channel in &mut experiment.channels {
                let count = channel.times().partition_point(|t| *t <= end);
                *channel = channel.first(count.max(2));
            }
        }
        part
    }

    /// Whether the continuous adjoint of Eq. 13 applies: the integral cost, one reading of the
    /// displacement per node, over the whole grid.
    pub fn supports_continuous(&self) -> bool {
        let nodes = self.oscillator.grid.nodes();
        let fits = |c: &Channel| {
            c.stride() == Some(1)
                && c.len() == nodes
                && matches!(c.weighting(), Weighting::Integral { .. })
        };
        let one =
            |e: &Experiment| e.nodes == nodes && e.channels.len() == 1 && fits(&e.channels[0]);
        self.experiments.iter().all(one)
    }
}
