//! `kmcfit check FILE`: lists the columns, variables or channels of a data file.

use super::progress::Activity;
use super::{OK, print};
use crate::config::{rate, recognised};
use crate::error::InputError;
use crate::escape::shell_quoted;
use crate::report::text::aligned;
use crate::tables::{Table, TableFormat};
use kmcfit_core::number_format::significant;
use std::path::Path;

/// Lists a data file.
///
/// # Errors
/// When it cannot be read.
pub(super) fn run(path: &Path) -> Result<u8, InputError> {
    let reading = Activity::begin(format!("reading {}", path.display()));
    let tables = Table::read_all(path, &TableFormat::default())?;
    drop(reading);
    let format = tables.first().map(Table::format_in_words);
    let mut text = format!("{}: {}\n", path.display(), format.unwrap_or_default());
    let mut rows = vec![
        ["column", "name", "quantity", "unit", "samples", "rate"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for table in &tables {
        let rate = rate(table).filter(|_| table.rows() > 1);
        let rate = rate.map_or("-".to_owned(), |(_, rate)| {
            format!("{} Hz", significant(rate, 6))
        });
        rows.extend((0..table.width()).map(|index| row(table, index, &rate)));
    }
    for line in aligned(&rows).lines() {
        text += &format!("  {line}\n");
    }
    for note in tables.first().map_or(&[][..], Table::notes) {
        text += &format!("note: {note}\n");
    }
    for table in &tables {
        for index in 0..table.width() {
            if let stated @ [_, ..] = table.unapplied(index) {
                let (name, stated) = (table.label(index), stated.join(", "));
                text +=
                    &format!("note: `{name}`: the file states {stated}, which is not applied\n");
            }
        }
    }
    for other in tables.first().map_or(&[][..], Table::unusable) {
        text += &format!("not usable: `{}`, {}\n", other.name, other.content);
        if let Some(hint) = &other.hint {
            text += &format!("  {hint}\n");
        }
    }
    let file = shell_quoted(&path.display().to_string());
    print(&format!("{text}`kmcfit init {file}` writes a model file\n"));
    Ok(OK)
}

/// Number, name, quantity, unit, number of samples and sampling rate of a column.
fn row(table: &Table, index: usize, rate: &str) -> Vec<String> {
    // A single number is no record.
    let known = recognised(table, index).filter(|_| table.rows() > 1);
    let unit = match (known, table.unit(index)) {
        (Some((_, unit, true)), _) => unit.symbol().to_owned(),
        (_, Some(stated)) => stated.to_owned(),
        (Some((_, unit, false)), None) => format!("{} (assumed)", unit.symbol()),
        (None, None) => "-".to_owned(),
    };
    let samples = match table.samples(index) {
        Ok(samples) => {
            let missing = samples.iter().filter(|x| x.is_nan()).count();
            match missing {
                0 => samples.len().to_string(),
                missing => format!("{}, {missing} missing", samples.len()),
            }
        }
        Err(_) => "not numbers".to_owned(),
    };
    vec![
        table
            .number(index)
            .map_or("-".to_owned(), |n| n.to_string()),
        table.label(index),
        known.map_or("-".to_owned(), |(role, ..)| role.key().replace('_', " ")),
        unit,
        samples,
        rate.to_owned(),
    ]
}
