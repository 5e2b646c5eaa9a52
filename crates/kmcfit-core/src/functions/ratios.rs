//! Ratios of stiffness and damping to mass, natural frequency and damping ratio.

use crate::system::NodalCoefficients;

/// `k/m`, `c/m`, natural frequency and damping ratio at the nodes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ratios {
    /// `k/m`, 1/s^2.
    pub k_over_m: Vec<f64>,
    /// `c/m`, 1/s.
    pub c_over_m: Vec<f64>,
    /// Natural frequency `sqrt(k/m) / (2 pi)`, Hz; NaN where `k/m` is negative.
    pub frequency: Vec<f64>,
    /// Damping ratio `c / (2 sqrt(k m))`; NaN where `k m` is not positive.
    pub damping_ratio: Vec<f64>,
}

impl Ratios {
    /// Ratios of nodal coefficients whose first two terms are damping and stiffness.
    ///
    /// # Panics
    /// If there are fewer than two terms.
    pub fn of(nodal: &NodalCoefficients) -> Self {
        let (m, c, k) = (
            &nodal.inertias[0],
            &nodal.coefficients[0],
            &nodal.coefficients[1],
        );
        let over_mass = |f: &[f64]| -> Vec<f64> { f.iter().zip(m).map(|(f, m)| f / m).collect() };
        let k_over_m = over_mass(k);
        let c_over_m = over_mass(c);
        let frequency = k_over_m
            .iter()
            .map(|r| r.sqrt() / std::f64::consts::TAU)
            .collect();
        let damping_ratio = (c_over_m.iter().zip(&k_over_m))
            .map(|(c, k)| {
                if *k > 0.0 {
                    0.5 * c / k.sqrt()
                } else {
                    f64::NAN
                }
            })
            .collect();
        Self {
            k_over_m,
            c_over_m,
            frequency,
            damping_ratio,
        }
    }
}
