//! How large a change of a function is large.

use super::Evaluation;
use crate::dynamics::quadrature::curvature;
use crate::problem::Problem;

impl Problem {
    /// For each function the larger of its own largest value and of the value at which its force
    /// would be as large as the mass's: `max m * rms(y'') / rms(phi)` along the motions. So a
    /// damping on its way to zero still has a size, that of a damping that matters.
    pub fn natural_sizes(&self, evaluation: &Evaluation) -> Vec<f64> {
        let step = self.oscillator.grid.step();
        let squares = |f: &dyn Fn(usize, usize) -> f64| -> f64 {
            let each = evaluation
                .trajectories
                .iter()
                .enumerate()
                .map(|(e, motion)| {
                    (0..motion.displacement.len())
                        .map(|i| f(e, i).powi(2))
                        .sum::<f64>()
                });
            each.sum::<f64>().sqrt()
        };
        let accelerations: Vec<Vec<f64>> = (evaluation.trajectories.iter())
            .map(|motion| curvature(&motion.displacement, step))
            .collect();
        let largest = |f: &[f64]| f.iter().fold(0.0f64, |most, p| most.max(p.abs()));
        let mass = largest(&evaluation.device.mass);
        let inertia = mass * squares(&|e, i| accelerations[e][i]);
        let natural = |j: usize| {
            let response = squares(&|e, i| {
                let motion = &evaluation.trajectories[e];
                self.oscillator.terms[j].phi(motion.displacement[i], motion.velocity[i])
            });
            if response > 0.0 {
                inertia / response
            } else {
                0.0
            }
        };
        let own = evaluation.device.functions().map(largest);
        let natural = std::iter::once(mass).chain((0..self.oscillator.terms.len()).map(natural));
        own.zip(natural)
            .map(|(own, natural)| own.max(natural))
            .collect()
    }

    /// The largest change of a function from one point to another, relative to
    /// [`Problem::natural_sizes`] at the first, over the functions.
    pub fn relative_change(&self, before: &Evaluation, after: &crate::dynamics::Device) -> f64 {
        let pairs = before.device.functions().zip(after.functions());
        let changes = pairs.zip(self.natural_sizes(before)).map(|((b, a), size)| {
            let change = b
                .iter()
                .zip(a)
                .fold(0.0f64, |most, (b, a)| most.max((a - b).abs()));
            if change == 0.0 { 0.0 } else { change / size }
        });
        changes.fold(0.0, f64::max)
    }
}
