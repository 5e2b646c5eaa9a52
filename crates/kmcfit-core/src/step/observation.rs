//! Observations of a response at any time, and their derivatives with respect to states and functions.
//!
//! Between nodes, displacement and velocity are cubic Hermite polynomials, fourth-order accurate in the step: the
//! displacement from its values and the velocities at both nodes, the velocity from its values and the accelerations
//! there. The acceleration follows from the equation of motion at the interpolated state, with functions linear between
//! nodes as in the stepper.

use super::Trajectory;
use super::engine::Driven;
use crate::record::ChannelKind;
use crate::system::{
    Excitation, FUNCTIONS, InputSample, NodalCoefficients, StageSamples, System, TimePoint,
};

/// An observed value and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// Value, in the SI unit of its kind.
    pub value: f64,
    /// Derivatives with respect to displacement and velocity at the left node, then at the right.
    pub states: [f64; 4],
    /// Derivatives with respect to the value of each function, mass first, at the left node and at
    /// the right.
    pub functions: [[f64; FUNCTIONS]; 2],
}

impl Observation {
    const NOTHING: Self = Self {
        value: 0.0,
        states: [0.0; 4],
        functions: [[0.0; FUNCTIONS]; 2],
    };

    #[inline(always)]
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
    #[inline(always)]
    fn state(index: usize, value: f64) -> Self {
        let mut sensed = Self::NOTHING;
        sensed.value = value;
        sensed.states[index] = 1.0;
        sensed
    }
}

/// Observes `kind` at `position` of the response `states`.
///
/// `input` is the force and the acceleration of the base at that time; `excitation` is that of the whole response.
/// Accelerations are those of `y`, relative to the base.
///
/// # Panics
/// If `position` is not within `states`.
#[inline(always)]
pub fn observe(
    system: &System,
    kind: ChannelKind,
    nodal: &NodalCoefficients,
    excitation: Option<&Excitation>,
    states: &Trajectory,
    position: TimePoint,
    input: InputSample,
) -> Observation {
    let driven = Driven {
        system,
        nodal,
        excitation,
    };
    let step = system.grid.step();
    match kind {
        ChannelKind::Displacement => displacement(step, states, position),
        ChannelKind::Velocity => velocity(driven, states, position),
        ChannelKind::Acceleration => {
            let y = displacement(step, states, position);
            let v = velocity(driven, states, position);
            acceleration(driven, position.step, position.fraction, input, &y, &v)
        }
    }
}

/// Value of [`observe`]: in one place, where its derivatives are not computed.
#[inline(never)]
pub fn observe_value(
    system: &System,
    kind: ChannelKind,
    nodal: &NodalCoefficients,
    excitation: Option<&Excitation>,
    states: &Trajectory,
    position: TimePoint,
    input: InputSample,
) -> f64 {
    observe(system, kind, nodal, excitation, states, position, input).value
}

/// Cubic Hermite weights at `x` of a step of length `h`: value and slope on the left, on the right.
#[inline(always)]
pub(super) fn hermite(x: f64, h: f64) -> [f64; 4] {
    let (x2, x3) = (x * x, x * x * x);
    [
        1.0 - 3.0 * x2 + 2.0 * x3,
        h * (x - 2.0 * x2 + x3),
        3.0 * x2 - 2.0 * x3,
        h * (x3 - x2),
    ]
}

#[inline(always)]
fn displacement(h: f64, states: &Trajectory, position: TimePoint) -> Observation {
    let (y, v, i) = (states.displacement(0), states.velocity(0), position.step);
    match position.fraction {
        0.0 => Observation::state(0, y[i]),
        1.0 => Observation::state(2, y[i + 1]),
        x => {
            let weights = hermite(x, h);
            let ends = [y[i], v[i], y[i + 1], v[i + 1]];
            Observation {
                value: weights.iter().zip(ends).map(|(w, e)| w * e).sum(),
                states: weights,
                ..Observation::NOTHING
            }
        }
    }
}

#[inline(always)]
fn velocity(driven: Driven, states: &Trajectory, position: TimePoint) -> Observation {
    let (y, v, i) = (states.displacement(0), states.velocity(0), position.step);
    match position.fraction {
        0.0 => Observation::state(1, v[i]),
        1.0 => Observation::state(3, v[i + 1]),
        x => {
            let at_end = |right: usize| {
                let part = |p: Option<&StageSamples>| p.map_or(0.0, |p| p.stages()[2 * right][i]);
                let input = driven
                    .excitation
                    .map_or(InputSample::default(), |e| InputSample {
                        force: part(e.force(0)),
                        base: part(e.frame(0)),
                    });
                let here = Observation::state(2 * right, y[i + right]);
                let speed = Observation::state(2 * right + 1, v[i + right]);
                (
                    speed,
                    acceleration(driven, i, right as f64, input, &here, &speed),
                )
            };
            let [(v0, a0), (v1, a1)] = [at_end(0), at_end(1)];
            let mut sensed = Observation::NOTHING;
            for (weight, end) in hermite(x, driven.system.grid.step())
                .into_iter()
                .zip([v0, a0, v1, a1])
            {
                sensed.add(weight, &end);
            }
            sensed
        }
    }
}

/// Acceleration `y'' = (f - sum_j p_j phi_j) / m - b''` at fraction `x` of step `i`, at the state `(y, v)`.
#[inline(always)]
fn acceleration(
    driven: Driven,
    i: usize,
    x: f64,
    input: InputSample,
    y: &Observation,
    v: &Observation,
) -> Observation {
    let blend = |f: &[f64]| match x {
        0.0 => f[i],
        1.0 => f[i + 1],
        x => f[i] * (1.0 - x) + f[i + 1] * x,
    };
    let mass = blend(&driven.nodal.inertias[0]);
    let mut inertia = input.force / mass;
    let (mut by_y, mut by_v) = (0.0, 0.0);
    let mut by_function = [0.0; FUNCTIONS];
    for (j, term) in driven.system.laws().iter().enumerate().rev() {
        let p = driven.nodal.coefficients.get(j);
        let p = p.map_or(0.0, |p| blend(p));
        let phi = term.phi(y.value, v.value);
        let slopes = term
            .slopes(y.value, v.value)
            .map(|slope| slope.unwrap_or(0.0));
        inertia -= p * phi / mass;
        by_y -= p * slopes[0] / mass;
        by_v -= p * slopes[1] / mass;
        by_function[j + 1] = -phi / mass;
    }
    by_function[0] = -inertia / mass;
    let mut sensed = Observation::NOTHING;
    sensed.add(by_y, y);
    sensed.add(by_v, v);
    for (side, share) in sensed.functions.iter_mut().zip([1.0 - x, x]) {
        for (f, slope) in side.iter_mut().zip(by_function) {
            *f += share * slope;
        }
    }
    sensed.value = inertia - input.base;
    sensed
}
