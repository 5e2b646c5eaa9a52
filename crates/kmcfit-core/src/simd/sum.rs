//! Sums, maxima and checks of long vectors, in eight lanes.

use super::{Arithmetic, Kernel, LANES};

/// Number of independent partial results: four rows, which hide the latency of an operation.
const AT_ONCE: usize = 4 * LANES;

/// Folds pairs of values by a function that the compiler vectorises: pair `i` into partial result `i % AT_ONCE`.
struct Fold<'a, F>(&'a [f64], &'a [f64], F);

impl<F: Fn(f64, f64, f64) -> f64> Kernel for Fold<'_, F> {
    type Output = [f64; AT_ONCE];

    #[inline(always)]
    fn run<A: Arithmetic>(self, _: A) -> [f64; AT_ONCE] {
        let Self(a, b, next) = self;
        let (a, b) = (a.as_chunks::<AT_ONCE>().0, b.as_chunks::<AT_ONCE>().0);
        let mut folds = [0.0; AT_ONCE];
        for (a, b) in a.iter().zip(b) {
            for ((fold, a), b) in folds.iter_mut().zip(a).zip(b) {
                *fold = next(*fold, *a, *b);
            }
        }
        folds
    }
}

/// Remaining pairs, too few for another round of [`Fold`].
fn left_over(a: &[f64], b: &[f64]) -> impl Iterator<Item = (f64, f64)> {
    let (a, b) = (a.as_chunks::<AT_ONCE>().1, b.as_chunks::<AT_ONCE>().1);
    a.iter().copied().zip(b.iter().copied())
}

/// Sum of the terms of all pairs, first within lanes and then over the lanes.
fn sum(a: &[f64], b: &[f64], term: impl Fn(f64, f64) -> f64) -> f64 {
    let sums = super::run(Fold(a, b, |sum, a, b| sum + term(a, b)));
    let rows = sums.as_chunks::<LANES>().0;
    let lane = |l: usize| (rows[0][l] + rows[1][l]) + (rows[2][l] + rows[3][l]);
    let whole = (0..LANES).map(lane).fold(0.0, |sum, lane| sum + lane);
    left_over(a, b).fold(whole, |sum, (a, b)| sum + term(a, b))
}

/// Inner product `sum_i a_i b_i`.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    sum(a, b, |a, b| a * b)
}

/// Sum of the values.
pub(crate) fn total(values: &[f64]) -> f64 {
    sum(values, values, |a, _| a)
}

/// Sum of the squared distances from `mean`.
pub(crate) fn squared_deviation(values: &[f64], mean: f64) -> f64 {
    sum(values, values, |a, _| (a - mean) * (a - mean))
}

/// Root mean square; zero without values.
pub(crate) fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Squared distance `sum_i (factor (a_i - b_i))^2`.
pub(crate) fn squared_distance(a: &[f64], b: &[f64], factor: f64) -> f64 {
    sum(a, b, |a, b| {
        let part = factor * (a - b);
        part * part
    })
}

/// Larger of two numbers, or `b` if one is NaN.
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Larger of `|x|` and `most`; `most` if `x` is NaN.
fn larger_size(x: f64, most: f64) -> f64 {
    larger(x, larger(0.0 - x, most))
}

fn largest_of(a: &[f64], b: &[f64], value: impl Fn(f64, f64) -> f64) -> f64 {
    let folds = super::run(Fold(a, b, |most, a, b| larger_size(value(a, b), most)));
    let most = folds.into_iter().fold(0.0, |most, x| larger(x, most));
    left_over(a, b).fold(most, |most, (a, b)| larger(value(a, b).abs(), most))
}

/// Largest absolute value; NaN is ignored.
pub(crate) fn largest(values: &[f64]) -> f64 {
    largest_of(values, values, |a, _| a)
}

/// Largest `|a_i - b_i|`; NaN is ignored.
pub(crate) fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    largest_of(a, b, |a, b| a - b)
}

/// True if all numbers are positive; false for NaN.
pub(crate) fn are_positive(values: &[f64]) -> bool {
    let next = |others, x, _| others + if x > 0.0 { 0.0 } else { 1.0 };
    let others = super::run(Fold(values, values, next));
    others == [0.0; AT_ONCE] && left_over(values, values).all(|(x, _)| x > 0.0)
}

/// True if all numbers are finite.
pub(crate) fn are_finite(values: &[f64]) -> bool {
    // Zero times a non-finite number is NaN, which persists in the sum.
    let zeros = super::run(Fold(values, values, |sum, x, _| sum + 0.0 * x));
    zeros == [0.0; AT_ONCE] && left_over(values, values).all(|(x, _)| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn largest_values_ignore_nan() {
        for nodes in [0, 1, 7, 32, 45, 100] {
            let mut a: Vec<f64> = (0..nodes).map(|i| f64::from(i * i % 29) - 14.0).collect();
            let b: Vec<f64> = (0..nodes).map(|i| f64::from(i * 7 % 31)).collect();
            if let [.., almost_last, _] = a.as_mut_slice() {
                *almost_last = f64::NAN;
            }
            let one_by_one = |values: &[f64]| values.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            let difference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
            let next = |most, a, b| larger_size(a - b, most);
            let folds = crate::simd::on_each(|| Fold(&a, &b, next));
            assert!(folds.windows(2).all(|pair| pair[0] == pair[1]), "{folds:?}");
            assert_eq!(largest(&a), one_by_one(&a));
            assert_eq!(largest_difference(&a, &b), one_by_one(&difference));
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
            assert_eq!(total(&a), a.iter().sum::<f64>(), "{count}");
            let deviation: f64 = a.iter().map(|a| (a - 1.5) * (a - 1.5)).sum();
            assert_eq!(squared_deviation(&a, 1.5), deviation, "{count}");
        }
    }

    #[test]
    fn one_number_that_is_not_positive_is_detected_at_any_position() {
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
    fn one_number_that_is_not_finite_is_detected_at_any_position() {
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
