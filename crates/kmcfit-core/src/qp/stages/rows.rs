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

/// Rows before they are put into time order.
#[derive(Default)]
pub(super) struct UnorderedRows {
    stages: Vec<u32>,
    /// End of the entries of each row.
    ends: Vec<u32>,
    columns: Vec<u8>,
    values: Vec<f64>,
    right: Vec<f64>,
}

impl UnorderedRows {
    /// Adds a row of a stage with the coefficients `xi` that `is_entry` chooses, times `factor`.
    pub fn push<const W: usize>(
        &mut self,
        stage: usize,
        xi: &[f64; W],
        factor: f64,
        right: f64,
        is_entry: impl Fn(usize) -> bool,
    ) {
        for (j, a) in xi.iter().enumerate() {
            if is_entry(j) {
                self.columns.push(j as u8);
                self.values.push(factor * a);
            }
        }
        self.stages.push(stage as u32);
        self.ends.push(self.columns.len() as u32);
        self.right.push(right);
    }

    pub fn len(&self) -> usize {
        self.stages.len()
    }

    /// The rows in time order, those of a stage in the order in which they were added, and the position of each before.
    pub fn in_order(&self, stages: usize) -> (StageRows, Vec<u32>) {
        let mut first = vec![0; stages + 1];
        for stage in &self.stages {
            first[*stage as usize + 1] += 1;
        }
        for i in 0..stages {
            first[i + 1] += first[i];
        }
        let mut next = first.clone();
        let mut order = vec![0; self.len()];
        for (row, stage) in self.stages.iter().enumerate() {
            let position = &mut next[*stage as usize];
            order[*position as usize] = row as u32;
            *position += 1;
        }
        let mut rows = StageRows {
            stages: first,
            rows: Vec::with_capacity(self.len() + 1),
            columns: Vec::with_capacity(self.columns.len()),
            values: Vec::with_capacity(self.values.len()),
            right: Vec::with_capacity(self.len()),
        };
        rows.rows.push(0);
        for row in &order {
            let row = *row as usize;
            let start = if row == 0 { 0 } else { self.ends[row - 1] };
            let entries = start as usize..self.ends[row] as usize;
            rows.columns
                .extend_from_slice(&self.columns[entries.clone()]);
            rows.values.extend_from_slice(&self.values[entries]);
            rows.rows.push(rows.columns.len() as u32);
            rows.right.push(self.right[row]);
        }
        (rows, order)
    }
}

impl StageRows {
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
