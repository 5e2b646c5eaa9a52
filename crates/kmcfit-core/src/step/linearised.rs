//! Linearisation of eight steps at once about a known response.

use super::stage::{EightSteps, Model, Pair, Stage, Stages, Values, eight, increment};
use super::tableau::Tableau;
use crate::simd::{Arithmetic, Eight, Real, Row};
use crate::structure::Link;

/// Block matrix `[[qq, qv], [vq, vv]]`.
pub(crate) type Blocks<T, const N: usize> = [[[[T; N]; N]; 2]; 2];

/// Accelerations `f + K q + C v` of a change from zero, with the matrices of each stage.
pub(super) struct Change<'a, T, const N: usize, const S: usize> {
    pub matrices: &'a [[[[T; N]; N]; 2]; S],
    pub accelerations: &'a [[T; N]; S],
}

impl<T: Real, const N: usize, const S: usize> Stages<T, N> for Change<'_, T, N, S> {
    #[inline(always)]
    fn accelerations(&mut self, s: usize, q: &[T; N], v: &[T; N]) -> [T; N] {
        let (mut a, matrices) = (self.accelerations[s], &self.matrices[s]);
        for i in 0..N {
            for j in 0..N {
                // Zero: at the first stage the state, at the second the displacement.
                if s > 0 {
                    a[i] = a[i] + matrices[1][i][j] * v[j];
                }
                if s > 1 {
                    a[i] = a[i] + matrices[0][i][j] * q[j];
                }
            }
        }
        a
    }
}

/// Matrices of eight steps minus the identity, from the derivatives of the accelerations at their stages.
#[inline(always)]
pub(super) fn step_matrices<A: Arithmetic, const N: usize, const S: usize>(
    tableau: &Tableau<S>,
    dt: f64,
    stages: &[[[[Eight<A>; N]; N]; 2]; S],
    matrices: &mut Blocks<Row, N>,
    zero: Eight<A>,
) {
    for b in 0..2 {
        for j in 0..N {
            let (mut dq, mut dv, mut sum) = ([zero; N], [zero; N], [[zero; N]; 2]);
            for s in 0..S {
                let mut a = [zero; N];
                for i in 0..N {
                    a[i] = stages[s][b][i][j];
                    if s >= 1 {
                        for c in 0..N {
                            a[i] += stages[s][1][i][c] * dv[c];
                        }
                    }
                    if s == 1 && b == 1 {
                        a[i] += stages[s][0][i][j].scale(dt * tableau.next[0]);
                    }
                    if s >= 2 {
                        for c in 0..N {
                            a[i] += stages[s][0][i][c] * dq[c];
                        }
                    }
                }
                if tableau.end[s] != 0.0 {
                    let h = dt * tableau.end[s];
                    for i in 0..N {
                        if s >= 1 {
                            sum[0][i] += dv[i].scale(h);
                        }
                        sum[1][i] += a[i].scale(h);
                    }
                }
                if s + 1 < S {
                    let h = dt * tableau.next[s];
                    for i in 0..N {
                        dq[i] = dv[i].scale(h);
                        dv[i] = a[i].scale(h);
                    }
                    if b == 1 {
                        dq[j] += zero.like(h);
                    }
                }
            }
            if b == 1 {
                sum[0][j] += zero.like(dt);
            }
            for i in 0..N {
                matrices[0][b][i][j] = sum[0][i].row();
                matrices[1][b][i][j] = sum[1][i].row();
            }
        }
    }
}

/// Eight steps about known states: derivatives and accelerations at their stages.
pub(super) struct Linearised<T, const N: usize, const E: usize, const S: usize> {
    slopes: [[[Option<T>; 2]; E]; S],
    /// Derivatives of the accelerations with respect to displacements and velocities.
    pub matrices: [[[[T; N]; N]; 2]; S],
    stages: [Stage<T, N, E>; S],
    /// Absolute accelerations.
    absolute: [[T; N]; S],
    phi: [[T; E]; S],
    /// Increment of the state.
    pub increment: Pair<T, N>,
}

/// Derivatives with respect to a function's values at the left end, the middle and the right end of a step.
pub(super) type Shares<T> = [T; 3];

impl<A: Arithmetic, const N: usize, const E: usize, const S: usize> Linearised<Eight<A>, N, E, S> {
    #[inline(always)]
    pub fn nothing(zero: Eight<A>) -> Self {
        let stage = Stage {
            inverse_masses: [zero; N],
            p: [zero; E],
            drives: None,
        };
        Linearised {
            slopes: [[[None; 2]; E]; S],
            matrices: [[[[zero; N]; N]; 2]; S],
            stages: [stage; S],
            absolute: [[zero; N]; S],
            phi: [[zero; E]; S],
            increment: [[zero; N]; 2],
        }
    }

    /// Linearises the steps from `from` about `states`; `is_known` for a linear structure with the functions of the steps linearised before.
    #[inline(always)]
    pub fn set(
        &mut self,
        arithmetic: A,
        model: Model<N, E, S>,
        states: &[[&[f64]; N]; 2],
        from: usize,
        is_known: bool,
    ) {
        let mut x = [[Eight::splat(arithmetic, 0.0); N]; 2];
        for k in 0..2 {
            for j in 0..N {
                x[k][j] = eight(arithmetic, states[k][j], from);
            }
        }
        let mut stages = LinearisedStages {
            model,
            values: EightSteps(arithmetic, model, from),
            out: self,
            is_known,
        };
        self.increment = increment(model.tableau, model.dt, &x, &mut stages);
    }

    /// Contributions to derivatives by multipliers `y` of the states at the right nodes: stage by stage backwards, with the multipliers
    /// `w` of the accelerations over the masses.
    #[inline(always)]
    pub fn back(&self, model: Model<N, E, S>, y: &Pair<Eight<A>, N>) -> Transposed<Eight<A>, N, E> {
        let zero = y[0][0].like(0.0);
        let mut out = Transposed {
            masses: [[zero; 3]; N],
            elements: [[zero; 3]; E],
            forces: [[zero; 3]; N],
            bases: [[zero; 3]; N],
        };
        let mut bar = [[zero; N]; 2];
        for s in (0..S).rev() {
            let mut by = [[zero; N]; 2];
            for k in 0..2 {
                for j in 0..N {
                    if model.tableau.end[s] != 0.0 {
                        by[k][j] = y[k][j].scale(model.dt * model.tableau.end[s]);
                    }
                    if s + 1 < S {
                        by[k][j] += bar[k][j].scale(model.dt * model.tableau.next[s]);
                    }
                }
            }
            let mut w = [zero; N];
            let at = model.tableau.at[s] as usize;
            for j in 0..N {
                w[j] = by[1][j] * self.stages[s].inverse_masses[j];
                out.masses[j][at] = out.masses[j][at] - w[j] * self.absolute[s][j];
                out.forces[j][at] += w[j];
                out.bases[j][at] = out.bases[j][at] - by[1][j];
            }
            bar = [[zero; N], by[0]];
            for (e, element) in model.elements().iter().enumerate().take(E) {
                let across = element.across(&w);
                out.elements[e][at] = out.elements[e][at] - across * self.phi[s][e];
                self.resist(s, e, *element, across, &mut bar);
            }
        }
        out
    }

    /// Takes the forces by which an element answers multipliers from `bar`.
    #[inline(always)]
    fn resist(
        &self,
        s: usize,
        e: usize,
        element: Link,
        across: Eight<A>,
        bar: &mut Pair<Eight<A>, N>,
    ) {
        let (i, to) = element.ends::<N>();
        for k in 0..2 {
            let Some(slope) = self.slopes[s][e][k] else {
                continue;
            };
            let force = slope * across;
            bar[k][i] = bar[k][i] - force;
            if let Some(j) = to {
                bar[k][j] += force;
            }
        }
    }
}

/// Transpose of eight linearised steps, applied to multipliers.
pub(super) struct Transposed<T, const N: usize, const E: usize> {
    pub masses: [Shares<T>; N],
    pub elements: [Shares<T>; E],
    pub forces: [Shares<T>; N],
    pub bases: [Shares<T>; N],
}

struct LinearisedStages<'a, 'm, A: Arithmetic, const N: usize, const E: usize, const S: usize> {
    model: Model<'m, N, E, S>,
    values: EightSteps<'m, A, N, E, S>,
    out: &'a mut Linearised<Eight<A>, N, E, S>,
    is_known: bool,
}

impl<A: Arithmetic, const N: usize, const E: usize, const S: usize> Stages<Eight<A>, N>
    for LinearisedStages<'_, '_, A, N, E, S>
{
    #[inline(always)]
    fn accelerations(&mut self, s: usize, q: &[Eight<A>; N], v: &[Eight<A>; N]) -> [Eight<A>; N] {
        let (model, out) = (self.model, &mut *self.out);
        let (elements, at) = (model.elements(), model.tableau.at[s]);
        let stage = &mut out.stages[s];
        if self.is_known {
            stage.drives = self.values.drives(at);
        } else {
            *stage = Stage::read(&self.values, elements.len(), at);
            out.slopes[s] = stage.slopes(elements, q, v);
            let zero = q[0].like(0.0);
            stage.matrices(elements, &out.slopes[s], &mut out.matrices[s], zero);
        }
        let (a, phi) = stage.accelerations(elements, q, v);
        out.phi[s] = phi;
        for j in 0..N {
            out.absolute[s][j] = match &stage.drives {
                Some([_, bases]) => a[j] + bases[j],
                None => a[j],
            };
        }
        a
    }
}

/// Derivatives with respect to the values at the left and the right nodes, from those at the stages.
#[inline(always)]
pub(super) fn at_ends<A: Arithmetic>([left, middle, right]: Shares<Eight<A>>) -> [Eight<A>; 2] {
    let middle = middle.scale(0.5);
    [left + middle, right + middle]
}
