//! `kmcfit check --gradient`: compares the gradient of a model with finite differences over step sizes and grids.

use super::progress::Activity;
use super::{CommandError, NOT_CONVERGED, OK, inputs, print, say, unwritable};
use crate::config::{BuildMode, Model, ModelFile, build};
use crate::report::{CsvTable, figures, render};
use crate::results::{Claim, OutputFolder};
use kmcfit_core::internals::objective::{GradientCheck, GradientKind};
use kmcfit_core::internals::simulate::SimulationError;
use std::path::Path;

fn no_response(breakdown: SimulationError) -> CommandError {
    CommandError::Numerical(format!("the start has no response: {breakdown}"))
}

/// The files in the output folder.
const FILES: [&str; 2] = ["gradient.csv", "figures/gradient.svg"];

/// Compares the gradients of the model of a file, built as `model`, with finite differences on grids of `nodes`; writes the errors to `out`.
///
/// # Errors
/// When the model cannot be built on a grid, the start has no response, or the results cannot be written.
pub(super) fn run(
    file: &ModelFile,
    model: &Model,
    nodes: &[usize],
    out: Option<&Path>,
) -> Result<u8, CommandError> {
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
    let folder = out
        .map(|out| {
            let claim = Claim::new("check").files(FILES).inputs(inputs(file));
            OutputFolder::prepare(out, claim)
        })
        .transpose()?;
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
    if let Some(folder) = folder {
        write(&folder, &curves).map_err(|error| unwritable(folder.path(), &error))?;
        print(&format!("results in {}\n", folder.path().display()));
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

fn write(folder: &OutputFolder, curves: &[GradientCheck]) -> std::io::Result<()> {
    let [table_name, figure_name] = FILES;
    let stage = folder.stage()?;
    stage.write(figure_name, render(&figures::gradient_error(curves)))?;
    let steps = curves.iter().flat_map(|curve| curve.step.iter().copied());
    let mut steps: Vec<f64> = steps.collect();
    steps.sort_by(|a, b| b.total_cmp(a));
    steps.dedup();
    let mut table = CsvTable::new().column("step", steps.clone());
    for curve in curves {
        // Steps that broke down are missing from a curve.
        let error_at = |step: &f64| {
            let i = curve.step.iter().position(|s| s == step);
            i.map_or(f64::NAN, |i| curve.error[i])
        };
        table = table.column(
            format!("error_{}_{}", curve.kind.name(), curve.nodes),
            steps.iter().map(error_at).collect(),
        );
    }
    stage.write(table_name, table.to_csv())?;
    stage.commit()
}
