//! Derivatives at one stage, forwards and back.

use super::stage::{AssembledStage, StageValues};
use crate::structure::Structure;

/// Derivatives with respect to the values at a stage.
#[derive(Debug, Clone)]
pub(crate) struct StageShares {
    pub functions: Vec<f64>,
    pub forces: Vec<f64>,
    pub frames: Vec<f64>,
}

impl StageShares {
    pub fn zeros(structure: &Structure) -> Self {
        Self {
            functions: vec![0.0; structure.functions()],
            forces: vec![0.0; structure.coordinates()],
            frames: vec![0.0; structure.coordinates()],
        }
    }
}

impl AssembledStage<f64> {
    /// Multipliers of the state that the stage starts from, added to `state`, for multipliers `velocity` of the velocities at the stage,
    /// `acceleration` of its accelerations and `rate` of the rates of its internal states; the factor is that of the stage.
    pub fn pull(
        &mut self,
        structure: &Structure,
        h: f64,
        [velocity, acceleration, rate]: [&[f64]; 3],
        [by_q, by_v, by_z]: [&mut [f64]; 3],
        shares: &mut StageShares,
    ) {
        let count = structure.inertias().len();
        self.step.copy_from_slice(velocity);
        for (internal, rate) in self.internal.iter().zip(rate) {
            let ends = structure.ends(internal.element);
            let [by_x, by_r, _] = internal.rate_by.map(|by| by * rate);
            ends.spread(by_x, by_q);
            ends.spread(h * by_x + by_r, &mut self.step);
        }
        for ((w, a), v) in self.work.iter_mut().zip(acceleration).zip(&self.step) {
            *w = a + h * v;
        }
        self.matrix.solve(&mut self.work);
        shares.forces.copy_from_slice(&self.work);
        by_v.iter_mut().zip(&self.step).for_each(|(to, v)| *to += v);
        shares.frames.fill(0.0);
        for (f, ends) in structure.inertias().iter().enumerate() {
            let across = of_coordinates(ends.entries(), &self.work);
            shares.functions[f] = -across * self.phi[f];
            ends.spread(-across * self.values.functions[f], &mut shares.frames);
        }
        let mut f = count;
        for (e, (law, ends)) in structure.elements().enumerate() {
            let across = of_coordinates(ends.entries(), &self.work);
            for _ in 0..law.coefficients() {
                shares.functions[f] = -across * self.phi[f];
                f += 1;
            }
            let [slope_q, slope_v] = self.slopes[e];
            ends.spread(-across * slope_q, by_q);
            ends.spread(-across * (slope_v + h * slope_q), by_v);
        }
        for (k, (internal, rate)) in self.internal.iter().zip(rate).enumerate() {
            let ends = structure.ends(internal.element);
            let across = of_coordinates(ends.entries(), &self.work);
            by_z[k] += rate * internal.rate_by[2] - across * internal.force_by_state;
            for (c, by) in internal.rate_by_coefficients.iter().enumerate() {
                shares.functions[internal.first + c] += rate * by;
            }
        }
    }

    /// Changes of velocities, accelerations and rates of internal states at the stage, in `out`, for changes `q`, `v`, `z` of the state that it
    /// starts from and changes of the values.
    pub fn push(
        &mut self,
        structure: &Structure,
        h: f64,
        [q, v, z]: [&[f64]; 3],
        changes: &StageValues<f64>,
        [to_v, to_a, to_rate]: [&mut [f64]; 3],
    ) {
        let count = structure.inertias().len();
        let n = structure.coordinates();
        self.work.copy_from_slice(&changes.forces);
        for (f, ends) in structure.inertias().iter().enumerate() {
            let mut frame = 0.0;
            for (j, factor) in ends.entries() {
                frame += factor * changes.frames.get(*j).copied().unwrap_or(0.0);
            }
            let force = self.values.functions[f] * frame + changes.functions[f] * self.phi[f];
            ends.spread(-force, &mut self.work);
        }
        let mut f = count;
        for (e, (law, ends)) in structure.elements().enumerate() {
            let [slope_q, slope_v] = self.slopes[e];
            let [dq, dv] = [q, v].map(|x| of_coordinates(ends.entries(), x));
            let mut force = slope_q * (dq + h * dv) + slope_v * dv;
            for _ in 0..law.coefficients() {
                force += changes.functions[f] * self.phi[f];
                f += 1;
            }
            ends.spread(-force, &mut self.work);
        }
        for (internal, z) in self.internal.iter().zip(z) {
            let ends = structure.ends(internal.element);
            ends.spread(-internal.force_by_state * z, &mut self.work);
        }
        self.matrix.solve(&mut self.work);
        to_a.copy_from_slice(&self.work);
        for j in 0..n {
            to_v[j] = v[j] + h * self.work[j];
        }
        for (k, internal) in self.internal.iter().enumerate() {
            let ends = structure.ends(internal.element);
            let dr = of_coordinates(ends.entries(), to_v);
            let dx = of_coordinates(ends.entries(), q) + h * dr;
            let [by_x, by_r, by_z] = internal.rate_by;
            let by_coefficients = internal.rate_by_coefficients.iter().enumerate();
            let of_coefficients =
                by_coefficients.map(|(c, by)| by * changes.functions[internal.first + c]);
            to_rate[k] = by_x * dx + by_r * dr + by_z * z[k] + of_coefficients.sum::<f64>();
        }
    }
}

/// A combination of coordinates, without supports.
fn of_coordinates(entries: &[(usize, f64)], x: &[f64]) -> f64 {
    let terms = entries
        .iter()
        .filter_map(|(j, factor)| Some(factor * x.get(*j)?));
    terms.sum()
}
