//! Errors of an input as they appear in the samples of one channel, and their whitening by a Kalman filter along the record.
//!
//! With the errors `w_k` of the input samples, of standard deviation `s`, and the noise `v_j` of the channel, both independent, the
//! normalised errors of the samples are
//!
//! ```text
//! x_i+1 = A_i x_i + l_i e_i + r_i e_i+1,    z_j = h_j (x_i, x_i+1) + d_j (e_i, e_i+1) + v_j,    R = I + s^2 G G^T
//! ```
//!
//! with the change `x_i` of displacement and velocity at node `i`, the error `e_i` of the input there (linear between input
//! samples), and the derivatives `G` of `z` with respect to `w`. The filter gives `W` with `W R W^T = I` in a time proportional to the
//! number of nodes.
//!
//! Source: R. E. Kalman, J. Basic Eng. 82 (1960) 35-45; F. C. Schweppe, IEEE Trans. Inf. Theory 11 (1965) 61-70 for the likelihood.

use nalgebra::{SMatrix, SVector};

/// Displacement, velocity, and the errors of the input samples on both sides at a node; displacement, velocity and error of the
/// input at the node before it.
const STATES: usize = 7;
type State = SVector<f64, STATES>;
type Matrix = SMatrix<f64, STATES, STATES>;
type Noise = SMatrix<f64, STATES, 2>;

/// Derivatives of the state `(y, v)` at the right node of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputStep {
    /// With respect to displacement and velocity at the left node.
    pub state: [[f64; 2]; 2],
    /// With respect to the input at the left and at the right node.
    pub input: [[f64; 2]; 2],
}

/// Derivatives of one sample over its sigma.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputRow {
    /// Step that contains the sample.
    pub step: usize,
    /// With respect to displacement and velocity at the left node of the step, then at the right.
    pub states: [f64; 4],
    /// With respect to the input at the left and at the right node.
    pub input: [f64; 2],
}

/// The effect of errors of the input on the samples of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct InputErrors {
    /// Standard deviation of the errors of the input samples.
    sigma: f64,
    transitions: Vec<Transition>,
    rows: Vec<Row>,
    /// Index of the input sample before the first node.
    first: usize,
}

/// `s_i+1 = matrix s_i + noise w / sigma`.
#[derive(Debug, Clone, PartialEq)]
struct Transition {
    matrix: Matrix,
    noise: Noise,
    /// Indices of the input samples that enter, where any do.
    enter: [Option<usize>; 2],
}

#[derive(Debug, Clone, PartialEq)]
struct Row {
    step: usize,
    /// Transition from the row before, and the covariance of the noise that enters; `None` within the same step.
    advance: Option<(Matrix, Matrix)>,
    derivatives: State,
    gain: State,
    /// Variance of the innovation.
    variance: f64,
}

impl InputErrors {
    /// The errors of standard deviation `sigma` of input samples; `places` are, for each node, the index of the input sample before it
    /// and the fraction of the way to the next one. `rows` are in the order of time.
    ///
    /// # Panics
    /// Unless there is one more place than steps.
    pub fn new(
        sigma: f64,
        steps: &[InputStep],
        places: &[(usize, f64)],
        rows: &[InputRow],
    ) -> Self {
        assert_eq!(places.len(), steps.len() + 1, "a place for each node");
        let each = steps.iter().zip(places.windows(2));
        let transitions: Vec<Transition> = each
            .map(|(step, pair)| transition(step, pair[0], pair[1], sigma))
            .collect();
        let rows = rows.iter().map(|row| {
            let [a, b, c, d] = row.states;
            let [left, right] = row.input;
            let fraction = places[row.step + 1].1;
            let (before, after) = (right * (1.0 - fraction), right * fraction);
            Row {
                step: row.step,
                advance: None,
                derivatives: State::from([c, d, before, after, a, b, left]),
                gain: State::zeros(),
                variance: 1.0,
            }
        });
        let mut errors = Self {
            sigma,
            rows: rows.collect(),
            transitions,
            first: places[0].0,
        };
        errors.join();
        errors.filter();
        errors
    }

    /// Joins the transitions between rows, so that the filter takes one step for each sample, whatever the number of nodes.
    fn join(&mut self) {
        let mut next = 0;
        for row in &mut self.rows {
            if next > row.step {
                continue;
            }
            let (mut matrix, mut covariance) = (Matrix::identity(), Matrix::zeros());
            for step in &self.transitions[next..=row.step] {
                matrix = step.matrix * matrix;
                covariance = step.matrix * covariance * step.matrix.transpose()
                    + step.noise * step.noise.transpose();
            }
            row.advance = Some((matrix, covariance));
            next = row.step + 1;
        }
    }

    /// Sets the gains and variances by the Riccati recursion.
    fn filter(&mut self) {
        let mut covariance = Matrix::zeros();
        covariance[(2, 2)] = self.sigma * self.sigma;
        covariance[(3, 3)] = self.sigma * self.sigma;
        for row in &mut self.rows {
            if let Some((matrix, noise)) = &row.advance {
                covariance = matrix * covariance * matrix.transpose() + noise;
            }
            let column = covariance * row.derivatives;
            row.variance = 1.0 + row.derivatives.dot(&column);
            row.gain = column / row.variance;
            covariance -= row.gain * column.transpose();
        }
    }

    /// Standard deviation of the errors of the input samples.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// The same effect of errors of another standard deviation.
    #[must_use]
    pub fn with_sigma(&self, sigma: f64) -> Self {
        let mut errors = self.clone();
        let ratio = sigma / self.sigma;
        for step in &mut errors.transitions {
            step.noise *= ratio;
        }
        for row in &mut errors.rows {
            if let Some((_, noise)) = &mut row.advance {
                *noise *= ratio * ratio;
            }
        }
        errors.sigma = sigma;
        errors.filter();
        errors
    }

    /// The effect with all derivatives of the samples multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let mut errors = self.clone();
        for row in &mut errors.rows {
            row.derivatives *= factor;
        }
        errors.filter();
        errors
    }

    /// The effect on the first `count` samples.
    #[must_use]
    pub fn first(&self, count: usize) -> Self {
        let mut part = self.clone();
        part.rows.truncate(count);
        part
    }

    /// Passes each row with the state before its update to `take`, which returns the innovation.
    fn run(&self, mut take: impl FnMut(usize, &Row, f64) -> f64) {
        let mut state = State::zeros();
        for (j, row) in self.rows.iter().enumerate() {
            if let Some((matrix, _)) = &row.advance {
                state = matrix * state;
            }
            let innovation = take(j, row, row.derivatives.dot(&state));
            state += row.gain * innovation;
        }
    }

    /// `W values`.
    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; values.len()];
        self.run(|j, row, predicted| {
            let innovation = values[j] - predicted;
            out[j] = innovation / row.variance.sqrt();
            innovation
        });
        out
    }

    /// `W^-1 values`.
    pub fn colour(&self, values: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; values.len()];
        self.run(|j, row, predicted| {
            let innovation = values[j] * row.variance.sqrt();
            out[j] = innovation + predicted;
            innovation
        });
        out
    }

    /// `W^T values`.
    pub fn whiten_transpose(&self, values: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; values.len()];
        let mut adjoint = State::zeros();
        for (j, row) in self.rows.iter().enumerate().rev() {
            out[j] = values[j] / row.variance.sqrt() + row.gain.dot(&adjoint);
            adjoint -= row.derivatives * out[j];
            if let Some((matrix, _)) = &row.advance {
                adjoint = matrix.tr_mul(&adjoint);
            }
        }
        out
    }

    /// `log |R|`.
    pub fn log_determinant(&self) -> f64 {
        self.rows.iter().map(|row| row.variance.ln()).sum()
    }

    /// `G errors`: changes of the samples by errors of the input samples.
    pub fn response(&self, errors: &[f64]) -> Vec<f64> {
        let error = |k: Option<usize>| k.and_then(|k| errors.get(k)).copied().unwrap_or(0.0);
        let mut state = State::zeros();
        state[2] = error(Some(self.first));
        state[3] = error(Some(self.first + 1));
        let mut out = vec![0.0; self.rows.len()];
        let mut next = 0;
        for (i, step) in self.transitions.iter().enumerate() {
            let enter = SVector::from(step.enter.map(|k| error(k) / self.sigma));
            state = step.matrix * state + step.noise * enter;
            while next < self.rows.len() && self.rows[next].step == i {
                out[next] = self.rows[next].derivatives.dot(&state);
                next += 1;
            }
        }
        out
    }

    /// Most likely errors of the `count` input samples, `s^2 G^T R^-1 values`, given the normalised errors `values` of the samples.
    pub fn smoothed(&self, values: &[f64], count: usize) -> Vec<f64> {
        let inverse = self.whiten_transpose(&self.whiten(values));
        let mut errors = vec![0.0; count];
        let mut add = |k: Option<usize>, value: f64| {
            if let Some(error) = k.and_then(|k| errors.get_mut(k)) {
                *error += value;
            }
        };
        let mut adjoint = State::zeros();
        let mut last = self.rows.len();
        for (i, step) in self.transitions.iter().enumerate().rev() {
            while last > 0 && self.rows[last - 1].step == i {
                last -= 1;
                adjoint += self.rows[last].derivatives * inverse[last];
            }
            let entered = step.noise.tr_mul(&adjoint) * self.sigma;
            add(step.enter[0], entered[0]);
            add(step.enter[1], entered[1]);
            adjoint = step.matrix.tr_mul(&adjoint);
        }
        let variance = self.sigma * self.sigma;
        add(Some(self.first), variance * adjoint[2]);
        add(Some(self.first + 1), variance * adjoint[3]);
        errors
    }
}

/// The transition over one step from the place of its left node to that of its right node.
fn transition(step: &InputStep, from: (usize, f64), to: (usize, f64), sigma: f64) -> Transition {
    let advance = |state: [f64; 4], enter: [f64; 2]| -> State {
        let [y, v, before, after] = state;
        let here = (1.0 - from.1) * before + from.1 * after;
        let [before, after] = match to.0 - from.0 {
            0 => [before, after],
            1 => [after, enter[1]],
            _ => enter,
        };
        let there = (1.0 - to.1) * before + to.1 * after;
        let end = |q: usize| {
            step.state[0][q] * y
                + step.state[1][q] * v
                + step.input[0][q] * here
                + step.input[1][q] * there
        };
        State::from([end(0), end(1), before, after, y, v, here])
    };
    let unit = |j: usize| std::array::from_fn(|i| if i == j { 1.0 } else { 0.0 });
    let mut matrix = Matrix::zeros();
    for j in 0..4 {
        matrix.set_column(j, &advance(unit(j), [0.0; 2]));
    }
    let mut noise = Noise::zeros();
    for k in 0..2 {
        let enter = [[sigma, 0.0], [0.0, sigma]][k];
        noise.set_column(k, &advance([0.0; 4], enter));
    }
    let enter = match to.0 - from.0 {
        0 => [None, None],
        1 => [None, Some(to.0 + 1)],
        _ => [Some(to.0), Some(to.0 + 1)],
    };
    Transition {
        matrix,
        noise,
        enter,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// `W R W^T = I`, the transpose, the inverse, the determinant, and the most likely errors, against dense matrices, for nodes on every
    /// input sample, several nodes for each input sample, and several input samples for each node.
    #[test]
    fn the_filter_is_a_root_of_the_dense_matrix() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for spacing in [1.0, 0.3, 2.5] {
            let nodes = 14;
            let mut number = || random.random_range(-1.0..1.0);
            let steps: Vec<InputStep> = (1..nodes)
                .map(|_| InputStep {
                    state: [[number(), number()], [number(), number()]],
                    input: [[number(), number()], [number(), number()]],
                })
                .collect();
            let places: Vec<(usize, f64)> = (0..nodes)
                .map(|i| (spacing * i as f64).floor())
                .zip((0..nodes).map(|i| (spacing * i as f64).fract()))
                .map(|(k, fraction)| (k as usize, fraction))
                .collect();
            let rows: Vec<InputRow> = (0..20)
                .map(|j| InputRow {
                    step: (j * (nodes - 1)) / 20,
                    states: std::array::from_fn(|_| number()),
                    input: [number(), number()],
                })
                .collect();
            let errors = InputErrors::new(0.7, &steps, &places, &rows);
            let inputs = places[nodes - 1].0 + 2;
            // The definition, without a filter.
            let mut g = DMatrix::zeros(rows.len(), inputs);
            for k in 0..inputs {
                let at = |i: usize| {
                    let (before, fraction) = places[i];
                    if before == k {
                        1.0 - fraction
                    } else if before + 1 == k {
                        fraction
                    } else {
                        0.0
                    }
                };
                let mut states = vec![[0.0; 2]];
                for (i, step) in steps.iter().enumerate() {
                    let [y, v] = states[i];
                    states.push(std::array::from_fn(|q| {
                        step.state[0][q] * y
                            + step.state[1][q] * v
                            + step.input[0][q] * at(i)
                            + step.input[1][q] * at(i + 1)
                    }));
                }
                for (j, row) in rows.iter().enumerate() {
                    let i = row.step;
                    let both = [
                        states[i][0],
                        states[i][1],
                        states[i + 1][0],
                        states[i + 1][1],
                    ];
                    let by_states: f64 = row.states.iter().zip(both).map(|(a, b)| a * b).sum();
                    g[(j, k)] = by_states + row.input[0] * at(i) + row.input[1] * at(i + 1);
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
            let other = InputErrors::new(0.2, &steps, &places, &rows);
            near(
                &errors.with_sigma(0.2).whiten(&values),
                &DVector::from_vec(other.whiten(&values)),
            );
            near(
                &errors.first(9).whiten(&values[..9]),
                &DVector::from_column_slice(&errors.whiten(&values)[..9]),
            );
        }
    }
}
