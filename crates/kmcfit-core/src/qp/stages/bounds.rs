//! Linear constraint rows `a' xi <= b` of an interior-point iterate.

use super::barrier::{Barrier, LEAST_SLACK, longest_step};
use super::rows::StageRows;
use crate::constraints::TOLERANCE;

/// Rows `a' xi + s = b` with slacks `s` and multipliers, both positive.
pub(super) struct Bounds<'a> {
    rows: &'a StageRows,
    /// Largest coefficient of each row in the variables.
    scales: &'a [f64],
    slacks: Vec<f64>,
    /// Multipliers, for half the cost.
    pub multipliers: Vec<f64>,
    /// `a' xi + s - b`.
    violations: Vec<f64>,
    slack_step: Vec<f64>,
    multiplier_step: Vec<f64>,
    products: Vec<f64>,
    weights: Vec<f64>,
    factors: Vec<f64>,
}

impl<'a> Bounds<'a> {
    pub fn new(rows: &'a StageRows, scales: &'a [f64]) -> Self {
        let zeros = vec![0.0; rows.len()];
        Self {
            rows,
            scales,
            slacks: zeros.clone(),
            multipliers: zeros.clone(),
            violations: zeros.clone(),
            slack_step: zeros.clone(),
            multiplier_step: zeros.clone(),
            products: Vec::with_capacity(rows.len()),
            weights: zeros.clone(),
            factors: zeros,
        }
    }

    /// `b - a' xi`.
    pub fn distances<const W: usize>(&mut self, xi: &[[f64; W]]) -> Vec<f64> {
        self.rows.products(xi, &mut self.products);
        let pairs = self.rows.right.iter().zip(&self.products);
        pairs.map(|(right, product)| right - product).collect()
    }

    /// Slacks by the larger of the distances at the start and at the minimum without constraints; products `mean`.
    pub fn start_inside(&mut self, at_start: &[f64], at_minimum: &[f64], mean: f64) {
        let pairs = at_start.iter().zip(at_minimum);
        let sizes: Vec<f64> = pairs.map(|(a, b)| a.abs().max(b.abs())).collect();
        let largest = sizes.iter().fold(0.0, |most: f64, size| most.max(*size));
        for (k, size) in sizes.into_iter().enumerate() {
            self.slacks[k] = size.max(LEAST_SLACK * largest);
            self.multipliers[k] = mean / self.slacks[k];
        }
    }

    /// Weights that hold the rows within `near` of their bound which have a positive multiplier in `estimates`, with a gap of `least` for each;
    /// `None` if there is no such row, or one is violated.
    pub fn hold_active(
        &mut self,
        distances: &[f64],
        estimates: &[f64],
        near: f64,
        least: f64,
    ) -> Option<()> {
        let mut is_any = false;
        for (k, (distance, estimate)) in distances.iter().zip(estimates).enumerate() {
            if *distance < -TOLERANCE * self.scales[k] {
                return None;
            }
            let is_active = *distance <= near * self.scales[k] && *estimate > 0.0;
            is_any |= is_active;
            self.factors[k] = if is_active { *estimate } else { 0.0 };
            self.weights[k] = self.factors[k] * self.factors[k] / least;
        }
        is_any.then_some(())
    }

    /// Slacks and multipliers on the central path, with products `mean`: near the bound by the multiplier, elsewhere by the distance.
    pub fn start_at_active_rows(
        &mut self,
        distances: &[f64],
        estimates: &[f64],
        near: f64,
        mean: f64,
    ) {
        for (k, (distance, estimate)) in distances.iter().zip(estimates).enumerate() {
            let is_near = *estimate > 0.0 && mean / estimate > *distance;
            self.slacks[k] = match is_near {
                true => mean / estimate,
                false => distance.max(near * self.scales[k]),
            };
            self.multipliers[k] = mean / self.slacks[k];
        }
    }

    /// Largest distance, in units of the rows.
    pub fn largest(&self, distances: &[f64]) -> f64 {
        let relative = distances
            .iter()
            .zip(self.scales)
            .map(|(d, scale)| d / scale);
        relative.fold(0.0, f64::max)
    }
}

impl<const W: usize> Barrier<W> for Bounds<'_> {
    fn curvature(&self) -> (&StageRows, &[f64]) {
        (self.rows, &self.weights)
    }

    fn add_to_gradient(&self, gradient: &mut [[f64; W]]) {
        self.rows.transpose_add(&self.factors, gradient);
    }

    fn degree(&self) -> usize {
        self.slacks.len()
    }

    fn gap(&self) -> f64 {
        let pairs = self.slacks.iter().zip(&self.multipliers);
        pairs.map(|(s, m)| s * m).sum()
    }

    fn is_satisfied(&self) -> bool {
        let pairs = self.violations.iter().zip(&self.slacks);
        let mut rows = pairs.zip(self.scales);
        rows.all(|((violation, slack), scale)| violation - slack <= 0.1 * TOLERANCE * scale)
    }

    fn update_violations(&mut self, xi: &[[f64; W]]) {
        self.rows.products(xi, &mut self.products);
        for (k, violation) in self.violations.iter_mut().enumerate() {
            *violation = self.products[k] + self.slacks[k] - self.rows.right[k];
        }
    }

    fn predict(&mut self) {
        for k in 0..self.slacks.len() {
            self.weights[k] = self.multipliers[k] / self.slacks[k];
            self.factors[k] = self.weights[k] * self.violations[k];
            self.multiplier_step[k] = 0.0;
        }
    }

    fn correct(&mut self, target: f64) {
        for k in 0..self.slacks.len() {
            let correction = self.slack_step[k] * self.multiplier_step[k];
            self.multiplier_step[k] = (target - correction) / self.slacks[k];
            self.factors[k] += self.multiplier_step[k];
        }
    }

    /// The violations vanish at the full length.
    fn update_steps(&mut self, step: &[[f64; W]]) {
        self.rows.products(step, &mut self.products);
        for k in 0..self.slacks.len() {
            self.slack_step[k] = -self.violations[k] - self.products[k];
            self.multiplier_step[k] -= self.multipliers[k] + self.weights[k] * self.slack_step[k];
        }
    }

    fn longest_step(&self, share: f64) -> f64 {
        let slacks = self.slacks.iter().zip(&self.slack_step);
        let multipliers = self.multipliers.iter().zip(&self.multiplier_step);
        longest_step(slacks, share).min(longest_step(multipliers, share))
    }

    fn gap_after(&self, length: f64) -> f64 {
        let each = (0..self.slacks.len()).map(|k| {
            (self.slacks[k] + length * self.slack_step[k])
                * (self.multipliers[k] + length * self.multiplier_step[k])
        });
        each.sum()
    }

    fn move_by(&mut self, length: f64) {
        for k in 0..self.slacks.len() {
            self.slacks[k] += length * self.slack_step[k];
            self.multipliers[k] += length * self.multiplier_step[k];
        }
    }

    fn take_multipliers(&mut self) {
        self.factors.copy_from_slice(&self.multipliers);
    }
}
