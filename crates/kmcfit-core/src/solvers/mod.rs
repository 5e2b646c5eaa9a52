//! Solvers: each is a direction and a step rule (`Descend`); the loop, the stopping test and the
//! record of what happened are shared.

mod activity;
mod ahead;
mod all_at_once;
mod beginning;
mod conflict;
mod covariance;
mod equation_error;
mod executor;
mod gauss_newton;
mod hold_out;
mod infeasible;
mod keep;
mod kinematics;
mod ladder;
mod lbfgs;
mod line_search;
mod noise;
mod optimality;
mod outcome;
mod point;
mod projected_gradient;
mod recorder;
mod start;
mod steepest_descent;
mod stopping;
mod timings;
mod weight_path;

pub use activity::{ActiveGroup, active_constraints};
pub use equation_error::{Measurements, Unsuited, equation_error};
pub use executor::{Fit, fit_from};
pub use gauss_newton::FEW_PARAMETERS;
pub(crate) use gauss_newton::{add_priors, linear_readings, weighted_jacobian};
pub use hold_out::predict_held_out;
pub use infeasible::without_motion;
pub use keep::{Bits, Keeper, Kept, Memory, Moment, Standing, Watch};
pub use kinematics::states_from_readings;
pub use ladder::CONTINUED;
pub use ladder::{Initial, Rung, fit, fit_watched};
pub use noise::{fit_with_noise, fit_with_noise_watched};
pub use optimality::Optimality;
pub use outcome::{Outcome, Status};
pub use point::{Counts, Point};
pub use recorder::{Row, SNAPSHOT_ITERATIONS, Snapshot};
pub use start::Start;
pub use stopping::Stopping;
pub use timings::Timings;
pub use timings::timed;
pub use weight_path::{PathPoint, WeightPath, WeightRule, choose_weight, choose_weight_watched};

use crate::dynamics::Breakdown;
use crate::objective::Evaluation;
use crate::objective::GradientKind;
use crate::problem::Problem;
use point::Work;
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
    /// The minimum of the equation error ([`Measurements`]), a convex problem that is solved once: the
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

impl Problem {
    /// Fits from the problem's start with the usual settings.
    ///
    /// # Errors
    /// A [`Breakdown`] if the start itself has no motion.
    pub fn fit(&self) -> Result<Fit, Breakdown> {
        self.fit_with(&FitSettings::default())
    }

    /// Fits from the problem's start.
    ///
    /// # Errors
    /// As [`Problem::fit`].
    pub fn fit_with(&self, settings: &FitSettings) -> Result<Fit, Breakdown> {
        fit(self, &self.start(), settings, &mut |_| {})
    }
}

/// Where one iteration led.
#[allow(
    clippy::large_enum_variant,
    reason = "there is one at a time, and nearly all have a point"
)]
pub(crate) enum Step {
    /// To a point with lower cost; `length` is the step along the direction. A `hindered` step is
    /// short because longer ones could not be computed: that it is short says nothing of a minimum.
    Moved {
        point: Box<Point>,
        length: f64,
        hindered: bool,
    },
    /// Nowhere: no step lowers the cost, for this reason.
    Stuck(String),
    /// Nowhere: the point breaks the constraints, and no step leads into them, for this reason.
    Infeasible(String),
    /// Nowhere: the model predicts no decrease worth the name; the point is a minimum.
    Minimum(String),
}

/// A direction and a step rule.
pub(crate) trait Descend {
    /// One iteration from `point`.
    fn step(&mut self, work: &mut Work, point: &Point) -> Step;

    /// Storage for the next step, from a point that has been left.
    fn recycle(&mut self, evaluation: Evaluation) {
        let _ = evaluation;
    }

    /// What decides its next steps beside the point.
    fn memory(&self) -> Memory {
        Memory::Nothing
    }

    /// Takes up a memory at `point`; whether it is one of this method and this problem.
    fn recall(&mut self, memory: Memory, problem: &Problem, point: &Point) -> bool {
        let _ = (problem, point);
        memory == Memory::Nothing
    }
}
