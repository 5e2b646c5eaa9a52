//! Elements with an internal state: the force and the rate of the state, with their derivatives.

use super::Law;
use crate::simd::Real;

/// Largest number of coefficients of an element.
pub(crate) const MOST_COEFFICIENTS: usize = 3;

/// A value with its derivatives by elongation, rate and internal state, and by the coefficients of the element.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Partials<T> {
    pub value: T,
    pub by: [T; 3],
    pub by_coefficients: [T; MOST_COEFFICIENTS],
}

impl Law {
    /// Number of coefficients, each a function of time.
    pub fn coefficients(self) -> usize {
        match self {
            Law::BoucWen { .. } => MOST_COEFFICIENTS,
            _ => 1,
        }
    }

    /// True for an element with an internal state.
    pub fn has_internal_state(self) -> bool {
        matches!(self, Law::BoucWen { .. })
    }

    /// Force of an element with an internal state `z`, and the rate `z'`, for its coefficients `p`, its elongation rate `r` and the signs of `r`
    /// and `z`.
    pub(crate) fn with_internal_state<T: Real>(
        self,
        p: &[T],
        r: T,
        z: T,
        [sign_r, sign_z]: [f64; 2],
    ) -> [Partials<T>; 2] {
        let exponent = match self {
            Law::BoucWen { exponent } => exponent.max(1),
            _ => 1,
        };
        let (zero, one) = (z.like(0.0), z.like(1.0));
        let [stiffness, beta, gamma] = [0, 1, 2].map(|k| p.get(k).copied().unwrap_or(zero));
        let power = (1..exponent).fold(one, |power, _| power * z.abs());
        let [by_beta, by_gamma] = [power * r.abs() * z, power * r * z.abs()];
        let force = Partials {
            value: stiffness * z,
            by: [zero, zero, stiffness],
            by_coefficients: [z, zero, zero],
        };
        let bend = power * (beta * r.abs() + gamma * r.scale(sign_z));
        let rate = Partials {
            value: r - beta * by_beta - gamma * by_gamma,
            by: [
                zero,
                one - power * (beta * z.scale(sign_r) + gamma * z.abs()),
                zero - bend.scale(f64::from(exponent)),
            ],
            by_coefficients: [zero, zero - by_beta, zero - by_gamma],
        };
        [force, rate]
    }
}
