//! User guide: identification of a system from a record.
//!
//! 1. [`tutorial`] fits the paper's record, then a record of one's own. Each step is a
//!    shipped model and one command.
//! 2. [`choosing`]: choice of method, basis and constraints for a record; failures of fits and their remedies.
//! 3. [`theory`]: the equations of system, cost, adjoints and Gauss–Newton, and identifiability.
//!
//! Programs in Rust use [`builder`](kmcfit_core::builder); [`Run`](crate::Run)
//! loads results back.
//!
//! The pages are those of `docs/`, their equations turned into MathML, which browsers draw by themselves.

#[cfg_attr(doc, doc = include_str!("tutorial.md"))]
pub mod tutorial {}

#[cfg_attr(doc, doc = include_str!("choosing.md"))]
pub mod choosing {}

#[cfg_attr(doc, doc = include_str!("theory.md"))]
pub mod theory {}
