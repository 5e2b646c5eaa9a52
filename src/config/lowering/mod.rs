//! Builds a [`Model`], the problem and its settings, from a [`ModelFile`] and its data files.

mod constraints;
mod experiments;
mod fit;
mod functions;
mod grid;
mod model_key;
mod on_grid;
mod refinement;
mod starts;
mod study;

pub(in crate::config) use experiments::known_stretches;
pub(super) use experiments::sensor_of;
pub use experiments::{ChannelNote, DelayLimits, HoldOut};
pub use kmcfit_core::builder::WeightSearch;
use model_key::ModelKey;
pub use refinement::AutomaticGrid;
pub use study::StudyPlan;

use super::{ModelFile, ModelSource};
use crate::error::{InputError, Location};
use kmcfit_core::assessment::Doubt;
use kmcfit_core::builder::{BuildError, Builder, Contradiction, listed};
use kmcfit_core::finding::Finding;
use kmcfit_core::finding::Severity;
use kmcfit_core::host::Instant;
use kmcfit_core::problem::Problem;
use kmcfit_core::solvers::{FitSettings, Solver, timed};
use kmcfit_core::system::{Grid, NodalCoefficients, State};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// Problem, settings and further contents of a model file.
#[derive(Debug, Clone)]
pub struct Model {
    /// Path of the model file.
    pub file: PathBuf,
    /// Title for reports.
    pub title: String,
    /// The problem.
    pub problem: Problem,
    /// Start values before the projection onto the constraints.
    pub given_start: Vec<f64>,
    /// Settings of the fit.
    pub settings: FitSettings,
    /// Rule that chooses the weight of some penalties; their weight in `problem` is 1.
    pub weight_rule: Option<WeightSearch>,
    /// True if the bases are tested against finer ones at the optimum.
    pub tests_bases: bool,
    /// True coefficients at the nodes, if they are known.
    pub truth: Option<NodalCoefficients>,
    /// Notes for reports on the channels of each experiment.
    pub notes: Vec<Vec<ChannelNote>>,
    /// Index in the file of each experiment of the problem, which has no validation records.
    pub positions: Vec<usize>,
    /// Validation records.
    pub validation: Vec<HoldOut>,
    /// Initial states of the predictions.
    pub predictions: Vec<State>,
    /// Settings of a study.
    pub study: StudyPlan,
    /// Warnings about data and specification.
    pub warnings: Vec<Finding>,
    /// What was found in the data and done with it.
    pub data: Vec<Finding>,
    /// Limits of the estimated delays.
    pub delay_limits: Vec<DelayLimits>,
    /// Automatic choices, such as the number of nodes.
    pub automatic: Vec<Finding>,
    /// Units that neither the model nor a file states.
    pub assumed_units: Vec<String>,
    /// True if the model states that the mass is unknown: it is 1, and the other coefficients are ratios to it.
    pub has_unknown_mass: bool,
    /// The automatic grid of a fit, which may be refined; `None` for a stated number of nodes.
    pub grid: Option<AutomaticGrid>,
    /// Source files.
    pub source: ModelSource,
    /// Time taken to build it.
    pub preparation: Preparation,
}

impl Model {
    /// True where an unmeasured force keeps up the motion of all records, by a warning about each.
    pub fn is_kept_up(&self) -> bool {
        let mut experiments = self.problem.experiments.iter();
        experiments.all(|experiment| {
            let is_of = |doubt: &Doubt| {
                matches!(doubt, Doubt::KeptUp { experiment: of, .. } if *of == experiment.name)
            };
            self.doubts().any(is_of)
        })
    }

    /// What stands beside its results: an unknown mass, and units that are not stated.
    pub fn assumptions(&self) -> impl Iterator<Item = Doubt> + use<> {
        let units = self.assumed_units.clone();
        let mass = self.has_unknown_mass.then_some(Doubt::MassUnknown);
        let units = (!units.is_empty()).then_some(Doubt::UnitsAssumed { units });
        mass.into_iter().chain(units)
    }

    /// The doubts about its data.
    pub fn doubts(&self) -> impl Iterator<Item = &Doubt> {
        let all = self.warnings.iter().chain(&self.data);
        all.filter_map(|finding| finding.doubt.as_ref())
    }
}

/// Wall-clock time taken to build a model.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Preparation {
    /// Time to read the data.
    pub reading: Duration,
    /// Total time.
    pub total: Duration,
}

/// Mode in which a model is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BuildMode {
    /// Fit: samples are required, at nodes.
    Fit,
    /// Simulation: data files are not read.
    Simulate {
        /// Number of nodes instead of the model's.
        nodes: Option<usize>,
    },
}

impl BuildMode {
    fn nodes(self) -> Option<usize> {
        match self {
            BuildMode::Fit => None,
            BuildMode::Simulate { nodes } => nodes,
        }
    }
}

/// The builder of the core for a model file and its data, and the notes on its channels.
fn builder(
    file: &ModelFile,
    mode: BuildMode,
    grid: &Grid,
    solver: Solver,
    records: Vec<Option<experiments::RawRecord>>,
) -> Result<(Builder, Vec<Vec<ChannelNote>>), InputError> {
    let is_limited =
        mode == BuildMode::Fit && matches!(solver, Solver::GaussNewton | Solver::ProjectedGradient);
    let starts = starts::of_records(file, grid, &records);
    let defaults = functions::Defaults {
        is_limited,
        starts: starts.as_ref(),
    };
    let shared = functions::shared(file).into_iter();
    let shared = shared.map(|given| {
        let at = ModelKey::new(file, format!("functions.{}", given.0.name()));
        let spec = functions::specification(&at, grid, given, defaults)?;
        Ok((given.0, spec))
    });
    let shared = shared.collect::<Result<_, _>>()?;
    let builder = match &file.spec.structure {
        None => Builder::of(shared),
        Some(given) => {
            let structure = functions::structure(file, given, grid, defaults)?;
            let built = Builder::structure(&structure);
            built.map_err(|error| input_error(file, error))?
        }
    };
    let mut builder = builder.grid(*grid).solver(solver);
    builder = builder.method(grid::method(file));
    if matches!(mode, BuildMode::Simulate { .. }) {
        builder = builder.simulation();
    }
    let mut notes = Vec::new();
    for (entry, record) in experiments::Entry::all(file).zip(records) {
        let (record, of_record) = experiments::specification(&entry, grid, record, defaults)?;
        builder = builder.record(record);
        notes.push(of_record);
    }
    if let Some(list) = constraints::all(file, grid)? {
        let built = builder.constraints(&list, grid);
        builder = built.map_err(|error| input_error(file, error))?;
    }
    Ok((builder, notes))
}

/// An error of the builder at the place of its key in the file.
fn input_error(file: &ModelFile, error: BuildError) -> InputError {
    let placed = match &error.contradiction {
        Some(contradiction) => contradicted(file, contradiction, &error.problem),
        None => InputError {
            found: error.found,
            ..file.error_at(&error.key, error.problem)
        },
    };
    InputError {
        expected: error.expected,
        hint: error.hint,
        ..placed
    }
}

/// Constraints that contradict each other, with their lines: placed at the last of them.
fn contradicted(file: &ModelFile, contradiction: &Contradiction, problem: &str) -> InputError {
    let mut last: Option<(usize, &str)> = None;
    let mut rows = Vec::new();
    for (name, key) in &contradiction.constraints {
        let location = key
            .as_ref()
            .map(|key| (key, file.error_at(key, "").location));
        let Some((key, Location::Line { line, .. })) = location else {
            rows.push(format!("`{name}`"));
            continue;
        };
        rows.push(format!("`{name}` (line {line})"));
        if last.is_none_or(|(before, _)| line >= before) {
            last = Some((line, key));
        }
    }
    let key = last.map_or("constraints", |(_, key)| key);
    file.error_at(key, problem)
        .found(listed(rows.iter().map(String::as_str)))
}

/// The records of a model with what was noted about them.
#[derive(Debug)]
struct ReadRecords {
    records: Vec<Option<experiments::RawRecord>>,
    warnings: Vec<Finding>,
    data: Vec<Finding>,
}

impl ReadRecords {
    fn of(file: &ModelFile, mode: BuildMode) -> Result<Self, InputError> {
        let mut notes = experiments::RecordNotes::default();
        let records = experiments::read(file, mode, &mut notes)?;
        let experiments::RecordNotes { warnings, data, .. } = notes;
        Ok(Self {
            records,
            warnings,
            data,
        })
    }
}

/// What is known of a model from another grid.
struct Known {
    read: Arc<ReadRecords>,
    /// States at the first node of the fitted records, from which those are searched that are estimated.
    states: Vec<State>,
    source: ModelSource,
}

/// Error for a model without a system or with two, and for keys that a structure does not have.
fn check_system(file: &ModelFile) -> Result<(), InputError> {
    let spec = &file.spec;
    let of_one = [
        ("functions", spec.functions.is_some()),
        ("constraints", spec.constraints.is_some()),
        ("truth", spec.truth.is_some()),
        ("predict", spec.predict.is_some()),
        ("study", spec.study.is_some()),
    ];
    let given = of_one.iter().find(|(_, is_given)| *is_given);
    match (&spec.structure, &spec.functions, given) {
        (None, None, _) => Err(file
            .error_at("", "the model has no system")
            .expected("`functions` of one coordinate, or `structure`")),
        (Some(_), _, Some((key, _))) => Err(file
            .error_at(key, format!("`{key}` concerns a system of one coordinate"))
            .found(format!("`structure` and `{key}`"))
            .expected("one of the two")),
        _ => Ok(()),
    }
}

/// Builds the model of a file in a mode.
///
/// # Errors
/// At the first invalid key, with its line.
pub fn build(file: &ModelFile, mode: BuildMode) -> Result<Model, InputError> {
    let model = build_on(file, mode, 0, None)?;
    model.on_stable_grid(file, mode)
}

/// [`build()`] with at least `least` nodes of an automatic grid; what is known from another grid is not read and estimated again.
fn build_on(
    file: &ModelFile,
    mode: BuildMode,
    least: usize,
    known: Option<Known>,
) -> Result<Model, InputError> {
    let clock = Instant::now();
    check_system(file)?;
    let mut reading = Duration::ZERO;
    let spec = &file.spec;
    let mut automatic = Vec::new();
    let (read, states, source) = match known {
        Some(known) => (known.read, known.states, Some(known.source)),
        None => {
            let read = timed(&mut reading, || ReadRecords::of(file, mode))?;
            (Arc::new(read), Vec::new(), None)
        }
    };
    let (mut warnings, data) = (read.warnings.clone(), read.data.clone());
    let records = &read.records;
    let delay_limits = experiments::delay_limits(file, records)?;
    let choice = grid::build(file, mode, records, least, &mut automatic)?;
    let grid = choice.grid;
    let solver = fit::solver(file)?;
    let automatic_grid = AutomaticGrid::of(file, mode, solver, choice.finer, &read);
    let records = match Arc::try_unwrap(read) {
        Ok(read) => read.records,
        Err(read) => read.records.clone(),
    };
    let (builder, notes) = builder(file, mode, &grid, solver, records)?;
    let builder = builder.states(states);
    let about = |error| input_error(file, error);
    let mut built = builder.lower().map_err(about)?;
    functions::check_unknown_mass(file, &built.problem)?;
    let searches =
        built.weight_search.is_some() || built.problem.penalties.iter().any(|p| p.rule.is_some());
    let settings = fit::build(file, &built.problem, solver, searches)?;
    let given_start = built.problem.functions.start();
    // A simulation uses the functions as given.
    if !matches!(mode, BuildMode::Simulate { .. }) {
        built.move_start().map_err(about)?;
    }
    // Assumed units stand beside a result, and are no warnings; each channel reads the column of times.
    let mut assumed_units = BTreeSet::new();
    warnings.retain(|warning| match &warning.doubt {
        Some(Doubt::UnitsAssumed { units }) => {
            assumed_units.extend(units.iter().cloned());
            false
        }
        _ => true,
    });
    warnings.extend(built.notices.iter().map(Finding::stated));
    for warning in &mut warnings {
        warning.severity = warning.severity.max(Severity::Warning);
    }
    let validation = |i: &usize| experiments::is_held_out(&spec.experiments[*i]);
    let (own, notes): (Vec<_>, Vec<_>) = notes
        .into_iter()
        .enumerate()
        .partition(|(i, _)| validation(i));
    let truth = timed(&mut reading, || functions::truth(file, &grid))?;
    let state = |s: &kmcfit_core::model::StateSpec| State::one(s.displacement, s.velocity);
    let study = study::build(file, &built.problem)?;
    let source = source.unwrap_or_else(|| timed(&mut reading, || ModelSource::of(file)));
    Ok(Model {
        file: file.path.clone(),
        study,
        title: title(file),
        problem: built.problem,
        given_start,
        settings,
        weight_rule: built.weight_search,
        tests_bases: spec
            .fit
            .as_ref()
            .and_then(|fit| fit.refinement)
            .unwrap_or(true),
        truth,
        positions: notes.iter().map(|(i, _)| *i).collect(),
        notes: notes.into_iter().map(|(_, notes)| notes).collect(),
        validation: (built.validation.into_iter().zip(own))
            .map(|((experiment, scalars), (_, notes))| HoldOut {
                experiment,
                scalars,
                notes,
            })
            .collect(),
        predictions: spec.predict.iter().flatten().map(state).collect(),
        warnings,
        data,
        delay_limits,
        automatic,
        assumed_units: assumed_units.into_iter().collect(),
        has_unknown_mass: functions::has_unknown_mass(file),
        grid: automatic_grid,
        source,
        preparation: Preparation {
            reading,
            total: clock.elapsed(),
        },
    })
}

fn title(file: &ModelFile) -> String {
    match &file.spec.title {
        Some(title) => title.clone(),
        None => file.path.file_stem().map_or_else(
            || "untitled".into(),
            |stem| stem.to_string_lossy().into_owned(),
        ),
    }
}
