//! Delays of channels and of the input as parameters: derivatives against differences, estimates against the truth, and the delay that is
//! named as the cause of a poor fit without the parameter. Oscillators of 1 Hz under a broadband force, by an independent integrator.

use crate::common::forced::{broadband, response, rms, white};
use kmcfit_core::assessment::{Doubt, FitAssessment, RecordError};
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::model::{CoefficientSpec, DelayValue, ScalarSpec, SensorSpec};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{ChannelKind, Weighting};
use kmcfit_core::solvers::{Fit, FitSettings, fit_with_noise};
use std::f64::consts::TAU;

const SAMPLES: usize = 400;
const SPACING: f64 = 0.05;
/// States for each sample: delays are multiples of a tenth of a sample.
const FINE: usize = 10;
/// Samples at either end that no delay moves out of the record.
const MARGIN: usize = 8;

/// Which clock is late.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Late {
    /// That of the acceleration, beside a displacement in time.
    Acceleration,
    /// That of the force: both channels are early.
    Force,
}

struct Case {
    force: Vec<f64>,
    channels: [(ChannelKind, Vec<f64>, f64); 2],
}

impl Case {
    /// A record in which the samples of one clock are late by `delay` samples, with noise of `level`.
    fn new(seed: u64, late: Late, delay: f64, level: f64) -> Self {
        let (m, k) = (2.0, TAU * TAU * 2.0);
        let c = 2.0 * m * TAU * 0.03;
        let force = broadband(white(seed, 1, SAMPLES));
        let count = FINE * (SAMPLES - 1) + 1;
        let between = |i: usize| {
            let (left, part) = (i / FINE, (i % FINE) as f64 / FINE as f64);
            force[left] + part * (force[(left + 1).min(SAMPLES - 1)] - force[left])
        };
        let fine: Vec<f64> = (0..count).map(between).collect();
        let spacing = SPACING / FINE as f64;
        let states = response(spacing, [0.0, 0.0], &fine, |_, y, v, f| {
            (f - c * v - k * y) / m
        });
        let channel = |kind, column: usize, delay: f64, stream| {
            let later = (delay * FINE as f64).round() as i64;
            let at = |i: usize| {
                let i = (FINE * i) as i64 - later;
                states[i.clamp(0, count as i64 - 1) as usize][column]
            };
            let exact: Vec<f64> = (0..SAMPLES).map(at).collect();
            let sigma = level * rms(&exact);
            let noise = white(seed, stream, SAMPLES).into_iter();
            let values = exact.iter().zip(noise).map(|(y, e)| y + sigma * e);
            (kind, values.collect(), sigma)
        };
        let [of_y, of_a] = match late {
            Late::Acceleration => [0.0, delay],
            Late::Force => [-delay; 2],
        };
        Self {
            channels: [
                channel(ChannelKind::Displacement, 0, of_y, 2),
                channel(ChannelKind::Acceleration, 2, of_a, 3),
            ],
            force,
        }
    }

    fn problem(&self, late: Option<Late>, start: f64) -> Problem {
        let times: Vec<f64> = (0..SAMPLES).map(|i| SPACING * i as f64).collect();
        let mut record = Record::new("forced")
            .from_state(0.0, 0.0)
            .force(&times, &self.force);
        if late == Some(Late::Force) {
            record = record.input_delay(ScalarSpec::starting_at(start));
        }
        for (kind, values, sigma) in &self.channels {
            let inner = MARGIN..SAMPLES - MARGIN;
            let mut channel = ChannelSpec::new(*kind, &times[inner.clone()], &values[inner]);
            channel.span = [0.0, times[SAMPLES - 1]];
            channel.weighting = Some(Weighting::Estimated { sigma: *sigma });
            let is_late = late == Some(Late::Acceleration) && *kind == ChannelKind::Acceleration;
            channel.sensor = SensorSpec {
                delay: is_late.then(|| DelayValue::starting_at(start)),
                ..SensorSpec::default()
            };
            record = record.channel(channel);
        }
        let parts = [2.2, 0.4, 75.0].map(CoefficientSpec::constant);
        let builder = Builder::new(parts).record(record);
        builder.nodes(2 * (SAMPLES - 1) + 1).build().unwrap()
    }

    fn fitted(&self, late: Option<Late>) -> (Problem, Fit) {
        let problem = self.problem(late, 0.0);
        let settings = FitSettings::default();
        fit_with_noise(&problem, &problem.start(), &settings, &mut |_| {}).unwrap()
    }
}

/// Gradient and Jacobian against central differences, and the covariance against the Jacobian by differences.
#[test]
fn derivatives_in_delays_agree_with_differences() {
    for late in [Late::Acceleration, Late::Force] {
        let case = Case::new(1, late, 1.3, 0.02);
        // Between the nodes, at distances of a step of 0.025 s.
        let problem = case.problem(Some(late), 0.0373);
        let theta = problem.start();
        let evaluation = problem.evaluate(&theta).unwrap();
        let jacobian = problem.predictions_jacobian(&evaluation);
        let gradient = problem.gradient(&theta, &evaluation, GradientKind::Discrete);
        let mut by_differences = jacobian.clone();
        for j in 0..theta.len() {
            let step = 1e-5 * problem.functions.scalars().first().map_or(1.0, |s| s.size);
            let step = if j < 3 { 1e-6 * theta[j] } else { step };
            let at = |by: f64| {
                let mut moved = theta.clone();
                moved[j] += by;
                problem.evaluate(&moved).unwrap()
            };
            let (up, down) = (at(step), at(-step));
            let pairs = (up.predictions.iter().flatten().flatten())
                .zip(down.predictions.iter().flatten().flatten());
            let slopes = pairs.map(|(a, b)| (a - b) / (2.0 * step));
            for (i, slope) in slopes.enumerate() {
                by_differences[(i, j)] = slope;
            }
            // Rounding of J over the step: 1e-16/1e-5, and the cubic of the difference.
            let slope = (up.cost - down.cost) / (2.0 * step);
            let own = gradient.euclidean[j];
            assert!(
                (slope / own - 1.0).abs() < 1e-5,
                "{late:?} {j}: {own} {slope}"
            );
        }
        for (own, other) in jacobian.column_iter().zip(by_differences.column_iter()) {
            let size = other.amax();
            assert!(size > 0.0 && (own - other).amax() < 2e-6 * size, "{late:?}");
        }
        let mut row = 0;
        for channel in problem.channels() {
            for i in 0..channel.len() {
                let sigma = channel.weighting().sigma(i).unwrap();
                by_differences.row_mut(row).scale_mut(1.0 / sigma);
                row += 1;
            }
        }
        let information = by_differences.tr_mul(&by_differences);
        let expected = information.try_inverse().unwrap();
        let covariance = problem.covariance(&evaluation).unwrap();
        for j in 0..theta.len() {
            let ratio = covariance[(j, j)] / expected[(j, j)];
            assert!((ratio - 1.0).abs() < 1e-3, "{late:?} {j}: {ratio}");
        }
    }
}

/// Delays of 0.3 to 5 samples (0.25 of a period) with 2 % noise are found within 0.05 samples and four standard errors, with the mass as
/// without a delay.
#[test]
fn delays_are_found() {
    for (seed, delay) in [0.3, -0.7, 1.5, -3.0, 5.0].into_iter().enumerate() {
        for late in [Late::Acceleration, Late::Force] {
            let case = Case::new(seed as u64, late, delay, 0.02);
            let (problem, fit) = case.fitted(Some(late));
            let found = *fit.best.parameters.last().unwrap();
            let covariance = problem.covariance(&fit.best.evaluation).unwrap();
            let error = covariance[(3, 3)].sqrt();
            println!(
                "{late:?} {delay}: {:.4} +- {:.4} samples, m {:.4}",
                found / SPACING,
                error / SPACING,
                fit.best.parameters[0]
            );
            assert!((found / SPACING - delay).abs() < 0.05, "{late:?} {delay}");
            assert!((fit.best.parameters[0] - 2.0).abs() < 4.0 * covariance[(0, 0)].sqrt());
        }
    }
}

/// Without the parameter the delay of the response is named, to a tenth of a sample.
#[test]
fn delays_are_named_without_the_parameter() {
    for (seed, delay) in [0.3, 1.0, 2.5, 5.0].into_iter().enumerate() {
        let case = Case::new(seed as u64, Late::Force, -delay, 0.02);
        let (problem, fit) = case.fitted(None);
        let warnings = FitAssessment::of(&problem, &fit, true)
            .plausibility
            .warnings;
        let named = warnings.iter().find_map(|w| match w {
            Doubt::RecordError(RecordError::Delay { samples, .. }) => Some(*samples),
            Doubt::Preferred { candidates } => {
                let delay = candidates[0].estimates.iter().find(|q| q.name == "delay");
                delay.map(|q| q.value / SPACING)
            }
            _ => None,
        });
        let found = named.unwrap_or_else(|| panic!("{delay}: {warnings:?}"));
        assert!((found - delay).abs() < 0.1, "{delay}: {found}");
    }
}
