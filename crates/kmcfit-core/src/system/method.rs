//! Methods of the forward solve.

/// Method of the forward solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Explicit midpoint rule, second order: that of the paper.
    Midpoint,
    /// Classical Runge–Kutta method, fourth order.
    Rk4,
    /// Implicit midpoint rule, second order: stable with every step, for stiff structures. An undamped linear oscillation of frequency
    /// `omega` keeps its energy and has the frequency `2 atan(omega h / 2) / h`.
    #[serde(skip)]
    ImplicitMidpoint,
}

impl Method {
    /// Name in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Method::Midpoint => "midpoint",
            Method::Rk4 => "rk4",
            Method::ImplicitMidpoint => "implicit-midpoint",
        }
    }

    /// Order of accuracy.
    pub fn order(self) -> u32 {
        match self {
            Method::Midpoint | Method::ImplicitMidpoint => 2,
            Method::Rk4 => 4,
        }
    }
}
