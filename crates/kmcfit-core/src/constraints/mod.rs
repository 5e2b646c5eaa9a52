//! Constraints: named linear rows and second-order cones on the parameters of all functions.
//!
//! What is demanded of the functions is a [`Constraint`]; [`Constraint::build`] turns it into rows.

mod build;
mod set;
mod soft;
mod violation;

pub use crate::rows::Rows;
pub use build::{Constraint, ConstraintError, Shape, TimeHistory};
pub use set::{Cone, ConeGroup, Constraints, RowGroup};
pub use violation::TOLERANCE;
