//! Gaps of the records, and the number of cycles of the undamped oscillation in them,
//!
//! ```text
//! n = integral over the gap of sqrt(k/m) / (2 pi) dt
//! ```

use crate::problem::Problem;
use crate::system::{NodalCoefficients, Term};
use std::f64::consts::TAU;

/// Fewest cycles in a gap: in less than half a period no cycle can be added.
const FEWEST_CYCLES: f64 = 0.5;
/// Shortest gap, in median distances of neighbouring samples.
const FEWEST_STEPS: f64 = 3.0;

/// Function whose variation changes the number of cycles: the stiffness, or the mass beside a constant stiffness; `None` where
/// both are constant or there is no stiffness, and with functions of single records or known parts.
pub(crate) fn varying_function(problem: &Problem) -> Option<usize> {
    let functions = &problem.functions;
    let [set] = functions.coefficient_sets() else {
        return None;
    };
    set.known_parts().is_empty().then_some(())?;
    let place = problem
        .system
        .terms
        .iter()
        .position(|t| *t == Term::Stiffness)?;
    let varies = |f: &usize| functions.get(*f).parameters() > 1;
    [set[place + 1], set[0]].into_iter().find(varies)
}

/// Spans of time (s) without samples of any record that contain at least half a period of the undamped oscillation at their ends.
pub(crate) fn gaps(problem: &Problem, nodal: &NodalCoefficients) -> Vec<[f64; 2]> {
    if varying_function(problem).is_none() {
        return Vec::new();
    }
    let mut times: Vec<f64> = (problem.channels())
        .flat_map(|c| c.times().iter().copied())
        .collect();
    times.sort_by(f64::total_cmp);
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.retain(|step| *step > 0.0);
    steps.sort_by(f64::total_cmp);
    let Some(median) = steps.get(steps.len() / 2) else {
        return Vec::new();
    };
    let frequencies = frequencies(problem, nodal);
    let at = |time: f64| frequencies[problem.system.grid.nearest(time)];
    let spans = times.windows(2).map(|pair| [pair[0], pair[1]]);
    spans
        .filter(|[from, to]| {
            let cycles = 0.5 * (at(*from) + at(*to)) * (to - from);
            to - from > FEWEST_STEPS * median && cycles > FEWEST_CYCLES
        })
        .collect()
}

/// Undamped natural frequency at the nodes, Hz; zero where stiffness or mass is negative.
fn frequencies(problem: &Problem, nodal: &NodalCoefficients) -> Vec<f64> {
    let mut terms = problem.system.terms.iter();
    let Some(place) = terms.position(|t| *t == Term::Stiffness) else {
        return vec![0.0; nodal.mass.len()];
    };
    let pairs = nodal.coefficients[place].iter().zip(&nodal.mass);
    pairs.map(|(k, m)| (k / m).max(0.0).sqrt() / TAU).collect()
}

/// Number of cycles of the undamped oscillation within a span of time (s), by the trapezoidal rule on the nodes.
pub fn cycles(problem: &Problem, nodal: &NodalCoefficients, [from, to]: [f64; 2]) -> f64 {
    let grid = &problem.system.grid;
    let (first, last) = (grid.nearest(from), grid.nearest(to));
    let frequencies = frequencies(problem, nodal);
    let pairs = frequencies[first..=last].windows(2);
    pairs
        .map(|pair| 0.5 * grid.step() * (pair[0] + pair[1]))
        .sum()
}
