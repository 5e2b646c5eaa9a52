//! What the samples can show of the functions, before a fit and after it, and which experiment would
//! show more.
//!
//! * [`count`]: from the problem alone, how many directions of the parameters can be seen at most, and
//!   which scale stays free;
//! * [`Sensitivity`] and [`SingularSpectrum`]: how well each direction is seen at a point;
//! * [`Gauge`]: the directions that leave the response unchanged, and whether an unseen direction is one;
//! * [`Bands`]: how far each function and ratio may be off;
//! * [`verdicts`]: the same in words; [`anchors`]: the instants at which a ratio is fixed;
//! * [`rank_experiments`]: which further record adds most.

mod active;
mod anchors;
mod band;
mod band_curves;
mod bands;
mod classification;
mod components;
mod covariance;
mod directions;
mod experiments;
mod factorisation;
mod gauge;
mod sensitivity;
mod spans;
mod structural_rank;
pub use classification::is_rounding;

use crate::problem::Problem;

/// Whether the samples alone decide on a point: nothing but the misfit is in the cost, and no constraint is active.
pub fn is_unhindered(problem: &Problem, theta: &[f64]) -> bool {
    !problem.is_regularised() && active::active_rows(problem, theta).is_empty()
}

pub use anchors::anchors;
pub use band::{Band, Side};
pub use bands::{BandSettings, Bands};
pub use classification::{
    Classification, ClassificationKind, FunctionClassification, classify_functions,
};
pub use experiments::{
    CandidateChannel, CandidateExperiment, Gain, Ranked, rank_experiments, residual_spread,
};
pub(crate) use factorisation::Factorisation;
pub use gauge::Gauge;
pub use sensitivity::{Seen, Sensitivity, SingularSpectrum};
pub use structural_rank::{RankFinding, RankFindingKind, Symmetry, structural_rank};
