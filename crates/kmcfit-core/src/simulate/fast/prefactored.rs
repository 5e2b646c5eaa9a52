//! Forward solve with prefactored stages.
//!
//! The quotients of each function and the mass, and the input, times the step and the factors of the tableau, are computed
//! eight steps at a time. A step then consists of products and sums, ordered for short chains of dependent operations: the
//! velocity of a stage follows by four operations from the displacement of the previous one.

use super::lane_reads;
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES, Row};
use crate::simulate::Trajectory;
use crate::simulate::reference::equation::EquationOfMotion;
use crate::system::{MIDPOINT, MOST_TERMS, Method, RK4, State, Tableau, Term};

/// Forward solve; agrees with [`forward_into`](crate::simulate::reference::forward_into()) to 40 machine precisions of the
/// largest value per step. Returns `false`, without a response, if a kind of term occurs twice.
pub(crate) fn forward(
    equation: EquationOfMotion,
    method: Method,
    initial: State,
    trajectory: &mut Trajectory,
) -> bool {
    let mut kinds = [None; MOST_TERMS];
    for (j, term) in equation.terms.iter().enumerate() {
        if kinds[place(*term)].replace(j).is_some() {
            return false;
        }
    }
    let width = equation.terms.iter().find_map(|term| match term {
        Term::CoulombFriction { width } => Some(*width),
        _ => None,
    });
    simd::run(PrefactoredForward {
        equation,
        method,
        kinds,
        width: width.unwrap_or(1.0),
        initial,
        trajectory,
    });
    true
}

const STIFFNESS: usize = 0;
const DAMPING: usize = 1;
const CUBIC_STIFFNESS: usize = 2;
const OFFSET: usize = 3;
const QUADRATIC_DAMPING: usize = 4;
const COULOMB_FRICTION: usize = 5;
const QUADRATIC_STIFFNESS: usize = 6;
const QUINTIC_STIFFNESS: usize = 7;

/// Kinds of terms of a linear system, and of one with a cubic spring.
const LINEAR: [bool; MOST_TERMS] = kinds(&[STIFFNESS, DAMPING]);
const CUBIC: [bool; MOST_TERMS] = kinds(&[STIFFNESS, DAMPING, CUBIC_STIFFNESS]);

const fn kinds(list: &[usize]) -> [bool; MOST_TERMS] {
    let mut there = [false; MOST_TERMS];
    let mut i = 0;
    while i < list.len() {
        there[list[i]] = true;
        i += 1;
    }
    there
}

fn place(term: Term) -> usize {
    match term {
        Term::Stiffness => STIFFNESS,
        Term::Damping => DAMPING,
        Term::QuadraticStiffness => QUADRATIC_STIFFNESS,
        Term::CubicStiffness => CUBIC_STIFFNESS,
        Term::QuinticStiffness => QUINTIC_STIFFNESS,
        Term::Offset => OFFSET,
        Term::QuadraticDamping => QUADRATIC_DAMPING,
        Term::CoulombFriction { .. } => COULOMB_FRICTION,
    }
}

/// Largest number of stages of a tableau.
const STAGES: usize = 4;

/// Rates `h p/m` of each kind of term, and `h (f/m - b'')`, over eight steps; `h` is the step times a factor of the
/// tableau.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Rates {
    kinds: [Row; MOST_TERMS],
    input: Row,
}

/// Contributions of the acceleration of a stage.
#[derive(Clone, Copy)]
struct StageRates {
    /// To the velocity of the next stage.
    next: Rates,
    /// To the velocity at the right node.
    end: Rates,
}

const NOTHING: StageRates = {
    let rates = Rates {
        kinds: [[0.0; LANES]; MOST_TERMS],
        input: [0.0; LANES],
    };
    StageRates {
        next: rates,
        end: rates,
    }
};

struct PrefactoredForward<'a> {
    equation: EquationOfMotion<'a>,
    method: Method,
    /// Index of the term of each kind.
    kinds: [Option<usize>; MOST_TERMS],
    width: f64,
    initial: State,
    trajectory: &'a mut Trajectory,
}

impl Kernel for PrefactoredForward<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let there = self.kinds.map(|kind| kind.is_some());
        match (self.method, there) {
            // Compile-time constants for common lists.
            (Method::Midpoint, LINEAR) => self.sweep(arithmetic, &MIDPOINT, LINEAR),
            (Method::Rk4, LINEAR) => self.sweep(arithmetic, &RK4, LINEAR),
            (Method::Rk4, CUBIC) => self.sweep(arithmetic, &RK4, CUBIC),
            (Method::Midpoint, there) => self.sweep(arithmetic, &MIDPOINT, there),
            (Method::Rk4, there) => self.sweep(arithmetic, &RK4, there),
        }
    }
}

impl PrefactoredForward<'_> {
    #[inline(always)]
    fn sweep<A: Arithmetic, const S: usize>(
        self,
        arithmetic: A,
        tableau: &Tableau<S>,
        there: [bool; MOST_TERMS],
    ) {
        let nodal = self.equation.nodal;
        let is_constant = |j: usize| lane_reads::is_constant(&nodal.coefficients[j]);
        let has_constant_mass = lane_reads::is_constant(&nodal.mass);
        let mut steady = [false; MOST_TERMS];
        for (steady, kind) in steady.iter_mut().zip(&self.kinds) {
            *steady = has_constant_mass && kind.is_some_and(is_constant);
        }
        let mut stages = [NOTHING; STAGES];
        let (mut y, mut v) = (self.initial.displacement, self.initial.velocity);
        let response = &mut *self.trajectory;
        let steps = response.nodes() - 1;
        (response.displacement[0], response.velocity[0]) = (y, v);
        let mut from = 0;
        while from < steps {
            let inverse_mass = lane_reads::inverse_mass(arithmetic, &nodal.mass, from);
            prepare_drive(
                arithmetic,
                tableau,
                &self.equation,
                &inverse_mass,
                from,
                &mut stages,
            );
            for (k, (kind, steady)) in self.kinds.iter().zip(steady).enumerate() {
                if let Some(j) = *kind {
                    // Constant functions keep the rates of the first eight steps.
                    if from > 0 && steady {
                        continue;
                    }
                    let values = &self.equation.nodal.coefficients[j];
                    prepare(
                        arithmetic,
                        tableau,
                        self.equation.dt,
                        values,
                        &inverse_mass,
                        from,
                        k,
                        &mut stages,
                    );
                }
            }
            let to = (from + LANES).min(steps);
            let ends = response.displacement[from + 1..=to]
                .iter_mut()
                .zip(&mut response.velocity[from + 1..=to]);
            for (l, (end_y, end_v)) in ends.enumerate() {
                let l = l & (LANES - 1);
                step(
                    tableau,
                    &stages,
                    there,
                    self.width,
                    self.equation.dt,
                    l,
                    &mut y,
                    &mut v,
                );
                (*end_y, *end_v) = (y, v);
            }
            from = to;
        }
    }
}

/// Rates of a kind of term from its function, over the steps from `i`.
#[inline(always)]
#[allow(
    clippy::too_many_arguments,
    reason = "rows are written in place, without copies"
)]
fn prepare<A: Arithmetic, const S: usize>(
    arithmetic: A,
    tableau: &Tableau<S>,
    dt: f64,
    values: &[f64],
    inverse_mass: &[Eight<A>; 3],
    i: usize,
    kind: usize,
    stages: &mut [StageRates; STAGES],
) {
    let mut p = lane_reads::stage_values(arithmetic, values, i);
    for (p, inverse_mass) in p.iter_mut().zip(inverse_mass) {
        *p = *p * *inverse_mass;
    }
    for (s, stage) in stages.iter_mut().enumerate().take(S) {
        let [next, end] = factors(tableau, dt, s);
        let p = p[tableau.position[s] as usize];
        stage.next.kinds[kind] = (p * Eight::splat(arithmetic, next)).row();
        stage.end.kinds[kind] = (p * Eight::splat(arithmetic, end)).row();
    }
}

/// Input of the steps from `i`.
#[inline(always)]
fn prepare_drive<A: Arithmetic, const S: usize>(
    arithmetic: A,
    tableau: &Tableau<S>,
    equation: &EquationOfMotion,
    inverse_mass: &[Eight<A>; 3],
    i: usize,
    stages: &mut [StageRates; STAGES],
) {
    let force = lane_reads::stage_samples(
        arithmetic,
        equation.excitation.and_then(|e| e.force.as_ref()),
        i,
    );
    let base = lane_reads::stage_samples(
        arithmetic,
        equation.excitation.and_then(|e| e.base.as_ref()),
        i,
    );
    for (s, stage) in stages.iter_mut().enumerate().take(S) {
        let q = tableau.position[s] as usize;
        let push = force[q] * inverse_mass[q];
        let input = push - base[q];
        let [next, end] = factors(tableau, equation.dt, s);
        stage.next.input = (input * Eight::splat(arithmetic, next)).row();
        stage.end.input = (input * Eight::splat(arithmetic, end)).row();
    }
}

/// Factors of the acceleration of stage `s` in the next stage, the only one that depends on it, and at the end of the step,
/// times the step.
#[inline(always)]
fn factors<const S: usize>(tableau: &Tableau<S>, dt: f64, s: usize) -> [f64; 2] {
    let next = if s + 1 < S { tableau.a[s + 1][s] } else { 0.0 };
    [dt * next, dt * tableau.b[s]]
}

/// One step, in lane `l` of the rates.
///
/// Sums follow the order in which their terms become available: the displacement of a stage before its velocity, and at the
/// first stage before the initial velocity.
#[inline(always)]
#[allow(
    clippy::too_many_arguments,
    reason = "a struct of them would not be kept in registers"
)]
fn step<const S: usize>(
    tableau: &Tableau<S>,
    stages: &[StageRates; STAGES],
    there: [bool; MOST_TERMS],
    width: f64,
    dt: f64,
    l: usize,
    y: &mut f64,
    v: &mut f64,
) {
    let (mut y_s, mut v_s) = (*y, *v);
    let (mut y_end, mut v_end) = (*y, *v);
    for (s, stage) in stages.iter().enumerate().take(S) {
        let phi = Phi::at(there, width, y_s, v_s);
        let [next, end] = factors(tableau, dt, s);
        if tableau.b[s] != 0.0 {
            y_end += end * v_s;
            let rates = &stage.end;
            v_end =
                phi.damped(rates, there, l, v_end) + phi.pushed(rates, there, l, rates.input[l]);
        }
        if s + 1 < S {
            y_s = *y + next * v_s;
            let rates = &stage.next;
            let input = rates.input[l];
            let pushed = match s {
                0 => *v + phi.pushed(rates, there, l, input),
                _ => phi.pushed(rates, there, l, *v + input),
            };
            v_s = phi.damped(rates, there, l, pushed);
        }
    }
    (*y, *v) = (y_end, v_end);
}

/// Factor `phi` of each function at one stage; for springs of higher powers without one factor `y`.
#[derive(Clone, Copy)]
struct Phi([f64; MOST_TERMS]);

impl Phi {
    #[inline(always)]
    fn at(there: [bool; MOST_TERMS], width: f64, y: f64, v: f64) -> Self {
        let mut phi = [0.0; MOST_TERMS];
        phi[OFFSET] = 1.0;
        phi[STIFFNESS] = y;
        phi[DAMPING] = v;
        if there[CUBIC_STIFFNESS] {
            phi[CUBIC_STIFFNESS] = y * y;
        }
        if there[QUADRATIC_STIFFNESS] {
            phi[QUADRATIC_STIFFNESS] = y;
        }
        if there[QUINTIC_STIFFNESS] {
            phi[QUINTIC_STIFFNESS] = (y * y) * (y * y);
        }
        if there[QUADRATIC_DAMPING] {
            phi[QUADRATIC_DAMPING] = Term::QuadraticDamping.phi(y, v);
        }
        if there[COULOMB_FRICTION] {
            phi[COULOMB_FRICTION] = Term::CoulombFriction { width }.phi(y, v);
        }
        Self(phi)
    }

    /// Adds the forces that depend on the displacement to `sum`.
    #[inline(always)]
    fn pushed(self, rates: &Rates, there: [bool; MOST_TERMS], l: usize, sum: f64) -> f64 {
        let Self(phi) = self;
        let mut sum = sum;
        for kind in [OFFSET, STIFFNESS] {
            if there[kind] {
                sum -= rates.kinds[kind][l] * phi[kind];
            }
        }
        for kind in [CUBIC_STIFFNESS, QUADRATIC_STIFFNESS, QUINTIC_STIFFNESS] {
            if there[kind] {
                // In independent pairs.
                let slope = rates.kinds[kind][l] * phi[STIFFNESS];
                sum -= slope * phi[kind];
            }
        }
        sum
    }

    /// Adds the forces that depend on the velocity to `sum`.
    #[inline(always)]
    fn damped(self, rates: &Rates, there: [bool; MOST_TERMS], l: usize, sum: f64) -> f64 {
        let mut sum = sum;
        for kind in [DAMPING, QUADRATIC_DAMPING, COULOMB_FRICTION] {
            if there[kind] {
                sum -= rates.kinds[kind][l] * self.0[kind];
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Engine, reference};
    use crate::system::{Excitation, Grid, NodalCoefficients, System};

    /// Rates of constants are computed once, those of varying functions anew: each function in turn varies after the first
    /// eight steps.
    #[test]
    fn functions_that_vary_after_the_first_eight_steps_are_recomputed() {
        let system = System {
            grid: Grid::new(0.0, 2.0, 41).expect("a grid"),
            method: Method::Rk4,
            terms: vec![Term::Damping, Term::Stiffness, Term::CubicStiffness],
        };
        let input: Vec<f64> = (0..41).map(|i| (0.3 * f64::from(i)).sin()).collect();
        let excitation = Excitation::force_at_nodes(&input);
        let initial = State {
            displacement: 0.4,
            velocity: -0.2,
        };
        for moving in 0..=4 {
            let values = |f: usize, value: f64| -> Vec<f64> {
                let grows = |i: usize| {
                    if f == moving && i > 9 {
                        0.02 * i as f64
                    } else {
                        0.0
                    }
                };
                (0..41).map(|i| value + grows(i)).collect()
            };
            let nodal = NodalCoefficients {
                mass: values(0, 1.2),
                coefficients: vec![values(1, 0.3), values(2, 5.0), values(3, 2.0)],
            };
            let zeros = || Trajectory::zeros(41);
            let (mut fast, mut plain, input) = (zeros(), zeros(), Some(&excitation));
            Engine::Prefactored
                .forward_into(&system, &nodal, initial, input, &mut fast)
                .expect("a motion");
            reference::forward_into(&system, &nodal, initial, input, &mut plain).expect("a motion");
            let pairs = (fast.displacement.iter().zip(&plain.displacement))
                .chain(fast.velocity.iter().zip(&plain.velocity));
            for (fast, plain) in pairs {
                assert!((fast - plain).abs() <= 1e-14, "{moving}: {fast} {plain}");
            }
        }
    }
}
