//! The axis along which the estimates of a fleet are shown.

use super::records::RecordList;
use crate::error::InputError;
use crate::spelling::nearest;
use crate::text_io::{one_of, quote};

/// An axis along which the estimates are shown: a column of the table of records, or their order.
pub struct Trend {
    /// Name.
    pub name: String,
    /// Value of each record; NaN where the cell is empty or no number.
    pub values: Vec<f64>,
}

impl Trend {
    /// The column that an argument names, or the order of the records.
    ///
    /// # Errors
    /// If there is no such column, or fewer than half of its cells are numbers.
    pub fn of(list: &RecordList, wanted: Option<&str>) -> Result<Self, InputError> {
        let Some(name) = wanted else {
            return Ok(Self {
                name: "record".into(),
                values: (1..=list.records.len()).map(|i| i as f64).collect(),
            });
        };
        let known = || list.columns.iter().map(String::as_str);
        let wrong = |problem| InputError::argument("--trend", problem).found(quote(name));
        let Some(index) = known().position(|column| column == name) else {
            return Err(wrong("no such column")
                .expected(format!(
                    "a further column of the table: {}",
                    one_of(known())
                ))
                .hint_if(nearest(name, known()).map(|near| format!("did you mean `{near}`?"))));
        };
        let cells = list.records.iter().map(|record| &record.columns[index]);
        let values: Vec<f64> = cells.map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
        match 2 * values.iter().filter(|x| x.is_finite()).count() >= values.len() {
            true => Ok(Self {
                name: name.to_owned(),
                values,
            }),
            false => Err(wrong("the column holds no numbers")
                .expected("a column of which at least half of the cells are numbers")),
        }
    }
}
