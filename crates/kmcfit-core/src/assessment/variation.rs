//! Functions that vary as fast as the vibration, or with a beat: what an estimate of them cannot be told from.
//!
//! A coefficient that varies within a period pumps the vibration and absorbs offsets, harmonics and second modes. With 4 knots a period an
//! offset of 0.4 % and a third harmonic of 0.3 % of a ring-down changed the damping ratio by 25 %, four times its interval; with one knot in
//! two periods, or a constant, the intervals held.

use super::Doubt;
use super::median_frequency::median_frequency;
use crate::identifiability::{Bands, Quantity};
use crate::objective::Evaluation;
use crate::problem::Problem;
use crate::signal::median;
use std::f64::consts::TAU;

/// Most freedom of a function beside its mean, per period of the vibration: one knot in two periods.
const MOST_PER_PERIOD: f64 = 0.5;
/// Freedom beside the mean that every function may have: a line.
const LINE: f64 = 1.0;
/// Share of the variance of a function, without its line, in one sine from which on it oscillates.
const ONE_SINE: f64 = 0.5;
/// Fewest and most cycles over the record of such a sine.
const CYCLES: std::ops::RangeInclusive<usize> = 2..=200;

/// Warnings about the functions of a fit, given the effective number of parameters of the function of each penalty.
pub(super) fn variation_warnings(
    problem: &Problem,
    evaluation: &Evaluation,
    bands: Option<&Bands>,
    effective: Option<&[f64]>,
) -> Vec<Doubt> {
    let Some(frequency) = median_frequency(problem, evaluation) else {
        return Vec::new();
    };
    let periods = frequency * problem.system.grid.duration();
    let (mut warnings, mut fast) = (Vec::new(), Vec::new());
    for (f, function) in problem.functions.iter().enumerate() {
        let jumps = problem.variations.iter().any(|v| v.function == f)
            || problem.jumps.iter().any(|j| j.function == f);
        if function.parameters() < 2 || jumps {
            continue;
        }
        let mut penalties = problem.penalties.iter().enumerate();
        let freedom = match penalties.find(|(_, penalty)| penalty.function == f) {
            Some((position, _)) => effective.and_then(|all| all.get(position).copied()),
            None => Some(function.parameters() as f64),
        };
        let beside_mean = freedom.unwrap_or(1.0) - 1.0;
        if beside_mean > LINE.max(MOST_PER_PERIOD * periods) {
            fast.push((function.name(), freedom.unwrap_or(1.0) / periods));
        } else if let Some(cycles) = bands.and_then(|bands| cycles(bands, f)) {
            warnings.push(Doubt::Oscillates {
                function: function.name(),
                frequency: cycles as f64 / problem.system.grid.duration(),
            });
        }
    }
    let per_period = fast.iter().map(|(_, n)| *n).reduce(f64::max);
    warnings.extend(per_period.map(|per_period| Doubt::FastVariation {
        functions: fast.into_iter().map(|(name, _)| name).collect(),
        per_period,
    }));
    warnings
}

/// Cycles over the record of the sine that is most of a function beside its line, where it exceeds the band.
fn cycles(bands: &Bands, f: usize) -> Option<usize> {
    let band = &bands.functions[f];
    let values: Vec<f64> = band.values().collect();
    let rest = without_line(&values)?;
    let n = rest.len();
    let variance: f64 = rest.iter().map(|x| x * x).sum();
    let square = |k: usize| {
        let (mut cosine, mut sine) = (0.0, 0.0);
        for (i, x) in rest.iter().enumerate() {
            let angle = TAU * (k * i % n) as f64 / n as f64;
            cosine += x * angle.cos();
            sine += x * angle.sin();
        }
        2.0 / n as f64 * (cosine * cosine + sine * sine)
    };
    let each = CYCLES.filter(|k| 4 * k < n).map(|k| (k, square(k)));
    let (k, largest) = each.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let amplitude = (2.0 * largest / n as f64).sqrt();
    let widths: Vec<f64> = band.points.iter().map(Quantity::half_width).collect();
    (largest > ONE_SINE * variance && amplitude > median(widths)).then_some(k)
}

/// Values less their regression line.
fn without_line(values: &[f64]) -> Option<Vec<f64>> {
    let n = values.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let mean = values.iter().sum::<f64>() / n;
    let position = |i: usize| i as f64 - middle;
    let (mut cross, mut square) = (0.0, 0.0);
    for (i, x) in values.iter().enumerate() {
        cross += position(i) * (x - mean);
        square += position(i) * position(i);
    }
    let slope = cross / square;
    let rest = values.iter().enumerate();
    let rest: Vec<f64> = rest.map(|(i, x)| x - mean - slope * position(i)).collect();
    rest.iter().all(|x| x.is_finite()).then_some(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_leaves_nothing_and_a_sine_itself() {
        let line: Vec<f64> = (0..50).map(|i| 3.0 - 0.2 * f64::from(i)).collect();
        let rest = without_line(&line).unwrap();
        assert!(rest.iter().all(|x| x.abs() < 1e-12));
        assert_eq!(without_line(&[1.0, f64::NAN, 2.0]), None);
    }
}
