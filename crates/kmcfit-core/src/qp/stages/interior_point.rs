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

use super::absolute_values::AbsoluteValues;
use super::barrier::Barrier;
use super::bounds::Bounds;
use super::cones::Cones;
use super::riccati::Factor;
use super::transcription::StageProgram;

/// Gap between the cost and its lower bound, relative to the cost, at which an iterate is a solution: a three hundredth of
/// the accuracy that a solution needs ([`crate::qp::Kkt::COST`]).
const GAP: f64 = 1e-12;
/// The same with cones: rounding errors of the slacks, relative to their distance from the cone, are those of the multipliers.
const CONE_GAP: f64 = 3e-11;
/// Share of the way to the nearest bound that a step takes.
const TO_THE_BOUND: f64 = 0.99;
/// A step below this share of the Newton step makes no progress.
const NO_STEP: f64 = 1e-8;
/// Iterations without halving the gap after which a search from the active rows ends, and one from the middle of the bounds.
const PATIENCE: [u32; 2] = [5, 25];
/// The gap at a start at active rows, relative to the geometric mean of the decrease by a step that holds them and of the complementarity
/// of the estimated multipliers.
const WARM_GAP: f64 = 0.3;
/// Least decrease in that mean, relative to the complementarity.
const LEAST_PROMISE: f64 = 1e-3;
/// Distance within which a row counts as active there, relative to the largest one in units of the rows.
const NEAR: f64 = 1e-4;

/// A solution in the coordinates of the stages.
pub(super) struct StageSolution<const W: usize> {
    pub xi: Vec<[f64; W]>,
    /// Multipliers of the constraint rows, for half the cost; zero where none is active.
    pub multipliers: Vec<f64>,
    /// Multipliers of the rows of the cones.
    pub cones: Vec<f64>,
    /// Multipliers of the absolute values.
    pub absolute: Vec<f64>,
    /// Decrease of half the Lagrangian by a Newton step with the curvature of the active rows.
    pub decrease: f64,
    /// By how much half the cost is below that of zero controls.
    pub fall: f64,
    /// Sum of the products of slacks and multipliers: bound of the further excess of half the cost over the minimum.
    pub gap: f64,
}

/// The iterate of the method.
struct InteriorPoint<'a, const X: usize, const W: usize> {
    program: &'a StageProgram<X, W>,
    factor: Factor<X, W>,
    is_factorised: bool,
    xi: Vec<[f64; W]>,
    bounds: Bounds<'a>,
    cones: Cones<'a>,
    absolute: AbsoluteValues<'a>,
    /// Gradient of half the sum of squares.
    slope: Vec<[f64; W]>,
    /// Gradient with the terms of the rows.
    gradient: Vec<[f64; W]>,
    step: Vec<[f64; W]>,
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
        let (mut iterate, start) = InteriorPoint::new(program);
        let [distances, values] = iterate.distances();
        iterate.predict_absolute_values();
        iterate.factorise()?;
        iterate.newton_step()?;
        iterate.move_by(1.0);
        let cost = iterate.update_slope();
        let [at_minimum, values_there] = iterate.distances();
        if iterate.is_bounded(&at_minimum) {
            let mean = (start - cost).max(GAP * start) / iterate.degree() as f64;
            iterate.bounds.start_inside(&distances, &at_minimum, mean);
            iterate.cones.start(&values, &values_there, mean);
            iterate.absolute.start(&iterate.xi, mean);
            iterate.update_violations();
            iterate.converge(start, cost, [iterations, PATIENCE[1]], share);
        }
        Some(iterate.solution(start))
    })
}

/// Minimises from the active rows; `None` if there are none or the search does not converge.
fn from_active_rows<const X: usize, const W: usize>(
    program: &StageProgram<X, W>,
    estimates: &[f64],
    iterations: u32,
    share: f64,
) -> Option<StageSolution<W>> {
    let (mut iterate, start) = InteriorPoint::new(program);
    iterate.start_at_active_rows(estimates, start)?;
    let is_converged = iterate.converge(start, start, [iterations, PATIENCE[0]], share);
    is_converged.then(|| iterate.solution(start))
}

impl<'a, const X: usize, const W: usize> InteriorPoint<'a, X, W> {
    /// The known first states and zero controls, and half the cost there.
    fn new(program: &'a StageProgram<X, W>) -> (Self, f64) {
        let zeros = vec![[0.0; W]; program.stages];
        let xi = program.uncontrolled();
        let mut iterate = Self {
            program,
            factor: Factor::new(program.stages, program.controls()),
            is_factorised: false,
            bounds: Bounds::new(&program.constraints, &program.scales),
            cones: Cones::new(&program.cones, &program.cone_rows),
            absolute: AbsoluteValues::new(&program.absolute, &program.absolute_costs),
            xi,
            slope: zeros.clone(),
            gradient: zeros.clone(),
            step: zeros,
        };
        let cost = iterate.update_slope();
        let mean = cost / iterate.degree().max(1) as f64;
        iterate.absolute.start(&iterate.xi, mean);
        (iterate, cost)
    }

    /// Weights and factors of the absolute values with multipliers of zero.
    fn predict_absolute_values(&mut self) {
        Barrier::<W>::predict(&mut self.absolute);
    }

    fn barriers(&self) -> [&dyn Barrier<W>; 3] {
        [&self.bounds, &self.cones, &self.absolute]
    }

    fn barriers_mut(&mut self) -> [&mut dyn Barrier<W>; 3] {
        [&mut self.bounds, &mut self.cones, &mut self.absolute]
    }

    /// Iterates from half the cost `cost`, `start` at zero; true at the gap that was asked for, false if the iterations end or a Newton
    /// step fails before.
    fn converge(
        &mut self,
        start: f64,
        mut cost: f64,
        [iterations, patience]: [u32; 2],
        share: f64,
    ) -> bool {
        let (mut least, mut since) = (f64::INFINITY, 0);
        let relative = match self.program.cone_order.is_empty() {
            true => GAP,
            false => CONE_GAP,
        };
        for _ in 0..iterations {
            let gap = self.gap();
            let rough = share * (start - cost);
            if gap <= relative * cost
                || (gap <= rough && self.is_inside() && self.excess() <= rough)
            {
                return true;
            }
            since = if gap <= 0.5 * least { 0 } else { since + 1 };
            least = least.min(gap);
            let length = match since <= patience && gap.is_finite() {
                true => self.predictor_corrector(),
                false => None,
            };
            if length.is_none_or(|length| length <= NO_STEP) {
                break;
            }
            cost = self.update_slope();
        }
        false
    }

    /// Updates the gradient of half the sum of squares, and returns half the cost.
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
        let others = self.barriers().map(|terms| terms.cost(&self.xi));
        0.5 * sum + others.iter().sum::<f64>()
    }

    /// Distances from the linear bounds, and the components of the cones.
    fn distances(&mut self) -> [Vec<f64>; 2] {
        [self.bounds.distances(&self.xi), self.cones.values(&self.xi)]
    }

    /// True if a bound or cone is violated, given the distances, or there are absolute values.
    fn is_bounded(&self, distances: &[f64]) -> bool {
        let is_outside = distances.iter().any(|distance| *distance < 0.0);
        is_outside || !self.program.absolute_costs.is_empty() || !self.program.cone_order.is_empty()
    }

    fn gap(&self) -> f64 {
        self.barriers().iter().map(|terms| terms.gap()).sum()
    }

    fn degree(&self) -> usize {
        self.barriers().iter().map(|terms| terms.degree()).sum()
    }

    fn is_inside(&self) -> bool {
        self.barriers().iter().all(|terms| terms.is_satisfied())
    }

    /// Bound of the excess of half the cost over the minimum, by weak duality: the gap, and the decrease of the Lagrangian to its
    /// minimum by a Newton step without the curvature of the rows.
    fn excess(&mut self) -> f64 {
        self.factorise_without_rows();
        let decrease = self.lagrangian_decrease();
        decrease.map_or(f64::INFINITY, |decrease| self.gap() + decrease)
    }

    /// The decrease that a Newton step on the Lagrangian promises; `None` without factors.
    fn lagrangian_decrease(&mut self) -> Option<f64> {
        for terms in self.barriers_mut() {
            terms.take_multipliers();
        }
        self.newton_step()?;
        Some(self.promised_decrease())
    }

    /// Slacks and multipliers for a start with active rows, by `estimates` of the multipliers; `None` if no active row has one,
    /// or a row does not hold. The gap follows from the decrease by a step that holds these rows.
    fn start_at_active_rows(&mut self, estimates: &[f64], cost: f64) -> Option<()> {
        let [distances, values] = self.distances();
        let near = NEAR * self.bounds.largest(&distances);
        let count = self.degree() as f64;
        let least = GAP * cost / count;
        self.bounds
            .hold_active(&distances, estimates, near, least)?;
        self.predict_absolute_values();
        self.factorise()?;
        self.newton_step()?;
        // Complementarity of this point with the estimates.
        let pairs = distances.iter().zip(estimates);
        let gap = pairs
            .map(|(distance, m)| distance.max(0.0) * m)
            .sum::<f64>();
        // Between the decrease by the step and the complementarity, which rows far from their bounds make too large.
        let promised = self.promised_decrease().max(LEAST_PROMISE * gap);
        let mean = WARM_GAP * (promised * promised.max(gap)).sqrt() / count;
        let mean = mean.max(10.0 * least);
        self.bounds
            .start_at_active_rows(&distances, estimates, near, mean);
        self.cones.start(&values, &values, mean);
        self.absolute.start(&self.xi, mean);
        self.update_violations();
        Some(())
    }

    /// `-1/2 g' d` of the Newton step `d` and its gradient `g`.
    fn promised_decrease(&self) -> f64 {
        let steps = self.step.iter().flatten();
        let pairs = self.gradient.iter().flatten().zip(steps);
        -0.5 * pairs.map(|(g, d)| g * d).sum::<f64>()
    }

    fn update_violations(&mut self) {
        self.bounds.update_violations(&self.xi);
        self.cones.update_violations(&self.xi);
    }

    /// Factorises for the weights of the rows.
    fn factorise(&mut self) -> Option<()> {
        let weighted = [
            Barrier::<W>::curvature(&self.bounds),
            Barrier::<W>::curvature(&self.cones),
            Barrier::<W>::curvature(&self.absolute),
        ];
        let (transitions, residuals) = (&self.program.transitions, &self.program.residuals);
        self.is_factorised = self.factor.factorise(transitions, residuals, &weighted);
        self.is_factorised.then_some(())
    }

    /// Factorises without the curvature of the rows.
    fn factorise_without_rows(&mut self) {
        let (transitions, residuals) = (&self.program.transitions, &self.program.residuals);
        self.is_factorised = self.factor.factorise(transitions, residuals, &[]);
    }

    /// The Newton step of the coordinates with the factors of the rows in the gradient.
    fn newton_step(&mut self) -> Option<()> {
        self.is_factorised.then_some(())?;
        self.gradient.copy_from_slice(&self.slope);
        self.bounds.add_to_gradient(&mut self.gradient);
        self.cones.add_to_gradient(&mut self.gradient);
        self.absolute.add_to_gradient(&mut self.gradient);
        let transitions = &self.program.transitions;
        let slope = self.factor.backward(transitions, &self.gradient);
        let first = self.first_step(&slope)?;
        self.factor.forward(transitions, first, &mut self.step);
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
        let gap = self.gap();
        for terms in self.barriers_mut() {
            terms.predict();
        }
        self.factorise()?;
        self.newton_step()?;
        self.update_steps();
        // The smaller the decrease of the gap by the predictor, the larger the target of the corrector.
        let length = self.longest_step(1.0);
        let ahead: f64 = self
            .barriers()
            .map(|terms| terms.gap_after(length))
            .iter()
            .sum();
        let target = (ahead / gap).powi(3) * gap / self.degree() as f64;
        for terms in self.barriers_mut() {
            terms.correct(target);
        }
        self.newton_step()?;
        self.update_steps();
        let length = self.longest_step(TO_THE_BOUND);
        let ahead = self.barriers().map(|terms| terms.gap_after(length));
        ahead.iter().sum::<f64>().is_finite().then_some(())?;
        self.move_by(length);
        for terms in self.barriers_mut() {
            terms.move_by(length);
        }
        self.update_violations();
        Some(length)
    }

    fn update_steps(&mut self) {
        self.bounds.update_steps(&self.step);
        self.cones.update_steps(&self.step);
        self.absolute.update_steps(&self.step);
    }

    /// The longest step, at most 1, that goes `share` of the way to the nearest boundary.
    fn longest_step(&self, share: f64) -> f64 {
        let each = self.barriers().map(|terms| terms.longest_step(share));
        each.into_iter().fold(1.0, f64::min)
    }

    fn move_by(&mut self, length: f64) {
        let pairs = self.xi.iter_mut().flatten().zip(self.step.iter().flatten());
        pairs.for_each(|(xi, step)| *xi += length * step);
    }

    /// The iterate, with the decrease that the gradient of its Lagrangian promises, and that since `start`.
    fn solution(mut self, start: f64) -> StageSolution<W> {
        let fall = start - self.update_slope();
        if !self.is_factorised {
            self.factorise_without_rows();
        }
        // Unknown where the Hessian cannot be factorised.
        let decrease = self.lagrangian_decrease().unwrap_or(f64::INFINITY);
        StageSolution {
            gap: self.gap(),
            xi: self.xi,
            multipliers: self.bounds.multipliers,
            cones: self.cones.multipliers,
            absolute: self.absolute.multipliers,
            decrease: decrease.max(0.0),
            fall,
        }
    }
}
