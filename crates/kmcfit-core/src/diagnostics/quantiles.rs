//! Quantiles for intervals of a given confidence.

use super::NORMAL_975;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};

/// Half-width of a two-sided interval of this confidence for a normal variable, in standard deviations.
pub fn normal_half_width(confidence: f64) -> f64 {
    Normal::standard().inverse_cdf(0.5 + 0.5 * confidence)
}

/// Half-width of a two-sided 95 % interval of Student's t distribution with `degrees` degrees of freedom, in standard errors;
/// [`NORMAL_975`] for infinitely many. From 10 degrees on the expansion of Abramowitz and Stegun (26.7.5), to 1e-4.
pub fn student_half_width(degrees: f64) -> f64 {
    if degrees < 10.0 {
        let law = StudentsT::new(0.0, 1.0, degrees.max(1.0));
        return law.map_or(f64::INFINITY, |law| law.inverse_cdf(0.975));
    }
    let z = NORMAL_975;
    let terms = [
        (z.powi(3) + z) / 4.0,
        (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0,
        (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0,
    ];
    let powers = [degrees, degrees * degrees, degrees * degrees * degrees];
    z + terms.iter().zip(powers).map(|(t, p)| t / p).sum::<f64>()
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
        // Table 26.10.
        for (degrees, t) in [
            (1.0, 12.706),
            (5.0, 2.571),
            (10.0, 2.228),
            (30.0, 2.042),
            (120.0, 1.980),
        ] {
            assert!((student_half_width(degrees) - t).abs() < 6e-4, "{degrees}");
        }
        assert_eq!(student_half_width(f64::INFINITY), NORMAL_975);
        assert!((chi_square_one(0.5) - normal_half_width(0.5).powi(2)).abs() < 1e-9);
    }
}
