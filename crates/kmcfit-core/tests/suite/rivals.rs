//! Time or amplitude: ring-downs of systems whose stiffness or damping depends on the amplitude or on time, fitted with coefficients that vary with
//! time. 25 periods of 1 Hz at 20 samples per period, 1 % noise of the first amplitude, data by an independent integrator. Seeds are 0, 1, 2, ...

use crate::common::forced::{response, white};
use kmcfit_core::assessment::{Doubt, FitAssessment, function_summaries, verdict_reasons};
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::identifiability::ClassificationKind;
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::record::{ChannelKind, Weighting};
use kmcfit_core::solvers::{FitSettings, Initial, fit_with_noise};
use std::f64::consts::TAU;

const STIFFNESS: f64 = TAU * TAU;
const SAMPLES: usize = 500;
const SPACING: f64 = 0.05;
const DURATION: f64 = SPACING * (SAMPLES - 1) as f64;

/// Systems of mass 1 kg released at 1 m.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Cubic,
    Quintic,
    Quadratic,
    Coulomb,
    /// Stiffness with a dip of 10 % at the third of six knots.
    Time,
    Constant,
}

impl Kind {
    /// Restoring and damping force at time `t`.
    fn force(self, t: f64, y: f64, v: f64) -> f64 {
        let linear = STIFFNESS * y + 2.0 * 0.01 * TAU * v;
        linear
            + match self {
                Self::Cubic => 0.1 * STIFFNESS * y.powi(3),
                Self::Quintic => 0.1 * STIFFNESS * y.powi(5),
                Self::Quadratic => 0.01 * v * v.abs(),
                Self::Coulomb => 0.01 * STIFFNESS * (v / 0.02).tanh(),
                Self::Time => {
                    -0.1 * STIFFNESS * y * (1.0 - 5.0 * (t / DURATION - 0.4).abs()).max(0.0)
                }
                Self::Constant => 0.0,
            }
    }
}

/// What a fit says about its functions.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Said {
    /// A function varies with time, and no rival is named.
    Time,
    /// A rival is named.
    TimeOrAmplitude,
    /// No function varies.
    Constant,
}

fn said(kind: Kind, seed: u64) -> Said {
    let force = vec![0.0; SAMPLES];
    let states = response(SPACING, [1.0, 0.0], &force, |t, y, v, _| {
        -kind.force(t, y, v)
    });
    let noise = white(seed, 7, SAMPLES);
    let samples: Vec<f64> = (states.iter().zip(noise))
        .map(|([y, ..], e)| y + 0.01 * e)
        .collect();
    let times: Vec<f64> = (0..samples.len()).map(|i| SPACING * i as f64).collect();
    let mut channel = ChannelSpec::new(ChannelKind::Displacement, &times, &samples);
    channel.weighting = Some(Weighting::Estimated { sigma: 0.02 });
    let record = Record::new("ring-down").channel(channel);
    let parts = [
        CoefficientSpec::fixed(1.0),
        CoefficientSpec::piecewise_linear(3, 0.2),
        CoefficientSpec::piecewise_linear(6, STIFFNESS),
    ];
    let problem = Builder::new(parts).record(record).build().unwrap();
    let settings = FitSettings {
        initial: Initial::Data,
        ..FitSettings::default()
    };
    let (problem, fit) =
        fit_with_noise(&problem, &problem.start(), &settings, &mut |_| {}).unwrap();
    let assessment = FitAssessment::of(&problem, &fit, true);
    let reasons = verdict_reasons(&problem, &fit, Some(&assessment));
    let is_rival = |r: &Doubt| match r {
        Doubt::AsGood { .. } => true,
        Doubt::Preferred { candidates } => candidates.iter().any(|c| c.to_constants),
        _ => false,
    };
    if reasons.iter().any(is_rival) {
        return Said::TimeOrAmplitude;
    }
    let summaries = function_summaries(&problem, &fit, Some(assessment.errors()), None);
    let varies = summaries.iter().any(|f| {
        f.verdict == Some(ClassificationKind::Identified)
            && f.constant_p_value.is_some_and(|p| p < 0.01)
    });
    match varies {
        true => Said::Time,
        false => Said::Constant,
    }
}

/// Number of the first seeds with each answer: time, time or amplitude, constant.
fn counts(kind: Kind, seeds: u64) -> [usize; 3] {
    let mut counts = [0; 3];
    for seed in 0..seeds {
        counts[said(kind, seed) as usize] += 1;
    }
    println!(
        "| {kind:?} | {seeds} | {} | {} | {} |",
        counts[0], counts[1], counts[2]
    );
    counts
}

/// No dependence on the amplitude is identified as one on time (100 records of each kind in `.ci/long rivals`).
#[test]
fn a_dependence_on_the_amplitude_is_no_dependence_on_time() {
    for kind in [Kind::Cubic, Kind::Quintic, Kind::Quadratic, Kind::Coulomb] {
        let [time, rival, _] = counts(kind, 10);
        assert_eq!(time, 0, "{kind:?}");
        // Friction stops the motion, and a damping on three knots that follows it leaves residuals that permit no test of a constant.
        let least = if kind == Kind::Coulomb { 0 } else { 9 };
        assert!(rival >= least, "{kind:?} {rival}");
    }
}

/// A variation that no amplitude explains is identified, and constants stay constants but for the level of the test.
#[test]
fn a_dependence_on_time_is_identified() {
    let [time, rival, _] = counts(Kind::Time, 10);
    assert_eq!((time, rival), (10, 0));
    let [time, rival, constant] = counts(Kind::Constant, 10);
    assert!(time + rival <= 1, "{time} {rival} {constant}");
}

/// The table of `.ci/long rivals`.
#[test]
#[ignore = "minutes; .ci/long rivals"]
fn many_records() {
    println!("| system | records | time | time or amplitude | constant |");
    println!("|---|---|---|---|---|");
    for kind in [Kind::Cubic, Kind::Quintic, Kind::Quadratic, Kind::Coulomb] {
        assert_eq!(counts(kind, 100)[0], 0, "{kind:?}");
    }
    counts(Kind::Time, 100);
    counts(Kind::Constant, 100);
}
