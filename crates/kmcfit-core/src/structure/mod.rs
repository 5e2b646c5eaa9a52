//! Structures: inertias at coordinates, and elements between them.
//!
//! | file | what |
//! |---|---|
//! | `law` | forces of elements and their slopes: a new element is a variant of [`Law`] |
//! | `hysteresis` | elements with an internal state and several coefficients |
//! | `ends` | rows `b`: how an elongation follows from coordinates and supports |
//! | `assembly` | a structure of any size, its table of inertias and elements, its natural frequencies |
//! | `banded` | symmetric banded matrices, for structures of any size |
//! | `link` | elements of the small structures whose size is compiled |

mod assembly;
pub(crate) mod banded;
mod ends;
mod hysteresis;
mod law;
mod link;

pub use assembly::{Structure, StructureError};
pub use ends::Ends;
pub(crate) use hysteresis::Partials;
pub use law::{Law, MOST_ELEMENTS};
pub(crate) use link::Link;
