//! Responses: by the matrices of eight steps, and by stages prepared for eight steps.

use super::linearised::{Blocks, Change, step_matrices};
use super::stage::{EightSteps, Model, Pair, Stage, ahead, increment};
use crate::simd::{Aligned, Arithmetic, Eight, Kernel, LANES, Real, Row};

/// Displacements and velocities at all nodes, to be written.
pub(crate) type States<'a, const N: usize> = [[&'a mut [f64]; N]; 2];

#[inline(always)]
fn put<const N: usize>(states: &mut States<N>, i: usize, x: &Pair<f64, N>) {
    for k in 0..2 {
        for j in 0..N {
            states[k][j][i] = x[k][j];
        }
    }
}

/// Response of a linear structure: matrices of eight steps at once, then products.
pub(crate) struct Linear<'a, const N: usize, const E: usize, const S: usize> {
    pub model: Model<'a, N, E, S>,
    pub x: Pair<f64, N>,
    pub states: States<'a, N>,
}

impl<const N: usize, const E: usize, const S: usize> Kernel for Linear<'_, N, E, S> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let Linear {
            model,
            mut x,
            mut states,
        } = self;
        let zero = Eight::splat(arithmetic, 0.0);
        let steps = states[0][0].len() - 1;
        let mut matrices: Aligned<Blocks<Row, N>> = Aligned([[[[[0.0; LANES]; N]; N]; 2]; 2]);
        let mut push = Aligned([[[0.0; LANES]; N]; 2]);
        let (mut d, mut driven) = ([[[[zero; N]; N]; 2]; S], [[zero; N]; S]);
        put(&mut states, 0, &x);
        for from in (0..steps).step_by(LANES) {
            let values = EightSteps(arithmetic, model, from);
            let is_known = from > 0 && model.is_constant(from - LANES);
            if !is_known || model.drives.is_some() {
                for s in 0..S {
                    let at = model.tableau.at[s];
                    let count = model.elements().len();
                    let stage = Stage::<_, N, E>::read(&values, count, at);
                    if !is_known {
                        let slopes = stage.slopes(model.elements(), &[zero; N], &[zero; N]);
                        stage.matrices(model.elements(), &slopes, &mut d[s], zero);
                    }
                    if model.drives.is_some() {
                        driven[s] = stage.accelerations(&[], &[zero; N], &[zero; N]).0;
                    }
                }
            }
            if model.drives.is_some() {
                let mut change = Change {
                    matrices: &d,
                    accelerations: &driven,
                };
                let by = increment(model.tableau, model.dt, &[[zero; N]; 2], &mut change);
                for k in 0..2 {
                    for i in 0..N {
                        push[k][i] = by[k][i].row();
                    }
                }
            }
            if !is_known {
                step_matrices(model.tableau, model.dt, &d, &mut matrices, zero);
            }
            for l in 0..LANES.min(steps - from) {
                let mut by = [[0.0; N]; 2];
                if model.drives.is_some() {
                    for k in 0..2 {
                        for i in 0..N {
                            by[k][i] = push[k][i][l];
                        }
                    }
                }
                x = apply::<N, false>(&matrices, l, &x, &by);
                put(&mut states, from + l + 1, &x);
            }
        }
    }
}

#[inline(always)]
fn in_pairs<const N: usize>(mut terms: [f64; N]) -> f64 {
    let mut n = N;
    while n > 1 {
        for i in 0..n / 2 {
            terms[i] += terms[n - 1 - i];
        }
        n -= n / 2;
    }
    terms[0]
}

/// `(x + push) + E x` with the matrix `E` in lane `l`, or its transpose; `push` joins the sums that are known first.
#[inline(always)]
pub(super) fn apply<const N: usize, const TRANSPOSED: bool>(
    matrices: &Blocks<Row, N>,
    l: usize,
    x: &Pair<f64, N>,
    push: &Pair<f64, N>,
) -> Pair<f64, N> {
    let mut y = *x;
    for k in 0..2 {
        for i in 0..N {
            let mut p = [[0.0; N]; 2];
            for b in 0..2 {
                for j in 0..N {
                    let e = match TRANSPOSED {
                        true => &matrices[b][k][j][i],
                        false => &matrices[k][b][i][j],
                    };
                    p[b][j] = e[l] * x[b][j];
                }
            }
            let (own, other) = (in_pairs(p[k]), in_pairs(p[1 - k]));
            y[k][i] = (x[k][i] + other) + (push[k][i] + own);
        }
    }
    y
}

/// Response of any structure: coefficients over masses, times step and tableau, for eight steps at once, then stage by stage.
pub(crate) struct Prepared<'a, const N: usize, const E: usize, const S: usize> {
    pub model: Model<'a, N, E, S>,
    pub x: Pair<f64, N>,
    pub states: States<'a, N>,
}

/// Rates of the stages of eight steps.
#[derive(Clone, Copy)]
struct Rates<const N: usize, const E: usize> {
    /// Of each element at both ends: to the next stage, or the end of the step for the last stage.
    elements: [[Row; 2]; E],
    drives: [Row; N],
}

impl<const N: usize, const E: usize, const S: usize> Kernel for Prepared<'_, N, E, S> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let Prepared {
            model,
            mut x,
            mut states,
        } = self;
        let zero = Eight::splat(arithmetic, 0.0);
        let (tableau, steps) = (model.tableau, states[0][0].len() - 1);
        put(&mut states, 0, &x);
        let nothing = Rates {
            elements: [[[0.0; LANES]; 2]; E],
            drives: [[0.0; LANES]; N],
        };
        let mut rates = Aligned([nothing; S]);
        for from in (0..steps).step_by(LANES) {
            let values = EightSteps(arithmetic, model, from);
            for s in 0..S {
                let factor = if s + 1 < S {
                    tableau.next[s]
                } else {
                    tableau.end[s]
                };
                let h = model.dt * factor;
                let count = model.elements().len();
                let stage = Stage::<_, N, E>::read(&values, count, tableau.at[s]);
                for (e, element) in model.elements().iter().enumerate().take(E) {
                    let p = stage.p[e].scale(h);
                    let (i, to) = element.ends::<N>();
                    rates[s].elements[e][0] = (p * stage.inverse_masses[i]).row();
                    if let Some(j) = to {
                        rates[s].elements[e][1] = (p * stage.inverse_masses[j]).row();
                    }
                }
                if model.drives.is_some() {
                    let by = stage.accelerations(&[], &[zero; N], &[zero; N]).0;
                    for i in 0..N {
                        rates[s].drives[i] = by[i].scale(h).row();
                    }
                }
            }
            for l in 0..LANES.min(steps - from) {
                x = prepared_step(&model, &rates, l, &x);
                put(&mut states, from + l + 1, &x);
            }
        }
    }
}

/// One step, in lane `l` of the rates.
#[inline(always)]
fn prepared_step<const N: usize, const E: usize, const S: usize>(
    model: &Model<N, E, S>,
    rates: &[Rates<N, E>; S],
    l: usize,
    x: &Pair<f64, N>,
) -> Pair<f64, N> {
    let (tableau, dt) = (model.tableau, model.dt);
    let [mut q, mut v] = *x;
    let mut end = *x;
    for s in 0..S {
        let is_last = s + 1 == S;
        // The last stage is added to the end, which is known last.
        let mut next = if is_last { [0.0; N] } else { x[1] };
        if model.drives.is_some() {
            for i in 0..N {
                next[i] += rates[s].drives[i][l];
            }
        }
        // Forwards: roots and quotients of friction, which take longest, stand behind springs and dampers.
        for (e, element) in model.elements().iter().enumerate().take(E) {
            let phi = element.law.phi(element.across(&q), element.across(&v));
            let rate = &rates[s].elements[e];
            let (i, to) = element.ends::<N>();
            next[i] -= rate[0][l] * phi;
            if let Some(j) = to {
                next[j] += rate[1][l] * phi;
            }
        }
        if tableau.end[s] != 0.0 {
            for i in 0..N {
                end[0][i] += dt * tableau.end[s] * v[i];
                end[1][i] += match is_last {
                    true => next[i],
                    false => tableau.end[s] / tableau.next[s] * (next[i] - x[1][i]),
                };
            }
        }
        q = ahead(&x[0], dt * tableau.next[s], &v);
        v = next;
    }
    end
}
