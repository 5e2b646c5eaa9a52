//! Explicit Runge–Kutta methods whose stages are at nodes or half-way between them, each after the one before.

/// Position of a stage in a step; coefficients there are a nodal value, or the mean of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum At {
    Left,
    Middle,
    Right,
}

impl At {
    /// Shares of the values at the left and the right node.
    pub fn shares(self) -> [f64; 2] {
        match self {
            At::Left => [1.0, 0.0],
            At::Middle => [0.5, 0.5],
            At::Right => [0.0, 1.0],
        }
    }
}

/// Coefficients of an explicit method with `S` stages: stage `s + 1` starts from `x + next[s] dt x'_s`, and the step ends at
/// `x + sum_s end[s] dt x'_s`.
#[derive(Debug)]
pub(crate) struct Tableau<const S: usize> {
    pub at: [At; S],
    pub next: [f64; S],
    pub end: [f64; S],
}

pub(crate) const MIDPOINT: Tableau<2> = Tableau {
    at: [At::Left, At::Middle],
    next: [0.5, 0.0],
    end: [0.0, 1.0],
};

pub(crate) const RK4: Tableau<4> = Tableau {
    at: [At::Left, At::Middle, At::Middle, At::Right],
    next: [0.5, 0.5, 1.0, 0.0],
    end: [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0],
};
