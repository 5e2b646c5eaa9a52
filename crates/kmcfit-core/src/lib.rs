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
//! use kmcfit_core::builder::{Builder, Record};
//! use kmcfit_core::model::CoefficientSpec;
//! use kmcfit_core::solvers::Status;
//! use kmcfit_core::structure::{CoefficientKind, Law, Structure};
//! use kmcfit_core::system::{Grid, Method, NodalCoefficients, State, System};
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
mod alternatives;
pub mod assessment;
pub mod builder;
pub mod candidates;
pub mod constraints;
pub mod diagnostics;
pub mod finding;
pub mod functions;
pub mod host;
pub mod identifiability;
pub mod model;
pub mod noise;
pub mod number_format;
pub mod objective;
pub mod problem;
pub mod qp;
pub mod record;
mod rows;
mod scalar_search;
mod severity;
pub mod signal;
pub mod simd;
pub mod solvers;
mod spans;
pub mod step;
pub mod structure;
pub mod study;
pub mod system;
pub mod threads;
