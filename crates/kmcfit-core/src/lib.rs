//! Numerics of kmcfit: time-varying mass, damping and stiffness of a vibrating system from measured records.
//!
//! Modules, in the order in which data flow:
//!
//! 1. `system`: time grid, integrators, elements; `functions`: from parameters to mass, damping and stiffness at the nodes.
//! 2. `record`: inputs, channels, sensors, weights; `constraints`: rows and cones in the parameters.
//! 3. `problem`: system, records, penalties and constraints.
//! 4. `structure`: coordinates, inertias, elements; `step`: their response, its linearisation and its adjoints.
//! 5. `objective`: the cost of the parameters and its gradient, from one simulation per point.
//! 6. `qp`: the convex subproblems; without active inequalities by an elimination along time or a sparse factorisation,
//!    otherwise by Clarabel.
//! 7. `solvers`: steepest descent, L-BFGS, projected gradient, Gauss–Newton, the equation error; starting points, the
//!    choice of a weight.
//! 8. `identifiability`: what records can determine, confidence bands, experiment design; `study`: profiles,
//!    equivalent and extreme systems, multistart, prediction; `assessment`: tests of a fit.
//! 9. `builder`: a problem in a few lines of Rust.
//!
//! Beside these, `diagnostics` has tests of residuals, `noise` correlations of noise, `signal` interpolation, excitation, filters
//! and spectra, `simd` vector arithmetic, `host` the services of the host and `threads` second threads.
//!
//! # Example
//!
//! A system whose mass falls along a line is simulated, and identified from its response:
//!
//! ```
//! use kmcfit_core::{Builder, CoefficientKind, Record, Status};
//! use kmcfit_core::model::CoefficientSpec;
//! use kmcfit_core::{Grid, Law, Method, NodalCoefficients, State, Structure, System};
//!
//! // The system: m = 1 - t/50 kg, c = 0, k = 1 N/m, over 25 s.
//! let grid = Grid::new(0.0, 25.0, 1001).ok_or("a grid")?;
//! let (times, nodes) = (grid.times(), grid.nodes());
//! let truth = NodalCoefficients {
//!     inertias: vec![times.iter().map(|t| 1.0 - t / 50.0).collect()],
//!     coefficients: vec![vec![0.0; nodes], vec![1.0; nodes]],
//! };
//! let structure = Structure::one(vec![Law::Damping, Law::Stiffness]);
//! let system = System { grid, method: Method::Rk4, structure };
//! let response = system.forward(&truth, &State::one(3.3, 1.0), None)?;
//!
//! // Estimated: a line for the mass and a constant damping; the stiffness is known.
//! let mass = CoefficientSpec::polynomial(&[2.0, 0.0]);
//! let coefficients = [mass, CoefficientSpec::constant(1.0), CoefficientSpec::fixed(1.0)];
//! let record = Record::new("free decay").from_state(3.3, 1.0).displacement(&times, response.displacement(0));
//! let problem = Builder::new(coefficients).record(record).build()?;
//! let fit = problem.fit()?;
//!
//! assert_eq!(fit.outcome.status, Status::Converged);
//! let mass = problem.coefficient(CoefficientKind::MASS, &fit.best.parameters).ok_or("a mass")?;
//! let error = mass.iter().zip(&truth.inertias[0]).map(|(m, t)| (m - t).abs()).fold(0.0, f64::max);
//! assert!(error < 1e-9, "{error}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
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
mod finding;
mod functions;
mod host;
mod identifiability;
pub mod model;
mod noise;
mod number_format;
mod objective;
mod problem;
mod qp;
mod record;
mod rows;
mod scalar_search;
mod signal;
mod simd;
mod solvers;
mod spans;
mod step;
mod structure;
mod study;
mod system;
mod threads;

// The public API, by topic. `tests/api.rs` holds it to `api.txt`: it grows only on purpose.

// Problems.
pub use builder::{BuildError, Builder, ChannelSpec, Record};
pub use constraints::{Constraint, Shape, TimeHistory};
pub use functions::{CoefficientKind, Prior, Ratio, WeightRule};
pub use problem::{Problem, ProblemError};
pub use record::{ChannelKind, InputNoiseKind, Loss, NoiseModel, Weighting};
pub use signal::{Interpolation, Signal};
pub use system::{
    Excitation, Grid, InputQuantity, Method, NodalCoefficients, StageSamples, State, SupportMotion,
    System,
};
// Simulation and cost.
pub use objective::{Evaluation, Gradient, GradientKind};
pub use step::{Cause, Motion, MotionError, SimulationError, Trajectory};
pub use structure::{Ends, Law, Structure, StructureError};
// Fits.
pub use solvers::{
    Attempt, Fit, FitSettings, Initial, Optimality, Outcome, QpSolver, Reason, SolveCounts, Solver,
    StartStrategy, Status, Stopping, Timings, WeightPath, choose_weight, fit,
};
// Inference.
pub use assessment::{CoarseBasis, Doubt, FitAssessment, Unidentified};
pub use identifiability::{
    Bands, Curve, Quantities, Quantity, Target, classify_functions, structural_rank,
};
pub use study::{Profile, ProfileSettings, profile};
// Services of the host.
pub use host::{Host, set_host};

#[doc(hidden)]
pub mod internals;
