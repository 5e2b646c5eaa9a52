//! The discrete adjoint: the exact transpose of the tangent, eight steps at a time.

use super::linearised::{Linearised, at_ends, step_matrices};
use super::response::apply;
use super::stage::{Model, Pair};
use crate::simd::{Aligned, Arithmetic, Eight, Kernel, LANES};

/// Derivatives with respect to the functions, masses first, to which an adjoint adds.
pub(crate) enum Gradient<'a> {
    /// With respect to nodal values.
    AtNodes(Vec<&'a mut [f64]>),
    /// Sums over the nodes: with respect to constants.
    Summed(&'a mut [f64]),
}

/// Adjoint of a cost with the derivatives `source` with respect to displacements and velocities at all nodes of the response
/// `states`; returns the derivatives with respect to the initial state.
pub(crate) struct Adjoint<'a, const N: usize, const E: usize, const S: usize> {
    pub model: Model<'a, N, E, S>,
    pub states: [[&'a [f64]; N]; 2],
    pub source: [[&'a [f64]; N]; 2],
    pub gradient: Gradient<'a>,
}

impl<const N: usize, const E: usize, const S: usize> Kernel for Adjoint<'_, N, E, S> {
    type Output = Pair<f64, N>;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> Pair<f64, N> {
        let Adjoint {
            model,
            states,
            source,
            mut gradient,
        } = self;
        let zero = Eight::splat(arithmetic, 0.0);
        let last = states[0][0].len() - 1;
        let mut y = [[0.0; N]; 2];
        for k in 0..2 {
            for j in 0..N {
                y[k][j] = source[k][j][last];
            }
        }
        let mut matrices = Aligned([[[[[0.0; LANES]; N]; N]; 2]; 2]);
        let mut ends = Aligned([[[0.0; LANES]; N]; 2]);
        let mut linearised = Linearised::<_, N, E, S>::nothing(zero);
        let functions = N + model.elements().len().min(E);
        let is_linear = model.elements().iter().all(|e| e.law.is_linear());
        let mut to = last;
        while to > 0 {
            let from = (to - 1) / LANES * LANES;
            let is_known = to < last && is_linear && model.is_constant(from);
            linearised.set(arithmetic, model, &states, from, is_known);
            let (tableau, dt) = (model.tableau, model.dt);
            if !is_known {
                step_matrices(tableau, dt, &linearised.matrices, &mut matrices, zero);
            }
            if to - from < LANES {
                *ends = [[[0.0; LANES]; N]; 2];
            }
            for l in (0..to - from).rev() {
                let mut push = [[0.0; N]; 2];
                for k in 0..2 {
                    for j in 0..N {
                        push[k][j] = source[k][j][from + l];
                        ends[k][j][l] = y[k][j];
                    }
                }
                y = apply::<N, true>(&matrices, l, &y, &push);
            }
            let mut multipliers = [[zero; N]; 2];
            for k in 0..2 {
                for j in 0..N {
                    multipliers[k][j] = Eight::load(arithmetic, &ends[k][j]);
                }
            }
            let found = linearised.back(model, &multipliers);
            for f in 0..functions {
                let shares = match f.checked_sub(N) {
                    None => found.masses[f],
                    Some(e) => found.elements[e],
                };
                let [left, right] = at_ends(shares);
                match &mut gradient {
                    Gradient::AtNodes(nodes) => {
                        spread(arithmetic, left, right, to - from, &mut nodes[f][from..]);
                    }
                    Gradient::Summed(sums) => sums[f] += (left + right).row().iter().sum::<f64>(),
                }
            }
            to = from;
        }
        y
    }
}

/// Adds the contributions of up to eight steps to their nodes.
#[inline(always)]
fn spread<A: Arithmetic>(
    arithmetic: A,
    left: Eight<A>,
    right: Eight<A>,
    steps: usize,
    g: &mut [f64],
) {
    let right = right.row();
    let mut before = [0.0; LANES];
    before[1..].copy_from_slice(&right[..LANES - 1]);
    let nodes = left + Eight::load(arithmetic, &before);
    match (steps, g.first_chunk_mut::<LANES>()) {
        (LANES, Some(g)) => *g = (Eight::load(arithmetic, g) + nodes).row(),
        _ => (g.iter_mut().zip(nodes.row()).take(steps)).for_each(|(g, x)| *g += x),
    }
    g[steps] += right[steps - 1];
}
