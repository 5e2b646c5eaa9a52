//! Experiments: readings, forces and initial states from files, put on the grid.

mod channel;
mod doubts;
mod excitation;
mod initial;
mod source;
mod unit;
mod value;

use super::functions::Assemblies;
use super::{Purpose, listed};
use crate::config::ModelFile;
use crate::config::spec::{ExperimentSpec, FitMethod};
use crate::error::InputError;
use crate::observations::resample;
use crate::units::Unit;
pub(super) use channel::RawChannel;
use excitation::RawExcitation;
use kmcfit_core::internals::functions::ScalarParameter;
use kmcfit_core::internals::record::{ChannelKind, Experiment, Weighting};
use kmcfit_core::internals::system::Grid;

pub(super) use doubts::unidentifiable;
pub(super) use excitation::shape;

/// What stands in the files of one experiment, at the times of its readings.
pub(super) struct Record {
    pub channels: Vec<RawChannel>,
    excitation: RawExcitation,
}

impl Record {
    /// First time of its rows, s: also of those without a reading.
    pub fn start(&self) -> f64 {
        let first = self.channels.iter().map(|c| c.span[0]);
        first.fold(f64::INFINITY, f64::min)
    }

    /// Last time of its rows, s.
    pub fn end(&self) -> f64 {
        let last = self.channels.iter().map(|c| c.span[1]);
        last.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Spacing of the samples of force or base, where they are equally spaced, s.
    pub fn drive_spacing(&self) -> Option<f64> {
        self.excitation.spacing()
    }

    /// The smallest median spacing of its channels, s.
    pub fn spacing(&self) -> f64 {
        let spacings = self.channels.iter().map(|c| c.median_spacing);
        spacings.fold(f64::INFINITY, f64::min)
    }
}

/// What a report says about one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelNote {
    /// What is measured.
    pub kind: ChannelKind,
    /// Unit of the file, which reports use as well.
    pub unit: Unit,
    /// Readings that are not used: how many, and why.
    pub ignored: Vec<(usize, String)>,
    /// How the file was found to be written, in words.
    pub format: String,
}

/// What was made of the experiments of a model.
pub(super) struct Built {
    pub fitted: Vec<Experiment>,
    pub notes: Vec<Vec<ChannelNote>>,
    pub scalars: Vec<ScalarParameter>,
    pub held_out: Vec<HoldOut>,
}

/// An experiment that is kept out of the fit.
#[derive(Debug, Clone)]
pub struct HoldOut {
    /// The experiment; what it leaves open are the scalars beside it.
    pub experiment: Experiment,
    /// Numbers of its own that are found from it with the functions held.
    pub scalars: Vec<ScalarParameter>,
    /// What a report says about its channels.
    pub notes: Vec<ChannelNote>,
}

/// Two experiments of one name could not be told apart.
pub(super) fn distinct_names(file: &ModelFile) -> Result<(), InputError> {
    let mut names: Vec<&str> = Vec::new();
    for (i, spec) in file.spec.experiments.iter().enumerate() {
        let Some(name) = &spec.name else { continue };
        if names.contains(&name.0.as_str()) {
            return Err(file
                .error_at(
                    &format!("experiments[{i}].name"),
                    "two experiments have the same name",
                )
                .found(format!("`{}`", name.0))
                .expected("a name of its own for every experiment"));
        }
        names.push(&name.0);
    }
    Ok(())
}

/// Whether the fit compares the equation of motion, and not a motion, with the readings.
fn is_equation_error(file: &ModelFile) -> bool {
    let method = file.spec.fit.as_ref().and_then(|f| f.method);
    method.map(FitMethod::name) == Some("equation-error")
}

/// Whether an experiment is kept out of the fit.
pub(super) fn is_held_out(spec: &ExperimentSpec) -> bool {
    spec.hold_out == Some(true)
}

/// Reads the files of all experiments; `None` where there is none to be read.
pub(super) fn read(
    file: &ModelFile,
    purpose: Purpose,
    warnings: &mut Vec<String>,
) -> Result<Vec<Option<Record>>, InputError> {
    let specs = &file.spec.experiments;
    if specs.iter().all(is_held_out) {
        return Err(file
            .error_at("experiments", "every experiment is held out of the fit")
            .found("`hold_out: true` in all of them")
            .expected("at least one experiment without"));
    }
    if matches!(purpose, Purpose::Simulate { .. }) {
        // The duration may still have to come from the readings.
        let has_duration = (file.spec.grid.as_ref()).is_some_and(|g| g.duration.is_some());
        let all_have_data = specs.iter().all(|e| e.data.is_some());
        if has_duration || !all_have_data {
            let records = specs.iter().enumerate().map(|(i, spec)| {
                let excitation = excitation::read(file, i, spec, warnings)?;
                let channels = Vec::new();
                Ok((!excitation.is_empty()).then_some(Record {
                    channels,
                    excitation,
                }))
            });
            return records.collect();
        }
    }
    let records: Vec<Option<Record>> = (specs.iter().enumerate())
        .map(|(i, spec)| read_one(file, i, spec, warnings).map(Some))
        .collect::<Result<_, _>>()?;
    same_start(file, &records)?;
    Ok(records)
}

fn read_one(
    file: &ModelFile,
    i: usize,
    spec: &ExperimentSpec,
    warnings: &mut Vec<String>,
) -> Result<Record, InputError> {
    let channels = channel::read(file, i, spec, warnings)?;
    let record = Record {
        channels,
        excitation: excitation::read(file, i, spec, warnings)?,
    };
    one_misfit(file, i, &record)?;
    excitation::covers(file, i, &record.excitation, [record.start(), record.end()])?;
    warnings.extend(doubts::of(file, i, spec, &record));
    Ok(record)
}

/// Without sigma J is the integral of the displacement's residual: other channels cannot be added
/// to it, since metres and metres per second cannot.
fn one_misfit(file: &ModelFile, i: usize, record: &Record) -> Result<(), InputError> {
    if is_equation_error(file) {
        return Ok(());
    }
    let without = record.channels.iter().find(|c| c.weighting.is_none());
    let alone = record.channels.len() == 1;
    match without {
        Some(channel) if !(alone && channel.kind == ChannelKind::Displacement) => {
            let name = channel.kind.name();
            let key = format!("experiments[{i}]");
            let problem = match alone {
                true => format!("readings of the {name} need a sigma"),
                false => "several channels need a sigma each, to be added up".to_owned(),
            };
            Err(file
                .error_at(&key, problem)
                .found(format!("no `sigma.{name}`"))
                .expected(format!(
                    "`sigma: {{{name}: …}}`: a number in SI units, a column, or `estimate`"
                )))
        }
        _ => Ok(()),
    }
}

/// The functions are functions of one time, and an initial state is that at its beginning.
fn same_start(file: &ModelFile, records: &[Option<Record>]) -> Result<(), InputError> {
    let Some(first) = records.iter().flatten().next() else {
        return Ok(());
    };
    for (i, record) in records.iter().enumerate() {
        let Some(record) = record else { continue };
        if (record.start() - first.start()).abs() > 1e-6 * first.spacing() {
            return Err(file
                .error_at(
                    &format!("experiments[{i}]"),
                    "this record begins at another time than the first one",
                )
                .found(format!("{} s", record.start()))
                .expected(format!("{} s, as the functions are shared", first.start()))
                .hint(format!(
                    "`time_zero: {}` counts its times from its beginning",
                    record.start() - first.start()
                )));
        }
    }
    Ok(())
}

/// Puts the records on the grid.
pub(super) fn build(
    file: &ModelFile,
    purpose: Purpose,
    grid: &Grid,
    records: Vec<Option<Record>>,
    assemblies: &Assemblies,
) -> Result<Built, InputError> {
    let mut built = Built {
        fitted: Vec::new(),
        notes: Vec::new(),
        scalars: Vec::new(),
        held_out: Vec::new(),
    };
    for (i, (spec, record)) in file.spec.experiments.iter().zip(records).enumerate() {
        let device = assemblies.of_experiment[i];
        if is_held_out(spec) {
            let mut scalars = Vec::new();
            let (experiment, notes) =
                place(file, purpose, grid, (i, device), record, &mut scalars)?;
            built.held_out.push(HoldOut {
                experiment,
                scalars,
                notes,
            });
        } else {
            let scalars = &mut built.scalars;
            let (experiment, notes) = place(file, purpose, grid, (i, device), record, scalars)?;
            built.fitted.push(experiment);
            built.notes.push(notes);
        }
    }
    Ok(built)
}

/// One experiment on the grid; numbers that it leaves open are added to `scalars`.
fn place(
    file: &ModelFile,
    purpose: Purpose,
    grid: &Grid,
    (i, device): (usize, usize),
    record: Option<Record>,
    scalars: &mut Vec<ScalarParameter>,
) -> Result<(Experiment, Vec<ChannelNote>), InputError> {
    let spec = &file.spec.experiments[i];
    let nodes = match &record {
        Some(record) if !record.channels.is_empty() => nodes_until(grid, record.end()),
        _ => grid.nodes(),
    };
    let (initial, sought) = initial::build(file, i, record.as_ref(), scalars)?;
    let mut experiment = Experiment::free(file.experiment_name(i), initial, nodes);
    experiment.sought = sought;
    experiment.device = device;
    let mut notes = Vec::new();
    if let Some(mut record) = record {
        excitation::place(&record.excitation, grid, nodes, &mut experiment);
        if let (Purpose::Check { .. }, [only]) = (purpose, record.channels.as_mut_slice()) {
            reading_per_node(only, grid);
        }
        if !matches!(purpose, Purpose::Simulate { .. }) {
            for raw in record.channels {
                notes.push(raw.note());
                let channel = channel::place(file, (i, spec), raw, grid, &experiment, scalars)?;
                experiment.channels.push(channel);
            }
        }
    }
    Ok((experiment, notes))
}

/// The nodes that a motion needs to reach `end`.
fn nodes_until(grid: &Grid, end: f64) -> usize {
    let steps = (end - grid.start()) / grid.step();
    let steps = (steps - kmcfit_core::internals::system::TimePoint::SAME_TIME)
        .ceil()
        .max(0.0);
    (steps as usize + 1).clamp(Grid::FEWEST_NODES, grid.nodes())
}

/// A check is about the gradient: readings of the plain integral cost are taken at every node, so
/// that the continuous adjoint can be checked on any grid.
fn reading_per_node(raw: &mut RawChannel, grid: &Grid) {
    let plain = raw.kind == ChannelKind::Displacement && raw.filter.is_empty();
    let integral = matches!(raw.weighting, Some(Weighting::Integral { .. }) | None);
    if plain && integral && raw.spacing.is_some() && raw.times.len() != grid.nodes() {
        raw.values = resample(&raw.values, grid.nodes());
        raw.times = grid.times();
        raw.spacing = Some(grid.step());
        raw.decimated = false;
        raw.weighting = None;
    }
}

/// Names of channels in a row.
fn names(kinds: &[ChannelKind]) -> String {
    listed(kinds.iter().map(|kind| kind.name()))
}
