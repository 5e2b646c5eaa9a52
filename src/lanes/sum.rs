//! Sums in eight lanes.

use super::{Arithmetic, Eight, Kernel, LANES};

/// Four rows at a time, as one sum would wait for itself.
const AT_ONCE: usize = 4;

/// `sum_i a_i b_i`, each lane by itself and then the lanes.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    super::run(Dot(a, b))
}

struct Dot<'a>(&'a [f64], &'a [f64]);

impl Kernel for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> f64 {
        let (a, a_rest) = self.0.as_chunks::<{ AT_ONCE * LANES }>();
        let (b, b_rest) = self.1.as_chunks::<{ AT_ONCE * LANES }>();
        let mut sums = [Eight::splat(arithmetic, 0.0); AT_ONCE];
        for (a, b) in a.iter().zip(b) {
            let (a, b) = (a.as_chunks::<LANES>().0, b.as_chunks::<LANES>().0);
            for q in 0..AT_ONCE {
                sums[q] += Eight::load(arithmetic, &a[q]) * Eight::load(arithmetic, &b[q]);
            }
        }
        let mut sum = 0.0;
        for lane in ((sums[0] + sums[1]) + (sums[2] + sums[3])).row() {
            sum += lane;
        }
        for (a, b) in a_rest.iter().zip(b_rest) {
            sum += a * b;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_any_length() {
        for count in 0..100 {
            let a: Vec<f64> = (0..count).map(|i| f64::from(i) * 0.5).collect();
            let b: Vec<f64> = (0..count).map(|i| 3.0 - f64::from(i)).collect();
            let product: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
            // Multiples of a half below 2^53: no sum is rounded.
            assert_eq!(dot(&a, &b), product, "{count}");
        }
    }
}
