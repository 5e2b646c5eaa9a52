//! How large a change of a function is large.

use super::Evaluation;
use crate::dynamics::quadrature::curvature;
use crate::problem::Problem;

impl Problem {
    /// For each function of the list the larger of its own largest value and of the value at which
    /// its force would be as large as the mass's: `max m * rms(y'') / rms(phi)` along the motions of
    /// the experiments that it takes part in. So a damping on its way to zero still has a size, that
    /// of a damping that matters.
    pub fn natural_sizes(&self, evaluation: &Evaluation) -> Vec<f64> {
        let step = self.oscillator.grid.step();
        let accelerations: Vec<Vec<f64>> = (evaluation.trajectories.iter())
            .map(|motion| curvature(&motion.displacement, step))
            .collect();
        let mut sizes = vec![0.0f64; self.functions.ranges().len()];
        for (which, assembly) in self.functions.assemblies().iter().enumerate() {
            let device = evaluation.device_of(which);
            let motions =
                || (0..self.experiments.len()).filter(|e| self.experiments[*e].device == which);
            let squares = motions().map(|e| sum_of_squares(accelerations[e].iter().copied()));
            let mass = largest(&device.mass);
            let inertia = mass * squares.sum::<f64>().sqrt();
            let natural = |j: usize| {
                let term = self.oscillator.terms[j];
                let squares = motions().map(|e| {
                    let motion = &evaluation.trajectories[e];
                    let states = motion.displacement.iter().zip(&motion.velocity);
                    sum_of_squares(states.map(|(y, v)| term.phi(*y, *v)))
                });
                let response = squares.sum::<f64>().sqrt();
                match response > 0.0 {
                    true => inertia / response,
                    false => 0.0,
                }
            };
            let terms = 0..self.oscillator.terms.len();
            let natural = std::iter::once(mass).chain(terms.map(natural));
            let own = device.functions().map(largest);
            for (&f, (own, natural)) in assembly.iter().zip(own.zip(natural)) {
                sizes[f] = sizes[f].max(own).max(natural);
            }
        }
        sizes
    }

    /// The largest change of a function or scalar from one point to the parameters `after`, relative
    /// to [`Problem::natural_sizes`] at the first, or to the scalar's own size.
    pub fn relative_change(&self, before: &Evaluation, from: &[f64], after: &[f64]) -> f64 {
        let delta: Vec<f64> = after.iter().zip(from).map(|(a, b)| a - b).collect();
        let mut values = vec![0.0; self.functions.nodes()];
        let parts = self.functions.iter().zip(self.functions.ranges());
        let functions = parts.zip(self.natural_sizes(before));
        let mut most = 0.0f64;
        for ((function, range), size) in functions {
            values.fill(0.0);
            function
                .design
                .multiply_add(&delta[range.clone()], &mut values);
            let change = largest(&values);
            if change != 0.0 {
                most = most.max(change / size);
            }
        }
        let scalars = self.functions.scalars().iter().zip(self.scalars(&delta));
        scalars.fold(most, |most, (scalar, x)| most.max(x.abs() / scalar.size))
    }
}

fn largest(f: &[f64]) -> f64 {
    f.iter().fold(0.0f64, |most, p| most.max(p.abs()))
}

fn sum_of_squares(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|x| x * x).sum()
}
