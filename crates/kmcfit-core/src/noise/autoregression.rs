//! Stationary autoregressive process, stated by its partial autocorrelations.

use nalgebra::{Complex, DMatrix};

/// Stationary autoregressive process of unit variance:
///
/// ```text
/// u_i = a_1 u_(i-1) + ... + a_p u_(i-p) + e_i,    var u = 1,    var e = prod_k (1 - phi_k^2)
/// ```
///
/// with partial autocorrelations `|phi_k| < 1`, from which the coefficients follow by the recursion of Levinson and Durbin. Any
/// such numbers give a stationary process.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Autoregression {
    partial: Vec<f64>,
    /// Best linear predictors of the orders `0..=p`: coefficients of `u_(i-1), u_(i-2), ...`.
    predictors: Vec<Vec<f64>>,
    /// Variances of their errors.
    variances: Vec<f64>,
}

impl Autoregression {
    /// Process with the partial autocorrelations `partial`; `None` unless all are within (-1, 1).
    pub fn new(partial: Vec<f64>) -> Option<Self> {
        if !partial.iter().all(|phi| phi.abs() < 1.0) {
            return None;
        }
        let mut predictors = vec![Vec::new()];
        let mut variances = vec![1.0];
        for (k, phi) in partial.iter().enumerate() {
            let before = &predictors[k];
            let mut next: Vec<f64> = (0..k)
                .map(|j| before[j] - phi * before[k - 1 - j])
                .collect();
            next.push(*phi);
            predictors.push(next);
            variances.push(variances[k] * (1.0 - phi) * (1.0 + phi));
        }
        Some(Self {
            partial,
            predictors,
            variances,
        })
    }

    /// Process whose partial autocorrelations are the hyperbolic tangents of `coordinates`, kept within `1 - 1e-9`.
    pub fn from_coordinates(coordinates: &[f64]) -> Self {
        const MOST: f64 = 1.0 - 1e-9;
        let partial = coordinates.iter().map(|z| z.tanh().clamp(-MOST, MOST));
        Self::new(partial.collect()).unwrap_or_default()
    }

    /// Inverse hyperbolic tangents of the partial autocorrelations, in which their errors are close to normal.
    pub fn coordinates(&self) -> Vec<f64> {
        self.partial.iter().map(|phi| phi.atanh()).collect()
    }

    /// Order `p`.
    pub fn order(&self) -> usize {
        self.partial.len()
    }

    /// Partial autocorrelations `phi_1, ..., phi_p`.
    pub fn partial(&self) -> &[f64] {
        &self.partial
    }

    /// Coefficients `a_1, ..., a_p`.
    pub fn coefficients(&self) -> &[f64] {
        self.predictor(self.order()).0
    }

    /// Variance of the innovations `e`, relative to that of the process.
    pub fn innovation_variance(&self) -> f64 {
        self.predictor(self.order()).1
    }

    /// Poles: the roots `z` of `z^p = a_1 z^(p-1) + ... + a_p`, inside the unit circle.
    pub fn poles(&self) -> Vec<Complex<f64>> {
        let a = self.coefficients();
        if a.is_empty() {
            return Vec::new();
        }
        let entry = |i: usize, j: usize| match i {
            0 => a[j],
            _ => f64::from(u8::from(j + 1 == i)),
        };
        let companion = DMatrix::from_fn(a.len(), a.len(), entry);
        companion.complex_eigenvalues().iter().copied().collect()
    }

    /// Best linear predictor of a value from the `count` before it (at most `p` of them are used): coefficients, and variance
    /// of the error relative to that of the process.
    pub fn predictor(&self, count: usize) -> (&[f64], f64) {
        match self.predictors.get(count.min(self.order())) {
            Some(predictor) => (predictor, self.variances[count.min(self.order())]),
            None => (&[], 1.0),
        }
    }

    /// Autocorrelations at the lags `0..count`.
    pub fn autocorrelation(&self, count: usize) -> Vec<f64> {
        let mut found = vec![1.0];
        for lag in 1..count {
            let next = match self.partial.get(lag - 1) {
                // rho_k = phi_k v_(k-1) + sum_j a_j^(k-1) rho_(k-j)
                Some(phi) => {
                    let (before, variance) = self.predictor(lag - 1);
                    let known: f64 = (before.iter().enumerate())
                        .map(|(j, a)| a * found[lag - 1 - j])
                        .sum();
                    phi * variance + known
                }
                None => {
                    let coefficients = self.coefficients().iter().enumerate();
                    coefficients.map(|(j, a)| a * found[lag - 1 - j]).sum()
                }
            };
            found.push(next);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// AR(2) with poles `r exp(+- i w)`: `a = (2 r cos w, -r^2)`, and `rho_1 = a_1/(1 - a_2)`.
    #[test]
    fn coefficients_of_a_resonance_follow_from_its_partial_autocorrelations() {
        let (radius, angle) = (0.95f64, 0.4f64);
        let expected = [2.0 * radius * angle.cos(), -radius * radius];
        let first = expected[0] / (1.0 - expected[1]);
        let process = Autoregression::new(vec![first, expected[1]]).unwrap();
        for (a, b) in process.coefficients().iter().zip(expected) {
            assert!((a - b).abs() < 1e-15);
        }
        let lags = process.autocorrelation(6);
        assert!((lags[1] - first).abs() < 1e-15);
        for k in 2..6 {
            let next = expected[0] * lags[k - 1] + expected[1] * lags[k - 2];
            assert!((lags[k] - next).abs() < 1e-14);
        }
        let again = Autoregression::from_coordinates(&process.coordinates());
        assert!((again.innovation_variance() - process.innovation_variance()).abs() < 1e-14);
        assert!(Autoregression::new(vec![0.2, 1.0]).is_none());
    }
}
