//! Automatic grids of random systems: free, forced and varying oscillators, sampled at 2 to 60 samples per period, with 0.1 to 10 %
//! noise, from an independent integrator. Required of each: a discretisation error below a tenth of the standard errors, with at
//! most 3 times the nodes that this takes, or one per sample.
//!
//! The discretisation error is the difference from the estimates of the same samples on a grid of [`FINE`] times the steps.
//! `.ci/long grids` fits 100 systems.

use kmcfit::config::{BuildMode, Model, ModelFile, Override, build};
use kmcfit::fitting::fit_model;
use kmcfit_core::solvers::{
    Fit, GridNotice, Observer, Status, fit_on_refined_grids, fit_with_noise, fit_with_noise_watched,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Required discretisation error in standard errors, and ratio of the nodes to the fewest that reach it.
const LARGEST_ERROR: f64 = 0.1;
const MOST_NODES: f64 = 3.0;
/// Steps of the reference per step of the automatic grid: 4096 times less error by the fourth order, 64 times by the second.
const FINE: usize = 8;
/// Steps of the data's integrator per period, at least.
const STEPS_PER_PERIOD: f64 = 400.0;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// Free decay, mass fixed.
    Free,
    /// Broadband force, linear between its samples; mass estimated.
    Forced,
    /// Broadband force, stiffness linear between four knots, mass fixed.
    Varying,
    /// Free decay, stiffness quadratic in time, mass fixed.
    Polynomial,
}

/// A random system and its sampling.
#[derive(Debug)]
struct Case {
    kind: Kind,
    mass: f64,
    damping: f64,
    /// Stiffness at four knots, equally spaced over the record.
    stiffness: [f64; 4],
    spacing: f64,
    samples: usize,
    samples_per_period: f64,
    /// Noise over the root-mean-square displacement.
    noise: f64,
    /// Start values over the true ones, less one.
    offsets: [f64; 3],
}

/// Number between `low` and `high`, uniform in its logarithm.
fn logarithmic(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    random.random_range(low.ln()..high.ln()).exp()
}

impl Case {
    fn new(seed: u64) -> Self {
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let kind = [Kind::Free, Kind::Forced, Kind::Varying, Kind::Polynomial][seed as usize % 4];
        let frequency = logarithmic(random, 0.1, 1000.0);
        let mass = logarithmic(random, 0.01, 100.0);
        let omega = TAU * frequency;
        let ratio = logarithmic(random, 0.002, 0.1);
        let samples_per_period = logarithmic(random, 2.0, 60.0);
        let cycles = logarithmic(random, 8.0, 60.0);
        let level = mass * omega * omega;
        let change = random.random_range(-0.2..0.2);
        let stiffness = [0.0, 1.0, 2.0, 3.0].map(|knot: f64| match kind {
            Kind::Free | Kind::Forced => level,
            Kind::Varying => level * (1.0 + random.random_range(-0.1..0.1)),
            Kind::Polynomial => level * (1.0 + change * (knot / 3.0).powi(2)),
        });
        Self {
            kind,
            mass,
            damping: 2.0 * ratio * mass * omega,
            stiffness,
            spacing: 1.0 / (frequency * samples_per_period),
            samples: ((cycles * samples_per_period) as usize).max(40),
            samples_per_period,
            noise: logarithmic(random, 0.001, 0.1),
            offsets: std::array::from_fn(|_| random.random_range(-0.02..0.02)),
        }
    }

    fn duration(&self) -> f64 {
        self.spacing * (self.samples - 1) as f64
    }

    fn stiffness_at(&self, t: f64) -> f64 {
        let share = t / self.duration();
        if self.kind == Kind::Polynomial {
            return self.stiffness[0] + (self.stiffness[3] - self.stiffness[0]) * share * share;
        }
        let x = (3.0 * share).clamp(0.0, 3.0);
        let left = (x as usize).min(2);
        let [a, b] = [self.stiffness[left], self.stiffness[left + 1]];
        a + (b - a) * (x - left as f64)
    }

    fn is_forced(&self) -> bool {
        matches!(self.kind, Kind::Forced | Kind::Varying)
    }

    /// Force at the samples, and displacement without noise by the fourth-order method of Runge and Kutta.
    fn response(&self, random: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>) {
        let mut smooth = 0.0;
        let size = if self.is_forced() {
            0.1 * self.stiffness[0]
        } else {
            0.0
        };
        let force: Vec<f64> = (0..self.samples)
            .map(|_| {
                let white: f64 = StandardNormal.sample(random);
                smooth = 0.7 * smooth + white;
                size * smooth
            })
            .collect();
        let parts = (STEPS_PER_PERIOD / self.samples_per_period).ceil();
        let h = self.spacing / parts;
        let initial = if self.is_forced() { 0.0 } else { 1.0 };
        let mut state = [initial, 0.0];
        let mut displacement = vec![initial];
        for i in 0..self.samples - 1 {
            let at = |share: f64| force[i] + (force[i + 1] - force[i]) * share;
            for part in 0..parts as usize {
                let start = part as f64 / parts;
                let slope = |share: f64, [y, v]: [f64; 2]| {
                    let t = (i as f64 + share) * self.spacing;
                    let f = at(share) - self.damping * v - self.stiffness_at(t) * y;
                    [v, f / self.mass]
                };
                let half = 0.5 / parts;
                let moved = |k: [f64; 2], by: f64| [state[0] + by * k[0], state[1] + by * k[1]];
                let a = slope(start, state);
                let b = slope(start + half, moved(a, 0.5 * h));
                let c = slope(start + half, moved(b, 0.5 * h));
                let d = slope(start + 2.0 * half, moved(c, h));
                let sum = |j: usize| a[j] + 2.0 * b[j] + 2.0 * c[j] + d[j];
                state = [state[0] + h / 6.0 * sum(0), state[1] + h / 6.0 * sum(1)];
            }
            displacement.push(state[0]);
        }
        (force, displacement)
    }

    /// Writes the table and returns the model file.
    fn model(&self, folder: &Path, seed: u64) -> ModelFile {
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(1);
        let (force, displacement) = self.response(random);
        let squares: f64 = displacement.iter().map(|y| y * y).sum();
        let sigma = self.noise * (squares / self.samples as f64).sqrt();
        let mut table = "t_s,f_N,y_m\n".to_owned();
        for (i, (f, y)) in force.iter().zip(&displacement).enumerate() {
            let e: f64 = StandardNormal.sample(random);
            let t = i as f64 * self.spacing;
            writeln!(table, "{t:.17e},{f:.17e},{:.17e}", y + sigma * e).unwrap();
        }
        fs::write(folder.join(format!("{seed}.csv")), table).unwrap();
        let yaml = self.yaml(seed);
        ModelFile::parse(folder.join(format!("{seed}.yaml")), yaml).unwrap()
    }

    fn yaml(&self, seed: u64) -> String {
        let start = |value: f64, i: usize| value * (1.0 + self.offsets[i]);
        let (column, force, initial) = match self.is_forced() {
            true => (", force: f_N", "force: {interpolation: linear}", 0),
            false => ("", "noise: {displacement: white}", 1),
        };
        let mass = match self.kind {
            Kind::Forced => format!("{{basis: constant, start: {:e}}}", start(self.mass, 0)),
            _ => format!("{{fixed: {:e}}}", self.mass),
        };
        let basis = match self.kind {
            Kind::Free | Kind::Forced => "constant",
            Kind::Varying => "piecewise-linear, knots: 4",
            Kind::Polynomial => "polynomial, degree: 2",
        };
        format!(
            "format: 1\nexperiments:\n  - name: record\n    data: {seed}.csv\n    columns: {{time: t_s, displacement: y_m{column}}}\n    \
             {force}\n    sigma: {{displacement: estimate}}\n    initial: {{displacement: {initial}, velocity: 0}}\n\
             grid: {{nodes: auto}}\nfunctions:\n  mass: {mass}\n  damping: {{basis: constant, start: {:e}}}\n  \
             stiffness: {{basis: {basis}, start: {:e}}}\n",
            start(self.damping, 1),
            start(self.stiffness[0], 2),
        )
    }
}

/// Estimates and standard errors.
struct Estimates {
    values: Vec<f64>,
    standard_errors: Vec<f64>,
}

/// The fit of the samples on `nodes` nodes from `start`; `None` if it fails.
fn on_nodes(file: &ModelFile, nodes: usize, start: &[f64]) -> Option<Estimates> {
    let keys = Override::parse_all(&[format!("grid.nodes={nodes}")]).unwrap();
    let file = file.clone().with_overrides(&keys).unwrap();
    let model = build(&file, BuildMode::Fit).unwrap();
    let found = fit_with_noise(&model.problem, start, &model.settings, &mut |_| {});
    let (problem, fit) = found.ok()?;
    let covariance = problem.covariance(&fit.best.evaluation)?;
    (fit.outcome.status == Status::Converged).then(|| Estimates {
        values: fit.best.parameters.clone(),
        standard_errors: covariance.diagonal().iter().map(|v| v.sqrt()).collect(),
    })
}

/// Largest difference of estimates from a reference, in its standard errors.
fn difference(values: &[f64], reference: &Estimates) -> f64 {
    let each = values.iter().zip(&reference.values);
    let each = each.zip(&reference.standard_errors);
    each.map(|((a, b), error)| ((a - b) / error).abs())
        .fold(0.0, f64::max)
}

fn automatic(file: &ModelFile) -> (Model, Fit) {
    let model = build(file, BuildMode::Fit).unwrap();
    let nothing = &mut |_: &_| {};
    let found = fit_model(&model, &mut Observer::new(nothing)).unwrap();
    (found.model, found.fit)
}

/// Result of a system.
struct Outcome {
    nodes: usize,
    samples: usize,
    /// Discretisation error in standard errors, and that on the largest grid of less than a third of the steps, if there is one with
    /// the samples of the force on its nodes.
    error: f64,
    coarse: Option<f64>,
}

impl Outcome {
    fn of(case: &Case, seed: u64, folder: &Path) -> Self {
        let file = case.model(folder, seed);
        let (model, fit) = automatic(&file);
        assert_eq!(fit.outcome.status, Status::Converged, "{seed}: {case:?}");
        let nodes = model.problem.system.grid.nodes();
        let theta = &fit.best.parameters;
        let reference = on_nodes(&file, FINE * (nodes - 1) + 1, theta);
        let reference = reference.expect("a fit on the fine grid");
        let unit = if case.is_forced() {
            case.samples - 1
        } else {
            1
        };
        let least = ((nodes - 1) as f64 / MOST_NODES / unit as f64).ceil() as usize - 1;
        let coarse = (least * unit >= 8).then(|| {
            let found = on_nodes(&file, least * unit + 1, theta);
            found.map_or(f64::INFINITY, |f| difference(&f.values, &reference))
        });
        Self {
            nodes,
            samples: case.samples,
            error: difference(theta, &reference),
            coarse,
        }
    }

    fn is_accurate(&self) -> bool {
        self.error <= LARGEST_ERROR
    }

    fn is_economical(&self) -> bool {
        self.nodes <= self.samples || self.coarse.is_none_or(|error| error > LARGEST_ERROR)
    }
}

/// Fits systems of these seeds, prints a row for each, and asserts the requirements of all.
fn check(seeds: std::ops::Range<u64>) {
    let folder = tempfile::tempdir().unwrap();
    println!(
        "| seed | system | samples per period | noise | samples | nodes | error | error, a third |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut missed = Vec::new();
    for seed in seeds {
        let case = Case::new(seed);
        let found = Outcome::of(&case, seed, folder.path());
        println!(
            "| {seed} | {:?} | {:.1} | {:.2} % | {} | {} | {:.1e} | {} |",
            case.kind,
            case.samples_per_period,
            100.0 * case.noise,
            case.samples,
            found.nodes,
            found.error,
            found.coarse.map_or("–".into(), |e| format!("{e:.1e}")),
        );
        if !found.is_accurate() || !found.is_economical() {
            missed.push(seed);
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}

/// A grid that may not be refined leaves a warning with its error; one that may, a note.
#[test]
fn the_limit_of_an_automatic_grid_is_a_notice() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/certified/micro.yaml");
    let auto = Override::parse_all(&["grid.nodes=auto".to_owned()]).unwrap();
    let file = ModelFile::read_with_overrides(path, &auto).unwrap();
    let model = build(&file, BuildMode::Fit).unwrap();
    let first = model.problem.system.grid.nodes();
    let start = model.problem.start();
    for most in [first, 64 * first] {
        let found = fit_on_refined_grids(
            &model.problem,
            &start,
            most,
            &mut |least| Some(model.on_nodes(least)?.problem),
            &mut |problem, start, watch| {
                fit_with_noise_watched(problem, start, &model.settings, watch)
                    .map(|(problem, fit)| ((), problem, fit))
            },
            &mut Observer::new(&mut |_| {}),
        );
        match found.unwrap().notices.as_slice() {
            [GridNotice::GridLimited { nodes, error }] => {
                assert!(most == first && *nodes == first && *error > LARGEST_ERROR);
            }
            [GridNotice::GridRefined { from, nodes, error }] => {
                let is_refined = most > first && *from == first && *nodes > first;
                assert!(
                    is_refined && *error < LARGEST_ERROR,
                    "{nodes} nodes, {error}"
                );
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn automatic_grids_reach_a_tenth_of_the_standard_errors() {
    check(0..24);
}

#[test]
#[ignore = "run by .ci/long"]
fn automatic_grids_of_a_hundred_systems() {
    check(0..100);
}
