//! An array of numbers with two dimensions, as channels.

use super::Channels;
use super::budget::Budget;
use crate::error::InputError;

/// A matrix of numbers.
pub(super) struct Array<'a> {
    pub rows: usize,
    pub columns: usize,
    /// True if the numbers of a column are adjacent (Fortran, MATLAB), false for those of a row (C).
    pub column_major: bool,
    /// The number at a place of the file's order.
    pub value: &'a dyn Fn(usize) -> f64,
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
        // Places of the first samples of the channels, and of the samples of one.
        let (first, step) = match self.column_major != in_rows {
            true => (samples, 1),
            false => (1, count),
        };
        for i in 0..count {
            let name = match count {
                1 => name.to_owned(),
                _ => format!("{name}.{}", i + 1),
            };
            budget.name(&name)?;
            let mut values = budget.list(samples)?;
            values.extend((0..samples).map(|k| (self.value)(i * first + k * step)));
            channels.push(&name, None, None, values);
        }
        Ok(())
    }
}
