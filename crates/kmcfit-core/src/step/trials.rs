//! Costs of many systems along a search ray, one per SIMD lane: the paper's trial steps.
//!
//! They choose candidates for the trial of least cost: the order of summation and the reciprocal of the mass differ from the paper's, whose
//! order of operations decides among the candidates.

use super::stage::{Function, LINEAR, Pair, Values, step};
use super::tableau::{At, MIDPOINT};
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES, Real, Row};
use crate::system::State;

/// Systems `p - a g` in linear free response by the midpoint rule, with a sample at every node.
#[derive(Clone, Copy)]
pub(crate) struct SearchRay<'a> {
    /// Mass, damping, stiffness at the nodes.
    pub functions: [&'a [f64]; 3],
    /// Search direction `g`, subtracted per unit of `a`.
    pub direction: [&'a [f64]; 3],
    /// State at the first node.
    pub initial: &'a State,
    /// Displacement samples at the nodes, m.
    pub samples: &'a [f64],
    /// Step, s.
    pub step: f64,
}

/// Largest number of rows computed together: enough to hide the latency of divisions, few enough for the registers.
const ROWS: usize = 4;

/// Relative margin between two ways to compute a cost. Each step rounds about ten operations, and the errors accumulate: some
/// 1e-12 at 2000 nodes. The margin is far above, and a further candidate costs one response.
const MARGIN: f64 = 1e-8;

impl SearchRay<'_> {
    /// Trials at `lengths` that may have the least cost `integral (y - y_obs)^2 dt`. All others have a higher cost, no positive mass, or a
    /// response that is not finite.
    pub fn candidates(self, lengths: &[f64]) -> Vec<usize> {
        let costs = self.costs(lengths);
        let lowest = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let may_be = |which: &usize| costs[*which] <= lowest * (1.0 + MARGIN);
        match lowest.is_finite() {
            true => (0..lengths.len()).filter(may_be).collect(),
            false => Vec::new(),
        }
    }

    /// Sums of squares at `lengths`; infinite where the mass is not positive or the response not finite.
    fn costs(self, lengths: &[f64]) -> Vec<f64> {
        let mut costs = Vec::with_capacity(lengths.len() + LANES);
        let rows: Vec<Row> = lengths
            .chunks(LANES)
            .map(|part| simd::window(part, 0))
            .collect();
        for rows in rows.chunks(ROWS) {
            match rows {
                [a] => costs.extend(self.of_rows([*a])),
                [a, b] => costs.extend(self.of_rows([*a, *b])),
                [a, b, c] => costs.extend(self.of_rows([*a, *b, *c])),
                [a, b, c, d, ..] => costs.extend(self.of_rows([*a, *b, *c, *d])),
                [] => {}
            }
        }
        let usable = |(cost, length): (f64, &f64)| match cost.is_finite() && self.has_mass(*length)
        {
            true => cost,
            false => f64::INFINITY,
        };
        costs.into_iter().zip(lengths).map(usable).collect()
    }

    /// True if the mass is positive at all nodes.
    fn has_mass(self, length: f64) -> bool {
        // All nodes are checked: a loop without early exit is faster.
        let pairs = self.functions[0].iter().zip(self.direction[0]);
        pairs.fold(true, |so_far, (p, g)| so_far & (p - length * g > 0.0))
    }

    fn of_rows<const R: usize>(self, lengths: [Row; R]) -> Vec<f64> {
        let sums = simd::run(Trials {
            ray: self,
            lengths: &lengths,
        });
        sums.into_iter().flatten().collect()
    }
}

/// Sums of squares of `R` rows of trials.
struct Trials<'a, const R: usize> {
    ray: SearchRay<'a>,
    lengths: &'a [Row; R],
}

/// Mass, damping and stiffness of a row of systems at both nodes of a step.
#[derive(Clone, Copy)]
struct OnRay<T>([[T; 3]; 2]);

impl<T: Real> Values<T, 1> for OnRay<T> {
    #[inline(always)]
    fn value(&self, function: Function, side: usize) -> T {
        match function {
            Function::Mass(_) => self.0[side][0],
            Function::Coefficient(e) => self.0[side][1 + e],
        }
    }

    #[inline(always)]
    fn drives(&self, _: At) -> Option<[[T; 1]; 2]> {
        None
    }
}

impl<const R: usize> Kernel for Trials<'_, R> {
    type Output = [Row; R];

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> [Row; R] {
        let Trials { ray, lengths } = self;
        let zero = Eight::splat(arithmetic, 0.0);
        let last = ray.samples.len() - 1;
        let start: Pair<_, 1> = [
            [Eight::splat(arithmetic, ray.initial.displacement(0))],
            [Eight::splat(arithmetic, ray.initial.velocity(0))],
        ];
        let mut states = [start; R];
        let mut values = [OnRay([[zero; 3]; 2]); R];
        let mut sums = [zero; R];
        for i in 0..=last {
            let sample = Eight::splat(arithmetic, ray.samples[i]);
            let weight = if i == 0 || i == last { 0.5 } else { 1.0 };
            for r in 0..R {
                let length = Eight::load(arithmetic, &lengths[r]);
                let OnRay([before, here]) = &mut values[r];
                *before = *here;
                for f in 0..3 {
                    here[f] = Eight::splat(arithmetic, ray.functions[f][i])
                        - length * Eight::splat(arithmetic, ray.direction[f][i]);
                }
                if i > 0 {
                    states[r] =
                        step::<_, 1, 2, 2>(&MIDPOINT, LINEAR, ray.step, &values[r], &states[r]);
                }
                let residual = states[r][0][0] - sample;
                sums[r] += (residual * residual).scale(weight);
            }
        }
        let mut rows = [[0.0; LANES]; R];
        for r in 0..R {
            rows[r] = sums[r].row();
        }
        rows
    }
}
