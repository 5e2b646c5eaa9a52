//! Eq. 13 with its coefficients formed eight steps at a time.

use super::padded_loads::places;
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES, Row};
use crate::simulate::reference::{Adjoint, AdjointEquation};

/// [`AdjointEquation::solve`], to the bit.
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

/// Functions of time that a step back needs.
const LISTS: usize = 8;

/// The way back. What a step needs and does not wait for is made for eight steps at a time, in lanes, between the steps
/// of the eight before, each of which waits for the one before it: so it takes no time of its own.
///
/// In a step the rate is divided by the mass twice, and all that follows waits for the quotients. A division takes 13 cycles,
/// a product with the reciprocal and what its rounding lost 7, and differs only where the quotient is next to the middle
/// between two numbers. So steps go on with the product while the division is done beside it; eight steps in which they
/// differ once are done again by divisions.
struct Sweep<'a> {
    dt: f64,
    /// `m`, `m'`, `m''`, `C`, `C'`, `K`, `y` and `y_obs` at the nodes.
    lists: [&'a [f64]; LISTS],
    /// The adjoint displacement at the nodes.
    z: &'a mut [f64],
}

/// What eight steps need, each at its right node and at mid-step: `m`, `C - 2 m'`, `m'' - C' + K` and `2 (y - y_obs) / m`, and
/// `1 / m` in two parts.
#[repr(align(64))]
struct Coefficients {
    mass: Row,
    damping: Row,
    stiffness: Row,
    source: Row,
    reciprocal: [Row; 2],
}

/// Eight steps back, or less.
struct Eighth<'a> {
    dt: f64,
    /// At the right nodes, and at mid-step.
    at: [Coefficients; 2],
    /// The adjoint displacement at the left nodes.
    z: &'a mut [f64],
}

impl Eighth<'_> {
    /// Goes back from `(z, z')`, with products in place of divisions if `FUSED`; whether these had the same bits.
    #[inline(always)]
    fn back<const FUSED: bool>(&mut self, [z, w]: [f64; 2]) -> ([f64; 2], bool) {
        let Self { dt, at, z: out } = self;
        let half_dt = 0.5 * *dt;
        let (mut z, mut w) = (z, w);
        let mut is_same = true;
        for (j, out) in out.iter_mut().enumerate().rev() {
            let mut slope = |at: &Coefficients, w: f64, z: f64| {
                let (m, [reciprocal, lost]) = (at.mass[j], &at.reciprocal);
                let divided = w / m;
                let mut quotient = divided;
                if FUSED {
                    quotient = w.mul_add(reciprocal[j], w * lost[j]);
                    is_same &= quotient == divided;
                }
                quotient * at.damping[j] - z / m * at.stiffness[j] + at.source[j]
            };
            let wh = w - half_dt * slope(&at[0], w, z);
            let zh = z - half_dt * w;
            w -= *dt * slope(&at[1], wh, zh);
            z -= *dt * wh;
            *out = z;
        }
        ([z, w], is_same)
    }
}

impl Kernel for Sweep<'_> {
    /// `z'` at the first node.
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> f64 {
        let Sweep { dt, lists, z } = self;
        let last = z.len() - 1;
        z[last] = 0.0;
        let mut state = [0.0; 2];
        for first in (0..last).step_by(LANES).rev() {
            let of = |list: usize| right_and_middle(arithmetic, lists[list], first);
            let [m, m1, m2, c] = [of(0), of(1), of(2), of(3)];
            let [c1, k, y, observed] = [of(4), of(5), of(6), of(7)];
            let at = [
                coefficients([m[0], m1[0], m2[0], c[0], c1[0], k[0], y[0], observed[0]]),
                coefficients([m[1], m1[1], m2[1], c[1], c1[1], k[1], y[1], observed[1]]),
            ];
            let end = last.min(first + LANES);
            let mut steps = Eighth {
                dt,
                at,
                z: &mut z[first..end],
            };
            let (mut after, mut is_same) = ([0.0; 2], false);
            if A::IS_FUSED {
                (after, is_same) = steps.back::<true>(state);
            }
            if !is_same {
                (after, _) = steps.back::<false>(state);
            }
            state = after;
        }
        state[1]
    }
}

/// Values at the right nodes of the eight steps from `first` on, and their means with those at the left nodes.
#[inline(always)]
fn right_and_middle<A: Arithmetic>(arithmetic: A, f: &[f64], first: usize) -> [Eight<A>; 2] {
    let [_, middle, right] = places(arithmetic, f, first);
    [right, middle]
}

/// What eight steps need at one place, from the values there, in the order of [`Sweep::lists`].
#[inline(always)]
fn coefficients<A: Arithmetic>(values: [Eight<A>; LISTS]) -> Coefficients {
    let [m, m1, m2, c, c1, k, y, observed] = values;
    let [reciprocal, lost] = m.reciprocal();
    Coefficients {
        mass: m.row(),
        damping: (c - (m1 + m1)).row(),
        stiffness: (m2 - c1 + k).row(),
        source: ((y - observed + (y - observed)) / m).row(),
        reciprocal: [reciprocal.row(), lost.row()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps with products, and the same with divisions; whether the products were the same.
    struct Both {
        mass: f64,
        rate: f64,
    }

    impl Kernel for Both {
        type Output = Option<([[f64; 2]; 2], bool)>;

        #[inline(always)]
        fn run<A: Arithmetic>(self, arithmetic: A) -> Self::Output {
            let of = |x: f64| Eight::splat(arithmetic, x);
            let values = || {
                [
                    of(self.mass),
                    of(0.0),
                    of(0.1),
                    of(0.3),
                    of(0.0),
                    of(2.0),
                    of(0.0),
                    of(0.0),
                ]
            };
            let mut z = [0.0; LANES];
            let mut steps = Eighth {
                dt: 0.01,
                at: [coefficients(values()), coefficients(values())],
                z: &mut z,
            };
            let state = [0.7, self.rate];
            let (with_products, is_same) = steps.back::<true>(state);
            let (with_divisions, _) = steps.back::<false>(state);
            A::IS_FUSED.then_some(([with_products, with_divisions], is_same))
        }
    }

    #[test]
    fn products_that_are_no_quotients_are_noticed() {
        // Numbers with 53 bits whose quotient is as near to the middle between two numbers as can be.
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(99);
            state
        };
        let mut noticed = 0;
        for _ in 0..2000 {
            let [rate, mass] = simd::tests::hardest(&mut random);
            for ([products, divisions], is_same) in
                simd::on_each(|| Both { mass, rate }).into_iter().flatten()
            {
                assert!(!is_same || products == divisions, "{mass} {rate}");
                noticed += usize::from(!is_same);
            }
            // All others are the same.
            for ([products, divisions], is_same) in simd::on_each(|| Both {
                mass: 1.3,
                rate: 0.9,
            })
            .into_iter()
            .flatten()
            {
                assert!(is_same && products == divisions);
            }
        }
        let is_fused = simd::on_each(|| Both {
            mass: 1.0,
            rate: 1.0,
        })
        .iter()
        .any(Option::is_some);
        assert_eq!(noticed > 0, is_fused, "{noticed} of 2000");
    }
}
