//! `kmcfit check`

use super::{Failure, NOT_CONVERGED, OK, Overrides, announce, inputs, print, say, unwritable};
use crate::config::{Model, Purpose, build};
use crate::report::figures::{self, GradientCurve};
use crate::report::{CsvTable, render};
use crate::results::{Claim, OutputFolder};
use kmcfit_core::internals::objective::GradientKind;
use kmcfit_core::internals::simulate::SimulationError;
use std::path::PathBuf;

/// Read and validate a model, then test its gradient against differences.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Model file (YAML).
    model: PathBuf,
    /// Numbers of nodes to check at, separated by commas [default: the model's].
    #[arg(long, value_delimiter = ',', value_name = "N,N,...")]
    nodes: Vec<usize>,
    #[command(flatten)]
    set: Overrides,
    /// Only read and validate.
    #[arg(long)]
    no_gradient: bool,
    /// Folder for the errors as a table and a figure.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Step sizes of the check: two per decade over ten decades, and over more where the error still falls at the last
/// ([`extended`]), the largest being the power of ten nearest to `10 J/G^2`. A step `a` lowers J by `a G^2` to first order, so the same part of J is
/// lowered whatever the unit of J; for the paper's run the steps are 1 to 1e-10.
fn steps(model: &Model) -> Result<Option<Vec<f64>>, Failure> {
    let problem = &model.problem;
    let start = problem.functions.start();
    let here = problem.evaluate(&start).map_err(no_motion)?;
    let gradient = problem.gradient(&start, &here, GradientKind::Discrete);
    let norm_squared = gradient.norm_squared;
    let decade = (10.0 * here.cost / norm_squared).log10().round();
    let decade = if decade.is_finite() { decade } else { 0.0 };
    let step = |i| 10f64.powf(decade - 0.5 * f64::from(i));
    Ok((norm_squared > 0.0).then(|| (0..=20).map(step).collect()))
}

/// Most step sizes: where the error still falls after 40 decades, nothing can be said of the gradient.
const MOST_STEPS: usize = 81;

/// The step sizes and five decades of smaller ones.
fn extended(steps: &[f64]) -> Vec<f64> {
    let last = steps.last().map_or(0.0, |step| step.log10());
    let smaller = (1..=10).map(|i| 10f64.powf(last - 0.5 * f64::from(i)));
    steps.iter().copied().chain(smaller).collect()
}

fn no_motion(breakdown: SimulationError) -> Failure {
    Failure::Numerical(format!("the start has no motion: {breakdown}"))
}

/// A curve that ends by falling in proportion to the step, by sqrt(10) from one to the next, has not
/// met a floor yet; this is a little less.
const FALLS: f64 = 2.5;

/// The discrete gradient passes if its error falls below this at some step. An error in the gradient is a floor; an
/// exact gradient is only limited by truncation and rounding, which leave 1e-7 or less at N = 128,000.
const PASS: f64 = 1e-6;

/// The errors of one gradient on one grid.
struct Curve {
    nodes: usize,
    kind: GradientKind,
    step: Vec<f64>,
    error: Vec<f64>,
}

impl Curve {
    /// Whether the error is as small as that of an exact gradient.
    fn passes(&self) -> bool {
        self.best().1 <= PASS
    }

    /// Whether the error still falls with the step at the smallest one, so that smaller steps show more of it.
    fn falls(&self) -> bool {
        let tail = &self.error[self.error.len().saturating_sub(4)..];
        tail.len() == 4 && tail.windows(2).all(|w| w[0] > FALLS * w[1])
    }

    fn best(&self) -> (f64, f64) {
        let pairs = self.step.iter().copied().zip(self.error.iter().copied());
        pairs.fold((f64::NAN, f64::INFINITY), |best, pair| {
            if pair.1 < best.1 { pair } else { best }
        })
    }
}

/// The files in the output folder.
const FILES: [&str; 2] = ["gradient.csv", "figures/gradient.svg"];

pub fn run(arguments: &Arguments) -> Result<u8, Failure> {
    let file = arguments.set.read(&arguments.model)?;
    let model = build(&file, Purpose::Fit)?;
    announce(&model);
    if arguments.no_gradient || model.problem.functions.parameters() == 0 {
        print(&describe(&model));
        return Ok(OK);
    }
    // Whatever is wrong with the input is said before anything is printed or made.
    let refined = node_counts(arguments)
        .into_iter()
        .map(|nodes| build(&file, Purpose::Check { nodes }))
        .collect::<Result<Vec<_>, _>>()?;
    let Some(steps) = steps(&model)? else {
        print(&describe(&model));
        print("the gradient vanishes at the start: check it from another one\n");
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
        "nodes", "adjoint", "least error", "at step"
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
    Ok(verdict(&curves))
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
    let grid = &model.problem.oscillator.grid;
    let mut text = String::new();
    for (experiment, notes) in model.problem.experiments.iter().zip(&model.notes) {
        for (channel, note) in experiment.channels.iter().zip(notes) {
            let (name, kind, unit) = (&experiment.name, note.kind.name(), note.unit.symbol());
            text += &format!(
                "{name}: {} readings of the {kind} in {unit} ({})\n",
                channel.len(),
                note.format
            );
            for (count, reason) in &note.ignored {
                text += &format!("{name}: {count} readings of the {kind} not used: {reason}\n");
            }
        }
    }
    text + &format!(
        "{}: {} nodes over {} s ({}), {} parameters, {}\n",
        model.title,
        grid.nodes(),
        grid.duration(),
        model.problem.oscillator.method.name(),
        model.problem.functions.parameters(),
        model.settings.solver.name(),
    )
}

fn check(model: &Model, steps: &[f64]) -> Result<Vec<Curve>, Failure> {
    let problem = &model.problem;
    let mut kinds = vec![GradientKind::Discrete];
    if problem.supports_continuous() {
        kinds.push(GradientKind::Continuous);
    }
    let theta = problem.functions.start();
    kinds
        .into_iter()
        .map(|kind| {
            let curve = |steps: &[f64]| {
                let errors = problem
                    .gradient_error(&theta, kind, steps)
                    .map_err(no_motion)?;
                Ok::<_, Failure>(Curve {
                    nodes: problem.oscillator.grid.nodes(),
                    kind,
                    step: errors.iter().map(|e| e.step).collect(),
                    error: errors.iter().map(|e| e.error).collect(),
                })
            };
            let mut steps = steps.to_vec();
            let mut found = curve(&steps)?;
            while !found.passes() && found.falls() && steps.len() < MOST_STEPS {
                steps = extended(&steps);
                found = curve(&steps)?;
            }
            Ok(found)
        })
        .collect()
}

fn verdict(curves: &[Curve]) -> u8 {
    let failed: Vec<&Curve> = (curves.iter())
        .filter(|c| c.kind == GradientKind::Discrete && !c.passes())
        .collect();
    if failed.is_empty() {
        print(&format!(
            "the discrete gradient is exact: least error below {PASS:.0e}\n"
        ));
        return OK;
    }
    for curve in failed {
        let (nodes, error) = (curve.nodes, curve.best().1);
        let sentence =
            format!("the discrete gradient on {nodes} nodes has an error of {error:.1e} at best");
        say("failed", sentence);
    }
    NOT_CONVERGED
}

fn write(folder: &OutputFolder, curves: &[Curve]) -> std::io::Result<()> {
    let drawn: Vec<GradientCurve> = (curves.iter())
        .map(|c| GradientCurve {
            nodes: c.nodes,
            adjoint: c.kind.name(),
            step: &c.step,
            error: &c.error,
        })
        .collect();
    let [table_name, figure_name] = FILES;
    let mut stage = folder.stage()?;
    stage.write(figure_name, &render(&figures::gradient_error(&drawn)))?;
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
