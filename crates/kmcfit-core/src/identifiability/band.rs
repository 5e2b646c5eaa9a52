//! The band of one function or ratio.

use crate::diagnostics::NORMAL_975;

/// To which sides of the value its band reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Both.
    Both,
    /// Only above: a lower bound is active.
    Above,
    /// Only below: an upper bound is active.
    Below,
    /// Neither: an equality, or nothing is estimated.
    Neither,
}

/// The band of one function or ratio over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// `mass`, ..., `k/m`, `c/m`, `natural frequency`, `damping ratio`.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Values at the times of [`Bands::times`](super::Bands::times); NaN where a frequency or damping ratio is not defined,
    /// which a note says.
    pub values: Vec<f64>,
    /// Standard errors; infinite where not seen.
    pub standard_error: Vec<f64>,
    /// Sides that the band reaches to.
    pub sides: Vec<Side>,
    /// Number of standard errors of the band that holds at all times at once with probability 95 %;
    /// `None` if not simulated.
    pub simultaneous: Option<f64>,
    /// What is to be said of it.
    pub notes: Vec<String>,
}

impl Band {
    /// Lower and upper end of the band of `factor` standard errors at index `i`.
    pub fn ends(&self, i: usize, factor: f64) -> [f64; 2] {
        let (value, width) = (self.values[i], factor * self.standard_error[i]);
        match self.sides[i] {
            Side::Both => [value - width, value + width],
            Side::Above => [value, value + width],
            Side::Below => [value - width, value],
            Side::Neither => [value, value],
        }
    }

    /// The band that holds at each time with probability 95 %.
    pub fn pointwise(&self, i: usize) -> [f64; 2] {
        self.ends(i, NORMAL_975)
    }
}
