//! System and simulation under one name.

pub use crate::record::ChannelKind;
pub(crate) use crate::simulate::fast::nodal_observations::{Accelerations, Sight};
pub(crate) use crate::simulate::fast::padded_loads as window;
pub(crate) use crate::simulate::fast::sensitivities::{
    Change, Course, Slot, Steady, TILE, TILE_NODES, Tangents,
};
pub(crate) use crate::simulate::fast::step_batch::{Layout, Ray, Trials, replay};
pub use crate::simulate::*;
pub(crate) use crate::system::FUNCTIONS;
pub use crate::system::*;
