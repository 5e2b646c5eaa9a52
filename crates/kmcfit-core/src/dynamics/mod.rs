//! System and simulation under one name.

pub use crate::record::ChannelKind;
pub(crate) use crate::simulate::fast::step_batch::{Layout, Ray, Trials, replay};
pub use crate::simulate::*;
pub use crate::system::*;
