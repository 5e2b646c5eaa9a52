//! Bases, bounds and penalties in model files: the functions that they define, and the messages about invalid ones.

use insta::assert_snapshot;
use kmcfit::config::{BuildMode, Model, ModelFile, build};
use kmcfit_core::functions::{Basis, Parameterization};
use std::path::PathBuf;

const COLUMN: &str = "t_s,m_kg\n0,1\n2.5,0.8\n10,0.2\n";

/// A model on 21 nodes over 10 s whose mass is written as given.
fn read(mass: &str) -> Result<Model, String> {
    let text = format!(
        "format: 1
experiments: [{{initial: {{displacement: 1, velocity: 0}}}}]
grid: {{nodes: 21, duration: 10}}
functions:
  mass: {mass}
  damping: {{fixed: 0}}
  stiffness: {{fixed: 1}}
"
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.csv"), COLUMN).unwrap();
    let path: PathBuf = folder.path().join("m.yaml");
    let said = |error: kmcfit::error::InputError| {
        let shown = format!("{}/", folder.path().display());
        error.to_string().replace(&shown, "")
    };
    let file = ModelFile::parse(&path, text).map_err(said)?;
    build(&file, BuildMode::Simulate { nodes: None }).map_err(said)
}

fn message(mass: &str) -> String {
    read(mass).map_or_else(|error| error, |_| "no error".to_owned())
}

fn functions(mass: &str) -> Parameterization {
    read(mass).unwrap().problem.functions.clone()
}

fn basis(mass: &str) -> Basis {
    let functions = functions(mass);
    let first = functions.iter().next().unwrap();
    first.basis.clone().unwrap()
}

/// The mass at the nodes at the start.
fn start(mass: &str) -> Vec<f64> {
    let functions = functions(mass);
    functions.nodal(&functions.start()).inertias.swap_remove(0)
}

#[track_caller]
fn assert_close(found: &[f64], expected: impl Fn(f64) -> f64) {
    assert_eq!(found.len(), 21);
    for (i, value) in found.iter().enumerate() {
        let expected = expected(0.5 * i as f64);
        assert!((value - expected).abs() < 1e-12, "{i}: {value}, {expected}");
    }
}

#[test]
fn bases_are_built() {
    let four = vec![0.0, 2.5, 5.0, 7.5, 10.0];
    for (text, expected) in [
        ("nodal", Basis::Nodal),
        ("constant", Basis::Constant),
        ("polynomial, degree: 3", Basis::Polynomial { degree: 3 }),
        (
            "piecewise-constant, knots: 5",
            Basis::PiecewiseConstant {
                knots: four.clone(),
            },
        ),
        (
            "piecewise-linear, knots: [0, 0.3, 10]",
            Basis::PiecewiseLinear {
                knots: vec![0.0, 0.3, 10.0],
            },
        ),
        ("b-spline, knots: 5", Basis::BSpline { knots: four }),
    ] {
        let mass = format!("{{basis: {text}, start: 2}}");
        assert_eq!(basis(&mass), expected);
        assert_close(&start(&mass), |_| 2.0);
    }
}

#[test]
fn starts_are_lists_and_columns() {
    let hats = "basis: piecewise-linear, knots: [0, 5, 10]";
    assert_close(&start(&format!("{{{hats}, start: [1, 2, 1]}}")), |t| {
        2.0 - (t - 5.0).abs() / 5.0
    });
    assert_close(
        &start("{basis: piecewise-constant, knots: [0, 5, 10], start: [1, 2]}"),
        // At the node of a jump the mean of both sides.
        |t| match t {
            5.0 => 1.5,
            t if t < 5.0 => 1.0,
            _ => 2.0,
        },
    );
    assert_close(
        &start("{basis: polynomial, degree: 2, start: [1, -0.1, 0.02]}"),
        |t| 1.0 - 0.1 * t + 0.02 * t * t,
    );
    assert_close(&start("{basis: constant, start: [3]}"), |_| 3.0);
    let nodal: Vec<String> = (1..=21).map(|i| i.to_string()).collect();
    assert_close(
        &start(&format!("{{basis: nodal, start: [{}]}}", nodal.join(", "))),
        |t| 1.0 + 2.0 * t,
    );
    // The column is a line, which every basis except the constants represents.
    let line = |t: f64| 1.0 - 0.08 * t;
    for text in [
        "nodal",
        "piecewise-linear, knots: 4",
        "polynomial, degree: 1",
        "b-spline, knots: 4",
    ] {
        let column = "{data: m.csv, column: m_kg}";
        assert_close(&start(&format!("{{basis: {text}, start: {column}}}")), line);
    }
    assert_close(
        &start("{basis: constant, start: {data: m.csv, column: m_kg}}"),
        |_| 0.6,
    );
}

#[test]
fn limits_and_penalties_are_accepted() {
    for text in [
        "min: 0.1, max: {data: m.csv, column: m_kg}",
        "min: 1, max: 1",
        "penalty: {kind: tikhonov, order: 2, weight: 2}",
        "penalty: [{kind: tikhonov, order: 0, weight: 1, reference: {data: m.csv, column: m_kg}}, {kind: tikhonov, order: 1, weight: 0}]",
        "penalty: {kind: tv, weight: 0.5}",
    ] {
        assert_eq!(
            message(&format!("{{basis: nodal, start: 1, {text}}}")),
            "no error"
        );
    }
}

#[test]
fn knots() {
    let knots = |knots: &str| {
        message(&format!(
            "{{basis: piecewise-linear, start: 1, knots: {knots}}}"
        ))
    };
    assert_snapshot!(message("{basis: piecewise-linear, start: 1}"), @"
    m.yaml:5:9: functions.mass: the basis `piecewise-linear` needs knots
      expected: `knots`: `auto`, the number of equally spaced knots, or a list of times in s
    ");
    assert_snapshot!(knots("1"), @"
    m.yaml:5:52: functions.mass.knots: there are fewer than two knots
      found: 1
      expected: 2 or more, both ends of the record included
    ");
    assert_snapshot!(knots("[0]"), @"
    m.yaml:5:52: functions.mass.knots: there are fewer than two knots
      found: 1
      expected: 2 or more, both ends of the record included
    ");
    assert_snapshot!(knots("[]"), @"
    m.yaml:5:52: functions.mass.knots: there are fewer than two knots
      found: 0
      expected: 2 or more, both ends of the record included
    ");
    assert_snapshot!(knots("-3"), @"
    m.yaml:5:52: functions.mass.knots: a count cannot be negative
      found: the integer -3
      expected: an integer, 0 or more, a list of numbers, or `auto`
    ");
    assert_snapshot!(knots("eleven"), @"
    m.yaml:5:52: functions.mass.knots: neither a number nor a known word
      found: text `eleven`
      expected: an integer, 0 or more, a list of numbers, or `auto`
    ");
    assert_snapshot!(knots("2.5"), @"
    m.yaml:5:52: functions.mass.knots: not an integer
      found: the floating-point number 2.5
      expected: an integer, 0 or more, a list of numbers, or `auto`
    ");
    assert_snapshot!(knots("{count: 3}"), @"
    m.yaml:5:52: functions.mass.knots: not an integer
      found: a map
      expected: an integer, 0 or more, a list of numbers, or `auto`
    ");
    assert_snapshot!(knots("[0, 5, 12]"), @"
    m.yaml:5:59: functions.mass.knots[2]: this knot lies outside the record
      found: 12
      expected: a time from 0 s to 10 s
    ");
    assert_snapshot!(knots("[-1, 5, 10]"), @"
    m.yaml:5:53: functions.mass.knots[0]: this knot lies outside the record
      found: -1
      expected: a time from 0 s to 10 s
    ");
    assert_snapshot!(knots("[0, 5, 5, 10]"), @"
    m.yaml:5:59: functions.mass.knots[2]: the knots do not increase
      found: 5 after 5
      expected: a time greater than 5 s
    ");
    assert_snapshot!(knots("[0, 5, four, 10]"), @"
    m.yaml:5:59: functions.mass.knots[2]: not a number
      found: text `four`
      expected: a finite number
    ");
    assert_snapshot!(knots("[0, 5]"), @"
    m.yaml:5:56: functions.mass.knots[1]: the last knot is not at the end of the record
      found: 5
      expected: 10 s
      hint: a list of knots includes both ends of the record
    ");
    assert_snapshot!(knots("[1, 10]"), @"
    m.yaml:5:53: functions.mass.knots[0]: the first knot is not at the start of the record
      found: 1
      expected: 0 s
      hint: a list of knots includes both ends of the record
    ");
    assert_snapshot!(knots("22"), @"
    m.yaml:5:52: functions.mass.knots: there are more parameters than nodes
      found: 22 knots on 21 nodes
      expected: at most 21 knots
    ");
    assert_snapshot!(knots("1000000000000"), @"
    m.yaml:5:52: functions.mass.knots: there are more parameters than nodes
      found: 1000000000000 knots on 21 nodes
      expected: at most 21 knots
    ");
    assert_snapshot!(knots("[0, 0.1, 0.2, 0.3, 10]"), @"
    m.yaml:5:52: functions.mass.knots: the knots are closer than the nodes
      found: no node for a parameter between 0 s and 0.2 s
      expected: knots further apart than the step of 0.5 s
    ");
    assert_snapshot!(knots("[0, 0.4, 0.6, 0.9, 1.1, 1.2, 10]"), @"
    m.yaml:5:52: functions.mass.knots: the functions of this basis are linearly dependent at the nodes
      found: 7 parameters on 21 nodes
      expected: fewer knots, or more nodes
    ");
    assert_snapshot!(message("{basis: b-spline, start: 1, knots: 20}"), @"
    m.yaml:5:44: functions.mass.knots: there are more parameters than nodes
      found: 20 knots on 21 nodes
      expected: at most 19 knots
    ");
    assert_snapshot!(message("{basis: b-spline, start: 1, knots: [0, 0.1, 0.2, 0.3, 0.35, 0.4, 10]}"), @"
    m.yaml:5:44: functions.mass.knots: the knots are closer than the nodes
      found: no node for a parameter between 0 s and 0.2 s
      expected: knots further apart than the step of 0.5 s
    ");
    assert_snapshot!(message("{basis: piecewise-constant, start: 1, knots: [0, 0.1, 0.2, 10]}"), @"
    m.yaml:5:54: functions.mass.knots: the functions of this basis are linearly dependent at the nodes
      found: 3 parameters on 21 nodes
      expected: fewer knots, or more nodes
    ");
}

#[test]
fn keys_that_a_basis_does_not_use() {
    let with = |text: &str| message(&format!("{{start: 1, {text}}}"));
    assert_snapshot!(with("basis: piecewise-linear, knots: 5, degree: 3"), @"
    m.yaml:5:63: functions.mass.degree: the basis `piecewise-linear` does not use this key
      found: `degree`
      expected: `knots`
      hint: polynomial has a degree
    ");
    assert_snapshot!(with("basis: polynomial, degree: 3, knots: 5"), @"
    m.yaml:5:57: functions.mass.knots: the basis `polynomial` does not use this key
      found: `knots`
      expected: `degree`
      hint: piecewise-constant, piecewise-linear and b-spline have knots
    ");
    assert_snapshot!(with("basis: nodal, knots: 5"), @"
    m.yaml:5:41: functions.mass.knots: the basis `nodal` does not use this key
      found: `knots`
      expected: neither `knots` nor `degree`
      hint: piecewise-constant, piecewise-linear and b-spline have knots
    ");
    assert_snapshot!(with("basis: constant, degree: 0"), @"
    m.yaml:5:45: functions.mass.degree: the basis `constant` does not use this key
      found: `degree`
      expected: neither `knots` nor `degree`
      hint: polynomial has a degree
    ");
    assert_snapshot!(with("knots: 5"), @"
    m.yaml:5:9: functions.mass: a function to be fitted needs a basis
      expected: `basis`, one of nodal, constant, piecewise-constant, piecewise-linear, polynomial, b-spline
    ");
    assert_snapshot!(with("basis: spline, knots: 5"), @"
    m.yaml:5:27: functions.mass.basis: unknown choice
      found: `spline`
      expected: one of: nodal, constant, piecewise-constant, piecewise-linear, polynomial, b-spline
      hint: did you mean `b-spline`?
    ");
    assert_snapshot!(with("basis: b-spline, knot: 5"), @"
    m.yaml:5:37: functions.mass: unknown key
      found: `knot`
      expected: one of: basis, knots, degree, start, fixed, known_part, min, max, penalty, width
      hint: did you mean `knots`?
    ");
}

#[test]
fn degrees() {
    assert_snapshot!(message("{basis: polynomial, start: 1}"), @"
    m.yaml:5:9: functions.mass: the basis `polynomial` needs a degree
      expected: `degree`: an integer, for instance `degree: 1`
    ");
    assert_snapshot!(message("{basis: polynomial, start: 1, degree: 21}"), @"
    m.yaml:5:47: functions.mass.degree: the degree is too high for the grid
      found: 21 on 21 nodes
      expected: at most 20
    ");
    assert_snapshot!(message("{basis: polynomial, start: 1, degree: 1.5}"), @"
    m.yaml:5:47: functions.mass.degree: not an integer
      found: the floating-point number 1.5
      expected: an integer, 0 or more
    ");
    assert_snapshot!(message("{basis: polynomial, start: 1, degree: -1}"), @"
    m.yaml:5:47: functions.mass.degree: a count cannot be negative
      found: the integer -1
      expected: an integer, 0 or more
    ");
    // The highest degree that the grid permits.
    assert_eq!(
        message("{basis: polynomial, start: 1, degree: 20}"),
        "no error"
    );
}

#[test]
fn starts() {
    assert_snapshot!(message("{basis: piecewise-linear, knots: 4, start: [1, 2, 3]}"), @"
    m.yaml:5:52: functions.mass.start: the list does not fit the basis
      found: 3 numbers for `piecewise-linear`
      expected: 4 numbers, one per knot
    ");
    assert_snapshot!(message("{basis: piecewise-constant, knots: 4, start: [1, 2, 3, 4]}"), @"
    m.yaml:5:54: functions.mass.start: the list does not fit the basis
      found: 4 numbers for `piecewise-constant`
      expected: 3 numbers, one per cell between knots
    ");
    assert_snapshot!(message("{basis: polynomial, degree: 2, start: [1]}"), @"
    m.yaml:5:47: functions.mass.start: the list does not fit the basis
      found: 1 number for `polynomial`
      expected: 3 numbers, the coefficients of t^0, t^1, … with t in s
    ");
    assert_snapshot!(message("{basis: nodal, start: [1, 2]}"), @"
    m.yaml:5:31: functions.mass.start: the list does not fit the basis
      found: 2 numbers for `nodal`
      expected: 21 numbers, one per node
    ");
    assert_snapshot!(message("{basis: constant, start: [1, 2]}"), @"
    m.yaml:5:34: functions.mass.start: the list does not fit the basis
      found: 2 numbers for `constant`
      expected: 1 number, the value at all times
    ");
    assert_snapshot!(message("{basis: b-spline, knots: 4, start: [1, 2, 3, 4]}"), @"
    m.yaml:5:44: functions.mass.start: `start` of the basis `b-spline` must be one number
      found: a list
      expected: a finite number, or a column: {data: file.csv, column: name}
    ");
    assert_snapshot!(message("{basis: nodal, start: [1, two]}"), @"
    m.yaml:5:35: functions.mass.start[1]: not a number
      found: text `two`
      expected: a finite number
    ");
    assert_snapshot!(message("{basis: nodal, start: high}"), @"
    m.yaml:5:31: functions.mass.start: not a number
      found: text `high`
      expected: a finite number, a list of numbers, or a column: {data: file.csv, column: name}
    ");
    assert_snapshot!(message("{basis: nodal, start: {data: m.csv, column: m}}"), @"
    m.yaml:5:53: functions.mass.start.column: m.csv: there is no such column
      found: `m`
      expected: one of: t_s, m_kg
      hint: did you mean `m_kg`?
    ");
    assert_snapshot!(message("{basis: nodal, start: 0}"), @"
    m.yaml:5:31: functions.mass.start: the mass must be positive at all times
      found: 0
      expected: a number greater than 0, in kg
    ");
    assert_snapshot!(message("{basis: polynomial, degree: 1, start: [1, -0.2]}"), @"
    m.yaml:5:47: functions.mass.start: the mass must be positive at all times
      found: 0 at node 10
      expected: a number greater than 0, in kg
    ");
    assert_snapshot!(message("{basis: piecewise-linear, knots: [0, 5, 10], start: [1, -1, 1]}"), @"
    m.yaml:5:61: functions.mass.start: the mass must be positive at all times
      found: 0 at node 5
      expected: a number greater than 0, in kg
    ");
}

#[test]
fn limits() {
    let with = |text: &str| message(&format!("{{basis: nodal, start: 1, {text}}}"));
    assert_snapshot!(with("min: 2, max: 1"), @"
    m.yaml:5:39: functions.mass.min: min is greater than max
      found: min 2 kg and max 1 kg at 0 s
      expected: min at most max at all times
    ");
    assert_snapshot!(with("min: 0.5, max: {data: m.csv, column: m_kg}"), @"
    m.yaml:5:39: functions.mass.min: min is greater than max
      found: min 0.5 kg and max 0.48 kg at 6.5 s
      expected: min at most max at all times
    ");
    assert_eq!(with("min: none"), "no error");
    assert_snapshot!(with("min: nine"), @"
    m.yaml:5:39: functions.mass.min: neither a number nor a known word
      found: text `nine`
      expected: a finite number, a column: {data: file.csv, column: name}, or `none`
      hint: did you mean `none`?
    ");
    assert_snapshot!(with("max: {data: x.csv, column: m_kg}"), @"
    m.yaml:5:46: functions.mass.max.data: x.csv: no such file
      expected: a CSV file with one row of column names and rows of numbers
      hint: did you mean `m.csv`?
    ");
    assert_snapshot!(message("{fixed: 1, min: 0.5}"), @"
    m.yaml:5:25: functions.mass.min: a fixed function has neither bounds nor penalties
      found: `fixed` and `min`
      expected: one of the two
    ");
    assert_snapshot!(message("{fixed: 1, penalty: {kind: tikhonov, order: 2, weight: 1}}"), @"
    m.yaml:5:29: functions.mass.penalty: a fixed function has neither bounds nor penalties
      found: `fixed` and `penalty`
      expected: one of the two
    ");
}

#[test]
fn penalties() {
    let with = |text: &str| message(&format!("{{basis: nodal, start: 1, {text}}}"));
    assert_snapshot!(with("penalty: {kind: tikhonov, order: 2, weight: discrepency}"), @"
    m.yaml:5:78: functions.mass.penalty.weight: unknown choice
      found: `discrepency`
      expected: a finite number, or one of: discrepancy, reml, period, bic
      hint: did you mean `discrepancy`?
    ");
    assert_snapshot!(with("penalty: {kind: tikhonov, order: 2}"), @"
    m.yaml:5:34: functions.mass.penalty: the key `weight` is missing
      expected: the key `weight`
    ");
    assert_snapshot!(with("penalty: {kind: tikhonov, order: 2, weigth: 1}"), @"
    m.yaml:5:70: functions.mass.penalty: unknown key
      found: `weigth`
      expected: one of: kind, order, weight, reference
      hint: did you mean `weight`?
    ");
    assert_snapshot!(with("penalty: {kind: tv, weight: -1}"), @"
    m.yaml:5:62: functions.mass.penalty.weight: a weight cannot be negative
      found: -1
      expected: a number, 0 or more
    ");
    assert_snapshot!(with("penalty: {kind: tv, weight: discrepancy}"), @"
    m.yaml:5:62: functions.mass.penalty.weight: the weight of total variation has the rule `bic` only
      found: `discrepancy`
      expected: `bic`, or a finite number
    ");
}
