//! Natural scales of the functions: sizes at which their forces equal the inertia force.

use super::Evaluation;
use crate::diagnostics::median_size;
use crate::problem::Problem;
use crate::record::{ChannelKind, Experiment, LONG_RECORD_STEPS};
use crate::signal::Spectrum;
use crate::simd::LANES;
use crate::simd::sum::largest;
use crate::step::Trajectory;
use crate::structure::{Ends, Law, Structure};
use crate::system::quadrature::curvature_at;
use std::f64::consts::TAU;

impl Problem {
    /// Natural scale of each function of the list: the larger of its largest value and of the value whose force equals the
    /// inertia force, `max m * rms(y'') / rms(phi)`, with the root of the sum of squares over all inertias. The mean squares are over the responses of the measured experiments of the
    /// coefficient set (of all experiments if none has samples). A damping close to zero thus has the scale of a relevant
    /// damping.
    pub fn natural_scales(&self, evaluation: &Evaluation) -> Vec<f64> {
        self.sizes(evaluation, largest)
    }

    /// [`Problem::natural_scales`] with the median of a function's values in place of the largest, which is insensitive to
    /// values at times without information.
    pub(crate) fn median_scales(&self, evaluation: &Evaluation) -> Vec<f64> {
        self.sizes(evaluation, median_size)
    }

    fn sizes(&self, evaluation: &Evaluation, size_of: fn(&[f64]) -> f64) -> Vec<f64> {
        let structure = &self.system.structure;
        let step = self.system.grid.step();
        let squares: Vec<Vec<f64>> = (evaluation.trajectories.iter())
            .map(|response| squares(response, structure, step))
            .collect();
        let any_has_samples = self.experiments.iter().any(Experiment::has_samples);
        let mut sizes = vec![0.0f64; self.functions.ranges().len()];
        for (which, assembly) in self.functions.coefficient_sets().iter().enumerate() {
            let nodal = evaluation.nodal_of(which);
            // Sums of squares of the accelerations of inertias, then of `phi` of elements.
            let root = |what: usize| -> f64 {
                let own = self.experiments.iter().zip(&squares);
                let own = own.filter(|(e, _)| {
                    e.coefficient_set == which && (e.has_samples() || !any_has_samples)
                });
                own.map(|(_, squares)| squares[what]).sum::<f64>().sqrt()
            };
            let masses: Vec<f64> = nodal.inertias.iter().map(|m| size_of(m)).collect();
            let forces = masses.iter().enumerate().map(|(r, m)| m * root(r));
            let inertia = forces.fold(0.0f64, f64::hypot);
            let natural = |e: usize| match root(masses.len() + e) {
                response if response > 0.0 => inertia / response,
                _ => 0.0,
            };
            let coefficients = structure.functions() - masses.len();
            let natural = (masses.iter().copied()).chain((0..coefficients).map(natural));
            let own = nodal.functions().map(size_of);
            for (&f, (own, natural)) in assembly.iter().zip(own.zip(natural)) {
                sizes[f] = sizes[f].max(own).max(natural);
            }
            for &(position, f) in assembly.known_parts() {
                sizes[f] = sizes[f].max(sizes[assembly[position]]);
            }
        }
        sizes
    }

    /// Largest change of a function or scalar between two points, relative to [`Problem::natural_scales`] at the first, or to
    /// the scalar's own size.
    pub fn relative_change(&self, before: &Evaluation, from: &[f64], after: &[f64]) -> f64 {
        self.change_in_scales(&self.natural_scales(before), from, after)
    }

    /// [`Problem::relative_change`] for given natural scales.
    pub(crate) fn change_in_scales(&self, sizes: &[f64], from: &[f64], after: &[f64]) -> f64 {
        let ranges = self.functions.ranges().iter().zip(sizes);
        let mut most = 0.0f64;
        for (index, (range, size)) in ranges.enumerate() {
            let change =
                (self.functions).largest_change(index, &from[range.clone()], &after[range.clone()]);
            if change != 0.0 {
                most = most.max(change / size);
            }
        }
        let changes = self
            .scalars(after)
            .iter()
            .zip(self.scalars(from))
            .map(|(a, b)| a - b);
        let scalars = self.functions.scalars().iter().zip(changes);
        scalars.fold(most, |most, (scalar, x)| most.max(x.abs() / scalar.size))
    }
}

/// Sums over the nodes of the squares of the accelerations of inertias, and of `phi` of each element.
fn squares(response: &Trajectory, structure: &Structure, step: f64) -> Vec<f64> {
    if !structure.is_one() {
        return squares_of_structure(response, structure, step);
    }
    let terms = structure.laws();
    let (y, v) = (response.displacement(0), response.velocity(0));
    let nodes = y.len();
    if nodes <= LONG_RECORD_STEPS {
        return sequential_squares(response, terms, step);
    }
    let inertia = sum_of_squares(nodes, |i| curvature_at(y, step, i));
    let of = |term: &Law| match term {
        Law::Damping => sum_of_squares(nodes, |i| v[i]),
        Law::Stiffness => sum_of_squares(nodes, |i| y[i]),
        _ => sum_of_squares(nodes, |i| term.phi(y[i], v[i])),
    };
    let terms = terms.iter().map(of);
    std::iter::once(inertia).chain(terms).collect()
}

/// [`squares`] of any number of coordinates; supports at rest.
fn squares_of_structure(response: &Trajectory, structure: &Structure, step: f64) -> Vec<f64> {
    let n = structure.coordinates();
    let across = |ends: &Ends, of: &dyn Fn(usize) -> f64| {
        let entries = ends.entries().iter().filter(|(j, _)| *j < n);
        entries.map(|(j, factor)| factor * of(*j)).sum::<f64>()
    };
    let inertia = |ends: &Ends| {
        sum_of_squares(response.nodes(), |i| {
            across(ends, &|j| curvature_at(response.displacement(j), step, i))
        })
    };
    let mut squares: Vec<f64> = structure.inertias().iter().map(inertia).collect();
    let mut internal = 2 * n..;
    for (law, ends) in structure.elements() {
        let state = law.has_internal_state().then(|| internal.next()).flatten();
        squares.push(sum_of_squares(response.nodes(), |i| match state {
            Some(z) => response.component(z)[i],
            None => {
                let x = across(ends, &|j| response.displacement(j)[i]);
                law.phi(x, across(ends, &|j| response.velocity(j)[i]))
            }
        }));
        // Other coefficients have the scale of their values.
        squares.resize(squares.len() + law.coefficients() - 1, 0.0);
    }
    squares
}

/// [`squares`] of a short record. Steepest descent depends on every bit, so sums are sequential; four columns are
/// interleaved, because each sum is a chain of dependent operations.
fn sequential_squares(response: &Trajectory, terms: &[Law], step: f64) -> Vec<f64> {
    const PART: usize = 256;
    let (y, v) = (response.displacement(0), response.velocity(0));
    let mut sums = vec![0.0; terms.len() + 1];
    let mut part = [[0.0; PART]; 4];
    for (first, sums) in (0..).step_by(4).zip(sums.chunks_mut(4)) {
        let mut four = [0.0; 4];
        for from in (0..y.len()).step_by(PART) {
            let nodes = from..y.len().min(from + PART);
            for (column, values) in (first..=terms.len()).zip(&mut part) {
                let values = &mut values[..nodes.len()];
                let each = values.iter_mut().zip(nodes.clone());
                match column.checked_sub(1).map(|j| &terms[j]) {
                    None => each.for_each(|(x, i)| *x = curvature_at(y, step, i)),
                    Some(Law::Damping) => values.copy_from_slice(&v[nodes.clone()]),
                    Some(Law::Stiffness) => values.copy_from_slice(&y[nodes.clone()]),
                    Some(term) => each.for_each(|(x, i)| *x = term.phi(y[i], v[i])),
                }
            }
            for i in 0..nodes.len() {
                for (sum, values) in four.iter_mut().zip(&part) {
                    *sum += values[i] * values[i];
                }
            }
        }
        sums.copy_from_slice(&four[..sums.len()]);
    }
    sums
}

/// Sum of the squares of `count` values, in eight interleaved partial sums.
fn sum_of_squares(count: usize, value: impl Fn(usize) -> f64) -> f64 {
    let mut sums = [0.0; LANES];
    for i in 0..count {
        let x = value(i);
        sums[i % LANES] += x * x;
    }
    sums.into_iter().fold(0.0, |sum, x| sum + x)
}

/// Sizes of displacement and velocity of a response, from samples of one `kind` with spacing `spacing` (s): root mean
/// squares, from the dominant frequency.
pub fn state_scales(kind: ChannelKind, values: &[f64], spacing: f64) -> [f64; 2] {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let centred: Vec<f64> = values.iter().map(|v| v - mean).collect();
    let rms = (centred.iter().map(|v| v * v).sum::<f64>() / centred.len() as f64).sqrt();
    let spectrum = Spectrum::of(&centred, spacing);
    let omega = TAU * spectrum.map_or(1.0, |s| s.dominant());
    let omega = if omega > 0.0 { omega } else { 1.0 };
    let displacement = match kind {
        ChannelKind::Displacement => rms,
        ChannelKind::Velocity => rms / omega,
        ChannelKind::Acceleration => rms / (omega * omega),
    };
    [displacement, displacement * omega]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, Record};
    use crate::model::CoefficientSpec;
    use crate::system::Grid;

    /// `A sin(w t)` over whole periods has the rms `A / sqrt(2)` for every kind of sensor, also with an offset.
    #[test]
    fn the_state_of_a_sine_has_its_size_whatever_was_read() {
        let (amplitude, omega, spacing) = (0.3, TAU / 0.4, 0.01);
        let samples = |size: f64, phase: f64| -> Vec<f64> {
            let at = |i: usize| size * (5.0 + (omega * spacing * i as f64 + phase).sin());
            (0..400).map(at).collect()
        };
        let quarter = TAU / 4.0;
        let cases = [
            (ChannelKind::Displacement, amplitude, 0.0),
            (ChannelKind::Velocity, amplitude * omega, quarter),
            (
                ChannelKind::Acceleration,
                amplitude * omega * omega,
                2.0 * quarter,
            ),
        ];
        let rms = amplitude / 2f64.sqrt();
        for (kind, size, phase) in cases {
            let [displacement, velocity] = state_scales(kind, &samples(size, phase), spacing);
            // The dominant frequency is accurate to a small part of the frequency spacing.
            assert!((displacement / rms - 1.0).abs() < 0.02, "{kind:?}");
            assert!((velocity / (rms * omega) - 1.0).abs() < 0.02, "{kind:?}");
            assert_eq!(state_scales(kind, &[2.0; 400], spacing), [0.0; 2]);
        }
    }

    /// One period of `y = size cos(w t)` with m = 1 and k = w^2 and a negligible cubic stiffness, and a second response of
    /// three times the size, with or without samples.
    fn swinging(size: f64, other_has_samples: bool) -> Problem {
        let times = Grid::new(0.0, 10.0, 101).unwrap().times();
        let record = |name: &str, size: f64| {
            let samples: Vec<f64> = times
                .iter()
                .map(|t| size * (TAU * t / 10.0).cos())
                .collect();
            Record::new(name)
                .from_state(size, 0.0)
                .displacement(&times, &samples)
        };
        let stiffness = (TAU / 10.0).powi(2);
        let parts = [1.0, 0.0, stiffness].map(CoefficientSpec::fixed);
        let mut problem = Builder::new(parts)
            .cubic_stiffness(CoefficientSpec::constant(1e-9))
            .record(record("small", size))
            .record(record("large", 3.0 * size))
            .build()
            .unwrap();
        if !other_has_samples {
            problem.parts_mut().experiments[1].channels.clear();
        }
        problem
    }

    fn sizes(problem: &Problem) -> Vec<f64> {
        problem.natural_scales(&problem.evaluate(&problem.start()).unwrap())
    }

    /// The root mean square of the force equals that of the inertia force: a damping `m w`, a cubic stiffness `m w^2 / y^2`
    /// with `mean y^6 / mean y^2 = 5/8 y^4`.
    #[test]
    fn the_natural_size_makes_a_force_as_large_as_that_of_the_mass() {
        let omega = TAU / 10.0;
        // A response of size 0.5 alone, and with one of size 1.5: 10 times the squares, 730 times the sixth powers.
        for (read, six_over_two) in [(false, 1.0), (true, 73.0)] {
            let found = sizes(&swinging(0.5, read));
            let cubic = omega * omega / (0.625f64 * 0.0625 * six_over_two).sqrt();
            let expected = [1.0, omega, omega * omega, cubic];
            for (found, expected) in found.iter().zip(expected) {
                // Sums over nodes and differences of second order.
                assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
            }
        }
    }

    /// The square of the third power of a response of 1e-60 m underflows: a cubic stiffness then has the scale of its own
    /// values, not an infinite one.
    #[test]
    fn a_term_with_vanishing_response_has_the_scale_of_its_values() {
        assert_eq!(sizes(&swinging(1e-60, true))[3], 1e-9);
    }
}
