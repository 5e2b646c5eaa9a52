//! Iterate of a search: parameters with cost, gradient and linearisation.

use super::linearization::Linearization;
use crate::objective::{Evaluation, Gradient};
use crate::problem::Problem;
use std::sync::OnceLock;

/// Parameters with their evaluation and gradient.
#[derive(Debug, Clone)]
pub struct Iterate {
    /// Parameters of all functions.
    pub parameters: Vec<f64>,
    /// Cost, coefficients and responses.
    pub evaluation: Evaluation,
    /// Gradient of the cost.
    pub gradient: Gradient,
    cached: Cached,
}

impl Iterate {
    pub(crate) fn new(parameters: Vec<f64>, evaluation: Evaluation, gradient: Gradient) -> Self {
        Self {
            parameters,
            evaluation,
            gradient,
            cached: Cached::default(),
        }
    }

    /// The iterate with natural sizes and linearisation.
    pub(super) fn with_cached(
        self,
        sizes: OnceLock<Vec<f64>>,
        linearization: Linearization,
    ) -> Self {
        let cached = Cached {
            sizes,
            linearization,
        };
        Self { cached, ..self }
    }

    /// Linearisation for a step from the iterate.
    pub(super) fn linearization(&self) -> &Linearization {
        &self.cached.linearization
    }

    /// [`Problem::natural_scales`] at the iterate.
    fn natural_scales(&self, problem: &Problem) -> &[f64] {
        (self.cached.sizes).get_or_init(|| problem.natural_scales(&self.evaluation))
    }

    /// [`Parameterization::relative_metric`](crate::functions::Parameterization::relative_metric) with the sizes at the iterate,
    /// over the whole grid.
    pub(crate) fn relative_metric(&self, problem: &Problem) -> Vec<f64> {
        let duration = problem.system.grid.duration();
        (problem.functions).relative_metric(self.natural_scales(problem), duration)
    }

    /// [`Problem::relative_change`] from the iterate to the parameters `after`.
    pub(crate) fn relative_change(&self, problem: &Problem, after: &[f64]) -> f64 {
        self.distance(problem, &self.parameters, after)
    }

    /// [`Problem::relative_change`] between two parameter vectors, with the sizes at the iterate.
    pub(crate) fn distance(&self, problem: &Problem, from: &[f64], to: &[f64]) -> f64 {
        problem.change_in_scales(self.natural_scales(problem), from, to)
    }
}

/// Values derived from parameters, evaluation and gradient.
#[derive(Clone, Default)]
struct Cached {
    sizes: OnceLock<Vec<f64>>,
    linearization: Linearization,
}

impl std::fmt::Debug for Cached {
    /// Placeholder, because cached values are not part of an iterate's identity.
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("…")
    }
}
