//! Convex subproblems behind one door: the only place that knows Clarabel.
//!
//! Every subproblem is a least-squares problem in residual form with linear and second-order-cone
//! constraints ([`Subproblem`]). [`Subproblem::solve_plain`] solves it without its inequalities by
//! one elimination, at once or along time, or one sparse factorisation; [`Subproblem::solve`] solves all of it by Clarabel.

mod chain;
mod clarabel;
mod dense;
mod factor;
mod projection;
mod subproblem;

pub use self::clarabel::{ConicStatus, Solution};
pub use projection::{Projection, RowPlace, project, project_within};
pub use subproblem::Subproblem;
