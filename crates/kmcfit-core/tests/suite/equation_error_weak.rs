//! The equation error in the weak form: a driven cart with Coulomb friction at several sampling rates and noise levels, robust losses,
//! and filtered channels. Data by an independent integrator. Seeds are 0, 1, 2, ...

use crate::common::counts::seeds;
use crate::common::forced::{response, rms, white};
use kmcfit_core::assessment::EquationErrorIntervals;
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{ChannelKind, Loss, Weighting};
use kmcfit_core::signal::SecondOrder;
use kmcfit_core::solvers::{Fit, FitSettings, Solver, Status, fit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use std::ops::Range;

/// Mass (kg), damping (N s/m), friction (N) and its width (m/s).
const MASS: f64 = 95.0;
const DAMPING: f64 = 200.0;
const FRICTION: f64 = 40.0;
const WIDTH: f64 = 2e-3;
/// Length of a record, s.
const DURATION: f64 = 40.0;

/// A record of the cart.
#[derive(Clone, Copy)]
struct Cart {
    seed: u64,
    /// Samples per second.
    rate: usize,
    /// Noise of each channel relative to its root mean square.
    noise: f64,
    /// Stiffness, N/m; zero without a spring.
    stiffness: f64,
    /// True with an accelerometer.
    has_accelerometer: bool,
}

/// Samples of a cart.
struct Samples {
    times: Vec<f64>,
    force: Vec<f64>,
    displacement: Vec<f64>,
    acceleration: Vec<f64>,
    /// Standard deviations of the noise of displacement and acceleration.
    sigmas: [f64; 2],
}

/// Force of 60 sines between 0.2 and 8 Hz, 300 N rms.
fn multisine(times: &[f64], seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
    let waves: Vec<[f64; 2]> = (0..60)
        .map(|_| {
            [
                TAU * random.random_range(0.2..8.0),
                random.random_range(0.0..TAU),
            ]
        })
        .collect();
    let amplitude = 300.0 * f64::sqrt(2.0 / 60.0);
    let at = |t: &f64| {
        let sum: f64 = waves.iter().map(|[w, phase]| (w * t + phase).sin()).sum();
        amplitude * sum
    };
    times.iter().map(at).collect()
}

impl Cart {
    fn samples(self) -> Samples {
        let spacing = 1.0 / self.rate as f64;
        let count = (DURATION * self.rate as f64) as usize + 1;
        let times: Vec<f64> = (0..count).map(|i| spacing * i as f64).collect();
        let force = multisine(&times, self.seed);
        let friction = |v: f64| FRICTION * v / (v * v + WIDTH * WIDTH).sqrt();
        let states = response(spacing, [0.0, 0.0], &force, |_, y, v, f| {
            (f - DAMPING * v - self.stiffness * y - friction(v)) / MASS
        });
        let noisy = |q: usize, stream: u64| {
            let exact: Vec<f64> = states.iter().map(|state| state[q]).collect();
            let sigma = self.noise * rms(&exact);
            let noise = white(self.seed, stream, count);
            let values = exact.iter().zip(noise).map(|(x, e)| x + sigma * e);
            (values.collect(), sigma)
        };
        let (displacement, of_y) = noisy(0, 2);
        let (acceleration, of_a) = noisy(2, 3);
        Samples {
            times,
            force,
            displacement,
            acceleration,
            sigmas: [of_y, of_a],
        }
    }

    fn record(self, samples: &Samples) -> Record {
        self.filtered_record(samples, &[])
    }

    /// The record with a filter of all channels.
    fn filtered_record(self, samples: &Samples, filter: &[SecondOrder]) -> Record {
        let channel = |kind, values: &[f64], sigma| {
            let mut channel = ChannelSpec::new(kind, &samples.times, values);
            channel.weighting = Some(Weighting::Sigma(sigma));
            channel.filter = filter.to_vec();
            channel
        };
        let [of_y, of_a] = samples.sigmas;
        let displacement = channel(ChannelKind::Displacement, &samples.displacement, of_y);
        let record = Record::new("cart")
            .from_state(0.0, 0.0)
            .force(&samples.times, &samples.force)
            .channel(displacement);
        match self.has_accelerometer {
            true => record.channel(channel(
                ChannelKind::Acceleration,
                &samples.acceleration,
                of_a,
            )),
            false => record,
        }
    }

    /// Mass, damping, friction and, with a spring, stiffness to be found.
    fn problem(self, record: Record) -> Problem {
        let stiffness = match self.stiffness > 0.0 {
            true => CoefficientSpec::constant(1000.0),
            false => CoefficientSpec::fixed(0.0),
        };
        let parts = [
            CoefficientSpec::constant(10.0),
            CoefficientSpec::constant(10.0),
            stiffness,
        ];
        let builder = Builder::new(parts)
            .coulomb_friction(CoefficientSpec::constant(1.0), WIDTH)
            .record(record)
            .solver(Solver::EquationError);
        builder.build().expect("a problem")
    }

    fn truth(self) -> Vec<f64> {
        match self.stiffness > 0.0 {
            true => vec![MASS, DAMPING, self.stiffness, FRICTION],
            false => vec![MASS, DAMPING, FRICTION],
        }
    }
}

fn fitted(problem: &Problem) -> Fit {
    let settings = FitSettings {
        solver: Solver::EquationError,
        ..FitSettings::default()
    };
    let found = fit(problem, &problem.start(), &settings, &mut |_| {}).expect("no simulation");
    assert_eq!(
        found.outcome.status,
        Status::Converged,
        "{:?}",
        found.outcome
    );
    found
}

/// Of several seeds: for each parameter the number whose 95 % interval holds the truth, the mean and the largest relative error.
struct Coverage {
    held: Vec<usize>,
    bias: Vec<f64>,
    largest: Vec<f64>,
}

fn coverage(seeds: Range<u64>, cart: impl Fn(u64) -> Cart) -> Coverage {
    let count = cart(0).truth().len();
    let mut all = Coverage {
        held: vec![0; count],
        bias: vec![0.0; count],
        largest: vec![0.0; count],
    };
    let number = (seeds.end - seeds.start) as f64;
    for seed in seeds {
        let cart = cart(seed);
        let problem = cart.problem(cart.record(&cart.samples()));
        let found = fitted(&problem);
        let intervals = EquationErrorIntervals::of(&problem, &found).expect("intervals");
        let covariance = intervals.bands.covariance.as_ref().expect("a covariance");
        for (j, truth) in cart.truth().into_iter().enumerate() {
            let off = found.best.parameters[j] - truth;
            all.held[j] += usize::from(off.abs() <= 1.96 * covariance[(j, j)].sqrt());
            all.bias[j] += off / truth / number;
            all.largest[j] = all.largest[j].max((off / truth).abs());
        }
    }
    all
}

/// The truth lies within the 95 % intervals in all seeds but three at most, and the mass is right to 1 %, at 250 Hz and at 1 kHz. With a
/// coverage of 95 % more than three of 20 miss with a probability of 2 %, of 8 with one of 0.04 %.
fn check_rates(stiffness: f64, has_accelerometer: bool) {
    let count = seeds(8, 20);
    for rate in [1000, 250] {
        let found = coverage(0..count, |seed| Cart {
            seed,
            rate,
            noise: 0.01,
            stiffness,
            has_accelerometer,
        });
        let case = format!("{rate} Hz, k {stiffness}, accelerometer {has_accelerometer}");
        println!(
            "{case}: held {:?}, bias {:.5?}, largest {:.5?}",
            found.held, found.bias, found.largest
        );
        let is_covered = found.held.iter().all(|held| held + 3 >= count as usize);
        assert!(is_covered, "{case}: {:?}", found.held);
        assert!(found.largest[0] < 0.01, "{case}: {:?}", found.largest);
    }
}

#[test]
fn the_sampling_rate_does_not_bias_the_estimates() {
    check_rates(4000.0, false);
}

#[test]
fn the_sampling_rate_does_not_bias_the_estimates_without_a_spring() {
    check_rates(0.0, false);
}

#[test]
fn the_sampling_rate_does_not_bias_the_estimates_with_an_accelerometer() {
    check_rates(4000.0, true);
}

/// Table of bias and coverage by rate and noise; the seeds are none of those of the other tests.
#[test]
#[ignore = "long: 50 seeds of 24 cases; `.ci/long equation_error`"]
fn bias_and_coverage_by_rate_and_noise() {
    println!("| rate | noise | cart | held, of 50 | bias, per cent | largest error, per cent |");
    println!("|---|---|---|---|---|---|");
    for rate in [250, 1000] {
        for noise in [0.001, 0.01, 0.02, 0.05] {
            for (name, stiffness, has_accelerometer) in [
                ("spring", 4000.0, false),
                ("no spring", 0.0, false),
                ("spring, accelerometer", 4000.0, true),
            ] {
                let found = coverage(500..550, |seed| Cart {
                    seed,
                    rate,
                    noise,
                    stiffness,
                    has_accelerometer,
                });
                let percent = |list: &[f64]| {
                    let each = list.iter().map(|x| format!("{:.3}", 100.0 * x));
                    each.collect::<Vec<_>>().join(", ")
                };
                let held: Vec<String> = found.held.iter().map(ToString::to_string).collect();
                println!(
                    "| {rate} Hz | {} % | {name} | {} | {} | {} |",
                    100.0 * noise,
                    held.join(", "),
                    percent(&found.bias),
                    percent(&found.largest)
                );
            }
        }
    }
}

/// One record with a spring and noise of one per cent at 250 Hz.
fn plain() -> Cart {
    Cart {
        seed: 3,
        rate: 250,
        noise: 0.01,
        stiffness: 4000.0,
        has_accelerometer: false,
    }
}

fn errors(cart: Cart, found: &Fit) -> Vec<f64> {
    let pairs = found.best.parameters.iter().zip(cart.truth());
    pairs
        .map(|(found, truth)| (found / truth - 1.0).abs())
        .collect()
}

/// One sample of a thousand is off by up to ten root mean squares: least squares fail, the robust losses do not.
#[test]
fn robust_losses_limit_the_influence_of_outliers() {
    let cart = plain();
    let mut samples = cart.samples();
    let size = rms(&samples.displacement);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..samples.times.len() / 1000 {
        let i = random.random_range(0..samples.times.len());
        samples.displacement[i] += size * random.random_range(-10.0..10.0);
    }
    let of = |loss: Loss| {
        let problem = cart.problem(cart.record(&samples).loss(loss));
        let found = fitted(&problem);
        assert!(EquationErrorIntervals::of(&problem, &found).is_ok());
        errors(cart, &found)
    };
    let squares = of(Loss::Squares);
    let huber = of(Loss::Huber { threshold: 1.345 });
    let student = of(Loss::StudentT { degrees: 4.0 });
    println!("squares {squares:?}, huber {huber:?}, student {student:?}");
    assert!(squares[0] > 0.05, "{squares:?}");
    for robust in [huber, student] {
        assert!(robust[0] < 0.02 && robust[2] < 0.02, "{robust:?}");
        assert!(robust.iter().all(|e| *e < 0.1), "{robust:?}");
    }
}
