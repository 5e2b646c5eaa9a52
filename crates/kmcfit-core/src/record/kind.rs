//! Kinds of measured quantities.

/// Measured quantity of a channel.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelKind {
    /// Displacement `y`, m.
    Displacement,
    /// Velocity `y'`, m/s.
    Velocity,
    /// Acceleration `y''`, m/s^2.
    Acceleration,
}

impl ChannelKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Displacement, Self::Velocity, Self::Acceleration];

    /// Key in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
        }
    }

    /// Symbol.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Displacement => "y",
            Self::Velocity => "y'",
            Self::Acceleration => "y''",
        }
    }

    /// SI unit for a translation or, if `angular`, a rotation.
    pub fn unit_of(self, angular: bool) -> &'static str {
        match (self, angular) {
            (_, false) => self.unit(),
            (Self::Displacement, true) => "rad",
            (Self::Velocity, true) => "rad/s",
            (Self::Acceleration, true) => "rad/s^2",
        }
    }

    /// SI unit for a translation.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Displacement => "m",
            Self::Velocity => "m/s",
            Self::Acceleration => "m/s^2",
        }
    }
}
