//! Quantities: numbers that follow from the parameters of a fit, with their derivatives in the parameters.
//!
//! With the covariance `C` of the parameters the standard error of a quantity with the gradient `g` is the root of
//! `g^T C g + basis_error^2` (delta method), and its 95 % interval follows from Student's t distribution. Every interval of a result is made
//! here.

use crate::diagnostics::student_half_width;
use crate::number_format::number_or_nan;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Sides of the value on which an interval extends.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Side {
    /// Both.
    #[default]
    Both,
    /// Only above: a lower bound is active.
    Above,
    /// Only below: an upper bound is active.
    Below,
    /// Neither: an equality is active, or nothing is estimated.
    Neither,
}

/// A number that follows from the parameters, with its standard error. In files an unknown standard error is `null`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// Name: that of a scalar, a function or a ratio, as in `mass at 3 s`.
    pub name: String,
    /// SI unit; empty if dimensionless.
    pub unit: String,
    /// Value; NaN where it is not defined, as a natural frequency with a negative stiffness.
    #[serde(deserialize_with = "number_or_nan")]
    pub value: f64,
    /// Derivatives in the parameters on which it depends, by their indices.
    #[serde(skip)]
    pub gradient: Vec<(usize, f64)>,
    /// Part of the standard error from the error of the basis.
    #[serde(skip)]
    pub basis_error: f64,
    /// Standard error: zero if nothing is estimated, infinite where the quantity is not identifiable, NaN without a covariance.
    #[serde(deserialize_with = "number_or_nan")]
    pub standard_error: f64,
    /// Degrees of freedom of its t distribution; infinite, and not in files, where the noise counts as known.
    #[serde(
        rename = "degrees_of_freedom",
        default = "infinite",
        skip_serializing_if = "is_infinite"
    )]
    pub degrees: f64,
    /// Sides on which its interval extends.
    #[serde(skip)]
    pub side: Side,
}

fn infinite() -> f64 {
    f64::INFINITY
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it so")]
fn is_infinite(degrees: &f64) -> bool {
    degrees.is_infinite()
}

impl Quantity {
    /// A quantity without a standard error.
    pub fn new(name: impl Into<String>, unit: impl Into<String>, value: f64) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            value,
            gradient: Vec::new(),
            basis_error: 0.0,
            standard_error: f64::NAN,
            degrees: f64::INFINITY,
            side: Side::Both,
        }
    }

    /// The quantity with the standard error by a covariance of the parameters, and these degrees of freedom.
    #[must_use]
    pub fn with_covariance(self, covariance: &DMatrix<f64>, degrees: f64) -> Self {
        let row = |(i, a): &(usize, f64)| -> f64 {
            let products = self.gradient.iter().map(|(j, b)| b * covariance[(*i, *j)]);
            a * products.sum::<f64>()
        };
        let variance: f64 = self.gradient.iter().map(row).sum();
        Self {
            standard_error: variance.max(0.0).sqrt().hypot(self.basis_error),
            degrees,
            ..self
        }
    }

    /// Half-width of the 95 % interval on a side on which it extends.
    pub fn half_width(&self) -> f64 {
        student_half_width(self.degrees) * self.standard_error
    }

    /// 95 % confidence interval; `None` where nothing is estimated, or the quantity is not identifiable.
    pub fn interval(&self) -> Option<[f64; 2]> {
        let half = self.half_width();
        let is_interval = half > 0.0 && half.is_finite() && self.value.is_finite();
        is_interval.then(|| self.ends(half))
    }

    /// Ends of the interval of this half-width, on the sides on which it extends.
    pub fn ends(&self, half: f64) -> [f64; 2] {
        let value = self.value;
        match self.side {
            Side::Both => [value - half, value + half],
            Side::Above => [value, value + half],
            Side::Below => [value - half, value],
            Side::Neither => [value, value],
        }
    }

    /// Value at the parameters `theta` of a quantity that is linear in them, made at `theta = 0`.
    pub(crate) fn linear_at(&self, theta: &[f64]) -> f64 {
        let products = self.gradient.iter().map(|(j, a)| a * theta[*j]);
        self.value + products.sum::<f64>()
    }
}
