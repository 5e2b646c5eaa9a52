//! Derivatives of the state at the right node of each step, for eight steps at a time.

use super::linearised::{Linearised, at_ends, step_matrices};
use super::stage::Model;
use crate::simd::{Aligned, Arithmetic, Eight, Kernel, LANES, Real, Row};

/// Derivatives of the `D` components of the state (displacements, then velocities) at the right nodes of eight steps, one step per
/// lane, with `F` functions, masses first. The last index is the component at the right node.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct StepMaps<const D: usize, const F: usize> {
    /// Increment of the state.
    pub increment: [Row; D],
    /// With respect to the components at the left node, minus the identity: first index the component at the right node.
    pub growth: [[Row; D]; D],
    /// With respect to each function's value at the left node.
    pub left: [[Row; D]; F],
    /// With respect to each function's value at the right node.
    pub right: [[Row; D]; F],
    /// With respect to a value equal at both nodes.
    pub sum: [[Row; D]; F],
    /// With respect to the forces on the coordinates at the left and at the right node, between which they are linear.
    pub forces: [[[Row; D]; 2]; D],
    /// With respect to the accelerations of the frames, likewise.
    pub bases: [[[Row; D]; 2]; D],
}

impl<const D: usize, const F: usize> StepMaps<D, F> {
    pub const NOTHING: Self = Self {
        increment: [[0.0; LANES]; D],
        growth: [[[0.0; LANES]; D]; D],
        left: [[[0.0; LANES]; D]; F],
        right: [[[0.0; LANES]; D]; F],
        sum: [[[0.0; LANES]; D]; F],
        forces: [[[[0.0; LANES]; D]; 2]; D],
        bases: [[[[0.0; LANES]; D]; 2]; D],
    };
}

/// Requested derivatives, masses first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wanted<const F: usize> {
    /// With respect to the values at both nodes.
    pub ends: [bool; F],
    /// With respect to a value equal at both nodes.
    pub sum: [bool; F],
    /// With respect to forces and accelerations of the frames.
    pub inputs: bool,
}

impl<const F: usize> Default for Wanted<F> {
    fn default() -> Self {
        Self {
            ends: [false; F],
            sum: [false; F],
            inputs: false,
        }
    }
}

/// Linearises the steps from `from` about `states`, which need not satisfy the equation of motion.
pub(crate) struct Linearise<
    'a,
    const N: usize,
    const E: usize,
    const S: usize,
    const D: usize,
    const F: usize,
> {
    pub model: Model<'a, N, E, S>,
    pub states: [[&'a [f64]; N]; 2],
    pub from: usize,
    pub wanted: &'a Wanted<F>,
    pub maps: &'a mut StepMaps<D, F>,
}

impl<const N: usize, const E: usize, const S: usize, const D: usize, const F: usize> Kernel
    for Linearise<'_, N, E, S, D, F>
{
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let Linearise {
            model,
            states,
            from,
            wanted,
            maps,
        } = self;
        let zero = Eight::splat(arithmetic, 0.0);
        let mut linearised = Linearised::<_, N, E, S>::nothing(zero);
        linearised.set(arithmetic, model, &states, from, false);
        let mut matrices = Aligned([[[[[0.0; LANES]; N]; N]; 2]; 2]);
        let (tableau, dt) = (model.tableau, model.dt);
        step_matrices(tableau, dt, &linearised.matrices, &mut matrices, zero);
        let functions = N + model.elements().len().min(E);
        for end in 0..D {
            let (k, i) = (end / N, end % N);
            maps.increment[end] = linearised.increment[k][i].row();
            for b in 0..2 {
                for j in 0..N {
                    maps.growth[end][b * N + j] = matrices[k][b][i][j];
                }
            }
            let mut y = [[zero; N]; 2];
            y[k][i] = zero.like(1.0);
            let found = linearised.back(model, &y);
            for f in 0..functions.min(F) {
                let shares = match f.checked_sub(N) {
                    None => found.masses[f],
                    Some(e) => found.elements[e],
                };
                let [left, right] = at_ends(shares);
                if wanted.ends[f] {
                    (maps.left[f][end], maps.right[f][end]) = (left.row(), right.row());
                }
                if wanted.sum[f] {
                    maps.sum[f][end] = (left + right).row();
                }
            }
            if wanted.inputs {
                for j in 0..N {
                    maps.forces[j]
                        .iter_mut()
                        .zip(at_ends(found.forces[j]))
                        .for_each(|(to, x)| to[end] = x.row());
                    maps.bases[j]
                        .iter_mut()
                        .zip(at_ends(found.bases[j]))
                        .for_each(|(to, x)| to[end] = x.row());
                }
            }
        }
    }
}
