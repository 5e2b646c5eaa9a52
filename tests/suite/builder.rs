//! Problems built in Rust equal those of a model file; invalid ones are rejected with the key.

use kmcfit::config::{BuildMode, ModelFile, build};
use kmcfit::tables::Table;
use kmcfit_core::builder::{Builder, ChannelSpec, Record};
use kmcfit_core::constraints::{Constraint, Shape, TimeHistory};
use kmcfit_core::model::{BasisName, CoefficientSpec, KnotSpec, ScalarSpec, StartSpec};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{ChannelKind, Loss, NoiseModel};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::Method;
use std::path::Path;

/// The columns of a file in `data/`.
fn columns<const N: usize>(file: &str, names: [&str; N]) -> [Vec<f64>; N] {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data")
        .join(file);
    let table = Table::read(path).unwrap();
    names.map(|name| table.column(name).unwrap().to_vec())
}

fn from_file(yaml: &str) -> (Problem, kmcfit_core::solvers::FitSettings) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/built-by-the-test.yaml");
    let model = build(&ModelFile::parse(&path, yaml).unwrap(), BuildMode::Fit).unwrap();
    (model.problem, model.settings)
}

fn paper_record() -> Record {
    let [times, y] = columns("paper.csv", ["t_s", "y_m"]);
    Record::new("free decay")
        .from_state(3.3, 1.0)
        .displacement(&times, &y)
}

/// Fits of both problems are bit-identical.
fn same_way(built: &Problem, written: &(Problem, kmcfit_core::solvers::FitSettings)) {
    let (written, settings) = written;
    assert_eq!(built.start(), written.start());
    let [a, b] = [built, written].map(|p| p.fit_with(settings).unwrap());
    assert_eq!(a.history, b.history);
    assert_eq!(a.best.parameters, b.best.parameters);
    assert_eq!(a.outcome.status, b.outcome.status);
}

#[test]
fn a_problem_with_bounds_penalties_and_constraints_equals_that_of_its_model_file() {
    let written = from_file(
        "format: 1
experiments:
  - {name: free decay, data: ../data/paper.csv, initial: {displacement: 3.3, velocity: 1.0}}
grid: {method: midpoint}
functions:
  mass:      {basis: piecewise-linear, knots: 11, start: 2.0, min: 0.05, penalty: {kind: tikhonov, order: 2, weight: 0.1}}
  damping:   {basis: b-spline, knots: 6, start: 1.0, min: 0.0, penalty: [{kind: tikhonov, order: 0, weight: 0.01}, {kind: tikhonov, order: 1, weight: 0.1}]}
  stiffness: {basis: polynomial, degree: 1, start: [1.5, -0.01], max: 4.0}
constraints:
  - {function: stiffness, at: 0.0, value: 1.0}
  - {function: mass, shape: non-increasing}
  - {function: mass, mean: 0.75, soft: 10.0}
fit: {stop: {iterations: 20, tolerance: 1e-10}}
",
    );
    let mass = CoefficientSpec::piecewise_linear(11, 2.0)
        .min(0.05)
        .tikhonov(2, 0.1);
    let damping = CoefficientSpec::b_spline(6, 1.0)
        .min(0.0)
        .tikhonov(0, 0.01)
        .tikhonov(1, 0.1);
    let stiffness = CoefficientSpec::polynomial(&[1.5, -0.01]).max(4.0);
    let of = CoefficientKind::MASS;
    let built = Builder::new([mass, damping, stiffness])
        .record(paper_record())
        .method(Method::Midpoint)
        .constrain(Constraint::Value {
            of: CoefficientKind::STIFFNESS,
            at: 0.0,
            value: 1.0,
        })
        .constrain(Constraint::Shape {
            of,
            shape: Shape::NonIncreasing,
        })
        .penalize(Constraint::Mean { of, value: 0.75 }, 10.0)
        .build()
        .unwrap();
    same_way(&built, &written);
}

#[test]
fn a_forced_record_of_an_accelerometer_equals_that_of_its_model_file() {
    let written = from_file(
        "format: 1
experiments:
  - name: shaker
    data: ../data/shaker.csv
    columns: {force: f_N, acceleration: a_m_per_s2}
    sigma: {acceleration: 0.02}
    loss: {acceleration: huber}
    initial: estimate
grid: {nodes: 4801}
functions:
  mass:      {basis: constant, start: 3.0, min: none}
  damping:   {basis: constant, start: 0.5, penalty: {kind: tv, weight: 0.1}}
  stiffness: {basis: piecewise-constant, knots: 3, start: 2000.0, penalty: {kind: tv, weight: 1e-6}}
  cubic_stiffness: {fixed: 0.0}
fit: {stop: {iterations: 20, tolerance: 1e-10}}
",
    );
    let [times, force, acceleration] = columns("shaker.csv", ["t_s", "f_N", "a_m_per_s2"]);
    let record = Record::new("shaker")
        .force(&times, &force)
        .acceleration(&times, &acceleration)
        .sigma(0.02)
        .loss(written.0.experiments[0].channels[0].loss());
    let device = [
        CoefficientSpec::constant(3.0),
        CoefficientSpec::constant(0.5).total_variation(0.1),
        CoefficientSpec::piecewise_constant(3, 2000.0).total_variation(1e-6),
    ];
    let built = Builder::new(device)
        .cubic_stiffness(CoefficientSpec::fixed(0.0))
        .record(record)
        .nodes(4801)
        .build()
        .unwrap();
    same_way(&built, &written);
}

/// The initial state of a record of 25,000 nodes is estimated from its first 20,000, and is that of a record that ends there: the one sample by
/// which they differ lies 600 periods from the first node. One channel and two are estimated in different ways.
#[test]
fn the_initial_state_of_a_long_record_is_that_of_its_beginning() {
    let mut seed = 1u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        // Uniform, of standard deviation 1e-3.
        1e-3 * 12f64.sqrt() * ((seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
    };
    let times: Vec<f64> = (0..25_000).map(|i| 0.1 * f64::from(i)).collect();
    let y: Vec<f64> = (times.iter())
        .map(|t| (2.0 * t).sin() + 0.5 + noise())
        .collect();
    let v: Vec<f64> = (times.iter())
        .map(|t| 2.0 * (2.0 * t).cos() + noise())
        .collect();
    let initial = |count: usize, has_velocity: bool| {
        let record = Record::new("long")
            .displacement(&times[..count], &y[..count])
            .sigma(1e-3);
        let record = match has_velocity {
            true => record.velocity(&times[..count], &v[..count]).sigma(1e-3),
            false => record,
        };
        let device = [1.0, 0.1, 4.0].map(CoefficientSpec::constant);
        let built = Builder::new(device)
            .record(record)
            .nodes(count)
            .build()
            .unwrap();
        let start = built.start();
        built.experiments[0].initial_state(built.scalars(&start))
    };
    for has_velocity in [false, true] {
        let [long, short] = [25_000, 20_000].map(|count| initial(count, has_velocity));
        // A sample more or less moves the weight of the smoothing, and the state by less than the noise: that of a sample, 1e-3, and that of
        // a difference of two, 1e-3 / 0.1.
        let apart = (long.displacement(0) - short.displacement(0)).abs();
        assert!(apart < 1e-3, "{long:?} {short:?}");
        let apart = (long.velocity(0) - short.velocity(0)).abs();
        assert!(apart < 1e-2, "{long:?} {short:?}");
    }
}

/// An invalid part is rejected with its key, without a panic.
#[test]
fn invalid_parts_are_refused_with_their_key() {
    let one = || CoefficientSpec::constant(1.0);
    let system = || [one(), one(), one()];
    let record = paper_record;
    let times = [0.0, 1.0, 2.0];
    let values = [1.0, 0.5, 0.2];
    let short = || Record::new("short").from_state(1.0, 0.0);
    let mass = |spec: CoefficientSpec| Builder::new([spec, one(), one()]).record(record());
    let of = CoefficientKind::MASS;
    let cases: Vec<(Builder, &str)> = vec![
        (Builder::new(system()), "experiments: there are no records"),
        (
            Builder::new(system()).record(short()),
            "experiments[0]: this experiment has no samples",
        ),
        (
            Builder::new(system()).record(short().displacement(&times, &values[..2])),
            "experiments[0].columns.displacement: the numbers of times and samples differ\n  found: 2 values at 3 times",
        ),
        (
            Builder::new(system()).record(short().velocity(&[0.0, 2.0, 1.0], &values)),
            "experiments[0].columns.velocity: invalid samples\n  found: times that do not increase",
        ),
        (
            Builder::new(system()).record(short().displacement(&times, &[1.0, f64::NAN, 0.0])),
            "found: a time or sample that is not a finite number",
        ),
        (
            Builder::new(system()).record(short().displacement(&times, &values).sigma(0.0)),
            "experiments[0].sigma.displacement: a standard deviation must be positive\n  found: 0",
        ),
        (
            Builder::new(system()).record(
                short()
                    .displacement(&times, &values)
                    .loss(Loss::Huber { threshold: 1.0 }),
            ),
            "experiments[0].loss.displacement: a robust loss needs a sigma to identify large residuals",
        ),
        (
            Builder::new(system()).record(short().channel(ChannelSpec {
                noise: NoiseModel::Autoregressive { order: 0 },
                ..ChannelSpec::new(ChannelKind::Displacement, &times, &values)
            })),
            "experiments[0].noise.displacement.ar: the order of the noise is outside its range\n  found: 0",
        ),
        (
            Builder::new(system()).record(short().channel(ChannelSpec {
                noise: NoiseModel::Autoregressive { order: 1 },
                ..ChannelSpec::new(ChannelKind::Displacement, &times, &values)
            })),
            "experiments[0].noise.displacement.ar: correlated noise needs a sigma",
        ),
        (
            Builder::new(system()).record(short().velocity(&times, &values)),
            "experiments[0]: samples of the velocity need a sigma",
        ),
        (
            Builder::new(system()).record(short().displacement(&times[..2], &values[..2])),
            "grid.nodes: invalid number of nodes\n  found: 2",
        ),
        (
            Builder::new(system()).record(short().displacement(&[0.0, 0.1, 2.0], &values)),
            "grid.nodes: the number of nodes is missing",
        ),
        (
            Builder::new(system()).record(record()).record(record()),
            "experiments[1].name: two experiments have the same name",
        ),
        (
            Builder::new(system()).record(record().validation()),
            "experiments: all experiments are validation records",
        ),
        (
            Builder::new(system()).record(record().force(&times, &values)),
            "experiments[0].columns.force: the force is shorter than the record\n  found: 0 s to 2 s",
        ),
        (
            mass(CoefficientSpec::constant(-1.0)),
            "functions.mass.start: the mass must be positive at all times\n  found: -1",
        ),
        (
            mass(CoefficientSpec::fixed(f64::INFINITY)),
            "functions.mass.fixed: not a finite number\n  found: inf",
        ),
        (
            mass(CoefficientSpec::known(TimeHistory::Nodal {
                name: "known".into(),
                values: vec![1.0; 3],
            })),
            "functions.mass.fixed: the number of values differs from that of the nodes\n  found: 3 values\n  expected: 2000 values",
        ),
        (
            mass(CoefficientSpec::piecewise_linear(1, 1.0)),
            "functions.mass.knots: there are fewer than two knots\n  found: 1",
        ),
        (
            mass(CoefficientSpec::b_spline(usize::MAX, 1.0)),
            "found: 18446744073709551615 knots on 2000 nodes\n  expected: at most 1998 knots",
        ),
        (
            mass(CoefficientSpec::polynomial(&[0.0; 2000])),
            "functions.mass.degree: the degree is too high for the grid\n  found: 1999 on 2000 nodes\n  expected: at most 313",
        ),
        (
            mass(CoefficientSpec::polynomial(&[])),
            "functions.mass.start: the list does not fit the basis\n  found: 0 numbers for `polynomial`",
        ),
        (
            mass(CoefficientSpec {
                degree: Some(usize::MAX),
                ..CoefficientSpec::polynomial(&[1.0])
            }),
            "found: 18446744073709551615 on 2000 nodes",
        ),
        (
            mass(one()).nodes(usize::MAX),
            "grid.nodes: invalid number of nodes\n  found: 18446744073709551615",
        ),
        (
            mass(CoefficientSpec::estimated(
                BasisName::Constant,
                StartSpec::List(vec![1.0, 2.0]),
            )),
            "found: 2 numbers for `constant`\n  expected: 1 number, the value at all times",
        ),
        (
            mass(CoefficientSpec::piecewise_linear(2, 1.0).knots(KnotSpec::Times(vec![0.0, 30.0]))),
            "functions.mass.knots[1]: this knot lies outside the record\n  found: 30\n  expected: a time from 0 s to 25 s",
        ),
        (
            mass(
                CoefficientSpec::piecewise_linear(2, 1.0).knots(KnotSpec::Times(vec![
                    0.0,
                    f64::NAN,
                    25.0,
                ])),
            ),
            "functions.mass.knots[1]: this knot lies outside the record\n  found: NaN",
        ),
        (
            mass(one().max(0.0)),
            "functions.mass.max: this bound excludes a positive mass: the mass must be positive at all times",
        ),
        (
            mass(one().min(f64::NAN)),
            "functions.mass.min: not a finite number",
        ),
        (
            mass(one().min(2.0).max(1.0)),
            "functions.mass.min: min is greater than max",
        ),
        (
            mass(CoefficientSpec::fixed(1.0).min(0.0)),
            "functions.mass.min: a fixed function has neither bounds nor penalties",
        ),
        (
            mass(one().tikhonov(3, 1.0)),
            "functions.mass.penalty[0].order: this derivative cannot be penalised\n  found: 3",
        ),
        (
            mass(one().total_variation(-1.0)),
            "functions.mass.penalty[0].weight: a weight cannot be negative\n  found: -1",
        ),
        (
            mass(one()).coulomb_friction(CoefficientSpec::constant(1.0), 0.0),
            "functions.coulomb_friction.width: the width must be positive\n  found: 0",
        ),
        (
            mass(one().width(1.0)),
            "functions.mass.width: the mass has no width",
        ),
        (
            mass(one().min(2.0)).constrain(Constraint::Mean { of, value: 1.0 }),
            "constraints: these constraints contradict each other",
        ),
        (
            mass(one()).penalize(Constraint::Mean { of, value: 1.0 }, 0.0),
            "constraints[0].soft: the weight of a soft constraint must be positive\n  found: 0",
        ),
        (
            mass(one()).penalize(Constraint::DampingRatio { max: 0.1 }, 1.0),
            "constraints[0].soft: a bound of the damping ratio cannot be soft",
        ),
        (
            Builder::new([CoefficientSpec::fixed(1.0), one(), one()])
                .record(record())
                .constrain(Constraint::Mean { of, value: 1.0 }),
            "constraints[0]: mass is fixed, so it cannot be constrained",
        ),
        (
            Builder::new(system()).record(record().coefficient(of, one())),
            "functions.mass: no experiment uses this function",
        ),
        (
            Builder::new(system())
                .record(record().coefficient(CoefficientKind::CUBIC_STIFFNESS, one())),
            "experiments[0].functions.cubic_stiffness: the system has no such function",
        ),
        (
            Builder::new(system())
                .record(record().initial([ScalarSpec::Known(f64::NAN), ScalarSpec::ESTIMATED])),
            "experiments[0].initial.displacement: not a finite number",
        ),
    ];
    for (builder, expected) in cases {
        let error = builder.build().expect_err(expected).to_string();
        assert!(error.contains(expected), "{error}\nnot {expected}");
    }
}
