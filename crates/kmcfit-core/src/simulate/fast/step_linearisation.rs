//! Eight steps linearised at once: the motion is known, so no step waits for the one before.

use super::elements::with_known;
use super::padded_loads as window;
use super::prefactored::is_constant;
use crate::lanes::{Arithmetic, Eight, LANES, Row};
use crate::simulate::Trajectory;
use crate::simulate::reference::equation::EquationOfMotion;
use crate::system::{
    FUNCTIONS, MIDPOINT, MOST_TERMS, Method, Position, RK4, Stepwise, Tableau, Term,
};

/// How the states at the right nodes of eight steps answer, one step a lane. The first index is the
/// one of the right node's state (displacement, velocity).
#[repr(align(64))]
pub(super) struct Maps {
    /// To displacement and velocity at the left node, less the identity.
    pub growth: [[Row; 2]; 2],
    /// To each function's value at the left node, mass first.
    pub left: [[Row; 2]; FUNCTIONS],
    /// To each function's value at the right node.
    pub right: [[Row; 2]; FUNCTIONS],
    /// To each function that has the same value everywhere.
    pub sum: [[Row; 2]; FUNCTIONS],
}

impl Maps {
    pub const NOTHING: Self = Self {
        growth: [[[0.0; LANES]; 2]; 2],
        left: [[[0.0; LANES]; 2]; FUNCTIONS],
        right: [[[0.0; LANES]; 2]; FUNCTIONS],
        sum: [[[0.0; LANES]; 2]; FUNCTIONS],
    };
}

/// Which answers are asked for, mass first.
#[derive(Clone, Copy, Default)]
pub(super) struct Wanted {
    /// To the values at both nodes.
    pub ends: [bool; FUNCTIONS],
    /// To one value for both.
    pub sum: [bool; FUNCTIONS],
}

/// The mass over some nodes, if it is constant there: steps then share a division.
pub(super) fn constant_mass(mass: &[f64]) -> Option<f64> {
    is_constant(mass).then(|| mass.first().copied()).flatten()
}

/// Where the functions are looked at: the three [`Position`]s.
#[derive(Clone, Copy)]
struct Places<A: Arithmetic>([Eight<A>; 3]);

impl<A: Arithmetic> Places<A> {
    #[inline(always)]
    fn of(arithmetic: A, values: &[f64], i: usize) -> Self {
        Self(window::places(arithmetic, values, i))
    }

    #[inline(always)]
    fn stepwise(arithmetic: A, part: Option<&Stepwise>, i: usize) -> Self {
        Self(window::stepwise(arithmetic, part, i))
    }

    #[inline(always)]
    fn at(&self, position: Position) -> Eight<A> {
        self.0[position as usize]
    }
}

/// Linearises the steps `i` to `i + 7` of a motion, over which the mass may be known to be constant, for the functions that
/// are `wanted`.
#[inline(always)]
#[allow(
    clippy::too_many_arguments,
    reason = "all of it is laid out for each method"
)]
pub(super) fn linearise<A: Arithmetic>(
    arithmetic: A,
    method: Method,
    rhs: &EquationOfMotion,
    motion: &Trajectory,
    i: usize,
    constant_mass: Option<f64>,
    wanted: &Wanted,
    maps: &mut Maps,
) {
    let terms = rhs.terms;
    with_known!(terms, terms, TERMS => match method {
        Method::Midpoint => {
            by::<A, 2, TERMS>(arithmetic, &MIDPOINT, terms, rhs, motion, i, constant_mass, wanted, maps);
        }
        Method::Rk4 => {
            by::<A, 4, TERMS>(arithmetic, &RK4, terms, rhs, motion, i, constant_mass, wanted, maps);
        }
    });
}

#[inline(always)]
#[allow(
    clippy::too_many_arguments,
    reason = "all of it is laid out for each list of terms"
)]
fn by<A: Arithmetic, const S: usize, const TERMS: usize>(
    arithmetic: A,
    tableau: &Tableau<S>,
    terms: &[Term],
    rhs: &EquationOfMotion,
    motion: &Trajectory,
    i: usize,
    constant_mass: Option<f64>,
    wanted: &Wanted,
    maps: &mut Maps,
) {
    let (zero, one) = (Eight::splat(arithmetic, 0.0), Eight::splat(arithmetic, 1.0));
    let dt = rhs.dt;
    let per_mass = match constant_mass {
        Some(mass) => Places([Eight::splat(arithmetic, 1.0 / mass); 3]),
        None => {
            let mut places = Places::of(arithmetic, &rhs.device.mass, i);
            for place in &mut places.0 {
                *place = one / *place;
            }
            places
        }
    };
    let force = Places::stepwise(arithmetic, rhs.excitation.and_then(|e| e.force.as_ref()), i);
    let base = Places::stepwise(arithmetic, rhs.excitation.and_then(|e| e.base.as_ref()), i);

    let mut functions = [Places([zero; 3]); TERMS];
    let coefficients = rhs.device.coefficients.iter().take(terms.len());
    for (places, values) in functions.iter_mut().zip(coefficients) {
        *places = Places::of(arithmetic, values, i);
    }

    // Forwards: the stages, their slopes, and how the acceleration answers to each function.
    let y0 = window::eight(arithmetic, &motion.displacement, i);
    let v0 = window::eight(arithmetic, &motion.velocity, i);
    let [mut v, mut a, mut by_y, mut by_v] = [[zero; S]; 4];
    let mut inertias = [zero; S];
    let mut answers = [[zero; TERMS]; S];
    for s in 0..S {
        let position = tableau.position[s];
        let (mut y_s, mut v_s) = (y0, v0);
        for r in 0..s {
            if tableau.a[s][r] != 0.0 {
                let h = Eight::splat(arithmetic, dt * tableau.a[s][r]);
                y_s += h * v[r];
                v_s += h * a[r];
            }
        }
        v[s] = v_s;
        let per_mass = per_mass.at(position);
        let minus_per_mass = -per_mass;
        let mut push = force.at(position);
        for (j, term) in terms.iter().enumerate().take(TERMS) {
            let p = functions[j].at(position);
            let response = term.respond(arithmetic, y_s, v_s);
            push = push - p * response.phi;
            answers[s][j] = response.phi * minus_per_mass;
            by_y[s] = response.by_y.taken_from(by_y[s], p);
            by_v[s] = response.by_v.taken_from(by_v[s], p);
        }
        let inertia = push * per_mass;
        a[s] = inertia - base.at(position);
        by_y[s] = by_y[s] * per_mass;
        by_v[s] = by_v[s] * per_mass;
        inertias[s] = inertia * minus_per_mass;
    }

    // Backwards, from each component of the state at the right node.
    for end in 0..2 {
        let [mut y_bar, mut v_bar, mut a_bar] = [[zero; S]; 3];
        let [mut to_y, mut to_v] = [zero; 2];
        for s in (0..S).rev() {
            let weight = Eight::splat(arithmetic, dt * tableau.b[s]);
            if end == 0 {
                v_bar[s] = weight;
            } else {
                a_bar[s] = weight;
            }
            for r in s + 1..S {
                if tableau.a[r][s] != 0.0 {
                    let h = Eight::splat(arithmetic, dt * tableau.a[r][s]);
                    a_bar[s] += h * v_bar[r];
                    v_bar[s] += h * y_bar[r];
                }
            }
            v_bar[s] += by_v[s] * a_bar[s];
            y_bar[s] = by_y[s] * a_bar[s];
            to_y += y_bar[s];
            to_v += v_bar[s];
        }
        maps.growth[end] = [to_y.row(), to_v.row()];
        for f in 0..=terms.len().min(TERMS) {
            let mut answer = [zero; S];
            for s in 0..S {
                answer[s] = match f {
                    0 => a_bar[s] * inertias[s],
                    _ => a_bar[s] * answers[s][f - 1],
                };
            }
            if wanted.sum[f] {
                let mut sum = answer[0];
                for part in &answer[1..] {
                    sum += *part;
                }
                maps.sum[f][end] = sum.row();
            }
            if !wanted.ends[f] {
                continue;
            }
            let [mut left, mut middle, mut right] = [zero; 3];
            for (s, answer) in answer.into_iter().enumerate() {
                match tableau.position[s] {
                    Position::Left => left += answer,
                    Position::Middle => middle += answer,
                    Position::Right => right += answer,
                }
            }
            middle = middle * Eight::splat(arithmetic, 0.5);
            maps.left[f][end] = (left + middle).row();
            maps.right[f][end] = (right + middle).row();
        }
    }
}
