//! Adjoints: the gradient of a cost of the motion with respect to every function at every node.

pub mod continuous;
pub mod discrete;
mod in_lanes;
