//! Structures: inertias at coordinates, and elements between them.
//!
//! | file | what |
//! |---|---|
//! | `elements` | the table of coefficients with names and units, and the laws of their elements: a new element is added here |
//! | `hysteresis` | elements with an internal state and several coefficients |
//! | `ends` | rows `b`: how an elongation follows from coordinates and supports |
//! | `assembly` | a structure of any size, its table of inertias and elements, its natural frequencies |
//! | `banded` | symmetric banded matrices, for structures of any size |
//! | `link` | elements of the small structures whose size is compiled |

pub(crate) mod assembly;
pub(crate) mod banded;
mod elements;
mod ends;
mod hysteresis;
mod link;

pub use assembly::Structure;
pub(crate) use elements::MOST_ELEMENTS;
pub use elements::{CoefficientKind, Law};
pub use ends::Ends;
pub(crate) use hysteresis::Partials;
pub(crate) use link::Link;
