//! Methods of the forward solve.

/// Explicit Runge–Kutta method of the forward solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Explicit midpoint rule, second order: that of the paper.
    Midpoint,
    /// Classical Runge–Kutta method, fourth order.
    Rk4,
}

impl Method {
    /// Name in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Method::Midpoint => "midpoint",
            Method::Rk4 => "rk4",
        }
    }

    /// Order of accuracy.
    pub fn order(self) -> u32 {
        match self {
            Method::Midpoint => 2,
            Method::Rk4 => 4,
        }
    }
}
