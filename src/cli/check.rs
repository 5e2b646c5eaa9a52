//! `kmcfit check`: validates a model and its data, and compares its gradient with finite differences over step sizes and grids.

use super::check_file;
use super::{CommandError, NOT_CONVERGED, OK, Overrides, announce, inputs, print, say, unwritable};
use crate::config::{BuildMode, Model, build};
use crate::formats::has_data_extension;
use crate::report::{CsvTable, figures, render};
use crate::results::{Claim, OutputFolder};
use kmcfit_core::internals::objective::{GradientCheck, GradientKind};
use kmcfit_core::internals::simulate::SimulationError;
use std::path::PathBuf;

/// Validate a model and its data, then compare its gradient with finite differences; list the columns of a data file.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  kmcfit check model.yaml --nodes 500,1000,2000\n  kmcfit check record.mat                       list its variables"
)]
pub struct Arguments {
    /// Model file (YAML), or a data file.
    model: PathBuf,
    /// Numbers of nodes for the check [default: that of the model].
    #[arg(long, value_delimiter = ',', value_name = "N,N,...")]
    nodes: Vec<usize>,
    #[command(flatten)]
    set: Overrides,
    /// Validate only.
    #[arg(long)]
    no_gradient: bool,
    /// Folder for the table and the figure of the errors.
    #[arg(long)]
    out: Option<PathBuf>,
}

fn no_response(breakdown: SimulationError) -> CommandError {
    CommandError::Numerical(format!("the start has no response: {breakdown}"))
}

/// The files in the output folder.
const FILES: [&str; 2] = ["gradient.csv", "figures/gradient.svg"];

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    if has_data_extension(&arguments.model) {
        return Ok(check_file::run(&arguments.model)?);
    }
    let file = arguments.set.read(&arguments.model)?;
    let model = build(&file, BuildMode::Fit)?;
    announce(&model);
    if arguments.no_gradient || model.problem.functions.parameters() == 0 {
        print(&describe(&model));
        print("the model and its data are valid\n");
        return Ok(OK);
    }
    // Errors in the input come before any output.
    let refined = node_counts(arguments)
        .into_iter()
        .map(|nodes| build(&file, BuildMode::Check { nodes }))
        .collect::<Result<Vec<_>, _>>()?;
    let problem = &model.problem;
    let steps = problem.check_steps(&problem.functions.start());
    let Some(steps) = steps.map_err(no_response)? else {
        print(&describe(&model));
        print("the gradient is zero at the start values: choose others for the check\n");
        return Ok(OK);
    };
    let folder = (arguments.out.as_deref())
        .map(|out| {
            let claim = Claim::new("check").files(FILES).inputs(inputs(&file));
            OutputFolder::prepare(out, claim)
        })
        .transpose()?;
    let mut curves = Vec::new();
    print(&describe(&model));
    print(&format!(
        "{:>8}  {:<10}  {:>12}  {:>9}\n",
        "nodes", "adjoint", "min error", "at step"
    ));
    for model in &refined {
        for curve in check(model, &steps)? {
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

fn node_counts(arguments: &Arguments) -> Vec<Option<usize>> {
    match arguments.nodes.is_empty() {
        true => vec![None],
        false => {
            let mut nodes = arguments.nodes.clone();
            nodes.dedup();
            nodes.into_iter().map(Some).collect()
        }
    }
}

fn describe(model: &Model) -> String {
    let grid = &model.problem.system.grid;
    let mut text = String::new();
    for (experiment, notes) in model.problem.experiments.iter().zip(&model.notes) {
        for (channel, note) in experiment.channels.iter().zip(notes) {
            let (name, kind, unit) = (&experiment.name, note.kind.name(), note.unit.symbol());
            text += &format!(
                "{name}: {} samples of the {kind} in {unit} ({})\n",
                channel.len(),
                note.format
            );
            for (count, reason) in &note.ignored {
                text += &format!("{name}: {count} samples of the {kind} not used: {reason}\n");
            }
        }
    }
    for fact in &model.data {
        text += &format!("{fact}\n");
    }
    text + &format!(
        "{}: {} nodes over {} s ({}), {} parameters, {}\n",
        model.title,
        grid.nodes(),
        grid.duration(),
        model.problem.system.method.name(),
        model.problem.functions.parameters(),
        model.settings.solver.name(),
    )
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
    let mut stage = folder.stage()?;
    stage.write(figure_name, &render(&figures::gradient_error(curves)))?;
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
    stage.write(table_name, &table.to_csv())?;
    stage.commit()
}
