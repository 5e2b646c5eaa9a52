//! Verdicts on fits of wrong models and of wrong data, and on fits of right ones: random oscillators of 0.5 to 20 Hz with damping ratios of 1
//! to 5 %, 1000 samples, 12 to 30 in a period, with 2 % noise whose sigma is estimated; data by an independent integrator. Seeds are 0, 1,
//! 2, ...; `KMCFIT_CASES` is the number of seeds of each kind (5 by default, 200 in `.ci/long verdict`), and `KMCFIT_SHOW` prints each case.
//!
//! Each kind has a size at which it shifts an estimate by at least 5 standard errors or leaves a fifth more residual than the noise, in the
//! median of its cases; [`Found::size`] measures both.

use crate::common::counts::seeds;
use crate::common::forced::{broadband, response, rms, white};
use kmcfit_core::assessment::{
    ClassicalEstimate, Doubt, FitAssessment, RecordError, VerdictLevel, estimates, verdict_reasons,
};
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::model::{CoefficientSpec, ScalarSpec};
use kmcfit_core::objective::Evaluation;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, ChannelKind, NoiseModel, Weighting};
use kmcfit_core::solvers::{FitSettings, fit_with_noise};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::InputSample;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

const SAMPLES: usize = 1000;
const NOISE: f64 = 0.02;
/// Coefficient of the autoregression of coloured noise.
const CORRELATION: f64 = 0.8;
/// Difference of the clocks of force and response.
const CLOCKS: f64 = 0.01;
/// Delay of the response, in samples.
const DELAY: f64 = 1.0;
/// Level of saturation in root mean squares of the response.
const SATURATED: f64 = 2.0;
/// Coulomb friction relative to the root mean square of the spring force.
const FRICTION: f64 = 0.05;
/// Part of a second mode whose residuals the noise model describes.
const WEAK: f64 = 0.1;

/// A defect of the model or of the data.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Clean,
    QuadraticDamping,
    SecondMode,
    WeakMode,
    Saturation,
    Clocks,
    Delay,
    ForceSign,
    Factor(f64),
    Friction,
    Coloured,
}

/// A random system and how it is measured.
struct Case {
    kind: Kind,
    seed: u64,
    mass: f64,
    damping: f64,
    stiffness: f64,
    frequency: f64,
    spacing: f64,
    is_free: bool,
    /// Uniform numbers for what depends on the kind.
    draws: [f64; 3],
}

impl Case {
    fn new(kind: Kind, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
        let mut between = |low: f64, high: f64| -> f64 { random.random_range(low..high) };
        let frequency = 0.5 * 40f64.powf(between(0.0, 1.0));
        let mass = 0.5 * 40f64.powf(between(0.0, 1.0));
        let ratio = between(0.01, 0.05);
        let spacing = 1.0 / (frequency * between(12.0, 30.0));
        let draws = [(); 3].map(|()| between(0.0, 1.0));
        let omega = TAU * frequency;
        let can_be_free = matches!(
            kind,
            Kind::Clean | Kind::QuadraticDamping | Kind::Friction | Kind::SecondMode
        );
        Self {
            kind,
            seed,
            mass,
            damping: 2.0 * ratio * omega * mass,
            stiffness: mass * omega * omega,
            frequency,
            spacing,
            is_free: can_be_free && seed % 4 == 3,
            draws,
        }
    }

    fn times(&self) -> Vec<f64> {
        (0..SAMPLES).map(|i| self.spacing * i as f64).collect()
    }

    fn force(&self) -> Vec<f64> {
        match self.is_free {
            true => vec![0.0; SAMPLES],
            false => broadband(white(self.seed, 1, SAMPLES)),
        }
    }

    /// Displacement, velocity and acceleration of the first mode with the terms of the kind.
    fn first_mode(&self, force: &[f64]) -> Vec<[f64; 3]> {
        let (m, c, k) = (self.mass, self.damping, self.stiffness);
        let start = [if self.is_free { 1.0 } else { 0.0 }, 0.0];
        let linear = response(self.spacing, start, force, |_, y, v, f| {
            (f - c * v - k * y) / m
        });
        let size = |part: usize| rms(&linear.iter().map(|s| s[part]).collect::<Vec<f64>>());
        let (y0, v0) = (size(0), size(1));
        let run = |acceleration: &dyn Fn(f64, f64, f64, f64) -> f64| {
            response(self.spacing, start, force, acceleration)
        };
        match self.kind {
            // The viscous damping that dissipates as much at the root mean square of the velocity.
            Kind::QuadraticDamping => run(&|_, y, v, f| (f - c / v0 * v * v.abs() - k * y) / m),
            Kind::Friction => {
                let friction = FRICTION * k * y0;
                run(&|_, y, v, f| {
                    let sign = (v / (1e-3 * v0)).clamp(-1.0, 1.0);
                    (f - c * v - k * y - friction * sign) / m
                })
            }
            _ => linear,
        }
    }

    /// Response at the sample times without noise, with those of a second mode or on another clock.
    fn states(&self, force: &[f64]) -> Vec<[f64; 3]> {
        let states = self.first_mode(force);
        let (m, c, k) = (self.mass, self.damping, self.stiffness);
        match self.kind {
            Kind::SecondMode | Kind::WeakMode => {
                let ratio = 1.4 + 1.2 * self.draws[0];
                let size = match self.kind {
                    Kind::SecondMode => 0.3 + 0.5 * self.draws[1],
                    _ => WEAK,
                };
                let part = size * (self.draws[2] - 0.5).signum();
                let start = [if self.is_free { part } else { 0.0 }, 0.0];
                let second = response(self.spacing, start, force, |_, y, v, f| {
                    (part * f - c * ratio * v - k * ratio * ratio * y) / m
                });
                let sum = |(a, b): (&[f64; 3], [f64; 3])| [0, 1, 2].map(|i| a[i] + b[i]);
                states.iter().zip(second).map(sum).collect()
            }
            Kind::Clocks | Kind::Delay => {
                let (rate, delay) = match self.kind {
                    Kind::Clocks => (1.0 + CLOCKS * (self.draws[0] - 0.5).signum(), 0.0),
                    _ => (1.0, DELAY * self.spacing),
                };
                // Of cubic interpolation, whose error is 2e-4 of the amplitude at 12 samples per period.
                let at = |t: f64| {
                    let position = (t / self.spacing).clamp(0.0, (SAMPLES - 1) as f64);
                    let i = (position as usize).min(SAMPLES - 2);
                    let s = position - i as f64;
                    let cubic = |q: usize| {
                        let [a, b] = [states[i], states[i + 1]];
                        let h = self.spacing;
                        (1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s) * a[q]
                            + s * (1.0 - s) * (1.0 - s) * h * a[q + 1]
                            + s * s * (3.0 - 2.0 * s) * b[q]
                            - s * s * (1.0 - s) * h * b[q + 1]
                    };
                    let (y, v) = (cubic(0), cubic(1));
                    let f = force[i] + s * (force[i + 1] - force[i]);
                    [y, v, (f - c * v - k * y) / m]
                };
                self.times().iter().map(|t| at(rate * t - delay)).collect()
            }
            _ => states,
        }
    }

    /// The channel `kind` with noise, times and samples, and the noise without a defect of the data.
    fn channel(&self, kind: ChannelKind, states: &[[f64; 3]]) -> (ChannelSpec, f64) {
        let exact: Vec<f64> = states.iter().map(|s| s[kind as usize]).collect();
        let sigma = NOISE * rms(&exact);
        let rho = if self.kind == Kind::Coloured {
            CORRELATION
        } else {
            0.0
        };
        let mut noise = 0.0;
        let noise = white(self.seed, 2 + kind as u64, SAMPLES)
            .into_iter()
            .map(|e| {
                noise = rho * noise + (1.0 - rho * rho).sqrt() * e;
                noise
            });
        let mut samples: Vec<f64> = exact
            .iter()
            .zip(noise)
            .map(|(y, e)| y + sigma * e)
            .collect();
        let times = self.times();
        if self.kind == Kind::Saturation {
            let limit = SATURATED * rms(&exact);
            samples.iter_mut().for_each(|y| *y = y.clamp(-limit, limit));
        }
        if let Kind::Factor(factor) = self.kind
            && kind == ChannelKind::Acceleration
        {
            samples.iter_mut().for_each(|y| *y *= factor);
        }
        let mut spec = ChannelSpec::new(kind, &times, &samples);
        spec.weighting = Some(Weighting::Estimated { sigma });
        if self.kind == Kind::Coloured {
            spec.noise = NoiseModel::White;
        }
        (spec, sigma)
    }

    fn problem(&self) -> (Problem, f64) {
        let force = self.force();
        let states = self.states(&force);
        let kinds: &[ChannelKind] = match self.kind {
            Kind::Factor(_) => &[ChannelKind::Displacement, ChannelKind::Acceleration],
            _ if self.seed.is_multiple_of(2) => &[ChannelKind::Displacement],
            _ => &[ChannelKind::Acceleration],
        };
        let mut record = Record::new("record");
        record = match self.is_free {
            true => record.initial([1.1, 0.0].map(ScalarSpec::starting_at)),
            false => {
                let sign = if self.kind == Kind::ForceSign {
                    -1.0
                } else {
                    1.0
                };
                let force: Vec<f64> = force.iter().map(|f| sign * f).collect();
                record.from_state(0.0, 0.0).force(&self.times(), &force)
            }
        };
        let mut sigma = 0.0;
        for kind in kinds {
            let (channel, noise) = self.channel(*kind, &states);
            record = record.channel(channel);
            sigma = noise;
        }
        // Half of the masses are weighed.
        let mass = match self.is_free || self.seed.is_multiple_of(2) {
            true => CoefficientSpec::uncertain(self.mass, 0.01 * self.mass),
            false => CoefficientSpec::constant(0.9 * self.mass),
        };
        let parts = [
            mass,
            CoefficientSpec::constant(0.7 * self.damping),
            CoefficientSpec::constant(1.1 * self.stiffness),
        ];
        let builder = Builder::new(parts).record(record);
        (builder.nodes(2 * (SAMPLES - 1) + 1).build().unwrap(), sigma)
    }

    /// The problem after the remedy of an error of its record: times of the response, or gains of its sensors, as the advice states them.
    fn corrected(&self, error: &RecordError) -> Problem {
        let problem = self.problem().0;
        let grid = problem.system.grid;
        let force = problem.experiments[0].input.clone();
        let corrected = problem.with(|parts| {
            let experiment = &mut parts.experiments[0];
            let nodes = experiment.nodes;
            for channel in &mut experiment.channels {
                let kind = channel.kind();
                let (scale, delay, gain) = match error {
                    RecordError::Delay { delay, .. } => (1.0, *delay, 1.0),
                    RecordError::ClockDifference { percent, .. } => {
                        (1.0 + 0.01 * percent, 0.0, 1.0)
                    }
                    RecordError::InputSign { .. } => (1.0, 0.0, -1.0),
                    // A spike of the force: no remedy of the response.
                    RecordError::InputPulses { .. } | RecordError::InputJump { .. } => {
                        (1.0, 0.0, 1.0)
                    }
                    RecordError::ChannelFactor {
                        channel, factor, ..
                    } => (1.0, 0.0, if channel == kind.name() { *factor } else { 1.0 }),
                };
                let times = channel.times().iter().map(|t| scale * t - delay);
                let samples = times.zip(channel.observed().iter().map(|y| y / gain));
                let end = grid.time(nodes - 1);
                let (times, samples): (Vec<f64>, Vec<f64>) =
                    samples.filter(|(t, _)| (0.0..=end).contains(t)).unzip();
                let inputs = times.iter().map(|t| InputSample {
                    force: force.force_at(*t),
                    base: 0.0,
                });
                let inputs = inputs.collect();
                let weighting = channel.weighting().clone();
                let made = Channel::new(kind, times, samples, weighting, &grid, nodes);
                *channel = made.unwrap().with_inputs_at_samples(inputs);
            }
        });
        corrected.unwrap()
    }

    /// Root mean square error of the displacement to another force by the estimates of a problem, relative to that of the displacement.
    fn misfit_of_prediction(&self, problem: &Problem) -> f64 {
        let settings = FitSettings::default();
        let (_, fit) = fit_with_noise(problem, &problem.start(), &settings, &mut |_| {}).unwrap();
        let force = broadband(white(self.seed, 9, SAMPLES));
        let response_of = |[m, c, k]: [f64; 3]| -> Vec<f64> {
            let states = response(self.spacing, [0.0, 0.0], &force, |_, y, v, f| {
                (f - c * v - k * y) / m
            });
            states.iter().map(|s| s[0]).collect()
        };
        let estimate = [0, 1, 2].map(|j| fit.best.parameters[j]);
        let truth = response_of([self.mass, self.damping, self.stiffness]);
        let errors = response_of(estimate)
            .into_iter()
            .zip(&truth)
            .map(|(a, b)| a - b);
        let error = rms(&errors.collect::<Vec<f64>>()) / rms(&truth);
        if error.is_finite() {
            error
        } else {
            f64::INFINITY
        }
    }

    /// Standard deviation of the noise that a model of its correlation leaves.
    fn innovations(&self, sigma: f64) -> f64 {
        match self.kind {
            Kind::Coloured => sigma * (1.0 - CORRELATION * CORRELATION).sqrt(),
            _ => sigma,
        }
    }

    fn verdict(&self) -> Found {
        let (problem, sigma) = self.problem();
        let settings = FitSettings::default();
        let start = problem.start();
        let Ok((problem, fit)) = fit_with_noise(&problem, &start, &settings, &mut |_| {}) else {
            panic!("{:?} {}: no fit", self.kind, self.seed);
        };
        let assessment = FitAssessment::of(&problem, &fit, true);
        let reasons = verdict_reasons(&problem, &fit, Some(&assessment));
        let found = estimates(&problem, &fit, assessment.quantities());
        let truths = [
            ("mass", self.mass),
            ("damping", self.damping),
            ("stiffness", self.stiffness),
        ];
        let shifts = truths.iter().filter_map(|(name, truth)| {
            let estimate = &found.iter().find(|(known, _)| known == name)?.1;
            let [low, high] = estimate.ci95?;
            Some((estimate.value - truth).abs() / ((high - low) / (2.0 * 1.96)))
        });
        let shift = shifts.reduce(f64::max).unwrap_or(f64::INFINITY);
        Found {
            classical: assessment.classical.clone(),
            level: VerdictLevel::of(
                reasons
                    .iter()
                    .map(Doubt::severity)
                    .max()
                    .unwrap_or_default(),
            ),
            reasons,
            shift,
            residual: residual(&problem, &fit.best.evaluation) / self.innovations(sigma),
        }
    }
}

/// Root mean square of the residuals of the last channel.
fn residual(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let channel = problem.channels().last().unwrap();
    let predicted = evaluation.predictions[0].last().unwrap();
    rms(&channel.residuals(predicted).collect::<Vec<f64>>())
}

/// Verdict on a fit.
struct Found {
    classical: Option<ClassicalEstimate>,
    level: VerdictLevel,
    reasons: Vec<Doubt>,
    /// Largest error of mass, damping and stiffness in standard errors, infinite without them.
    shift: f64,
    /// Root mean square of the residuals over sigma of the noise, or over that of its innovations.
    residual: f64,
}

/// Counts of a kind.
struct Counts {
    found: Vec<Found>,
    cases: usize,
    right: usize,
    levels: [usize; 3],
    size: [f64; 2],
}

fn cases() -> u64 {
    let given = std::env::var("KMCFIT_CASES").ok();
    given.map_or(5, |text| text.parse().expect("a number of cases"))
}

fn count(kind: Kind, is_right: impl Fn(&Doubt) -> bool) -> Counts {
    let shows = std::env::var_os("KMCFIT_SHOW").is_some();
    let found: Vec<Found> = (0..cases())
        .map(|seed| {
            let found = Case::new(kind, seed).verdict();
            if shows {
                let Found {
                    level,
                    reasons,
                    shift,
                    residual,
                    ..
                } = &found;
                println!("{kind:?} {seed}: {level:?} {shift:.1} {residual:.2} {reasons:?}");
            }
            found
        })
        .collect();
    let middle = |of: &dyn Fn(&Found) -> f64| {
        let mut all: Vec<f64> = found.iter().map(of).collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    let at = |level: VerdictLevel| found.iter().filter(|f| f.level == level).count();
    let counts = Counts {
        cases: found.len(),
        right: found
            .iter()
            .filter(|f| f.reasons.iter().any(&is_right))
            .count(),
        levels: [
            VerdictLevel::Adequate,
            VerdictLevel::Check,
            VerdictLevel::Inadequate,
        ]
        .map(at),
        size: [middle(&|f| f.shift), middle(&|f| f.residual)],
        found,
    };
    let [adequate, check, inadequate] = counts.levels;
    println!(
        "| {kind:?} | {} | {adequate} | {check} | {inadequate} | {} | {:.1} | {:.2} |",
        counts.cases, counts.right, counts.size[0], counts.size[1]
    );
    counts
}

/// True for a doubt whose preferred candidates, or those as good, contain this name.
fn is_preferred(doubt: &Doubt, name: &str) -> bool {
    match doubt {
        Doubt::Preferred { candidates } => candidates.iter().any(|c| c.name.contains(name)),
        _ => false,
    }
}

/// Never adequate, with the right reason in at least 80 %, and of the stated size. With 200 seeds two kinds miss the first.
fn assert_found(kind: Kind, is_right: impl Fn(&Doubt) -> bool) {
    let counts = count(kind, is_right);
    assert_eq!(counts.levels[0], 0, "{kind:?} is adequate");
    assert!(
        10 * counts.right >= 8 * counts.cases,
        "{kind:?}: {}",
        counts.right
    );
    let [shift, residual] = counts.size;
    assert!(
        shift >= 5.0 || residual >= 1.2,
        "{kind:?}: {shift} {residual}"
    );
}

/// At most 17 of 200 clean records have a reason, 3 of fewer: the 99.9 % limits of a true rate of 4 %. A classical estimate exists for most records,
/// and its intervals contain the truth in at least nine of ten of them: they include the errors of the method, at a confidence of 95 %.
#[test]
fn clean_records_are_adequate() {
    let counts = count(Kind::Clean, |_| true);
    let most = if counts.cases >= 200 {
        17 * counts.cases / 200
    } else {
        3
    };
    assert!(
        counts.cases - counts.levels[0] <= most,
        "{:?}",
        counts.levels
    );
    let (mut all, mut right, mut damped) = (0, 0, 0);
    for (seed, found) in counts.found.iter().enumerate() {
        let Some(classical) = &found.classical else {
            continue;
        };
        let case = Case::new(Kind::Clean, seed as u64);
        let ratio = 0.5 * case.damping / (case.mass * case.stiffness).sqrt();
        let holds = |[low, high]: [f64; 2], truth: f64| (low..=high).contains(&truth);
        let of_damping = classical.damping_interval;
        all += 1;
        damped += usize::from(of_damping.is_some());
        let is_right = holds(classical.frequency_interval, case.frequency)
            && of_damping.is_none_or(|interval| holds(interval, ratio));
        right += usize::from(is_right);
        if !is_right {
            println!("classical {seed}: {} {ratio} {classical:?}", case.frequency);
        }
    }
    println!(
        "| Classical | {all} of {}, {damped} with a damping ratio | | | | {right} | | |",
        counts.cases
    );
    assert!(
        2 * all > counts.cases && 10 * right >= 9 * all,
        "{all} {right}"
    );
}

/// The remedy of each reason about a record improves the prediction of another record of the system: the response to another force, without
/// noise and defect, by the estimates before and after. The fit of the prediction is then at least 95 per cent.
#[test]
fn corrected_records_predict_another_record() {
    for kind in [
        Kind::Clocks,
        Kind::Delay,
        Kind::ForceSign,
        Kind::Factor(1000.0),
    ] {
        // Of two channels that disagree the wrong one shows only where the mass is known, as it is for even seeds.
        for seed in (0..seeds(1, 3)).map(|i| 2 * i) {
            let case = Case::new(kind, seed);
            let before = match kind {
                // The displacement is predicted, but samples of the acceleration are off by the factor.
                Kind::Factor(factor) => (1.0 - 1.0 / factor).abs(),
                _ => case.misfit_of_prediction(&case.problem().0),
            };
            let found = case.verdict();
            let mut errors = found.reasons.iter().filter_map(|reason| match reason {
                Doubt::RecordError(error) => Some(error),
                _ => None,
            });
            let Some(error) = errors.next_back() else {
                panic!("{kind:?} {seed}: {:?}", found.reasons);
            };
            let after = case.misfit_of_prediction(&case.corrected(error));
            println!("{kind:?} {seed}: {before:.3} {after:.4}");
            assert!(
                after < 0.05 && after < 0.5 * before,
                "{kind:?} {seed}: {before} {after}"
            );
        }
    }
}

#[test]
fn quadratic_damping_as_viscous() {
    let of = CoefficientKind::QUADRATIC_DAMPING;
    assert_found(Kind::QuadraticDamping, |reason| {
        is_preferred(reason, of.name())
    });
}

#[test]
fn friction_left_out() {
    let of = CoefficientKind::COULOMB_FRICTION;
    assert_found(Kind::Friction, |reason| is_preferred(reason, of.name()));
}

#[test]
fn a_second_mode() {
    assert_found(Kind::SecondMode, |reason| {
        is_preferred(reason, "second mode")
    });
}

/// A mode with a tenth of the first one's part, which the noise model may describe: it is named, or the force is coherent with the
/// residuals.
#[test]
fn a_weak_second_mode() {
    assert_found(Kind::WeakMode, |reason| {
        matches!(reason, Doubt::CoherentResiduals { .. }) || is_preferred(reason, "second mode")
    });
}

#[test]
fn saturation() {
    assert_found(Kind::Saturation, |reason| {
        matches!(reason, Doubt::Saturation { .. })
    });
}

#[test]
fn clocks_that_differ() {
    assert_found(Kind::Clocks, |reason| match reason {
        Doubt::RecordError(RecordError::ClockDifference { percent, .. }) => {
            (percent.abs() - 100.0 * CLOCKS).abs() < 0.1
        }
        _ => false,
    });
}

#[test]
fn a_delay() {
    assert_found(Kind::Delay, |reason| match reason {
        Doubt::RecordError(RecordError::Delay { samples, .. }) => (samples - DELAY).abs() < 0.1,
        _ => false,
    });
}

#[test]
fn the_sign_of_the_force() {
    assert_found(Kind::ForceSign, |reason| {
        matches!(reason, Doubt::RecordError(RecordError::InputSign { .. }))
    });
}

/// True for a factor of the acceleration, or the inverse of one of the displacement, within a tenth.
fn is_factor(reason: &Doubt, expected: f64) -> bool {
    match reason {
        Doubt::RecordError(RecordError::ChannelFactor {
            channel, factor, ..
        }) => {
            let factor = match channel.as_str() {
                "displacement" => 1.0 / factor,
                _ => *factor,
            };
            (factor / expected - 1.0).abs() < 0.1
        }
        _ => false,
    }
}

#[test]
fn one_of_two_channels_off_by_1000() {
    assert_found(Kind::Factor(1000.0), |r| is_factor(r, 1000.0));
}

#[test]
fn coloured_noise_as_white() {
    assert_found(Kind::Coloured, |reason| {
        matches!(reason, Doubt::Coloured { .. })
    });
}
