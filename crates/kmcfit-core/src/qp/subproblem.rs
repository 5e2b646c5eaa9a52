//! Definition of convex subproblems.

use super::StageLayout;
use crate::constraints::{Cone, Rows};

/// Minimise `constant + |F z - f|^2 + sum_j d_j z_j^2 + sum_i w_i |(T z - t)_i|` subject to `E z = e`, `l <= G z <= u` and second-order cones.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Subproblem {
    /// Number of variables.
    pub variables: usize,
    /// Constant part of the cost.
    pub constant: f64,
    /// `F` and `f`.
    pub residuals: Rows,
    /// `d`, one per variable, not negative.
    pub proximal: Vec<f64>,
    /// `T` and `t`.
    pub absolute: Rows,
    /// `w`, one per row of `T`, not negative.
    pub absolute_weights: Vec<f64>,
    /// `E` and `e`.
    pub equalities: Rows,
    /// `G` and `l`; minus infinity for no lower bound.
    pub inequalities: Rows,
    /// `u`; infinity for no upper bound.
    pub upper: Vec<f64>,
    /// Second-order cones.
    pub cones: Vec<Cone>,
    /// Elimination order: place of each variable along a chain, mostly time, in which rows couple neighbours only; empty if unknown for some
    /// variable.
    pub elimination_order: Vec<u32>,
    /// Assignment of the variables to the nodes of a time grid, if known for all.
    pub layout: Option<StageLayout>,
}

impl Subproblem {
    /// An empty problem with `variables` variables.
    pub fn new(variables: usize) -> Self {
        Self {
            variables,
            constant: 0.0,
            residuals: Rows::new(),
            proximal: vec![0.0; variables],
            absolute: Rows::new(),
            absolute_weights: Vec::new(),
            equalities: Rows::new(),
            inequalities: Rows::new(),
            upper: Vec::new(),
            cones: Vec::new(),
            elimination_order: Vec::new(),
            layout: None,
        }
    }

    /// Adds `lower <= entries z <= upper`.
    pub fn bound(
        &mut self,
        entries: impl IntoIterator<Item = (usize, f64)>,
        lower: f64,
        upper: f64,
    ) {
        self.inequalities.push(entries, lower);
        self.upper.push(upper);
    }

    /// Adds variables without a proximal term and returns their indices.
    pub fn add_variables(&mut self, count: usize) -> Vec<usize> {
        let indices = self.variables..self.variables + count;
        self.variables += count;
        self.proximal.resize(self.variables, 0.0);
        indices.collect()
    }

    /// Cost `constant + |F z - f|^2 + sum d z^2 + sum w |T z - t|`.
    pub fn value(&self, z: &[f64]) -> f64 {
        let tz = self.absolute.multiply(z);
        let jumps = tz
            .iter()
            .zip(self.absolute.right())
            .zip(&self.absolute_weights);
        let jumps: f64 = jumps.map(|((a, b), w)| w * (a - b).abs()).sum();
        let fz = self.residuals.multiply(z);
        let fit = fz.iter().zip(self.residuals.right());
        let near = self.proximal.iter().zip(z);
        let squares: f64 = fit.map(|(a, b)| (a - b) * (a - b)).sum();
        self.constant + jumps + squares + near.map(|(d, z)| d * z * z).sum::<f64>()
    }

    /// The problem in the variables `z_j / units_j`.
    #[must_use]
    pub fn in_units(&self, units: &[f64]) -> Self {
        let mut scaled = self.clone();
        let cones = scaled.cones.iter_mut().map(|cone| &mut cone.rows);
        let rows = [
            &mut scaled.residuals,
            &mut scaled.absolute,
            &mut scaled.equalities,
            &mut scaled.inequalities,
        ];
        let rows = rows.into_iter().chain(cones);
        rows.for_each(|rows| rows.scale_columns(units));
        let proximal = scaled.proximal.iter_mut().zip(units);
        proximal.for_each(|(d, unit)| *d *= unit * unit);
        scaled
    }

    /// Sets the right-hand sides of the equalities to zero.
    pub fn homogeneous(&mut self) {
        self.equalities.clear_right();
    }

    /// True if all inequalities and cones hold at `z`, to `tolerance` relative to each row's size.
    pub fn holds(&self, z: &[f64], tolerance: f64) -> bool {
        let values = self.inequalities.multiply(z);
        let rows = values.iter().enumerate().all(|(i, value)| {
            let slack = tolerance * self.inequalities.scale(i).max(f64::MIN_POSITIVE);
            *value >= self.inequalities.right()[i] - slack && *value <= self.upper[i] + slack
        });
        rows && self.cones.iter().all(|cone| cone.violation(z) <= tolerance)
    }

    /// True if an inequality is active at zero: its bound is nearer than `share` of the largest distance of a bound, each
    /// in units of the row's largest coefficient.
    pub fn is_active_at_zero(&self, share: f64) -> bool {
        let bounds = self.inequalities.right().iter().zip(&self.upper);
        let distances = bounds
            .enumerate()
            .map(|(i, (lower, upper))| lower.abs().min(upper.abs()) / self.inequalities.scale(i));
        let (least, most) = distances
            .filter(|distance| distance.is_finite())
            .fold((f64::INFINITY, 0.0f64), |(least, most), d| {
                (least.min(d), most.max(d))
            });
        least <= share * most
    }
}
