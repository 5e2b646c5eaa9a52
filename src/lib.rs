//! Finds the time-varying mass, damping and stiffness of an oscillator from its measured motion.
//!
//! New here? [`guide`] is a short course: a tutorial, how to choose and what goes wrong, the theory. [`builder`]
//! states a problem in a few lines of Rust.
//!
#![cfg_attr(doc, doc = include_str!("guide/equations.md"))]
//!
//! In the library: [`dynamics::Term`] has the terms, [`objective::Channel`] the sensors and [`objective::Loss`] the
//! losses; [`problem::Problem::evaluate`] computes `J`, [`dynamics::adjoint`] the adjoints.
//!
//! # Modules, in the order in which data flow
//!
//! 1. [`config`] reads a model file, and through [`observations`] its tables, and builds from it a
//! 2. [`problem`], validated and immutable; what is wrong with the input is an [`mod@error`].
//! 3. [`functions`] turns parameters into mass, damping and stiffness at the nodes, and knows their
//!    roughness and variation; [`dynamics`] turns those into a motion, its linearisation, its adjoints.
//! 4. [`objective`] is the cost of the parameters and its gradient, from one motion per point.
//! 5. [`constraints`] turns statements about the functions into rows and cones in the parameters.
//! 6. [`qp`] solves the convex subproblems: where no inequality is met by an elimination along time or
//!    a sparse factorisation, Clarabel where one is.
//! 7. [`solvers`] searches: steepest descent, L-BFGS, projected gradient, Gauss–Newton; the ladder of
//!    starts, the choice of a weight; and the equation error, which simulates nothing.
//! 8. [`diagnostics`] says whether what is left is noise, and which of two models to prefer.
//! 9. [`identifiability`] says what the readings can show, how far a fit may be off, and which record
//!    would show more; [`study`] asks further: profiles, equivalent and extreme devices, many starts,
//!    whether a function varies at all, bootstrap, prediction.
//! 10. [`report`] writes tables, figures, pages and the result document, loads them back
//!     ([`Run::open`]), and compares runs.
//! 11. [`cli`] is one file per command.
//!
//! Beside these, [`units`] knows units and their factors to SI, and [`signal`] what lies between
//! samples, shapes of excitation, filters and spectra.
//!
//! # Example
//!
//! A device whose mass falls along a line is simulated, and found again from its motion:
//!
//! ```
//! use kmcfit::dynamics::{Device, Grid, Method, Oscillator, State, Term};
//! use kmcfit::functions::{Basis, CoefficientFunction, Functions, Quantity};
//! use kmcfit::objective::{Channel, GradientKind, Weighting};
//! use kmcfit::problem::{Experiment, Problem};
//! use kmcfit::solvers::{FitSettings, Initial, Solver, Status, Stopping, fit};
//!
//! // The device: m = 1 - t/50 kg, c = 0, k = 1 N/m, over 25 s.
//! let grid = Grid::new(0.0, 25.0, 1001).expect("a grid");
//! let nodes = grid.nodes();
//! let truth = Device {
//!     mass: grid.times().iter().map(|t| 1.0 - t / 50.0).collect(),
//!     coefficients: vec![vec![0.0; nodes], vec![1.0; nodes]],
//! };
//! let oscillator = Oscillator {
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
//!     CoefficientFunction::free(Quantity::Mass, line, &grid, start),
//!     CoefficientFunction::constant(Quantity::Damping, 1.0, nodes),
//!     CoefficientFunction::fixed(Quantity::Stiffness, vec![1.0; nodes]),
//! ];
//! let functions = Functions::new(list, nodes, grid.step()).expect("independent functions");
//! let weighting = Weighting::Integral { spacing: grid.step() };
//! let channel = Channel::displacement_at_nodes(motion.displacement, 1, weighting, &grid);
//! let record = Experiment::free("free decay", initial, nodes).with_channel(channel);
//! let problem = Problem::new(oscillator, functions, vec![record]);
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
// All output passes `cli::output`, all changes of files `results`, all thread starts `threads`.
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::disallowed_macros))]
#![allow(
    clippy::result_large_err,
    reason = "an input error ends the program: its size costs nothing, its detail helps"
)]
pub mod builder;
pub mod cli;
pub mod config;
pub mod constraints;
pub mod diagnostics;
pub mod digest;
mod digits;
pub mod dynamics;
pub mod error;
mod excerpt;
mod faults;
pub mod functions;
pub mod guide;
pub mod identifiability;
mod input;
mod lanes;
mod memory;
mod near;
pub mod objective;
pub mod observations;
pub mod problem;
pub mod qp;
pub mod report;
pub mod results;
pub mod signal;
pub mod solvers;
pub mod study;
mod threads;
pub mod units;

pub use report::Run;
