//! Sparse rows of the stages, in time order.

/// Rows `a' xi_i` of the stages, each with a right-hand side; `xi_i = (x_i, u_i)` are the coordinates of stage `i`.
#[derive(Debug, Clone, Default)]
pub(super) struct StageRows {
    /// First row of each stage, and the number of rows.
    stages: Vec<u32>,
    /// First entry of each row, and the number of entries.
    rows: Vec<u32>,
    columns: Vec<u8>,
    values: Vec<f64>,
    /// Right-hand sides.
    pub right: Vec<f64>,
}

/// A row before it is put into time order.
pub(super) struct LooseRow {
    pub stage: usize,
    pub entries: Vec<(u8, f64)>,
    pub right: f64,
}

impl StageRows {
    /// The rows in time order, and the position among `loose` of each.
    pub fn in_order(loose: &[LooseRow], stages: usize) -> (Self, Vec<u32>) {
        let mut order: Vec<u32> = (0..loose.len() as u32).collect();
        // Stable: rows of a stage keep their order.
        order.sort_by_key(|i| loose[*i as usize].stage);
        let mut rows = Self {
            rows: vec![0],
            ..Self::default()
        };
        for (count, i) in order.iter().enumerate() {
            let row = &loose[*i as usize];
            rows.stages.resize(row.stage + 1, count as u32);
            for (column, value) in &row.entries {
                rows.columns.push(*column);
                rows.values.push(*value);
            }
            rows.rows.push(rows.columns.len() as u32);
            rows.right.push(row.right);
        }
        rows.stages.resize(stages + 1, loose.len() as u32);
        (rows, order)
    }

    pub fn len(&self) -> usize {
        self.right.len()
    }

    #[inline(always)]
    pub fn of_stage(&self, i: usize) -> std::ops::Range<usize> {
        self.stages[i] as usize..self.stages[i + 1] as usize
    }

    /// Columns and values of a row.
    #[inline(always)]
    pub fn row(&self, row: usize) -> (&[u8], &[f64]) {
        let range = self.rows[row] as usize..self.rows[row + 1] as usize;
        (&self.columns[range.clone()], &self.values[range])
    }

    /// The same rows with values of zero.
    pub fn zero(&self) -> Self {
        Self {
            values: vec![0.0; self.values.len()],
            ..self.clone()
        }
    }

    /// Values of a row.
    pub fn values_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.values[self.rows[row] as usize..self.rows[row + 1] as usize]
    }

    /// `a' xi` of a row of its stage.
    #[inline(always)]
    pub fn product<const W: usize>(&self, row: usize, xi: &[f64; W]) -> f64 {
        let (columns, values) = self.row(row);
        let mut sum = 0.0;
        for (column, value) in columns.iter().zip(values) {
            sum += value * xi[usize::from(*column) % W];
        }
        sum
    }

    /// `a' xi` of all rows.
    pub fn products<const W: usize>(&self, xi: &[[f64; W]], out: &mut Vec<f64>) {
        out.clear();
        for (i, xi) in xi.iter().enumerate() {
            for row in self.of_stage(i) {
                out.push(self.product(row, xi));
            }
        }
    }

    /// Adds `factor a` of a row.
    #[inline(always)]
    pub fn add_multiple<const W: usize>(&self, row: usize, factor: f64, out: &mut [f64; W]) {
        let (columns, values) = self.row(row);
        for (column, value) in columns.iter().zip(values) {
            out[usize::from(*column) % W] += factor * value;
        }
    }

    /// Adds `sum_j factor_j a_j` to the gradient of each stage.
    pub fn transpose_add<const W: usize>(&self, factors: &[f64], gradient: &mut [[f64; W]]) {
        for (i, gradient) in gradient.iter_mut().enumerate() {
            for row in self.of_stage(i) {
                self.add_multiple(row, factors[row], gradient);
            }
        }
    }
}
