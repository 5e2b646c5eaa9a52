//! `kmcfit check --gradient`: compares the gradient of a model with finite differences over step sizes and grids.

use super::progress::Activity;
use super::{CommandError, NOT_CONVERGED, OK, print, say};
use crate::config::{BuildMode, Model, ModelFile, build};
use kmcfit_core::internals::objective::{GradientCheck, GradientKind};
use kmcfit_core::internals::simulate::SimulationError;

fn no_response(breakdown: SimulationError) -> CommandError {
    CommandError::Numerical(format!("the start has no response: {breakdown}"))
}

/// Compares the gradients of the model of a file, built as `model`, with finite differences on grids of `nodes`.
///
/// # Errors
/// When the model cannot be built on a grid, or the start has no response.
pub(super) fn run(file: &ModelFile, model: &Model, nodes: &[usize]) -> Result<u8, CommandError> {
    // Errors in the input come before any output.
    let refined = node_counts(nodes)
        .into_iter()
        .map(|nodes| build(file, BuildMode::Check { nodes }))
        .collect::<Result<Vec<_>, _>>()?;
    let problem = &model.problem;
    let steps = problem.check_steps(&problem.functions.start());
    let Some(steps) = steps.map_err(no_response)? else {
        print("the gradient is zero at the start values: choose others for the check\n");
        return Ok(OK);
    };
    let mut curves = Vec::new();
    print(&format!(
        "{:>8}  {:<10}  {:>12}  {:>9}\n",
        "nodes", "adjoint", "min error", "at step"
    ));
    for model in &refined {
        let nodes = model.problem.system.grid.nodes();
        let activity = Activity::begin(format!("checking the gradient on {nodes} nodes"));
        let checked = check(model, &steps)?;
        drop(activity);
        for curve in checked {
            let (step, error) = curve.best();
            print(&format!(
                "{:>8}  {:<10}  {error:>12.1e}  {step:>9.1e}\n",
                curve.nodes,
                curve.kind.name()
            ));
            curves.push(curve);
        }
    }
    Ok(report_result(&curves))
}

fn node_counts(nodes: &[usize]) -> Vec<Option<usize>> {
    match nodes.is_empty() {
        true => vec![None],
        false => {
            let mut nodes = nodes.to_vec();
            nodes.dedup();
            nodes.into_iter().map(Some).collect()
        }
    }
}

fn check(model: &Model, steps: &[f64]) -> Result<Vec<GradientCheck>, CommandError> {
    let problem = &model.problem;
    let mut kinds = vec![GradientKind::Discrete];
    if problem.supports_continuous() {
        kinds.push(GradientKind::Continuous);
    }
    let theta = problem.functions.start();
    let checks = kinds.into_iter();
    let checks = checks.map(|kind| problem.check_gradient(&theta, kind, steps));
    checks.collect::<Result<_, _>>().map_err(no_response)
}

fn report_result(curves: &[GradientCheck]) -> u8 {
    let failed: Vec<&GradientCheck> = (curves.iter())
        .filter(|c| c.kind == GradientKind::Discrete && !c.passes())
        .collect();
    if failed.is_empty() {
        print(&format!(
            "the discrete gradient is exact: smallest relative error below {:.0e}\n",
            GradientCheck::PASS
        ));
        return OK;
    }
    for curve in failed {
        let (nodes, error) = (curve.nodes, curve.best().1);
        let sentence =
            format!("the discrete gradient on {nodes} nodes has a min error of {error:.1e}");
        say("failed", sentence);
    }
    NOT_CONVERGED
}
