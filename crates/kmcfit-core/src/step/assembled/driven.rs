//! Systems whose steps are not compiled: several coordinates, supports, implicit methods.

use super::super::engine::{Driven, Maps};
use super::super::error::{SimulationError, at};
use super::super::{CoefficientGradient, Trajectory};
use super::sweeps::StepRow;
use super::{Motion, MotionError};
use crate::simd::LANES;
use crate::system::{State, SystemTangent};

impl Driven<'_> {
    /// Functions of elements without coefficients are zero.
    pub(in crate::step) fn with_motion<R>(self, call: impl FnOnce(&Motion) -> R) -> R {
        let zeros = vec![0.0; self.nodal.nodes()];
        let given = self.nodal.functions();
        let functions: Vec<&[f64]> = given
            .chain(std::iter::repeat(zeros.as_slice()))
            .take(self.system.structure.functions())
            .collect();
        call(&Motion {
            structure: &self.system.structure,
            method: self.system.method,
            step: self.system.grid.step(),
            functions: &functions,
            excitation: self.excitation,
        })
    }

    fn failed(self, error: MotionError) -> SimulationError {
        at(&self.system.grid, error.cause, error.node, f64::NAN)
    }

    /// [`Driven::respond`] by the assembled structure.
    pub(in crate::step) fn respond_assembled(
        self,
        initial: &State,
        trajectory: &mut Trajectory,
    ) -> Result<(), SimulationError> {
        self.with_motion(|motion| motion.respond(initial.components(), trajectory))
            .map_err(|error| self.failed(error))
    }

    /// [`Driven::adjoint`] by the assembled structure; not a number where a step has no solution.
    pub(in crate::step) fn adjoint_assembled(
        self,
        trajectory: &Trajectory,
        source: &Trajectory,
        gradient: CoefficientGradient,
    ) -> State {
        let add_to = |columns: &mut [&mut [f64]]| {
            self.with_motion(|motion| motion.adjoint(trajectory, source, columns))
        };
        let initial = match gradient {
            CoefficientGradient::AtNodes(nodal) => {
                let columns = nodal.functions_mut().map(Vec::as_mut_slice);
                add_to(&mut columns.collect::<Vec<_>>())
            }
            CoefficientGradient::Summed(sums) => {
                let mut all = vec![vec![0.0; self.nodal.nodes()]; sums.len()];
                let columns = all.iter_mut().map(Vec::as_mut_slice);
                let initial = add_to(&mut columns.collect::<Vec<_>>());
                for (to, found) in sums.iter_mut().zip(&all) {
                    *to += found.iter().sum::<f64>();
                }
                initial
            }
        };
        let components = initial.unwrap_or_else(|_| vec![f64::NAN; trajectory.components()]);
        State::of_components(trajectory.coordinates(), components)
    }

    /// [`Driven::tangent`] along several directions, by the assembled structure.
    pub(crate) fn tangents(
        self,
        trajectory: &Trajectory,
        directions: &[SystemTangent],
    ) -> Vec<Trajectory> {
        let zeros = vec![0.0; self.nodal.nodes()];
        let functions = directions.iter().map(|direction| {
            let given = direction.nodal.functions();
            let all = given.chain(std::iter::repeat(zeros.as_slice()));
            all.take(self.system.structure.functions()).collect()
        });
        let functions: Vec<Vec<&[f64]>> = functions.collect();
        let directions: Vec<(&[&[f64]], &[f64])> = (functions.iter().zip(directions))
            .map(|(functions, direction)| (functions.as_slice(), direction.initial.components()))
            .collect();
        let found = self.with_motion(|motion| motion.tangents(trajectory, &directions));
        found.unwrap_or_else(|_| {
            let mut nothing = trajectory.clone();
            for c in 0..nothing.components() {
                nothing.component_mut(c).fill(f64::NAN);
            }
            vec![nothing; directions.len()]
        })
    }

    /// Passes the state after each step and the rows of its derivatives to `take`; not a number where a step has no solution.
    pub(in crate::step) fn each_assembled_step(
        self,
        trajectory: &Trajectory,
        mut take: impl FnMut(&[f64], &[StepRow]),
    ) {
        let mut x = vec![0.0; trajectory.components()];
        self.with_motion(|motion| {
            for i in 0..trajectory.nodes() - 1 {
                trajectory.read(i, &mut x);
                match motion.step_derivatives(i, &mut x) {
                    Ok(rows) => take(&x, &rows),
                    Err(_) => {
                        x.fill(f64::NAN);
                        let mut row = StepRow::zeros(motion.structure);
                        row.state.fill(f64::NAN);
                        take(&x, &vec![row; x.len()]);
                    }
                }
            }
        });
    }

    /// [`Driven::linearise`] by the assembled structure; not a number where a step has no solution.
    pub(in crate::step) fn linearise_assembled(
        self,
        trajectory: &Trajectory,
        from: usize,
        maps: &mut Maps,
    ) {
        let last = trajectory.nodes() - 2;
        self.with_motion(|motion| {
            for l in 0..LANES {
                let i = (from + l).min(last);
                let mut x = [trajectory.displacement(0)[i], trajectory.velocity(0)[i]];
                let before = x;
                let Ok(rows) = motion.step_derivatives(i, &mut x) else {
                    maps.increment.iter_mut().for_each(|row| row[l] = f64::NAN);
                    let growth = maps.growth.as_flattened_mut();
                    growth.iter_mut().for_each(|row| row[l] = f64::NAN);
                    continue;
                };
                for (end, row) in rows.iter().enumerate() {
                    maps.increment[end][l] = x[end] - before[end];
                    for (b, slope) in row.state.iter().enumerate() {
                        maps.growth[end][b][l] = slope - f64::from(u8::from(b == end));
                    }
                    for (f, [left, right]) in row.functions.iter().enumerate() {
                        (maps.left[f][end][l], maps.right[f][end][l]) = (*left, *right);
                        maps.sum[f][end][l] = left + right;
                    }
                    for side in 0..2 {
                        maps.forces[0][side][end][l] = row.forces[0][side];
                        maps.bases[0][side][end][l] = row.frames[0][side];
                    }
                }
            }
        });
    }
}
