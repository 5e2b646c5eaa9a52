//! Scalar parameters: initial states, gains and offsets of sensors, estimated together with the functions.

/// Gaussian prior of a nuisance parameter: it adds `((x - mean) / sigma)^2` to J.
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "prior", extend("expecting" = "a map such as {mean: 1.0, sigma: 0.1}"))]
pub struct Prior {
    /// Mean.
    #[schemars(extend("example" = "1.0"))]
    pub mean: f64,
    /// Standard deviation.
    #[schemars(extend("example" = "0.1", "range" = "greater than 0"))]
    pub sigma: f64,
}

impl Prior {
    /// Contribution to J at the value `x`.
    pub fn price(self, x: f64) -> f64 {
        let u = (x - self.mean) / self.sigma;
        u * u
    }
}

/// A scalar parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalarParameter {
    /// Name for reports.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Start.
    pub start: f64,
    /// Scale of changes.
    pub size: f64,
    /// Prior, if any.
    pub prior: Option<Prior>,
}

/// A scalar that is known, or estimated as one of the [`ScalarParameter`]s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ScalarValue {
    /// Known value.
    Known(f64),
    /// Index of the estimated scalar.
    Estimated(usize),
}

impl ScalarValue {
    /// Value, given the values `scalars` of all scalars.
    ///
    /// # Panics
    /// If the index is out of range.
    #[inline]
    pub fn of(self, scalars: &[f64]) -> f64 {
        match self {
            Self::Known(value) => value,
            Self::Estimated(index) => scalars[index],
        }
    }

    /// Index of the scalar, if estimated.
    pub fn index(self) -> Option<usize> {
        match self {
            Self::Known(_) => None,
            Self::Estimated(index) => Some(index),
        }
    }
}
