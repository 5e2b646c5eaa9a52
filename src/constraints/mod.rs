//! Constraints: named linear rows and second-order cones on the parameters of all functions.

mod rows;
mod set;
mod violation;

pub use rows::Rows;
pub use set::{Cone, ConeGroup, Constraints, RowGroup};
pub use violation::{TOLERANCE, Violation};
