//! Compensated accumulation of products (Dot2).

use crate::constraints::Rows;

/// Compensated accumulation of products with an error as if computed in twice the working precision, then rounded to `f64`
/// (Dot2, Ogita, Rump and Oishi 2005, Algorithm 5.3).
///
/// If constraint rows are linearly dependent, their multipliers can be arbitrarily large and cancel in the gradient; in working
/// precision the rounding error would then exceed the gradient, and any point would appear stationary.
#[derive(Clone, Copy, Default)]
pub(super) struct CompensatedSum {
    value: f64,
    error: f64,
}

impl CompensatedSum {
    /// Adds `a b`.
    pub(super) fn add_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        let sum = self.value + product;
        let added = sum - self.value;
        let lost = (self.value - (sum - added)) + (product - added);
        self.error += lost + a.mul_add(b, -product);
        self.value = sum;
    }

    /// Returns the sum, rounded to `f64`.
    pub(super) fn total(&self) -> f64 {
        self.value + self.error
    }
}

/// Adds `A^T factors` to `gradient` (length n), where `A` (m x n) has the rows `a_i` and `factors` has length m.
pub(super) fn add_transposed_product(
    gradient: &mut [CompensatedSum],
    rows: &Rows,
    factors: &[f64],
) {
    for (i, factor) in factors.iter().enumerate() {
        if *factor != 0.0 {
            rows.row(i)
                .for_each(|(j, a)| gradient[j].add_product(*factor, a));
        }
    }
}

/// Returns the signed residuals `A z - b`, one per row, for finite `b`. If `z` is large along a direction in which the cost is
/// flat, the terms nearly cancel, and in working precision the rounding error would exceed the residual.
pub(super) fn residuals(rows: &Rows, z: &[f64]) -> Vec<f64> {
    let residual = |(i, right): (usize, &f64)| {
        let mut sum = CompensatedSum::default();
        sum.add_product(-1.0, *right);
        rows.row(i).for_each(|(j, a)| sum.add_product(a, z[j]));
        sum.total()
    };
    rows.right().iter().enumerate().map(residual).collect()
}
