//! Errors of an input as they appear in the samples of one channel, and their whitening by a Kalman filter along the record.
//!
//! With the errors `w_k` of the input samples and the noise `v_j` of the channel, independent and of standard deviations in the ratio
//! `rho`, the errors of the samples and their covariance relative to that of the noise are
//!
//! ```text
//! x_i+1 = A_i x_i + l_i e_i + r_i e_i+1,    z_j = h_j (x_i, x_i+1) + d_j e(t_j) + v_j,    R = I + rho^2 G G^T
//! ```
//!
//! with the change `x_i` of displacements and velocities at node `i`, the error `e_i` of the input there and `e(t_j)` at the sample (linear
//! between input samples), and the derivatives `G` of `z` with respect to `w`. The state of the filter is `x_i` and the errors of the input
//! samples on which step `i` depends. It gives `W` with `W R W^T = I` in a time proportional to the number of nodes.
//!
//! Source: R. E. Kalman, J. Basic Eng. 82 (1960) 35-45; F. C. Schweppe, IEEE Trans. Inf. Theory 11 (1965) 61-70 for the likelihood.

use nalgebra::{DMatrix, DVector};

/// Derivatives of the displacements and velocities at the right node of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct InputStep {
    /// With respect to those at the left node.
    pub state: DMatrix<f64>,
    /// With respect to the input at the left and at the right node.
    pub input: [DVector<f64>; 2],
}

/// Derivatives of one sample.
#[derive(Debug, Clone, PartialEq)]
pub struct InputRow {
    /// Step that contains the sample.
    pub step: usize,
    /// With respect to displacements and velocities at the left and at the right node of the step.
    pub states: [DVector<f64>; 2],
    /// With respect to the input at the time of the sample.
    pub input: f64,
    /// Index of the input sample before that time, and the fraction of the way to the next one.
    pub position: (usize, f64),
}

/// The effect of errors of the input on the samples of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct InputErrors {
    /// Standard deviation of the errors of the input samples over that of the noise of the channel.
    ratio: f64,
    /// Number of displacements and velocities, the first ones of the state.
    motions: usize,
    transitions: Vec<Transition>,
    rows: Vec<Row>,
    /// Gains and variances of the innovations of the rows.
    gains: Vec<(DVector<f64>, f64)>,
    /// Index of the first input sample of the first state.
    first: usize,
}

/// From the state at the left node of a step to that of the next step.
#[derive(Debug, Clone, PartialEq)]
struct Transition {
    matrix: DMatrix<f64>,
    /// Index of the first input sample of the next state, and the number of its last ones that are new.
    first: usize,
    entering: usize,
}

#[derive(Debug, Clone, PartialEq)]
struct Row {
    step: usize,
    /// Transposed transition from the row before, and the covariance of what enters for errors of unit variance; `None` within a step.
    advance: Option<(DMatrix<f64>, DMatrix<f64>)>,
    derivatives: DVector<f64>,
}

impl InputErrors {
    /// No errors of the input samples; `positions` are, for each node, the index of the input sample before it and the fraction of the way
    /// to the next one. `rows` are in the order of time.
    ///
    /// # Panics
    /// Unless there is one more place than steps, and at least one step.
    pub fn new(steps: &[InputStep], positions: &[(usize, f64)], rows: &[InputRow]) -> Self {
        assert_eq!(positions.len(), steps.len() + 1, "a place for each node");
        let motions = steps[0].state.nrows();
        let widths = positions.windows(2).map(|pair| pair[1].0 - pair[0].0 + 2);
        let size = motions + widths.max().unwrap_or(2);
        let each = steps.iter().zip(positions.windows(2));
        let transitions: Vec<Transition> = each
            .map(|(step, pair)| transition(step, pair[0], pair[1], size))
            .collect();
        let rows = rows.iter().map(|row| {
            let [left, right] = &row.states;
            let mut derivatives = transitions[row.step].matrix.rows(0, motions).tr_mul(right);
            let mut here = derivatives.rows_mut(0, motions);
            here += left;
            let (k, fraction) = row.position;
            let k = k
                .saturating_sub(positions[row.step].0)
                .min(size - motions - 2);
            derivatives[motions + k] += row.input * (1.0 - fraction);
            derivatives[motions + k + 1] += row.input * fraction;
            Row {
                step: row.step,
                advance: None,
                derivatives,
            }
        });
        let mut errors = Self {
            ratio: 0.0,
            motions,
            gains: vec![(DVector::zeros(size), 1.0); rows.len()],
            rows: rows.collect(),
            transitions,
            first: positions[0].0,
        };
        errors.join(size);
        errors
    }

    /// Joins the transitions between rows, so that the filter takes one step for each sample, whatever the number of nodes.
    fn join(&mut self, size: usize) {
        let mut next = 0;
        for row in self.rows.iter_mut().filter(|row| row.step > 0) {
            if next == row.step {
                continue;
            }
            let mut matrix = DMatrix::identity(size, size);
            let mut covariance = DMatrix::zeros(size, size);
            for step in &self.transitions[next..row.step] {
                matrix = &step.matrix * matrix;
                covariance = &step.matrix * covariance * step.matrix.transpose();
                (size - step.entering..size).for_each(|k| covariance[(k, k)] += 1.0);
            }
            row.advance = Some((matrix.transpose(), covariance));
            next = row.step;
        }
    }

    /// Number of states.
    fn size(&self) -> usize {
        self.transitions[0].matrix.nrows()
    }

    /// The Riccati recursion over the first `count` rows: passes each with its gain and the variance of its innovation to `take`.
    fn each_gain(
        &self,
        ratio: f64,
        count: usize,
        mut take: impl FnMut(usize, &Row, &DVector<f64>, f64),
    ) {
        let size = self.size();
        let variance = ratio * ratio;
        let mut covariance = DMatrix::zeros(size, size);
        (self.motions..size).for_each(|k| covariance[(k, k)] = variance);
        let mut product = DMatrix::zeros(size, size);
        let mut gain = DVector::zeros(size);
        for (j, row) in self.rows.iter().take(count).enumerate() {
            if let Some((transposed, entering)) = &row.advance {
                product.gemm(1.0, &covariance, transposed, 0.0);
                covariance.copy_from(entering);
                covariance.gemm_tr(1.0, transposed, &product, variance);
            }
            gain.gemv(1.0, &covariance, &row.derivatives, 0.0);
            let innovation = 1.0 + row.derivatives.dot(&gain);
            covariance.ger(-1.0 / innovation, &gain, &gain, 1.0);
            gain /= innovation;
            take(j, row, &gain, innovation);
        }
    }

    /// Standard deviation of the errors of the input samples over that of the noise of the channel.
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// The same effect of errors of another standard deviation.
    #[must_use]
    pub fn with_ratio(mut self, ratio: f64) -> Self {
        let mut gains = Vec::with_capacity(self.rows.len());
        self.each_gain(ratio, self.rows.len(), |_, _, gain, variance| {
            gains.push((gain.clone(), variance));
        });
        self.ratio = ratio;
        self.gains = gains;
        self
    }

    /// `values^T R^-1 values` and `log |R|` of the first samples with errors of another standard deviation.
    pub fn likelihood(&self, ratio: f64, values: &[f64]) -> [f64; 2] {
        let mut state = DVector::zeros(self.size());
        let mut sums = [0.0; 2];
        let mut before = state.clone();
        self.each_gain(ratio, values.len(), |j, row, gain, variance| {
            let innovation = values[j] - row.predict(&mut state, &mut before);
            state.axpy(innovation, gain, 1.0);
            sums[0] += innovation * innovation / variance;
            sums[1] += variance.ln();
        });
        sums
    }

    /// The effect on the first `count` samples.
    #[must_use]
    pub fn first(&self, count: usize) -> Self {
        let mut part = self.clone();
        part.rows.truncate(count);
        part.gains.truncate(count);
        part
    }

    /// Passes each row with its prediction, gain and variance to `take`, which returns the innovation.
    fn run(&self, mut take: impl FnMut(usize, f64, f64) -> f64) {
        let mut state = DVector::zeros(self.size());
        let mut before = state.clone();
        for (j, (row, (gain, variance))) in self.rows.iter().zip(&self.gains).enumerate() {
            let predicted = row.predict(&mut state, &mut before);
            state.axpy(take(j, predicted, *variance), gain, 1.0);
        }
    }

    /// `W values`.
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; values.len()];
        self.run(|j, predicted, variance| {
            let innovation = values[j] - predicted;
            out[j] = innovation / variance.sqrt();
            innovation
        });
        out
    }

    /// `W^-1 values`.
    pub fn colour(&self, values: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; values.len()];
        self.run(|j, predicted, variance| {
            let innovation = values[j] * variance.sqrt();
            out[j] = innovation + predicted;
            innovation
        });
        out
    }

    /// `W^T values`.
    pub fn whiten_transpose(&self, values: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; values.len()];
        let mut adjoint = DVector::zeros(self.size());
        let mut later = adjoint.clone();
        let rows = self.rows.iter().zip(&self.gains).enumerate();
        for (j, (row, (gain, variance))) in rows.rev() {
            out[j] = values[j] / variance.sqrt() + gain.dot(&adjoint);
            adjoint.axpy(-out[j], &row.derivatives, 1.0);
            if let Some((transposed, _)) = &row.advance {
                later.gemv(1.0, transposed, &adjoint, 0.0);
                adjoint.copy_from(&later);
            }
        }
        out
    }

    /// `log |R|`.
    pub fn log_determinant(&self) -> f64 {
        self.gains.iter().map(|(_, variance)| variance.ln()).sum()
    }

    /// `G errors`: changes of the samples by errors of the input samples.
    pub fn response(&self, errors: &[f64]) -> Vec<f64> {
        let error = |k: usize| errors.get(k).copied().unwrap_or(0.0);
        let (size, motions) = (self.size(), self.motions);
        let mut state = DVector::zeros(size);
        (motions..size).for_each(|k| state[k] = error(self.first + k - motions));
        let mut out = Vec::with_capacity(self.rows.len());
        for (i, step) in self.transitions.iter().enumerate() {
            let rows = self.rows[out.len()..]
                .iter()
                .take_while(|row| row.step == i);
            out.extend(rows.map(|row| row.derivatives.dot(&state)));
            state = &step.matrix * state;
            let entering = size - step.entering..size;
            entering.for_each(|k| state[k] = error(step.first + k - motions));
        }
        out
    }

    /// Most likely errors of the `count` input samples, `rho^2 G^T R^-1 values`, given the errors `values` of the samples.
    pub fn smoothed(&self, values: &[f64], count: usize) -> Vec<f64> {
        let inverse = self.whiten_transpose(&self.whiten(values));
        let (size, motions) = (self.size(), self.motions);
        let variance = self.ratio * self.ratio;
        let mut errors = vec![0.0; count];
        let mut add = |k: usize, value: f64| {
            if let Some(error) = errors.get_mut(k) {
                *error += variance * value;
            }
        };
        let mut adjoint = DVector::zeros(size);
        let mut last = self.rows.len();
        for (i, step) in self.transitions.iter().enumerate().rev() {
            let entering = size - step.entering..size;
            entering.for_each(|k| add(step.first + k - motions, adjoint[k]));
            adjoint = step.matrix.tr_mul(&adjoint);
            while last > 0 && self.rows[last - 1].step == i {
                last -= 1;
                adjoint.axpy(inverse[last], &self.rows[last].derivatives, 1.0);
            }
        }
        (motions..size).for_each(|k| add(self.first + k - motions, adjoint[k]));
        errors
    }
}

impl Row {
    /// Advances the state of the row before, and returns what it predicts; `before` is space for a state.
    fn predict(&self, state: &mut DVector<f64>, before: &mut DVector<f64>) -> f64 {
        if let Some((transposed, _)) = &self.advance {
            before.copy_from(state);
            state.gemv_tr(1.0, transposed, before, 0.0);
        }
        self.derivatives.dot(state)
    }
}

/// The transition of `size` states over one step, from the place of its left node to that of its right node.
fn transition(step: &InputStep, from: (usize, f64), to: (usize, f64), size: usize) -> Transition {
    let motions = step.state.nrows();
    let entering = to.0 - from.0;
    let mut matrix = DMatrix::zeros(size, size);
    matrix
        .view_mut((0, 0), (motions, motions))
        .copy_from(&step.state);
    for (input, (k, fraction)) in step.input.iter().zip([(0, from.1), (entering, to.1)]) {
        for (k, share) in [(k, 1.0 - fraction), (k + 1, fraction)] {
            let mut column = matrix.column_mut(motions + k);
            column.rows_mut(0, motions).axpy(share, input, 1.0);
        }
    }
    (motions + entering..size).for_each(|k| matrix[(k - entering, k)] = 1.0);
    Transition {
        matrix,
        first: to.0,
        entering,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// `W R W^T = I`, the transpose, the inverse, the determinant, and the most likely errors, against dense matrices, for nodes on every
    /// input sample, several nodes for each input sample, and several input samples for each node, one coordinate and two.
    #[test]
    fn the_filter_is_a_root_of_the_dense_matrix() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for (spacing, motions) in [(1.0, 2), (0.3, 2), (2.5, 2), (0.7, 4), (1.6, 4)] {
            let nodes = 14;
            let mut number = || random.random_range(-1.0..1.0);
            // Decays, so that no sum loses digits.
            let steps: Vec<InputStep> = (1..nodes)
                .map(|_| InputStep {
                    state: DMatrix::from_fn(motions, motions, |_, _| 0.7 * number()),
                    input: [0, 1].map(|_| DVector::from_fn(motions, |_, _| number())),
                })
                .collect();
            let position = |x: f64| ((spacing * x).floor() as usize, (spacing * x).fract());
            let positions: Vec<(usize, f64)> = (0..nodes).map(|i| position(i as f64)).collect();
            let rows: Vec<InputRow> = (0..20)
                .map(|j| {
                    let step = (j * (nodes - 1)) / 20;
                    InputRow {
                        step,
                        states: [0, 1].map(|_| DVector::from_fn(motions, |_, _| number())),
                        input: number(),
                        position: position(step as f64 + 0.05 * (j % 20) as f64),
                    }
                })
                .collect();
            let errors = InputErrors::new(&steps, &positions, &rows).with_ratio(0.7);
            let inputs = positions[nodes - 1].0 + 2;
            // The definition, without a filter.
            let mut g = DMatrix::zeros(rows.len(), inputs);
            for k in 0..inputs {
                let at = |(before, fraction): (usize, f64)| match k.checked_sub(before) {
                    Some(0) => 1.0 - fraction,
                    Some(1) => fraction,
                    _ => 0.0,
                };
                let mut states = vec![DVector::zeros(motions)];
                for (i, step) in steps.iter().enumerate() {
                    let [left, right] = &step.input;
                    let next = &step.state * &states[i]
                        + left * at(positions[i])
                        + right * at(positions[i + 1]);
                    states.push(next);
                }
                for (j, row) in rows.iter().enumerate() {
                    let [left, right] = &row.states;
                    g[(j, k)] = left.dot(&states[row.step])
                        + right.dot(&states[row.step + 1])
                        + row.input * at(row.position);
                }
            }
            let r = DMatrix::identity(20, 20) + 0.49 * &g * g.transpose();
            let mut w = DMatrix::zeros(20, 20);
            for j in 0..20 {
                let mut unit = vec![0.0; 20];
                unit[j] = 1.0;
                w.set_column(j, &errors.whiten(&unit).into());
            }
            let off = (&w * &r * w.transpose() - DMatrix::identity(20, 20)).amax();
            assert!(off < 1e-10, "{spacing}: {off}");
            let determinant = r.determinant().ln();
            assert!((errors.log_determinant() - determinant).abs() < 1e-10 * determinant.abs());
            let values: Vec<f64> = (0..20).map(|_| number()).collect();
            let vector = DVector::from_column_slice(&values);
            let near = |found: &[f64], expected: &DVector<f64>| {
                let off = found
                    .iter()
                    .zip(expected.iter())
                    .map(|(a, b)| (a - b).abs());
                assert!(off.fold(0.0, f64::max) < 1e-10 * expected.amax().max(1.0));
            };
            near(&errors.whiten_transpose(&values), &w.tr_mul(&vector));
            near(&errors.colour(&errors.whiten(&values)), &vector);
            let likely = 0.49 * g.tr_mul(&r.clone().lu().solve(&vector).expect("regular"));
            near(&errors.smoothed(&values, inputs), &likely);
            let drawn: Vec<f64> = (0..inputs).map(|_| number()).collect();
            near(
                &errors.response(&drawn),
                &(&g * DVector::from_column_slice(&drawn)),
            );
            let other = errors.clone().with_ratio(0.2);
            let [squares, determinant] = errors.likelihood(0.2, &values);
            let whitened = DVector::from_vec(other.whiten(&values));
            assert!((squares - whitened.norm_squared()).abs() < 1e-10 * squares);
            assert!((determinant - other.log_determinant()).abs() < 1e-10 * determinant.abs());
            near(
                &errors.first(9).whiten(&values[..9]),
                &DVector::from_column_slice(&errors.whiten(&values)[..9]),
            );
        }
    }
}
