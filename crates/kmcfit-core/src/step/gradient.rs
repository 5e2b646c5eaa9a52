//! Accumulation of derivatives with respect to the coefficient functions.

use crate::system::NodalCoefficients;

/// Storage for derivatives with respect to the functions.
#[derive(Debug)]
pub enum CoefficientGradient<'a> {
    /// Derivatives with respect to nodal values.
    AtNodes(&'a mut NodalCoefficients),
    /// Sums over the nodes, one per function, inertias first: the derivatives with respect to constant functions.
    Summed(&'a mut [f64]),
}

impl CoefficientGradient<'_> {
    /// Number of functions.
    pub(crate) fn functions(&self) -> usize {
        match self {
            CoefficientGradient::AtNodes(nodal) => nodal.functions().count(),
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
