//! The axis along which the estimates of a fleet are shown.

use super::records::RecordList;
use crate::error::InputError;
use crate::spelling::nearest;
use crate::text_io::{one_of, quote};

/// Days of a year.
const YEAR: f64 = 365.25;

/// An axis along which the estimates are shown: a column of the table of records, or their order.
pub struct Trend {
    /// Name.
    pub name: String,
    /// Unit; empty for none.
    pub unit: String,
    /// Value of each record; NaN where the cell is empty or no number.
    pub values: Vec<f64>,
}

impl Trend {
    /// The column `wanted`, else the column `date` or the first one of numbers or dates, else the order of the records. `None` where there
    /// is no column of the name wanted.
    pub fn of(list: &RecordList, wanted: Option<&str>) -> Option<Self> {
        let column = |index: usize| {
            let cells = list
                .records
                .iter()
                .map(|record| record.columns[index].as_str());
            Self::of_cells(&list.columns[index], cells)
        };
        let position = |name: &str| list.columns.iter().position(|column| column == name);
        if let Some(wanted) = wanted {
            return column(position(wanted)?);
        }
        let first = position("date").and_then(column);
        let any = || (0..list.columns.len()).find_map(column);
        first.or_else(any).or_else(|| {
            Some(Self {
                name: "record".into(),
                unit: String::new(),
                values: (1..=list.records.len()).map(|i| i as f64).collect(),
            })
        })
    }

    /// [`Trend::of`] for the column that an argument names.
    ///
    /// # Errors
    /// If there is no such column, or it holds neither numbers nor dates.
    pub fn named(list: &RecordList, wanted: Option<&str>) -> Result<Self, InputError> {
        let name = wanted.unwrap_or_default();
        let known = || list.columns.iter().map(String::as_str);
        Self::of(list, wanted).ok_or_else(|| match known().any(|column| column == name) {
            true => InputError::argument("--trend", "the column holds neither numbers nor dates")
                .found(quote(name))
                .expected("a column of which at least half of the cells are numbers, or dates such as 2026-03-02"),
            false => InputError::argument("--trend", "no such column")
                .found(quote(name))
                .expected(match list.columns.is_empty() {
                    true => "a table of records with further columns".to_owned(),
                    false => one_of(known()),
                })
                .hint_if(nearest(name, known()).map(|near| format!("did you mean `{near}`?"))),
        })
    }

    /// The unit of the axis as a noun: `year`, or the name of the column.
    pub fn step(&self) -> &str {
        match self.unit.is_empty() {
            true => &self.name,
            false => &self.unit,
        }
    }

    /// A column of which at least half of the cells are numbers, or dates such as 2026-03-02.
    fn of_cells<'a>(name: &str, cells: impl Iterator<Item = &'a str> + Clone) -> Option<Self> {
        let count = cells.clone().count();
        let is_most = |values: &[f64]| 2 * values.iter().filter(|x| x.is_finite()).count() >= count;
        let numbers: Vec<f64> = cells
            .clone()
            .map(|cell| cell.parse().unwrap_or(f64::NAN))
            .collect();
        if is_most(&numbers) {
            return Some(Self {
                name: name.to_owned(),
                unit: String::new(),
                values: numbers,
            });
        }
        let years: Vec<f64> = cells.map(|cell| year(cell).unwrap_or(f64::NAN)).collect();
        is_most(&years).then(|| Self {
            name: name.to_owned(),
            unit: "year".to_owned(),
            values: years,
        })
    }
}

/// A date such as `2026-03-02` or `2026-03-02T12:30` as a year with its fraction.
fn year(text: &str) -> Option<f64> {
    let mut parts = text.get(..10)?.split('-');
    let mut next = || parts.next()?.parse::<i64>().ok();
    let (year, month, day) = (next()?, next()?, next()?);
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    let before = [0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334];
    let days = before[month as usize - 1] + day - 1;
    let hours = text.get(11..16).and_then(|time| {
        let (hour, minute) = time.split_once(':')?;
        Some(hour.parse::<f64>().ok()? + minute.parse::<f64>().ok()? / 60.0)
    });
    Some(year as f64 + (days as f64 + hours.unwrap_or(0.0) / 24.0) / YEAR)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_years_with_fractions() {
        assert_eq!(year("2026-01-01"), Some(2026.0));
        assert_eq!(year("2026-02-01T12:00"), Some(2026.0 + 31.5 / YEAR));
        assert_eq!(year("2026-13-01"), None);
        assert_eq!(year("yesterday!"), None);
    }
}
