//! Responses, tangents and adjoints of a structure along a record.

use super::super::Trajectory;
use super::super::error::Cause;
use super::super::tableau::At;
use super::stage::{StageValues, Unsolved};
use super::stage_derivatives::StageShares;
use super::step::{Source, Steps};
use crate::simd::LANES;
use crate::structure::Structure;
use crate::system::{Excitation, Method, StageSamples};
use thiserror::Error;

/// A structure over a record: the values of its functions at the nodes, and what moves it.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// Coordinates, inertias, elements.
    pub structure: &'a Structure,
    /// Method of the steps.
    pub method: Method,
    /// Step, s.
    pub step: f64,
    /// Values of each function of the structure at the nodes, between which it is linear.
    pub functions: &'a [&'a [f64]],
    /// What moves it; `None` for a free motion.
    pub excitation: Option<&'a Excitation>,
}

/// A motion that cannot be computed.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("{} node {node}", match .cause {
    Cause::Mass => "the mass matrix is not positive definite in the step from",
    Cause::NoConvergence => "there is no solution of the implicit step from",
    Cause::Overflow | Cause::CostOverflow => "the response overflows at",
})]
pub struct MotionError {
    /// Cause.
    pub cause: Cause,
    /// As that of a [`SimulationError`](crate::SimulationError).
    pub node: usize,
}

/// Changes of the functions at the nodes; inputs do not change.
struct Changes<'a>(&'a [&'a [f64]]);

fn at_stage(values: &[f64], step: usize, at: At) -> f64 {
    match at {
        At::Left => values[step],
        At::Middle => (values[step + 1] + values[step]) * 0.5,
        At::Right => values[step + 1],
    }
}

impl Source<f64> for Changes<'_> {
    fn read(&self, step: usize, at: At, values: &mut StageValues<f64>) {
        for (to, function) in values.functions.iter_mut().zip(self.0) {
            *to = at_stage(function, step, at);
        }
    }
}

impl Source<f64> for Motion<'_> {
    fn read(&self, step: usize, at: At, values: &mut StageValues<f64>) {
        Changes(self.functions).read(step, at, values);
        let Some(excitation) = self.excitation else {
            return;
        };
        let sample = |samples: &StageSamples| samples.stages()[at as usize][step];
        for (coordinate, samples) in &excitation.forces {
            values.forces[*coordinate] = sample(samples);
        }
        for (coordinate, samples) in &excitation.frames {
            values.frames[*coordinate] = sample(samples);
        }
        let [q, v, a] = &mut values.supports;
        for (s, support) in excitation.supports.iter().enumerate() {
            q[s] = sample(&support.displacement);
            v[s] = sample(&support.velocity);
            a[s] = sample(&support.acceleration);
        }
    }
}

impl<'a> Motion<'a> {
    fn steps(&self) -> Steps<'a, f64> {
        assert_eq!(
            self.functions.len(),
            self.structure.functions(),
            "values of each function"
        );
        assert_eq!(
            self.excitation.map_or(0, |e| e.supports.len()),
            self.structure.supports(),
            "a motion of each support"
        );
        Steps::new(self.structure, self.method, self.step, 0.0)
    }

    fn error(node: usize, unsolved: Unsolved) -> MotionError {
        let cause = match unsolved {
            Unsolved::Mass => Cause::Mass,
            Unsolved::Newton => Cause::NoConvergence,
        };
        MotionError { cause, node }
    }

    /// Response from the state `initial`: the displacements of all coordinates, then their velocities. `states` gives the number of nodes.
    /// Whether explicit steps are short enough to be stable is not tested here.
    ///
    /// # Errors
    /// A [`MotionError`] if the mass matrix is not positive definite, an implicit step is not solved, or the response overflows.
    ///
    /// # Panics
    /// If functions, inputs or states do not fit the structure.
    pub fn respond(&self, initial: &[f64], states: &mut Trajectory) -> Result<(), MotionError> {
        let mut steps = self.steps();
        let mut x = initial.to_vec();
        states.write(0, &x);
        for i in 0..states.nodes() - 1 {
            (steps.advance(self, i, &mut x)).map_err(|unsolved| Self::error(i, unsolved))?;
            states.write(i + 1, &x);
        }
        let overflow = |node| MotionError {
            cause: Cause::Overflow,
            node,
        };
        states
            .first_not_finite()
            .map_or(Ok(()), |node| Err(overflow(node)))
    }

    /// Derivatives of a cost of the response `states` with the derivatives `source` by the states at all nodes: those by the functions' values
    /// at the nodes are added to `gradient`, those by the initial state are returned. The exact transpose of [`Motion::tangent`].
    ///
    /// # Errors
    /// As [`Motion::respond`].
    ///
    /// # Panics
    /// If the arguments do not fit the structure.
    pub fn adjoint(
        &self,
        states: &Trajectory,
        source: &Trajectory,
        gradient: &mut [&mut [f64]],
    ) -> Result<Vec<f64>, MotionError> {
        let mut steps = self.steps();
        let mut shares = StageShares::zeros(self.structure);
        // Of some neighbouring nodes: the columns of many functions lie on as many pages of memory, which cost more than the sums.
        let functions = self.functions.len();
        let mut gathered = vec![0.0; (LANES + 1) * functions];
        let zeros = vec![0.0; states.components()];
        let (mut x, mut next) = (zeros.clone(), zeros.clone());
        let (mut y, mut push) = (zeros.clone(), zeros);
        let last = states.nodes() - 1;
        source.read(last, &mut y);
        for i in (0..last).rev() {
            states.read(i, &mut x);
            states.read(i + 1, &mut next);
            (steps.linearise(self, i, &mut x, Some(&next)))
                .map_err(|unsolved| Self::error(i, unsolved))?;
            steps.pull(&mut y, &mut shares, |at, shares| {
                let [left, right] = at.shares();
                let nodes = &mut gathered[i % LANES * functions..][..2 * functions];
                let (at_left, at_right) = nodes.split_at_mut(functions);
                let ends = at_left.iter_mut().zip(at_right);
                for ((at_left, at_right), share) in ends.zip(&shares.functions) {
                    *at_left += left * share;
                    *at_right += right * share;
                }
            });
            if i % LANES == 0 {
                for (f, gradient) in gradient.iter_mut().enumerate() {
                    let of_function = gathered[f..].iter().step_by(functions);
                    let nodes = gradient[i..].iter_mut().zip(of_function);
                    nodes.for_each(|(to, found)| *to += found);
                }
                gathered.fill(0.0);
            }
            source.read(i, &mut push);
            y.iter_mut().zip(&push).for_each(|(y, push)| *y += push);
        }
        Ok(y)
    }

    /// Derivatives of the response `states` along changes of the functions' values at the nodes and of the initial state, for each of
    /// several directions, which share the linearised steps.
    ///
    /// # Errors
    /// As [`Motion::respond`].
    ///
    /// # Panics
    /// If the arguments do not fit the structure.
    pub(crate) fn tangents(
        &self,
        states: &Trajectory,
        directions: &[(&[&[f64]], &[f64])],
    ) -> Result<Vec<Trajectory>, MotionError> {
        let mut steps = self.steps();
        let zeros = vec![0.0; states.components()];
        let (mut x, mut next) = (zeros.clone(), zeros);
        let empty = Trajectory::like(states);
        let begin = |(_, initial): &(_, &[f64])| {
            let mut out = empty.clone();
            out.write(0, initial);
            (out, initial.to_vec())
        };
        let mut all: Vec<(Trajectory, Vec<f64>)> = directions.iter().map(begin).collect();
        for i in 0..states.nodes() - 1 {
            states.read(i, &mut x);
            states.read(i + 1, &mut next);
            (steps.linearise(self, i, &mut x, Some(&next)))
                .map_err(|unsolved| Self::error(i, unsolved))?;
            for ((out, change), (functions, _)) in all.iter_mut().zip(directions) {
                steps.push(&Changes(functions), i, change);
                out.write(i + 1, change);
            }
        }
        Ok(all.into_iter().map(|(out, _)| out).collect())
    }

    /// The state after step `i` from the state `x`, and for each of its components the multipliers of the state before the step and the
    /// derivatives by the functions, forces and frames at both nodes, between which they are linear.
    pub(crate) fn step_derivatives(
        &self,
        i: usize,
        x: &mut [f64],
    ) -> Result<Vec<StepRow>, Unsolved> {
        let mut steps = self.steps();
        steps.linearise(self, i, x, None)?;
        let mut shares = StageShares::zeros(self.structure);
        let rows = (0..x.len()).map(|end| {
            let mut row = StepRow::zeros(self.structure);
            row.state[end] = 1.0;
            let StepRow {
                state,
                functions,
                forces,
                frames,
            } = &mut row;
            steps.pull(state, &mut shares, |at, shares| {
                add(at, &shares.functions, functions);
                add(at, &shares.forces, forces);
                add(at, &shares.frames, frames);
            });
            row
        });
        Ok(rows.collect())
    }
}

fn add(at: At, shares: &[f64], to: &mut [[f64; 2]]) {
    let [left, right] = at.shares();
    for (to, share) in to.iter_mut().zip(shares) {
        to[0] += left * share;
        to[1] += right * share;
    }
}

/// Derivatives of one component of the state after a step.
#[derive(Debug, Clone)]
pub(crate) struct StepRow {
    pub state: Vec<f64>,
    pub functions: Vec<[f64; 2]>,
    pub forces: Vec<[f64; 2]>,
    pub frames: Vec<[f64; 2]>,
}

impl StepRow {
    pub fn zeros(structure: &Structure) -> Self {
        let n = structure.coordinates();
        Self {
            state: vec![0.0; structure.components()],
            functions: vec![[0.0; 2]; structure.functions()],
            forces: vec![[0.0; 2]; n],
            frames: vec![[0.0; 2]; n],
        }
    }
}
