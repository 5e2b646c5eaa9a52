//! Absolute values `h |a' xi - t|` of an interior-point iterate.

use super::barrier::{Barrier, longest_step};
use super::rows::StageRows;

/// Rows `a' xi - t = p - q` with positive parts `p` and `q`, which cost `h (p + q)`. With the multiplier `y` of a row, those of its parts are
/// `h - y` and `h + y`.
pub(super) struct AbsoluteValues<'a> {
    rows: &'a StageRows,
    /// `h`, half the weights of the subproblem.
    costs: &'a [f64],
    parts: [Vec<f64>; 2],
    /// `y`.
    pub multipliers: Vec<f64>,
    part_steps: [Vec<f64>; 2],
    multiplier_step: Vec<f64>,
    products: Vec<f64>,
    weights: Vec<f64>,
    factors: Vec<f64>,
}

impl<'a> AbsoluteValues<'a> {
    pub fn new(rows: &'a StageRows, costs: &'a [f64]) -> Self {
        let zeros = vec![0.0; rows.len()];
        Self {
            rows,
            costs,
            parts: [zeros.clone(), zeros.clone()],
            multipliers: zeros.clone(),
            part_steps: [zeros.clone(), zeros.clone()],
            multiplier_step: zeros.clone(),
            products: Vec::with_capacity(rows.len()),
            weights: zeros.clone(),
            factors: zeros,
        }
    }

    /// Multipliers of zero, and parts that satisfy their rows with products of at least `mean`.
    pub fn start<const W: usize>(&mut self, xi: &[[f64; W]], mean: f64) {
        self.rows.products(xi, &mut self.products);
        for (k, h) in self.costs.iter().enumerate() {
            let distance = self.products[k] - self.rows.right[k];
            let least = mean / h.max(f64::MIN_POSITIVE);
            self.parts[0][k] = distance.max(0.0) + least;
            self.parts[1][k] = (-distance).max(0.0) + least;
        }
    }

    /// Multipliers of both parts.
    fn part_multipliers(&self, k: usize) -> [f64; 2] {
        let [h, y] = [self.costs[k], self.multipliers[k]];
        [h - y, h + y]
    }
}

impl<const W: usize> Barrier<W> for AbsoluteValues<'_> {
    fn curvature(&self) -> (&StageRows, &[f64]) {
        (self.rows, &self.weights)
    }

    fn add_to_gradient(&self, gradient: &mut [[f64; W]]) {
        self.rows.transpose_add(&self.factors, gradient);
    }

    fn degree(&self) -> usize {
        2 * self.costs.len()
    }

    fn gap(&self) -> f64 {
        <Self as Barrier<W>>::gap_after(self, 0.0)
    }

    fn cost(&self, xi: &[[f64; W]]) -> f64 {
        let mut products = Vec::with_capacity(self.rows.len());
        self.rows.products(xi, &mut products);
        let distances = products.iter().zip(&self.rows.right);
        let each = distances.zip(self.costs);
        each.map(|((product, right), h)| h * (product - right).abs())
            .sum()
    }

    /// Always: the parts satisfy their row from the start.
    fn is_satisfied(&self) -> bool {
        true
    }

    fn update_violations(&mut self, _: &[[f64; W]]) {}

    fn predict(&mut self) {
        for k in 0..self.costs.len() {
            let [plus, minus] = self.part_multipliers(k);
            let [p, q] = [self.parts[0][k], self.parts[1][k]];
            self.weights[k] = 1.0 / (p / plus + q / minus);
            self.factors[k] = self.multipliers[k] + self.weights[k] * (p - q);
            // Products to reach, over the multipliers.
            [self.part_steps[0][k], self.part_steps[1][k]] = [-p, -q];
        }
    }

    fn correct(&mut self, target: f64) {
        for k in 0..self.costs.len() {
            let [plus, minus] = self.part_multipliers(k);
            let [p, q] = [self.parts[0][k], self.parts[1][k]];
            let [dp, dq] = [self.part_steps[0][k], self.part_steps[1][k]];
            let dy = self.multiplier_step[k];
            let [to_p, to_q] = [
                (target + dp * dy) / plus - p,
                (target - dq * dy) / minus - q,
            ];
            self.factors[k] = self.multipliers[k] + self.weights[k] * (to_q - to_p);
            [self.part_steps[0][k], self.part_steps[1][k]] = [to_p, to_q];
        }
    }

    fn update_steps(&mut self, step: &[[f64; W]]) {
        self.rows.products(step, &mut self.products);
        for k in 0..self.costs.len() {
            let [plus, minus] = self.part_multipliers(k);
            let [p, q] = [self.parts[0][k], self.parts[1][k]];
            let [to_p, to_q] = [self.part_steps[0][k], self.part_steps[1][k]];
            let dy = self.weights[k] * (self.products[k] - to_p + to_q);
            self.multiplier_step[k] = dy;
            self.part_steps[0][k] = to_p + p * dy / plus;
            self.part_steps[1][k] = to_q - q * dy / minus;
        }
    }

    fn longest_step(&self, share: f64) -> f64 {
        let [p, q] = [0, 1]
            .map(|side| longest_step(self.parts[side].iter().zip(&self.part_steps[side]), share));
        let each = self
            .costs
            .iter()
            .zip(&self.multipliers)
            .zip(&self.multiplier_step);
        // The multiplier of the part towards which y moves.
        let falling = each.filter(|(_, dy)| **dy != 0.0);
        falling.fold(p.min(q), |length, ((h, y), dy)| {
            length.min(share * (h - y * dy.signum()) / dy.abs())
        })
    }

    fn gap_after(&self, length: f64) -> f64 {
        let each = (0..self.costs.len()).map(|k| {
            let [plus, minus] = self.part_multipliers(k);
            let dy = length * self.multiplier_step[k];
            let [p, q] = [0, 1].map(|side| self.parts[side][k] + length * self.part_steps[side][k]);
            p * (plus - dy) + q * (minus + dy)
        });
        each.sum()
    }

    fn move_by(&mut self, length: f64) {
        for k in 0..self.costs.len() {
            for side in 0..2 {
                self.parts[side][k] += length * self.part_steps[side][k];
            }
            self.multipliers[k] += length * self.multiplier_step[k];
        }
    }

    fn take_multipliers(&mut self) {
        self.factors.copy_from_slice(&self.multipliers);
    }
}
