//! A short course: from a record to the device behind it.
//!
//! 1. [`tutorial`] fits the paper's record, then a record of one's own. Each step is a
//!    shipped model and one command.
//! 2. [`choosing`] says which method, which basis and which constraint fit which record, and shows how fits
//!    go wrong and what cures them.
//! 3. [`theory`] has the equations: the device, the cost, the adjoints, Gauss–Newton, and what a record can
//!    show.
//!
//! Programs in Rust use [`builder`](kmcfit_core::internals::builder); [`Run`](crate::Run)
//! loads results back.
//!
//! The pages are those of `docs/`, their equations turned into MathML, which browsers draw by themselves.

#[cfg_attr(doc, doc = include_str!("tutorial.md"))]
pub mod tutorial {}

#[cfg_attr(doc, doc = include_str!("choosing.md"))]
pub mod choosing {}

#[cfg_attr(doc, doc = include_str!("theory.md"))]
pub mod theory {}
