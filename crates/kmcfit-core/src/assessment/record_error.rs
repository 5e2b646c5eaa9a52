//! Errors of a record that no parameter of the model explains.

use crate::number_format::{count, significant};
use crate::system::InputQuantity;
use serde::Serialize;

/// An error of a record.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RecordError {
    /// The response is recorded later than the input; earlier if negative.
    Delay {
        /// Name of the experiment.
        experiment: String,
        /// The delay, s.
        delay: f64,
        /// The delay in samples of the first channel.
        samples: f64,
    },
    /// The clocks of input and response run at different rates.
    ClockDifference {
        /// Name of the experiment.
        experiment: String,
        /// Excess of the time in the system over that on the clock of the response, per cent.
        percent: f64,
    },
    /// Errors of few samples of the force, or unmeasured impacts, explain the residuals.
    InputPulses {
        /// Name of the experiment.
        experiment: String,
        /// Number of samples.
        count: usize,
        /// Time of the largest error, s.
        time: f64,
        /// The largest error, N: what the force lacks.
        error: f64,
    },
    /// The input jumps between two samples.
    InputJump {
        /// Name of the experiment.
        experiment: String,
        /// The input.
        input: InputQuantity,
        /// Times of the samples, s.
        between: [f64; 2],
        /// Change from one to the other, in the SI unit of the input.
        jump: f64,
    },
    /// The input acts against its sign.
    InputSign {
        /// Name of the experiment.
        experiment: String,
    },
    /// The samples of a channel are a multiple of the response.
    ChannelFactor {
        /// Name of the experiment.
        experiment: String,
        /// Kind of the channel.
        channel: String,
        /// Samples over the response.
        factor: f64,
        /// True if other channels of the record agree with the model without it.
        beside_others: bool,
    },
}

impl RecordError {
    /// The error as a clause.
    pub fn sentence(&self) -> String {
        match self {
            Self::Delay {
                experiment,
                delay,
                samples,
            } => format!(
                "the response of {experiment} {} its input by {} s ({} samples)",
                if *delay > 0.0 { "lags" } else { "leads" },
                significant(delay.abs(), 3),
                significant(samples.abs(), 3)
            ),
            Self::ClockDifference {
                experiment,
                percent,
            } => format!(
                "the clocks of input and response of {experiment} differ: the times of the response are {} % too {}",
                significant(percent.abs(), 3),
                if *percent > 0.0 { "short" } else { "long" }
            ),
            Self::InputPulses {
                experiment,
                count: pulses,
                time,
                error,
            } => format!(
                "the force of {experiment} has errors at {}, as by spikes, cut peaks or unmeasured impacts, the largest of about {} N near {} s",
                count(*pulses, "sample"),
                significant(*error, 2),
                significant(*time, 6)
            ),
            Self::InputJump {
                experiment,
                input,
                between: [from, to],
                jump,
            } => format!(
                "the {} of {experiment} jumps by {} {} between its samples at {} and {} s, and its interpolation does not have the time of the jump",
                input.name().replace('_', " "),
                significant(*jump, 3),
                input.unit(),
                significant(*from, 6),
                significant(*to, 6)
            ),
            Self::InputSign { experiment } => {
                format!("the input of {experiment} has the wrong sign")
            }
            Self::ChannelFactor {
                experiment,
                channel,
                factor,
                beside_others,
            } => format!(
                "the {channel} of {experiment} is {} times {}",
                significant(*factor, 4),
                match beside_others {
                    true => "what its other channels and the model give",
                    false => "what its input and the model give",
                }
            ),
        }
    }
}
