//! Structures: masses at coordinates, and elements between them.
//!
//! `m_j(t) (q_j'' + b_j'') + sum_e row_e p_e(t) phi_e(row_e q, row_e q') = f_j(t)` with the coordinates `q`, relative to frames that move by
//! `b_j`. A new element is a variant of [`Law`], with its force and slopes.

mod element;
mod law;

pub(crate) use element::Element;
pub use law::{Law, MOST_ELEMENTS};
