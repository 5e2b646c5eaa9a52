//! The measured response: forces and residuals of the equation of motion, and the response on the nodes of the grid.

use super::measured::SAME_SPACING;
use crate::objective::SimulatedRecord;
use crate::problem::Problem;
use crate::record::{Channel, Measured};
use crate::signal::zero_phase;
use crate::step::Trajectory;
use crate::system::{Grid, NodalCoefficients, TimePoint};
use std::ops::Range;

impl Measured {
    /// The response for the weak form.
    pub fn in_weak_form(&self) -> &Self {
        self.at_samples.as_deref().unwrap_or(self)
    }

    /// Runs of equally spaced times; between them are gaps.
    pub fn runs(&self, step: f64) -> Vec<Range<usize>> {
        let at = |position: &TimePoint| (position.step as f64 + position.fraction) * step;
        let mut runs: Vec<Range<usize>> = Vec::new();
        for i in 0..self.positions.len() {
            let is_next = i > 0 && {
                let gap = at(&self.positions[i]) - at(&self.positions[i - 1]);
                (gap - self.weight).abs() <= SAME_SPACING * self.weight
            };
            match runs.last_mut() {
                Some(run) if is_next => run.end = i + 1,
                _ => runs.push(i..i + 1),
            }
        }
        runs
    }

    /// A series at the times after the filter of the channels.
    pub fn filtered(&self, series: Vec<f64>) -> Vec<f64> {
        match self.filter.as_slice() {
            [] => series,
            filter => zero_phase(filter, &series),
        }
    }

    /// Factor of function `f` at time `i`: `y'' + b''` for the mass, `phi` for a term.
    pub fn response(&self, problem: &Problem, f: usize, i: usize) -> f64 {
        match f {
            0 => self.a[i] + self.base[i],
            term => problem.system.laws()[term - 1].phi(self.y[i], self.v[i]),
        }
    }

    /// Residual `m (y'' + b'') + sum_j p_j phi_j(y, y') - f` of the equation of motion at all times, N.
    pub fn errors(&self, problem: &Problem, nodal: &NodalCoefficients) -> Vec<f64> {
        let error = |(i, position): (usize, &TimePoint)| {
            let forces = nodal.functions().enumerate();
            let force = |(f, values): (usize, &[f64])| {
                blend(values, *position) * self.response(problem, f, i)
            };
            forces
                .map(force)
                .fold(-self.force[i], |sum, force| sum + force)
        };
        self.positions.iter().enumerate().map(error).collect()
    }

    /// Response on `nodes` nodes: cubic between times, extended harmonically with the dominant frequency beyond them.
    pub fn trajectory(&self, grid: &Grid, nodes: usize) -> Trajectory {
        let mut response = Trajectory::zeros(1, nodes);
        let at = |i: usize| self.positions[i].step as f64 + self.positions[i].fraction;
        let last = self.positions.len() - 1;
        let mut i = 0;
        for node in 0..nodes {
            let x = node as f64;
            while i < last && at(i + 1) <= x {
                i += 1;
            }
            let since = (x - at(i)) * grid.step();
            let (y, v) = match i < last && since > 0.0 {
                true => {
                    let [y, v, _] = self.between(i, since, (at(i + 1) - at(i)) * grid.step());
                    (y, v)
                }
                false => self.swung_on(i, since),
            };
            response.component_mut(0)[node] = y;
            response.component_mut(1)[node] = v;
        }
        response
    }

    fn swung_on(&self, i: usize, since: f64) -> (f64, f64) {
        let (y, v, w) = (self.y[i], self.v[i], self.frequency);
        let (sine, cosine) = (w * since).sin_cos();
        (y * cosine + v / w * sine, v * cosine - w * y * sine)
    }

    /// Cubic Hermite polynomials through displacement and velocity, and velocity and acceleration.
    /// The acceleration is the derivative of the latter.
    pub(super) fn between(&self, i: usize, since: f64, span: f64) -> [f64; 3] {
        let x = since / span;
        let cubic = |p: &[f64], d: &[f64]| {
            let (x2, x3) = (x * x, x * x * x);
            (1.0 - 3.0 * x2 + 2.0 * x3) * p[i]
                + span * (x - 2.0 * x2 + x3) * d[i]
                + (3.0 * x2 - 2.0 * x3) * p[i + 1]
                + span * (x3 - x2) * d[i + 1]
        };
        let (v, a) = (&self.v, &self.a);
        let slope = 6.0 * (x - x * x) / span * (v[i + 1] - v[i])
            + (1.0 - 4.0 * x + 3.0 * x * x) * a[i]
            + (3.0 * x * x - 2.0 * x) * a[i + 1];
        [cubic(&self.y, v), cubic(v, a), slope]
    }

    /// Predictions at this state.
    ///
    /// For an acceleration in a band, `y'' = (f - sum_j p_j phi_j)/m - b''` of the band plus the part of the sample that the
    /// filter removed; the residual is then minus the equation error over the mass. Omitted samples at the ends are their own
    /// predictions.
    pub fn predict(&self, problem: &Problem, channel: &Channel, view: SimulatedRecord) -> Vec<f64> {
        if self.corner.is_none() {
            return channel.predict(view);
        }
        let [gain, ..] = channel.sensor().values(view.scalars);
        let mut predicted = channel.observed().to_vec();
        for (i, error) in self.errors(problem, view.nodal).iter().enumerate() {
            predicted[self.first + i] -=
                gain * error / blend(&view.nodal.inertias[0], self.positions[i]);
        }
        predicted
    }
}

/// Value of a function that is linear between nodes.
pub(super) fn blend(values: &[f64], position: TimePoint) -> f64 {
    let [left, right] = [values[position.step], values[position.step + 1]];
    match position.fraction {
        0.0 => left,
        1.0 => right,
        x => left * (1.0 - x) + right * x,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 0.25;
    const NODES: usize = 24;

    fn grid() -> Grid {
        Grid::new(0.0, STEP * (NODES - 1) as f64, NODES).unwrap()
    }

    /// Measured states at some nodes and between some, of the response `state`: `y`, `y'`, `y''`.
    fn measured(frequency: f64, state: impl Fn(f64) -> [f64; 3]) -> Measured {
        let between = |step| TimePoint {
            step,
            fraction: 0.5,
        };
        let node = |i| TimePoint::node(i, NODES);
        let positions = vec![node(3), node(5), between(6), between(9), node(12), node(18)];
        let time = |p: &TimePoint| (p.step as f64 + p.fraction) * STEP;
        let all: Vec<[f64; 3]> = positions.iter().map(|p| state(time(p))).collect();
        let part = |j: usize| all.iter().map(|state| state[j]).collect::<Vec<f64>>();
        Measured {
            first: 0,
            y: part(0),
            v: part(1),
            a: part(2),
            force: vec![0.0; all.len()],
            base: vec![0.0; all.len()],
            weight: STEP,
            frequency,
            corner: None,
            unsmoothed: None,
            filter: Vec::new(),
            smoothing: None,
            at_samples: None,
            positions,
        }
    }

    /// Largest difference of a response from the displacement and velocity of `state`.
    fn distance(
        response: &Trajectory,
        nodes: impl Iterator<Item = usize>,
        state: impl Fn(f64) -> [f64; 3],
    ) -> f64 {
        let one = |i: usize| {
            let [y, v, _] = state(i as f64 * STEP);
            let [of_y, of_v] = [response.displacement(0)[i] - y, response.velocity(0)[i] - v];
            of_y.abs() + of_v.abs()
        };
        // NaN counts as the largest.
        nodes.map(one).max_by(f64::total_cmp).unwrap()
    }

    /// Cubic polynomials through values and slopes are exact for cubics, at the times and between.
    #[test]
    fn a_cubic_response_is_interpolated_exactly() {
        let cubic = |t: f64| {
            [
                0.3 + t - 2.0 * t * t + 0.7 * t * t * t,
                1.0 - 4.0 * t + 2.1 * t * t,
                4.2 * t - 4.0,
            ]
        };
        let response = measured(1.0, cubic).trajectory(&grid(), NODES);
        let off = distance(&response, 3..=18, cubic);
        assert!(off < 1e-12, "{off}");
    }

    #[test]
    fn a_harmonic_response_is_extended_exactly() {
        let w = 1.7;
        let harmonic = |t: f64| {
            let (sine, cosine) = (w * t + 0.4).sin_cos();
            [2.0 * cosine, -2.0 * w * sine, -2.0 * w * w * cosine]
        };
        let response = measured(w, harmonic).trajectory(&grid(), NODES);
        let off = distance(&response, (0..=3).chain(18..NODES), harmonic);
        assert!(off < 1e-12, "{off}");
    }
}
