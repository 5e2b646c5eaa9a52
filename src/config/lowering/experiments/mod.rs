//! Experiments of a model file: channels, excitation and initial state, read from files and placed on the grid.

mod channel;
mod column_samples;
mod data_checks;
mod data_facts;
mod delays;
mod excitation;
mod faults;
mod shared_samples;
mod unit;

use super::{BuildMode, functions};
use crate::config::ModelFile;
use crate::config::lowering::ModelKey;
use crate::error::InputError;
use crate::units::Unit;
pub(super) use channel::RawChannel;
pub(in crate::config) use channel::sensor_of;
pub(super) use data_facts::RecordNotes;
pub use delays::DelayLimits;
pub(in crate::config) use excitation::known_stretches;
use kmcfit_core::builder::{ChannelSpec, Record, listed};
use kmcfit_core::finding::Finding;
use kmcfit_core::functions::ScalarParameter;
use kmcfit_core::model::{
    DelayValue, ExperimentSpec, FitMethod, InitialSpec, InputErrorName, InputSigmaSpec, ScalarSpec,
};
use kmcfit_core::record::{BaseMotion, ChannelKind, Experiment, Input, InputNoiseKind, Waveform};
use kmcfit_core::signal::Signal;
use kmcfit_core::system::{Grid, InputQuantity};
use std::sync::Arc;

pub(super) use excitation::shape;

/// Data of one experiment before it is placed on the grid, at the times of its samples.
#[derive(Debug, Clone)]
pub(super) struct RawRecord {
    pub channels: Vec<RawChannel>,
    input: Input,
}

impl RawRecord {
    /// Samples of the force, if it alone acts.
    pub fn force(&self) -> Option<&Signal> {
        match &self.input {
            Input {
                force: Some(Waveform::Samples(signal)),
                base: None,
                ..
            } => Some(signal),
            _ => None,
        }
    }

    /// The measured input and its name, if it is one series of samples.
    fn input_samples(&self) -> Option<(&'static str, &Signal)> {
        match (&self.input.force, &self.input.base) {
            (Some(Waveform::Samples(signal)), None) => Some(("force", signal)),
            (None, Some(BaseMotion::Acceleration(signal))) => Some(("base_acceleration", signal)),
            (None, Some(BaseMotion::Displacement(signal))) => Some(("base_displacement", signal)),
            _ => None,
        }
    }

    /// Forces (N) at some times (s), if measured and if no other input acts.
    fn forces_at(&self, times: &[f64]) -> Option<Arc<Vec<f64>>> {
        self.force()?;
        self.input.forces_at(times)
    }

    /// True for a free response.
    pub fn is_free(&self) -> bool {
        self.input.force.is_none() && self.input.base.is_none()
    }

    /// First time of its rows, missing samples included, s.
    pub fn start(&self) -> f64 {
        let first = self.channels.iter().map(|c| c.span[0]);
        first.fold(f64::INFINITY, f64::min)
    }

    /// Last time of its rows, s.
    pub fn end(&self) -> f64 {
        let last = self.channels.iter().map(|c| c.span[1]);
        last.fold(f64::NEG_INFINITY, f64::max)
    }

    /// True for a force and a motion of the base.
    fn has_two_inputs(&self) -> bool {
        self.input.force.is_some() && self.input.base.is_some()
    }

    /// Sampling interval of force or base motion, if equally spaced, s.
    pub fn drive_spacing(&self) -> Option<f64> {
        let force = match &self.input.force {
            Some(Waveform::Samples(signal)) => Some(signal),
            _ => None,
        };
        let base = match &self.input.base {
            Some(BaseMotion::Acceleration(signal) | BaseMotion::Displacement(signal)) => {
                Some(signal)
            }
            None => None,
        };
        let times = force.or(base)?.times();
        let spacing = (times[times.len() - 1] - times[0]) / (times.len() - 1).max(1) as f64;
        let regular = times
            .windows(2)
            .all(|w| (w[1] - w[0] - spacing).abs() <= 1e-6 * spacing);
        (regular && spacing > 0.0).then_some(spacing)
    }

    /// The smallest median spacing of its channels, s.
    pub fn spacing(&self) -> f64 {
        let spacings = self.channels.iter().map(|c| c.median_spacing);
        spacings.fold(f64::INFINITY, f64::min)
    }
}

/// Notes for reports on one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelNote {
    /// Measured quantity.
    pub kind: ChannelKind,
    /// Unit of the file and of reports.
    pub unit: Unit,
    /// Unused samples: number and reason.
    pub ignored: Vec<(usize, String)>,
    /// Detected format of the file, as text.
    pub format: String,
}

/// A validation record: an experiment that is not used in the fit.
#[derive(Debug, Clone)]
pub struct HoldOut {
    /// The experiment; `scalars` are its estimated values.
    pub experiment: Experiment,
    /// Parameters of this record alone, estimated from it with the functions fixed.
    pub scalars: Vec<ScalarParameter>,
    /// Notes for reports on its channels.
    pub notes: Vec<ChannelNote>,
}

/// One entry of `experiments`.
#[derive(Debug, Clone)]
pub(super) struct Entry<'a> {
    pub at: ModelKey<'a>,
    pub number: usize,
    pub spec: &'a ExperimentSpec,
}

impl<'a> Entry<'a> {
    pub fn new(file: &'a ModelFile, number: usize) -> Self {
        Self {
            at: ModelKey::new(file, format!("experiments[{number}]")),
            number,
            spec: &file.spec.experiments[number],
        }
    }

    /// All entries of a model file.
    pub fn all(file: &'a ModelFile) -> impl Iterator<Item = Self> {
        (0..file.spec.experiments.len()).map(|i| Self::new(file, i))
    }

    /// Name of the experiment in reports.
    pub fn name(&self) -> String {
        self.at.file.experiment_name(self.number)
    }

    /// A finding about the experiment.
    fn placed(&self, finding: Finding) -> Finding {
        let name = self.name();
        let location = format!("{} ({name})", self.at.key);
        finding.at(&location).with("experiment", name)
    }
}

/// True if the fit minimises the equation error instead of the misfit of a simulated response.
fn is_equation_error(file: &ModelFile) -> bool {
    let method = file.spec.fit.as_ref().and_then(|f| f.method);
    method.map(FitMethod::name) == Some("equation-error")
}

/// True for a validation record.
pub(super) fn is_held_out(spec: &ExperimentSpec) -> bool {
    spec.validation == Some(true)
}

/// Reads the files of all experiments; `None` for an experiment without files.
pub(super) fn read(
    file: &ModelFile,
    mode: BuildMode,
    notes: &mut RecordNotes,
) -> Result<Vec<Option<RawRecord>>, InputError> {
    let specs = &file.spec.experiments;
    if specs.iter().all(is_held_out) {
        return Err(file
            .error_at("experiments", "every experiment is a validation record")
            .found("`validation: true` in all of them")
            .expected("at least one experiment without"));
    }
    if matches!(mode, BuildMode::Simulate { .. }) {
        // Without `duration` the length of the grid follows from the samples.
        let has_duration = (file.spec.grid.as_ref()).is_some_and(|g| g.duration.is_some());
        let all_have_data = specs.iter().all(|e| e.data.is_some());
        if has_duration || !all_have_data {
            let records = Entry::all(file).map(|entry| {
                let record = RawRecord {
                    channels: Vec::new(),
                    input: excitation::read(&entry, notes)?,
                };
                Ok((!record.is_free()).then_some(record))
            });
            return records.collect();
        }
    }
    let records = Entry::all(file).map(|entry| read_one(&entry, notes).map(Some));
    let records: Vec<Option<RawRecord>> = records.collect::<Result<_, _>>()?;
    let repeated = shared_samples::repeated_records(file, &records);
    notes.warnings.extend(repeated);
    Ok(records)
}

fn read_one(entry: &Entry<'_>, notes: &mut RecordNotes) -> Result<RawRecord, InputError> {
    shared_samples::refuse_one_column_twice(entry)?;
    let channels = channel::read(entry, notes)?;
    let mut record = RawRecord {
        channels,
        input: excitation::read(entry, notes)?,
    };
    shared_samples::refuse_input_as_response(entry, &record)?;
    if let Some(channel) = record.channels.first() {
        record.input.share_times(&channel.times);
    }
    let next = entry.at.file.spec.experiments.get(entry.number + 1);
    if next.is_none_or(|next| next.data != entry.spec.data) {
        notes.close_file();
    }
    let checks = data_checks::of(entry, &record);
    // Outliers are spikes as well.
    let is_repeated = |w: &Finding| w.doubt.is_some() && checks.iter().any(|c| c.doubt == w.doubt);
    notes.warnings.retain(|warning| !is_repeated(warning));
    notes.warnings.extend(checks);
    delays::apply(entry, &mut record, notes)?;
    Ok(record)
}

/// The specification of an experiment with its data, and the notes on its channels.
pub(super) fn specification(
    entry: &Entry<'_>,
    grid: &Grid,
    record: Option<RawRecord>,
    defaults: functions::Defaults<'_>,
) -> Result<(Record, Vec<ChannelNote>), InputError> {
    let spec = entry.spec;
    let initial = match &spec.initial {
        InitialSpec::Scalar(_) => [ScalarSpec::ESTIMATED; 2],
        InitialSpec::Map(state) => [state.displacement, state.velocity],
    };
    let mut found = Record::new(entry.name()).initial(initial);
    if let Some(force) = spec.forces.iter().flatten().next() {
        found = found.force_at(&force.at);
    }
    if is_held_out(spec) {
        found = found.validation();
    }
    for given in functions::own(spec) {
        let at = entry.at.below(&format!("functions.{}", given.0.name()));
        let own = functions::specification(&at, grid, given, defaults)?;
        found = found.coefficient(given.0, own);
    }
    if let Some((quantity, error)) = input_sigma(entry)? {
        let kind = match error.kind {
            InputErrorName::Sensor => InputNoiseKind::Sensor,
            InputErrorName::Drive => InputNoiseKind::Drive,
        };
        found = found.input_error(quantity, kind, error.value);
    }
    let mut notes = Vec::new();
    if let Some(record) = record {
        if let Some(start) = delays::of_input(entry, record.spacing())?.start() {
            found = found.input_delay(ScalarSpec::starting_at(start));
        }
        found = found.input(record.input);
        for raw in record.channels {
            notes.push(raw.note());
            let delay = delays::of_channel(entry, raw.kind, raw.median_spacing)?;
            found = found.channel(channel(raw, delay.start()));
        }
    }
    Ok((found, notes))
}

/// Stated errors of the input of an experiment, at most of one.
fn input_sigma<'a>(
    entry: &Entry<'a>,
) -> Result<Option<(InputQuantity, &'a InputSigmaSpec)>, InputError> {
    let Some(sigma) = &entry.spec.sigma else {
        return Ok(None);
    };
    match (&sigma.force, &sigma.base_acceleration) {
        (Some(_), Some(_)) => {
            let at = entry.at.below("sigma.base_acceleration");
            Err(at
                .error("errors are supported for one input")
                .found("`force` and `base_acceleration`")
                .expected("one of the two"))
        }
        (Some(force), None) => Ok(Some((InputQuantity::Force, force))),
        (None, Some(base)) => Ok(Some((InputQuantity::BaseAcceleration, base))),
        (None, None) => Ok(None),
    }
}

fn channel(raw: RawChannel, delay: Option<f64>) -> ChannelSpec {
    let mut sensor = raw.sensor;
    // Known delays have been taken off the times of the samples.
    sensor.delay = delay.map(DelayValue::starting_at);
    ChannelSpec {
        kind: raw.kind,
        sensor,
        weighting: raw.weighting,
        loss: raw.loss,
        noise: raw.noise,
        resolution: raw.resolution,
        filter: raw.filter,
        span: raw.span,
        angular: raw.unit.is_angular(),
        times: raw.times,
        values: raw.values,
        at: raw.at,
    }
}

/// Limits of the estimated delays of all records.
pub(super) fn delay_limits(
    file: &ModelFile,
    records: &[Option<RawRecord>],
) -> Result<Vec<DelayLimits>, InputError> {
    let mut found = Vec::new();
    for (entry, record) in Entry::all(file).zip(records) {
        if let Some(record) = record {
            found.extend(delays::limits(&entry, record)?);
        }
    }
    Ok(found)
}

/// Names of channels, separated by commas.
fn names(kinds: &[ChannelKind]) -> String {
    listed(kinds.iter().map(|kind| kind.name()))
}
