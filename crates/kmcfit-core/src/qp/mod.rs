//! Convex subproblems; the only module that uses Clarabel.
//!
//! Each subproblem is a least-squares problem in residual form with linear and second-order-cone constraints ([`Subproblem`]).
//! [`Subproblem::solve_equality_constrained`] solves it with its equalities only, by one elimination or one sparse factorisation;
//! [`Subproblem::solve`] the full problem: by an interior point along time, in few variables by active sets, otherwise by Clarabel, which
//! [`Subproblem::solve_by_clarabel`] uses alone.

mod chain;
mod clarabel;
mod contradiction;
mod dot2;
mod dual_active_set;
mod equalities;
mod few_variables;
mod kkt;
mod layout;
mod ldl;
mod polish;
mod primal_dual;
mod projection;
mod scaling;
mod solve;
mod stages;
mod subproblem;

pub(crate) use chain::BandedFactor;
pub use kkt::Kkt;
pub(crate) use layout::{ResponseVariables, StageLayout};
pub(crate) use primal_dual::PrimalDual;
pub use projection::project;
pub(crate) use projection::project_by;
pub use solve::ConicStatus;
pub(crate) use solve::Solution;

pub use subproblem::Subproblem;
