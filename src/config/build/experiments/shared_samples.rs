//! Samples that stand where others are meant: one column as an input and as a response, and a record that is listed twice.

use super::warning::DataWarning;
use super::{RawChannel, RawRecord};
use crate::config::ModelFile;
use crate::config::spec::{ColumnRef, ExperimentSpec};
use crate::error::InputError;
use crate::finding::Finding;

/// Refuses an experiment with the same column in two places.
///
/// # Errors
/// At the second place.
pub fn refuse_one_column_twice(
    file: &ModelFile,
    i: usize,
    spec: &ExperimentSpec,
) -> Result<(), InputError> {
    let Some(columns) = &spec.columns else {
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
    for (place, (name, column)) in named.iter().enumerate() {
        let earlier = named[..place].iter().find(|(_, other)| other == column);
        if let Some((other, _)) = earlier {
            return Err(refused(file, i, [other, name]));
        }
    }
    Ok(())
}

/// Refuses a record whose response is its input, sample by sample.
///
/// # Errors
/// At the response.
pub fn refuse_input_as_response(
    file: &ModelFile,
    i: usize,
    record: &RawRecord,
) -> Result<(), InputError> {
    let Some((name, signal)) = record.excitation.samples() else {
        return Ok(());
    };
    let is_input = |channel: &&RawChannel| {
        let same = channel.values.iter().zip(signal.values());
        channel.values.len() == signal.values().len() && same.into_iter().all(|(a, b)| a == b)
    };
    match record.channels.iter().find(is_input) {
        Some(channel) => Err(refused(file, i, [name, channel.kind.name()])),
        None => Ok(()),
    }
}

fn refused(file: &ModelFile, i: usize, [one, other]: [&str; 2]) -> InputError {
    let key = format!("experiments[{i}].columns.{other}");
    let words = [one, other].map(|name| name.replace('_', " "));
    file.error_at(
        &key,
        format!("{} and {} are the same column", words[0], words[1]),
    )
    .expected("a column for each of them")
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
            let warning = DataWarning::RepeatedRecord {
                experiment: name.clone(),
                other,
            };
            warnings.push(warning.at(&format!("experiments[{later}] ({name})")));
        }
    }
    warnings
}
