//! What a sensor sees of a motion at any time, and how that answers to the states and the functions.
//!
//! Between nodes displacement and velocity are cubic Hermite polynomials, of order 4 in the step: the
//! displacement from its values and the velocities at both nodes, the velocity from its values and
//! the accelerations there. The acceleration is the equation of motion's own, at the interpolated
//! state, with the functions linear between nodes as the stepper sees them.

use super::stages::Rhs;
use super::tableau::Position;
use super::term::MOST_TERMS;
use super::{Device, Excitation, Grid, Oscillator, Trajectory};

/// What a channel measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ChannelKind {
    /// Displacement `y`, m.
    Displacement,
    /// Velocity `y'`, m/s.
    Velocity,
    /// Acceleration `y''`, m/s^2.
    Acceleration,
}

impl ChannelKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Displacement, Self::Velocity, Self::Acceleration];

    /// Key in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
        }
    }

    /// Symbol.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Displacement => "y",
            Self::Velocity => "y'",
            Self::Acceleration => "y''",
        }
    }

    /// SI unit of motion along a line, or of turning.
    pub fn unit_of(self, angular: bool) -> &'static str {
        match (self, angular) {
            (_, false) => self.unit(),
            (Self::Displacement, true) => "rad",
            (Self::Velocity, true) => "rad/s",
            (Self::Acceleration, true) => "rad/s^2",
        }
    }

    /// SI unit of motion along a line.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Displacement => "m",
            Self::Velocity => "m/s",
            Self::Acceleration => "m/s^2",
        }
    }
}

/// A time on a grid: `fraction` of a step after the left node of step `step`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Step, from 0.
    pub step: usize,
    /// From 0 at the left node to 1 at the right one.
    pub fraction: f64,
}

impl Place {
    /// How near a time must be to a node, in steps, to be taken as the node itself.
    pub const SAME_TIME: f64 = 1e-6;

    /// The place of `time` (s) on `grid`; `None` outside it.
    pub fn of(grid: &Grid, time: f64) -> Option<Self> {
        let x = (time - grid.start()) / grid.step();
        let last = grid.nodes() - 1;
        let nearest = x.round();
        if !(nearest >= 0.0 && nearest <= last as f64) {
            return None;
        }
        if (x - nearest).abs() <= Self::SAME_TIME {
            return Some(Self::node(nearest as usize, grid.nodes()));
        }
        let step = x.floor();
        let inside = step >= 0.0 && step < last as f64;
        inside.then_some(Self {
            step: step as usize,
            fraction: x - step,
        })
    }

    /// Node `node` of a motion over `nodes` nodes: the left node of a step, but for the last.
    pub fn node(node: usize, nodes: usize) -> Self {
        match node + 1 < nodes {
            true => Self {
                step: node,
                fraction: 0.0,
            },
            false => Self {
                step: node.saturating_sub(1),
                fraction: 1.0,
            },
        }
    }

    /// The node that this place is, if it is one.
    pub fn as_node(self) -> Option<usize> {
        match self.fraction {
            0.0 => Some(self.step),
            1.0 => Some(self.step + 1),
            _ => None,
        }
    }
}

/// Force and acceleration of the base at one time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Surroundings {
    /// Force, N.
    pub force: f64,
    /// Acceleration of the base, m/s^2.
    pub base: f64,
}

/// What a sensor sees, and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensed {
    /// The value itself, in the SI unit of its kind.
    pub value: f64,
    /// Derivatives with respect to displacement and velocity at the left node, then at the right.
    pub states: [f64; 4],
    /// Derivatives with respect to the value of each function, mass first, at the left node and at
    /// the right.
    pub functions: [[f64; MOST_TERMS + 1]; 2],
}

impl Sensed {
    const NOTHING: Self = Self {
        value: 0.0,
        states: [0.0; 4],
        functions: [[0.0; MOST_TERMS + 1]; 2],
    };

    fn add(&mut self, factor: f64, other: &Self) {
        self.value += factor * other.value;
        for (a, b) in self.states.iter_mut().zip(&other.states) {
            *a += factor * b;
        }
        for (side, from) in self.functions.iter_mut().zip(&other.functions) {
            side.iter_mut()
                .zip(from)
                .for_each(|(a, b)| *a += factor * b);
        }
    }

    /// One of the four states of a step, as a value with derivatives.
    fn state(index: usize, value: f64) -> Self {
        let mut sensed = Self::NOTHING;
        sensed.value = value;
        sensed.states[index] = 1.0;
        sensed
    }
}

impl Oscillator {
    /// What a sensor of `kind` sees at `place` of the motion `states` of `device`.
    ///
    /// `around` is the force and the base's acceleration at that very time; `excitation` is that of
    /// the whole motion. An acceleration is that of `y`, relative to the base.
    ///
    /// # Panics
    /// If `place` is not within `states`.
    pub fn sense(
        &self,
        kind: ChannelKind,
        device: &Device,
        excitation: Option<&Excitation>,
        states: &Trajectory,
        place: Place,
        around: Surroundings,
    ) -> Sensed {
        let rhs = Rhs {
            terms: &self.terms,
            device,
            excitation,
            dt: self.grid.step(),
        };
        match kind {
            ChannelKind::Displacement => displacement(rhs.dt, states, place),
            ChannelKind::Velocity => velocity(rhs, states, place),
            ChannelKind::Acceleration => {
                let y = displacement(rhs.dt, states, place);
                let v = velocity(rhs, states, place);
                acceleration(rhs, place.step, place.fraction, around, &y, &v)
            }
        }
    }
}

/// Cubic Hermite weights at `x` of a step of length `h`: value and slope on the left, on the right.
fn hermite(x: f64, h: f64) -> [f64; 4] {
    let (x2, x3) = (x * x, x * x * x);
    [
        1.0 - 3.0 * x2 + 2.0 * x3,
        h * (x - 2.0 * x2 + x3),
        3.0 * x2 - 2.0 * x3,
        h * (x3 - x2),
    ]
}

fn displacement(h: f64, states: &Trajectory, place: Place) -> Sensed {
    let (y, v, i) = (&states.displacement, &states.velocity, place.step);
    match place.fraction {
        0.0 => Sensed::state(0, y[i]),
        1.0 => Sensed::state(2, y[i + 1]),
        x => {
            let weights = hermite(x, h);
            let ends = [y[i], v[i], y[i + 1], v[i + 1]];
            Sensed {
                value: weights.iter().zip(ends).map(|(w, e)| w * e).sum(),
                states: weights,
                ..Sensed::NOTHING
            }
        }
    }
}

fn velocity(rhs: Rhs, states: &Trajectory, place: Place) -> Sensed {
    let (y, v, i) = (&states.displacement, &states.velocity, place.step);
    match place.fraction {
        0.0 => Sensed::state(1, v[i]),
        1.0 => Sensed::state(3, v[i + 1]),
        x => {
            let at_end = |right: usize| {
                let position = [Position::Left, Position::Right][right];
                let part =
                    |p: &Option<super::Stepwise>| p.as_ref().map_or(0.0, |p| p.at(i, position));
                let around = rhs
                    .excitation
                    .map_or(Surroundings::default(), |e| Surroundings {
                        force: part(&e.force),
                        base: part(&e.base),
                    });
                let here = Sensed::state(2 * right, y[i + right]);
                let speed = Sensed::state(2 * right + 1, v[i + right]);
                (
                    speed,
                    acceleration(rhs, i, right as f64, around, &here, &speed),
                )
            };
            let [(v0, a0), (v1, a1)] = [at_end(0), at_end(1)];
            let mut sensed = Sensed::NOTHING;
            for (weight, end) in hermite(x, rhs.dt).into_iter().zip([v0, a0, v1, a1]) {
                sensed.add(weight, &end);
            }
            sensed
        }
    }
}

/// `y'' = (f - sum_j p_j phi_j) / m - b''` at fraction `x` of step `i`, at the state `(y, v)`.
fn acceleration(
    rhs: Rhs,
    i: usize,
    x: f64,
    around: Surroundings,
    y: &Sensed,
    v: &Sensed,
) -> Sensed {
    let blend = |f: &[f64]| match x {
        0.0 => f[i],
        1.0 => f[i + 1],
        x => f[i] * (1.0 - x) + f[i + 1] * x,
    };
    let mass = blend(&rhs.device.mass);
    let mut inertia = around.force / mass;
    let (mut by_y, mut by_v) = (0.0, 0.0);
    let mut by_function = [0.0; MOST_TERMS + 1];
    for (j, (term, p)) in rhs
        .terms
        .iter()
        .zip(&rhs.device.coefficients)
        .enumerate()
        .rev()
    {
        let p = blend(p);
        let phi = term.phi(y.value, v.value);
        let (phi_y, phi_v) = term.partials(y.value, v.value);
        inertia -= p * phi / mass;
        by_y -= p * phi_y / mass;
        by_v -= p * phi_v / mass;
        by_function[j + 1] = -phi / mass;
    }
    by_function[0] = -inertia / mass;
    let mut sensed = Sensed::NOTHING;
    sensed.add(by_y, y);
    sensed.add(by_v, v);
    for (side, share) in sensed.functions.iter_mut().zip([1.0 - x, x]) {
        for (f, slope) in side.iter_mut().zip(by_function) {
            *f += share * slope;
        }
    }
    sensed.value = inertia - around.base;
    sensed
}
