//! Prediction of the response to another excitation or initial state, with its uncertainty.
//!
//! The 95 % confidence band is that of the linearised response, `y(t) +- z sqrt(J(t) C J(t)^T)`, with the covariance `C`
//! of the parameters and `z = 1.96` (delta method); displacements only. The envelope is that of the responses of given
//! data-consistent extreme systems ([`super::extremes`]).

use super::extremes::Extreme;
use crate::diagnostics::NORMAL_975;
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::record::{Channel, Experiment, Weighting};
use crate::step::{SimulationError, Trajectory};
use crate::system::{Excitation, State};
use nalgebra::DMatrix;

/// Largest displacement of an extreme system beside that of the optimum which is a prediction: beyond it the records do not limit the response.
pub const BOUNDED: f64 = 10.0;

/// Initial state and excitation of a prediction.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictionCase {
    /// Name.
    pub name: String,
    /// State at the first node.
    pub initial: State,
    /// Excitation on the grid of the problem; `None` for a free response.
    pub excitation: Option<Excitation>,
}

impl PredictionCase {
    /// A free response with the shared coefficient set.
    pub fn free(name: impl Into<String>, initial: State) -> Self {
        Self {
            name: name.into(),
            initial,
            excitation: None,
        }
    }

    /// Predicts it at the parameters `theta`, with the confidence band of `covariance` and the envelope of `extremes`.
    ///
    /// # Errors
    /// A [`SimulationError`] if the simulation at the optimum fails.
    ///
    /// # Panics
    /// If the covariance is not one of the parameters.
    pub fn predict(
        &self,
        problem: &Problem,
        theta: &[f64],
        covariance: Option<&DMatrix<f64>>,
        extremes: &[Extreme],
    ) -> Result<Prediction, SimulationError> {
        let seen = with_run(problem, self);
        let evaluation = seen.evaluate(theta)?;
        let response = evaluation.trajectories[0].clone();
        let y = response.displacement(0);
        let band = covariance.map(|covariance| {
            assert_eq!(covariance.nrows(), theta.len(), "one row per parameter");
            let errors = standard_errors(&seen, &evaluation, covariance);
            band(y, errors.into_iter().flatten())
        });
        let mut envelope: Vec<[f64; 2]> = y.iter().map(|y| [*y, *y]).collect();
        let mut furthest: Option<(String, f64)> = None;
        let mut unbounded = Vec::new();
        let most = BOUNDED * y.iter().fold(0.0f64, |most, y| most.max(y.abs()));
        for extreme in extremes {
            let other = seen.evaluate(&extreme.parameters).ok();
            let is_bounded = |e: &Evaluation| {
                let mut all = e.trajectories[0].displacement(0).iter();
                all.all(|y| y.abs() <= most)
            };
            let Some(other) = other.filter(is_bounded) else {
                unbounded.push(extreme.name());
                continue;
            };
            let mut distance = 0.0f64;
            let others = other.trajectories[0].displacement(0);
            for ((ends, other), y) in envelope.iter_mut().zip(others).zip(y) {
                *ends = [ends[0].min(*other), ends[1].max(*other)];
                distance = distance.max((other - y).abs());
            }
            if furthest.as_ref().is_none_or(|(_, most)| distance > *most) {
                furthest = Some((extreme.name(), distance));
            }
        }
        Ok(Prediction {
            name: self.name.clone(),
            times: seen.system.grid.times(),
            band,
            worst: furthest.is_some().then_some(envelope),
            furthest,
            unbounded,
            response,
        })
    }
}

/// Predicted response of one case.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Name of the case.
    pub name: String,
    /// Times of the nodes, s.
    pub times: Vec<f64>,
    /// Response at the optimum.
    pub response: Trajectory,
    /// 95 % band of the displacement at each node, m; `None` without a covariance.
    pub band: Option<Vec<[f64; 2]>>,
    /// Envelope of the displacements of the optimum and the extreme systems, m; `None` if no extreme system could be
    /// simulated.
    pub worst: Option<Vec<[f64; 2]>>,
    /// Name of the extreme system with the largest difference from the optimum, and the difference, m.
    pub furthest: Option<(String, f64)>,
    /// Extreme systems without a bounded response: the simulation fails, or the displacement exceeds [`BOUNDED`] times that of the optimum.
    pub unbounded: Vec<String>,
}

/// Standard errors `sqrt(diag(J C J^T))` of the predictions of each channel, with their derivatives `J` in the parameters.
pub(super) fn standard_errors(
    problem: &Problem,
    evaluation: &Evaluation,
    covariance: &DMatrix<f64>,
) -> Vec<Vec<f64>> {
    let change = |j: usize| -> Vec<Vec<f64>> {
        let mut unit = vec![0.0; covariance.nrows()];
        unit[j] = 1.0;
        let change = problem.predictions_tangent(evaluation, &unit);
        change.into_iter().flatten().collect()
    };
    let changes: Vec<Vec<Vec<f64>>> = (0..covariance.nrows()).map(change).collect();
    let of_channel = |(c, samples): (usize, usize)| {
        let jacobian = DMatrix::from_fn(samples, changes.len(), |i, j| changes[j][c][i]);
        let spread = &jacobian * covariance;
        let variance = |i: usize| spread.row(i).dot(&jacobian.row(i));
        (0..samples).map(|i| variance(i).max(0.0).sqrt()).collect()
    };
    let samples = problem.channels().map(Channel::len);
    samples.enumerate().map(of_channel).collect()
}

/// 95 % band of values with these standard errors, which count as known.
pub(super) fn band(values: &[f64], errors: impl Iterator<Item = f64>) -> Vec<[f64; 2]> {
    let halves = errors.map(|error| NORMAL_975 * error);
    let pairs = values.iter().zip(halves);
    pairs.map(|(y, half)| [y - half, y + half]).collect()
}

/// The problem with the case as its only experiment and displacements at all nodes.
fn with_run(problem: &Problem, run: &PredictionCase) -> Problem {
    let mut seen = problem.clone();
    let grid = problem.system.grid;
    let nodes = grid.nodes();
    let zeros = vec![0.0; nodes];
    let channel = Channel::displacement_at_nodes(zeros, 1, Weighting::Sigma(1.0), &grid);
    let mut experiment = Experiment::free(run.name.clone(), run.initial.clone(), nodes);
    experiment.excitation.clone_from(&run.excitation);
    seen.parts_mut().experiments = vec![experiment.with_channel(channel)];
    seen
}
