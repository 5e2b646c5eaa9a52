//! Rows of systems in SIMD lanes, and their steps by the midpoint rule.

use super::{SearchRay, States, part};
use crate::simd::{Arithmetic, Eight, Kernel, Row};

/// `R` rows of systems.
pub(super) struct BatchRows<'a, const R: usize> {
    pub ray: SearchRay<'a>,
    pub lengths: &'a [Row; R],
    pub states: &'a mut [States; R],
    /// Sums of squares; not finite where the response is not.
    pub costs: &'a mut [Row; R],
}

/// Mass, damping and stiffness of a row of systems.
#[derive(Clone, Copy)]
pub(super) struct Values<A: Arithmetic>(pub [Eight<A>; 3]);

impl<A: Arithmetic> Values<A> {
    #[inline(always)]
    fn at(ray: &SearchRay, arithmetic: A, length: Eight<A>, i: usize) -> Self {
        let mut values = [length; 3];
        let pairs = ray.functions.iter().zip(&ray.direction);
        for (value, (p, g)) in values.iter_mut().zip(pairs) {
            let (p, g) = (
                Eight::splat(arithmetic, p[i]),
                Eight::splat(arithmetic, g[i]),
            );
            *value = p - length * g;
        }
        Self(values)
    }

    /// Twice the values at mid-step; halving all three would not change a bit of an acceleration.
    #[inline(always)]
    fn twice_middle(self, right: Self) -> Self {
        let mut values = self.0;
        for (value, right) in values.iter_mut().zip(right.0) {
            *value = right + *value;
        }
        Self(values)
    }

    /// Deceleration `-y'' = k y/m + c v/m`. Using it in place of the acceleration changes no bit except the sign of a zero
    /// velocity.
    #[inline(always)]
    fn deceleration(self, y: Eight<A>, v: Eight<A>) -> Eight<A> {
        let [m, c, k] = self.0;
        k * y / m + c * v / m
    }
}

/// Constants of all steps.
#[derive(Clone, Copy)]
pub(super) struct Steps<A: Arithmetic> {
    dt: Eight<A>,
    half_dt: Eight<A>,
}

impl<A: Arithmetic> Steps<A> {
    #[inline(always)]
    pub fn of(arithmetic: A, step: f64) -> Self {
        let splat = |x| Eight::splat(arithmetic, x);
        Self {
            dt: splat(step),
            half_dt: splat(0.5 * step),
        }
    }

    /// One step of the midpoint rule.
    #[inline(always)]
    pub fn step(self, [left, right]: [Values<A>; 2], [y, v]: [Eight<A>; 2]) -> [Eight<A>; 2] {
        let Self { dt, half_dt } = self;
        let d = left.deceleration(y, v);
        let (y_half, v_half) = (y + half_dt * v, v - half_dt * d);
        let middle = left.twice_middle(right);
        let d_half = middle.deceleration(y_half, v_half);
        [y + dt * v_half, v - dt * d_half]
    }
}

/// A row of systems during integration.
#[derive(Clone, Copy)]
struct BatchCoefficients<A: Arithmetic> {
    arithmetic: A,
    length: Row,
    left: Values<A>,
    state: [Eight<A>; 2],
    /// Sum of squared residuals.
    sum: Eight<A>,
}

impl<A: Arithmetic> BatchCoefficients<A> {
    #[inline(always)]
    fn begin(ray: &SearchRay, arithmetic: A, length: &Row) -> Self {
        let splat = |x| Eight::splat(arithmetic, x);
        let state = [splat(ray.initial.displacement), splat(ray.initial.velocity)];
        let residual = state[0] - splat(ray.samples[0]);
        Self {
            arithmetic,
            length: *length,
            left: Values::at(ray, arithmetic, Eight::load(arithmetic, length), 0),
            state,
            // Both ends have half weight.
            sum: splat(-0.5) * (residual * residual),
        }
    }

    #[inline(always)]
    fn step(&mut self, ray: &SearchRay, steps: Steps<A>, i: usize) {
        let residual = self.state[0] - Eight::splat(self.arithmetic, ray.samples[i]);
        self.sum += residual * residual;
        let length = Eight::load(self.arithmetic, &self.length);
        let right = Values::at(ray, self.arithmetic, length, i + 1);
        self.state = steps.step([self.left, right], self.state);
        self.left = right;
    }

    #[inline(always)]
    fn rows(&self) -> [Row; 2] {
        [self.state[0].row(), self.state[1].row()]
    }

    #[inline(always)]
    fn cost(&self, last_sample: f64) -> Row {
        let splat = |x| Eight::splat(self.arithmetic, x);
        let [y, v] = self.state;
        let residual = y - splat(last_sample);
        // Zero for a finite response, otherwise not a number.
        let nothing = splat(0.0) * y + splat(0.0) * v;
        (self.sum + splat(0.5) * (residual * residual) + nothing).row()
    }
}

impl<const R: usize> Kernel for BatchRows<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) {
        let BatchRows {
            ray,
            lengths,
            states,
            costs,
        } = self;
        let steps = Steps::of(arithmetic, ray.step);
        let nodes = ray.samples.len();
        let last = nodes - 1;
        let part = part(nodes);

        let mut rows = [BatchCoefficients::begin(&ray, arithmetic, &lengths[0]); R];
        for r in 1..R {
            rows[r] = BatchCoefficients::begin(&ray, arithmetic, &lengths[r]);
        }
        let (mut next, mut which) = (0, 0);
        for i in 0..=last {
            if i == next {
                for r in 0..R {
                    states[r][which] = rows[r].rows();
                }
                (next, which) = (next + part, which + 1);
            }
            if i < last {
                for row in &mut rows {
                    row.step(&ray, steps, i);
                }
            }
        }
        for r in 0..R {
            costs[r] = rows[r].cost(ray.samples[last]);
        }
    }
}
