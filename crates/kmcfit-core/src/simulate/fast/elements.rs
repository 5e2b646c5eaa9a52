//! Element responses `phi(y, v)` and their derivatives in eight SIMD lanes.

use crate::simd::{Arithmetic, Eight, LANES};
use crate::system::Term;

/// Element response with its derivatives with respect to displacement and velocity.
pub(super) struct Response<A: Arithmetic> {
    pub phi: Eight<A>,
    pub by_y: Derivative<A>,
    pub by_v: Derivative<A>,
}

/// A derivative; zero and one need no product.
pub(super) enum Derivative<A: Arithmetic> {
    Zero,
    One,
    Of(Eight<A>),
}

impl<A: Arithmetic> Derivative<A> {
    /// Difference `sum - p` times the derivative.
    #[inline(always)]
    pub fn taken_from(self, sum: Eight<A>, p: Eight<A>) -> Eight<A> {
        match self {
            Derivative::Zero => sum,
            Derivative::One => sum - p,
            Derivative::Of(by) => sum - p * by,
        }
    }
}

impl Term {
    /// [`Term::phi`] and [`Term::partials`] at eight states.
    #[inline(always)]
    pub(super) fn respond<A: Arithmetic>(
        self,
        arithmetic: A,
        y: Eight<A>,
        v: Eight<A>,
    ) -> Response<A> {
        match self {
            Term::Damping => Response {
                phi: v,
                by_y: Derivative::Zero,
                by_v: Derivative::One,
            },
            Term::Stiffness => Response {
                phi: y,
                by_y: Derivative::One,
                by_v: Derivative::Zero,
            },
            Term::QuadraticStiffness => Response {
                phi: y * y,
                by_y: Derivative::Of(Eight::splat(arithmetic, 2.0) * y),
                by_v: Derivative::Zero,
            },
            Term::CubicStiffness => {
                let square = y * y;
                Response {
                    phi: square * y,
                    by_y: Derivative::Of(Eight::splat(arithmetic, 3.0) * square),
                    by_v: Derivative::Zero,
                }
            }
            Term::QuinticStiffness => {
                let square = y * y;
                let fourth = square * square;
                Response {
                    phi: fourth * y,
                    by_y: Derivative::Of(Eight::splat(arithmetic, 5.0) * fourth),
                    by_v: Derivative::Zero,
                }
            }
            Term::QuadraticDamping | Term::CoulombFriction { .. } | Term::Offset => {
                self.one_by_one(arithmetic, y, v)
            }
        }
    }

    /// Terms with absolute values and square roots, lane by lane.
    #[inline(always)]
    fn one_by_one<A: Arithmetic>(self, arithmetic: A, y: Eight<A>, v: Eight<A>) -> Response<A> {
        let (y, v) = (y.row(), v.row());
        let [mut phi, mut by_y, mut by_v] = [[0.0; LANES]; 3];
        for l in 0..LANES {
            phi[l] = self.phi(y[l], v[l]);
            (by_y[l], by_v[l]) = self.partials(y[l], v[l]);
        }
        Response {
            phi: Eight::load(arithmetic, &phi),
            by_y: Derivative::Of(Eight::load(arithmetic, &by_y)),
            by_v: Derivative::Of(Eight::load(arithmetic, &by_v)),
        }
    }
}

/// Evaluates an expression with the list of terms as a compile-time constant for common lists, so that the compiler
/// unrolls the loop over it; the second name is the largest number of terms.
macro_rules! with_known {
    ($terms:expr, $known:ident, $most:ident => $call:expr) => {
        match $terms {
            [Term::Damping, Term::Stiffness] => {
                const $most: usize = 2;
                let $known: &[Term] = &[Term::Damping, Term::Stiffness];
                $call
            }
            [Term::Damping, Term::Stiffness, Term::CubicStiffness] => {
                const $most: usize = 3;
                let $known: &[Term] = &[Term::Damping, Term::Stiffness, Term::CubicStiffness];
                $call
            }
            $known => {
                const $most: usize = MOST_TERMS;
                $call
            }
        }
    };
}
pub(super) use with_known;
