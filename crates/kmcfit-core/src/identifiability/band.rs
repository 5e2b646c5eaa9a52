//! Confidence band of one function or ratio over time.

use crate::diagnostics::student_half_width;

/// Sides of the value on which a band extends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BandSide {
    /// Both.
    Both,
    /// Only above: a lower bound is active.
    Above,
    /// Only below: an upper bound is active.
    Below,
    /// Neither: an equality is active, or nothing is estimated.
    Neither,
}

/// Mean of a function or ratio over the record.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanOverRecord {
    /// Mean `1/T integral p dt` by the trapezoid rule over the times of the bands, in the unit of the band; NaN where a value is not
    /// defined.
    pub value: f64,
    /// Derivatives in the parameters: with the covariance `C` of the parameters ([`Bands::covariance`](super::Bands::covariance)) and the
    /// gradient `g` the standard error is the root of `g^T C g + basis_error^2`.
    pub gradient: Vec<f64>,
    /// Standard error; zero if nothing is estimated, infinite where the mean is not identifiable.
    pub standard_error: f64,
    /// Part of the standard error from the error of the basis.
    pub basis_error: f64,
    /// Degrees of freedom of its t distribution; infinite where the noise counts as known.
    pub degrees: f64,
}

impl MeanOverRecord {
    /// 95 % confidence interval; `None` where nothing is estimated, or the mean is not identifiable.
    pub fn interval(&self) -> Option<[f64; 2]> {
        let half = student_half_width(self.degrees) * self.standard_error;
        let is_interval = half > 0.0 && half.is_finite() && self.value.is_finite();
        is_interval.then_some([self.value - half, self.value + half])
    }
}

/// Confidence band of one function or ratio over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// `mass`, ..., `k/m`, `c/m`, `natural frequency`, `damping ratio`.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Values at the times of [`Bands::times`](super::Bands::times); NaN where a frequency or damping ratio is undefined, as
    /// reported in a note.
    pub values: Vec<f64>,
    /// Standard errors; infinite where the value is not identifiable.
    pub standard_error: Vec<f64>,
    /// Degrees of freedom of the t distribution of each value; infinite where the noise counts as known.
    pub degrees: Vec<f64>,
    /// Sides of each value on which the band extends.
    pub sides: Vec<BandSide>,
    /// Mean over the record.
    pub mean: MeanOverRecord,
    /// Notes on the band.
    pub notes: Vec<String>,
}

impl Band {
    /// Lower and upper end of the band of `factor` standard errors at index `i`.
    pub fn ends(&self, i: usize, factor: f64) -> [f64; 2] {
        let (value, width) = (self.values[i], factor * self.standard_error[i]);
        match self.sides[i] {
            BandSide::Both => [value - width, value + width],
            BandSide::Above => [value, value + width],
            BandSide::Below => [value - width, value],
            BandSide::Neither => [value, value],
        }
    }

    /// Pointwise 95 % band at index `i`.
    pub fn pointwise(&self, i: usize) -> [f64; 2] {
        self.ends(i, student_half_width(self.degrees[i]))
    }

    /// Half-width of the pointwise 95 % band at index `i` on a side on which it extends.
    pub fn half_width(&self, i: usize) -> f64 {
        student_half_width(self.degrees[i]) * self.standard_error[i]
    }
}
