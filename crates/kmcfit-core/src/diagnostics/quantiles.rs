//! Quantiles behind intervals of a stated confidence.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

/// Half-width of a two-sided interval of this confidence for a Gaussian, in standard deviations.
pub fn normal_half_width(confidence: f64) -> f64 {
    Normal::standard().inverse_cdf(0.5 + 0.5 * confidence)
}

/// Value below which a chi-square of one degree of freedom lies with this probability: the rise of
/// chi-square at the ends of an interval for one number.
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
