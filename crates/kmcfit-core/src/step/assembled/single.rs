//! Systems of one coordinate as structures of any size: those of the methods that have no compiled steps.

use super::super::engine::{Driven, Maps};
use super::super::error::{SimulationError, at};
use super::super::{CoefficientGradient, Trajectory};
use super::{Motion, MotionError};
use crate::simd::LANES;
use crate::system::{StageSamples, State};

impl Driven<'_> {
    fn with_motion<R>(self, call: impl FnOnce(&Motion) -> R) -> R {
        // Functions of terms without coefficients are zero.
        let zeros = vec![0.0; self.nodal.inertias[0].len()];
        let given: Vec<&[f64]> = self.nodal.functions().collect();
        let functions: Vec<&[f64]> = (0..=self.system.laws().len())
            .map(|f| given.get(f).map_or(zeros.as_slice(), |values| values))
            .collect();
        let one = |part: fn(&crate::system::Excitation) -> &Option<StageSamples>| {
            let samples = self
                .excitation
                .and_then(|excitation| part(excitation).as_ref());
            samples.map(|samples| (0, samples))
        };
        let (force, base) = (one(|e| &e.force), one(|e| &e.base));
        call(&Motion {
            structure: &self.system.structure,
            method: self.system.method,
            step: self.system.grid.step(),
            functions: &functions,
            forces: force.as_slice(),
            frames: base.as_slice(),
            supports: &[],
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
        let nodes = self.nodal.inertias[0].len();
        let mut all = vec![vec![0.0; nodes]; 1 + self.system.laws().len()];
        let mut columns: Vec<&mut [f64]> = all.iter_mut().map(Vec::as_mut_slice).collect();
        let initial = self.with_motion(|motion| motion.adjoint(trajectory, source, &mut columns));
        match gradient {
            CoefficientGradient::AtNodes(nodal) => {
                for (to, found) in nodal.functions_mut().zip(&all) {
                    to.iter_mut().zip(found).for_each(|(to, x)| *to += x);
                }
            }
            CoefficientGradient::Summed(sums) => {
                for (to, found) in sums.iter_mut().zip(&all) {
                    *to += found.iter().sum::<f64>();
                }
            }
        }
        let initial = initial.unwrap_or_else(|_| vec![f64::NAN; 2]);
        State::one(initial[0], initial[1])
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
