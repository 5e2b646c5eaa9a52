//! Covariances and sigmas of estimates under Gaussian noise and with outliers, without bounds and penalties.

use crate::common::synthetic::{Truth, cramer_rao, rms, run, settings, with_noise};
use kmcfit_core::builder::{Builder, Record};
use kmcfit_core::functions::{
    Basis, CoefficientFunction, Parameterization, Ratio, ScalarParameter, ScalarValue,
    uniform_knots,
};
use kmcfit_core::identifiability::Bands;
use kmcfit_core::model::CoefficientSpec;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Loss, Sensor, Weighting};
use kmcfit_core::solvers::fit_with_noise;
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{Excitation, Grid, Method, NodalCoefficients, State, System};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

const NODES: usize = 201;
const DURATION: f64 = 12.0;
/// Noise relative to the samples: small enough that the problem is linear over the errors of the parameters (per mille to per cent),
/// whose second-order bias is a hundredth of their standard deviation.
const NOISE: f64 = 0.02;
fn initial() -> State {
    State::one(1.5, -0.8)
}

/// Samples from clean ones, sigma and a seed.
type Spoil = fn(&[f64], f64, u64) -> Vec<f64>;

/// A system of constants with one channel sampled at all nodes.
struct Setup {
    terms: Vec<(Law, CoefficientKind)>,
    /// Mass first; `None` for what is known.
    start: Vec<Option<f64>>,
    truth: Vec<f64>,
    kind: ChannelKind,
    excitation: Option<Excitation>,
    /// True if the initial state is estimated.
    state: bool,
    /// Gain and offset, if they are estimated.
    sensor: Option<[f64; 2]>,
    loss: Loss,
}

impl Setup {
    fn free(kind: ChannelKind) -> Self {
        Self {
            terms: vec![
                (Law::Damping, CoefficientKind::DAMPING),
                (Law::Stiffness, CoefficientKind::STIFFNESS),
            ],
            truth: vec![1.0, 0.2, 4.0],
            start: vec![None, Some(0.25), Some(3.8)],
            kind,
            excitation: None,
            state: false,
            sensor: None,
            loss: Loss::Squares,
        }
    }

    fn forced(kind: ChannelKind) -> Self {
        let grid = Grid::new(0.0, DURATION, NODES).unwrap();
        let times = grid.times();
        let force = times
            .iter()
            .map(|t| 2.0 * (1.1 * t).sin() + 1.5 * (2.7 * t).cos());
        Self {
            excitation: Some(Excitation::force_at_nodes(&force.collect::<Vec<f64>>())),
            ..Self::free(kind)
        }
    }

    fn system(&self) -> System {
        System {
            grid: Grid::new(0.0, DURATION, NODES).unwrap(),
            method: Method::Rk4,
            structure: Structure::one(self.terms.iter().map(|t| t.0).collect()),
        }
    }

    /// The true parameters, in the order of the problem's.
    fn theta(&self) -> Vec<f64> {
        let estimated = self.truth.iter().zip(&self.start);
        let mut theta: Vec<f64> = estimated
            .filter_map(|(p, start)| start.map(|_| *p))
            .collect();
        if self.state {
            theta.extend([initial().displacement(0), initial().velocity(0)]);
        }
        theta.extend(self.sensor.iter().flatten());
        theta
    }

    fn clean(&self) -> Vec<f64> {
        let system = self.system();
        let each: Vec<Vec<f64>> = self.truth.iter().map(|p| vec![*p; NODES]).collect();
        let nodal = NodalCoefficients {
            inertias: vec![each[0].clone()],
            coefficients: each[1..].to_vec(),
        };
        let truth = Truth {
            system: &system,
            nodal: &nodal,
            excitation: self.excitation.as_ref(),
            initial: initial(),
        };
        let seen = truth.seen(self.kind, &system.grid.times(), &[]);
        let [gain, offset] = self.sensor.unwrap_or([1.0, 0.0]);
        seen.iter().map(|x| gain * x + offset).collect()
    }

    fn problem(&self, values: Vec<f64>, sigma: f64) -> Problem {
        let system = self.system();
        let grid = system.grid;
        let quantities =
            std::iter::once(CoefficientKind::MASS).chain(self.terms.iter().map(|t| t.1));
        let list = quantities.zip(self.start.iter().zip(&self.truth));
        let list = list
            .map(|(quantity, (start, truth))| match start {
                Some(start) => CoefficientFunction::constant(quantity, *start, NODES),
                None => CoefficientFunction::fixed(quantity, vec![*truth; NODES]),
            })
            .collect();
        let scalar = |start: f64| ScalarParameter {
            name: "a number".into(),
            unit: String::new(),
            start,
            size: 1.0,
            prior: None,
        };
        let mut scalars = Vec::new();
        let weighting = Weighting::Sigma(sigma);
        let mut channel =
            Channel::new(self.kind, grid.times(), values, weighting, &grid, NODES).unwrap();
        let mut experiment = Experiment::free("record", initial(), NODES);
        experiment.excitation = self.excitation.clone();
        if self.state {
            experiment.initial_parameters = vec![Some(0), Some(1)];
            scalars.extend([scalar(1.3), scalar(-0.6)]);
        }
        if self.sensor.is_some() {
            channel = channel.with_sensor(Sensor {
                gain: ScalarValue::Estimated(scalars.len()),
                offset: ScalarValue::Estimated(scalars.len() + 1),
                ..Sensor::default()
            });
            scalars.extend([scalar(1.0), scalar(0.0)]);
        }
        channel = channel.with_loss(self.loss);
        let functions = Parameterization::new(list, NODES, grid.step())
            .unwrap()
            .with_scalars(scalars);
        Problem::new(system, functions, vec![experiment.with_channel(channel)]).unwrap()
    }

    /// Errors of all parameters in units of the spread of Cramer and Rao, for samples that `spoil`
    /// makes of the clean ones and sigma.
    fn errors(&self, seeds: std::ops::RangeInclusive<u64>, spoil: Spoil) -> Vec<Vec<f64>> {
        let clean = self.clean();
        let sigma = NOISE * rms(&clean);
        let theta = self.theta();
        let exact = self.problem(clean.clone(), sigma);
        let covariance = cramer_rao(&exact, &theta);
        let each = seeds.map(|seed| {
            let found = run(&self.problem(spoil(&clean, sigma, seed), sigma));
            let pairs = found.best.parameters.iter().zip(&theta).enumerate();
            pairs
                .map(|(j, (a, b))| (a - b) / covariance[(j, j)].sqrt())
                .collect()
        });
        each.collect()
    }
}

/// One sample in twenty is off by 30 standard deviations, to either side.
fn with_outliers(clean: &[f64], sigma: f64, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(1000 + seed);
    let mut spoiled = with_noise(clean, sigma, seed);
    for value in &mut spoiled {
        if random.random_bool(0.05) {
            let side = if random.random_bool(0.5) { 1.0 } else { -1.0 };
            *value += side * 30.0 * sigma;
        }
    }
    spoiled
}

/// Root mean square error in units of the spread of Cramer and Rao without outliers.
fn with_loss(loss: Loss) -> f64 {
    let setup = Setup {
        loss,
        ..Setup::forced(ChannelKind::Displacement)
    };
    let errors = setup.errors(1..=40, with_outliers);
    rms(&errors.concat())
}

#[test]
fn robust_losses_stay_close_where_least_squares_does_not() {
    let squares = with_loss(Loss::Squares);
    let huber = with_loss(Loss::Huber { threshold: 1.345 });
    let student = with_loss(Loss::StudentT { degrees: 4.0 });
    println!("5 % outliers: squares {squares:.2}, Huber {huber:.2}, Student {student:.2}");
    // The variance of a sample is 1 + 0.05 * 900 = 46 of its own: 6.8 times the spread; 80 errors
    // determine it to a tenth.
    assert!((5.4..8.2).contains(&squares), "{squares}");
    // Huber (1964): with a share e of outliers and the threshold a = 1.345 the variance is
    // ((1 - e) E psi^2 + e a^2) / ((1 - e) E psi')^2 = 1.26 of the clean one, the spread 1.12, and that
    // of Student's t about the same: 1.4 is three of its standard errors more.
    assert!(huber < 1.4, "{huber}");
    assert!(student < 1.4, "{student}");
}

/// The covariance by a decomposition of the Jacobian against the inverse of the information.
#[test]
fn the_covariance_is_that_of_cramer_and_rao() {
    let mut setup = Setup::forced(ChannelKind::Acceleration);
    setup.start[0] = Some(1.1);
    let problem = setup.problem(setup.clean(), 0.1);
    let theta = setup.theta();
    let found = problem.covariance(&problem.evaluate(&theta).unwrap());
    let found = found.expect("a force gives the mass");
    let expected = cramer_rao(&problem, &theta);
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        let size = (expected[(i, i)] * expected[(j, j)]).sqrt();
        let off = (found[(i, j)] - expected[(i, j)]).abs();
        assert!(off < 1e-9 * size, "{i} {j}: {found} {expected}");
    }
}

/// Without a given sigma the residuals determine it: by their weighted mean square, with `n - p` below it.
#[test]
fn without_a_sigma_the_covariance_is_that_of_the_residuals() {
    let mut setup = Setup::forced(ChannelKind::Acceleration);
    setup.start[0] = Some(1.1);
    let theta = setup.theta();
    let found = |values: Vec<f64>| {
        let mut problem = setup.problem(values, 0.1);
        let channel = problem.experiments[0].channels[0].clone();
        let weighting = Weighting::Integral {
            spacing: DURATION / (NODES - 1) as f64,
        };
        let channel = channel.with_weighting(weighting);
        problem = problem
            .with(|parts| {
                parts.experiments[0].channels[0] = channel;
            })
            .unwrap();
        let evaluation = problem.evaluate(&theta).unwrap();
        let covariance = problem.covariance(&evaluation);
        (problem, evaluation, covariance)
    };
    let (problem, evaluation, covariance) = found(with_noise(&setup.clean(), 0.1, 5));
    let covariance = covariance.expect("residuals");
    let variance = evaluation.misfit / (NODES - theta.len()) as f64;
    let expected = cramer_rao(&problem, &theta) * variance;
    for j in 0..theta.len() {
        let ratio = covariance[(j, j)] / expected[(j, j)];
        assert!((ratio - 1.0).abs() < 1e-9, "{j}: {ratio}");
    }
    // Zero residuals do not determine it.
    let exact = evaluation.predictions[0][0].clone();
    assert!(found(exact).2.is_none());
}

/// Stiffnesses at knots, over the whole of a record and over its first half.
#[test]
fn a_covariance_is_formed_of_up_to_64_parameters() {
    let setup = Setup::free(ChannelKind::Displacement);
    let covariance = |knots: usize, samples: usize| {
        let mut problem = setup.problem(setup.clean(), 0.1);
        let grid = problem.system.grid;
        let basis = Basis::PiecewiseLinear {
            knots: uniform_knots(&grid, knots),
        };
        let list = vec![
            CoefficientFunction::fixed(CoefficientKind::MASS, vec![1.0; NODES]),
            CoefficientFunction::fixed(CoefficientKind::DAMPING, vec![0.2; NODES]),
            CoefficientFunction::free(CoefficientKind::STIFFNESS, basis, &grid, vec![4.0; knots]),
        ];
        problem = problem
            .with(|parts| {
                parts.functions = Parameterization::new(list, NODES, grid.step()).unwrap();
            })
            .unwrap();
        let times = grid.times()[..samples].to_vec();
        let values = setup.clean()[..samples].to_vec();
        let weighting = Weighting::Sigma(0.1);
        let channel = Channel::new(setup.kind, times, values, weighting, &grid, NODES);
        problem = problem
            .with(|parts| {
                parts.experiments[0].channels = vec![channel.unwrap()];
            })
            .unwrap();
        problem.covariance(&problem.evaluate(&problem.start()).unwrap())
    };
    // The stiffness at the last knot hardly affects the last sample: one parameter fewer is identifiable.
    assert!(covariance(63, NODES).is_some());
    assert!(covariance(64, NODES).is_some());
    assert!(covariance(65, NODES).is_none());
    assert!(covariance(20, NODES / 2).is_none());
}

/// A free response determines only ratios to the mass; and with as many samples as parameters no degrees of freedom
/// remain.
#[test]
fn undetermined_parameters_have_no_covariance() {
    let mut setup = Setup::free(ChannelKind::Displacement);
    let covariance = |setup: &Setup, samples: usize| {
        let mut problem = setup.problem(setup.clean(), 0.1);
        let grid = problem.system.grid;
        let times = grid.times()[50..50 + samples].to_vec();
        let values = setup.clean()[50..50 + samples].to_vec();
        let weighting = Weighting::Sigma(0.1);
        let channel = Channel::new(setup.kind, times, values, weighting, &grid, NODES);
        problem = problem
            .with(|parts| {
                parts.experiments[0].channels = vec![channel.unwrap()];
            })
            .unwrap();
        problem.covariance(&problem.evaluate(&setup.theta()).unwrap())
    };
    assert!(covariance(&setup, 3).is_some());
    assert!(covariance(&setup, 2).is_none());
    setup.start[0] = Some(1.1);
    assert!(covariance(&setup, 100).is_none());
}

/// Samples of a known response by a sensor whose offset is estimated, with an unknown sigma.
fn with_an_offset(values: Vec<f64>, setup: &Setup) -> Problem {
    let mut problem = setup.problem(values, 1.0);
    let offset = ScalarParameter {
        name: "offset".into(),
        unit: "m".into(),
        start: 0.0,
        size: 1.0,
        prior: None,
    };
    problem = problem
        .with(|parts| {
            parts.functions = parts.functions.clone().with_scalars(vec![offset]);
        })
        .unwrap();
    let channel = problem.experiments[0].channels[0].clone();
    let sensor = Sensor {
        offset: ScalarValue::Estimated(0),
        ..Sensor::default()
    };
    let weighting = Weighting::Estimated { sigma: 1.0 };
    let channel = channel.with_sensor(sensor).with_weighting(weighting);
    problem = problem
        .with(|parts| {
            parts.experiments[0].channels[0] = channel;
        })
        .unwrap();
    problem
}

fn sigma_of(problem: &Problem) -> f64 {
    let channel = &problem.experiments[0].channels[0];
    channel.weighting().sigma(0).expect("a sigma")
}

/// The offset of samples of a known response is their mean distance from it, and the sigma their sample
/// standard deviation, with `n - 1` below the squares.
#[test]
fn the_sigma_is_the_sample_standard_deviation() {
    let mut setup = Setup::free(ChannelKind::Displacement);
    setup.start = vec![None; 3];
    let clean = setup.clean();
    let samples: Vec<f64> = (with_noise(&clean, 0.05, 9).iter())
        .map(|x| x + 0.3)
        .collect();
    let problem = with_an_offset(samples.clone(), &setup);
    let found = fit_with_noise(&problem, &problem.start(), &settings(), &mut |_| {});
    let (with_sigma, fit) = found.unwrap();
    let n = NODES as f64;
    let residuals = samples.iter().zip(&clean).map(|(r, c)| r - c);
    let mean = residuals.clone().sum::<f64>() / n;
    let squares: f64 = residuals.map(|r| (r - mean).powi(2)).sum();
    let expected = (squares / (n - 1.0)).sqrt();
    let sigma = sigma_of(&with_sigma);
    // The samples are simulated twice, to machine precision.
    assert!((fit.best.parameters[0] - mean).abs() < 1e-9);
    assert!((sigma / expected - 1.0).abs() < 1e-9, "{sigma} {expected}");
    // The sigma changes nothing about the mean: it is found in the first round and confirmed by the
    // second. Twenty rounds would take twenty responses at least; the first fit takes two, and each of the
    // two rounds one at least.
    assert!((4..20).contains(&fit.counts.forward), "{:?}", fit.counts);
}

/// Two sensors of one response with the same offset, one ten times as noisy: their sigmas are those about the
/// offset, and the offset is the mean with the weights of these sigmas.
#[test]
fn sigmas_of_two_channels_converge_with_the_weighted_mean() {
    let mut setup = Setup::free(ChannelKind::Displacement);
    setup.start = vec![None; 3];
    let clean = setup.clean();
    let noisy = [(0.02, 11), (0.2, 12)].map(|(sigma, seed)| with_noise(&clean, sigma, seed));
    let mut problem = with_an_offset(noisy[0].clone(), &setup);
    let other = with_an_offset(noisy[1].clone(), &setup);
    let other = other.experiments[0].channels[0].clone();
    problem = problem
        .with(|parts| {
            parts.experiments[0].channels.push(other);
        })
        .unwrap();
    let found = fit_with_noise(&problem, &problem.start(), &settings(), &mut |_| {});
    let (with_sigmas, fit) = found.unwrap();

    let n = NODES as f64;
    let residuals = noisy.each_ref().map(|samples| -> Vec<f64> {
        let pairs = samples.iter().zip(&clean);
        pairs.map(|(r, c)| r - c).collect()
    });
    let means = residuals.each_ref().map(|r| r.iter().sum::<f64>() / n);
    let mut variances = [1.0; 2];
    let mut offset = 0.0;
    for _ in 0..100 {
        let [one, two] = variances;
        offset = (means[0] / one + means[1] / two) / (1.0 / one + 1.0 / two);
        // One parameter of 2 n samples.
        variances = residuals.each_ref().map(|r| {
            let squares = r.iter().map(|r| (r - offset).powi(2)).sum::<f64>();
            squares / n / (1.0 - 0.5 / n)
        });
    }
    assert!((fit.best.parameters[0] - offset).abs() < 1e-6 * offset.abs());
    let channels = with_sigmas.experiments[0].channels.iter();
    for (channel, variance) in channels.zip(variances) {
        let sigma = channel.weighting().sigma(0).unwrap();
        // The sigmas at which the iteration stops.
        assert!((sigma / variance.sqrt() - 1.0).abs() < 1e-6, "{sigma}");
    }
    assert!(!fit.attempts.is_empty() && !fit.history.is_empty() && !fit.snapshots.is_empty());
    let cost = with_sigmas.evaluate(&problem.start()).unwrap().cost;
    assert_eq!(fit.initial_cost, cost);
}

/// With a robust loss the sigma follows from the median of the residuals, half of which are below 0.6745 sigma
/// where they are Gaussian.
#[test]
fn a_robust_sigma_is_that_of_the_median() {
    let mut setup = Setup::free(ChannelKind::Displacement);
    setup.start = vec![None; 3];
    setup.loss = Loss::Huber { threshold: 1.345 };
    let clean = setup.clean();
    let samples = with_outliers(&clean, 0.05, 3);
    let problem = with_an_offset(samples.clone(), &setup);
    let found = fit_with_noise(&problem, &problem.start(), &settings(), &mut |_| {});
    let (with_sigma, fit) = found.unwrap();
    let offset = fit.best.parameters[0];
    let residuals = samples.iter().zip(&clean).map(|(r, c)| r - c - offset);
    let mut sizes: Vec<f64> = residuals.map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    let n = NODES as f64;
    let expected = sizes[NODES / 2] / 0.674_49 / (1.0 - 1.0 / n).sqrt();
    let sigma = sigma_of(&with_sigma);
    // The quantile is known to five digits.
    assert!((sigma / expected - 1.0).abs() < 1e-4, "{sigma} {expected}");
}

/// Samples without noise: their sigma is the last digit of a sample, and not zero.
#[test]
fn samples_that_are_fitted_exactly_have_a_sigma() {
    let mut setup = Setup::free(ChannelKind::Displacement);
    setup.start = vec![None; 3];
    let silent = with_an_offset(vec![0.0; NODES], &setup);
    let exact = silent.evaluate(&silent.start()).unwrap().predictions[0][0].clone();
    let problem = with_an_offset(exact.clone(), &setup);
    let found = fit_with_noise(&problem, &problem.start(), &settings(), &mut |_| {});
    let (with_sigma, fit) = found.unwrap();
    assert_eq!(fit.best.evaluation.cost, 0.0);
    let sigma = sigma_of(&with_sigma) / (f64::EPSILON * rms(&exact));
    assert!((sigma - 1.0).abs() < 1e-12, "{sigma}");
}

/// Samples that are all zero have no scale: the sigma is unchanged.
#[test]
fn zero_samples_keep_their_sigma() {
    let mut setup = Setup::free(ChannelKind::Displacement);
    setup.start = vec![None; 3];
    let mut problem = with_an_offset(vec![0.0; NODES], &setup);
    problem = problem
        .with(|parts| {
            parts.experiments[0].initial = State::one(0.0, 0.0);
        })
        .unwrap();
    let found = fit_with_noise(&problem, &problem.start(), &settings(), &mut |_| {});
    let (with_sigma, fit) = found.unwrap();
    assert_eq!(sigma_of(&with_sigma), sigma_of(&problem));
    assert_eq!(fit.best.evaluation.cost, 0.0);
    assert_eq!(fit.best.parameters, [0.0]);
}

/// Standard errors and bands come from one factorisation: for an undetermined parameter both are absent, and
/// otherwise the standard error of a constant is that of its band.
#[test]
fn standard_errors_and_bands_agree() {
    let both = |setup: &Setup| {
        let problem = setup.problem(setup.clean(), 0.1);
        let theta = setup.theta();
        let evaluation = problem.evaluate(&theta).unwrap();
        let bands = Bands::at(&problem, &theta, &evaluation);
        (problem.covariance(&evaluation), bands)
    };
    let mut setup = Setup::forced(ChannelKind::Displacement);
    setup.start[0] = Some(1.1);
    let (covariance, bands) = both(&setup);
    let covariance = covariance.expect("a force gives the mass");
    assert_eq!(bands.undetermined, 0);
    for (j, band) in bands.functions.iter().enumerate() {
        let ratio = band.points[0].standard_error / covariance[(j, j)].sqrt();
        assert!((ratio - 1.0).abs() < 1e-9, "{j}: {ratio}");
    }
    // The smaller the force, the nearer the mass is to being undetermined. At every size both agree, also at the level of
    // rounding errors.
    let mut open = Vec::new();
    for exponent in 1..=16 {
        let mut setup = Setup::forced(ChannelKind::Displacement);
        setup.start[0] = Some(1.1);
        let force: Vec<f64> = (0..NODES)
            .map(|i| 10f64.powi(-exponent) * (0.1 * i as f64).sin())
            .collect();
        setup.excitation = Some(Excitation::force_at_nodes(&force));
        let (covariance, bands) = both(&setup);
        assert_eq!(
            covariance.is_none(),
            bands.undetermined > 0,
            "1e-{exponent}"
        );
        for (j, band) in bands.functions.iter().enumerate() {
            let error = covariance
                .as_ref()
                .map_or(f64::INFINITY, |c| c[(j, j)].sqrt());
            let same = error == band.points[0].standard_error;
            // The root of the inverse loses the digits that the singular values have lost.
            let near = (band.points[0].standard_error / error - 1.0).abs() < 1e-3;
            assert!(same || near, "1e-{exponent}, {j}: {error}");
        }
        open.push(covariance.is_none());
    }
    assert!(!open[0] && open[15] && open.is_sorted(), "{open:?}");
    // Of a free response the ratios to the mass are known, and none of the functions.
    let mut setup = Setup::free(ChannelKind::Displacement);
    setup.start[0] = Some(1.1);
    let (covariance, bands) = both(&setup);
    assert!(covariance.is_none());
    assert_eq!(bands.undetermined, 1);
    for band in &bands.functions {
        assert!(band.points.iter().all(|p| p.standard_error.is_infinite()));
    }
    let ratio = bands.ratio(Ratio::StiffnessOverMass).expect("a stiffness");
    assert!(ratio.points.iter().all(|p| p.standard_error.is_finite()));
}

/// A free decay with exact samples (closed form), fitted with 100 steps a period: the estimates are off by the discretisation
/// error, and the standard errors of the bands are these shifts, from steps of half the length. The sigma adds a thousandth of them.
#[test]
fn intervals_contain_the_shift_by_the_time_steps() {
    let (damping, stiffness) = (0.1f64, TAU * TAU);
    let times: Vec<f64> = (0..=1000).map(|i| 0.01 * f64::from(i)).collect();
    let frequency = (stiffness - 0.25 * damping * damping).sqrt();
    let decay = |t: &f64| {
        let phase = frequency * t;
        (-0.5 * damping * t).exp() * (phase.cos() + 0.5 * damping / frequency * phase.sin())
    };
    let samples: Vec<f64> = times.iter().map(decay).collect();
    for (method, least) in [(Method::Midpoint, 1e-3), (Method::Rk4, 1e-8)] {
        let record = Record::new("decay")
            .from_state(1.0, 0.0)
            .displacement(&times, &samples)
            .sigma(least * 1e-3);
        let parts = [
            CoefficientSpec::fixed(1.0),
            CoefficientSpec::constant(0.12),
            CoefficientSpec::constant(38.0),
        ];
        let problem = Builder::new(parts)
            .record(record)
            .nodes(times.len())
            .method(method)
            .build()
            .unwrap();
        let fit = problem.fit().unwrap();
        let (theta, evaluation) = (&fit.best.parameters, &fit.best.evaluation);
        let bands = Bands::at(&problem, theta, evaluation);
        for (j, truth) in [damping, stiffness].into_iter().enumerate() {
            let error = (theta[j] - truth).abs();
            let share = bands.functions[j + 1].points[0].standard_error / error;
            // The amplitude converges by one order faster than the phase, (3/4)^-1 7/8 = 1.17 for the midpoint rule, and the
            // phase error of half the step, 0.03 rad, adds its square to the damping.
            let most = [2.0, 1.1][j];
            assert!(
                (0.9..most).contains(&share),
                "{method:?} {j}: {share} of {error}"
            );
            let covariance = bands.covariance.as_ref().unwrap();
            let same = covariance[(j, j)].sqrt() / bands.functions[j + 1].points[0].standard_error;
            assert!((same - 1.0).abs() < 1e-9, "{same}");
        }
    }
}
