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
    /// Half-width, in standard errors, of the simultaneous 95 % band, which contains the curve at all times;
    /// `None` if not simulated.
    pub simultaneous: Option<f64>,
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
