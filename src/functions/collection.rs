//! All functions of a device, their parameters in one vector.

use super::{CoefficientFunction, Gram};
use crate::dynamics::Device;
use crate::dynamics::quadrature::{trapezoid, trapezoid_weights};
use std::ops::Range;

/// The functions of one device: mass first, then one per force term. Their parameters stand one
/// after the other in one vector `theta`.
#[derive(Debug, Clone)]
pub struct Functions {
    list: Vec<CoefficientFunction>,
    ranges: Vec<Range<usize>>,
    grams: Vec<Gram>,
    nodes: usize,
    step: f64,
}

impl Functions {
    /// Collects `list` (mass first) on `nodes` nodes of step `step` (s); `None` if some basis is
    /// linearly dependent on the grid or the list is empty.
    pub fn new(list: Vec<CoefficientFunction>, nodes: usize, step: f64) -> Option<Self> {
        let weights = trapezoid_weights(nodes, step);
        let grams: Option<Vec<Gram>> = list
            .iter()
            .map(|f| Gram::new(&f.design, &weights))
            .collect();
        let mut ranges = Vec::with_capacity(list.len());
        let mut first = 0;
        for function in &list {
            let end = first + function.parameters();
            ranges.push(first..end);
            first = end;
        }
        (!list.is_empty()).then_some(())?;
        Some(Self {
            list,
            ranges,
            grams: grams?,
            nodes,
            step,
        })
    }

    /// The functions, mass first.
    pub fn iter(&self) -> impl Iterator<Item = &CoefficientFunction> {
        self.list.iter()
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Number of all parameters.
    pub fn parameters(&self) -> usize {
        self.ranges.last().map_or(0, |r| r.end)
    }

    /// Where each function's parameters stand in `theta`.
    pub fn ranges(&self) -> &[Range<usize>] {
        &self.ranges
    }

    /// The start of the search.
    pub fn start(&self) -> Vec<f64> {
        self.list.iter().flat_map(|f| f.start.clone()).collect()
    }

    /// The same functions with another start of the search.
    ///
    /// # Panics
    /// If `theta` has another number of parameters.
    #[must_use]
    pub fn with_start(mut self, theta: &[f64]) -> Self {
        assert_eq!(theta.len(), self.parameters(), "one start per parameter");
        for (function, range) in self.list.iter_mut().zip(&self.ranges) {
            function.start.copy_from_slice(&theta[range.clone()]);
        }
        self
    }

    /// A device of the right shape, all zero.
    pub fn empty_device(&self) -> Device {
        Device::zeros(self.nodes, self.list.len() - 1)
    }

    /// The device with parameters `theta`.
    pub fn device(&self, theta: &[f64]) -> Device {
        let mut device = self.empty_device();
        self.device_into(theta, &mut device);
        device
    }

    /// [`Functions::device`] into storage that is used again.
    pub fn device_into(&self, theta: &[f64], device: &mut Device) {
        let parts = self.list.iter().zip(&self.ranges);
        for ((function, range), values) in parts.zip(device.functions_mut()) {
            function.values_into(&theta[range.clone()], values);
        }
    }

    /// `B theta` without the fixed parts: the change of the device along a direction.
    pub fn direction(&self, theta: &[f64]) -> Device {
        let mut device = self.empty_device();
        let parts = self.list.iter().zip(&self.ranges);
        for ((function, range), values) in parts.zip(device.functions_mut()) {
            function.design.multiply_add(&theta[range.clone()], values);
        }
        device
    }

    /// `B^T` applied to nodal values: Euclidean gradient in nodal values to Euclidean gradient in
    /// parameters.
    pub fn transpose(&self, nodal: &Device) -> Vec<f64> {
        let mut out = vec![0.0; self.parameters()];
        let parts = self.list.iter().zip(&self.ranges);
        for ((function, range), values) in parts.zip(nodal.functions()) {
            function
                .design
                .transpose_multiply_add(values, &mut out[range.clone()]);
        }
        out
    }

    /// Diagonal of `G`, all functions: the squared L2 norm of each parameter's function, s.
    pub fn gram_diagonal(&self) -> Vec<f64> {
        self.grams.iter().flat_map(Gram::diagonal).collect()
    }

    /// Diagonal of `sum_f 1/T integral (p_f / size_f)^2 dt` in the parameters, with a size for each
    /// function and `T = duration`. A function of size zero takes the largest size of all.
    pub fn relative_metric(&self, sizes: &[f64], duration: f64) -> Vec<f64> {
        let largest = sizes
            .iter()
            .copied()
            .fold(f64::MIN_POSITIVE.sqrt(), f64::max);
        let mut metric = self.gram_diagonal();
        for (range, size) in self.ranges.iter().zip(sizes) {
            let size = if *size > 0.0 { *size } else { largest };
            for g in &mut metric[range.clone()] {
                *g /= duration * size * size;
            }
        }
        metric
    }

    /// `G theta`, all functions.
    pub fn gram_multiply(&self, theta: &[f64]) -> Vec<f64> {
        self.each_gram(theta, Gram::multiply)
    }

    /// `G^-1 dual`, all functions.
    pub fn gram_solve(&self, dual: &[f64]) -> Vec<f64> {
        self.each_gram(dual, Gram::solve)
    }

    fn each_gram(&self, input: &[f64], apply: fn(&Gram, &[f64], &mut [f64])) -> Vec<f64> {
        let mut out = vec![0.0; input.len()];
        for (gram, range) in self.grams.iter().zip(&self.ranges) {
            apply(gram, &input[range.clone()], &mut out[range.clone()]);
        }
        out
    }

    /// `integral sum_j (B_j theta_j)^2 dt` by the trapezoid rule, summed over the functions node by
    /// node: G^2 of the paper when `theta` is the L2 gradient.
    pub fn norm_squared(&self, theta: &[f64]) -> f64 {
        let mut squares = vec![0.0; self.nodes];
        for values in self.direction(theta).functions() {
            for (sum, value) in squares.iter_mut().zip(values) {
                *sum += value * value;
            }
        }
        trapezoid(&squares, self.step)
    }
}
