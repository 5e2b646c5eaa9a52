//! Linearisation of eight steps at a time about a known response.

use super::elements::with_known;
use super::lane_reads;
use crate::simd::{Arithmetic, Eight, LANES, Row};
use crate::simulate::Trajectory;
use crate::simulate::reference::equation::EquationOfMotion;
use crate::system::{
    FUNCTIONS, MIDPOINT, MOST_TERMS, Method, RK4, StagePosition, StageSamples, Tableau, Term,
};

/// Derivatives of the states at the right nodes of eight steps, one step per lane. The last index is the component of the
/// state at the right node (displacement, velocity).
#[repr(align(64))]
pub(super) struct StepLinearisation {
    /// With respect to displacement and velocity at the left node, minus the identity.
    pub growth: [[Row; 2]; 2],
    /// With respect to each function's value at the left node, mass first.
    pub left: [[Row; 2]; FUNCTIONS],
    /// With respect to each function's value at the right node.
    pub right: [[Row; 2]; FUNCTIONS],
    /// With respect to a value equal at both nodes.
    pub sum: [[Row; 2]; FUNCTIONS],
}

impl StepLinearisation {
    pub const NOTHING: Self = Self {
        growth: [[[0.0; LANES]; 2]; 2],
        left: [[[0.0; LANES]; 2]; FUNCTIONS],
        right: [[[0.0; LANES]; 2]; FUNCTIONS],
        sum: [[[0.0; LANES]; 2]; FUNCTIONS],
    };
}

/// Requested derivatives, mass first.
#[derive(Clone, Copy, Default)]
pub(super) struct RequestedDerivatives {
    /// With respect to the values at both nodes.
    pub ends: [bool; FUNCTIONS],
    /// With respect to a value equal at both nodes.
    pub sum: [bool; FUNCTIONS],
}

/// Values of a function at the three [`StagePosition`]s of eight steps.
#[derive(Clone, Copy)]
struct StageValues<A: Arithmetic>([Eight<A>; 3]);

impl<A: Arithmetic> StageValues<A> {
    #[inline(always)]
    fn of(arithmetic: A, values: &[f64], i: usize) -> Self {
        Self(lane_reads::stage_values(arithmetic, values, i))
    }

    #[inline(always)]
    fn samples(arithmetic: A, samples: Option<&StageSamples>, i: usize) -> Self {
        Self(lane_reads::stage_samples(arithmetic, samples, i))
    }

    #[inline(always)]
    fn at(&self, position: StagePosition) -> Eight<A> {
        self.0[position as usize]
    }
}

/// Linearises the steps `i` to `i + 7` of a response for the functions `wanted`; agrees with
/// [`step_jacobians`](crate::simulate::reference::step_jacobians()) to machine precision.
#[inline(always)]
#[allow(
    clippy::too_many_arguments,
    reason = "a struct of them would not be kept in registers"
)]
pub(super) fn linearise<A: Arithmetic>(
    arithmetic: A,
    method: Method,
    equation: &EquationOfMotion,
    response: &Trajectory,
    i: usize,
    wanted: &RequestedDerivatives,
    maps: &mut StepLinearisation,
) {
    let terms = equation.terms;
    with_known!(terms, terms, TERMS => match method {
        Method::Midpoint => {
            let stages = StageDerivatives::<A, 2, TERMS>::new(
                arithmetic, &MIDPOINT, terms, equation, response, i,
            );
            stages.transpose(arithmetic, &MIDPOINT, terms.len(), equation.dt, wanted, maps);
        }
        Method::Rk4 => {
            let stages = StageDerivatives::<A, 4, TERMS>::new(
                arithmetic, &RK4, terms, equation, response, i,
            );
            stages.transpose(arithmetic, &RK4, terms.len(), equation.dt, wanted, maps);
        }
    });
}

/// Derivatives of the accelerations at the stages of eight steps.
#[derive(Clone, Copy)]
struct StageDerivatives<A: Arithmetic, const S: usize, const TERMS: usize> {
    /// With respect to displacement and velocity.
    by_y: [Eight<A>; S],
    by_v: [Eight<A>; S],
    /// With respect to the mass.
    by_mass: [Eight<A>; S],
    /// With respect to the function of each term.
    by_function: [[Eight<A>; TERMS]; S],
}

impl<A: Arithmetic, const S: usize, const TERMS: usize> StageDerivatives<A, S, TERMS> {
    #[inline(always)]
    fn new(
        arithmetic: A,
        tableau: &Tableau<S>,
        terms: &[Term],
        equation: &EquationOfMotion,
        response: &Trajectory,
        i: usize,
    ) -> Self {
        let zero = Eight::splat(arithmetic, 0.0);
        let inverse_mass = StageValues(lane_reads::inverse_mass(
            arithmetic,
            &equation.nodal.mass,
            i,
        ));
        let input = equation.excitation;
        let force = StageValues::samples(arithmetic, input.and_then(|e| e.force.as_ref()), i);
        let base = StageValues::samples(arithmetic, input.and_then(|e| e.base.as_ref()), i);
        let mut functions = [StageValues([zero; 3]); TERMS];
        let coefficients = equation.nodal.coefficients.iter().take(terms.len());
        for (stage_values, values) in functions.iter_mut().zip(coefficients) {
            *stage_values = StageValues::of(arithmetic, values, i);
        }
        let y0 = lane_reads::eight(arithmetic, &response.displacement, i);
        let v0 = lane_reads::eight(arithmetic, &response.velocity, i);
        let [mut v, mut a] = [[zero; S]; 2];
        let mut stages = Self {
            by_y: [zero; S],
            by_v: [zero; S],
            by_mass: [zero; S],
            by_function: [[zero; TERMS]; S],
        };
        for s in 0..S {
            let position = tableau.position[s];
            let (mut y_s, mut v_s) = (y0, v0);
            for r in 0..s {
                if tableau.a[s][r] != 0.0 {
                    let h = Eight::splat(arithmetic, equation.dt * tableau.a[s][r]);
                    y_s += h * v[r];
                    v_s += h * a[r];
                }
            }
            v[s] = v_s;
            let inverse_mass = inverse_mass.at(position);
            let minus_inverse_mass = -inverse_mass;
            let mut push = force.at(position);
            for (j, term) in terms.iter().enumerate().take(TERMS) {
                let p = functions[j].at(position);
                let response = term.respond(arithmetic, y_s, v_s);
                push = push - p * response.phi;
                stages.by_function[s][j] = response.phi * minus_inverse_mass;
                stages.by_y[s] = response.by_y.taken_from(stages.by_y[s], p);
                stages.by_v[s] = response.by_v.taken_from(stages.by_v[s], p);
            }
            let inertia = push * inverse_mass;
            a[s] = inertia - base.at(position);
            stages.by_y[s] = stages.by_y[s] * inverse_mass;
            stages.by_v[s] = stages.by_v[s] * inverse_mass;
            stages.by_mass[s] = inertia * minus_inverse_mass;
        }
        stages
    }

    /// Derivatives of each component of the state at the right node, backwards through the stages.
    #[inline(always)]
    fn transpose(
        &self,
        arithmetic: A,
        tableau: &Tableau<S>,
        terms: usize,
        dt: f64,
        wanted: &RequestedDerivatives,
        maps: &mut StepLinearisation,
    ) {
        let zero = Eight::splat(arithmetic, 0.0);
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
                v_bar[s] += self.by_v[s] * a_bar[s];
                y_bar[s] = self.by_y[s] * a_bar[s];
                to_y += y_bar[s];
                to_v += v_bar[s];
            }
            maps.growth[end] = [to_y.row(), to_v.row()];
            for f in 0..=terms.min(TERMS) {
                let mut answer = [zero; S];
                for s in 0..S {
                    answer[s] = match f {
                        0 => a_bar[s] * self.by_mass[s],
                        _ => a_bar[s] * self.by_function[s][f - 1],
                    };
                }
                if wanted.sum[f] {
                    maps.sum[f][end] = sum(answer).row();
                }
                if wanted.ends[f] {
                    let [left, right] = at_ends(arithmetic, tableau, answer);
                    (maps.left[f][end], maps.right[f][end]) = (left.row(), right.row());
                }
            }
        }
    }
}

#[inline(always)]
fn sum<A: Arithmetic, const S: usize>(parts: [Eight<A>; S]) -> Eight<A> {
    let mut sum = parts[0];
    for part in &parts[1..] {
        sum += *part;
    }
    sum
}

/// Derivatives with respect to the values at the left and the right node, from those at the stages.
#[inline(always)]
fn at_ends<A: Arithmetic, const S: usize>(
    arithmetic: A,
    tableau: &Tableau<S>,
    stages: [Eight<A>; S],
) -> [Eight<A>; 2] {
    let [mut left, mut middle, mut right] = [Eight::splat(arithmetic, 0.0); 3];
    for (s, stage) in stages.into_iter().enumerate() {
        match tableau.position[s] {
            StagePosition::Left => left += stage,
            StagePosition::Middle => middle += stage,
            StagePosition::Right => right += stage,
        }
    }
    middle = middle * Eight::splat(arithmetic, 0.5);
    [left + middle, right + middle]
}
