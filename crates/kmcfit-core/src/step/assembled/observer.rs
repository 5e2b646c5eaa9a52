//! Observations of a structure at any time: of combinations of its coordinates, with their derivatives.
//!
//! Between nodes, displacements and velocities are cubic Hermite polynomials as for one coordinate ([`observe`](crate::step::observe())):
//! displacements from values and velocities at both nodes, velocities from values and accelerations there. Internal states of elements are linear.

use super::super::Trajectory;
use super::super::engine::Driven;
use super::super::observation::hermite;
use super::stage::AssembledStage;
use super::stage_derivatives::StageShares;
use crate::record::ChannelKind;
use crate::structure::Ends;
use crate::system::{StageSamples, TimePoint};

/// An observed value and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct RowObservation {
    /// Value, in the SI unit of its kind; not a number where the mass matrix is not positive definite.
    pub value: f64,
    /// Derivatives by the components of the state at the left node, and at the right.
    pub states: [Vec<f64>; 2],
    /// Derivatives by the value of each function, inertias first, at the left node, and at the right.
    pub functions: [Vec<f64>; 2],
}

/// Observes the response of a structure.
pub struct RowObserver<'a> {
    driven: Driven<'a>,
    states: &'a Trajectory,
    functions: Vec<&'a [f64]>,
    stage: AssembledStage<f64>,
    shares: StageShares,
    out: RowObservation,
}

impl<'a> RowObserver<'a> {
    /// An observer of the response `states`.
    pub fn new(driven: Driven<'a>, states: &'a Trajectory) -> Self {
        let structure = &driven.system.structure;
        let (components, functions) = (states.components(), structure.functions());
        let zeros = |count: usize| [vec![0.0; count], vec![0.0; count]];
        Self {
            functions: driven.nodal.functions().collect(),
            stage: AssembledStage::new(structure, 0.0),
            shares: StageShares::zeros(structure),
            out: RowObservation {
                value: 0.0,
                states: zeros(components),
                functions: zeros(functions),
            },
            driven,
            states,
        }
    }

    /// The combination `row` of displacements, velocities or accelerations at `position`; supports move as the excitation says, accelerations are
    /// relative to the frames.
    ///
    /// # Panics
    /// If `position` is not within the response.
    pub fn value(&mut self, kind: ChannelKind, row: &Ends, position: TimePoint) -> f64 {
        let n = self.states.coordinates();
        if kind == ChannelKind::Acceleration {
            self.solve(position);
            return row.across(&self.stage.a);
        }
        let of_supports = self.of_supports(kind, row, position);
        let velocities = match kind {
            ChannelKind::Displacement => Vec::new(),
            _ => self.velocities(position),
        };
        let entries = row.entries().iter().filter(|(j, _)| *j < n);
        let terms = entries.map(|(j, factor)| {
            let of_coordinate = velocities.get(*j).copied();
            factor * of_coordinate.unwrap_or_else(|| self.displacement(*j, position))
        });
        of_supports + terms.sum::<f64>()
    }

    /// [`RowObserver::value`] with its derivatives.
    ///
    /// # Panics
    /// As [`RowObserver::value`].
    pub fn observe(
        &mut self,
        kind: ChannelKind,
        row: &Ends,
        position: TimePoint,
    ) -> &RowObservation {
        let value = self.value(kind, row, position);
        let lists = self.out.states.iter_mut().chain(&mut self.out.functions);
        lists.for_each(|list| list.fill(0.0));
        let mut weights = vec![0.0; self.states.coordinates()];
        row.spread(1.0, &mut weights);
        match kind {
            ChannelKind::Displacement => self.add_displacement(&weights, position),
            ChannelKind::Velocity => self.add_velocity(&weights, position),
            ChannelKind::Acceleration => self.add_acceleration(&weights, position),
        }
        self.out.value = value;
        &self.out
    }

    /// Derivatives of the accelerations of `row` at `position` by the force on each coordinate, and by the acceleration of each frame.
    pub fn acceleration_by_inputs(&mut self, row: &Ends, position: TimePoint) -> [Vec<f64>; 2] {
        self.solve(position);
        let mut weights = vec![0.0; self.states.coordinates()];
        row.spread(1.0, &mut weights);
        self.pull(&weights);
        [self.shares.forces.clone(), self.shares.frames.clone()]
    }

    /// Multipliers of displacements, velocities and internal states at the place that was solved, for weights of the accelerations there.
    fn pull(&mut self, weights: &[f64]) -> [Vec<f64>; 3] {
        let structure = &self.driven.system.structure;
        let zeros = vec![0.0; weights.len()];
        let internal = vec![0.0; structure.internal_states()];
        let mut by = [zeros.clone(), zeros.clone(), internal.clone()];
        self.stage.linearise(structure, 0.0);
        if self.stage.factorise(structure, 0.0).is_err() {
            by[0].fill(f64::NAN);
        } else {
            let state = by.each_mut().map(Vec::as_mut_slice);
            let multipliers = [zeros.as_slice(), weights, &internal];
            (self.stage).pull(structure, 0.0, multipliers, state, &mut self.shares);
        }
        by
    }

    fn of_supports(&self, kind: ChannelKind, row: &Ends, position: TimePoint) -> f64 {
        let n = self.states.coordinates();
        let supports = self.driven.excitation.map_or(&[][..], |e| &e.supports);
        let of = |(j, factor): &(usize, f64)| {
            let support = supports.get(j.checked_sub(n)?)?;
            Some(
                factor
                    * match kind {
                        ChannelKind::Displacement => support.displacement.at(position),
                        _ => support.velocity.at(position),
                    },
            )
        };
        row.entries().iter().filter_map(of).sum()
    }

    fn displacement(&self, j: usize, TimePoint { step: i, fraction }: TimePoint) -> f64 {
        let (q, v) = (self.states.displacement(j), self.states.velocity(j));
        match fraction {
            0.0 => q[i],
            1.0 => q[i + 1],
            x => {
                let weights = hermite(x, self.driven.system.grid.step());
                let ends = [q[i], v[i], q[i + 1], v[i + 1]];
                weights.iter().zip(ends).map(|(w, end)| w * end).sum()
            }
        }
    }

    fn velocities(&mut self, position: TimePoint) -> Vec<f64> {
        let (states, i) = (self.states, position.step);
        let n = states.coordinates();
        let at_node = |node: usize| (0..n).map(move |j| states.velocity(j)[node]);
        match position.fraction {
            0.0 => at_node(i).collect(),
            1.0 => at_node(i + 1).collect(),
            x => {
                let by = hermite(x, self.driven.system.grid.step());
                let mut accelerations = |fraction: f64| {
                    self.solve(TimePoint {
                        fraction,
                        ..position
                    });
                    self.stage.a.clone()
                };
                let [left, right] = [0.0, 1.0].map(&mut accelerations);
                let velocities = at_node(i).zip(at_node(i + 1));
                let accelerations = left.iter().zip(&right);
                let pairs = velocities.zip(accelerations);
                let each = pairs
                    .map(|((v0, v1), (a0, a1))| by[0] * v0 + by[1] * a0 + by[2] * v1 + by[3] * a1);
                each.collect()
            }
        }
    }

    /// Solves the equation of motion at `position`.
    fn solve(&mut self, position: TimePoint) {
        let n = self.states.coordinates();
        let q: Vec<f64> = (0..n).map(|j| self.displacement(j, position)).collect();
        let v = self.velocities(position);
        let (i, x) = (position.step, position.fraction);
        let values = &mut self.stage.values;
        for (to, f) in values.functions.iter_mut().zip(&self.functions) {
            *to = match x {
                0.0 => f[i],
                1.0 => f[i + 1],
                x => f[i] * (1.0 - x) + f[i + 1] * x,
            };
        }
        if let Some(excitation) = self.driven.excitation {
            let set = |to: &mut [f64], inputs: &[(usize, StageSamples)]| {
                (inputs.iter()).for_each(|(j, samples)| to[*j] = samples.at(position));
            };
            set(&mut values.forces, &excitation.forces);
            set(&mut values.frames, &excitation.frames);
            let [of_q, of_v, of_a] = &mut values.supports;
            for (s, support) in excitation.supports.iter().enumerate() {
                of_q[s] = support.displacement.at(position);
                of_v[s] = support.velocity.at(position);
                of_a[s] = support.acceleration.at(position);
            }
        }
        let structure = &self.driven.system.structure;
        let z: Vec<f64> = (2 * n..self.states.components())
            .map(|c| {
                let values = self.states.component(c);
                match x {
                    0.0 => values[i],
                    1.0 => values[i + 1],
                    x => values[i] * (1.0 - x) + values[i + 1] * x,
                }
            })
            .collect();
        if self.stage.solve(structure, 0.0, [&q, &v, &z]).is_err() {
            self.stage.a.fill(f64::NAN);
        }
    }

    /// Adds the derivatives of the displacements with some weights.
    fn add_displacement(&mut self, weights: &[f64], position: TimePoint) {
        let n = weights.len();
        let by = hermite(position.fraction, self.driven.system.grid.step());
        for (j, weight) in weights.iter().enumerate() {
            for side in 0..2 {
                self.out.states[side][j] += weight * by[2 * side];
                self.out.states[side][n + j] += weight * by[2 * side + 1];
            }
        }
    }

    fn add_velocity(&mut self, weights: &[f64], position: TimePoint) {
        let n = weights.len();
        let x = position.fraction;
        let by = hermite(x, self.driven.system.grid.step());
        for side in 0..2 {
            for (j, weight) in weights.iter().enumerate() {
                self.out.states[side][n + j] += weight * by[2 * side];
            }
            if by[2 * side + 1] != 0.0 {
                let weights: Vec<f64> = weights.iter().map(|w| w * by[2 * side + 1]).collect();
                let fraction = side as f64;
                self.add_acceleration(
                    &weights,
                    TimePoint {
                        fraction,
                        ..position
                    },
                );
            }
        }
    }

    fn add_acceleration(&mut self, weights: &[f64], position: TimePoint) {
        self.solve(position);
        let [by_q, by_v, by_z] = self.pull(weights);
        for (side, share) in [1.0 - position.fraction, position.fraction]
            .into_iter()
            .enumerate()
        {
            let pairs = self.out.functions[side]
                .iter_mut()
                .zip(&self.shares.functions);
            pairs.for_each(|(to, by)| *to += share * by);
            let internal = self.out.states[side][2 * weights.len()..].iter_mut();
            let pairs = internal.zip(&by_z);
            pairs.for_each(|(to, by)| *to += share * by);
        }
        self.add_displacement(&by_q, position);
        self.add_velocity(&by_v, position);
    }
}
