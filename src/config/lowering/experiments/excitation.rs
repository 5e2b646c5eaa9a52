//! Excitation of an experiment: force and base motion.

use super::Entry;
use super::column_samples::{self, ColumnRequest, ColumnSamples};
use super::data_facts::{RecordNotes, USED};
use super::faults::{Column, is_coarse, quantisation_step};
use crate::config::lowering::ModelKey;
use crate::error::InputError;
use crate::units::Measurand;
use kmcfit_core::model::{BaseSpec, ExperimentSpec, ForceShape, ForceSpec};
use kmcfit_core::record::{BaseMotion, Input, Waveform};
use kmcfit_core::signal::{ExcitationShape, Interpolation, Signal, SweepLaw};
use std::ops::Range;

/// Reads the excitation of an experiment.
pub fn read(entry: &Entry<'_>, notes: &mut RecordNotes) -> Result<Input, InputError> {
    let (at, spec) = (&entry.at, entry.spec);
    let columns = spec.columns.as_ref();
    let units = spec.units.as_ref();
    let at_coordinate = match spec.forces.as_deref() {
        None | Some([]) => None,
        Some([force]) => Some(force),
        Some(several) => {
            return Err(at
                .error_in("forces[1]", "only one force can act on a structure")
                .found(format!("{} forces", several.len()))
                .expected("one of them"));
        }
    };
    let force_column = columns.and_then(|c| c.force.as_ref());
    let force_column = force_column.or(at_coordinate.map(|force| &force.column));
    let force = match (force_column, &spec.force) {
        (None, None) => None,
        (None, Some(force)) => Some(Waveform::Shape(shape(at, force)?)),
        (Some(column), force) => {
            if let Some(named) = force.as_ref().and_then(|f| f.shape) {
                return Err(at
                    .error_in("force.shape", "the force is given twice")
                    .found(format!("a column and the shape `{named}`"))
                    .expected("one of the two"));
            }
            let interpolation = force.as_ref().and_then(|f| f.interpolation);
            let interpolation = interpolation.or(at_coordinate.and_then(|f| f.interpolation));
            let wanted = ColumnRequest {
                entry,
                name: "force",
                kind: Measurand::Force,
                column,
                unit: (at_coordinate.and_then(|f| f.unit.as_ref()))
                    .or(units.and_then(|u| u.force.as_ref())),
                beside: None,
            };
            let meant = interpolation.unwrap_or_default();
            Some(Waveform::Samples(signal(&wanted, meant, notes)?))
        }
    };
    let base = base(entry, notes)?;
    Ok(Input {
        force,
        base,
        ..Input::default()
    })
}

fn base(entry: &Entry<'_>, notes: &mut RecordNotes) -> Result<Option<BaseMotion>, InputError> {
    let (at, spec) = (&entry.at, entry.spec);
    let columns = spec.columns.as_ref();
    let units = spec.units.as_ref();
    let acceleration = columns.and_then(|c| c.base_acceleration.as_ref());
    let displacement = columns.and_then(|c| c.base_displacement.as_ref());
    let own = spec.base.as_ref();
    let interpolation = own.and_then(|b| b.interpolation);
    let of_base = |is_meant: bool| {
        let is_displacement = |b: &&BaseSpec| b.displacement.unwrap_or(false) == is_meant;
        own.filter(is_displacement).and_then(|b| b.column.as_ref())
    };
    let (acceleration, displacement) = (
        acceleration.or(of_base(false)),
        displacement.or(of_base(true)),
    );
    let unit = own.and_then(|b| b.unit.as_ref());
    let (column, kind) = match (acceleration, displacement) {
        (None, None) if spec.base.is_none() => return Ok(None),
        (None, None) => {
            return Err(at
                .error_in("base", "the base motion is missing")
                .expected("`columns: {base_acceleration: …}` or `{base_displacement: …}`"));
        }
        (Some(_), Some(_)) => {
            return Err(at
                .error_in(
                    "columns.base_displacement",
                    "the base motion is given twice",
                )
                .found("`base_acceleration` and `base_displacement`")
                .expected("one of the two"));
        }
        (Some(column), None) => (column, Measurand::Acceleration),
        (None, Some(column)) => (column, Measurand::Displacement),
    };
    let wanted = |name, unit, kind| ColumnRequest {
        entry,
        name,
        kind,
        column,
        unit,
        beside: None,
    };
    if kind == Measurand::Acceleration {
        let unit = unit.or(units.and_then(|u| u.base_acceleration.as_ref()));
        let wanted = wanted("base_acceleration", unit, kind);
        let meant = interpolation.unwrap_or_default();
        return signal(&wanted, meant, notes).map(|signal| Some(BaseMotion::Acceleration(signal)));
    }
    if let Some(given) = interpolation.filter(|i| *i != Interpolation::Cubic) {
        let name = match given {
            Interpolation::Hold => "`hold`",
            _ => "`linear`",
        };
        return Err(at
            .error_in(
                "base.interpolation",
                "a displacement of the base is differentiated twice, so it must be smooth",
            )
            .found(name)
            .expected("`cubic`"));
    }
    let unit = units.and_then(|u| u.base_displacement.as_ref());
    let wanted = wanted("base_displacement", unit, kind);
    let signal = signal(&wanted, Interpolation::Cubic, notes)?;
    Ok(Some(BaseMotion::Displacement(signal)))
}

/// Stretches without missing values, as ranges of rows.
pub(in crate::config) fn known_stretches(values: &[f64]) -> Vec<Range<usize>> {
    let mut stretches: Vec<Range<usize>> = Vec::new();
    for i in (0..values.len()).filter(|i| !values[*i].is_nan()) {
        match stretches.last_mut().filter(|run| run.end == i) {
            Some(run) => run.end += 1,
            None => stretches.push(i..i + 1),
        }
    }
    stretches
}

fn gaps(
    at: &ModelKey<'_>,
    source: &ColumnSamples,
    known: &[Range<usize>],
    zero: f64,
) -> InputError {
    let missing = source.values.iter().filter(|v| v.is_nan()).count();
    let first = source.values.iter().position(|v| v.is_nan()).unwrap_or(0);
    let error = at
        .error("the input has gaps")
        .found(format!(
            "{missing} of {} values missing, the first at {} s",
            source.values.len(),
            source.times[first] + zero
        ))
        .expected("a value in every row of the window: it acts at all times");
    match known.iter().max_by_key(|run| run.len()) {
        Some(run) => error.hint(format!(
            "`window: {{min: {}, max: {}}}` is the longest part without gaps",
            source.times[run.start] + zero,
            source.times[run.end - 1] + zero
        )),
        None => error,
    }
}

/// A column as a signal. Refuses missing samples in the window, because an excitation acts at all times.
fn signal(
    wanted: &ColumnRequest,
    interpolation: Interpolation,
    notes: &mut RecordNotes,
) -> Result<Signal, InputError> {
    // Interpolation needs samples of the excitation slightly beyond the window of the response.
    let (entry, spec) = (wanted.entry, wanted.entry.spec);
    let unbounded = ExperimentSpec {
        window: None,
        ..spec.clone()
    };
    let everywhere = Entry {
        spec: &unbounded,
        ..entry.clone()
    };
    let everywhere = ColumnRequest {
        entry: &everywhere,
        ..*wanted
    };
    let mut source = column_samples::read(&everywhere, notes)?;
    let at = entry.at.below(&format!("columns.{}", wanted.name));
    let [from, to] = column_samples::window(entry)?;
    let known = known_stretches(&source.values);
    let last = source.times.len() - 1;
    let zero = spec.time_zero.unwrap_or(0.0);
    let [from, to] = [
        (from - zero).max(source.times[0]),
        (to - zero).min(source.times[last]),
    ];
    let covers =
        |run: &&Range<usize>| source.times[run.start] <= from && source.times[run.end - 1] >= to;
    match known.iter().find(covers).cloned() {
        Some(run) => {
            source.times.truncate(run.end);
            source.times.drain(..run.start);
            source.values.truncate(run.end);
            source.values.drain(..run.start);
        }
        None => return Err(gaps(&at, &source, &known, zero)),
    }
    let column = Column {
        entry,
        name: &wanted.name.replace('_', " "),
        is_input: true,
        is_robust: false,
    };
    let quantisation = quantisation_step(&source.values);
    column.check(&mut source, quantisation, notes);
    if let Some(step) = quantisation.filter(|step| is_coarse(*step, &source.values)) {
        column.state_quantisation(step, &source.values, source.unit, USED, notes);
    }
    let samples = source.times.len();
    Signal::new(source.times, source.values, interpolation).ok_or_else(|| {
        at.error("invalid samples of the input")
            .found(format!("{samples} samples"))
            .expected("finite values at increasing times")
    })
}

/// A force given by its shape instead of samples.
pub fn shape(at: &ModelKey<'_>, spec: &ForceSpec) -> Result<ExcitationShape, InputError> {
    let at = at.below("force");
    let Some(shape) = spec.shape else {
        return Err(at
            .error("the force is missing")
            .expected("`columns: {force: …}`, or `shape` here"));
    };
    shape_keys(&at, shape, spec)?;
    let number = |given: Option<f64>| given.unwrap_or(0.0);
    let (amplitude, start) = (number(spec.amplitude), number(spec.at));
    let duration = number(spec.duration);
    Ok(match shape {
        ForceShape::Constant => ExcitationShape::Constant { amplitude },
        ForceShape::Sine => ExcitationShape::Sine {
            amplitude,
            frequency: number(spec.frequency),
            phase: number(spec.phase),
        },
        ForceShape::Sweep => ExcitationShape::Sweep {
            amplitude,
            from: number(spec.from),
            to: number(spec.to),
            start,
            duration,
            law: SweepLaw::Linear,
        },
        ForceShape::Step => ExcitationShape::Step {
            amplitude,
            at: start,
        },
        ForceShape::HalfSine => ExcitationShape::HalfSine {
            amplitude,
            at: start,
            duration,
        },
    })
}

/// Refuses unknown and missing keys of a shape, and invalid values.
fn shape_keys(at: &ModelKey<'_>, shape: ForceShape, spec: &ForceSpec) -> Result<(), InputError> {
    let keys = [
        ("amplitude", spec.amplitude),
        ("frequency", spec.frequency),
        ("phase", spec.phase),
        ("from", spec.from),
        ("to", spec.to),
        ("at", spec.at),
        ("duration", spec.duration),
    ];
    let (needed, possible): (&[&str], &[&str]) = match shape {
        ForceShape::Constant => (&["amplitude"], &[]),
        ForceShape::Sine => (&["amplitude", "frequency"], &["phase"]),
        ForceShape::Sweep => (&["amplitude", "from", "to", "duration"], &["at"]),
        ForceShape::Step => (&["amplitude"], &["at"]),
        ForceShape::HalfSine => (&["amplitude", "duration"], &["at"]),
    };
    let expected = || listed_keys(needed, possible);
    for (name, value) in keys {
        let is_needed = needed.contains(&name);
        if value.is_some() && !is_needed && !possible.contains(&name) {
            let problem = format!("a {shape} has no `{name}`");
            return Err((at.error_in(name, problem))
                .found(format!("`{name}`"))
                .expected(expected()));
        }
        if value.is_none() && is_needed {
            let problem = format!("a {shape} needs its `{name}`");
            return Err(at.error(problem).expected(expected()));
        }
    }
    if spec.interpolation.is_some() {
        return Err(
            (at.error_in("interpolation", "a shape is not interpolated"))
                .found(format!("`interpolation` beside `{shape}`"))
                .expected("one of the two"),
        );
    }
    let positive = [
        ("frequency", spec.frequency, "Hz"),
        ("duration", spec.duration, "s"),
    ];
    for (name, value, unit) in positive {
        if let Some(value) = value.filter(|v| *v <= 0.0) {
            return Err(at
                .error_in(name, format!("the {name} must be positive"))
                .found(format!("{} {unit}", value))
                .expected(format!("a number greater than 0, in {unit}")));
        }
    }
    Ok(())
}

fn listed_keys(needed: &[&str], possible: &[&str]) -> String {
    let quoted = |names: &[&str]| -> String {
        let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        names.join(", ")
    };
    match possible {
        [] => quoted(needed),
        _ => format!("{}, optionally {}", quoted(needed), quoted(possible)),
    }
}
