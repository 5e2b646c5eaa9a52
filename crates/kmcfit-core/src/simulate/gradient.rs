//! Accumulation of derivatives with respect to the coefficient functions.

use crate::system::NodalCoefficients;

/// Where derivatives with respect to the functions of a system are added.
#[derive(Debug)]
pub enum CoefficientGradient<'a> {
    /// To those with respect to the values at the nodes.
    AtNodes(&'a mut NodalCoefficients),
    /// To their sums over the nodes, one a function, mass first: all that a constant asks for.
    Summed(&'a mut [f64]),
}

impl CoefficientGradient<'_> {
    /// Number of functions.
    pub(crate) fn functions(&self) -> usize {
        match self {
            CoefficientGradient::AtNodes(nodal) => 1 + nodal.coefficients.len(),
            CoefficientGradient::Summed(sums) => sums.len(),
        }
    }

    /// Adds the derivative with respect to the value of function `f` at a node.
    #[inline(always)]
    pub(crate) fn add(&mut self, f: usize, node: usize, slope: f64) {
        match self {
            CoefficientGradient::AtNodes(nodal) => nodal.function_mut(f)[node] += slope,
            CoefficientGradient::Summed(sums) => sums[f] += slope,
        }
    }
}
