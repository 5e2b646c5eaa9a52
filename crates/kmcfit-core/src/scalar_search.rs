//! Roots and minima of functions of one number, by the methods of Brent in argmin.

use argmin::core::{CostFunction, Error, Executor, IterState, Solver};
use argmin::solver::brent::{BrentOpt, BrentRoot};

/// Largest number of evaluations: both methods end earlier at the tolerances in use.
const MOST: u64 = 60;

struct Function<F>(F);

impl<F: Fn(f64) -> f64> CostFunction for Function<F> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, x: &f64) -> Result<f64, Error> {
        Ok((self.0)(*x))
    }
}

type State = IterState<f64, (), (), (), (), f64>;

fn best<F: Fn(f64) -> f64, S: Solver<Function<F>, State>>(value: F, solver: S) -> Option<f64> {
    let executor = Executor::new(Function(value), solver).timer(false);
    let result = executor
        .configure(|state| state.max_iters(MOST))
        .run()
        .ok()?;
    result.state.best_param
}

/// The root between two ends, to a relative `tolerance`; `None` where the signs at the ends are equal.
pub(crate) fn root(value: impl Fn(f64) -> f64, ends: [f64; 2], tolerance: f64) -> Option<f64> {
    best(value, BrentRoot::new(ends[0], ends[1], tolerance))
}

/// A minimum between two ends, to about three times `tolerance`, and the value there.
pub(crate) fn minimum(value: impl Fn(f64) -> f64, ends: [f64; 2], tolerance: f64) -> (f64, f64) {
    let solver = BrentOpt::new(ends[0], ends[1]).set_tolerance(f64::EPSILON.sqrt(), tolerance);
    let position = best(&value, solver).unwrap_or(ends[0]);
    (position, value(position))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_and_a_minimum_are_found_to_the_tolerance() {
        let found = root(|x| x.exp() - 3.0, [-4.0, 7.0], 1e-9);
        assert!((found.expect("a change of sign") - 3f64.ln()).abs() < 1e-8);
        assert_eq!(root(|x| x * x + 1.0, [-1.0, 1.0], 1e-9), None);
        let (position, value) = minimum(|x| (x - 0.03f64.ln()).powi(2) + 5.0, [-9.0, 0.0], 1e-3);
        assert!((position - 0.03f64.ln()).abs() < 4e-3, "{position}");
        assert!((value - 5.0).abs() < 2e-5, "{value}");
    }
}
