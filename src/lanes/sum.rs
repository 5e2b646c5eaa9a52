//! Sums in eight lanes.

use super::{Arithmetic, Eight, Kernel, LANES};

/// `sum_i (a_i - b_i)^2`, each lane by itself and then the lanes.
pub(crate) fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    super::run(SquaredDistance(a, b))
}

/// `sum_i a_i b_i`, each lane by itself and then the lanes.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    super::run(Dot(a, b))
}

/// `sum_i a_i b_i w_i`, each lane by itself and then the lanes.
pub(crate) fn weighted_dot(a: &[f64], b: &[f64], w: &[f64]) -> f64 {
    super::run(WeightedDot(a, b, w))
}

struct SquaredDistance<'a>(&'a [f64], &'a [f64]);

struct Dot<'a>(&'a [f64], &'a [f64]);

struct WeightedDot<'a>(&'a [f64], &'a [f64], &'a [f64]);

/// Four rows at a time, as one sum would wait for itself.
const AT_ONCE: usize = 4;

macro_rules! summed {
    ($arithmetic:ident, $first:expr, $($other:expr),+; |$($x:ident),+| $term:expr) => {{
        let count = $first.len();
        let whole = count / (AT_ONCE * LANES) * (AT_ONCE * LANES);
        let mut sums = [Eight::splat($arithmetic, 0.0); AT_ONCE];
        let mut i = 0;
        while i < whole {
            for (q, sum) in sums.iter_mut().enumerate() {
                let from = i + q * LANES;
                summed!(@load $arithmetic, from, $($x),+; $first, $($other),+);
                *sum += $term;
            }
            i += AT_ONCE * LANES;
        }
        let lanes = ((sums[0] + sums[1]) + (sums[2] + sums[3])).row();
        let mut sum: f64 = lanes.iter().sum();
        for i in whole..count {
            summed!(@plain i, $($x),+; $first, $($other),+);
            sum += $term;
        }
        sum
    }};
    (@load $arithmetic:ident, $from:ident, $($x:ident),+; $($slice:expr),+) => {
        $(let $x = Eight::load(
            $arithmetic,
            $slice[$from..$from + LANES].first_chunk().expect("a whole row"),
        );)+
    };
    (@plain $i:ident, $($x:ident),+; $($slice:expr),+) => {
        $(let $x = $slice[$i];)+
    };
}

impl Kernel for SquaredDistance<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> f64 {
        summed!(arithmetic, self.0, self.1; |a, b| (a - b) * (a - b))
    }
}

impl Kernel for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> f64 {
        summed!(arithmetic, self.0, self.1; |a, b| a * b)
    }
}

impl Kernel for WeightedDot<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> f64 {
        summed!(arithmetic, self.0, self.1, self.2; |a, b, w| a * b * w)
    }
}
