//! Means over the record of functions and ratios, with their derivatives in the parameters.

use super::band::MeanOverRecord;
use super::basis_error::basis_error;
use super::ratios::ratios_of_set;
use crate::problem::Problem;
use crate::system::quadrature::trapezoid_weights;

/// Means of the functions and ratios of a fit.
#[derive(Debug, Clone)]
pub struct Means<'a> {
    /// One for each function.
    pub functions: Vec<&'a MeanOverRecord>,
    /// Ratios by the name of their band.
    pub ratios: Vec<(&'a str, &'a MeanOverRecord)>,
}

impl Means<'_> {
    /// Mean of the ratio with this band.
    pub fn ratio(&self, name: &str) -> Option<&MeanOverRecord> {
        let mut ratios = self.ratios.iter();
        ratios.find(|(of, _)| *of == name).map(|(_, mean)| *mean)
    }
}

/// Weights of all nodes in a mean over the record, `1/T integral p dt` by the trapezoid rule. Every mean that is reported has them.
pub(crate) fn mean_weights(nodes: usize) -> Vec<f64> {
    trapezoid_weights(nodes, 1.0 / (nodes - 1).max(1) as f64)
}

/// Mean over the record of the values at all nodes, with their [`mean_weights`]; the value itself where it is constant.
pub(crate) fn mean_over_record(values: &[f64], weights: &[f64]) -> f64 {
    match values.iter().all(|x| *x == values[0]) {
        true => values[0],
        false => values.iter().zip(weights).map(|(x, w)| x * w).sum(),
    }
}

/// Means at the parameters `theta` without errors of the samples: of each function, and of the ratios by the name of their band.
pub(crate) fn means_at(
    problem: &Problem,
    theta: &[f64],
) -> (Vec<MeanOverRecord>, Vec<(&'static str, MeanOverRecord)>) {
    let functions = &problem.functions;
    let values = functions.values(theta);
    let nodes = functions.nodes();
    let shares = mean_weights(nodes);
    let times = problem.system.grid.times();
    let mean = |at_node: &[f64]| mean_over_record(at_node, &shares);
    let add = |gradient: &mut [f64], f: usize, node: usize, factor: f64| {
        let first = functions.ranges()[f].start;
        let row = functions.get(f).design.row(node);
        row.for_each(|(j, b)| gradient[first + j] += factor * b);
    };
    let errors: Vec<Vec<f64>> = (0..values.len())
        .map(|f| basis_error(problem, f, theta, &times))
        .collect();
    let record = |value, basis_error, gradient| MeanOverRecord {
        value,
        gradient,
        standard_error: f64::NAN,
        basis_error,
        degrees: f64::INFINITY,
    };
    let of_functions = values.iter().enumerate().map(|(f, at_node)| {
        let mut gradient = vec![0.0; problem.parameters()];
        (shares.iter().enumerate()).for_each(|(i, share)| add(&mut gradient, f, i, *share));
        record(mean(at_node), mean(&errors[f]), gradient)
    });
    let of_functions = of_functions.collect();
    let of_ratios = ratios_of_set(problem).into_iter().map(|ratio| {
        let places = ratio.functions();
        let mut gradient = vec![0.0; problem.parameters()];
        let mut basis_error = 0.0;
        let (ratios, slopes) = ratio.at_nodes(&values);
        let each = slopes.chunks_exact(places.len());
        for ((i, share), slopes) in shares.iter().enumerate().zip(each) {
            for (f, slope) in places.iter().zip(slopes) {
                add(&mut gradient, *f, i, share * slope);
                basis_error += share * slope * errors[*f][i];
            }
        }
        (ratio.name, record(mean(&ratios), basis_error, gradient))
    });
    (of_functions, of_ratios.collect())
}
