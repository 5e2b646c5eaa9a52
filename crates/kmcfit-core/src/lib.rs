//! Numerics of kmcfit: time-varying mass, damping and stiffness of an oscillator from its measured motion.
//!
//! Modules, in the order in which data flow:
//!
//! 1. `system`: time grid, integrators, elements; `functions`: from parameters to mass, damping and stiffness at the nodes.
//! 2. `record`: inputs, channels, sensors, weights; `constraints`: rows and cones in the parameters.
//! 3. `problem`: system, records, penalties and constraints.
//! 4. `simulate`: the response, its linearisation and its adjoints, plainly (`reference`) and specialised (`fast`).
//! 5. `objective`: the cost of the parameters and its gradient, from one simulation per point.
//! 6. `qp`: the convex subproblems; without active inequalities by an elimination along time or a sparse factorisation,
//!    otherwise by Clarabel.
//! 7. `solvers`: steepest descent, L-BFGS, projected gradient, Gauss–Newton, the equation error; starting points, the
//!    choice of a weight.
//! 8. `identifiability`: what records can determine, confidence bands, experiment design; `study`: profiles,
//!    equivalent and extreme systems, multistart, constancy test, bootstrap, prediction; `assessment`: tests of a fit.
//! 9. `builder`: a problem in a few lines of Rust.
//!
//! Beside these, `diagnostics` has tests of residuals, `signal` interpolation, excitation, filters and spectra, `simd` vector
//! arithmetic, `host` the services of the host and `threads` second threads.
//!
//! # Example
//!
//! A device whose mass falls along a line is simulated, and found again from its motion:
//!
//! ```
//! use kmcfit_core::{NodalCoefficients, Grid, Method, System, State, Term};
//! use kmcfit_core::{Basis, CoefficientFunction, Parameterization, CoefficientKind};
//! use kmcfit_core::GradientKind;
//! use kmcfit_core::{Channel, Experiment, Weighting};
//! use kmcfit_core::Problem;
//! use kmcfit_core::{FitSettings, Initial, Solver, Status, Stopping, fit};
//!
//! // The device: m = 1 - t/50 kg, c = 0, k = 1 N/m, over 25 s.
//! let grid = Grid::new(0.0, 25.0, 1001).expect("a grid");
//! let nodes = grid.nodes();
//! let truth = NodalCoefficients {
//!     mass: grid.times().iter().map(|t| 1.0 - t / 50.0).collect(),
//!     coefficients: vec![vec![0.0; nodes], vec![1.0; nodes]],
//! };
//! let oscillator = System {
//!     grid,
//!     method: Method::Rk4,
//!     terms: vec![Term::Damping, Term::Stiffness],
//! };
//! let initial = State { displacement: 3.3, velocity: 1.0 };
//! let motion = oscillator.forward(&truth, initial, None).expect("a motion");
//!
//! // What is sought: a line for the mass and a constant for the damping; the stiffness is known.
//! let line = Basis::Polynomial { degree: 1 };
//! let start = line.constant(&grid, 2.0);
//! let list = vec![
//!     CoefficientFunction::free(CoefficientKind::Mass, line, &grid, start),
//!     CoefficientFunction::constant(CoefficientKind::Damping, 1.0, nodes),
//!     CoefficientFunction::fixed(CoefficientKind::Stiffness, vec![1.0; nodes]),
//! ];
//! let functions = Parameterization::new(list, nodes, grid.step()).expect("independent functions");
//! let weighting = Weighting::Integral { spacing: grid.step() };
//! let channel = Channel::displacement_at_nodes(motion.displacement, 1, weighting, &grid);
//! let record = Experiment::free("free decay", initial, nodes).with_channel(channel);
//! let problem = Problem::new(oscillator, functions, vec![record]).unwrap();
//!
//! let settings = FitSettings {
//!     solver: Solver::GaussNewton,
//!     initial: Initial::Functions,
//!     gradient: GradientKind::Discrete,
//!     stopping: Stopping::default(),
//!     interrupt: None,
//! };
//! let found = fit(&problem, &problem.functions.start(), &settings, &mut |_| {}).expect("a motion");
//! assert_eq!(found.outcome.status, Status::Converged);
//! let mass = &found.best.evaluation.device.mass;
//! let error = mass.iter().zip(&truth.mass).map(|(m, t)| (m - t).abs()).fold(0.0, f64::max);
//! assert!(error < 1e-9, "{error}");
//! ```
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::disallowed_macros))]
// Items of the public API refer to internals, which `--document-private-items` shows.
#![allow(rustdoc::private_intra_doc_links)]
#![allow(
    clippy::result_large_err,
    reason = "what failed is returned to be used again"
)]
mod assessment;
mod builder;
mod constraints;
mod diagnostics;
mod functions;
mod host;
mod identifiability;
mod objective;
mod problem;
mod qp;
mod record;
mod rows;
mod signal;
mod simd;
mod simulate;
mod solvers;
mod study;
mod system;
mod threads;

// The public API, by topic. `tests/api.rs` holds it to `api.txt`: it grows only on purpose.

// Problems.
pub use builder::{BuildError, Builder, Part, Record};
pub use constraints::{Limit, Shape, Statement};
pub use functions::{
    Basis, CoefficientFunction, CoefficientKind, Parameterization, Penalty, Prior, ScalarParameter,
    Variation,
};
pub use problem::{Problem, ProblemError, ProblemParts};
pub use record::{Channel, ChannelKind, Experiment, Loss, Sensor, Weighting};
pub use signal::{Interpolation, Signal};
pub use system::{Excitation, Grid, Method, NodalCoefficients, State, System, Term};
// Simulation and cost.
pub use objective::{Evaluation, Gradient, GradientError, GradientKind};
pub use simulate::{Cause, SimulationError, Trajectory};
// Fits.
pub use solvers::{
    Attempt, Counts, Fit, FitSettings, Initial, Optimality, Outcome, Reason, Solver, StartStrategy,
    Status, Stopping, Timings, WeightPath, WeightRule, choose_weight, fit,
};
// Inference.
pub use assessment::{FitAssessment, FitWarning, Unidentified};
pub use identifiability::{BandSettings, Bands, count, verdicts};
pub use study::{Profile, ProfileSettings, Target, profile};
// Services of the host.
pub use host::{Host, provide};

#[doc(hidden)]
pub mod internals;
