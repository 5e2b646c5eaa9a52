//! Quantiles for intervals of a given confidence.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// Half-width of a two-sided interval of this confidence for a normal variable, in standard deviations.
pub fn normal_half_width(confidence: f64) -> f64 {
    Normal::standard().inverse_cdf(0.5 + 0.5 * confidence)
}

/// Quantile of the chi-square distribution with one degree of freedom, the rise of chi-square at the ends of an interval for one
/// quantity.
pub fn chi_square_one(probability: f64) -> f64 {
    ChiSquared::new(1.0).map_or(f64::NAN, |chi| chi.inverse_cdf(probability))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_values_of_the_tables() {
        // Abramowitz and Stegun, tables 26.5 and 26.8, to the digits given there.
        assert!((normal_half_width(0.95) - 1.959_964).abs() < 1e-6);
        assert!((chi_square_one(0.95) - 3.841_46).abs() < 1e-5);
        assert!((chi_square_one(0.5) - normal_half_width(0.5).powi(2)).abs() < 1e-9);
    }
}
