//! Experiments: readings, forces and initial states from files, put on the grid.

mod channel;
mod column_samples;
mod data_checks;
mod excitation;
mod unit;
mod warning;

use super::{BuildMode, functions};
use crate::config::ModelFile;
use crate::config::spec::{EstimateValue, ExperimentSpec, FitMethod, InitialSpec, SensorSpec};
use crate::config::values::{Estimate, NumberOrEstimate, ScalarOr};
use crate::error::InputError;
use crate::finding::Finding;
use crate::tables::resample;
use crate::units::Unit;
pub(super) use channel::RawChannel;
use excitation::RawExcitation;
use kmcfit_core::internals::builder::{self, ChannelSpec, ScalarSpec, listed};
use kmcfit_core::internals::functions::{Prior, ScalarParameter};
use kmcfit_core::internals::record::{ChannelKind, Experiment, Weighting};
use kmcfit_core::internals::system::Grid;

pub(super) use excitation::shape;

/// What stands in the files of one experiment, at the times of its readings.
pub(super) struct RawRecord {
    pub channels: Vec<RawChannel>,
    excitation: RawExcitation,
}

impl RawRecord {
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

/// Whether the fit compares the equation of motion, and not a motion, with the readings.
fn is_equation_error(file: &ModelFile) -> bool {
    let method = file.spec.fit.as_ref().and_then(|f| f.method);
    method.map(FitMethod::name) == Some("equation-error")
}

/// Whether an experiment is kept out of the fit.
pub(super) fn is_held_out(spec: &ExperimentSpec) -> bool {
    spec.validation == Some(true)
}

/// Reads the files of all experiments; `None` where there is none to be read.
pub(super) fn read(
    file: &ModelFile,
    purpose: BuildMode,
    warnings: &mut Vec<Finding>,
) -> Result<Vec<Option<RawRecord>>, InputError> {
    let specs = &file.spec.experiments;
    if specs.iter().all(is_held_out) {
        return Err(file
            .error_at("experiments", "every experiment is a validation record")
            .found("`validation: true` in all of them")
            .expected("at least one experiment without"));
    }
    if matches!(purpose, BuildMode::Simulate { .. }) {
        // The duration may still have to come from the readings.
        let has_duration = (file.spec.grid.as_ref()).is_some_and(|g| g.duration.is_some());
        let all_have_data = specs.iter().all(|e| e.data.is_some());
        if has_duration || !all_have_data {
            let records = specs.iter().enumerate().map(|(i, spec)| {
                let excitation = excitation::read(file, i, spec, warnings)?;
                let channels = Vec::new();
                Ok((!excitation.is_empty()).then_some(RawRecord {
                    channels,
                    excitation,
                }))
            });
            return records.collect();
        }
    }
    let records = specs.iter().enumerate();
    records
        .map(|(i, spec)| read_one(file, i, spec, warnings).map(Some))
        .collect()
}

fn read_one(
    file: &ModelFile,
    i: usize,
    spec: &ExperimentSpec,
    warnings: &mut Vec<Finding>,
) -> Result<RawRecord, InputError> {
    let channels = channel::read(file, i, spec, warnings)?;
    let record = RawRecord {
        channels,
        excitation: excitation::read(file, i, spec, warnings)?,
    };
    warnings.extend(data_checks::of(file, i, spec, &record));
    Ok(record)
}

/// The specification of experiment `i` with what its files have, and what a report says of its channels.
pub(super) fn specification(
    file: &ModelFile,
    purpose: BuildMode,
    grid: &Grid,
    i: usize,
    record: Option<RawRecord>,
) -> Result<(builder::Record, Vec<ChannelNote>), InputError> {
    let spec = &file.spec.experiments[i];
    let estimate = ScalarOr::Scalar(NumberOrEstimate::Estimate);
    let initial = match &spec.initial {
        InitialSpec::Scalar(Estimate) => [&estimate, &estimate],
        InitialSpec::Map(state) => [&state.displacement, &state.velocity],
    };
    let mut found = builder::Record::new(file.experiment_name(i)).initial(initial.map(scalar));
    if is_held_out(spec) {
        found = found.validation();
    }
    for (kind, given) in functions::own(file, i) {
        let key = format!("experiments[{i}].functions.{}", kind.name());
        let own = functions::specification(file, grid, &key, given)?;
        found = found.coefficient(kind, own);
    }
    let mut notes = Vec::new();
    if let Some(mut record) = record {
        found = found.input(record.excitation.into_input());
        if let (BuildMode::Check { .. }, [only]) = (purpose, record.channels.as_mut_slice()) {
            reading_per_node(only, grid);
        }
        for raw in record.channels {
            notes.push(raw.note());
            found = found.channel(channel(spec, raw));
        }
    }
    Ok((found, notes))
}

/// A number of the model that is known or estimated.
fn scalar(given: &EstimateValue) -> ScalarSpec {
    match given {
        ScalarOr::Scalar(NumberOrEstimate::Number(number)) => ScalarSpec::Known(number.0),
        ScalarOr::Scalar(NumberOrEstimate::Estimate) => ScalarSpec::ESTIMATED,
        ScalarOr::Map(spec) => ScalarSpec::Estimated {
            start: spec.start.map(|start| start.0),
            prior: spec.prior.as_ref().map(|prior| Prior {
                mean: prior.mean.0,
                sigma: prior.sigma.0,
            }),
        },
    }
}

fn channel(spec: &ExperimentSpec, raw: RawChannel) -> ChannelSpec {
    let sensor = |given: &SensorSpec| builder::SensorSpec {
        gain: given.gain.as_ref().map(scalar),
        offset: given.offset.as_ref().map(scalar),
        drift: given.drift.as_ref().map(scalar),
        absolute: given.absolute,
    };
    let given = channel::sensor_of(spec, raw.kind);
    ChannelSpec {
        kind: raw.kind,
        sensor: given.map(sensor).unwrap_or_default(),
        weighting: raw.weighting,
        loss: raw.loss,
        filter: raw.filter,
        span: raw.span,
        angular: raw.unit.is_angular(),
        times: raw.times,
        values: raw.values,
    }
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
