//! Measured records: inputs and channels.

mod kind;

pub use kind::ChannelKind;
