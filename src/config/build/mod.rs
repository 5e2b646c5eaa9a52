//! From what was written to what is meant: a [`ModelFile`] becomes a [`Model`].

mod constraints;
mod experiments;
mod fit;
mod functions;
mod grid;
mod on_grid;
mod penalties;

pub use penalties::WeightSearch;

use super::ModelFile;
use crate::dynamics::{Device, Oscillator, State};
use crate::error::{InputError, Place};
use crate::functions::Functions;
use crate::problem::Problem;
use crate::solvers::FitSettings;

/// Everything that a model file means.
#[derive(Debug, Clone)]
pub struct Model {
    /// Title for reports.
    pub title: String,
    /// What is fitted.
    pub problem: Problem,
    /// The start as it is given, before it was moved into the constraints.
    pub given_start: Vec<f64>,
    /// How it is fitted.
    pub settings: FitSettings,
    /// The rule that chooses the weight of some penalties, whose weight in `problem` is 1.
    pub weight_rule: Option<WeightSearch>,
    /// The true device on the grid, where it is known.
    pub truth: Option<Device>,
    /// Initial states to predict the motion from.
    pub predictions: Vec<State>,
    /// What the user should know although it is no error.
    pub warnings: Vec<String>,
}

/// What a model is built for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// To be fitted: readings are needed, at nodes.
    Fit,
    /// To be simulated: readings are not looked at.
    Simulate {
        /// Number of nodes instead of the model's.
        nodes: Option<usize>,
    },
    /// To have its gradient checked: readings are needed, and interpolated where a node has none.
    Check {
        /// Number of nodes instead of the model's.
        nodes: Option<usize>,
    },
}

impl Purpose {
    fn nodes(self) -> Option<usize> {
        match self {
            Purpose::Fit => None,
            Purpose::Simulate { nodes } | Purpose::Check { nodes } => nodes,
        }
    }
}

/// An error about a file as a whole, said at the key of the model that names the file; errors about
/// its rows stay where they are.
fn asked_for(file: &ModelFile, key: impl Into<String>) -> impl Fn(InputError) -> InputError {
    let key = key.into();
    move |error| match &error.place {
        Place::File(path) => {
            let problem = format!("{}: {}", path.display(), error.problem);
            let here = file.error_at(&key, problem);
            InputError {
                place: here.place,
                key: here.key,
                problem: here.problem,
                ..error
            }
        }
        _ => error,
    }
}

/// Builds the model of a file for a purpose.
///
/// # Errors
/// At the first thing that cannot be meant, with its line.
pub fn build(file: &ModelFile, purpose: Purpose) -> Result<Model, InputError> {
    let spec = &file.spec;
    experiments::distinct_names(file)?;
    let records = experiments::read(file, purpose)?;
    let grid = grid::build(file, purpose, &records)?;
    let mut warnings = Vec::new();
    let list = functions::build(file, &grid, &mut warnings)?;
    let assemblies = functions::assemblies(file)?;
    let functions =
        Functions::with_devices(list, assemblies.devices.clone(), grid.nodes(), grid.step());
    let functions = functions.ok_or_else(|| {
        file.error_at(
            "functions",
            "a basis has functions that the grid cannot tell apart",
        )
    })?;
    let oscillator = Oscillator {
        grid,
        method: grid::method(file),
        terms: functions::terms(file)?,
    };
    let experiments = experiments::build(file, purpose, &grid, records)?;
    let mut problem = Problem::new(oscillator, functions, experiments);
    let measured = fit::measurements(file, purpose, &problem, &mut warnings)?;
    let weight_rule = penalties::build(file, &mut problem, measured.as_ref(), &mut warnings)?;
    penalties::add_variations(file, &mut problem);
    let places = constraints::build(file, &mut problem, &mut warnings)?;
    problem.soft = problem.constraints.take_soft();
    let settings = fit::build(file, &problem, weight_rule.is_some())?;
    let given_start = problem.functions.start();
    // A simulation is of the functions as they are given.
    if !matches!(purpose, Purpose::Simulate { .. }) {
        constraints::move_start(file, &mut problem, &places, &mut warnings)?;
    }
    let truth = functions::truth(file, &grid)?;
    let state = |s: &super::spec::StateSpec| State {
        displacement: s.displacement.0,
        velocity: s.velocity.0,
    };
    Ok(Model {
        title: title(file),
        problem,
        given_start,
        settings,
        weight_rule,
        truth,
        predictions: spec.predict.iter().flatten().map(state).collect(),
        warnings,
    })
}

/// Names in a row: `a`, `a and b`, `a, b and c`.
fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        Some((last, _)) => (*last).to_owned(),
        None => String::new(),
    }
}

fn title(file: &ModelFile) -> String {
    match &file.spec.title {
        Some(title) => title.0.clone(),
        None => file.path.file_stem().map_or_else(
            || "untitled".into(),
            |stem| stem.to_string_lossy().into_owned(),
        ),
    }
}
