//! Fits: methods, each a search direction and a step rule, their common loop, starting points, and analyses based on fits.
//!
//! Order of imports: settings, termination, history and observer; linearisation; iterate and counted evaluations;
//! methods; executor (the loop); starts; start strategy; noise estimation, weight path and validation; grid refinement.

mod active_set;
mod correlation_estimation;
mod evaluator;
mod executor;
mod fit;
mod further_starts;
mod grid_refinement;
mod history;
mod infeasible_subset;
mod input_errors;
mod iterate;
mod jumps;
mod linearization;
mod methods;
mod no_response;
mod noise_estimation;
mod observer;
mod optimality;
mod path;
mod reason;
mod reml;
mod reml_by_traces;
mod rounds;
mod settings;
mod solve_counts;
mod start_projection;
mod start_strategy;
mod starts;
mod state_estimation;
mod termination;
mod timings;
mod traces;
mod validation;
mod weight_choice;
mod weight_path;
mod weight_rules;

pub(crate) use crate::record::Measurements;
pub use active_set::{ActiveGroup, active_constraints};
pub use executor::fit_from;
pub use fit::{Attempt, Fit};
pub use grid_refinement::{GridNotice, OnNodes, fit_on_refined_grids};
pub use history::IterationRecord;
pub(crate) use input_errors::input_error_effect;
pub(crate) use iterate::Iterate;
pub(crate) use linearization::{
    add_penalties, add_priors, add_soft, linear_predictions, weighted_jacobian,
};
pub(crate) use methods::equation_error::NoEquationRows;
pub use methods::equation_error::{
    EquationBalance, EquationForm, EquationShare, MissingTerm, equation_balance, equation_error,
    equation_rows, missing_terms,
};
pub use no_response::no_response;
pub use noise_estimation::{fit_with_noise, fit_with_noise_watched};
pub use observer::{IterationEvent, Observer};
pub use optimality::Optimality;
pub use path::{PathPoint, WeightPath};
pub use settings::{FitSettings, Initial, QpSolver, Solver, StartStrategy};
pub use start_projection::StartProjection;
pub use start_strategy::fit;
pub(crate) use state_estimation::estimate_states;
pub use termination::{Status, Stopping};
pub use timings::timed;
pub use validation::predict_validation;
pub use weight_choice::{choose_weight, choose_weight_watched};

use crate::problem::Problem;
use crate::step::SimulationError;

impl Problem {
    /// Fits from the problem's start with default settings.
    ///
    /// # Errors
    /// A [`SimulationError`] if the simulation at the start fails.
    pub fn fit(&self) -> Result<Fit, SimulationError> {
        self.fit_with(&FitSettings::default())
    }

    /// Fits from the problem's start.
    ///
    /// # Errors
    /// As [`Problem::fit`].
    pub fn fit_with(&self, settings: &FitSettings) -> Result<Fit, SimulationError> {
        fit(self, &self.start(), settings, &mut |_| {})
    }
}
