//! The forward solve with what does not depend on the motion made ahead, eight steps at a time: each
//! function by the mass, and the drive. What is left of a step are products and sums of its states.

use super::stages::Rhs;
use super::tableau::{MIDPOINT, Position, RK4, Tableau};
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

/// `p/m` of each kind of term, and the drive `f/m - b''`, over eight steps at the three positions.
struct Rates {
    kinds: [[Row; 3]; MOST_TERMS],
    drive: [Row; 3],
}

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
        let mut rates = Rates {
            kinds: [[[0.0; LANES]; 3]; MOST_TERMS],
            drive: [[0.0; LANES]; 3],
        };
        let (mut y, mut v) = (self.initial.displacement, self.initial.velocity);
        let motion = &mut *self.trajectory;
        let steps = motion.nodes() - 1;
        (motion.displacement[0], motion.velocity[0]) = (y, v);
        let mut from = 0;
        while from < steps {
            prepare(arithmetic, &self.rhs, &self.kinds, from, &mut rates);
            let to = (from + LANES).min(steps);
            let ends = motion.displacement[from + 1..=to]
                .iter_mut()
                .zip(&mut motion.velocity[from + 1..=to]);
            for (l, (end_y, end_v)) in ends.enumerate() {
                step(
                    tableau,
                    &rates,
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
fn prepare<A: Arithmetic>(
    arithmetic: A,
    rhs: &Rhs,
    kinds: &[Option<usize>; MOST_TERMS],
    i: usize,
    rates: &mut Rates,
) {
    let (one, half) = (Eight::splat(arithmetic, 1.0), Eight::splat(arithmetic, 0.5));
    let left = Eight::load(arithmetic, &window::row(&rhs.device.mass, i));
    let right = Eight::load(arithmetic, &window::row(&rhs.device.mass, i + 1));
    let per_mass = [one / left, one / ((right + left) * half), one / right];
    for (rate, kind) in rates.kinds.iter_mut().zip(kinds) {
        let Some(j) = *kind else {
            continue;
        };
        let p = &rhs.device.coefficients[j];
        let left = Eight::load(arithmetic, &window::row(p, i));
        let right = Eight::load(arithmetic, &window::row(p, i + 1));
        let p = [left, (right + left) * half, right];
        for q in 0..3 {
            rate[q] = (p[q] * per_mass[q]).row();
        }
    }
    let force = window::stepwise(rhs.excitation.and_then(|e| e.force.as_ref()), i);
    let base = window::stepwise(rhs.excitation.and_then(|e| e.base.as_ref()), i);
    for q in 0..3 {
        let push = Eight::load(arithmetic, &force[q]) * per_mass[q];
        rates.drive[q] = (push - Eight::load(arithmetic, &base[q])).row();
    }
}

/// One step, in lane `l` of the rates.
#[inline(always)]
#[allow(
    clippy::too_many_arguments,
    reason = "a struct of them would not be kept in registers"
)]
fn step<const S: usize>(
    tableau: &Tableau<S>,
    rates: &Rates,
    there: [bool; MOST_TERMS],
    width: f64,
    dt: f64,
    l: usize,
    y: &mut f64,
    v: &mut f64,
) {
    let [mut vs, mut accelerations] = [[0.0; S]; 2];
    for s in 0..S {
        let (mut y_s, mut v_s) = (*y, *v);
        for r in 0..s {
            if tableau.a[s][r] != 0.0 {
                let h = dt * tableau.a[s][r];
                y_s += h * vs[r];
                v_s += h * accelerations[r];
            }
        }
        let position = match tableau.position[s] {
            Position::Left => 0,
            Position::Middle => 1,
            Position::Right => 2,
        };
        // What needs the velocity comes last: it is the last to be known.
        let mut a = rates.drive[position][l];
        if there[OFFSET] {
            a -= rates.kinds[OFFSET][position][l];
        }
        if there[STIFFNESS] {
            a -= rates.kinds[STIFFNESS][position][l] * y_s;
        }
        if there[CUBIC_STIFFNESS] {
            a -= rates.kinds[CUBIC_STIFFNESS][position][l] * (y_s * y_s * y_s);
        }
        if there[DAMPING] {
            a -= rates.kinds[DAMPING][position][l] * v_s;
        }
        if there[QUADRATIC_DAMPING] {
            a -= rates.kinds[QUADRATIC_DAMPING][position][l] * Term::QuadraticDamping.phi(y_s, v_s);
        }
        if there[COULOMB_FRICTION] {
            let phi = Term::CoulombFriction { width }.phi(y_s, v_s);
            a -= rates.kinds[COULOMB_FRICTION][position][l] * phi;
        }
        (vs[s], accelerations[s]) = (v_s, a);
    }
    let [mut by_y, mut by_v] = [0.0; 2];
    for s in 0..S {
        if tableau.b[s] != 0.0 {
            let h = dt * tableau.b[s];
            by_y += h * vs[s];
            by_v += h * accelerations[s];
        }
    }
    *y += by_y;
    *v += by_v;
}
