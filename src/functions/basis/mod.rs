//! Bases: each makes the design matrix from parameters to nodal values; one file each.

mod constant;
mod nodal;

pub use constant::constant;
pub use nodal::nodal;
