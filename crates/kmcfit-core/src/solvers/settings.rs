//! Settings of a fit: solver, start, gradient and termination.

use super::termination::Stopping;
use crate::objective::GradientKind;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Solver of a fit, with its settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// The paper's method: 50 trial steps `5 sqrt(G^2) / i^4` along the negative L2 gradient, of which the best is taken.
    SteepestDescent,
    /// Limited-memory BFGS in the L2 inner product, with the logarithm of the mass.
    Lbfgs {
        /// Number of stored pairs.
        memory: usize,
    },
    /// Spectral projected gradient, with constraints.
    ProjectedGradient,
    /// Gauss–Newton with a proximal term, with constraints.
    GaussNewton,
    /// Minimum of the equation error ([`Measurements`](super::Measurements)), a convex problem with another cost; independent of
    /// start, gradient and stopping test.
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

/// Initial parameters of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Initial {
    /// Start values of the functions.
    Functions,
    /// Minimum of the equation error of the samples.
    Data,
    /// Start values of the functions, near an optimum: no other is tried.
    #[serde(skip)]
    Near,
}

impl Initial {
    /// Name in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Initial::Functions | Initial::Near => "functions",
            Initial::Data => "data",
        }
    }
}

/// Start strategies, tried in turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StartStrategy {
    /// Parameters fitted to the first steps of a long record.
    Truncated {
        /// Number of steps.
        steps: usize,
    },
    /// Start values of the functions.
    StartValues,
    /// Minimum of the equation error.
    EquationError,
    /// Minimum of the equation error, fitted to growing parts of the record.
    GrowingHorizon,
    /// Constants by a scan of the natural frequency, then three knots, then the functions.
    FrequencyScan,
    /// The best fit with outliers of mass and stiffness moved to the median of their function.
    WithoutOutliers,
    /// End of the attempt with the lowest cost.
    Continued,
}

impl StartStrategy {
    /// Name in `result.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Truncated { .. } => "beginning of the record",
            Self::StartValues => "start values",
            Self::EquationError => "equation error",
            Self::GrowingHorizon => "growing part of the record",
            Self::FrequencyScan => "frequency scan",
            Self::WithoutOutliers => "best of these, without outliers",
            Self::Continued => "best of these, continued",
        }
    }
}

/// Solver of the quadratic programs of steps under constraints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum QpSolver {
    /// Clipping and eliminations where they give the step; along time an interior-point method on stages; Clarabel
    /// otherwise.
    #[default]
    Auto,
    /// Clarabel for every step of Gauss–Newton and of the projected gradient under constraints.
    Clarabel,
}

impl QpSolver {
    /// Name in a model file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Clarabel => "clarabel",
        }
    }
}

/// Settings of a fit.
#[derive(Debug, Clone)]
pub struct FitSettings {
    /// Solver.
    pub solver: Solver,
    /// Initial parameters.
    pub initial: Initial,
    /// Adjoint for gradients.
    pub gradient: GradientKind,
    /// Solver of the quadratic programs.
    pub qp: QpSolver,
    /// Stopping tests and limits.
    pub stopping: Stopping,
    /// Flag set by the application (Ctrl-C) to end the fit after the current iteration.
    pub interrupt: Option<Arc<AtomicBool>>,
}

impl FitSettings {
    /// True where further starting points are tried until a fit explains the record.
    pub(super) fn has_several_starts(&self) -> bool {
        self.solver == Solver::GaussNewton && self.initial != Initial::Near
    }
}

impl Default for FitSettings {
    /// Default settings of a model file: Gauss–Newton from the start values with exact gradients, a tolerance of 1e-10.
    fn default() -> Self {
        Self {
            solver: Solver::GaussNewton,
            initial: Initial::Functions,
            gradient: GradientKind::Discrete,
            qp: QpSolver::Auto,
            stopping: Stopping::default(),
            interrupt: None,
        }
    }
}
