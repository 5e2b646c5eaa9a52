//! Samples that stand where others are meant: one column as an input and as a response, and a record that is listed twice.

use super::{Entry, RawChannel, RawRecord};
use crate::config::ModelFile;
use crate::error::InputError;
use kmcfit_core::finding::Finding;
use kmcfit_core::finding::Severity;
use kmcfit_core::model::ColumnRef;

/// Refuses an experiment with the same column in two places.
///
/// # Errors
/// At the second place.
pub fn refuse_one_column_twice(entry: &Entry<'_>) -> Result<(), InputError> {
    let Some(columns) = &entry.spec.columns else {
        return Ok(());
    };
    let named: Vec<(&str, &ColumnRef)> = [
        ("force", &columns.force),
        ("base_acceleration", &columns.base_acceleration),
        ("base_displacement", &columns.base_displacement),
        ("displacement", &columns.displacement),
        ("velocity", &columns.velocity),
        ("acceleration", &columns.acceleration),
    ]
    .into_iter()
    .filter_map(|(name, column)| Some((name, column.as_ref()?)))
    .collect();
    for (location, (name, column)) in named.iter().enumerate() {
        let earlier = named[..location].iter().find(|(_, other)| other == column);
        if let Some((other, _)) = earlier {
            return Err(refused(entry, [other, name]));
        }
    }
    Ok(())
}

/// Factors of one signal that is written twice: in the same unit, in g and m/s^2. Others are those of a free mass without noise.
const FACTORS: [f64; 3] = [1.0, 9.806_65, 1.0 / 9.806_65];
/// Difference of such signals by the rounding of seven digits, relative to their largest value; noise of sensors is above it.
const ROUNDING: f64 = 1e-6;

/// Refuses a record whose response is its input, sample by sample, also in another unit.
///
/// # Errors
/// At the response.
pub fn refuse_input_as_response(entry: &Entry<'_>, record: &RawRecord) -> Result<(), InputError> {
    let Some((name, signal)) = record.input_samples() else {
        return Ok(());
    };
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let is_input = |channel: &&RawChannel| {
        let (values, most) = (&channel.values, largest(&channel.values));
        let slack = |factor: f64| if factor == 1.0 { 0.0 } else { ROUNDING * most };
        let same = |factor: &f64| {
            let mut pairs = values.iter().zip(signal.values());
            pairs.all(|(a, b)| (a - factor * b).abs() <= slack(*factor))
        };
        values.len() == signal.values().len() && FACTORS.iter().any(same)
    };
    match record.channels.iter().find(is_input) {
        Some(channel) => Err(refused(entry, [name, channel.kind.name()])),
        None => Ok(()),
    }
}

fn refused(entry: &Entry<'_>, [one, other]: [&str; 2]) -> InputError {
    let words = [one, other].map(|name| name.replace('_', " "));
    let problem = format!("{} and {} are the same column", words[0], words[1]);
    (entry.at.error_in(&format!("columns.{other}"), problem)).expected("a column for each of them")
}

/// Warnings about records with the samples of an earlier one, under whatever name.
pub fn repeated_records(file: &ModelFile, records: &[Option<RawRecord>]) -> Vec<Finding> {
    let channels = |i: usize| records[i].iter().flat_map(|record| &record.channels);
    let same = |a: &RawChannel, b: &RawChannel| a.kind == b.kind && a.values == b.values;
    let mut warnings = Vec::new();
    for later in 1..records.len() {
        let repeats = |earlier: &usize| {
            let mut own = channels(later);
            own.any(|channel| channels(*earlier).any(|other| same(channel, other)))
        };
        if let Some(earlier) = (0..later).find(repeats) {
            let [name, other] = [later, earlier].map(|i| file.experiment_name(i));
            let text = format!(
                "{name} has the samples of {other}: listed twice, they narrow the intervals without further information; remove one"
            );
            let warning = Finding::new("repeated_record", text).with("experiment", &name);
            let warning = warning.with("other", other).rated(Severity::Check);
            warnings.push(warning.at(&format!("experiments[{later}] ({name})")));
        }
    }
    warnings
}
