//! Terms of an interior-point iterate: bounds, cones and absolute values, each with its slacks and multipliers.

use super::rows::StageRows;

/// Share of the largest distance below which a slack at the start is not chosen.
pub(super) const LEAST_SLACK: f64 = 1e-3;

/// Constraint rows or absolute values with complementary pairs of slacks and multipliers.
///
/// A Newton step minimises `1/2 d' (H + sum w a a') d + (g + sum f a)' d` in the changes `d` of the coordinates, with the weights
/// `w` and factors `f` of the rows `a`.
pub(super) trait Barrier<const W: usize> {
    /// Rows with their weights in the Hessian.
    fn curvature(&self) -> (&StageRows, &[f64]);
    /// Adds the rows with their factors to the gradient.
    fn add_to_gradient(&self, gradient: &mut [[f64; W]]);
    /// Number of complementary pairs.
    fn degree(&self) -> usize;
    /// Sum of the products of the pairs.
    fn gap(&self) -> f64;
    /// Cost of the terms at the coordinates, as part of half the cost.
    fn cost(&self, _xi: &[[f64; W]]) -> f64 {
        0.0
    }
    /// True if the rows are satisfied.
    fn is_satisfied(&self) -> bool;
    /// Updates the violations of the rows from the coordinates.
    fn update_violations(&mut self, xi: &[[f64; W]]);
    /// Weights at this iterate, and the factors of the step towards products of zero.
    fn predict(&mut self);
    /// Factors of the step towards products of `target`, with the second-order term of the last step.
    fn correct(&mut self, target: f64);
    /// Changes of slacks and multipliers for a step of the coordinates.
    fn update_steps(&mut self, step: &[[f64; W]]);
    /// The longest step, at most 1, that goes `share` of the way to the nearest boundary.
    fn longest_step(&self, share: f64) -> f64;
    /// [`Barrier::gap`] after a step of this length.
    fn gap_after(&self, length: f64) -> f64;
    fn move_by(&mut self, length: f64);
    /// Factors by which the gradient is that of the Lagrangian.
    fn take_multipliers(&mut self);
}

/// The longest step, at most 1, that takes positive values `share` of the way to zero.
pub(super) fn longest_step<'a>(pairs: impl Iterator<Item = (&'a f64, &'a f64)>, share: f64) -> f64 {
    let falling = pairs.filter(|(_, step)| **step < 0.0);
    falling.fold(1.0, |length: f64, (value, step)| {
        length.min(-share * value / step)
    })
}
