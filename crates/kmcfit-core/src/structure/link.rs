//! Elements and the coordinates that they join.

use super::Law;
use crate::simd::Real;

/// Element between a coordinate and another one, or the ground; its elongation is `q_from - q_to`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Link {
    pub law: Law,
    pub from: usize,
    /// `None` for the ground.
    pub to: Option<usize>,
}

impl Link {
    /// Element between the only coordinate and the ground.
    pub const fn grounded(law: Law) -> Self {
        Self {
            law,
            from: 0,
            to: None,
        }
    }

    /// Ends, known to the compiler for one coordinate.
    #[inline(always)]
    pub fn ends<const N: usize>(self) -> (usize, Option<usize>) {
        match N {
            1 => (0, None),
            _ => (self.from, self.to),
        }
    }

    /// Elongation of the element by displacements `x` of the coordinates.
    #[inline(always)]
    pub fn across<T: Real, const N: usize>(self, x: &[T; N]) -> T {
        match self.ends::<N>() {
            (i, None) => x[i],
            (i, Some(j)) => x[i] - x[j],
        }
    }
}
