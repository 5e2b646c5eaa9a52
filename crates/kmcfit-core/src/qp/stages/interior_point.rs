//! An interior-point method on stages: Mehrotra's predictor and corrector, with Newton steps by the Riccati recursion.
//!
//! With slacks `s` and multipliers `lambda` of the constraint rows `A xi <= b`, a Newton step at the barrier parameter `mu`
//! minimises
//!
//! ```text
//! 1/2 d' (H + A' W A) d + (g + A' (W r + (mu - corrections) / s))' d,    W = lambda / s,    r = A xi + s - b
//! ```
//!
//! over the changes `d` of the coordinates that the transitions allow; `g` is the gradient of half the cost. The start
//! satisfies the transitions with their offsets, so every iterate does.
//!
//! Source: S. Mehrotra, SIAM J. Optim. 2 (1992) 575-601; C. V. Rao, S. J. Wright, J. B. Rawlings, J. Optim. Theory Appl. 99
//! (1998) 723-757 for the recursion.

use super::riccati::Factor;
use super::transcription::StageProgram;
use crate::constraints::TOLERANCE;

/// Gap between the cost and its lower bound, relative to the cost, at which an iterate is a solution: a three hundredth of
/// the accuracy that a solution needs ([`crate::qp::Kkt::COST`]).
const GAP: f64 = 1e-12;
/// Share of the way to the nearest bound that a step takes.
const TO_THE_BOUND: f64 = 0.99;
/// A step below this share of the Newton step makes no progress.
const NO_STEP: f64 = 1e-8;
/// Iterations without halving the gap after which a search from the active rows ends, and one from the middle of the bounds.
const PATIENCE: [u32; 2] = [5, 25];
/// Least slack at the start, relative to the largest.
const LEAST_SLACK: f64 = 1e-3;
/// The gap at a start at active rows, relative to the decrease by a step that holds them.
const WARM_GAP: f64 = 0.3;
/// Distance within which a row counts as active there, relative to the largest one in units of the rows.
const NEAR: f64 = 1e-4;

/// A solution in the coordinates of the stages.
pub(super) struct StageSolution<const W: usize> {
    pub xi: Vec<[f64; W]>,
    /// Multipliers of the constraint rows, for half the cost; zero where none is active.
    pub multipliers: Vec<f64>,
    /// Decrease of half the Lagrangian by a Newton step with the curvature of the active rows.
    pub decrease: f64,
    /// `s' lambda`: bound of the further excess of half the cost over the minimum.
    pub gap: f64,
}

/// The iterate of the method.
struct InteriorPoint<'a, const X: usize, const W: usize> {
    program: &'a StageProgram<X, W>,
    factor: Factor<X, W>,
    xi: Vec<[f64; W]>,
    /// Slacks of the constraint rows, positive.
    slacks: Vec<f64>,
    multipliers: Vec<f64>,
    /// `A xi + s - b`.
    violations: Vec<f64>,
    /// Gradient of half the cost.
    slope: Vec<[f64; W]>,
    /// Gradient with the terms of the constraint rows.
    gradient: Vec<[f64; W]>,
    step: Vec<[f64; W]>,
    slack_step: Vec<f64>,
    multiplier_step: Vec<f64>,
    products: Vec<f64>,
    weights: Vec<f64>,
    factors: Vec<f64>,
}

/// Minimises, in at most so many iterations, to a gap of [`GAP`] of the cost or, inside the bounds, of `share` of the decrease
/// since the start; `None` if a Newton step fails. `estimates` are multipliers of the constraint rows at the start. A search from
/// the active rows that does not converge is repeated from the middle of the bounds.
pub(super) fn minimise<const X: usize, const W: usize>(
    program: &StageProgram<X, W>,
    estimates: &[f64],
    iterations: u32,
    share: f64,
) -> Option<StageSolution<W>> {
    from_active_rows(program, estimates, iterations, share).or_else(|| {
        let mut iterate = InteriorPoint::new(program);
        let start = iterate.update_slope();
        let distances = iterate.distances();
        iterate.factorise()?;
        iterate.newton_step()?;
        iterate.move_by(1.0);
        let cost = iterate.update_slope();
        let at_minimum = iterate.distances();
        if at_minimum.iter().any(|distance| *distance < 0.0) {
            iterate.start_inside(&distances, &at_minimum, start - cost);
            iterate.converge(start, cost, [iterations, PATIENCE[1]], share)?;
        }
        iterate.solution()
    })
}

/// Minimises from the active rows; `None` if there are none or the search does not converge.
fn from_active_rows<const X: usize, const W: usize>(
    program: &StageProgram<X, W>,
    estimates: &[f64],
    iterations: u32,
    share: f64,
) -> Option<StageSolution<W>> {
    let mut iterate = InteriorPoint::new(program);
    let start = iterate.update_slope();
    let distances = iterate.distances();
    let is_converged = iterate.start_at_active_rows(&distances, estimates, start)?
        && iterate.converge(start, start, [iterations, PATIENCE[0]], share)?;
    is_converged.then(|| iterate.solution())?
}

impl<'a, const X: usize, const W: usize> InteriorPoint<'a, X, W> {
    /// The known first states and zero controls.
    fn new(program: &'a StageProgram<X, W>) -> Self {
        let rows = program.constraints.len();
        let zeros = vec![[0.0; W]; program.stages];
        Self {
            program,
            factor: Factor::new(program.stages, program.controls()),
            xi: program.uncontrolled(),
            slope: zeros.clone(),
            gradient: zeros.clone(),
            step: zeros,
            slacks: vec![1.0; rows],
            multipliers: vec![0.0; rows],
            violations: vec![0.0; rows],
            slack_step: vec![0.0; rows],
            multiplier_step: vec![0.0; rows],
            products: Vec::with_capacity(rows),
            weights: vec![0.0; rows],
            factors: vec![0.0; rows],
        }
    }

    /// Iterates from half the cost `cost`, `start` at zero; true at the gap that was asked for. `None` if a Newton step fails.
    fn converge(
        &mut self,
        start: f64,
        mut cost: f64,
        [iterations, patience]: [u32; 2],
        share: f64,
    ) -> Option<bool> {
        let (mut least, mut since) = (f64::INFINITY, 0);
        for _ in 0..iterations {
            let gap = self.gap();
            let is_close = gap <= share * (start - cost) && self.is_inside();
            if gap <= GAP * cost || is_close {
                return Some(true);
            }
            since = if gap <= 0.5 * least { 0 } else { since + 1 };
            least = least.min(gap);
            if since > patience || !gap.is_finite() || self.predictor_corrector()? <= NO_STEP {
                break;
            }
            cost = self.update_slope();
        }
        Some(false)
    }

    /// Updates the gradient of half the cost, and returns half the cost.
    fn update_slope(&mut self) -> f64 {
        let rows = &self.program.residuals;
        let mut sum = 0.0;
        for (i, (slope, xi)) in self.slope.iter_mut().zip(&self.xi).enumerate() {
            *slope = [0.0; W];
            for row in rows.of_stage(i) {
                let residual = rows.product(row, xi) - rows.right[row];
                sum += residual * residual;
                rows.add_multiple(row, residual, slope);
            }
        }
        0.5 * sum
    }

    /// `b - A xi`.
    fn distances(&mut self) -> Vec<f64> {
        let rows = &self.program.constraints;
        rows.products(&self.xi, &mut self.products);
        let pairs = rows.right.iter().zip(&self.products);
        pairs.map(|(right, product)| right - product).collect()
    }

    fn gap(&self) -> f64 {
        let pairs = self.slacks.iter().zip(&self.multipliers);
        pairs.map(|(s, m)| s * m).sum()
    }

    /// True if all rows are satisfied.
    fn is_inside(&self) -> bool {
        let pairs = self.violations.iter().zip(&self.slacks);
        let mut rows = pairs.zip(&self.program.scales);
        rows.all(|((violation, slack), scale)| violation - slack <= 0.1 * TOLERANCE * scale)
    }

    /// Slacks and multipliers inside, from the distances from the bounds at the start and at the minimum without
    /// constraints, which lowers half the cost by `decrease`.
    fn start_inside(&mut self, at_start: &[f64], at_minimum: &[f64], decrease: f64) {
        let mean = decrease / at_start.len() as f64;
        let pairs = at_start.iter().zip(at_minimum);
        let sizes: Vec<f64> = pairs.map(|(a, b)| a.abs().max(b.abs())).collect();
        let largest = sizes.iter().fold(0.0, |most: f64, size| most.max(*size));
        for (k, size) in sizes.into_iter().enumerate() {
            self.slacks[k] = size.max(LEAST_SLACK * largest);
            self.multipliers[k] = mean / self.slacks[k];
        }
        self.update_violations();
    }

    /// Slacks and multipliers for a start with active rows, by `estimates` of the multipliers; false if no active row has one,
    /// or a row does not hold. The gap follows from the decrease by a step that holds these rows.
    fn start_at_active_rows(
        &mut self,
        distances: &[f64],
        estimates: &[f64],
        cost: f64,
    ) -> Option<bool> {
        let scales = &self.program.scales;
        let relative = distances.iter().zip(scales).map(|(d, scale)| d / scale);
        let near = NEAR * relative.fold(0.0, f64::max);
        let count = distances.len() as f64;
        let least = GAP * cost / count;
        let mut is_any = false;
        for (k, (distance, estimate)) in distances.iter().zip(estimates).enumerate() {
            if *distance < -TOLERANCE * scales[k] {
                return Some(false);
            }
            let is_active = *distance <= near * scales[k] && *estimate > 0.0;
            is_any |= is_active;
            self.factors[k] = if is_active { *estimate } else { 0.0 };
            self.weights[k] = self.factors[k] * self.factors[k] / least;
        }
        if !is_any {
            return Some(false);
        }
        self.factorise()?;
        self.newton_step()?;
        // Complementarity of this point with the estimates.
        let pairs = distances.iter().zip(estimates);
        let gap = pairs
            .map(|(distance, m)| distance.max(0.0) * m)
            .sum::<f64>();
        let mean = (WARM_GAP * self.promised_decrease().max(gap) / count).max(10.0 * least);
        for (k, (distance, estimate)) in distances.iter().zip(estimates).enumerate() {
            // On the central path: near the bound by the multiplier, elsewhere by the distance.
            let is_near = *estimate > 0.0 && mean / estimate > *distance;
            self.slacks[k] = match is_near {
                true => mean / estimate,
                false => distance.max(near * scales[k]),
            };
            self.multipliers[k] = mean / self.slacks[k];
        }
        self.update_violations();
        Some(true)
    }

    /// `-1/2 g' d` of the Newton step `d` and its gradient `g`.
    fn promised_decrease(&self) -> f64 {
        let steps = self.step.iter().flatten();
        let pairs = self.gradient.iter().flatten().zip(steps);
        -0.5 * pairs.map(|(g, d)| g * d).sum::<f64>()
    }

    fn update_violations(&mut self) {
        let rows = &self.program.constraints;
        rows.products(&self.xi, &mut self.products);
        for (k, violation) in self.violations.iter_mut().enumerate() {
            *violation = self.products[k] + self.slacks[k] - rows.right[k];
        }
    }

    /// Factorises for the weights of the constraint rows.
    fn factorise(&mut self) -> Option<()> {
        let program = self.program;
        let is_done = self.factor.factorise(
            &program.transitions,
            &program.residuals,
            &program.constraints,
            &self.weights,
        );
        is_done.then_some(())
    }

    /// The Newton step of the coordinates with the factors of the constraint rows in the gradient.
    fn newton_step(&mut self) -> Option<()> {
        let program = self.program;
        self.gradient.copy_from_slice(&self.slope);
        program
            .constraints
            .transpose_add(&self.factors, &mut self.gradient);
        let slope = self.factor.backward(&program.transitions, &self.gradient);
        let first = self.first_step(&slope)?;
        self.factor
            .forward(&program.transitions, first, &mut self.step);
        Some(())
    }

    /// The change of the first state: it minimises `1/2 x' P x + p' x` in the states that are not known.
    fn first_step(&self, slope: &[f64; X]) -> Option<[f64; X]> {
        let free: Vec<usize> = (0..X)
            .filter(|j| self.program.fixed[*j].is_none())
            .collect();
        let n = free.len();
        let matrix = nalgebra::DMatrix::from_fn(n, n, |i, j| self.factor.first[free[i]][free[j]]);
        let right = nalgebra::DVector::from_fn(n, |i, _| -slope[free[i]]);
        // In units in which the diagonal is 1.
        let units = nalgebra::DVector::from_fn(n, |i, _| 1.0 / matrix[(i, i)].sqrt());
        let scaled = nalgebra::DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * units[i] * units[j]);
        let solution = scaled.cholesky()?.solve(&right.component_mul(&units));
        let mut step = [0.0; X];
        for (k, j) in free.iter().enumerate() {
            step[*j] = solution[k] * units[k];
        }
        Some(step)
    }

    /// One iteration; the length of its step.
    fn predictor_corrector(&mut self) -> Option<f64> {
        let count = self.slacks.len();
        let gap = self.gap();
        for k in 0..count {
            self.weights[k] = self.multipliers[k] / self.slacks[k];
            self.factors[k] = self.weights[k] * self.violations[k];
        }
        self.factorise()?;
        self.newton_step()?;
        self.update_slack_step();
        for k in 0..count {
            self.multiplier_step[k] = -self.multipliers[k] - self.weights[k] * self.slack_step[k];
        }
        // The smaller the decrease of the gap by the predictor, the larger the target of the corrector.
        let length = self.longest_step(1.0);
        let mut ahead = 0.0;
        for k in 0..count {
            ahead += (self.slacks[k] + length * self.slack_step[k])
                * (self.multipliers[k] + length * self.multiplier_step[k]);
        }
        let target = (ahead / gap).powi(3) * gap / count as f64;
        for k in 0..count {
            // Second-order term of the product of slack and multiplier.
            let correction = self.slack_step[k] * self.multiplier_step[k];
            self.multiplier_step[k] = (target - correction) / self.slacks[k];
            self.factors[k] += self.multiplier_step[k];
        }
        self.newton_step()?;
        self.update_slack_step();
        for k in 0..count {
            self.multiplier_step[k] -= self.multipliers[k] + self.weights[k] * self.slack_step[k];
        }
        let length = self.longest_step(TO_THE_BOUND);
        self.move_by(length);
        for k in 0..count {
            self.slacks[k] += length * self.slack_step[k];
            self.multipliers[k] += length * self.multiplier_step[k];
        }
        self.update_violations();
        Some(length)
    }

    /// Changes of the slacks by the step of the coordinates: the violations vanish at its full length.
    fn update_slack_step(&mut self) {
        let rows = &self.program.constraints;
        rows.products(&self.step, &mut self.products);
        let pairs = self.violations.iter().zip(&self.products);
        for (step, (violation, product)) in self.slack_step.iter_mut().zip(pairs) {
            *step = -violation - product;
        }
    }

    /// The longest step, at most 1, that goes `share` of the way to the nearest bound.
    fn longest_step(&self, share: f64) -> f64 {
        let mut length = 1.0f64;
        for (values, steps) in [
            (&self.slacks, &self.slack_step),
            (&self.multipliers, &self.multiplier_step),
        ] {
            for (value, step) in values.iter().zip(steps) {
                if *step < 0.0 {
                    length = length.min(-share * value / step);
                }
            }
        }
        length
    }

    fn move_by(&mut self, length: f64) {
        let pairs = self.xi.iter_mut().flatten().zip(self.step.iter().flatten());
        pairs.for_each(|(xi, step)| *xi += length * step);
    }

    /// The iterate, with the decrease that the gradient of its Lagrangian promises.
    fn solution(mut self) -> Option<StageSolution<W>> {
        self.factors.copy_from_slice(&self.multipliers);
        self.newton_step()?;
        let decrease = self.promised_decrease();
        Some(StageSolution {
            gap: self.gap(),
            xi: self.xi,
            multipliers: self.multipliers,
            decrease: decrease.max(0.0),
        })
    }
}
