//! Continuous adjoint (Eq. 13) with its coefficients computed eight steps at a time.

use super::lane_reads::stage_values;
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES, Row};
use crate::simulate::reference::{Adjoint, AdjointEquation};

/// [`AdjointEquation::solve`], bit-identical.
pub(crate) fn solve(equation: &AdjointEquation) -> Adjoint {
    let lists = equation.functions.each_ref().map(|f| &**f);
    let mut z = vec![0.0; lists[0].len()];
    let first_slope = simd::run(Sweep {
        dt: equation.dt,
        lists,
        z: &mut z,
    });
    Adjoint {
        displacement: z,
        first_slope,
    }
}

/// Number of functions of time in a step.
const LISTS: usize = 8;

/// Backward integration. The coefficients of eight steps are computed in SIMD lanes while the previous eight steps, which
/// depend on each other, are integrated.
struct Sweep<'a> {
    dt: f64,
    /// Nodal values of `m`, `m'`, `m''`, `C`, `C'`, `K`, `y` and `y_obs`.
    lists: [&'a [f64]; LISTS],
    /// Adjoint displacement at the nodes.
    z: &'a mut [f64],
}

/// Coefficients of eight steps, at the right node and at mid-step: `m`, `C - 2 m'`, `m'' - C' + K` and `2 (y - y_obs) / m`.
#[repr(align(64))]
struct StageCoefficients {
    mass: Row,
    damping: Row,
    stiffness: Row,
    source: Row,
}

impl StageCoefficients {
    /// Second derivative `z''` in step `j` at `(z, w) = (z, z')`.
    #[inline(always)]
    fn slope(&self, j: usize, w: f64, z: f64) -> f64 {
        let m = self.mass[j];
        w / m * self.damping[j] - z / m * self.stiffness[j] + self.source[j]
    }
}

impl Kernel for Sweep<'_> {
    /// Slope `z'` at the first node.
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> f64 {
        let Sweep { dt, lists, z } = self;
        let last = z.len() - 1;
        z[last] = 0.0;
        let (half_dt, mut w, mut next) = (0.5 * dt, 0.0, 0.0);
        for first in (0..last).step_by(LANES).rev() {
            let of = |list: usize| right_and_middle(arithmetic, lists[list], first);
            let [m, m1, m2, c] = [of(0), of(1), of(2), of(3)];
            let [c1, k, y, observed] = [of(4), of(5), of(6), of(7)];
            let at = [
                coefficients([m[0], m1[0], m2[0], c[0], c1[0], k[0], y[0], observed[0]]),
                coefficients([m[1], m1[1], m2[1], c[1], c1[1], k[1], y[1], observed[1]]),
            ];
            let end = last.min(first + LANES);
            for (j, out) in z[first..end].iter_mut().enumerate().rev() {
                let j = j & (LANES - 1);
                let middle_w = w - half_dt * at[0].slope(j, w, next);
                let middle = next - half_dt * w;
                w -= dt * at[1].slope(j, middle_w, middle);
                next -= dt * middle_w;
                *out = next;
            }
        }
        w
    }
}

/// Values at the right nodes of the eight steps from `first` on, and means with those at the left nodes.
#[inline(always)]
fn right_and_middle<A: Arithmetic>(arithmetic: A, f: &[f64], first: usize) -> [Eight<A>; 2] {
    let [_, middle, right] = stage_values(arithmetic, f, first);
    [right, middle]
}

/// Coefficients of eight steps at one stage, from the values there, in the order of [`Sweep::lists`].
#[inline(always)]
fn coefficients<A: Arithmetic>(values: [Eight<A>; LISTS]) -> StageCoefficients {
    let [m, m1, m2, c, c1, k, y, observed] = values;
    StageCoefficients {
        mass: m.row(),
        damping: (c - (m1 + m1)).row(),
        stiffness: (m2 - c1 + k).row(),
        source: ((y - observed + (y - observed)) / m).row(),
    }
}
