//! Records of known systems by the independent evaluation of [`super::sensed`], and their fits.

use super::sensed::{Record, Response};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::ChannelKind;
use kmcfit_core::solvers::{Fit, FitSettings, Initial, Solver, Status, Stopping, fit};
use kmcfit_core::structure::Law;
use kmcfit_core::system::{
    Excitation, InputSample, NodalCoefficients, StageSamples, State, System,
};
use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// System, input and initial state.
pub struct Truth<'a> {
    pub system: &'a System,
    pub nodal: &'a NodalCoefficients,
    pub excitation: Option<&'a Excitation>,
    pub initial: State,
}

impl Truth<'_> {
    /// Samples of a perfect sensor at `times`; force and base there are `around`, or else linear
    /// over each step.
    pub fn seen(&self, kind: ChannelKind, times: &[f64], around: &[InputSample]) -> Vec<f64> {
        let record = self.record();
        let states = record.response();
        let grid = &self.system.grid;
        let sample = |(n, t): (usize, &f64)| {
            let x = (t - grid.start()) / grid.step();
            let nearest = x.round();
            let x = if (x - nearest).abs() < 1e-9 {
                nearest
            } else {
                x
            };
            let step = (x.floor() as usize).min(grid.nodes() - 2);
            let share = x - step as f64;
            let linear = |part: &[[f64; 3]]| part[step][0] * (1.0 - share) + part[step][2] * share;
            let driven = match around.get(n) {
                Some(around) => (around.force, around.base),
                None => (linear(&record.force), linear(&record.base)),
            };
            record.seen(kind, &states, (step, share), driven)
        };
        times.iter().enumerate().map(sample).collect()
    }

    fn record(&self) -> Record<f64> {
        let steps = self.system.grid.nodes() - 1;
        let part = |choose: &dyn Fn(&Excitation) -> Option<StageSamples>| {
            let given = self.excitation.and_then(choose);
            let mut values = given.map_or(Vec::new(), |p| p.iter().collect());
            values.resize(steps, [0.0; 3]);
            values
        };
        let terms = self.system.laws().iter().map(|term| response(*term));
        Record {
            method: self.system.method,
            dt: self.system.grid.step(),
            mass: self.nodal.inertias[0].clone(),
            terms: terms.zip(self.nodal.coefficients.iter().cloned()).collect(),
            force: part(&|e| e.force(0).cloned()),
            base: part(&|e| e.frame(0).cloned()),
            initial: (self.initial.displacement(0), self.initial.velocity(0)),
        }
    }
}

#[allow(
    clippy::match_wildcard_for_single_variants,
    reason = "of a law that is added, too"
)]
fn response(term: Law) -> Response {
    match term {
        Law::Damping => Response::Damping,
        Law::Stiffness => Response::Stiffness,
        Law::QuadraticStiffness => Response::QuadraticSpring,
        Law::CubicStiffness => Response::Cubic,
        Law::QuinticStiffness => Response::Quintic,
        Law::QuadraticDamping => Response::Quadratic,
        Law::CoulombFriction { width } => Response::Coulomb(width),
        Law::Offset => Response::Offset,
        other => unreachable!("{other:?} is not in the independent integrator"),
    }
}

/// Gauss-Newton from the start values of the functions.
pub fn settings() -> FitSettings {
    FitSettings {
        solver: Solver::GaussNewton,
        initial: Initial::Functions,
        gradient: GradientKind::Discrete,
        stopping: Stopping {
            tolerance: Some(1e-12),
            ..Stopping::exactly(100)
        },
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    }
}

/// The fit of `problem`, which must converge.
pub fn run(problem: &Problem) -> Fit {
    let found = fit(problem, &problem.start(), &settings(), &mut |_| {}).unwrap();
    assert_eq!(
        found.outcome.status,
        Status::Converged,
        "{:#?}",
        found.attempts
    );
    found
}

/// `values` plus `sigma` times standard normal numbers.
pub fn with_noise(values: &[f64], sigma: f64, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
    values.iter().map(|x| x + sigma * noise()).collect()
}

/// Root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// Covariance of the parameters by Cramer and Rao, `(J' W J)^-1` with the Jacobian of all predictions
/// at `theta` and the weights of the samples.
pub fn cramer_rao(problem: &Problem, theta: &[f64]) -> DMatrix<f64> {
    let jacobian = weighted_jacobian(problem, theta);
    let information = jacobian.transpose() * &jacobian;
    // Parameters of very different sizes: scaled to a unit diagonal, so that rounding does not matter.
    let scale = information.diagonal().map(|x| 1.0 / x.sqrt());
    let scale = DMatrix::from_diagonal(&scale);
    let scaled = &scale * information * &scale;
    let inverse = scaled.try_inverse().expect("independent parameters");
    &scale * inverse * &scale
}

/// `dz / dtheta` of all predictions, each row by the root of its sample's weight.
pub fn weighted_jacobian(problem: &Problem, theta: &[f64]) -> DMatrix<f64> {
    let here = problem.evaluate(theta).unwrap();
    let weight_roots: Vec<f64> = (problem.channels())
        .flat_map(|c| (0..c.len()).map(|i| c.weighting().weight(i, c.len()).sqrt()))
        .collect();
    let mut jacobian = DMatrix::zeros(weight_roots.len(), theta.len());
    let mut unit = vec![0.0; theta.len()];
    for j in 0..theta.len() {
        unit[j] = 1.0;
        let changes = problem.predictions_tangent(&here, &unit);
        unit[j] = 0.0;
        let all = changes.iter().flatten().flatten().zip(&weight_roots);
        for (i, (change, root)) in all.enumerate() {
            jacobian[(i, j)] = root * change;
        }
    }
    jacobian
}
