//! Second-order cones of an interior-point iterate, in the scaling of Nesterov and Todd.
//!
//! A cone of rows `s = C xi - d` asks for `|s_1| <= s_0`, with `s_1` the components after the first. Slacks `s` and multipliers `z`, both
//! inside, are scaled to one point `lambda = W z = W^-1 s` by
//!
//! ```text
//! W = eta [w_0, w_1'; w_1, I + w_1 w_1' / (1 + w_0)],    w_0^2 - |w_1|^2 = 1
//! ```
//!
//! so that the cone adds `(W^-1 C)' (W^-1 C)` to the Hessian. Products of pairs are those of Jordan,
//! `u o v = (u' v, u_0 v_1 + v_0 u_1)`.
//!
//! Source: Yu. E. Nesterov, M. J. Todd, SIAM J. Optim. 8 (1998) 324-364; L. Vandenberghe, The CVXOPT linear and quadratic cone program
//! solvers (2010), for the formulas.

use super::barrier::{Barrier, LEAST_SLACK};
use super::rows::StageRows;
use crate::constraints::TOLERANCE;

/// Scaling of one cone.
#[derive(Debug, Clone, Default)]
struct Scaling {
    eta: f64,
    /// `w`, the first component first.
    w: Vec<f64>,
}

/// All cones of a program; their rows follow each other.
pub(super) struct Cones<'a> {
    rows: &'a StageRows,
    /// First row of each cone, and the number of rows.
    first: &'a [u32],
    slacks: Vec<f64>,
    /// Multipliers, for half the cost.
    pub multipliers: Vec<f64>,
    /// `s - (C xi - d)`.
    violations: Vec<f64>,
    scalings: Vec<Scaling>,
    /// `W^-1 C`, weights of 1, and `lambda`.
    scaled: StageRows,
    ones: Vec<f64>,
    points: Vec<f64>,
    /// `W^-1` times the change of the slacks, and `W` times that of the multipliers.
    slack_step: Vec<f64>,
    multiplier_step: Vec<f64>,
    /// `lambda \ (target - second-order term)`.
    targets: Vec<f64>,
    products: Vec<f64>,
    factors: Vec<f64>,
}

impl<'a> Cones<'a> {
    /// Without curvature until the first [`Barrier::predict`].
    pub fn new(rows: &'a StageRows, first: &'a [u32]) -> Self {
        let zeros = vec![0.0; rows.len()];
        let scaling = |cone: &[u32]| Scaling {
            eta: 1.0,
            w: vec![0.0; (cone[1] - cone[0]) as usize],
        };
        Self {
            rows,
            first,
            slacks: zeros.clone(),
            multipliers: zeros.clone(),
            violations: zeros.clone(),
            scalings: first.windows(2).map(scaling).collect(),
            scaled: rows.zero(),
            ones: vec![1.0; rows.len()],
            points: zeros.clone(),
            slack_step: zeros.clone(),
            multiplier_step: zeros.clone(),
            targets: zeros.clone(),
            products: Vec::with_capacity(rows.len()),
            factors: zeros,
        }
    }

    fn ranges(&self) -> impl Iterator<Item = std::ops::Range<usize>> + use<'a> {
        let first = self.first;
        first.windows(2).map(|c| c[0] as usize..c[1] as usize)
    }

    /// `C xi - d`.
    pub fn values<const W: usize>(&mut self, xi: &[[f64; W]]) -> Vec<f64> {
        self.rows.products(xi, &mut self.products);
        let pairs = self.products.iter().zip(&self.rows.right);
        pairs.map(|(product, right)| product - right).collect()
    }

    /// Slacks with the components `values`, and first components that leave the larger of the margins of `values` and `others`; products `mean`.
    pub fn start(&mut self, values: &[f64], others: &[f64], mean: f64) {
        let margin = |range: std::ops::Range<usize>| {
            let both = [&values[range.clone()], &others[range]];
            both.map(|s| (s[0] - norm(s)).abs())
                .into_iter()
                .fold(0.0, f64::max)
        };
        let largest = self.ranges().fold(0.0, |most: f64, range| {
            most.max(values[range.start].abs()).max(margin(range))
        });
        for range in self.ranges() {
            let s = &mut self.slacks[range.clone()];
            s.copy_from_slice(&values[range.clone()]);
            s[0] = norm(s) + margin(range.clone()).max(LEAST_SLACK * largest);
            // mean s^-1 = mean (s_0, -s_1) / (s_0^2 - |s_1|^2).
            let factor = mean / determinant(s);
            for (j, (z, s)) in self.multipliers[range].iter_mut().zip(s).enumerate() {
                *z = if j == 0 { factor * *s } else { -factor * *s };
            }
        }
    }

    /// Factors from the residuals of the products: the multipliers after the step are `-factors` but for the change of the slacks.
    fn update_factors(&mut self) {
        let mut scaled = Vec::new();
        for (range, scaling) in self.ranges().zip(&self.scalings) {
            // -(W^-2 r + W^-1 t) = -W^-1 (W^-1 r + t).
            scaled.clear();
            scaled.extend_from_slice(&self.violations[range.clone()]);
            scaling.divide(&mut scaled);
            let targets = &self.targets[range.clone()];
            scaled.iter_mut().zip(targets).for_each(|(a, t)| *a += t);
            scaling.divide(&mut scaled);
            let factors = self.factors[range].iter_mut().zip(&scaled);
            factors.for_each(|(factor, a)| *factor = -a);
        }
    }
}

impl<const W: usize> Barrier<W> for Cones<'_> {
    fn curvature(&self) -> (&StageRows, &[f64]) {
        (&self.scaled, &self.ones)
    }

    fn add_to_gradient(&self, gradient: &mut [[f64; W]]) {
        self.rows.transpose_add(&self.factors, gradient);
    }

    fn degree(&self) -> usize {
        self.scalings.len()
    }

    fn gap(&self) -> f64 {
        let pairs = self.slacks.iter().zip(&self.multipliers);
        pairs.map(|(s, z)| s * z).sum()
    }

    fn is_satisfied(&self) -> bool {
        let mut parts = Vec::new();
        self.ranges().all(|range| {
            parts.clear();
            let pairs = self.slacks[range.clone()]
                .iter()
                .zip(&self.violations[range.clone()]);
            parts.extend(pairs.map(|(s, r)| s - r));
            let right = &self.rows.right[range];
            let scale = right.iter().fold(0.0f64, |most, b| most.max(b.abs()));
            norm(&parts) - parts[0] <= 0.1 * TOLERANCE * scale.max(parts[0].abs())
        })
    }

    fn update_violations(&mut self, xi: &[[f64; W]]) {
        self.rows.products(xi, &mut self.products);
        for (k, violation) in self.violations.iter_mut().enumerate() {
            *violation = self.slacks[k] + self.rows.right[k] - self.products[k];
        }
    }

    fn predict(&mut self) {
        for (cone, range) in self.ranges().enumerate() {
            let scaling = &mut self.scalings[cone];
            let point = &mut self.points[range.clone()];
            scaling.update(
                &self.slacks[range.clone()],
                &self.multipliers[range.clone()],
                point,
            );
            scaling.divide_rows(self.rows, &mut self.scaled, range);
        }
        self.targets.fill(0.0);
        self.update_factors();
    }

    fn correct(&mut self, target: f64) {
        for range in self.ranges() {
            let [u, v] = [&self.slack_step, &self.multiplier_step].map(|x| &x[range.clone()]);
            let point = &self.points[range.clone()];
            // Solves lambda o t = d for d = target e - u o v.
            let t = &mut self.targets[range];
            for (j, t) in t.iter_mut().enumerate() {
                *t = match j {
                    0 => target - inner(u, v),
                    _ => -(u[0] * v[j] + v[0] * u[j]),
                };
            }
            let along = inner(&point[1..], &t[1..]);
            t[0] = (point[0] * t[0] - along) / determinant(point);
            for j in 1..t.len() {
                t[j] = (t[j] - t[0] * point[j]) / point[0];
            }
        }
        self.update_factors();
    }

    fn update_steps(&mut self, step: &[[f64; W]]) {
        self.rows.products(step, &mut self.products);
        for (range, scaling) in self.ranges().zip(&self.scalings) {
            let u = &mut self.slack_step[range.clone()];
            for (k, u) in range.clone().zip(u.iter_mut()) {
                *u = self.products[k] - self.violations[k];
            }
            scaling.divide(u);
            for (k, u) in range.zip(u.iter()) {
                self.multiplier_step[k] = self.targets[k] - self.points[k] - u;
            }
        }
    }

    fn longest_step(&self, share: f64) -> f64 {
        let mut length = 1.0f64;
        for range in self.ranges() {
            let point = &self.points[range.clone()];
            let root = determinant(point).sqrt();
            let unit = |j: usize| point[j] / root;
            for step in [&self.slack_step, &self.multiplier_step] {
                // The step in the frame of the point: it leaves the cone where |rho_1| - rho_0 = 1 / length.
                let step = &step[range.clone()];
                let along: f64 = (1..step.len()).map(|j| unit(j) * step[j]).sum();
                let first = (unit(0) * step[0] - along) / root;
                let factor = (step[0] / root + first) / (unit(0) + 1.0);
                let rest = (1..step.len()).map(|j| step[j] / root - factor * unit(j));
                let rest = rest.map(|x| x * x).sum::<f64>().sqrt();
                if rest - first > 0.0 {
                    length = length.min(share / (rest - first));
                }
            }
        }
        length
    }

    /// `(lambda + length u)' (lambda + length v)`.
    fn gap_after(&self, length: f64) -> f64 {
        let each = (0..self.points.len()).map(|k| {
            let [u, v] = [self.slack_step[k], self.multiplier_step[k]];
            (self.points[k] + length * u) * (self.points[k] + length * v)
        });
        each.sum()
    }

    fn move_by(&mut self, length: f64) {
        let mut change = Vec::new();
        for (range, scaling) in self.ranges().zip(&self.scalings) {
            change.clear();
            change.extend_from_slice(&self.slack_step[range.clone()]);
            scaling.multiply(&mut change);
            let slacks = self.slacks[range.clone()].iter_mut().zip(&change);
            slacks.for_each(|(s, change)| *s += length * change);
            change.clear();
            change.extend_from_slice(&self.multiplier_step[range.clone()]);
            scaling.divide(&mut change);
            let multipliers = self.multipliers[range].iter_mut().zip(&change);
            multipliers.for_each(|(z, change)| *z += length * change);
        }
    }

    fn take_multipliers(&mut self) {
        let pairs = self.factors.iter_mut().zip(&self.multipliers);
        pairs.for_each(|(factor, z)| *factor = -z);
    }
}

impl Scaling {
    /// The scaling with which `W z = W^-1 s`, and this `point`, from sums that do not cancel.
    fn update(&mut self, s: &[f64], z: &[f64], point: &mut [f64]) {
        let [of_s, of_z] = [determinant(s).sqrt(), determinant(z).sqrt()];
        let product = inner(s, z) / (of_s * of_z);
        let gamma = (0.5 * (1.0 + product)).sqrt();
        for (j, w) in self.w.iter_mut().enumerate() {
            let sign = if j == 0 { 1.0 } else { -1.0 };
            *w = (s[j] / of_s + sign * z[j] / of_z) / (2.0 * gamma);
        }
        self.eta = (of_s / of_z).sqrt();
        let size = (of_s * of_z).sqrt();
        let [s0, z0] = [s[0] / of_s, z[0] / of_z];
        point[0] = size * gamma;
        for j in 1..s.len() {
            let sum = (gamma + z0) * s[j] / of_s + (gamma + s0) * z[j] / of_z;
            point[j] = size * sum / (s0 + z0 + 2.0 * gamma);
        }
    }

    /// `W x`.
    fn multiply(&self, x: &mut [f64]) {
        let along = inner(&self.w[1..], &x[1..]);
        let factor = x[0] + along / (1.0 + self.w[0]);
        x[0] = self.eta * (self.w[0] * x[0] + along);
        for (x, w) in x[1..].iter_mut().zip(&self.w[1..]) {
            *x = self.eta * (*x + factor * w);
        }
    }

    /// `W^-1 x`.
    fn divide(&self, x: &mut [f64]) {
        let along = inner(&self.w[1..], &x[1..]);
        let factor = along / (1.0 + self.w[0]) - x[0];
        x[0] = (self.w[0] * x[0] - along) / self.eta;
        for (x, w) in x[1..].iter_mut().zip(&self.w[1..]) {
            *x = (*x + factor * w) / self.eta;
        }
    }

    /// `W^-1` times the rows `range`, which have the same columns.
    fn divide_rows(&self, rows: &StageRows, out: &mut StageRows, range: std::ops::Range<usize>) {
        let mut column = vec![0.0; range.len()];
        for c in 0..rows.row(range.start).1.len() {
            for (x, row) in column.iter_mut().zip(range.clone()) {
                *x = rows.row(row).1[c];
            }
            self.divide(&mut column);
            for (x, row) in column.iter().zip(range.clone()) {
                out.values_mut(row)[c] = *x;
            }
        }
    }
}

fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `|x_1|`.
fn norm(x: &[f64]) -> f64 {
    inner(&x[1..], &x[1..]).sqrt()
}

/// `x_0^2 - |x_1|^2`, without cancellation.
fn determinant(x: &[f64]) -> f64 {
    let length = norm(x);
    (x[0] - length) * (x[0] + length)
}
