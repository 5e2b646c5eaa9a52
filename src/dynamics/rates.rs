//! The forward solve with what does not depend on the motion made ahead, eight steps at a time: each
//! function by the mass, and the drive, times the step and the tableau's factors. What is left of a step
//! are products and sums of its states, in an order in which few wait for each other: a stage's velocity
//! waits for four operations on the displacement of the stage before.

use super::stages::Rhs;
use super::tableau::{MIDPOINT, RK4, Tableau};
use super::{MOST_TERMS, Method, State, Term, Trajectory, window};
use crate::lanes::{self, Arithmetic, Eight, Kernel, LANES, Row};

/// The motion, which differs from that of the paper's order of operations by rounding. `false` if
/// a kind of term is there twice: then nothing is done.
pub(super) fn forward(
    rhs: Rhs,
    method: Method,
    initial: State,
    trajectory: &mut Trajectory,
) -> bool {
    let mut kinds = [None; MOST_TERMS];
    for (j, term) in rhs.terms.iter().enumerate() {
        if kinds[place(*term)].replace(j).is_some() {
            return false;
        }
    }
    let width = rhs.terms.iter().find_map(|term| match term {
        Term::CoulombFriction { width } => Some(*width),
        _ => None,
    });
    lanes::run(Forward {
        rhs,
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

fn place(term: Term) -> usize {
    match term {
        Term::Stiffness => STIFFNESS,
        Term::Damping => DAMPING,
        Term::CubicStiffness => CUBIC_STIFFNESS,
        Term::Offset => OFFSET,
        Term::QuadraticDamping => QUADRATIC_DAMPING,
        Term::CoulombFriction { .. } => COULOMB_FRICTION,
    }
}

/// Most stages of a tableau.
const STAGES: usize = 4;

/// `h p/m` of each kind of term, and `h (f/m - b'')`, over eight steps; `h` is the step times a factor of
/// the tableau.
#[derive(Clone, Copy)]
struct Rates {
    kinds: [Row; MOST_TERMS],
    drive: Row,
}

/// What the acceleration of a stage brings.
#[derive(Clone, Copy)]
struct Brought {
    /// To the velocity of the next stage.
    next: Rates,
    /// To the velocity at the right node.
    end: Rates,
}

const NOTHING: Brought = {
    let rates = Rates {
        kinds: [[0.0; LANES]; MOST_TERMS],
        drive: [0.0; LANES],
    };
    Brought {
        next: rates,
        end: rates,
    }
};

struct Forward<'a> {
    rhs: Rhs<'a>,
    method: Method,
    /// The term of each kind.
    kinds: [Option<usize>; MOST_TERMS],
    width: f64,
    initial: State,
    trajectory: &'a mut Trajectory,
}

impl Kernel for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let there = self.kinds.map(|kind| kind.is_some());
        match (self.method, there) {
            // Such lists are known when this is compiled.
            (Method::Midpoint, [true, true, false, false, false, false]) => {
                self.sweep(
                    arithmetic,
                    &MIDPOINT,
                    [true, true, false, false, false, false],
                );
            }
            (Method::Rk4, [true, true, false, false, false, false]) => {
                self.sweep(arithmetic, &RK4, [true, true, false, false, false, false]);
            }
            (Method::Rk4, [true, true, true, false, false, false]) => {
                self.sweep(arithmetic, &RK4, [true, true, true, false, false, false]);
            }
            (Method::Midpoint, there) => self.sweep(arithmetic, &MIDPOINT, there),
            (Method::Rk4, there) => self.sweep(arithmetic, &RK4, there),
        }
    }
}

impl Forward<'_> {
    #[inline(always)]
    fn sweep<A: Arithmetic, const S: usize>(
        self,
        arithmetic: A,
        tableau: &Tableau<S>,
        there: [bool; MOST_TERMS],
    ) {
        let mut brought = [NOTHING; STAGES];
        let (mut y, mut v) = (self.initial.displacement, self.initial.velocity);
        let motion = &mut *self.trajectory;
        let steps = motion.nodes() - 1;
        (motion.displacement[0], motion.velocity[0]) = (y, v);
        let mut from = 0;
        while from < steps {
            prepare(
                arithmetic,
                tableau,
                &self.rhs,
                &self.kinds,
                from,
                &mut brought,
            );
            let to = (from + LANES).min(steps);
            let ends = motion.displacement[from + 1..=to]
                .iter_mut()
                .zip(&mut motion.velocity[from + 1..=to]);
            for (l, (end_y, end_v)) in ends.enumerate() {
                step(
                    tableau,
                    &brought,
                    there,
                    self.width,
                    self.rhs.dt,
                    l & (LANES - 1),
                    &mut y,
                    &mut v,
                );
                (*end_y, *end_v) = (y, v);
            }
            from = to;
        }
    }
}

#[inline(always)]
fn prepare<A: Arithmetic, const S: usize>(
    arithmetic: A,
    tableau: &Tableau<S>,
    rhs: &Rhs,
    kinds: &[Option<usize>; MOST_TERMS],
    i: usize,
    brought: &mut [Brought; STAGES],
) {
    let (one, half) = (Eight::splat(arithmetic, 1.0), Eight::splat(arithmetic, 0.5));
    let left = Eight::load(arithmetic, &window::row(&rhs.device.mass, i));
    let right = Eight::load(arithmetic, &window::row(&rhs.device.mass, i + 1));
    let per_mass = [one / left, one / ((right + left) * half), one / right];
    for (k, kind) in kinds.iter().enumerate() {
        let Some(j) = *kind else {
            continue;
        };
        let p = &rhs.device.coefficients[j];
        let left = Eight::load(arithmetic, &window::row(p, i));
        let right = Eight::load(arithmetic, &window::row(p, i + 1));
        let mut p = [left, (right + left) * half, right];
        for q in 0..3 {
            p[q] = p[q] * per_mass[q];
        }
        for (s, stage) in brought.iter_mut().enumerate().take(S) {
            let [next, end] = factors(tableau, rhs.dt, s);
            let p = p[tableau.position[s] as usize];
            stage.next.kinds[k] = (p * Eight::splat(arithmetic, next)).row();
            stage.end.kinds[k] = (p * Eight::splat(arithmetic, end)).row();
        }
    }
    let force = window::stepwise(rhs.excitation.and_then(|e| e.force.as_ref()), i);
    let base = window::stepwise(rhs.excitation.and_then(|e| e.base.as_ref()), i);
    for (s, stage) in brought.iter_mut().enumerate().take(S) {
        let q = tableau.position[s] as usize;
        let push = Eight::load(arithmetic, &force[q]) * per_mass[q];
        let drive = push - Eight::load(arithmetic, &base[q]);
        let [next, end] = factors(tableau, rhs.dt, s);
        stage.next.drive = (drive * Eight::splat(arithmetic, next)).row();
        stage.end.drive = (drive * Eight::splat(arithmetic, end)).row();
    }
}

/// The step times what the acceleration of stage `s` counts for the next stage, the only one that sees
/// it, and for the end of the step.
#[inline(always)]
fn factors<const S: usize>(tableau: &Tableau<S>, dt: f64, s: usize) -> [f64; 2] {
    let next = if s + 1 < S { tableau.a[s + 1][s] } else { 0.0 };
    [dt * next, dt * tableau.b[s]]
}

/// One step, in lane `l` of the rates.
#[inline(always)]
#[allow(
    clippy::too_many_arguments,
    reason = "a struct of them would not be kept in registers"
)]
fn step<const S: usize>(
    tableau: &Tableau<S>,
    brought: &[Brought; STAGES],
    there: [bool; MOST_TERMS],
    width: f64,
    dt: f64,
    l: usize,
    y: &mut f64,
    v: &mut f64,
) {
    let (mut y_s, mut v_s) = (*y, *v);
    let (mut y_end, mut v_end) = (*y, *v);
    for (s, stage) in brought.iter().enumerate().take(S) {
        let phi = Phi::at(there, width, y_s, v_s);
        let [next, end] = factors(tableau, dt, s);
        if end != 0.0 {
            y_end += end * v_s;
            v_end = phi.add(&stage.end, there, l, v_end);
        }
        if s + 1 < S {
            y_s = *y + next * v_s;
            v_s = phi.add(&stage.next, there, l, *v);
        }
    }
    (*y, *v) = (y_end, v_end);
}

/// What each term multiplies its function by, at one stage.
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
            phi[CUBIC_STIFFNESS] = y * y * y;
        }
        if there[QUADRATIC_DAMPING] {
            phi[QUADRATIC_DAMPING] = Term::QuadraticDamping.phi(y, v);
        }
        if there[COULOMB_FRICTION] {
            phi[COULOMB_FRICTION] = Term::CoulombFriction { width }.phi(y, v);
        }
        Self(phi)
    }

    /// `v + h y''`: what is known first is added first.
    #[inline(always)]
    fn add(self, rates: &Rates, there: [bool; MOST_TERMS], l: usize, v: f64) -> f64 {
        let mut v = v + rates.drive[l];
        for kind in [
            OFFSET,
            DAMPING,
            STIFFNESS,
            CUBIC_STIFFNESS,
            QUADRATIC_DAMPING,
            COULOMB_FRICTION,
        ] {
            if there[kind] {
                v -= rates.kinds[kind][l] * self.0[kind];
            }
        }
        v
    }
}
