//! Explicit Runge–Kutta methods whose stages are at nodes or half-way between them.

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

/// Position of a stage in a step; coefficients there are a nodal value, or the mean of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StagePosition {
    Left,
    Middle,
    Right,
}

impl StagePosition {
    /// Value of the piecewise linear function `f` at this position of step `i`.
    #[inline(always)]
    pub fn of(self, f: &[f64], i: usize) -> f64 {
        match self {
            StagePosition::Left => f[i],
            StagePosition::Middle => (f[i + 1] + f[i]) * 0.5,
            StagePosition::Right => f[i + 1],
        }
    }

    /// Weight of the value at the node `node`, an end of the step, at this position.
    #[inline(always)]
    pub fn share(self, node: StagePosition) -> f64 {
        match (self, node) {
            (StagePosition::Middle, _) => 0.5,
            (here, node) if here == node => 1.0,
            _ => 0.0,
        }
    }

    /// Transpose of [`StagePosition::of`]: adds `value` to the nodes of the position.
    #[inline(always)]
    pub fn spread(self, f: &mut [f64], i: usize, value: f64) {
        match self {
            StagePosition::Left => f[i] += value,
            StagePosition::Middle => {
                f[i] += 0.5 * value;
                f[i + 1] += 0.5 * value;
            }
            StagePosition::Right => f[i + 1] += value,
        }
    }
}

/// Coefficients of an explicit method with `S` stages: stage `s` starts from `x + sum_r a[s][r] k_r`
/// with `k_r = dt x'_r`, and the step ends at `x + sum_s b[s] k_s`.
#[derive(Debug)]
pub(crate) struct Tableau<const S: usize> {
    pub a: [[f64; S]; S],
    pub b: [f64; S],
    pub position: [StagePosition; S],
}

pub(crate) const MIDPOINT: Tableau<2> = Tableau {
    a: [[0.0, 0.0], [0.5, 0.0]],
    b: [0.0, 1.0],
    position: [StagePosition::Left, StagePosition::Middle],
};

pub(crate) const RK4: Tableau<4> = Tableau {
    a: [
        [0.0, 0.0, 0.0, 0.0],
        [0.5, 0.0, 0.0, 0.0],
        [0.0, 0.5, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
    ],
    b: [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0],
    position: [
        StagePosition::Left,
        StagePosition::Middle,
        StagePosition::Middle,
        StagePosition::Right,
    ],
};
