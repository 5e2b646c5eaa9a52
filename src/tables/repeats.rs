//! Rows of a table that repeat a time: found, and merged into one sample per time.

use super::Table;
use super::times::not_increasing;
use crate::error::InputError;
pub use kmcfit_core::model::Duplicates;
use std::borrow::Cow;
use std::ops::Range;

/// Most times that a message lists.
const LISTED: usize = 10;

/// Rows of a table with the same time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RepeatedTimes {
    /// The rows of each repeated time, from 0.
    pub groups: Vec<Range<usize>>,
    /// True if the rows of each group are equal in every numeric column.
    pub are_equal: bool,
}

impl RepeatedTimes {
    /// Times that are all different.
    pub const NONE: Self = Self {
        groups: Vec::new(),
        are_equal: true,
    };

    /// Rows that a merged column does not have.
    pub fn excess(&self) -> usize {
        self.groups.iter().map(|rows| rows.len() - 1).sum()
    }

    /// A column with one value for each time, by `duplicates`; a mean is that of the values that are not missing.
    pub fn merged<'a>(&self, column: &'a [f64], duplicates: Duplicates) -> Cow<'a, [f64]> {
        if self.groups.is_empty() {
            return Cow::Borrowed(column);
        }
        let mut merged = Vec::with_capacity(column.len() - self.excess());
        let mut next = 0;
        for rows in &self.groups {
            merged.extend_from_slice(&column[next..rows.start]);
            merged.push(match duplicates {
                // Rounding must not change equal values.
                Duplicates::Mean if !self.are_equal => mean(&column[rows.clone()]),
                _ => column[rows.start],
            });
            next = rows.end;
        }
        merged.extend_from_slice(&column[next..]);
        Cow::Owned(merged)
    }

    /// Line or sample numbers of the repeated rows, those after the first of each time; at most `most`.
    pub fn lines(&self, table: &Table, most: usize) -> Vec<usize> {
        let rows = self.groups.iter().flat_map(|rows| rows.start + 1..rows.end);
        let lines = rows.filter_map(|row| table.lines().get(row).copied());
        lines.take(most).collect()
    }

    /// The error for rows that differ, at the first of them.
    fn refused(&self, table: &Table, index: usize, times: &[f64]) -> InputError {
        let differ = |rows: &&Range<usize>| {
            let mut later = rows.start + 1..rows.end;
            later.any(|row| !table.agree(rows.start, row))
        };
        let group = self.groups.iter().find(differ).or(self.groups.first());
        let row = group.map_or(1, |rows| rows.start + 1);
        let error = not_increasing(table, &table.label(index), times, row);
        if 2 * self.excess() > times.len() {
            return error.hint(
                "most rows repeat a time, as if printed with too few digits: `sample_rate` states equally spaced times",
            );
        }
        let count = self.excess();
        let repeat = if count == 1 {
            "row repeats"
        } else {
            "rows repeat"
        };
        error.hint(format!(
            "`duplicates: first` keeps the first row of each time, `duplicates: mean` the mean; {count} {repeat} a time: {}",
            lines_in_words(&self.lines(table, LISTED), count)
        ))
    }
}

/// `line 14`, or `lines 14, 20, 31 and 5 more` of `count` lines.
pub fn lines_in_words(lines: &[usize], count: usize) -> String {
    let list: Vec<String> = lines.iter().take(LISTED).map(usize::to_string).collect();
    let more = count.saturating_sub(list.len());
    match (list.as_slice(), more) {
        ([line], 0) => format!("line {line}"),
        (_, 0) => format!("lines {}", list.join(", ")),
        _ => format!("lines {} and {more} more", list.join(", ")),
    }
}

fn mean(values: &[f64]) -> f64 {
    let present = values.iter().filter(|v| !v.is_nan());
    let count = present.clone().count();
    // A group without a value is a missing sample.
    present.sum::<f64>() / count as f64
}

/// Rows of increasing times that repeat.
///
/// Rows that are equal in every numeric column are merged under each setting; others need `duplicates`.
///
/// # Errors
/// When a time is less than the one before, or a time repeats with other values and `duplicates` is [`Duplicates::Error`].
pub fn repeated_times(
    table: &Table,
    index: usize,
    duplicates: Duplicates,
) -> Result<RepeatedTimes, InputError> {
    let times = table.values(index)?;
    if let Some(row) = times.windows(2).position(|pair| pair[1] < pair[0]) {
        let error = not_increasing(table, &table.label(index), times, row + 1);
        let here = table.row_in_words(row + 1);
        return Err(error.hint(format!(
            "if the clock restarted there, write the rows from {here} to a file of their own: a second experiment"
        )));
    }
    let mut groups = Vec::new();
    let mut row = 0;
    for same in times.chunk_by(|a, b| a == b) {
        if same.len() > 1 {
            groups.push(row..row + same.len());
        }
        row += same.len();
    }
    let are_equal = groups.iter().all(|rows: &Range<usize>| {
        let mut later = rows.start + 1..rows.end;
        later.all(|row| table.agree(rows.start, row))
    });
    let found = RepeatedTimes { groups, are_equal };
    match are_equal || duplicates != Duplicates::Error {
        true => Ok(found),
        false => Err(found.refused(table, index, times)),
    }
}

impl Table {
    /// True if two rows have the same numbers, or none, in every column of numbers.
    fn agree(&self, one: usize, other: usize) -> bool {
        self.columns.iter().all(|column| {
            match (column.samples.get(one), column.samples.get(other)) {
                (Some(a), Some(b)) => a == b || (a.is_nan() && b.is_nan()),
                // A column of text.
                _ => true,
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(rows: &str) -> Table {
        Table::parse("t.csv", format!("t,y,z\n{rows}").as_bytes()).unwrap()
    }

    #[test]
    fn equal_rows_are_merged_under_each_setting() {
        let table = table("0,1,2\n1,3,4\n1,3,4\n1,3,4\n2,5,\n2,5,\n3,7,8\n");
        for duplicates in [Duplicates::Error, Duplicates::First, Duplicates::Mean] {
            let found = repeated_times(&table, 0, duplicates).unwrap();
            assert!(found.are_equal);
            assert_eq!((found.excess(), found.lines(&table, 9)), (3, vec![4, 5, 7]));
            let times = found.merged(table.values(0).unwrap(), duplicates);
            assert_eq!(*times, [0.0, 1.0, 2.0, 3.0]);
            assert_eq!(
                *found.merged(table.values(1).unwrap(), duplicates),
                [1.0, 3.0, 5.0, 7.0]
            );
        }
    }

    #[test]
    fn other_rows_need_a_setting() {
        let table = table("0,1,2\n1,3,4\n1,5,\n2,5,6\n");
        let error = repeated_times(&table, 0, Duplicates::Error).unwrap_err();
        assert!(
            error
                .hint
                .unwrap()
                .ends_with("1 row repeats a time: line 4")
        );
        let column = |duplicates, index: usize| {
            let found = repeated_times(&table, 0, duplicates).unwrap();
            found
                .merged(table.samples(index).unwrap(), duplicates)
                .into_owned()
        };
        assert_eq!(column(Duplicates::First, 1), [1.0, 3.0, 5.0]);
        assert_eq!(column(Duplicates::Mean, 1), [1.0, 4.0, 5.0]);
        assert_eq!(column(Duplicates::Mean, 2), [2.0, 4.0, 6.0]);
    }

    #[test]
    fn a_clock_that_restarts_and_rounded_times_have_their_hints() {
        let restarted = repeated_times(&table("0,1,2\n1,3,4\n0,5,6\n"), 0, Duplicates::Mean);
        assert!(
            restarted
                .unwrap_err()
                .hint
                .unwrap()
                .contains("from line 4 to a file of their own")
        );
        let rounded = table("0,1,2\n0,3,4\n0,5,6\n0,7,6\n1,5,6\n");
        let error = repeated_times(&rounded, 0, Duplicates::Error).unwrap_err();
        assert!(error.hint.unwrap().contains("`sample_rate`"));
    }
}
