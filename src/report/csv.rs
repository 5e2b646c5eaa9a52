//! CSV output: a header with units, one row per node or iteration, numbers with the shortest digits that parse to the
//! same bits.

use std::ops::Range;

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

    /// The text of the file. Fields of values that are not finite are empty.
    pub fn to_csv(&self) -> String {
        let rows = self.columns.iter().map(Vec::len).max().unwrap_or(0);
        let mut text = self.headers.join(",");
        // One reservation avoids repeated reallocation of a growing text.
        text.reserve(DIGITS * rows * self.columns.len());
        text.push('\n');
        // Bits and place of the number before in each column: constant functions repeat theirs.
        let mut before = vec![(f64::NAN.to_bits(), 0..0); self.columns.len()];
        for row in 0..rows {
            for (j, (column, (bits, position))) in self.columns.iter().zip(&mut before).enumerate()
            {
                if j > 0 {
                    text.push(',');
                }
                let Some(&value) = column.get(row) else {
                    continue;
                };
                if value.to_bits() == *bits {
                    text.extend_from_within(position.clone());
                    continue;
                }
                let start = text.len();
                push_number(&mut text, value);
                (*bits, *position) = (value.to_bits(), start..text.len());
            }
            text.push('\n');
        }
        text
    }
}

/// Longest number with its comma, bytes.
const DIGITS: usize = 21;

/// Range of numbers that `zmij` writes without an exponent although they are shorter with one.
const LONG: Range<f64> = 1e15..1e16;

/// Appends the shortest decimal that parses to the same number, with an exponent if that is shorter.
fn push_number(text: &mut String, value: f64) {
    if !value.is_finite() {
        return;
    }
    if LONG.contains(&value.abs()) {
        text.push_str(&format!("{value:e}"));
        return;
    }
    let mut buffer = zmij::Buffer::new();
    let digits = buffer.format_finite(value);
    // Large numbers alone have an exponent with a sign that is left out.
    let large = value.abs() >= LONG.end;
    match large.then(|| digits.split_once("e+")).flatten() {
        Some((digits, exponent)) => text.extend([digits, "e", exponent]),
        None => text.push_str(match digits.as_bytes() {
            [.., b'.', b'0'] => &digits[..digits.len() - 2],
            _ => digits,
        }),
    }
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

    /// Numbers are as short as those of the slower standard library.
    #[test]
    fn numbers_have_the_shortest_digits() {
        let mut bits = 1u64;
        let mut values: Vec<f64> = (-320..308).map(|n| 10f64.powi(n)).collect();
        values.extend((0..20_000).map(|_| {
            // A full-period generator of Knuth's.
            bits = bits
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            f64::from_bits(bits)
        }));
        let near: Vec<f64> = values.iter().map(|x| (x % 1e17) * 1e-3).collect();
        for value in values
            .into_iter()
            .chain(near)
            .flat_map(|x| [x, -x, x.next_up()])
        {
            let mut text = String::new();
            push_number(&mut text, value);
            let size = value.abs();
            let expected = match () {
                () if !value.is_finite() => String::new(),
                () if size != 0.0 && !(1e-5..1e15).contains(&size) => format!("{value:e}"),
                () => format!("{value}"),
            };
            // Of two equally near ones either may be taken.
            assert_eq!(text.len(), expected.len(), "{text} {expected}");
            if value.is_finite() {
                assert_eq!(text.parse::<f64>().map(f64::to_bits), Ok(value.to_bits()));
            }
        }
    }

    /// Numbers that repeat the one before, in columns of different length.
    #[test]
    fn repeated_numbers_have_their_digits_in_each_row() {
        let text = CsvTable::new()
            .column("a", vec![0.1, 0.1, f64::NAN, 0.1, -0.0, 0.0])
            .column("b", vec![2.5e22, 2.5e22, 2.5e22])
            .to_csv();
        assert_eq!(
            text,
            "a,b\n0.1,2.5e22\n0.1,2.5e22\n,2.5e22\n0.1,\n-0,\n0,\n"
        );
    }

    #[test]
    fn values_that_are_not_finite_are_empty() {
        let text = CsvTable::new()
            .column("a", vec![f64::NAN])
            .column("b", vec![1.0])
            .to_csv();
        assert_eq!(text, "a,b\n,1\n");
    }
}
