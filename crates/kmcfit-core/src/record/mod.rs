//! Measured records: inputs, channels, sensors and noise models.

mod channel;
mod experiment;
mod input;
mod input_error;
mod kind;
mod loss;
mod measured;
mod misfit;
mod noise;
mod sample_positions;
mod sensor;
mod weighting;
mod whitening;

pub use channel::Channel;
pub use experiment::Experiment;
pub use input::{BaseMotion, Input, Waveform};
pub use input_error::{InputNoise, InputNoiseKind};
pub use kind::ChannelKind;
pub use loss::Loss;
pub use measured::Measurements;
pub(crate) use measured::{Differences, Measured, Unsmoothed};
pub use misfit::integral_over;
pub use noise::{NoiseEstimate, NoiseModel, ScoreCovariance};
pub use sensor::Sensor;
pub use weighting::Weighting;
pub(crate) use whitening::Majorant;

/// Number of steps from which a record is processed in parts.
pub(crate) const LONG_RECORD_STEPS: usize = 1 << 15;
