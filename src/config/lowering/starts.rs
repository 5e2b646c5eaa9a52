//! Start values of mass, damping and stiffness that a model file leaves out, from its records.
//!
//! A measured force gives all three by the frequency response of a linear oscillator. Otherwise the dominant frequency and the decay give the
//! ratios, and the known or stated mass or stiffness their scale:
//!
//! ```text
//! k = m (2 pi f)^2,    c = 2 zeta sqrt(k m)
//! ```

use super::ModelKey;
use super::experiments::{RawChannel, RawRecord, is_held_out};
use super::functions::{self, RecordStarts};
use crate::config::ModelFile;
use crate::config::dominant::{Oscillation, decay_ratio, remove_outliers};
use kmcfit_core::diagnostics::standard_deviation;
use kmcfit_core::model::{ColumnSpec, KnownValue, NumberOrColumn, StartSpec};
use kmcfit_core::signal::{driven_oscillator, onset};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::Grid;
use std::f64::consts::TAU;

/// Damping ratio of a response that shows none: that of a lightly damped structure.
const DAMPING_RATIO: f64 = 0.02;
/// Frequency of a record without a dominant one, Hz.
const FREQUENCY: f64 = 1.0;

/// Start values from the first record that is fitted; `None` without samples, and where no function needs them.
pub(super) fn of_records(
    file: &ModelFile,
    grid: &Grid,
    records: &[Option<RawRecord>],
) -> Option<RecordStarts> {
    let all = functions::all(file);
    let needs = |(_, f): &functions::Given| f.start.is_none() && f.basis.is_some();
    all.iter().any(needs).then_some(())?;
    let specs = file.spec.experiments.iter().zip(records);
    let mut used = specs.filter(|(spec, _)| !is_held_out(spec));
    let record = used.find_map(|(_, record)| record.as_ref().filter(|r| !r.channels.is_empty()))?;
    let channel = record.channels.first()?;
    let [mass, stiffness] =
        [CoefficientKind::MASS, CoefficientKind::STIFFNESS].map(|kind| stated(file, grid, kind));
    let (omega, ratio, driven) = match oscillator(record, channel) {
        Some([m, c, k]) => ((k / m).sqrt(), 0.5 * c / (k * m).sqrt(), Some(m)),
        None => {
            let (omega, ratio) = oscillation(record, channel);
            (omega, ratio, inertial_mass(record, channel, omega))
        }
    };
    let ratio = match ratio > 0.0 {
        true => ratio,
        false => DAMPING_RATIO,
    };
    let of_stiffness = stiffness.map(|k| k / (omega * omega));
    let mass = mass
        .or(of_stiffness)
        .or(driven)
        .filter(|m| *m > 0.0)
        .unwrap_or(1.0);
    let stiffness = mass * omega * omega;
    Some([
        (CoefficientKind::MASS, mass),
        (CoefficientKind::DAMPING, 2.0 * ratio * mass * omega),
        (CoefficientKind::STIFFNESS, stiffness),
    ])
}

/// Mean of the fixed or start values of a shared function that states them. An error of their column is reported where the function is built.
fn stated(file: &ModelFile, grid: &Grid, kind: CoefficientKind) -> Option<f64> {
    let shared = functions::shared(file);
    let (_, given) = shared.iter().find(|(other, _)| *other == kind)?;
    let at = ModelKey::new(file, format!("functions.{}", kind.name()));
    let of_column = |part: &str, column: ColumnSpec| {
        let column = NumberOrColumn::Column(column);
        let values = functions::values(&at.below(part), grid, &column).ok()?;
        Some(values.iter().sum::<f64>() / values.len() as f64)
    };
    match (&given.fixed, &given.start) {
        (Some(KnownValue::Unknown(_)), _) => Some(1.0),
        (Some(KnownValue::Number(number)), _) => Some(*number),
        (Some(KnownValue::Map(map)), _) => match (&map.value, &map.data, &map.column) {
            (Some(value), _, _) => Some(*value),
            (None, Some(data), Some(column)) => {
                let (data, column) = (data.clone(), column.clone());
                of_column("fixed", ColumnSpec { data, column })
            }
            _ => None,
        },
        (None, Some(StartSpec::Number(number))) => Some(*number),
        (None, Some(StartSpec::List(values))) => values.first().copied(),
        (None, Some(StartSpec::Column(column))) => of_column("start", column.clone()),
        // A file states columns, not yet values at the nodes.
        (Some(KnownValue::History(_)), _) | (None, Some(StartSpec::Nodal(_)) | None) => None,
    }
}

/// Mass, damping and stiffness by the frequency response to the measured force.
fn oscillator(record: &RawRecord, channel: &RawChannel) -> Option<[f64; 3]> {
    let force = record.force()?;
    let spacing = channel.spacing?;
    let force: Vec<f64> = channel.times.iter().map(|t| force.value(*t)).collect();
    driven_oscillator(&force, &channel.values, spacing, channel.kind as i32)
}

/// Mass whose inertia force at a circular frequency equals the measured force, kg: for records too short for a frequency response.
fn inertial_mass(record: &RawRecord, channel: &RawChannel, omega: f64) -> Option<f64> {
    let force = record.force()?;
    let force: Vec<f64> = channel.times.iter().map(|t| force.value(*t)).collect();
    let order = 2 - channel.kind as i32;
    let acceleration = standard_deviation(&channel.values) * omega.powi(order);
    let mass = standard_deviation(&force) / acceleration;
    mass.is_finite().then_some(mass)
}

/// Circular frequency (1/s) and damping ratio of a channel.
fn oscillation(record: &RawRecord, channel: &RawChannel) -> (f64, f64) {
    let pairs = channel
        .times
        .iter()
        .copied()
        .zip(channel.values.iter().copied());
    let mut pairs: Vec<(f64, f64)> = pairs.collect();
    remove_outliers(&mut pairs);
    let values: Vec<f64> = pairs.iter().map(|(_, value)| *value).collect();
    let begin = match record.is_free() {
        true => onset(&values, channel.median_spacing).unwrap_or(0),
        false => 0,
    };
    let pairs = &pairs[begin..];
    let duration = match (pairs.first(), pairs.last()) {
        (Some(first), Some(last)) => last.0 - first.0,
        _ => 0.0,
    };
    let found = Oscillation::of(pairs, channel.median_spacing, duration);
    let frequency = found.frequency.unwrap_or(FREQUENCY);
    let ratio = decay_ratio(pairs, frequency).filter(|_| record.is_free());
    (TAU * frequency, ratio.unwrap_or(DAMPING_RATIO))
}
