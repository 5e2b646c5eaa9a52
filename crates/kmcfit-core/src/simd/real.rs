//! Number types of the kernel.

use super::{Arithmetic, Eight};
use std::ops::{Add, Div, Mul, Sub};

/// A number of the kernel: `f64`, or eight of them in SIMD lanes; in tests also a dual number.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// The constant `x`.
    fn like(self, x: f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Product with a constant.
    #[inline(always)]
    fn scale(self, x: f64) -> Self {
        self * self.like(x)
    }
}

impl Real for f64 {
    #[inline(always)]
    fn like(self, x: f64) -> f64 {
        x
    }

    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> f64 {
        f64::abs(self)
    }
}

impl<A: Arithmetic> Real for Eight<A> {
    #[inline(always)]
    fn like(self, x: f64) -> Self {
        self.constant(x)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Eight::sqrt(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Eight::abs(self)
    }
}
