//! Fits of models: with their noise, the weights chosen by a rule, finer grids where the number of nodes is automatic.

use crate::config::{AutomaticGrid, Model, WeightSearch};
use kmcfit_core::finding::Finding;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{
    Fit, GridNotice, Observer, OnNodes, WeightPath, choose_weight_watched, fit_on_refined_grids,
    fit_with_noise_watched, no_response,
};
use kmcfit_core::step::SimulationError;

/// A fit, and the model as fitted.
pub struct ModelFit {
    /// The model with the grid, sigmas and penalty weights of the fit.
    pub model: Model,
    /// Fits with other weights, if a rule chose them.
    pub weights: Option<WeightPath>,
    /// The fit.
    pub fit: Fit,
}

/// Fits a model from its start.
///
/// # Errors
/// A [`SimulationError`] if no starting point can be simulated.
pub fn fit_model(model: &Model, watch: &mut Observer) -> Result<ModelFit, SimulationError> {
    let start = model.problem.functions.start();
    let mut run =
        |problem: &Problem, start: &[f64], watch: &mut Observer| run(model, problem, start, watch);
    let Some(grid) = &model.grid else {
        let (weights, problem, fit) = run(&model.problem, &start, watch)?;
        let model = Model {
            problem,
            ..model.clone()
        };
        return Ok(ModelFit {
            model,
            weights,
            fit,
        });
    };
    let mut on_nodes = |least| Some(model.on_nodes(least)?.problem);
    let found = fit_on_refined_grids(
        &model.problem,
        &start,
        AutomaticGrid::most(grid),
        &mut on_nodes as &mut OnNodes,
        &mut run,
        watch,
    )?;
    let nodes = found.problem.system.grid.nodes();
    let is_same = nodes == model.problem.system.grid.nodes();
    let refined = (!is_same).then(|| model.on_nodes(nodes)).flatten();
    let mut model = Model {
        problem: found.problem,
        ..refined.unwrap_or_else(|| model.clone())
    };
    for notice in found.notices {
        match notice {
            GridNotice::GridRefined { .. } => model.automatic.push(Finding::stated(&notice)),
            GridNotice::GridLimited { .. } => model.warnings.push(Finding::stated(&notice)),
        }
    }
    Ok(ModelFit {
        model,
        weights: found.further,
        fit: found.fit,
    })
}

/// As [`fit_model`]; a fit whose problem has no response from any start has the status infeasible or failed, where its method states one.
///
/// # Errors
/// A sentence if no starting point can be simulated, and the method states no outcome without a response.
pub fn fit_or_no_response(model: &Model, watch: &mut Observer) -> Result<ModelFit, String> {
    fit_model(model, watch).or_else(|breakdown| {
        let (problem, settings) = (&model.problem, &model.settings);
        let fit = no_response(problem, &model.given_start, settings, breakdown)
            .map_err(|breakdown| format!("the start cannot be evaluated: {breakdown}"))?;
        Ok(ModelFit {
            model: model.clone(),
            weights: None,
            fit,
        })
    })
}

/// Fits a problem of the model.
fn run(
    model: &Model,
    problem: &Problem,
    start: &[f64],
    watch: &mut Observer,
) -> Result<(Option<WeightPath>, Problem, Fit), SimulationError> {
    let settings = &model.settings;
    match &model.weight_rule {
        None => fit_with_noise_watched(problem, start, settings, watch)
            .map(|(problem, fit)| (None, problem, fit)),
        Some(WeightSearch { rule, penalties }) => {
            choose_weight_watched(problem, start, settings, *rule, penalties, watch)
                .map(|(path, problem, fit)| (Some(path), problem, fit))
        }
    }
}
