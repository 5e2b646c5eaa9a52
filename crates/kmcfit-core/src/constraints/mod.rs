//! Constraints: named linear rows and second-order cones on the parameters of all functions.
//!
//! A [`Constraint`] is a condition on coefficient functions; [`Constraint::build`] computes its rows.

mod kinds;
mod set;
mod soft;
mod violation;

pub use crate::rows::Rows;
pub(crate) use kinds::ConstraintError;
pub use kinds::{Constraint, Shape, TimeHistory};
pub(crate) use set::ConeGroup;
pub use set::{Cone, Constraints, RowGroup};
pub use violation::TOLERANCE;
