//! Accumulation of derivatives with respect to the coefficient functions.

use crate::system::Device;

/// Where derivatives with respect to the functions of a device are added.
#[derive(Debug)]
pub enum Slopes<'a> {
    /// To those with respect to the values at the nodes.
    AtNodes(&'a mut Device),
    /// To their sums over the nodes, one a function, mass first: all that a constant asks for.
    Summed(&'a mut [f64]),
}

impl Slopes<'_> {
    /// Number of functions.
    pub(crate) fn functions(&self) -> usize {
        match self {
            Slopes::AtNodes(device) => 1 + device.coefficients.len(),
            Slopes::Summed(sums) => sums.len(),
        }
    }

    /// Adds the derivative with respect to the value of function `f` at a node.
    #[inline(always)]
    pub(crate) fn add(&mut self, f: usize, node: usize, slope: f64) {
        match self {
            Slopes::AtNodes(device) => device.function_mut(f)[node] += slope,
            Slopes::Summed(sums) => sums[f] += slope,
        }
    }
}
