//! Records, sensors, systems and terms, separately and combined: from noise-free records of an independent evaluation the
//! parameters are recovered to 1e-8.

use crate::common::synthetic::{Truth, rms, run, settings};
use kmcfit_core::functions::{
    Basis, CoefficientFunction, Parameterization, Penalty, Prior, ScalarParameter, ScalarValue,
    uniform_knots,
};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Loss, Sensor, Weighting};
use kmcfit_core::signal::{SecondOrder, band_pass};
use kmcfit_core::solvers::fit;
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{
    Excitation, Grid, InputSample, Method, NodalCoefficients, StageSamples, State, System,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// 63 steps in a period of the system.
const NODES: usize = 301;
const DURATION: f64 = 15.0;
/// The rounding error of some hundred steps is 1e-14, and the relative sensitivity of the response to well-determined parameters is about
/// 1; the tolerance of 1e-8 allows for poorly determined ones.
const EXACT: f64 = 1e-8;
const WIDTH: f64 = 0.3;
fn initial() -> State {
    State::one(1.2, -0.5)
}

fn system(terms: &[Law]) -> System {
    System {
        grid: Grid::new(0.0, DURATION, NODES).unwrap(),
        method: Method::Rk4,
        structure: Structure::one(terms.to_vec()),
    }
}

fn grid() -> Grid {
    Grid::new(0.0, DURATION, NODES).unwrap()
}

fn line() -> Basis {
    Basis::PiecewiseLinear {
        knots: uniform_knots(&grid(), 5),
    }
}

/// An estimated function: basis, true parameters and start.
#[derive(Clone)]
struct EstimatedFunction {
    quantity: CoefficientKind,
    basis: Basis,
    truth: Vec<f64>,
    start: Vec<f64>,
}

fn constant(quantity: CoefficientKind, truth: f64, start: f64) -> EstimatedFunction {
    EstimatedFunction {
        quantity,
        basis: Basis::Constant,
        truth: vec![truth],
        start: vec![start],
    }
}

fn lines(quantity: CoefficientKind, truth: [f64; 5], start: f64) -> EstimatedFunction {
    EstimatedFunction {
        quantity,
        basis: line(),
        truth: truth.to_vec(),
        start: vec![start; 5],
    }
}

impl EstimatedFunction {
    fn function(&self) -> CoefficientFunction {
        CoefficientFunction::free(
            self.quantity,
            self.basis.clone(),
            &grid(),
            self.start.clone(),
        )
    }

    fn values(&self) -> Vec<f64> {
        self.basis.design(&grid()).multiply(&self.truth, NODES)
    }
}

/// Damping and stiffness of the linear system, which most tests estimate; the mass is known.
fn damping() -> EstimatedFunction {
    constant(CoefficientKind::DAMPING, 0.25, 0.4)
}

fn stiffness() -> EstimatedFunction {
    lines(CoefficientKind::STIFFNESS, [4.0, 4.6, 4.3, 3.7, 4.1], 3.6)
}

const LINEAR: [Law; 2] = [Law::Damping, Law::Stiffness];

fn known_mass() -> Vec<f64> {
    let times = grid().times();
    times.iter().map(|t| 1.1 - 0.01 * t).collect()
}

/// The times of a record: irregular, off the nodes, with missing samples and a gap.
fn scattered(count: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut times: Vec<f64> = (0..count)
        .map(|_| random.random_range(0.0..DURATION))
        .filter(|t| !(6.0..7.0).contains(t))
        .collect();
    times.sort_by(f64::total_cmp);
    times
}

/// One channel and its sensor.
#[derive(Clone)]
struct ChannelSpec {
    kind: ChannelKind,
    times: Vec<f64>,
    sigma: Weighting,
    /// True gain, offset and drift, with the indices of the scalars if they are estimated.
    sensor: [f64; 3],
    initial_parameters: [Option<usize>; 3],
    around: Vec<InputSample>,
    base: Vec<f64>,
    filter: Vec<SecondOrder>,
    loss: Loss,
}

impl ChannelSpec {
    fn of(kind: ChannelKind, times: Vec<f64>) -> Self {
        Self {
            kind,
            times,
            sigma: Weighting::Sigma(1e-3),
            sensor: [1.0, 0.0, 0.0],
            initial_parameters: [None; 3],
            around: Vec::new(),
            base: Vec::new(),
            filter: Vec::new(),
            loss: Loss::Squares,
        }
    }

    fn at_nodes(kind: ChannelKind) -> Self {
        Self::of(kind, grid().times())
    }

    /// Gain, offset and drift, which are estimated as the scalars from `first` on.
    fn unknown_sensor(mut self, sensor: [f64; 3], first: usize) -> Self {
        self.sensor = sensor;
        self.initial_parameters = [first, first + 1, first + 2].map(Some);
        self
    }

    fn channel(&self, truth: &Truth, nodes: usize) -> Channel {
        let seen = truth.seen(self.kind, &self.times, &self.around);
        let [gain, offset, drift] = self.sensor;
        let base = |i: usize| self.base.get(i).copied().unwrap_or(0.0);
        let age = |i: usize| self.times[i] - self.times[0];
        let samples = seen.iter().enumerate();
        let values = samples
            .map(|(i, x)| gain * (x + base(i)) + offset + drift * age(i))
            .collect();
        let sigma = self.sigma.clone();
        let mut channel =
            Channel::new(self.kind, self.times.clone(), values, sigma, &grid(), nodes).unwrap();
        let value = |i: usize| {
            self.initial_parameters[i]
                .map_or(ScalarValue::Known(self.sensor[i]), ScalarValue::Estimated)
        };
        channel = channel.with_loss(self.loss).with_sensor(Sensor {
            gain: value(0),
            offset: value(1),
            drift: value(2),
            ..Sensor::default()
        });
        if !self.around.is_empty() {
            channel = channel.with_inputs_at_samples(self.around.clone());
        }
        if !self.base.is_empty() {
            channel = channel.with_base(self.base.clone());
        }
        if !self.filter.is_empty() {
            channel = channel.with_filter(self.filter.clone());
        }
        channel
    }
}

/// One record: initial state, input and channels.
#[derive(Clone)]
struct Record {
    initial: State,
    /// Indices of the scalars of an estimated initial state.
    initial_parameters: [Option<usize>; 2],
    excitation: Option<Excitation>,
    samples: Vec<ChannelSpec>,
    /// Index of the coefficient set.
    coefficient_set: usize,
}

impl Record {
    fn free(samples: Vec<ChannelSpec>) -> Self {
        Self {
            initial: initial(),
            initial_parameters: [None; 2],
            excitation: None,
            samples,
            coefficient_set: 0,
        }
    }

    fn driven(excitation: Excitation, samples: Vec<ChannelSpec>) -> Self {
        Self {
            excitation: Some(excitation),
            ..Self::free(samples)
        }
    }
}

/// A scalar parameter.
fn scalar(truth: f64, start: f64, prior: Option<f64>) -> (f64, ScalarParameter) {
    let prior = prior.map(|sigma| Prior { mean: truth, sigma });
    let scalar = ScalarParameter {
        name: "a number".into(),
        unit: String::new(),
        start,
        size: truth.abs().max(0.1),
        prior,
    };
    (truth, scalar)
}

/// A system, its records and its estimated parameters.
struct Case {
    terms: Vec<Law>,
    /// `None` where the mass is known.
    mass: Option<EstimatedFunction>,
    functions: Vec<EstimatedFunction>,
    /// Functions that replace one of the shared coefficient set in the other systems: which one of its list.
    own: Vec<(usize, EstimatedFunction)>,
    scalars: Vec<(f64, ScalarParameter)>,
    records: Vec<Record>,
}

impl Case {
    fn linear(records: Vec<Record>) -> Self {
        Self {
            terms: LINEAR.to_vec(),
            mass: None,
            functions: vec![damping(), stiffness()],
            own: Vec::new(),
            scalars: Vec::new(),
            records,
        }
    }

    fn with_scalars(mut self, scalars: Vec<(f64, ScalarParameter)>) -> Self {
        self.scalars = scalars;
        self
    }

    fn truth(&self) -> Vec<f64> {
        let own = self.own.iter().map(|(_, estimated)| estimated);
        let functions = self.mass.iter().chain(&self.functions).chain(own);
        functions
            .flat_map(|f| f.truth.clone())
            .chain(self.scalars.iter().map(|s| s.0))
            .collect()
    }

    fn nodal(&self, which: usize) -> NodalCoefficients {
        let mass: Vec<f64> = self
            .mass
            .as_ref()
            .map_or_else(known_mass, EstimatedFunction::values);
        let mut coefficients: Vec<Vec<f64>> = self
            .functions
            .iter()
            .map(EstimatedFunction::values)
            .collect();
        let mut nodal = NodalCoefficients {
            inertias: vec![mass],
            coefficients: std::mem::take(&mut coefficients),
        };
        if which > 0 {
            let (replaced, estimated) = &self.own[which - 1];
            nodal.coefficients[replaced - 1] = estimated.values();
        }
        nodal
    }

    fn problem(&self) -> Problem {
        let system = system(&self.terms);
        let mass = match &self.mass {
            Some(estimated) => estimated.function(),
            None => CoefficientFunction::fixed(CoefficientKind::MASS, known_mass()),
        };
        let mut list = vec![mass];
        list.extend(self.functions.iter().map(EstimatedFunction::function));
        let main: Vec<usize> = (0..list.len()).collect();
        let mut nodal_sets = vec![main.clone()];
        for (replaced, estimated) in &self.own {
            let mut nodal = main.clone();
            nodal[*replaced] = list.len();
            nodal_sets.push(nodal);
            list.push(estimated.function());
        }
        let functions =
            Parameterization::with_coefficient_sets(list, nodal_sets, NODES, system.grid.step())
                .unwrap()
                .with_scalars(self.scalars.iter().map(|s| s.1.clone()).collect());
        let records = self.records.iter().map(|record| {
            // A record ends with its last sample, at the next node.
            let ends = record.samples.iter().map(|r| r.times[r.times.len() - 1]);
            let end = ends.fold(0.0, f64::max);
            let nodes = ((end / system.grid.step() - 1e-9).ceil() as usize + 1).min(NODES);
            let nodal = self.nodal(record.coefficient_set);
            let truth = Truth {
                system: &system,
                nodal: &nodal,
                excitation: record.excitation.as_ref(),
                initial: record.initial.clone(),
            };
            let start = |q: usize, known: f64| match record.initial_parameters[q] {
                Some(index) => self.scalars[index].1.start,
                None => known,
            };
            let initial = State::one(
                start(0, record.initial.displacement(0)),
                start(1, record.initial.velocity(0)),
            );
            let mut experiment = Experiment::free("record", initial, nodes);
            experiment.initial_parameters = record.initial_parameters.to_vec();
            experiment.coefficient_set = record.coefficient_set;
            experiment.excitation = record.excitation.clone();
            for sample in &record.samples {
                experiment = experiment.with_channel(sample.channel(&truth, nodes));
            }
            experiment
        });
        let records = records.collect();
        Problem::new(system, functions, records).unwrap()
    }

    /// Fits from the start values and compares all parameters, each relative to the larger of itself
    /// and 0.1.
    fn check(&self, words: &str) {
        let problem = self.problem();
        let truth = self.truth();
        // The data are in the model class: the residuals at the truth are rounding errors.
        let misfit = problem.evaluate(&truth).unwrap().misfit;
        assert!(
            misfit <= 1e-18 * problem.zero_response_misfit(),
            "{words}: {misfit:e} at the truth"
        );
        let found = run(&problem);
        let pairs = found.best.parameters.iter().zip(&truth);
        let error = pairs.fold(0.0f64, |most, (a, b)| {
            most.max((a - b).abs() / b.abs().max(0.1))
        });
        println!(
            "{words}: {} parameters, {error:.1e}, by {:?}",
            truth.len(),
            found
                .attempts
                .iter()
                .map(|r| (r.start, r.history.len(), r.initial_cost, r.cost))
                .collect::<Vec<_>>()
        );
        assert!(
            error < EXACT,
            "{words}: {error:e}\n{:?}\n{truth:?}\n{:#?}",
            found.best.parameters,
            found.attempts
        );
    }
}

fn force() -> StageSamples {
    let force: Vec<f64> = (grid().times().iter())
        .map(|t| 2.0 * (1.3 * t).sin() + (3.1 * t).cos())
        .collect();
    StageSamples::linear(&force)
}

fn base() -> StageSamples {
    let base: Vec<f64> = (grid().times().iter())
        .map(|t| 1.5 * (0.9 * t).cos() - (2.6 * t).sin())
        .collect();
    StageSamples::linear(&base)
}

fn forced() -> Excitation {
    Excitation::one(Some(force()), None)
}

#[test]
fn each_kind_of_channel() {
    for kind in ChannelKind::ALL {
        Case::linear(vec![Record::free(vec![ChannelSpec::at_nodes(kind)])]).check(kind.name());
        let scattered = ChannelSpec::of(kind, scattered(160, 3));
        Case::linear(vec![Record::free(vec![scattered])])
            .check(&format!("{} between nodes", kind.name()));
    }
}

#[test]
fn channels_at_times_of_their_own() {
    let samples = ChannelKind::ALL.iter().zip(1..);
    let samples = samples.map(|(kind, seed)| ChannelSpec::of(*kind, scattered(70, seed)));
    Case::linear(vec![Record::free(samples.collect())]).check("mixed");
}

#[test]
fn samples_with_individual_sigmas_and_robust_losses() {
    let times = scattered(150, 8);
    let sigmas = (0..times.len()).map(|i| 1e-3 * (1.0 + (i % 7) as f64));
    let mut sample = ChannelSpec::of(ChannelKind::Displacement, times.clone());
    sample.sigma = Weighting::Sigmas(sigmas.collect());
    for loss in [
        Loss::Squares,
        Loss::Huber { threshold: 1.345 },
        Loss::StudentT { degrees: 4.0 },
    ] {
        sample.loss = loss;
        Case::linear(vec![Record::free(vec![sample.clone()])]).check(&format!("{loss:?}"));
    }
    sample.loss = Loss::Squares;
    sample.sigma = kmcfit_core::record::integral_over(&times);
    Case::linear(vec![Record::free(vec![sample])]).check("integral over irregular times");
}

#[test]
fn gain_offset_and_drift() {
    for kind in ChannelKind::ALL {
        // With a known mass a force determines the gain; a free record does not.
        let sample = ChannelSpec::of(kind, scattered(150, 4)).unknown_sensor([1.3, 0.4, -0.05], 0);
        let scalars = vec![
            scalar(1.3, 1.0, None),
            scalar(0.4, 0.0, None),
            scalar(-0.05, 0.0, None),
        ];
        Case::linear(vec![Record::driven(forced(), vec![sample])])
            .with_scalars(scalars)
            .check(&format!("sensor of {}", kind.name()));
    }
}

#[test]
fn initial_states_with_and_without_a_prior() {
    for kind in ChannelKind::ALL {
        for prior in [None, Some(0.02)] {
            let mut record = Record::free(vec![ChannelSpec::of(kind, scattered(150, 5))]);
            record.initial_parameters = [Some(0), Some(1)];
            let scalars = vec![
                scalar(initial().displacement(0), 0.8, prior),
                scalar(initial().velocity(0), 0.1, prior),
            ];
            Case::linear(vec![record])
                .with_scalars(scalars)
                .check(&format!("initial state from {}, {prior:?}", kind.name()));
        }
    }
}

#[test]
fn a_measured_force_gives_the_mass_too() {
    for kind in ChannelKind::ALL {
        let mut case = Case::linear(vec![Record::driven(
            forced(),
            vec![ChannelSpec::of(kind, scattered(200, 6))],
        )]);
        case.mass = Some(constant(CoefficientKind::MASS, 1.2, 1.6));
        case.check(&format!("forced, {}", kind.name()));
    }
}

#[test]
fn a_band_pass_filter() {
    let rate = 1.0 / grid().step();
    for kind in ChannelKind::ALL {
        let mut sample = ChannelSpec::at_nodes(kind);
        sample.filter = band_pass(2, 0.1, 2.0, rate).unwrap();
        sample.sensor = [1.0, 0.7, 0.02];
        Case::linear(vec![Record::free(vec![sample])]).check(&format!("band of {}", kind.name()));
    }
}

/// All features combined: all terms, a mass, three experiments with states, sensors, filters, sigmas and
/// a stiffness of their own.
#[test]
fn all_together() {
    let both = Excitation::one(Some(force()), Some(base()));
    let displacement = ChannelSpec::of(ChannelKind::Displacement, scattered(150, 21))
        .unknown_sensor([0.8, 0.2, 0.03], 2);
    let mut velocity = ChannelSpec::of(ChannelKind::Velocity, scattered(120, 22));
    velocity.sigma = Weighting::Sigmas(
        (0..velocity.times.len())
            .map(|i| 1e-3 + 1e-5 * i as f64)
            .collect(),
    );
    let mut acceleration = ChannelSpec::at_nodes(ChannelKind::Acceleration);
    acceleration.filter = band_pass(2, 0.1, 2.5, 1.0 / grid().step()).unwrap();
    let mut first = Record::driven(both, vec![displacement, velocity.clone()]);
    first.initial_parameters = [Some(0), Some(1)];
    let mut second = Record::free(vec![acceleration, velocity]);
    second.coefficient_set = 1;
    second.initial = State::one(-1.5, 1.0);
    let short = (0..180).map(|i| grid().time(i)).collect();
    let third = Record::driven(
        forced(),
        vec![ChannelSpec::of(ChannelKind::Displacement, short)],
    );
    Case {
        terms: vec![
            Law::Damping,
            Law::Stiffness,
            Law::QuadraticStiffness,
            Law::CubicStiffness,
            Law::QuinticStiffness,
            Law::QuadraticDamping,
            Law::CoulombFriction { width: WIDTH },
            Law::Offset,
        ],
        mass: Some(lines(
            CoefficientKind::MASS,
            [1.2, 1.1, 1.15, 1.0, 0.9],
            1.3,
        )),
        functions: vec![
            damping(),
            stiffness(),
            constant(CoefficientKind::QUADRATIC_STIFFNESS, 0.3, 0.0),
            constant(CoefficientKind::CUBIC_STIFFNESS, 0.8, 0.5),
            constant(CoefficientKind::QUINTIC_STIFFNESS, 0.1, 0.0),
            constant(CoefficientKind::QUADRATIC_DAMPING, 0.1, 0.0),
            constant(CoefficientKind::COULOMB_FRICTION, 0.2, 0.0),
            constant(CoefficientKind::STATIC_FORCE, -0.3, 0.0),
        ],
        own: vec![(2, constant(CoefficientKind::STIFFNESS, 5.0, 4.2))],
        scalars: vec![
            scalar(initial().displacement(0), 1.0, Some(0.1)),
            scalar(initial().velocity(0), -0.2, None),
            scalar(0.8, 1.0, None),
            scalar(0.2, 0.0, None),
            scalar(0.03, 0.0, None),
        ],
        records: vec![first, second, third],
    }
    .check("everything");
}

/// One value per node: the states are unknowns of the subproblem. The truth is linear in time, so
/// that light smoothness charges nothing for it and decides what the samples leave open.
#[test]
fn one_value_per_node_with_sensors_states_and_a_filter() {
    let nodal = |quantity, from: f64, slope: f64, start: f64| EstimatedFunction {
        quantity,
        basis: Basis::Nodal,
        truth: grid().times().iter().map(|t| from + slope * t).collect(),
        start: vec![start; NODES],
    };
    let mut filtered = ChannelSpec::at_nodes(ChannelKind::Velocity);
    filtered.filter = band_pass(2, 0.1, 3.0, 1.0 / grid().step()).unwrap();
    let displacement = ChannelSpec::of(ChannelKind::Displacement, scattered(250, 31))
        .unknown_sensor([1.2, 0.3, 0.01], 2);
    let acceleration = ChannelSpec::of(ChannelKind::Acceleration, scattered(200, 32));
    let mut first = Record::driven(forced(), vec![displacement, acceleration]);
    first.initial_parameters = [Some(0), Some(1)];
    let mut second = Record::free(vec![filtered]);
    second.coefficient_set = 1;
    let case = Case {
        terms: vec![Law::Damping, Law::Stiffness, Law::CubicStiffness],
        mass: None,
        functions: vec![
            nodal(CoefficientKind::DAMPING, 0.25, 0.01, 0.4),
            nodal(CoefficientKind::STIFFNESS, 4.0, 0.05, 3.6),
            constant(CoefficientKind::CUBIC_STIFFNESS, 0.5, 0.2),
        ],
        own: vec![(2, nodal(CoefficientKind::STIFFNESS, 5.0, -0.03, 4.5))],
        scalars: vec![
            scalar(initial().displacement(0), 1.0, None),
            scalar(initial().velocity(0), -0.2, None),
            scalar(1.2, 1.0, None),
            scalar(0.3, 0.0, None),
            scalar(0.01, 0.0, None),
        ],
        records: vec![first, second],
    };
    let mut problem = case.problem();
    for function in [1, 2, 4] {
        let rows = Basis::Nodal.roughness(&grid(), 2);
        problem
            .penalize(Penalty::new(function, 2, 1e2, rows))
            .unwrap();
    }
    let found = run(&problem);
    let truth = case.truth();
    let pairs = found.best.parameters.iter().zip(&truth);
    let error = pairs.fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
    println!("nodal: {error:.1e} of {} parameters", truth.len());
    assert!(error < EXACT, "{error:e} {:#?}", found.attempts);
}

/// The part of a record within a growing horizon is filtered like the whole: its residuals at the true parameters are
/// zero.
#[test]
fn a_part_of_a_filtered_record_is_a_record() {
    let mut sample = ChannelSpec::at_nodes(ChannelKind::Displacement);
    sample.filter = band_pass(2, 0.1, 2.0, 1.0 / grid().step()).unwrap();
    let case = Case::linear(vec![Record::free(vec![sample])]);
    let whole = case.problem();
    let part = whole.truncated(0.3);
    // The response ends with the samples.
    let [nodes, all] = [&part, &whole].map(|p| p.experiments[0].nodes);
    assert!(nodes * 3 < all, "{nodes} of {all}");
    let misfit = part.evaluate(&case.truth()).unwrap().misfit;
    assert!(misfit < 1e-18 * part.zero_response_misfit(), "{misfit:e}");
    assert!(rms(part.experiments[0].channels[0].observed()) > 0.1);
    let found = fit(&part, &case.truth(), &settings(), &mut |_| {}).unwrap();
    assert_eq!(found.attempts.len(), 1);
}
