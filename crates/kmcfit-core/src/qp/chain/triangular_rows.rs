//! Triangular factor: one row per variable, in the order of elimination.

/// Rows that determine a variable from those eliminated later.
#[derive(Debug, Clone)]
pub struct TriangularRows {
    variables: usize,
    sides: usize,
    positions: Vec<u32>,
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
    pivots: Vec<f64>,
    right: Vec<f64>,
    /// True for the rows of equalities.
    exact: Vec<bool>,
}

impl TriangularRows {
    /// An empty factor for `variables` variables and `sides` right-hand sides.
    pub fn new(variables: usize, sides: usize) -> Self {
        Self {
            variables,
            sides,
            positions: Vec::with_capacity(variables),
            starts: vec![0],
            columns: Vec::new(),
            values: Vec::new(),
            pivots: Vec::with_capacity(variables),
            right: Vec::with_capacity(variables * sides),
            exact: Vec::with_capacity(variables),
        }
    }

    /// Appends the `row`, of an equality or of residuals, that determines the variable in column `pivot`; `columns` are the places of all
    /// columns, followed by the right-hand sides.
    pub fn push(&mut self, pivot: usize, columns: &[u32], row: &[f64], is_exact: bool) {
        self.exact.push(is_exact);
        self.positions.push(columns[pivot]);
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

    /// True for the row of an equality.
    pub fn is_exact(&self, i: usize) -> bool {
        self.exact[i]
    }

    /// VariableRole of the variable that row `i` determines, its coefficient, and places and coefficients of the others.
    pub fn row(&self, i: usize) -> (u32, f64, impl Iterator<Item = (u32, f64)> + '_) {
        let range = self.starts[i]..self.starts[i + 1];
        let columns = self.columns[range.clone()].iter().copied();
        let others = columns.zip(self.values[range].iter().copied());
        (self.positions[i], self.pivots[i], others)
    }

    /// Back substitution for one right-hand side; variables by place.
    pub fn substitute(&self, side: usize) -> Vec<f64> {
        self.substituted(|i| self.right[i * self.sides + side])
    }

    /// Back substitution for the right-hand side `right`, one entry for each row; variables by place.
    pub fn substitute_right(&self, right: &[f64]) -> Vec<f64> {
        self.substituted(|i| right[i])
    }

    fn substituted(&self, right: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut z = vec![0.0; self.variables];
        for i in (0..self.positions.len()).rev() {
            let (position, pivot, others) = self.row(i);
            let known: f64 = others.map(|(j, a)| a * z[j as usize]).sum();
            z[position as usize] = (right(i) - known) / pivot;
        }
        z
    }

    /// Solution `y` of `R^T y = g`, one entry for each row, with the `entries` of `g` by place.
    pub fn substitute_transposed(&self, entries: impl Iterator<Item = (usize, f64)>) -> Vec<f64> {
        let mut remaining = vec![0.0; self.variables];
        entries.for_each(|(position, a)| remaining[position] += a);
        let mut y = Vec::with_capacity(self.positions.len());
        for i in 0..self.positions.len() {
            let (position, pivot, others) = self.row(i);
            let value = remaining[position as usize] / pivot;
            if value != 0.0 {
                others.for_each(|(j, a)| remaining[j as usize] -= a * value);
            }
            y.push(value);
        }
        y
    }
}
