//! How large a change of a function is large.

use super::Evaluation;
use crate::dynamics::quadrature::curvature;
use crate::dynamics::{Term, Trajectory};
use crate::functions::Design;
use crate::lanes::sum::dot;
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
            let takes_part = |e: &usize| self.experiments[*e].device == which;
            let squares = |of: &dyn Fn(usize) -> f64| -> f64 {
                let motions = (0..self.experiments.len()).filter(takes_part);
                motions.map(of).sum::<f64>().sqrt()
            };
            let mass = largest(&device.mass);
            let inertia = mass * squares(&|e| dot(&accelerations[e], &accelerations[e]));
            let natural = |j: usize| {
                let response = squares(&|e| {
                    let Trajectory {
                        displacement: y,
                        velocity: v,
                    } = &evaluation.trajectories[e];
                    match self.oscillator.terms[j] {
                        Term::Damping => dot(v, v),
                        Term::Stiffness => dot(y, y),
                        term => {
                            let pairs = y.iter().zip(v);
                            pairs.map(|(y, v)| term.phi(*y, *v).powi(2)).sum()
                        }
                    }
                });
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
            let delta = &delta[range.clone()];
            let change = match &function.design {
                Design::Identity => largest(delta),
                design => {
                    values.fill(0.0);
                    design.multiply_add(delta, &mut values);
                    largest(&values)
                }
            };
            if change != 0.0 {
                most = most.max(change / size);
            }
        }
        let scalars = self.functions.scalars().iter().zip(self.scalars(&delta));
        scalars.fold(most, |most, (scalar, x)| most.max(x.abs() / scalar.size))
    }
}

fn largest(f: &[f64]) -> f64 {
    // Four at a time: one maximum would wait for itself.
    let (fours, rest) = f.as_chunks::<4>();
    let mut most = [0.0f64; 4];
    for four in fours {
        for (most, p) in most.iter_mut().zip(four) {
            *most = most.max(p.abs());
        }
    }
    let rest = rest.iter().map(|p| p.abs());
    rest.chain(most).fold(0.0, f64::max)
}
