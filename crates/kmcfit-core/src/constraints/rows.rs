//! Sparse rows with a right-hand side, built one after the other.

/// Rows `a_i^T z` with right-hand sides `b_i`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    starts: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    right: Vec<f64>,
}

impl Rows {
    /// No rows.
    pub fn new() -> Self {
        Self {
            starts: vec![0],
            ..Self::default()
        }
    }

    /// Adds the row with these entries (columns may repeat; they add up) and right-hand side.
    pub fn push(&mut self, entries: impl IntoIterator<Item = (usize, f64)>, right: f64) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        let first = self.columns.len();
        // Rows usually come with rising columns; only others have to be searched.
        let mut highest = None;
        for (column, value) in entries {
            let known = if highest.is_none_or(|h| column > h) {
                highest = Some(column);
                None
            } else {
                self.columns[first..].iter().position(|c| *c == column)
            };
            match known {
                Some(k) => self.values[first + k] += value,
                None => {
                    self.columns.push(column);
                    self.values.push(value);
                }
            }
        }
        self.starts.push(self.columns.len());
        self.right.push(right);
    }

    /// Makes room for so many further rows and entries.
    pub fn reserve(&mut self, rows: usize, entries: usize) {
        self.starts.reserve(rows + 1);
        self.right.reserve(rows);
        self.columns.reserve(entries);
        self.values.reserve(entries);
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.right.len()
    }

    /// One more than the largest column of an entry.
    pub fn width(&self) -> usize {
        self.columns.iter().max().map_or(0, |j| j + 1)
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.right.is_empty()
    }

    /// Entries of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[i]..self.starts[i + 1];
        let columns = self.columns[range.clone()].iter().copied();
        columns.zip(self.values[range].iter().copied())
    }

    /// Right-hand sides.
    pub fn right(&self) -> &[f64] {
        &self.right
    }

    /// Sets all right-hand sides to zero.
    pub fn clear_right(&mut self) {
        self.right.fill(0.0);
    }

    /// `a_i^T z` for all rows.
    pub fn multiply(&self, z: &[f64]) -> Vec<f64> {
        (0..self.len())
            .map(|i| self.row(i).map(|(j, a)| a * z[j]).sum())
            .collect()
    }

    /// Multiplies every column by its factor.
    pub fn scale_columns(&mut self, factors: &[f64]) {
        for (column, value) in self.columns.iter().zip(&mut self.values) {
            *value *= factors[*column];
        }
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.values.len()
    }

    /// Largest size of an entry of row `i`; 0 for an empty row.
    pub fn scale(&self, i: usize) -> f64 {
        self.row(i).fold(0.0, |most, (_, a)| most.max(a.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rows over three columns, by hand.
    fn rows() -> Rows {
        let mut rows = Rows::new();
        rows.push([(0, 1.0), (2, -2.0)], 5.0);
        rows.push([(1, 4.0)], 6.0);
        rows
    }

    #[test]
    fn products_by_hand() {
        assert_eq!(rows().multiply(&[1.0, 10.0, 100.0]), [-199.0, 40.0]);
    }

    /// What is scaled in its columns says of `z` what the rows said of `factors * z`.
    #[test]
    fn scaled_columns() {
        let mut scaled = rows();
        scaled.scale_columns(&[2.0, 0.5, -3.0]);
        let z = [1.5, -2.0, 0.25];
        assert_eq!(
            scaled.multiply(&z),
            rows().multiply(&[3.0, -1.0, -0.75]),
            "{z:?}"
        );
        assert_eq!(scaled.right(), rows().right());
        assert_eq!(scaled.scale(0), 6.0);
    }
}
