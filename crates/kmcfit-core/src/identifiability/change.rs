//! Largest change of a function over the record, with its confidence interval.

use super::bands::Bands;
use crate::diagnostics::student_half_width;
use crate::problem::Problem;

/// Smallest value of a function, in standard errors, by which its change is divided.
const RESOLVED: f64 = 4.0;

/// Change of a function `p` from one extreme to the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativeChange {
    /// Times of the extremes, s, in their order.
    pub times: [f64; 2],
    /// `p(times[1]) / p(times[0]) - 1`.
    pub relative: f64,
    /// Its 95 % confidence interval by the delta method.
    pub interval: [f64; 2],
}

impl Bands {
    /// Change of the function `f` between the times of its smallest and largest value at the parameters `theta` of these bands; `None` for a
    /// constant, without a covariance, and where the first value is not resolved.
    pub fn relative_change(
        &self,
        problem: &Problem,
        theta: &[f64],
        f: usize,
    ) -> Option<RelativeChange> {
        let covariance = self.covariance.as_ref()?;
        let functions = &problem.functions;
        let (function, range) = (functions.get(f), functions.ranges()[f].clone());
        let values = functions.values(theta);
        let values = &values[f];
        let extreme = |sign: f64| {
            let nodes = 0..values.len();
            nodes.max_by(|a, b| (sign * values[*a]).total_cmp(&(sign * values[*b])))
        };
        let (low, high) = (extreme(-1.0)?, extreme(1.0)?);
        (values[low] < values[high]).then_some(())?;
        let nodes = [low.min(high), low.max(high)];
        let entries = nodes.map(|node| -> Vec<(usize, f64)> {
            let row = function.design.row(node);
            row.map(|(j, b)| (range.start + j, b)).collect()
        });
        let product = |a: &[(usize, f64)], b: &[(usize, f64)]| -> f64 {
            let pairs = a.iter().flat_map(|x| b.iter().map(move |y| (x, y)));
            pairs
                .map(|((i, a), (j, b))| a * b * covariance[(*i, *j)])
                .sum()
        };
        let [first, last] = nodes.map(|node| values[node]);
        let [from, to] = &entries;
        (first.abs() > RESOLVED * product(from, from).sqrt()).then_some(())?;
        let (slope_first, slope_last) = (-last / (first * first), 1.0 / first);
        let variance = slope_first * slope_first * product(from, from)
            + 2.0 * slope_first * slope_last * product(from, to)
            + slope_last * slope_last * product(to, to);
        let degrees = self.degrees_of_freedom[range].iter().copied();
        let half = student_half_width(degrees.fold(f64::INFINITY, f64::min)) * variance.sqrt();
        let relative = last / first - 1.0;
        (half.is_finite() && half > 0.0).then_some(RelativeChange {
            times: nodes.map(|node| problem.system.grid.time(node)),
            relative,
            interval: [relative - half, relative + half],
        })
    }
}

#[cfg(test)]
mod tests {
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
        let found = bands.relative_change(&problem, &theta, f).unwrap();
        let change = |theta: &[f64]| {
            let values = problem.functions.values(theta);
            values[f].last().unwrap() / values[f][0] - 1.0
        };
        assert!((found.relative - change(&theta)).abs() < 1e-12);
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
        let covariance = bands.covariance.as_ref().unwrap();
        let error = gradient.dot(&(covariance * &gradient)).sqrt();
        let half = 0.5 * (found.interval[1] - found.interval[0]);
        assert!((half / (1.959_964 * error) - 1.0).abs() < 1e-5);
        assert_eq!(found.times, [0.0, times[199]]);
        // A constant does not change.
        assert_eq!(bands.relative_change(&problem, &theta, 1), None);
    }
}
