//! Convex subproblems behind one door: the only place that knows Clarabel.
//!
//! Every subproblem is a least-squares problem in residual form with linear and second-order-cone
//! constraints ([`Subproblem`]). [`Subproblem::solve_plain`] solves it without its inequalities by
//! one elimination, at once or along time, or one sparse factorisation; [`Subproblem::solve`] solves all of it by Clarabel.

mod candidate;
mod chain;
mod clarabel;
mod contradiction;
mod dense;
mod factor;
mod kkt;
mod normal;
mod polish;
mod projection;
mod solve;
mod subproblem;

pub use candidate::Candidate;
pub use kkt::Kkt;
pub use projection::{project, project_within};
pub use solve::{ConicStatus, Solution};
pub use subproblem::Subproblem;
