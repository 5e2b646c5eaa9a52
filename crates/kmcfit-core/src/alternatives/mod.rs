//! Problems with one thing changed, their refits, and linearisations beside them: for [candidates](crate::candidates) and
//! [assessment](crate::assessment).

mod clock;
mod disturbance;
mod extension;
mod finer;
mod inputs;
mod minimum;
mod record_parameters;
mod refit;
mod span;

pub(crate) use clock::on_best_clock;
pub(crate) use disturbance::{Disturbance, MOST_SAMPLES, TOLERANCE};
pub(crate) use extension::{extended, with_functions};
pub(crate) use finer::{applies, finer_basis};
pub(crate) use inputs::{measured, with_cubic_inputs, with_cubics, with_input};
pub(crate) use minimum::Minimum;
pub use record_parameters::RecordParameter;
pub(crate) use record_parameters::{
    Clock, RecordColumns, on_clock, predict, record_parameters, with_clock, with_gain,
    with_samples_of,
};
pub use refit::POOR;
pub(crate) use refit::{Refit, uncorrelated, without_correlation, worst_fit, worst_misfit};
pub(crate) use span::{Span, weighted_residuals};
