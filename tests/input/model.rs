//! Valid model files.

use std::path::{Path, PathBuf};

use kmcfit::config::ModelFile;
use kmcfit_core::functions::WeightRule;
use kmcfit_core::model::{
    BasisName, Bound, ByCoefficient, CoefficientSpec, ColumnId, FitMethod, InitialSpec, KnotSpec,
    KnownValue, Nodes, NumberOrColumn, PenaltyKind, PenaltySpec, ScalarOr, ScalarSpec, Shared,
    SigmaValue, StartSpec, WeightChoice,
};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::system::Method;

pub const FULL: &str = "\
format: 1
title: Linear mass decay
experiments:
  - name: free decay
    data: ../data/noisy.csv
    columns: {time: t_s, displacement: y_m}
    sigma: {displacement: 0.1}
    initial: {displacement: 3.3, velocity: 1}
  - initial:
      displacement: -2e-3
      velocity: +0.5
grid: {nodes: 2000, method: midpoint, duration: 25.0}
functions:
  mass: {basis: nodal, start: 2.0}
  damping:
    basis: nodal
    start: {data: start.csv, column: damping_N_s_per_m}
  stiffness: {basis: constant, fixed: 1}
fit:
  method: lbfgs
  gradient: continuous
  memory: 10
  stop: {iterations: 1000, cost_ratio: 1e-4, gradient_ratio: 1e-4, tolerance: 1e-10, step: 1e-12, seconds: 60}
truth:
  data: ../data/paper_truth.csv
  columns: {mass: mass_kg, damping: damping_N_s_per_m, stiffness: stiffness_N_per_m}
predict:
  - {displacement: 3.301, velocity: 1.001}
";

pub const SHORT: &str = "\
format: 1
experiments:
  - initial: {displacement: 3.3, velocity: 1.0}
functions:
  mass: {basis: nodal}
  damping: {basis: nodal}
  stiffness: {basis: nodal}
";

fn of(functions: &ByCoefficient<Shared>, kind: CoefficientKind) -> CoefficientSpec {
    functions.get(kind).expect("a required function").clone()
}

#[test]
fn every_key_is_read() {
    let spec = ModelFile::parse("m.yaml", FULL).unwrap().spec;
    assert_eq!(spec.title.as_deref(), Some("Linear mass decay"));
    let [first, second] = spec.experiments.as_slice() else {
        panic!("two experiments")
    };
    assert_eq!(first.name.as_deref(), Some("free decay"));
    assert_eq!(first.data.as_deref(), Some("../data/noisy.csv"));
    let columns = first.columns.as_ref().unwrap();
    assert_eq!(columns.time, Some(ColumnId::Name("t_s".into())));
    assert_eq!(
        columns.displacement,
        Some(ScalarOr::Scalar(ColumnId::Name("y_m".into())))
    );
    let sigma = first.sigma.as_ref().unwrap().displacement.clone();
    assert_eq!(sigma, Some(SigmaValue::Number(0.1)));
    assert_eq!(known(&first.initial)[1], 1.0);
    assert_eq!(second.name, None);
    assert_eq!(known(&second.initial), [-2e-3, 0.5]);

    let grid = spec.grid.unwrap();
    assert_eq!(grid.nodes, Some(Nodes::Count(2000)));
    assert_eq!(grid.method, Some(Method::Midpoint));
    assert_eq!(grid.duration, Some(25.0));

    let functions = spec.functions;
    assert_eq!(
        of(&functions, CoefficientKind::MASS).basis,
        Some(BasisName::Nodal)
    );
    assert_eq!(
        of(&functions, CoefficientKind::MASS).start,
        Some(StartSpec::Number(2.0))
    );
    let Some(StartSpec::Column(start)) = of(&functions, CoefficientKind::DAMPING).start else {
        panic!("a column")
    };
    assert_eq!(
        (&*start.data, &*start.column),
        ("start.csv", "damping_N_s_per_m")
    );
    assert_eq!(
        of(&functions, CoefficientKind::STIFFNESS).fixed,
        Some(KnownValue::Number(1.0))
    );

    let fit = spec.fit.unwrap();
    assert_eq!(fit.method, Some(FitMethod::Lbfgs));
    assert_eq!(fit.gradient, Some(GradientKind::Continuous));
    assert_eq!(fit.memory, Some(10));
    let stop = fit.stop.unwrap();
    assert_eq!(stop.iterations, Some(1000));
    assert_eq!(stop.cost_ratio, Some(1e-4));
    assert_eq!(stop.gradient_ratio, Some(1e-4));
    assert_eq!(stop.tolerance, Some(1e-10));
    assert_eq!(stop.step, Some(1e-12));
    assert_eq!(stop.seconds, Some(60.0));

    let truth = spec.truth.unwrap();
    assert_eq!(&*truth.data, "../data/paper_truth.csv");
    let columns = truth.columns.unwrap();
    assert_eq!(
        columns.get(CoefficientKind::MASS).map(String::as_str),
        Some("mass_kg")
    );
    assert_eq!(
        columns.get(CoefficientKind::DAMPING).map(String::as_str),
        Some("damping_N_s_per_m")
    );
    assert_eq!(
        columns.get(CoefficientKind::STIFFNESS).map(String::as_str),
        Some("stiffness_N_per_m")
    );
    assert_eq!(spec.predict.unwrap()[0].velocity, 1.001);
}

#[test]
fn shapes_limits_and_penalties_are_read() {
    let text = SHORT
        .replace("mass: {basis: nodal}", "mass: {basis: piecewise-linear, knots: 11, start: [1, 2.5], min: 0.1, max: {data: m.csv, column: m}}")
        .replace("damping: {basis: nodal}", "damping: {basis: b-spline, knots: [0, 1.5, 3], penalty: [{kind: tikhonov, order: 1, weight: discrepancy}, {kind: tv, weight: 2}]}")
        .replace("stiffness: {basis: nodal}", "stiffness: {basis: polynomial, degree: 3, penalty: [{kind: tikhonov, order: 0, weight: 1e-3, reference: 1}, {kind: tikhonov, order: 2, weight: reml}]}");
    let functions = ModelFile::parse("m.yaml", text).unwrap().spec.functions;

    let mass = of(&functions, CoefficientKind::MASS);
    assert_eq!(mass.basis, Some(BasisName::PiecewiseLinear));
    assert_eq!(mass.knots, Some(KnotSpec::Count(11)));
    let list = vec![1.0, 2.5];
    assert_eq!(mass.start, Some(StartSpec::List(list)));
    let bound = Bound::At(NumberOrColumn::Number(0.1));
    assert_eq!(mass.min, Some(bound));
    let Some(Bound::At(NumberOrColumn::Column(max))) = mass.max else {
        panic!("a column")
    };
    assert_eq!((&*max.data, &*max.column), ("m.csv", "m"));

    let damping = of(&functions, CoefficientKind::DAMPING);
    assert_eq!(damping.basis, Some(BasisName::BSpline));
    let times = [0.0, 1.5, 3.0].to_vec();
    assert_eq!(damping.knots, Some(KnotSpec::Times(times)));
    let tikhonov = |order, weight, reference| PenaltySpec {
        kind: PenaltyKind::Tikhonov,
        order: Some(order),
        weight,
        reference,
    };
    let two: Vec<_> = damping.penalty.iter().flat_map(|s| s.iter()).collect();
    let slope = tikhonov(1, WeightChoice::Rule(WeightRule::Discrepancy), None);
    let variation = PenaltySpec {
        kind: PenaltyKind::TotalVariation,
        order: None,
        weight: WeightChoice::Number(2.0),
        reference: None,
    };
    let expected = [("[0]".to_owned(), &slope), ("[1]".to_owned(), &variation)];
    assert_eq!(two, expected);

    let stiffness = of(&functions, CoefficientKind::STIFFNESS);
    assert_eq!(stiffness.degree, Some(3));
    let many: Vec<_> = stiffness.penalty.iter().flat_map(|s| s.iter()).collect();
    let reference = NumberOrColumn::Number(1.0);
    let value = tikhonov(0, WeightChoice::Number(1e-3), Some(reference));
    let curvature = tikhonov(
        2,
        WeightChoice::Rule(WeightRule::RestrictedLikelihood),
        None,
    );
    let expected = [("[0]".to_owned(), &value), ("[1]".to_owned(), &curvature)];
    assert_eq!(many, expected);
}

#[test]
fn optional_keys_may_be_missing_or_empty() {
    let short = ModelFile::parse("m.yaml", SHORT).unwrap().spec;
    assert_eq!(short.title, None);
    assert_eq!(short.grid, None);
    assert_eq!(short.fit, None);
    let blank = format!("{SHORT}grid:\nfit: ~\ntitle: null\n");
    assert_eq!(ModelFile::parse("m.yaml", blank).unwrap().spec, short);
}

#[test]
fn names_keep_their_spelling() {
    let text = format!("{SHORT}title: 1.50\n");
    let spec = ModelFile::parse("m.yaml", text).unwrap().spec;
    assert_eq!(spec.title.as_deref(), Some("1.50"));
}

/// In values that may be written in several ways too.
#[test]
fn names_and_numbers_are_read_by_their_keys() {
    let text = SHORT.replace(
        "mass: {basis: nodal}",
        "mass: {fixed: {data: 12, column: 1.50}}",
    );
    let text = text.replace(
        "damping: {basis: nodal}",
        "damping: {basis: nodal, start: 99999999999999999999, min: {data: yes, column: true}}",
    );
    let functions = ModelFile::parse("m.yaml", text).unwrap().spec.functions;
    let Some(KnownValue::Map(fixed)) = of(&functions, CoefficientKind::MASS).fixed else {
        panic!("a map")
    };
    let names = [fixed.data, fixed.column].map(Option::unwrap_or_default);
    assert_eq!(names, ["12", "1.50"]);
    let damping = of(&functions, CoefficientKind::DAMPING);
    assert_eq!(damping.start, Some(StartSpec::Number(1e20)));
    let Some(Bound::At(NumberOrColumn::Column(min))) = damping.min else {
        panic!("a column")
    };
    assert_eq!((&*min.data, &*min.column), ("yes", "true"));
}

/// A coefficient without a value is no coefficient that is left out.
#[test]
fn an_empty_function_is_refused() {
    let text = SHORT.replace("  stiffness", "  cubic_stiffness:\n  stiffness");
    let error = ModelFile::parse("m.yaml", text).unwrap_err().to_string();
    assert!(
        error.contains("functions.cubic_stiffness: wrong type of value"),
        "{error}"
    );
}

#[test]
fn order_quotes_anchors_and_line_ends_do_not_matter() {
    let short = ModelFile::parse("m.yaml", SHORT).unwrap().spec;
    for text in [
        SHORT.replace('\n', "\r\n"),
        format!("---\n# comment\n{SHORT}...\n"),
        SHORT
            .replace("format", "\"format\"")
            .replace("mass", "'mass'"),
        SHORT
            .replace("mass: {basis: nodal}", "mass: &f {basis: nodal}")
            .replace("damping: {basis: nodal}", "damping: *f"),
    ] {
        assert_eq!(ModelFile::parse("m.yaml", text).unwrap().spec, short);
    }
}

#[test]
fn a_file_is_read_and_paths_start_from_its_folder() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.yaml");
    std::fs::write(&path, format!("\u{feff}{FULL}")).unwrap();
    let model = ModelFile::read(&path).unwrap();
    assert_eq!(model.path, path);
    assert_eq!(model.text, FULL);
    let data = model.spec.experiments[0].data.as_ref().unwrap();
    assert_eq!(model.resolve(data), folder.path().join("../data/noisy.csv"));
    let absolute = folder.path().join("x.csv");
    assert_eq!(model.resolve(&absolute), absolute);
    let bare = ModelFile::parse("model.yaml", SHORT).unwrap();
    assert_eq!(bare.resolve(Path::new("x.csv")), PathBuf::from("x.csv"));
}

#[test]
fn choices_say_their_names() {
    for method in FitMethod::ALL {
        assert_eq!(method.to_string(), method.name());
    }
    assert_eq!(Method::Rk4.name(), "rk4");
}

/// Displacement and velocity of an initial state that is known.
fn known(initial: &InitialSpec) -> [f64; 2] {
    let ScalarOr::Map(state) = initial else {
        panic!("a state")
    };
    [&state.displacement, &state.velocity].map(|value| match value {
        ScalarSpec::Known(number) => *number,
        other => panic!("{other:?}"),
    })
}
