//! Channels of an experiment: samples from a column, with noise, loss, sensor and filter.

mod noise;
mod sampling;

use super::column_samples::{self, ColumnRequest, ColumnSamples, PresentRows};
use super::data_facts::RecordNotes;
use super::faults::{Column, is_coarse, quantisation_step};
use super::{ChannelNote, names};
use crate::config::lowering::ModelKey;
use crate::config::lowering::experiments::Entry;
use crate::error::InputError;
use crate::units::Unit;
use kmcfit_core::model::{
    ColumnId, ColumnRef, CorrelationName, CorrelationSpec, ExperimentSpec, LossName, LossSpec,
    ScalarOr, SensorSpec, SigmaValue, StructureChannelSpec,
};
use kmcfit_core::number_format::{count, significant};
use kmcfit_core::record::{ChannelKind, Loss, NoiseModel, Weighting};
use kmcfit_core::signal::{SecondOrder, even_spacing, median_spacing};
use kmcfit_core::system::Grid;
use noise::{loss, noise_model, weighting, with_quantisation};
use sampling::{band, decimate};
use std::sync::Arc;

/// Default name of the column of the displacement, for files without `columns`.
const DISPLACEMENT_COLUMN: &str = "y_m";

/// A channel before it is placed on the grid.
#[derive(Debug, Clone)]
pub struct RawChannel {
    /// Measured quantity.
    pub kind: ChannelKind,
    /// Times, s.
    pub times: Arc<Vec<f64>>,
    /// Samples, SI.
    pub values: Arc<Vec<f64>>,
    /// Sampling interval of equally spaced samples without gaps, s.
    pub spacing: Option<f64>,
    /// First and last time of the rows, missing samples included, s.
    pub span: [f64; 2],
    /// True after decimation: the sampling interval then no longer bounds the step.
    pub decimated: bool,
    /// s.
    pub median_spacing: f64,
    /// `None` for the integral cost.
    pub weighting: Option<Weighting>,
    /// Sections of the band's filter.
    pub filter: Vec<SecondOrder>,
    pub loss: Loss,
    /// Correlation of the noise.
    pub noise: NoiseModel,
    /// Sensor, as stated.
    pub sensor: SensorSpec,
    /// What is observed of a structure.
    pub at: Vec<String>,
    pub unit: Unit,
    /// Unit of the column of times; `None` for a sampling rate.
    pub time_unit: Option<Unit>,
    /// Quantisation step, SI; 0 where none is stated.
    pub resolution: f64,
    pub(super) ignored: Vec<(usize, String)>,
    format: String,
}

impl RawChannel {
    /// Notes for reports.
    pub fn note(&self) -> ChannelNote {
        ChannelNote {
            kind: self.kind,
            unit: self.unit,
            ignored: self.ignored.clone(),
            format: self.format.clone(),
        }
    }
}

/// Settings of the model file for one channel.
struct Spec<'a> {
    kind: ChannelKind,
    column: Option<&'a ColumnRef>,
    unit: Option<&'a String>,
    sigma: Option<&'a SigmaValue>,
    loss: Option<&'a ScalarOr<LossName, LossSpec>>,
    noise: Option<&'a ScalarOr<CorrelationName, CorrelationSpec>>,
    sensor: Option<&'a SensorSpec>,
}

fn spec_of(spec: &ExperimentSpec, kind: ChannelKind) -> Spec<'_> {
    macro_rules! pick {
        ($part:expr) => {
            $part.as_ref().and_then(|part| match kind {
                ChannelKind::Displacement => part.displacement.as_ref(),
                ChannelKind::Velocity => part.velocity.as_ref(),
                ChannelKind::Acceleration => part.acceleration.as_ref(),
            })
        };
    }
    Spec {
        kind,
        column: pick!(spec.columns),
        unit: pick!(spec.units),
        sigma: pick!(spec.sigma),
        loss: pick!(spec.loss),
        noise: pick!(spec.noise),
        sensor: pick!(spec.sensors),
    }
}

/// Settings of the sensor of a channel in the model file.
pub fn sensor_of(spec: &ExperimentSpec, kind: ChannelKind) -> Option<&SensorSpec> {
    spec_of(spec, kind).sensor
}

/// Reads all channels of an experiment.
pub fn read(entry: &Entry<'_>, notes: &mut RecordNotes) -> Result<Vec<RawChannel>, InputError> {
    let spec = entry.spec;
    if let Some(list) = &spec.channels {
        return list
            .iter()
            .enumerate()
            .map(|channel| of_structure(entry, channel, notes))
            .collect();
    }
    let named: Vec<ChannelKind> = (ChannelKind::ALL.into_iter())
        .filter(|kind| spec_of(spec, *kind).column.is_some())
        .collect();
    if named.is_empty() && (spec.data.is_none() || named_something_else(spec)) {
        return Err(no_channel(entry));
    }
    let default: ColumnRef = ScalarOr::Scalar(ColumnId::Name(DISPLACEMENT_COLUMN.to_owned()));
    let mut channels = Vec::new();
    for kind in ChannelKind::ALL {
        let of_kind = spec_of(spec, kind);
        let usual = named.is_empty() && kind == ChannelKind::Displacement;
        match of_kind.column.or(usual.then_some(&default)) {
            Some(column) => channels.push(read_one(entry, &of_kind, column, notes)?),
            None => without_column(entry, &of_kind, &named)?,
        }
    }
    Ok(channels)
}

/// Reads a channel that observes a structure.
fn of_structure(
    entry: &Entry<'_>,
    (i, given): (usize, &StructureChannelSpec),
    notes: &mut RecordNotes,
) -> Result<RawChannel, InputError> {
    let observed = given.observed();
    let [(kind, at)] = observed.as_slice() else {
        let key = format!("channels[{i}]");
        return Err(entry
            .at
            .error_in(&key, "a channel observes one quantity")
            .found(match observed.len() {
                0 => "none".to_owned(),
                several => format!("{several} quantities"),
            })
            .expected("one of `displacement`, `velocity`, `acceleration` and `elongation`"));
    };
    let sensor = given.sensor();
    let spec = Spec {
        kind: *kind,
        column: None,
        unit: given.unit.as_ref(),
        sigma: given.sigma.as_ref(),
        loss: given.loss.as_ref(),
        noise: given.noise.as_ref(),
        sensor: Some(&sensor),
    };
    let channel = read_one(entry, &spec, &given.column, notes)?;
    let at = at.clone();
    Ok(RawChannel { at, ..channel })
}

/// True if `columns` names an excitation, or the time only.
fn named_something_else(spec: &ExperimentSpec) -> bool {
    let columns = spec.columns.as_ref();
    columns.is_some_and(|c| {
        c.force.is_some() || c.base_acceleration.is_some() || c.base_displacement.is_some()
    })
}

fn no_channel(entry: &Entry<'_>) -> InputError {
    let at = &entry.at;
    match (&entry.spec.data, &entry.spec.columns) {
        (None, None) => at
            .error("this experiment has no data")
            .expected("`data`, a CSV file with the samples"),
        _ => at
            .error_in("columns", "this experiment has no data")
            .found("no column of a response")
            .expected("one or more of `displacement`, `velocity`, `acceleration`"),
    }
}

/// Refuses a sigma, a loss, a noise model or a sensor of a channel without a column.
fn without_column(entry: &Entry<'_>, spec: &Spec, named: &[ChannelKind]) -> Result<(), InputError> {
    let name = spec.kind.name();
    let given = [
        ("sigma", spec.sigma.is_some()),
        ("units", spec.unit.is_some()),
        ("loss", spec.loss.is_some()),
        ("noise", spec.noise.is_some()),
        ("sensors", spec.sensor.is_some()),
    ];
    match given.iter().find(|(_, given)| *given) {
        Some((part, _)) => Err(entry
            .at
            .error_in(
                &format!("{part}.{name}"),
                format!("the {name} has no column, so it is not read"),
            )
            .found(match named {
                [] => "no `columns`: the displacement is read".to_owned(),
                some => format!("columns of {}", names(some)),
            })
            .expected(format!("`columns: {{{name}: …}}`, or leave the key out"))),
        None => Ok(()),
    }
}

fn read_one(
    entry: &Entry<'_>,
    of_kind: &Spec,
    column: &ColumnRef,
    notes: &mut RecordNotes,
) -> Result<RawChannel, InputError> {
    let (kind, spec, at) = (of_kind.kind, entry.spec, &entry.at);
    let sigma_at = at.below(&format!("sigma.{}", kind.name()));
    let sigma_column = match of_kind.sigma {
        Some(SigmaValue::Column(name)) => Some((name.as_str(), &sigma_at)),
        _ => None,
    };
    let wanted = ColumnRequest {
        entry,
        name: kind.name(),
        kind: kind.into(),
        column,
        unit: of_kind.unit,
        beside: sigma_column,
    };
    let mut source = column_samples::read(&wanted, notes)?;
    let mut ignored = Vec::new();
    let loss = loss(at, of_kind)?;
    let missing = source.values.iter().filter(|v| v.is_nan()).count();
    let quantisation = quantisation_step(&source.values);
    let is_stated = |step: &f64| {
        spec.band.is_none() && spec.decimate.is_none() && is_coarse(*step, &source.values)
    };
    let step = quantisation.filter(is_stated);
    let column = Column {
        entry,
        name: kind.name(),
        is_input: false,
        is_robust: loss != Loss::Squares,
    };
    let excluded = column.check(&mut source, quantisation, notes);
    if source.outside > 0 {
        ignored.push((source.outside, "outside the window".to_owned()));
    }
    if let Some(factor) = spec.decimate {
        decimate(at, factor, &mut source, &mut ignored)?;
    }
    let span = [source.times[0], source.times[source.times.len() - 1]];
    let present = PresentRows::of(&source.values);
    let samples = present.pick(&source.values);
    let column_at = at.below(&format!("columns.{}", kind.name()));
    refuse_too_little(&column_at, kind, &source, &samples)?;
    if missing > 0 {
        ignored.push((missing, "missing".to_owned()));
    }
    ignored.extend(excluded);
    let missing = source.values.len() - samples.len();
    let sigmas = source.beside.take().map(|b| present.picked(b));
    let [times, values] = [&mut source.times, &mut source.values]
        .map(|column| present.picked(std::mem::take(column)));
    let spacing = even_spacing(&times);
    let filter = band(at, spec, spacing, missing)?;
    let weighting = weighting(&sigma_at, of_kind.sigma, sigmas, &values)?;
    let (weighting, action) = with_quantisation(weighting, step.unwrap_or(0.0));
    if let Some(step) = step {
        column.state_quantisation(step, &values, source.unit, action, notes);
    }
    Ok(RawChannel {
        kind,
        span,
        decimated: spec.decimate.is_some_and(|factor| factor > 1),
        median_spacing: median_spacing(&times),
        times: Arc::new(times),
        values: Arc::new(values),
        spacing,
        weighting,
        filter,
        loss,
        noise: noise_model(of_kind),
        sensor: of_kind.sensor.cloned().unwrap_or_default(),
        at: Vec::new(),
        unit: source.unit,
        time_unit: source.time_unit,
        resolution: step.unwrap_or(0.0),
        ignored,
        format: source.format,
    })
}

/// Refuses too few samples, and samples that are all equal; `samples` are those of `source` that are not missing.
fn refuse_too_little(
    at: &ModelKey<'_>,
    kind: ChannelKind,
    source: &ColumnSamples,
    samples: &[f64],
) -> Result<(), InputError> {
    let found = match samples {
        [] => {
            let (missing, label) = (source.values.len(), &source.label);
            return Err(at
                .error("all samples are missing")
                .found(format!("{missing} rows without a number in `{label}`"))
                .expected("at least one sample"));
        }
        few if few.len() < Grid::FEWEST_NODES => count(few.len(), "sample"),
        [first, ..] => {
            if samples.iter().any(|sample| sample != first) {
                return Ok(());
            }
            let unit = kind.unit_of(source.unit.is_angular());
            return Err(at
                .error("all samples are equal")
                .found(format!(
                    "{} samples, all {} {unit}",
                    samples.len(),
                    significant(*first, 6)
                ))
                .expected("a record of a moving system"));
        }
    };
    Err(at
        .error("too few samples")
        .found(found)
        .expected(format!("at least {}", Grid::FEWEST_NODES)))
}
