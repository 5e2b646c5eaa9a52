//! Full scale and unit of channels that a file gives without units, from the option `--units`.

use crate::error::InputError;
use crate::spelling::did_you_mean;
use crate::tables::Table;
use crate::text_io::{one_of, quote};
use crate::units::{Quantity, Unit, split_factor};

/// Multiplies the channels of a table by their full scales: `50 g,200 N` for the first two, `-` for one that is not used.
///
/// # Errors
/// When the table has times or units of its own, another number of channels, or an entry has no unit.
pub fn apply(table: &mut Table, units: &str) -> Result<(), InputError> {
    let error = |problem: &str| InputError::argument("--units", problem);
    let Some(channels) = table.time_column() else {
        return Err(error("the file has no full scale")
            .found(format!(
                "{}, a {}",
                table.path().display(),
                table.format_in_words()
            ))
            .expected("a file of channels with a sampling rate and without units (WAV)")
            .hint("state units in the model file: `units: {acceleration: g}`"));
    };
    let entries: Vec<&str> = units.split(',').map(str::trim).collect();
    if entries.len() != channels {
        return Err(error("another number of units than channels")
            .found(format!("{} in {}", entries.len(), quote(units)))
            .expected(format!(
                "{channels}, separated by commas; `-` for a channel that is not used"
            )));
    }
    for (index, entry) in entries.into_iter().enumerate() {
        if entry == "-" {
            continue;
        }
        let (factor, unit) = split_factor(entry);
        let known = || {
            Quantity::ALL
                .iter()
                .find_map(|kind| Unit::recognise(*kind, unit))
        };
        match known() {
            Some(unit) if factor.is_finite() && factor != 0.0 => {
                table.calibrate(index, factor, unit.symbol());
            }
            _ => {
                let symbols = || Quantity::ALL.into_iter().flat_map(Unit::symbols);
                return Err(error("not a full scale and its unit")
                    .found(quote(entry))
                    .expected(format!("a number and {}", one_of(symbols())))
                    .hint_if(did_you_mean(unit, symbols())));
            }
        }
    }
    Ok(())
}
