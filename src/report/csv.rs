//! Tables as CSV: a header with units, one row per node or iteration, numbers that read back to the
//! same bits.

use std::fmt::Write;

/// A table to be written: named columns of equal length.
#[derive(Debug, Default)]
pub struct CsvTable {
    headers: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl CsvTable {
    /// An empty table.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a column.
    #[must_use]
    pub fn column(mut self, header: impl Into<String>, values: Vec<f64>) -> Self {
        self.headers.push(header.into());
        self.columns.push(values);
        self
    }

    /// The file's text. Values that are not finite are left empty.
    pub fn to_csv(&self) -> String {
        let rows = self.columns.iter().map(Vec::len).max().unwrap_or(0);
        let mut text = self.headers.join(",");
        // At once: a text that grows leaves its smaller selves behind in memory that costs time to get.
        text.reserve(DIGITS * rows * self.columns.len());
        text.push('\n');
        for row in 0..rows {
            for (j, column) in self.columns.iter().enumerate() {
                if j > 0 {
                    text.push(',');
                }
                if let Some(value) = column.get(row) {
                    push_number(&mut text, *value);
                }
            }
            text.push('\n');
        }
        text
    }
}

/// Room for a number and its comma.
const DIGITS: usize = 21;

/// Appends the shortest decimal that reads back as the same number; with an exponent where that is
/// shorter to read.
fn push_number(text: &mut String, value: f64) {
    let size = value.abs();
    // Writing to a String cannot fail.
    let _ = match size {
        _ if !value.is_finite() => Ok(()),
        _ if size != 0.0 && !(1e-5..1e15).contains(&size) => write!(text, "{value:e}"),
        _ => write!(text, "{value}"),
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_to_the_same_bits() {
        let values = vec![
            0.1 + 0.2,
            1e-300,
            -2.5e22,
            0.0,
            1.0,
            f64::MIN_POSITIVE,
            25.0 / 1999.0,
        ];
        let text = CsvTable::new().column("x", values.clone()).to_csv();
        let read: Vec<f64> = text.lines().skip(1).map(|l| l.parse().unwrap()).collect();
        let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read), bits(&values));
    }

    #[test]
    fn what_is_not_finite_is_empty() {
        let text = CsvTable::new()
            .column("a", vec![f64::NAN])
            .column("b", vec![1.0])
            .to_csv();
        assert_eq!(text, "a,b\n,1\n");
    }
}
