//! Largest change of a function over the record.

use super::curve::{Curve, Curves};
use super::quantity::Quantity;
use crate::problem::Problem;
use nalgebra::DMatrix;

/// Smallest value of a function, in standard errors, by which its change is divided.
const RESOLVED: f64 = 4.0;

impl Quantity {
    /// Change `p(t_2)/p(t_1) - 1` of the function `f` between the nodes of its smallest and its largest value, with the times of these (s), by a
    /// covariance of the parameters and their degrees of freedom; `None` for a constant, and where the first value is not resolved.
    pub fn relative_change(
        problem: &Problem,
        theta: &[f64],
        f: usize,
        (covariance, degrees): (&DMatrix<f64>, &[f64]),
    ) -> Option<(Self, [f64; 2])> {
        let curve = Curves::at(problem, theta, None);
        let values = &curve.values[f];
        let extreme = |sign: f64| {
            let nodes = 0..values.len();
            nodes.max_by(|a, b| (sign * values[*a]).total_cmp(&(sign * values[*b])))
        };
        let (low, high) = (extreme(-1.0)?, extreme(1.0)?);
        (values[low] < values[high]).then_some(())?;
        let nodes = [low.min(high), low.max(high)];
        let terms = Curve::Function(f).terms(problem)?;
        let degrees = (problem.functions.ranges()[f].clone()).map(|j| degrees[j]);
        let degrees = degrees.fold(f64::INFINITY, f64::min);
        let [first, last] = nodes.map(|node| Self {
            basis_error: 0.0,
            ..curve.quantity(&terms, &[(node, 1.0)])
        });
        let first = first.with_covariance(covariance, degrees);
        (first.value.abs() > RESOLVED * first.standard_error).then_some(())?;
        let by = |q: &Self, slope: f64| -> Vec<(usize, f64)> {
            q.gradient.iter().map(|(j, a)| (*j, slope * a)).collect()
        };
        let ratio = last.value / first.value;
        let change = Self {
            value: ratio - 1.0,
            unit: String::new(),
            gradient: [
                by(&first, -ratio / first.value),
                by(&last, 1.0 / first.value),
            ]
            .concat(),
            ..last
        };
        let change = change.with_covariance(covariance, degrees);
        (change.interval().is_some())
            .then(|| (change, nodes.map(|node| problem.system.grid.time(node))))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Bands;
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::model::CoefficientSpec;

    /// The interval is that of the gradient by central differences of `k(T)/k(0) - 1` in the parameters.
    #[test]
    fn the_interval_is_that_of_the_delta_method() {
        let times: Vec<f64> = (0..200).map(|i| 0.05 * f64::from(i)).collect();
        let samples: Vec<f64> = times
            .iter()
            .map(|t| (-0.05 * t).exp() * (2.0 * t - 0.01 * t * t).cos())
            .collect();
        let record = Record::new("decay").from_state(1.0, 0.0);
        let record = record.displacement(&times, &samples).sigma(0.01);
        let parts = [
            CoefficientSpec::fixed(1.0),
            CoefficientSpec::constant(0.1),
            CoefficientSpec::polynomial(&[3.6, -0.4]),
        ];
        let problem = Builder::new(parts).record(record).build().unwrap();
        let theta = problem.start();
        let evaluation = problem.evaluate(&theta).unwrap();
        let bands = Bands::at(&problem, &theta, &evaluation);
        let f = problem
            .functions
            .iter()
            .position(|f| f.name() == "stiffness");
        let f = f.unwrap();
        let covariance = bands.covariance.as_ref().unwrap();
        let errors = (covariance, bands.degrees_of_freedom.as_slice());
        let (found, times_of) = Quantity::relative_change(&problem, &theta, f, errors).unwrap();
        let change = |theta: &[f64]| {
            let values = problem.functions.values(theta);
            values[f].last().unwrap() / values[f][0] - 1.0
        };
        assert!((found.value - change(&theta)).abs() < 1e-12);
        let gradient: Vec<f64> = (0..theta.len())
            .map(|j| {
                let moved = |by: f64| {
                    let mut moved = theta.clone();
                    moved[j] += by;
                    change(&moved)
                };
                (moved(1e-5) - moved(-1e-5)) / 2e-5
            })
            .collect();
        let gradient = nalgebra::DVector::from_vec(gradient);
        let error = gradient.dot(&(covariance * &gradient)).sqrt();
        assert!((found.half_width() / (1.959_964 * error) - 1.0).abs() < 1e-5);
        assert_eq!(times_of, [0.0, times[199]]);
        // A constant does not change.
        assert_eq!(Quantity::relative_change(&problem, &theta, 1, errors), None);
    }
}
