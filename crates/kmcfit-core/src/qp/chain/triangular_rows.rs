//! The triangular factor: one row for each variable, in the order of elimination.

/// Rows that give a variable from those that are eliminated later.
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
    /// No rows yet, for so many variables and right-hand sides.
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

    /// Adds the `row` that gives the variable in its `pivot`-th column; `columns` are the places of all,
    /// and the right-hand sides follow them.
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

    /// The variables by place for one right-hand side, from the last to the first.
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
