//! One step of the midpoint rule for a linear system in free response.
//!
//! Time is in units of the step `h`, so the velocity is `w = h v`, in m, and a step is
//!
//! ```text
//! w_h = w - (beta y + alpha w)            alpha = h/2 c/m            beta  = h^2/2 k/m
//! w'  = w - (delta y_h + gamma w_h)       gamma = h c_h/m_h          delta = h^2 k_h/m_h
//! y'  = y + w_h                           y_h = y + w/2
//! ```
//!
//! with `m_h`, `c_h`, `k_h` the means of the two nodes.

use crate::simd::{Arithmetic, Eight};
use std::ops::{Add, Div, Mul, Sub};

/// A number, or eight numbers in SIMD lanes.
pub(super) trait StepNumber:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
}

impl<T> StepNumber for T where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Div<Output = T>
{
}

/// Constants of all steps.
#[derive(Clone, Copy)]
pub(super) struct Constants<T> {
    pub zero: T,
    pub half: T,
    pub one: T,
    /// Step, s.
    pub h: T,
    /// Half of the step, s.
    pub half_h: T,
    /// `1/h`.
    pub per_h: T,
}

impl Constants<f64> {
    pub fn new(h: f64) -> Self {
        Self {
            zero: 0.0,
            half: 0.5,
            one: 1.0,
            h,
            half_h: 0.5 * h,
            per_h: 1.0 / h,
        }
    }

    /// The constants in all SIMD lanes.
    #[inline(always)]
    pub fn splat<A: Arithmetic>(self, arithmetic: A) -> Constants<Eight<A>> {
        Constants {
            zero: Eight::splat(arithmetic, self.zero),
            half: Eight::splat(arithmetic, self.half),
            one: Eight::splat(arithmetic, self.one),
            h: Eight::splat(arithmetic, self.h),
            half_h: Eight::splat(arithmetic, self.half_h),
            per_h: Eight::splat(arithmetic, self.per_h),
        }
    }
}

/// Mass, damping and `h` times the stiffness at a node.
#[derive(Clone, Copy)]
pub(super) struct NodeCoefficients<T> {
    pub m: T,
    pub c: T,
    pub hk: T,
}

/// Dimensionless rates of a step, and the mobilities.
#[derive(Clone, Copy)]
pub(super) struct StepRates<T> {
    pub alpha: T,
    pub beta: T,
    pub gamma: T,
    pub delta: T,
    /// Mobility `h/(2m)` at the left node and in the middle, s/kg.
    pub mobility: [T; 2],
}

impl<T: StepNumber> StepRates<T> {
    /// Computes the rates; both inverse masses come from one division.
    #[inline(always)]
    pub fn new(left: NodeCoefficients<T>, right: NodeCoefficients<T>, of: Constants<T>) -> Self {
        let twice = left.m + right.m;
        let both = of.half_h / (left.m * twice);
        let mobility = [twice * both, (left.m + left.m) * both];
        Self {
            alpha: left.c * mobility[0],
            beta: left.hk * mobility[0],
            gamma: (left.c + right.c) * mobility[1],
            delta: (left.hk + right.hk) * mobility[1],
            mobility,
        }
    }

    /// State `(y, w)` after the step.
    #[inline(always)]
    pub fn forward(&self, [y, w]: [T; 2], of: Constants<T>) -> [T; 2] {
        let w_half = w - (self.beta * y + self.alpha * w);
        let y_half = y + of.half * w;
        [y + w_half, w - (self.delta * y_half + self.gamma * w_half)]
    }

    /// Transpose of [`StepRates::forward`].
    #[inline(always)]
    pub fn backward(&self, [y, w]: [T; 2], of: Constants<T>) -> [T; 2] {
        let w_half = y - self.gamma * w;
        let y_half = self.delta * w;
        [
            (y - y_half) - self.beta * w_half,
            (w - of.half * y_half) + (w_half - self.alpha * w_half),
        ]
    }

    /// The step as an increment of the state.
    #[inline(always)]
    pub fn increment(&self, of: Constants<T>) -> Increment<T> {
        let q = of.one - self.alpha;
        let by_half = self.gamma * q;
        Increment {
            yy: of.zero - self.beta,
            yw: q,
            wy: self.gamma * self.beta - self.delta,
            ww: of.zero - (of.half * self.delta + by_half),
        }
    }

    /// Contributions of a step to the gradient with respect to `m/h`, `c` and `h k`: at its left node, and half of that at
    /// mid-step. `adjoint` is the state at the right node, `response` that at the left node.
    #[inline(always)]
    pub fn shares(&self, [y, w]: [T; 2], adjoint: [T; 2], of: Constants<T>) -> ([T; 3], [T; 3]) {
        let slowing = self.beta * y + self.alpha * w;
        let w_half = w - slowing;
        let y_half = y + of.half * w;
        let slowing_half = self.delta * y_half + self.gamma * w_half;
        let pull = (adjoint[0] - self.gamma * adjoint[1]) * self.mobility[0];
        let pull_half = adjoint[1] * self.mobility[1];
        let (push, push_half) = (of.zero - pull, of.zero - pull_half);
        (
            [(pull + pull) * slowing, push * w, push * y],
            [
                pull_half * slowing_half,
                push_half * w_half,
                push_half * y_half,
            ],
        )
    }
}

/// Increment `x_{i+1} - x_i = E x_i` of one step. Adding the identity would round the change by `E` at every step.
#[derive(Clone, Copy)]
pub(super) struct Increment<T> {
    yy: T,
    yw: T,
    wy: T,
    ww: T,
}

impl<T: StepNumber> Increment<T> {
    /// State `x + E x`.
    #[inline(always)]
    pub fn forward(&self, [y, w]: [T; 2]) -> [T; 2] {
        [
            y + (self.yy * y + self.yw * w),
            w + (self.wy * y + self.ww * w),
        ]
    }
}
