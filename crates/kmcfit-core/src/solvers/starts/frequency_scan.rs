//! Starting point by a scan of the natural frequency.
//!
//! A response of a wrong period fits worse than no response, so that a search from a distant start ends in a local minimum. With
//! constant coefficients the lowest natural frequency is one number: steps from [`FREQUENCIES`] values of it, those of the [`KEPT`] lowest costs
//! and then the best one continued, give the level of each function; three knots give their course, and the functions of the problem their
//! details.
//!
//! Masses and springs that are free are multiplied by one factor each for a frequency. The steps are taken in the logarithms of masses,
//! dampings and stiffnesses, which stay positive without a bound.

use crate::functions::{Basis, CoefficientFunction, CoefficientKind, Parameterization, Ratio};
use crate::objective::Evaluation;
use crate::problem::{FEW_PARAMETERS, Problem};
use crate::record::Experiment;
use crate::signal::{Spectrum, median_spacing};
use crate::solvers::linearization::{Linearization, linearise};
use crate::solvers::timings::Timings;
use crate::structure::Law;
use crate::threads::{analyses_at_once, map};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Natural frequencies of the scan.
const FREQUENCIES: usize = 25;
/// Periods of the lowest frequency in the shortest record, and samples per period of the highest one.
const LIMITS: [f64; 2] = [2.0, 2.5];
/// Largest ratio of a natural frequency to the dominant one of a free response of constants: an octave, so that two modes, harmonics and
/// friction leave it within.
const NEAR: f64 = 2.0;
/// Difference of the natural and the dominant frequency, in the spacing of the spectrum, below which they are one: the response then has the
/// phase of the record throughout.
const SHARE: f64 = 0.25;
/// Steps from each frequency, and further ones from those kept.
const SCAN_STEPS: [u64; 2] = [2, 4];
/// Frequencies that are kept after the first steps.
const KEPT: usize = 6;
/// Relative distance of natural frequencies and costs below which two descents approach the same minimum.
const SAME: f64 = 1e-3;
/// Steps from the best frequency, and in the logarithms of further functions.
const STEPS: u64 = 40;
/// Knots of the functions between constants and those of the problem.
const COARSE_KNOTS: usize = 3;
/// Least damping ratio of a start: a response without damping never forgets its phase.
const LEAST_DAMPING_RATIO: f64 = 0.02;
/// Largest change of a logarithm in a step.
const LARGEST_CHANGE: f64 = 1.0;
/// Damping of the first step, relative to the diagonal of the normal matrix, its factor, and its largest value.
const DAMPING: [f64; 3] = [1e-3, 10.0, 1e8];
/// Relative decrease of the cost below which steps end.
const CONVERGED: f64 = 1e-7;

/// Starting point for `problem` by a scan with the other values of `start`; `None` where no frequency can be set.
pub(in crate::solvers) fn scan_start(problem: &Problem, start: &[f64]) -> Option<Vec<f64>> {
    let mut stage = with_knots(problem, 1)?;
    let mut theta = scanned(problem, &stage, start)?;
    if let Some(coarse) = with_knots(problem, COARSE_KNOTS) {
        theta = transferred(&stage, &theta, &coarse);
        theta = Descent::new(&coarse, STEPS).run(theta).0;
        stage = coarse;
    }
    theta = transferred(&stage, &theta, problem);
    if problem.parameters() <= FEW_PARAMETERS {
        theta = Descent::new(problem, STEPS).run(theta).0;
    }
    Some(theta)
}

/// The problem with each function that has more parameters on so many knots, constant with one, and without penalties and
/// constraints; `None` where its functions do not change.
fn with_knots(problem: &Problem, knots: usize) -> Option<Problem> {
    let grid = &problem.system.grid;
    let functions = &problem.functions;
    let is_finer = |f: &CoefficientFunction| f.parameters() > knots;
    if knots > 1 && !functions.iter().any(is_finer) {
        return None;
    }
    let nodal = functions.values(&functions.start());
    let list = functions.iter().zip(nodal).map(|(function, values)| {
        if !is_finer(function) {
            return function.clone();
        }
        let share = |i: usize| i as f64 / (knots - 1) as f64;
        let time = |i: usize| grid.start() + share(i) * grid.duration();
        let basis = match knots {
            1 => Basis::Constant,
            _ => Basis::PiecewiseLinear {
                knots: (0..knots).map(time).collect(),
            },
        };
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        CoefficientFunction {
            start: vec![mean; knots],
            positive_parameters: basis.positive_parameters(),
            design: basis.design(grid),
            basis: Some(basis),
            ..function.clone()
        }
    });
    let sets = functions.coefficient_sets().to_vec();
    let list = list.collect();
    let coarse = Parameterization::with_coefficient_sets(list, sets, grid.nodes(), grid.step())?;
    let coarse = coarse.with_scalars(functions.scalars().to_vec());
    let changed = problem.clone().with(|parts| {
        parts.functions = coarse;
        parts.penalties.clear();
        parts.variations.clear();
        parts.constraints = Default::default();
        parts.soft.clear();
        parts.jumps.clear();
    });
    changed.ok()
}

/// Parameters of `to` with the values of the functions and scalars of `from` at `theta`.
fn transferred(from: &Problem, theta: &[f64], to: &Problem) -> Vec<f64> {
    let mut result = to.start();
    let values = from.functions.values(theta);
    for (f, (function, nodal)) in to.functions.iter().zip(values).enumerate() {
        let own = from.functions.get(f);
        let range = to.functions.ranges()[f].clone();
        if own.basis == function.basis {
            result[range].copy_from_slice(&theta[from.functions.ranges()[f].clone()]);
            continue;
        }
        let free: Vec<f64> = nodal
            .iter()
            .enumerate()
            .map(|(i, v)| v - function.fixed_at(i))
            .collect();
        let basis = function.basis.as_ref();
        if let Some(found) = basis.and_then(|b| b.project(&to.system.grid, &free)) {
            result[range].copy_from_slice(&found);
        }
    }
    let scalars = to.functions.scalar_range();
    result[scalars].copy_from_slice(from.scalars(theta));
    result
}

/// Constants of the lowest cost after steps from each frequency, continued; `None` where neither mass nor stiffness is free or no
/// response can be simulated.
fn scanned(problem: &Problem, constants: &Problem, start: &[f64]) -> Option<Vec<f64>> {
    let (functions, structure) = (&constants.functions, &problem.system.structure);
    let base = transferred(problem, start, constants);
    let values = functions.values(&base);
    let mean = |f: &usize| values[*f].iter().sum::<f64>() / values[*f].len() as f64;
    let set = functions.coefficient_set(0);
    let mut levels: Vec<f64> = set.iter().map(mean).collect();
    let inertias = set.inertias();
    let of_law = |wanted: Law| {
        let laws = structure.laws().iter().enumerate();
        let found = laws.filter(|(_, law)| **law == wanted);
        found
            .map(|(e, _)| structure.function_of(e))
            .collect::<Vec<usize>>()
    };
    let (masses, springs) = ((0..inertias).collect::<Vec<_>>(), of_law(Law::Stiffness));
    let average = |levels: &[f64], positions: &[usize]| {
        positions.iter().map(|p| levels[*p]).sum::<f64>() / positions.len() as f64
    };
    let mass = average(&levels, &masses);
    for position in &springs {
        if levels[*position] <= 0.0 {
            levels[*position] = mass;
        }
    }
    let parameter = |position: &usize| {
        Some((
            *position,
            functions.ranges()[set[*position]].clone().next()?,
        ))
    };
    let free = |positions: &[usize]| positions.iter().filter_map(parameter).collect::<Vec<_>>();
    let (free_masses, free_springs) = (free(&masses), free(&springs));
    let lowest = |levels: &[f64]| structure.eigenvalues(levels)?.first().copied();
    let from_square = lowest(&levels).filter(|square| *square > 0.0)?;
    (!free_masses.is_empty() || !free_springs.is_empty()).then_some(())?;
    let from = |omega: f64| -> Vec<f64> {
        let mut theta = base.clone();
        let ratio = omega * omega / from_square;
        let [to_mass, to_spring] = match (free_masses.is_empty(), free_springs.is_empty()) {
            (false, false) => [1.0 / ratio.sqrt(), ratio.sqrt()],
            (false, true) => [1.0 / ratio, 1.0],
            (true, _) => [1.0, ratio],
        };
        (free_masses.iter()).for_each(|(position, i)| theta[*i] = levels[*position] * to_mass);
        (free_springs.iter()).for_each(|(position, i)| theta[*i] = levels[*position] * to_spring);
        let critical = (mass * to_mass * average(&levels, &springs) * to_spring).sqrt();
        for (_, i) in free(&of_law(Law::Damping)) {
            theta[i] = theta[i].max(2.0 * LEAST_DAMPING_RATIO * critical);
        }
        theta
    };
    let frequency = |theta: &[f64]| {
        let mut levels = levels.clone();
        let each = free_masses.iter().chain(&free_springs);
        each.for_each(|(position, i)| levels[*position] = theta[*i]);
        lowest(&levels).unwrap_or(f64::NAN).sqrt()
    };
    let starts: Vec<Vec<f64>> = frequencies(problem)?.into_iter().map(from).collect();
    let mut points = descents(constants, SCAN_STEPS[0], starts);
    points.dedup_by(|next, point| {
        let is_near = |a: f64, b: f64| (a - b).abs() <= SAME * a.abs().max(b.abs());
        let is_same = is_near(point.1, next.1) && is_near(frequency(&point.0), frequency(&next.0));
        if is_same && next.1 < point.1 {
            std::mem::swap(point, next);
        }
        is_same
    });
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    points.truncate(KEPT);
    let kept = points.into_iter().map(|(theta, _)| theta).collect();
    let points = descents(constants, SCAN_STEPS[1], kept).into_iter();
    let (theta, _) = points.min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Descent::new(constants, STEPS).run(theta).0)
}

/// Parameters after so many steps from each start, with their costs; without starts that cannot be simulated.
fn descents(problem: &Problem, steps: u64, starts: Vec<Vec<f64>>) -> Vec<(Vec<f64>, f64)> {
    let descent = Descent::new(problem, steps);
    let threads = analyses_at_once(problem.sample_count());
    let points = map(starts.len(), threads, |i| descent.run(starts[i].clone()));
    let points = points.into_iter();
    points.filter(|(_, cost)| cost.is_finite()).collect()
}

/// Dominant frequencies of the channels of constants in free records, rad/s, with the spacing of their spectra; none of others.
fn dominant(problem: &Problem) -> impl Iterator<Item = (f64, f64)> {
    let is_free =
        problem.functions.are_constants() && problem.experiments.iter().all(Experiment::is_free);
    let channels = problem.channels().filter(move |c| is_free && c.len() > 1);
    channels.filter_map(|c| {
        let spectrum = Spectrum::of(c.observed(), median_spacing(c.times()))?;
        Some((TAU * spectrum.dominant(), TAU * spectrum.resolution()))
    })
}

/// True for constants in free records whose natural frequency is the dominant one of each channel: a scan finds the same.
pub(in crate::solvers) fn is_dominant(problem: &Problem, evaluation: &Evaluation) -> bool {
    let natural = Ratio::NaturalFrequency.at_nodes(problem.system.laws(), &evaluation.nodal);
    let Some(natural) = natural.first().map(|f| TAU * f) else {
        return false;
    };
    let mut all = dominant(problem).peekable();
    all.peek().is_some() && all.all(|(omega, spacing)| (omega - natural).abs() < SHARE * spacing)
}

/// Natural frequencies of the scan, rad/s: equally spaced logarithms between [`LIMITS`]; of constants in free records those near the
/// dominant frequency of a channel.
fn frequencies(problem: &Problem) -> Option<Vec<f64>> {
    let channels = || problem.channels().filter(|c| c.len() > 1);
    let length = |times: &[f64]| times[times.len() - 1] - times[0];
    let shortest = channels()
        .map(|c| length(c.times()))
        .fold(f64::INFINITY, f64::min);
    let spacing = channels().map(|c| length(c.times()) / (c.len() - 1) as f64);
    let spacing = spacing.fold(f64::INFINITY, f64::min);
    let [low, high] = [LIMITS[0] / shortest, 1.0 / (LIMITS[1] * spacing)].map(|f| TAU * f);
    (low > 0.0 && high > low && high.is_finite()).then_some(())?;
    let share = |i: usize| i as f64 / (FREQUENCIES - 1) as f64;
    let all = (0..FREQUENCIES).map(|i| low * (high / low).powf(share(i)));
    let dominant: Vec<f64> = dominant(problem).map(|(omega, _)| omega).collect();
    let is_near = |omega: &f64| dominant.iter().any(|d| (omega / d).max(d / omega) <= NEAR);
    let near: Vec<f64> = all.clone().filter(is_near).collect();
    Some(if near.is_empty() { all.collect() } else { near })
}

/// Levenberg–Marquardt steps in the logarithms of positive mass, damping and stiffness.
struct Descent<'a> {
    problem: &'a Problem,
    steps: u64,
    /// True for parameters whose logarithm is the coordinate.
    is_logarithmic: Vec<bool>,
}

impl<'a> Descent<'a> {
    fn new(problem: &'a Problem, steps: u64) -> Self {
        let functions = &problem.functions;
        let mut is_logarithmic = vec![false; problem.parameters()];
        for (function, range) in functions.iter().zip(functions.ranges()) {
            let has_sign = [
                CoefficientKind::MASS,
                CoefficientKind::DAMPING,
                CoefficientKind::STIFFNESS,
            ]
            .contains(&function.quantity);
            is_logarithmic[range.clone()].fill(has_sign && function.positive_parameters);
        }
        Self {
            problem,
            steps,
            is_logarithmic,
        }
    }

    /// Parameters after the steps, and their cost; infinite where the start cannot be simulated.
    fn run(&self, mut theta: Vec<f64>) -> (Vec<f64>, f64) {
        let Ok(mut here) = self.problem.evaluate(&theta) else {
            return (theta, f64::INFINITY);
        };
        let [mut damping, factor, largest] = DAMPING;
        for _ in 0..self.steps {
            let fresh = Linearization::Fresh;
            let (sub, _) = linearise(self.problem, &theta, &here, &fresh, &mut Timings::default());
            let scales: Vec<f64> = (theta.iter().zip(&self.is_logarithmic))
                .map(|(t, log)| if *log && *t > 0.0 { *t } else { 1.0 })
                .collect();
            let rows = &sub.residuals;
            let mut jacobian = DMatrix::zeros(rows.len(), theta.len());
            for i in 0..rows.len() {
                for (j, a) in rows.row(i).filter(|(j, _)| *j < theta.len()) {
                    jacobian[(i, j)] = a * scales[j];
                }
            }
            let right = DVector::from_column_slice(rows.right());
            let normal = jacobian.tr_mul(&jacobian);
            let descent = jacobian.tr_mul(&right);
            let before = here.cost;
            let mut is_lower = false;
            while damping <= largest && !is_lower {
                let mut damped = normal.clone();
                for j in 0..theta.len() {
                    damped[(j, j)] += damping * normal[(j, j)].max(f64::MIN_POSITIVE);
                }
                let step = damped.cholesky().map(|factor| factor.solve(&descent));
                // With more damping the decrease is smaller: none that counts is left.
                let predicted = step.as_ref().map_or(f64::INFINITY, |step| {
                    2.0 * step.dot(&descent) - step.dot(&(&normal * step))
                });
                if predicted <= CONVERGED * before {
                    break;
                }
                let moved = step.map(|step| self.moved(&theta, &scales, step.as_slice()));
                let there =
                    moved.and_then(|moved| Some((self.problem.evaluate(&moved).ok()?, moved)));
                match there {
                    Some((evaluation, moved)) if evaluation.cost < before => {
                        (here, theta, is_lower) = (evaluation, moved, true);
                        damping /= factor;
                    }
                    _ => damping *= factor,
                }
            }
            if !is_lower || before - here.cost <= CONVERGED * before {
                break;
            }
        }
        (theta, here.cost)
    }

    /// Parameters after a step of the coordinates.
    fn moved(&self, theta: &[f64], scales: &[f64], step: &[f64]) -> Vec<f64> {
        let each = theta.iter().zip(scales).zip(step).zip(&self.is_logarithmic);
        each.map(|(((t, scale), step), log)| match *log && *t > 0.0 {
            true => t * step.clamp(-LARGEST_CHANGE, LARGEST_CHANGE).exp(),
            false => t + scale * step,
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::model::CoefficientSpec;

    /// A problem of unit mass and free damping for a free decay of 5 rad/s in 40 s.
    fn decay(stiffness: CoefficientSpec) -> Problem {
        let times: Vec<f64> = (0..801).map(|i| 0.05 * f64::from(i)).collect();
        let decay = |t: &f64| (-0.05 * t).exp() * (5.0 * t).cos();
        let samples: Vec<f64> = times.iter().map(decay).collect();
        let [mass, damping] = [1.0, 0.2].map(CoefficientSpec::constant);
        let record = Record::new("decay").displacement(&times, &samples);
        let builder = Builder::new([mass, damping, stiffness]).record(record);
        builder.build().expect("a problem")
    }

    fn on_three_knots() -> CoefficientSpec {
        CoefficientSpec::piecewise_linear(3, 25.0)
    }

    /// Constants are scanned within an octave of the frequency of the record, a stiffness on knots over the whole range.
    #[test]
    fn constants_of_a_free_record_are_scanned_near_its_frequency() {
        let scanned = |stiffness| frequencies(&decay(stiffness)).expect("frequencies");
        let near = scanned(CoefficientSpec::constant(10.0));
        assert!((5..=10).contains(&near.len()), "{near:?}");
        assert!(near[0] >= 2.4 && near[near.len() - 1] <= 10.2, "{near:?}");
        assert_eq!(scanned(on_three_knots()).len(), FREQUENCIES);
    }

    /// The spectrum has a spacing of 0.157 rad/s, a quarter of which is 0.8 % of the frequency.
    #[test]
    fn constants_with_the_frequency_of_the_record_need_no_scan() {
        let is_found = |stiffness| {
            let problem = decay(stiffness);
            is_dominant(
                &problem,
                &problem.evaluate(&problem.start()).expect("a response"),
            )
        };
        for (omega, expected) in [(5.0, true), (5.02, true), (5.1, false), (4.9, false)] {
            let stiffness = CoefficientSpec::constant(omega * omega);
            assert_eq!(is_found(stiffness), expected, "{omega}");
        }
        assert!(!is_found(on_three_knots()));
    }
}
