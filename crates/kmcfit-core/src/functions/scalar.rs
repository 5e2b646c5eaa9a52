//! Numbers that are fitted beside the functions: initial states, gains and offsets of sensors.

/// What is known of a number before the record is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Expected value.
    pub mean: f64,
    /// Standard deviation; J grows by `((x - mean) / sigma)^2`.
    pub sigma: f64,
}

/// A number to be fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalarParameter {
    /// Name for reports.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Where the search starts.
    pub start: f64,
    /// How large a change of it is large: steps are measured by it.
    pub size: f64,
    /// What is known of it beforehand.
    pub prior: Option<Prior>,
}

impl ScalarParameter {
    /// What the prior charges for the value `x`.
    pub fn price(&self, x: f64) -> f64 {
        self.prior.map_or(0.0, |p| {
            let u = (x - p.mean) / p.sigma;
            u * u
        })
    }
}

/// A number that is known, or fitted as one of the [`ScalarParameter`]s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ScalarValue {
    /// Known.
    Known(f64),
    /// The scalar of this index.
    Estimated(usize),
}

impl ScalarValue {
    /// The number, for the values `scalars` of all scalars.
    ///
    /// # Panics
    /// If it is a scalar that is not among them.
    #[inline]
    pub fn of(self, scalars: &[f64]) -> f64 {
        match self {
            Self::Known(value) => value,
            Self::Estimated(index) => scalars[index],
        }
    }

    /// The index of the scalar, if it is estimated.
    pub fn index(self) -> Option<usize> {
        match self {
            Self::Known(_) => None,
            Self::Estimated(index) => Some(index),
        }
    }
}
