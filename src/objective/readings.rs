//! Measured displacements and their misfit.

/// How residuals are weighed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weighting {
    /// `J = integral r^2 dt` by the trapezoid rule over the readings (Eq. 1), in m^2 s.
    Integral {
        /// Spacing of the readings, s.
        spacing: f64,
    },
    /// `J = sum (r / sigma)^2`: chi-square, without a factor 1/2 and without `dt`.
    Sigma(
        /// Standard deviation of a reading, m.
        f64,
    ),
}

/// Displacements measured at every `stride`-th node, the first at the first node.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    values: Vec<f64>,
    stride: usize,
    weighting: Weighting,
}

impl Readings {
    /// Readings `values` (m) at the nodes `0, stride, 2 stride, ...`.
    ///
    /// # Panics
    /// If `stride` is zero.
    pub fn new(values: Vec<f64>, stride: usize, weighting: Weighting) -> Self {
        assert!(stride > 0, "readings advance");
        Self {
            values,
            stride,
            weighting,
        }
    }

    /// Keeps the first `count` readings.
    pub fn truncate(&mut self, count: usize) {
        self.values.truncate(count);
    }

    /// The measured displacements, m.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Nodes from one reading to the next.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// How residuals are weighed.
    pub fn weighting(&self) -> Weighting {
        self.weighting
    }

    /// Residuals `r = y - y_obs`, m, one per reading.
    pub fn residuals<'a>(&'a self, displacement: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        let model = displacement.iter().step_by(self.stride);
        model.zip(&self.values).map(|(y, observed)| y - observed)
    }

    /// The misfit of the motion, in the unit of its [`Weighting`].
    ///
    /// The sum runs in the paper's order, both ends first: its run depends on every bit.
    pub fn cost(&self, displacement: &[f64]) -> f64 {
        match self.weighting {
            Weighting::Integral { spacing } => {
                let square = |i: usize| {
                    let r = displacement[i * self.stride] - self.values[i];
                    r * r
                };
                let last = self.values.len() - 1;
                let ends = spacing * 0.5 * (square(0) + square(last));
                (1..last).fold(ends, |sum, i| sum + spacing * 0.5 * (2.0 * square(i)))
            }
            Weighting::Sigma(sigma) => self
                .residuals(displacement)
                .map(|r| (r / sigma) * (r / sigma))
                .sum(),
        }
    }

    /// `cost(to) - cost(from)`, as `sum w (y' - y) (y' + y - 2 y_obs)`: where the motions are close,
    /// the difference of two rounded costs would be lost in their rounding.
    pub fn cost_difference(&self, from: &[f64], to: &[f64]) -> f64 {
        let pairs = from.iter().zip(to).step_by(self.stride);
        let terms = pairs.zip(&self.values).enumerate();
        terms
            .map(|(i, ((y, moved), observed))| {
                self.weight(i) * (moved - y) * ((moved - observed) + (y - observed))
            })
            .sum()
    }

    /// Weight `w_i` of reading `i`, so that `J = sum w_i r_i^2`.
    pub fn weight(&self, i: usize) -> f64 {
        match self.weighting {
            Weighting::Integral { spacing } if i == 0 || i + 1 == self.values.len() => {
                0.5 * spacing
            }
            Weighting::Integral { spacing } => spacing,
            Weighting::Sigma(sigma) => 1.0 / (sigma * sigma),
        }
    }

    /// `dJ/dy = 2 w r` at every node; zero at nodes without a reading.
    pub fn source(&self, displacement: &[f64]) -> Vec<f64> {
        let mut source = vec![0.0; displacement.len()];
        for (i, r) in self.residuals(displacement).enumerate() {
            source[i * self.stride] = 2.0 * self.weight(i) * r;
        }
        source
    }
}
