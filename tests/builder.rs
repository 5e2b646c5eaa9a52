//! Problems from Rust: the same as from a model file, and refusals with a place.

use kmcfit::config::{ModelFile, Purpose, build};
use kmcfit::observations::Table;
use kmcfit_core::internals::builder::{Builder, Part, Record};
use kmcfit_core::internals::constraints::{Shape, Statement};
use kmcfit_core::internals::functions::{Basis, CoefficientKind};
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::system::Method;
use std::path::Path;

/// The columns of a file in `data/`.
fn columns<const N: usize>(file: &str, names: [&str; N]) -> [Vec<f64>; N] {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("data")
        .join(file);
    let table = Table::read(path).unwrap();
    names.map(|name| table.column(name).unwrap().to_vec())
}

fn from_file(yaml: &str) -> (Problem, kmcfit_core::internals::solvers::FitSettings) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/built-by-the-test.yaml");
    let model = build(&ModelFile::parse(&path, yaml).unwrap(), Purpose::Fit).unwrap();
    (model.problem, model.settings)
}

fn paper_record() -> Record {
    let [times, y] = columns("paper.csv", ["t_s", "y_m"]);
    Record::new("free decay")
        .from_state(3.3, 1.0)
        .displacement(&times, &y)
}

/// Both problems take the same way, to the last bit.
fn same_way(built: &Problem, written: &(Problem, kmcfit_core::internals::solvers::FitSettings)) {
    let (written, settings) = written;
    assert_eq!(built.start(), written.start());
    let [a, b] = [built, written].map(|p| p.fit_with(settings).unwrap());
    assert_eq!(a.history, b.history);
    assert_eq!(a.best.parameters, b.best.parameters);
    assert_eq!(a.outcome.status, b.outcome.status);
}

#[test]
fn a_device_with_limits_penalties_and_demands_is_that_of_its_model_file() {
    let written = from_file(
        "format: 1
experiments:
  - {name: free decay, data: ../data/paper.csv, initial: {displacement: 3.3, velocity: 1.0}}
grid: {method: midpoint}
functions:
  mass:      {basis: piecewise-linear, knots: 11, start: 2.0, min: 0.05, smooth: {order: 2, weight: 0.1}}
  damping:   {basis: b-spline, knots: 6, start: 1.0, min: 0.0, smooth: [{order: 0, weight: 0.01}, {order: 1, weight: 0.1}]}
  stiffness: {basis: polynomial, degree: 1, start: [1.5, -0.01], max: 4.0}
constraints:
  - {function: stiffness, at: 0.0, value: 1.0}
  - {function: mass, shape: non-increasing}
  - {function: mass, mean: 0.75, soft: 10.0}
fit: {stop: {iterations: 20, tolerance: 1e-10}}
",
    );
    let mass = Part::piecewise_linear(11, 2.0).min(0.05).smooth(2, 0.1);
    let damping = Part::b_spline(6, 1.0)
        .min(0.0)
        .smooth(0, 0.01)
        .smooth(1, 0.1);
    let stiffness = Part::polynomial(&[1.5, -0.01]).max(4.0);
    let of = CoefficientKind::Mass;
    let built = Builder::new([mass, damping, stiffness])
        .record(paper_record())
        .method(Method::Midpoint)
        .demand(Statement::Value {
            of: CoefficientKind::Stiffness,
            at: 0.0,
            value: 1.0,
        })
        .demand(Statement::Shape {
            of,
            shape: Shape::NonIncreasing,
        })
        .prefer(Statement::Mean { of, value: 0.75 }, 10.0)
        .build()
        .unwrap();
    same_way(&built, &written);
}

#[test]
fn a_forced_record_of_an_accelerometer_is_that_of_its_model_file() {
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
  mass:      {basis: constant, start: 3.0}
  damping:   {basis: constant, start: 0.5, variation: {weight: 0.1}}
  stiffness: {basis: piecewise-constant, knots: 3, start: 2000.0, variation: {weight: 1e-6}}
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
        Part::constant(3.0),
        Part::constant(0.5).variation(0.1),
        Part::piecewise_constant(3, 2000.0).variation(1e-6),
    ];
    let built = Builder::new(device)
        .cubic_stiffness(Part::fixed(0.0))
        .record(record)
        .nodes(4801)
        .build()
        .unwrap();
    same_way(&built, &written);
}

/// What cannot be meant is refused with its part, and nothing panics.
#[test]
fn what_cannot_be_meant_is_refused() {
    let one = || Part::constant(1.0);
    let device = || [one(), one(), one()];
    let record = paper_record;
    let times = [0.0, 1.0, 2.0];
    let values = [1.0, 0.5, 0.2];
    let short = || Record::new("short").from_state(1.0, 0.0);
    let mass = |part: Part| Builder::new([part, one(), one()]).record(record());
    let of = CoefficientKind::Mass;
    let cases: Vec<(Builder, &str)> = vec![
        (Builder::new(device()), "records: there are none"),
        (
            Builder::new(device()).record(short()),
            "record `short`: there are no readings",
        ),
        (
            Builder::new(device()).record(short().displacement(&times, &values[..2])),
            "record `short`: displacement: 2 values at 3 times",
        ),
        (
            Builder::new(device()).record(short().velocity(&[0.0, 2.0, 1.0], &values)),
            "record `short`: velocity: the times do not increase",
        ),
        (
            Builder::new(device()).record(short().displacement(&times, &[1.0, f64::NAN, 0.0])),
            "record `short`: displacement: a time or reading is not a finite number",
        ),
        (
            Builder::new(device()).record(short().displacement(&times, &values).sigma(0.0)),
            "record `short`: displacement: sigma is not a positive number",
        ),
        (
            Builder::new(device()).record(short().displacement(&times[..2], &values[..2])),
            "grid: 2 nodes, fewer than 3",
        ),
        (
            Builder::new(device()).record(short().displacement(&[0.0, 0.1, 2.0], &values)),
            "grid: `nodes` is needed: the readings are not all at the same, equally spaced times",
        ),
        (
            Builder::new(device()).record(record().force(&times, &values)),
            "record `free decay`: force: it does not cover 0 s to 25 s",
        ),
        (
            mass(Part::constant(-1.0)),
            "mass: it must be positive at all times, not -1",
        ),
        (
            mass(Part::fixed(f64::INFINITY)),
            "mass: its start is inf, not a finite number",
        ),
        (
            mass(Part::piecewise_linear(1, 1.0)),
            "mass: 1 knots, but from 2 to 2000 fit the grid",
        ),
        (
            mass(Part::b_spline(usize::MAX, 1.0)),
            "mass: 18446744073709551615 knots, but from 2 to 1998 fit the grid",
        ),
        (
            mass(Part::polynomial(&[0.0; 2000])),
            "mass: degree 1999, but at most 313 fits the grid",
        ),
        (
            mass(Part::sought(
                Basis::Polynomial { degree: usize::MAX },
                vec![1.0],
            )),
            "mass: degree 18446744073709551615, but at most 313 fits the grid",
        ),
        (
            mass(Part::constant(1.0)).nodes(usize::MAX),
            "grid: 18446744073709551615 nodes, more than 100000000",
        ),
        (
            mass(Part::sought(Basis::Constant, vec![1.0, 2.0])),
            "mass: 2 start values, but 1 parameters",
        ),
        (
            mass(Part::sought(
                Basis::PiecewiseLinear {
                    knots: vec![0.0, 30.0],
                },
                vec![1.0, 1.0],
            )),
            "mass: its knots must increase from 0 s to 25 s, the ends of the record",
        ),
        (mass(one().max(0.0)), "mass: `max` leaves no mass"),
        (
            mass(one().smooth(3, 1.0)),
            "mass: order 3 of `smooth` is not 0, 1 or 2",
        ),
        (
            mass(one().variation(-1.0)),
            "mass: the weight -1 is not a finite number of at least 0",
        ),
        (
            mass(one()).coulomb_friction(Part::constant(1.0), 0.0),
            "coulomb_friction: its width is 0 m/s, not positive",
        ),
        (
            mass(one().min(2.0)).demand(Statement::Mean { of, value: 1.0 }),
            "demands: they contradict each other",
        ),
        (
            Builder::new([Part::fixed(1.0), one(), one()])
                .record(record())
                .demand(Statement::Mean { of, value: 1.0 }),
            "mass cannot be constrained: fixed",
        ),
    ];
    for (builder, expected) in cases {
        let error = builder.build().expect_err(expected).to_string();
        assert!(error.contains(expected), "{error}\nnot {expected}");
    }
}
