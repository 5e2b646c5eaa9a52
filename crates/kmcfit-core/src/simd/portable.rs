//! Eight lanes without particular instructions.

use super::{Arithmetic, LANES, Row};
use std::array::from_fn;

/// Plain numbers.
#[derive(Clone, Copy)]
pub(crate) struct Portable;

impl Arithmetic for Portable {
    type Registers = Row;
    type Half = Self;
    const IS_FUSED: bool = false;

    #[inline(always)]
    fn half(self) -> Self {
        self
    }

    #[inline(always)]
    fn splat(self, x: f64) -> Row {
        [x; LANES]
    }

    #[inline(always)]
    fn load(self, row: &Row) -> Row {
        *row
    }

    #[inline(always)]
    fn store(self, x: Row) -> Row {
        x
    }

    #[inline(always)]
    fn add(self, a: Row, b: Row) -> Row {
        from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn sub(self, a: Row, b: Row) -> Row {
        from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul(self, a: Row, b: Row) -> Row {
        from_fn(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn div(self, a: Row, b: Row) -> Row {
        from_fn(|i| a[i] / b[i])
    }

    #[inline(always)]
    fn larger(self, a: Row, b: Row) -> Row {
        from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }
}
