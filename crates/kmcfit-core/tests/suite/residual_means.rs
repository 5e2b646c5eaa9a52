//! Means of residuals: oscillators of 1 Hz under a broadband force, with white and with correlated noise of 5 %, displacements and
//! accelerations by an independent integrator, with and without an offset of the sensor. Seeds are 0, 1, 2, ...

use crate::common::counts::seeds;
use crate::common::forced::{broadband, response, rms, white};
use kmcfit_core::assessment::{Doubt, FitAssessment};
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::candidates::Addition;
use kmcfit_core::candidates::RecordParameter;
use kmcfit_core::model::{CoefficientSpec, ScalarSpec, SensorSpec};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{ChannelKind, Weighting};
use kmcfit_core::solvers::{Fit, FitSettings, fit_with_noise};
use std::f64::consts::TAU;

const SAMPLES: usize = 1000;
const SPACING: f64 = 0.05;
/// Coefficient of the autoregression of correlated noise.
const CORRELATION: f64 = 0.8;
/// Offset in standard deviations of the noise: 8 standard errors of the mean with correlated noise, 25 with white noise.
const OFFSET: f64 = 0.8;

/// One record.
struct Case {
    kind: ChannelKind,
    force: Vec<f64>,
    samples: Vec<f64>,
    sigma: f64,
    /// Offset of the sensor, SI.
    offset: f64,
}

impl Case {
    fn new(seed: u64, has_offset: bool) -> Self {
        let (m, k) = (2.0, TAU * TAU * 2.0);
        let c = 2.0 * m * TAU * [0.01, 0.03, 0.05][seed as usize % 3];
        let kind = [ChannelKind::Displacement, ChannelKind::Acceleration][seed as usize % 2];
        let force = broadband(white(seed, 1, SAMPLES));
        let states = response(SPACING, [0.0, 0.0], &force, |_, y, v, f| {
            (f - c * v - k * y) / m
        });
        let column = match kind {
            ChannelKind::Displacement => 0,
            _ => 2,
        };
        let exact: Vec<f64> = states.iter().map(|state| state[column]).collect();
        let sigma = 0.05 * rms(&exact);
        let is_correlated = seed / 2 % 2 == 1;
        let rho = if is_correlated { CORRELATION } else { 0.0 };
        let mut noise = 0.0;
        let noise = white(seed, 2, SAMPLES).into_iter().map(|e| {
            noise = rho * noise + (1.0 - rho * rho).sqrt() * e;
            noise
        });
        let sign = if seed.is_multiple_of(3) { -1.0 } else { 1.0 };
        let offset = if has_offset {
            sign * OFFSET * sigma
        } else {
            0.0
        };
        let samples = exact.iter().zip(noise).map(|(y, e)| y + sigma * e + offset);
        Self {
            kind,
            samples: samples.collect(),
            force,
            sigma,
            offset,
        }
    }

    /// The fit, and the warnings about means.
    fn fitted(&self, estimates_offset: bool) -> (Problem, Fit, Vec<Doubt>) {
        let times: Vec<f64> = (0..SAMPLES).map(|i| SPACING * i as f64).collect();
        let mut channel = ChannelSpec::new(self.kind, &times, &self.samples);
        channel.weighting = Some(Weighting::Estimated { sigma: self.sigma });
        if estimates_offset {
            channel.sensor = SensorSpec {
                offset: Some(ScalarSpec::ESTIMATED),
                ..SensorSpec::default()
            };
        }
        let record = Record::new("forced")
            .from_state(0.0, 0.0)
            .force(&times, &self.force)
            .channel(channel);
        let parts = [2.2, 0.4, 75.0].map(CoefficientSpec::constant);
        let builder = Builder::new(parts).record(record);
        let problem = builder.nodes(2 * (SAMPLES - 1) + 1).build().unwrap();
        let settings = FitSettings::default();
        let start = problem.start();
        let (problem, fit) = fit_with_noise(&problem, &start, &settings, &mut |_| {}).unwrap();
        let assessment = FitAssessment::of(&problem, &fit, true);
        let mut warnings = assessment.plausibility.warnings;
        warnings.retain(|w| offset(w).is_some());
        (problem, fit, warnings)
    }
}

/// The offset of a sensor that is preferred to the model, or as good as what is.
fn offset(doubt: &Doubt) -> Option<f64> {
    let Doubt::Preferred { candidates } = doubt else {
        return None;
    };
    let is_offset = |a: &Addition| matches!(a, Addition::Record(RecordParameter::Offset(..)));
    let offset = candidates
        .iter()
        .find(|c| c.additions.iter().all(is_offset))?;
    Some(offset.estimates[0].value)
}

/// One of 40 at most; none in these.
#[test]
fn no_mean_is_named_where_there_is_no_offset() {
    let named = |seed: &u64| !Case::new(*seed, false).fitted(false).2.is_empty();
    let alarms = (0..40).filter(named).count();
    println!("{alarms} of 40");
    assert!(alarms <= 1, "{alarms}");
}

/// Each offset is named; with the offset estimated the residuals have no mean and are smaller, and the estimate is within four standard
/// errors.
#[test]
fn an_offset_is_named_and_its_estimate_removes_the_mean() {
    // Twelve are all combinations of kind, damping, noise and sign.
    for seed in 0..seeds(12, 20) {
        let case = Case::new(seed, true);
        let (before, fit, warnings) = case.fitted(false);
        let [named] = warnings.as_slice() else {
            panic!("{seed}: {warnings:?}");
        };
        let named = offset(named).unwrap();
        assert!(named * case.offset > 0.0, "{seed}: {named} {}", case.offset);
        let size = |problem: &Problem, fit: &Fit| {
            let channel = problem.channels().next().unwrap();
            let predicted = &fit.best.evaluation.predictions[0][0];
            rms(&channel.residuals(predicted).collect::<Vec<f64>>())
        };
        let spoilt = size(&before, &fit);
        let (problem, fit, warnings) = case.fitted(true);
        assert!(warnings.is_empty(), "{seed}: {warnings:?}");
        let improved = size(&problem, &fit);
        assert!(improved < 0.9 * spoilt, "{seed}: {improved} {spoilt}");
        let found = *fit.best.parameters.last().unwrap();
        let covariance = problem.covariance(&fit.best.evaluation).unwrap();
        let error = covariance[(3, 3)].sqrt();
        println!("{seed}: {found:.3e} of {:.3e} +- {error:.1e}", case.offset);
        assert!((found - case.offset).abs() < 4.0 * error, "{seed}");
    }
}
