//! Sums of products in twice the working precision.

use crate::constraints::Rows;

/// A sum of products in twice the working precision (Ogita, Rump and Oishi 2005, Algorithm 5.3).
///
/// Dependent rows can have multipliers of any size that cancel. In working precision their rounding errors would hide the gradient, and any
/// point would appear stationary.
#[derive(Clone, Copy, Default)]
pub(super) struct Sum {
    value: f64,
    error: f64,
}

impl Sum {
    /// Adds `a b`.
    pub(super) fn add_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        let sum = self.value + product;
        let added = sum - self.value;
        let lost = (self.value - (sum - added)) + (product - added);
        self.error += lost + a.mul_add(b, -product);
        self.value = sum;
    }

    /// Sum, rounded once.
    pub(super) fn total(&self) -> f64 {
        self.value + self.error
    }
}

/// Adds `factor_i a_i` for every row.
pub(super) fn add(gradient: &mut [Sum], rows: &Rows, factors: &[f64]) {
    for (i, factor) in factors.iter().enumerate() {
        if *factor != 0.0 {
            rows.row(i)
                .for_each(|(j, a)| gradient[j].add_product(*factor, a));
        }
    }
}

/// Distances `sum_j a_ij z_j - b_i` of every row, for finite right-hand sides `b`. Far out along a direction without cost the terms cancel, and
/// rounding errors of the working precision would hide the distance.
pub(super) fn distances(rows: &Rows, z: &[f64]) -> Vec<f64> {
    let distance = |(i, right): (usize, &f64)| {
        let mut sum = Sum::default();
        sum.add_product(-1.0, *right);
        rows.row(i).for_each(|(j, a)| sum.add_product(a, z[j]));
        sum.total()
    };
    rows.right().iter().enumerate().map(distance).collect()
}
