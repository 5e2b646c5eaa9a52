//! Sums and largest values in eight lanes.

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

/// The root mean square; zero of no values.
pub(crate) fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// `sum_i (factor (a_i - b_i))^2`, each lane by itself and then the lanes.
pub(crate) fn squared_distance(a: &[f64], b: &[f64], factor: f64) -> f64 {
    super::run(SquaredDistance(a, b, factor))
}

struct SquaredDistance<'a>(&'a [f64], &'a [f64], f64);

impl Kernel for SquaredDistance<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> f64 {
        let Self(a, b, factor) = self;
        let (a, a_rest) = a.as_chunks::<{ AT_ONCE * LANES }>();
        let (b, b_rest) = b.as_chunks::<{ AT_ONCE * LANES }>();
        let each = Eight::splat(arithmetic, factor);
        let mut sums = [Eight::splat(arithmetic, 0.0); AT_ONCE];
        for (a, b) in a.iter().zip(b) {
            let (a, b) = (a.as_chunks::<LANES>().0, b.as_chunks::<LANES>().0);
            for q in 0..AT_ONCE {
                let difference = Eight::load(arithmetic, &a[q]) - Eight::load(arithmetic, &b[q]);
                let part = each * difference;
                sums[q] += part * part;
            }
        }
        let mut sum = 0.0;
        for lane in ((sums[0] + sums[1]) + (sums[2] + sums[3])).row() {
            sum += lane;
        }
        for (a, b) in a_rest.iter().zip(b_rest) {
            let part = factor * (a - b);
            sum += part * part;
        }
        sum
    }
}

/// The largest size of the numbers; those that are none are passed over.
pub(crate) fn largest(values: &[f64]) -> f64 {
    super::run(LargestDifference::<false>(values, values))
}

/// The largest size of `a_i - b_i`; what is no number is passed over.
pub(crate) fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    super::run(LargestDifference::<true>(a, b))
}

/// Of differences, or of the first numbers alone.
struct LargestDifference<'a, const IS_TAKEN: bool>(&'a [f64], &'a [f64]);

impl<const IS_TAKEN: bool> Kernel for LargestDifference<'_, IS_TAKEN> {
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> f64 {
        let zero = Eight::splat(arithmetic, 0.0);
        let (a, a_rest) = self.0.as_chunks::<{ AT_ONCE * LANES }>();
        let (b, b_rest) = self.1.as_chunks::<{ AT_ONCE * LANES }>();
        let mut most = [zero; AT_ONCE];
        for (a, b) in a.iter().zip(b) {
            let (a, b) = (a.as_chunks::<LANES>().0, b.as_chunks::<LANES>().0);
            for q in 0..AT_ONCE {
                let mut x = Eight::load(arithmetic, &a[q]);
                if IS_TAKEN {
                    x = x - Eight::load(arithmetic, &b[q]);
                }
                most[q] = x.larger((zero - x).larger(most[q]));
            }
        }
        let most = most[0].larger(most[1]).larger(most[2].larger(most[3]));
        let larger = |most: f64, x: f64| if x > most { x } else { most };
        let rest = a_rest.iter().zip(b_rest);
        let rest = rest.map(|(a, b)| if IS_TAKEN { (a - b).abs() } else { a.abs() });
        rest.chain(most.row()).fold(0.0, larger)
    }
}

/// Whether all numbers are positive, and are numbers.
pub(crate) fn are_positive(values: &[f64]) -> bool {
    let (parts, rest) = values.as_chunks::<{ AT_ONCE * LANES }>();
    let mut others = [0.0; AT_ONCE * LANES];
    super::run(super::Elementwise(|| {
        for part in parts {
            for (others, value) in others.iter_mut().zip(part) {
                *others += if *value > 0.0 { 0.0 } else { 1.0 };
            }
        }
    }));
    others == [0.0; AT_ONCE * LANES] && rest.iter().all(|value| *value > 0.0)
}

/// Whether all numbers are finite.
pub(crate) fn are_finite(values: &[f64]) -> bool {
    super::run(Finite(values))
}

struct Finite<'a>(&'a [f64]);

impl Kernel for Finite<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> bool {
        let zero = Eight::splat(arithmetic, 0.0);
        let (values, rest) = self.0.as_chunks::<{ AT_ONCE * LANES }>();
        // Zero times what is not finite is not a number, and stays so.
        let mut sums = [zero; AT_ONCE];
        for values in values {
            let values = values.as_chunks::<LANES>().0;
            for q in 0..AT_ONCE {
                sums[q] += zero * Eight::load(arithmetic, &values[q]);
            }
        }
        let sums = ((sums[0] + sums[1]) + (sums[2] + sums[3])).row();
        sums.iter().all(|sum| *sum == 0.0) && rest.iter().all(|x| x.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn largest_sizes_pass_over_what_is_no_number() {
        for nodes in [0, 1, 7, 32, 45, 100] {
            let mut a: Vec<f64> = (0..nodes).map(|i| f64::from(i * i % 29) - 14.0).collect();
            let b: Vec<f64> = (0..nodes).map(|i| f64::from(i * 7 % 31)).collect();
            if let [.., almost_last, _] = a.as_mut_slice() {
                *almost_last = f64::NAN;
            }
            let one_by_one = |values: &[f64]| values.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            let difference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
            let sizes = crate::simd::on_each(|| LargestDifference::<false>(&a, &a));
            assert!(
                sizes.iter().all(|size| *size == one_by_one(&a)),
                "{sizes:?}"
            );
            let sizes = crate::simd::on_each(|| LargestDifference::<true>(&a, &b));
            assert!(
                sizes.iter().all(|size| *size == one_by_one(&difference)),
                "{sizes:?}"
            );
        }
    }

    #[test]
    fn sums_of_any_length() {
        for count in 0..100 {
            let a: Vec<f64> = (0..count).map(|i| f64::from(i) * 0.5).collect();
            let b: Vec<f64> = (0..count).map(|i| 3.0 - f64::from(i)).collect();
            let product: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
            // Multiples of a half below 2^53: no sum is rounded.
            assert_eq!(dot(&a, &b), product, "{count}");
            let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum();
            assert_eq!(squared_distance(&a, &b, 2.0), 4.0 * squares, "{count}");
        }
    }

    #[test]
    fn one_number_that_is_not_positive_is_found_anywhere() {
        for count in 1..100 {
            let mut values = vec![1e-300; count];
            assert!(are_positive(&values), "{count}");
            for i in 0..count {
                for odd in [f64::NAN, 0.0, -0.0, -1.0, f64::NEG_INFINITY] {
                    let kept = std::mem::replace(&mut values[i], odd);
                    assert!(!are_positive(&values), "{odd} at {i} of {count}");
                    values[i] = kept;
                }
            }
        }
    }

    #[test]
    fn one_number_that_is_not_finite_is_found_anywhere() {
        for count in 1..100 {
            let mut values = vec![f64::MAX; count];
            assert!(are_finite(&values), "{count}");
            for i in 0..count {
                for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                    let kept = std::mem::replace(&mut values[i], odd);
                    assert!(!are_finite(&values), "{odd} at {i} of {count}");
                    values[i] = kept;
                }
            }
        }
    }
}
