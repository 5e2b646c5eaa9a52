//! Prediction of validation records, which take no part in the fit.

use super::executor::search_unobserved;
use super::settings::{FitSettings, Solver};
use super::state_estimation::estimate_states;
use crate::functions::{CoefficientFunction, Parameterization, ScalarParameter};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::Experiment;
use crate::step::SimulationError;

/// Predicts `experiment` with the functions of `evaluation`. Its initial state and sensor parameters, if unknown, are
/// estimated from its own samples (`scalars`). Returns the problem of that experiment alone and the evaluated point.
///
/// # Errors
/// A [`SimulationError`] if the simulation fails.
pub fn predict_validation(
    problem: &Problem,
    evaluation: &Evaluation,
    experiment: &Experiment,
    scalars: &[ScalarParameter],
    settings: &FitSettings,
) -> Result<(Problem, Evaluation), SimulationError> {
    let grid = &problem.system.grid;
    let known = |(f, values): (&usize, &[f64])| {
        CoefficientFunction::fixed(problem.functions.get(*f).quantity, values.to_vec())
    };
    let main = problem.functions.coefficient_set(0);
    let list = main.iter().zip(evaluation.nodal.functions()).map(known);
    let functions = Parameterization::new(list.collect(), grid.nodes(), grid.step())
        .expect("known functions have no basis that could be dependent")
        .with_scalars(scalars.to_vec());
    let mut alone = Experiment {
        coefficient_set: 0,
        ..experiment.clone()
    };
    alone.name.clone_from(&experiment.name);
    let alone = Problem::new(problem.system.clone(), functions, vec![alone])
        .expect("a record that fits the grid and its own scalars");
    let mut start = alone.start();
    let first = estimate_states(&alone).into_iter().next().flatten();
    if let Some(state) = first {
        let indices = alone.experiments[0].initial_parameters.iter();
        for (index, value) in indices.zip(state.components()) {
            if let Some(index) = index.filter(|i| scalars[*i].prior.is_none()) {
                start[index] = *value;
            }
        }
    }
    let settings = FitSettings {
        solver: Solver::GaussNewton,
        ..settings.clone()
    };
    let found = search_unobserved(&alone, &start, &settings)?;
    Ok((alone, found.best.evaluation))
}
