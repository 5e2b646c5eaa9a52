//! Triangular factor: one row per variable, in the order of elimination.

/// Rows that determine a variable from those eliminated later.
pub struct TriangularRows {
    variables: usize,
    sides: usize,
    places: Vec<u32>,
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
    pivots: Vec<f64>,
    right: Vec<f64>,
}

impl TriangularRows {
    /// An empty factor for `variables` variables and `sides` right-hand sides.
    pub fn new(variables: usize, sides: usize) -> Self {
        Self {
            variables,
            sides,
            places: Vec::with_capacity(variables),
            starts: vec![0],
            columns: Vec::new(),
            values: Vec::new(),
            pivots: Vec::with_capacity(variables),
            right: Vec::with_capacity(variables * sides),
        }
    }

    /// Appends the `row` that determines the variable in column `pivot`; `columns` are the places of all columns, followed by the
    /// right-hand sides.
    pub fn push(&mut self, pivot: usize, columns: &[u32], row: &[f64]) {
        self.places.push(columns[pivot]);
        self.pivots.push(row[pivot]);
        for (k, (column, a)) in columns.iter().zip(row).enumerate() {
            if *a != 0.0 && k != pivot {
                self.columns.push(*column);
                self.values.push(*a);
            }
        }
        self.starts.push(self.columns.len());
        self.right.extend_from_slice(&row[columns.len()..]);
    }

    /// Back substitution for one right-hand side; variables by place.
    pub fn substitute(&self, side: usize) -> Vec<f64> {
        let mut z = vec![0.0; self.variables];
        for i in (0..self.places.len()).rev() {
            let range = self.starts[i]..self.starts[i + 1];
            let known = self.columns[range.clone()].iter().zip(&self.values[range]);
            let known: f64 = known.map(|(j, a)| a * z[*j as usize]).sum();
            let right = self.right[i * self.sides + side];
            z[self.places[i] as usize] = (right - known) / self.pivots[i];
        }
        z
    }
}
