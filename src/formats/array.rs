//! An array of numbers with two dimensions, as channels.

use super::budget::Budget;
use super::number::{ByteOrder, NumberType};
use super::{Channels, Sampling};
use crate::error::InputError;

/// A matrix of numbers.
pub(super) struct Array<'a> {
    /// Exactly rows x columns numbers.
    pub bytes: &'a [u8],
    pub kind: NumberType,
    pub order: ByteOrder,
    pub rows: usize,
    pub columns: usize,
    /// True if the numbers of a column are adjacent (Fortran, MATLAB), false for those of a row (C).
    pub column_major: bool,
}

impl Array<'_> {
    /// Adds one channel for each column or, in an array with more columns than rows, for each row: the longer dimension is time.
    /// Several are named `name.1`, `name.2`, ...
    ///
    /// # Errors
    /// When they exceed the budget.
    pub fn add_to(
        &self,
        channels: &mut Channels,
        name: &str,
        sampling: Option<Sampling>,
        budget: &mut Budget,
    ) -> Result<(), InputError> {
        let in_rows = self.columns > self.rows;
        let (samples, count) = match in_rows {
            true => (self.columns, self.rows),
            false => (self.rows, self.columns),
        };
        if samples.min(count) == 0 {
            channels.refuse(name, "an empty array", None);
            return Ok(());
        }
        let size = self.kind.size();
        let is_adjacent = self.column_major != in_rows;
        for i in 0..count {
            let name = match count {
                1 => name.to_owned(),
                _ => format!("{name}.{}", i + 1),
            };
            budget.name(&name)?;
            let mut values = budget.list(samples)?;
            match is_adjacent {
                true => {
                    let begin = i * samples * size;
                    let own = self.bytes.get(begin..begin + samples * size);
                    values.extend(
                        self.kind
                            .values(own.unwrap_or_default(), self.order, 0, size),
                    );
                }
                false => {
                    let (offset, stride) = (i * size, count * size);
                    values.extend(self.kind.values(self.bytes, self.order, offset, stride));
                }
            }
            channels.push(&name, None, sampling, values);
        }
        Ok(())
    }
}
