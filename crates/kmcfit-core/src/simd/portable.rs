//! Scalar arithmetic on eight lanes, for any processor.

use super::{Arithmetic, LANES, Row};
use std::array::from_fn;

/// Scalar arithmetic.
#[derive(Clone, Copy)]
pub(crate) struct Portable;

/// Operators lane by lane.
macro_rules! operators {
    ($($name:ident |$a:ident, $b:ident| $result:expr),*) => {$(
        #[inline(always)]
        fn $name(self, a: Row, b: Row) -> Row {
            from_fn(|i| {
                let ($a, $b) = (a[i], b[i]);
                $result
            })
        }
    )*};
}

impl Arithmetic for Portable {
    type Registers = Row;

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
    fn sqrt(self, a: Row) -> Row {
        from_fn(|i| a[i].sqrt())
    }

    #[inline(always)]
    fn abs(self, a: Row) -> Row {
        from_fn(|i| a[i].abs())
    }

    operators!(
        add | a,
        b | a + b,
        sub | a,
        b | a - b,
        mul | a,
        b | a * b,
        div | a,
        b | a / b
    );
}
