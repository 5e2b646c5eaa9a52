//! From what was written to what is meant: a [`ModelFile`] becomes a [`Model`].

mod constraints;
mod experiments;
mod fit;
mod functions;
mod grid;
mod on_grid;
mod penalties;
mod study;

pub use experiments::{ChannelNote, HoldOut};
pub use penalties::WeightSearch;
pub use study::{Candidate, Equivalent, StudyPlan, StudyTarget};

use super::scalar::ScalarOr;
use super::spec::InitialSpec;
use super::{ModelFile, Source};
use crate::error::{InputError, Place};
use crate::memory;
use kmcfit_core::internals::functions::Parameterization;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::solvers::{self, FitSettings, timed};
use kmcfit_core::internals::system::{NodalCoefficients, State, System};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Everything that a model file means.
#[derive(Debug, Clone)]
pub struct Model {
    /// The model file, as it was given.
    pub file: PathBuf,
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
    pub truth: Option<NodalCoefficients>,
    /// What reports say about the channels of each experiment.
    pub notes: Vec<Vec<ChannelNote>>,
    /// Experiments that are only predicted and scored.
    pub held_out: Vec<HoldOut>,
    /// Initial states to predict the motion from.
    pub predictions: Vec<State>,
    /// What `study` looks into.
    pub study: StudyPlan,
    /// Memory that a fit of it may need, bytes: an upper estimate.
    pub memory: u64,
    /// What the user should know although it is no error.
    pub warnings: Vec<String>,
    /// What was chosen for the user, and why.
    pub remarks: Vec<String>,
    /// What it was made from.
    pub source: Source,
    /// What it took to build it.
    pub preparation: Preparation,
}

/// What it took to build a model, in wall-clock time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Preparation {
    /// Reading its data.
    pub reading: Duration,
    /// All together.
    pub total: Duration,
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
    let clock = Instant::now();
    let mut reading = Duration::ZERO;
    let spec = &file.spec;
    experiments::distinct_names(file)?;
    let mut warnings = Vec::new();
    let mut remarks = Vec::new();
    let assemblies = functions::assemblies(file)?;
    let records = timed(&mut reading, || {
        experiments::read(file, purpose, &mut warnings)
    })?;
    let grid = grid::build(file, purpose, &records, &mut remarks)?;
    let list = functions::build(file, &grid, &mut warnings)?;
    let functions =
        Parameterization::with_devices(list, assemblies.devices.clone(), grid.nodes(), grid.step());
    let functions = functions.ok_or_else(|| {
        file.error_at(
            "functions",
            "a basis has functions that the grid cannot tell apart",
        )
    })?;
    let oscillator = System {
        grid,
        method: grid::method(file),
        terms: functions::terms(file)?,
    };
    let built = experiments::build(file, purpose, &grid, records, &assemblies)?;
    let functions = functions.with_scalars(built.scalars);
    let mut problem = Problem::new(oscillator, functions, built.fitted)
        .map_err(|why| file.error_at("functions", why.to_string()))?;
    let measured = fit::measurements(file, purpose, &problem, &mut warnings)?;
    let weight_rule = penalties::build(file, &mut problem, measured.as_ref(), &mut warnings)?;
    penalties::add_variations(file, &mut problem)?;
    let places = constraints::build(file, &mut problem, &assemblies, &mut warnings)?;
    experiments::unidentifiable(file, &problem)?;
    start_from_readings(file, &mut problem);
    let settings = fit::build(file, &problem, weight_rule.is_some())?;
    let given_start = problem.functions.start();
    // A simulation is of the functions as they are given.
    if !matches!(purpose, Purpose::Simulate { .. }) {
        constraints::move_start(file, &mut problem, &places, &mut warnings)?;
    }
    let truth = timed(&mut reading, || functions::truth(file, &grid))?;
    let state = |s: &super::spec::StateSpec| State {
        displacement: s.displacement.0,
        velocity: s.velocity.0,
    };
    let memory = grid::memory_of(file, purpose, grid.nodes()) as u64;
    let study = study::build(file, &problem)?;
    let source = timed(&mut reading, || Source::of(file));
    Ok(Model {
        file: file.path.clone(),
        study,
        memory,
        title: title(file),
        problem,
        given_start,
        settings,
        weight_rule,
        truth,
        notes: built.notes,
        held_out: built.held_out,
        predictions: spec.predict.iter().flatten().map(state).collect(),
        warnings,
        remarks,
        source,
        preparation: Preparation {
            reading,
            total: clock.elapsed(),
        },
    })
}

/// Memory that a study takes for each node beside that of a fit, bytes: bands, extremes, equivalent
/// systems, and the figures of all. Measured to be 5.9 to 7.1 kB with 2 to 41 free parameters.
const STUDY_PER_NODE: u64 = 8000;

impl Model {
    /// Refuses a study whose memory is not available.
    ///
    /// # Errors
    /// About the model file, with what may be needed and what is available.
    pub fn check_study_memory(&self) -> Result<(), InputError> {
        let nodes = self.problem.oscillator.grid.nodes() as u64;
        let needed = nodes.saturating_mul(STUDY_PER_NODE) + self.memory;
        memory::check(needed).map_err(|available| {
            InputError::file(
                &self.file,
                "a study on so many nodes does not fit into memory",
            )
            .key("grid.nodes")
            .found(format!(
                "{nodes} nodes, for which a study may need {}",
                memory::in_words(needed as f64)
            ))
            .expected(format!("at most {available}"))
            .hint("a study of fewer nodes: `--set grid.nodes=…`")
        })
    }

    /// The threads, of so many that are wanted, that have the memory to fit the model at the same time:
    /// at least one.
    pub fn threads_within_memory(&self, wanted: usize) -> usize {
        memory::threads_within(wanted, self.memory)
    }
}

/// Initial states that are sought without a start or a prior begin where the readings do.
fn start_from_readings(file: &ModelFile, problem: &mut Problem) {
    let sought = problem.experiments.iter().any(|e| e.sought != [None; 2]);
    if !sought {
        return;
    }
    let given = |i: usize, q: usize| match &file.spec.experiments[i].initial {
        InitialSpec::Scalar(_) => false,
        InitialSpec::Map(state) => {
            let value = [&state.displacement, &state.velocity][q];
            matches!(value, ScalarOr::Map(e) if e.start.is_some() || e.prior.is_some())
        }
    };
    let fitted = (file.spec.experiments.iter().enumerate())
        .filter(|(_, spec)| !experiments::is_held_out(spec))
        .map(|(i, _)| i);
    let mut start = problem.start();
    let first = problem.functions.scalar_range().start;
    let states = solvers::states_from_readings(problem);
    for ((i, experiment), state) in fitted.zip(&problem.experiments).zip(states) {
        let Some(state) = state else { continue };
        for (q, value) in [state.displacement, state.velocity].into_iter().enumerate() {
            if let (Some(index), false) = (experiment.sought[q], given(i, q)) {
                start[first + index] = value;
            }
        }
    }
    problem.start_from(&start);
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
