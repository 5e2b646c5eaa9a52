//! Cost and Euclidean gradient of a problem in one call, for use with other optimisers.

use crate::functions::Design;
use crate::problem::Problem;
use crate::record::{Channel, Experiment};
use crate::step::{SimulationError, least_squares};
use crate::system::Excitation;

impl Problem {
    /// Cost `J` at `theta`; writes its Euclidean gradient `dJ/dtheta`, by the discrete adjoint, into `gradient`.
    ///
    /// For one record with nodal functions, a linear free response by the midpoint rule and a displacement sample at every node the
    /// gradient is written in place; all other problems use [`Problem::evaluate`] and [`Problem::gradient`].
    ///
    /// # Errors
    /// As [`Problem::evaluate`]; the contents of `gradient` are then undefined.
    ///
    /// # Panics
    /// If `theta` or `gradient` has a length other than the number of parameters.
    pub fn cost_and_gradient(
        &self,
        theta: &[f64],
        gradient: &mut [f64],
    ) -> Result<f64, SimulationError> {
        assert_eq!(theta.len(), self.parameters(), "one number per parameter");
        assert_eq!(gradient.len(), self.parameters(), "one slope per parameter");
        if let Some(misfit) = self.fused_least_squares(theta, gradient) {
            if self.is_regularised() {
                let push = self.penalty_gradient(theta);
                gradient.iter_mut().zip(&push).for_each(|(g, p)| *g += p);
            }
            return Ok(misfit + self.regularisation(theta));
        }
        let evaluation = self.evaluate(theta)?;
        gradient.copy_from_slice(&self.euclidean_gradient(theta, &evaluation));
        Ok(evaluation.cost)
    }

    /// Misfit and gradient in place; `None` where it does not apply, or where a result is not finite.
    fn fused_least_squares(&self, theta: &[f64], gradient: &mut [f64]) -> Option<f64> {
        let (experiment, channel, weights) = self.one_full_record()?;
        let nodes = experiment.nodes;
        if theta.len() != 3 * nodes {
            return None;
        }
        let (mass, others) = theta.split_at(nodes);
        let (damping, stiffness) = others.split_at(nodes);
        let (by_mass, others) = gradient.split_at_mut(nodes);
        let (by_damping, by_stiffness) = others.split_at_mut(nodes);
        least_squares(
            &self.system,
            [mass, damping, stiffness],
            &experiment.initial,
            channel.observed(),
            weights,
            [by_mass, by_damping, by_stiffness],
        )
    }

    /// The record, its channel and the weights of its samples, if the problem has a single free record with a sample at
    /// every node and nodal functions in the order of the list.
    pub(crate) fn one_full_record(&self) -> Option<(&Experiment, &Channel, [f64; 2])> {
        let [experiment] = self.experiments.as_slice() else {
            return None;
        };
        let [channel] = experiment.channels.as_slice() else {
            return None;
        };
        let nodes = self.system.grid.nodes();
        let mut designs = self.functions.iter().map(|f| &f.design);
        let plain = experiment.nodes == nodes
            && channel.len() == nodes
            && channel.stride() == Some(1)
            && self.functions.scalars().is_empty()
            && matches!(self.functions.coefficient_sets(), [only] if *only == vec![0, 1, 2].into())
            && designs.all(|d| matches!(d, Design::Identity))
            && experiment
                .excitation
                .as_ref()
                .is_none_or(Excitation::is_zero);
        plain.then_some((experiment, channel, channel.uniform_weights()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::functions::Parameterization;
    use crate::model::CoefficientSpec;
    use crate::system::Grid;
    use crate::system::Method;

    /// The paper's problem on a coarse grid.
    fn problem() -> Problem {
        let grid = Grid::new(0.0, 25.0, 200).unwrap();
        let times = grid.times();
        let samples: Vec<f64> = times.iter().map(|t| 3.3 * (0.9 * t).cos()).collect();
        let record = Record::new("free decay")
            .from_state(3.3, 1.0)
            .displacement(&times, &samples);
        Builder::new([2.0, 0.5, 1.0].map(CoefficientSpec::nodal))
            .record(record)
            .method(Method::Midpoint)
            .build()
            .unwrap()
    }

    /// The direct way is several times as fast with equal results; no other test detects that it is not used.
    #[test]
    fn the_paper_s_problem_is_computed_in_place() {
        let problem = problem();
        let theta = problem.start();
        let mut gradient = vec![0.0; theta.len()];
        assert!(problem.fused_least_squares(&theta, &mut gradient).is_some());
    }

    /// A system whose functions are in another order than in the list.
    #[test]
    fn functions_in_any_order() {
        let mut problem = problem();
        let [m, c, k] = problem
            .functions
            .iter()
            .cloned()
            .collect::<Vec<_>>()
            .try_into()
            .unwrap();
        let grid = problem.system.grid;
        let functions = Parameterization::with_coefficient_sets(
            vec![k, m, c],
            vec![vec![1, 2, 0]],
            grid.nodes(),
            grid.step(),
        );
        problem.parts_mut().functions = functions.unwrap();
        let theta = problem.start();
        let mut found = vec![0.0; theta.len()];
        let cost = problem.cost_and_gradient(&theta, &mut found).unwrap();
        let evaluation = problem.evaluate(&theta).unwrap();
        assert_eq!(cost, evaluation.cost);
        assert_eq!(found, problem.euclidean_gradient(&theta, &evaluation));
    }
}
