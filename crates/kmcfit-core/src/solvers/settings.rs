//! Settings of a fit: solver, start, gradient and termination.

use super::termination::Stopping;
use crate::objective::GradientKind;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Which solver, with its own settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// The paper's: 50 trial steps `5 sqrt(G^2) / i^4` along the L2 gradient, the best is taken.
    SteepestDescent,
    /// Limited-memory BFGS in the L2 inner product, in the logarithm of the mass.
    Lbfgs {
        /// Number of pairs kept.
        memory: usize,
    },
    /// Spectral projected gradient, under constraints.
    ProjectedGradient,
    /// Gauss–Newton with a proximal term, under constraints.
    GaussNewton,
    /// The minimum of the equation error ([`Measurements`](super::Measurements)), a convex problem that is solved once: the
    /// cost is another one, and neither start, gradient nor stopping test has a part in it.
    EquationError,
}

impl Solver {
    /// Name in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Solver::SteepestDescent => "steepest-descent",
            Solver::Lbfgs { .. } => "lbfgs",
            Solver::ProjectedGradient => "projected-gradient",
            Solver::GaussNewton => "gauss-newton",
            Solver::EquationError => "equation-error",
        }
    }
}

/// Where a fit starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Initial {
    /// From the start values of the functions.
    Functions,
    /// From the equation error of the samples.
    Data,
}

impl Initial {
    /// Name in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Initial::Functions => "functions",
            Initial::Data => "data",
        }
    }
}

/// The strategies for starting points, which a fit tries in turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StartStrategy {
    /// The parameters that fit the first steps of a long record.
    Truncated {
        /// How many.
        steps: usize,
    },
    /// The start values of the functions.
    StartValues,
    /// The minimum of the equation error.
    EquationError,
    /// The minimum of the equation error, fitted to growing parts of the record.
    GrowingHorizon,
    /// States and parameters that fit together, from a response near the measurements.
    Collocation,
    /// The end of the attempt with the lowest cost.
    Continued,
}

impl StartStrategy {
    /// Name in `result.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Truncated { .. } => "beginning of the record",
            Self::StartValues => "start values",
            Self::EquationError => "equation error",
            Self::GrowingHorizon => "growing horizon",
            Self::Collocation => "motion of the samples",
            Self::Continued => "best of these, continued",
        }
    }
}

/// How a fit is run.
#[derive(Debug, Clone)]
pub struct FitSettings {
    /// The solver.
    pub solver: Solver,
    /// Where it starts.
    pub initial: Initial,
    /// Which adjoint gives its gradients.
    pub gradient: GradientKind,
    /// When it ends.
    pub stopping: Stopping,
    /// Set from outside (Ctrl-C) to end the run after the current iteration.
    pub interrupt: Option<Arc<AtomicBool>>,
}

impl Default for FitSettings {
    /// Those of a model file that says nothing of them: Gauss–Newton from the functions' start, with exact
    /// gradients, until nothing changes.
    fn default() -> Self {
        Self {
            solver: Solver::GaussNewton,
            initial: Initial::Functions,
            gradient: GradientKind::Discrete,
            stopping: Stopping::default(),
            interrupt: None,
        }
    }
}
