//! Constraints in model files: their rows and cones, and the messages about invalid ones.

use insta::assert_snapshot;
use kmcfit::config::{BuildMode, Model, ModelFile, build};
use kmcfit_core::finding::Finding;
use kmcfit_core::solvers::{Initial, Solver};

/// A model with 21 samples over 2 s; line 8 is the mass, line 11 the constraints, line 12 the fit.
fn text(constraints: &str) -> String {
    format!(
        "format: 1
experiments:
  - data: samples.csv
    initial: {{displacement: 1, velocity: 0}}
grid: {{nodes: 21, method: midpoint}}
title: T
functions:
  mass: {{basis: piecewise-linear, knots: 5, start: 2}}
  damping: {{basis: nodal, start: 1}}
  stiffness: {{fixed: 1}}
constraints: {constraints}
"
    )
}

fn read(text: &str) -> Result<Model, String> {
    let folder = tempfile::tempdir().unwrap();
    let mut samples = String::from("t_s,y_m\n");
    let mut column = String::from("t_s,c\n");
    for i in 0..21 {
        let t = f64::from(i) / 10.0;
        samples.push_str(&format!("{t},{}\n", t.cos()));
        column.push_str(&format!("{t},{}\n", 0.1 + 0.1 * t * t));
    }
    std::fs::write(folder.path().join("samples.csv"), samples).unwrap();
    std::fs::write(folder.path().join("c.csv"), column).unwrap();
    let said = |error: kmcfit::error::InputError| {
        let shown = format!("{}/", folder.path().display());
        error.to_string().replace(&shown, "")
    };
    let file = ModelFile::parse(folder.path().join("m.yaml"), text).map_err(said)?;
    build(&file, BuildMode::Fit).map_err(said)
}

fn message(constraints: &str) -> String {
    said(&text(constraints))
}

fn said(text: &str) -> String {
    read(text).map_or_else(
        |error| error,
        |model| format!("no error {:?}", Finding::texts(&model.warnings)),
    )
}

/// The names of all rows and cones.
fn names(constraints: &str) -> Vec<String> {
    let model = read(&text(constraints)).unwrap_or_else(|error| panic!("{error}"));
    let set = model.problem.constraints.clone();
    let rows = set
        .groups
        .into_iter()
        .chain(model.problem.soft.clone())
        .map(|g| g.name);
    rows.chain(set.cones.into_iter().map(|g| g.name)).collect()
}

#[test]
fn every_kind_of_constraint_is_accepted() {
    let list = "
  - {function: mass, shape: [non-increasing, convex]}
  - {function: mass, shape: non-decreasing, soft: 3}
  - {function: damping, min: 0.5, max: 2}
  - {function: damping, min: {data: c.csv, column: c}}
  - {function: mass, slope: {min: -0.1, max: 0.1}}
  - {function: mass, at: 0, value: 2}
  - {function: mass, at: [0, 2], value: 2}
  - {function: mass, at: [0, 1], value: [2, 2]}
  - {function: mass, mean: 2}
  - {function: mass, integral: 4}
  - {equal: [damping, mass], ratio: 0.5}
  - {equal: [mass, damping], ratio: 2}
  - {passive: true}
  - {frequency: {min: 0.05, max: 0.5}}
  - {damping_ratio: {max: 0.9}}";
    assert_eq!(
        names(list),
        [
            "mass >= 0.002",
            "mass non-increasing",
            "mass convex",
            "damping >= 0.5",
            "damping <= 2",
            "damping >= c of c.csv",
            "slope of mass >= -0.1",
            "slope of mass <= 0.1",
            "mass(0) = 2",
            "mass(0) = 2",
            "mass(2) = 2",
            "mass(0) = 2",
            "mass(1) = 2",
            "mean of mass = 2",
            "integral of mass = 4",
            "damping = 0.5 mass",
            "mass = 2 damping",
            "passive: c >= m'/2",
            "frequency >= 0.05 Hz",
            "frequency <= 0.5 Hz",
            "mass non-decreasing",
            "damping ratio <= 0.9",
        ]
    );
    let model = read(&text(list)).unwrap();
    let soft: Vec<_> = (model.problem.soft.iter())
        .filter_map(|g| Some((g.name.as_str(), g.soft?)))
        .collect();
    assert_eq!(soft, [("mass non-decreasing", 3.0)]);
}

#[test]
fn bounds_of_the_functions_are_rows() {
    let with = |mass: &str| {
        let changed = text("").replace("start: 2", &format!("start: 2, {mass}"));
        read(&changed.replace("constraints: \n", "")).unwrap()
    };
    let name = |model: &Model, i: usize| model.problem.constraints.groups[i].name.clone();
    let model = with("min: 0.05, max: 3");
    assert_eq!(
        [name(&model, 0), name(&model, 1)],
        ["mass >= 0.05", "mass <= 3"]
    );
    assert!(model.problem.constraints.are_simple());
    assert!(model.warnings.is_empty());
    let model = with("min: 2, max: 2");
    assert_eq!(name(&model, 0), "mass = 2");
    let model = with("max: 1.5");
    assert_eq!(
        Finding::texts(&model.warnings),
        ["the start values violate `mass <= 1.5` and were projected onto the constraints"]
    );
    assert_eq!(model.problem.functions.start()[..5], [1.5; 5]);
}

#[test]
fn methods_and_starts() {
    let with = |fit: &str| format!("{}fit: {fit}\n", text("").replace("constraints: \n", ""));
    let settings = |fit: &str| read(&with(fit)).unwrap().settings;
    assert_eq!(settings("{}").solver, Solver::GaussNewton);
    assert_eq!(settings("{}").initial, Initial::Functions);
    assert_eq!(
        settings("{method: projected-gradient, initial: data}").initial,
        Initial::Data
    );
    assert_eq!(
        settings("{method: projected-gradient}").solver,
        Solver::ProjectedGradient
    );
    assert_snapshot!(said(&with("{memory: 5}")), @"
    m.yaml:11:15: fit.memory: the method `gauss-newton` has no memory
      expected: no `memory`, or `method: lbfgs`
    ");
    assert_snapshot!(said(&with("{initial: date}")), @"
    m.yaml:11:16: fit.initial: unknown choice
      found: `date`
      expected: one of: functions, data
      hint: did you mean `data`?
    ");
    let bounded = |method: &str| {
        let text = with(&format!("{{method: {method}}}"));
        said(&text.replace("start: 1", "start: 1, min: 0"))
    };
    assert_snapshot!(bounded("lbfgs"), @"
    m.yaml:11:15: fit.method: this method does not support constraints
      found: `lbfgs` with `damping >= 0`
      expected: `gauss-newton` or `projected-gradient`
    ");
    assert_snapshot!(bounded("steepest-descent"), @"
    m.yaml:11:15: fit.method: this method does not support constraints
      found: `steepest-descent` with `damping >= 0`
      expected: `gauss-newton` or `projected-gradient`
    ");
    let listed = format!("{}fit: {{method: lbfgs}}\n", text("[{passive: true}]"));
    assert_snapshot!(said(&listed), @"
    m.yaml:12:15: fit.method: this method does not support constraints
      found: `lbfgs` with `passive: c >= m'/2`
      expected: `gauss-newton` or `projected-gradient`
    ");
}

#[test]
fn penalties_and_rules() {
    let with = |damping: &str| {
        let changed = text("").replace("start: 1", &format!("start: 1, {damping}"));
        changed.replace("constraints: \n", "")
    };
    let model = |damping: &str| read(&with(damping)).unwrap_or_else(|error| panic!("{error}"));
    let found = model(
        "penalty: [{kind: tikhonov, order: 0, weight: 2, reference: {data: c.csv, column: c}}, {kind: tikhonov, order: 1, weight: 3}]",
    );
    let [value, slope] = found.problem.penalties.as_slice() else {
        panic!("two penalties")
    };
    assert_eq!((value.function, value.order, value.weight), (1, 0, 2.0));
    assert_eq!((slope.function, slope.order, slope.weight), (1, 1, 3.0));
    // integral of (1 - 0.1 - 0.1 t^2)^2 from 0 to 2, up to the interpolation error of t^2.
    let roughness = value.roughness(&[1.0; 21]);
    assert!((roughness - 1.204).abs() < 5e-3, "{roughness}");
    let reference: Vec<f64> = (0..21)
        .map(|i| 0.1 + 0.1 * (0.1 * f64::from(i)).powi(2))
        .collect();
    assert!(value.roughness(&reference) < 1e-25);
    assert_eq!(found.weight_rule, None);

    let found = model(
        "penalty: [{kind: tikhonov, order: 1, weight: 2}, {kind: tikhonov, order: 2, weight: 1}, {kind: tv, weight: 0.5}]",
    );
    assert_eq!(found.problem.penalties[1].weight, 1.0);
    let [variation] = found.problem.variations.as_slice() else {
        panic!("one variation");
    };
    assert_eq!((variation.function, variation.weight), (1, 0.5));

    assert_snapshot!(said(&with("penalty: {kind: tikhonov, order: 2, weight: discrepancy}")), @"
    m.yaml:9:81: functions.damping.penalty.weight: the rule `discrepancy` needs the noise of the samples
      found: no `sigma` in experiments[0]
      expected: `sigma` in every experiment, or `reml` with `estimate`
    ");
    assert_snapshot!(said(&with("penalty: {kind: tikhonov, order: 2, weight: reml}")), @"
    m.yaml:9:81: functions.damping.penalty.weight: the rule `reml` needs a likelihood of the samples
      found: no `sigma` in experiments[0]
      expected: `sigma` in every experiment, a number or `estimate`
    ");
    let automatic = with("").replace("knots: 5", "knots: auto");
    assert_snapshot!(said(&automatic), @"
    m.yaml:8:42: functions.mass.knots: automatic knots need a likelihood of the samples
      found: no `sigma` in experiments[0]
      expected: `sigma` in every experiment, a number or `estimate`; or a number of knots
    ");
    assert_snapshot!(said(&with("penalty: {kind: tikhonov, order: 2, weight: gcv}")), @"
    m.yaml:9:81: functions.damping.penalty.weight: this choice was removed
      found: `gcv`
      expected: a finite number, or one of: discrepancy, reml, period, bic
      hint: `reml` chooses the weight by the likelihood of noise and smoothness, also with `sigma: {…: estimate}`; the fit page of `discrepancy` shows what L-curve and cross-validation would choose
    ");
}

/// The rule of total variation: one function with levels, one rule, a likelihood.
#[test]
fn jumps_by_bic() {
    let with = |damping: &str| {
        let changed = text("").replace("start: 1}", &format!("start: 1, {damping}}}"));
        let changed = changed.replace("constraints: \n", "");
        changed.replace(
            "    initial:",
            "    sigma: {displacement: 0.1}\n    initial:",
        )
    };
    let bic = "penalty: {kind: tv, weight: bic}";
    let found = read(&with(bic)).unwrap_or_else(|error| panic!("{error}"));
    let search = found.weight_rule.expect("a rule");
    assert_eq!((search.rule.name(), search.penalties), ("bic", vec![0]));
    assert_eq!(found.problem.variations[0].weight, 1.0);

    let without = with(bic).replace("    sigma: {displacement: 0.1}\n", "");
    assert_snapshot!(said(&without), @"
    m.yaml:9:65: functions.damping.penalty.weight: the rule `bic` needs a likelihood of the samples
      found: no `sigma` in experiments[0]
      expected: `sigma` in every experiment, a number or `estimate`; or a number for the weight
    ");
    assert_snapshot!(said(&with("penalty: {kind: tv, weight: bci}")), @"
    m.yaml:10:65: functions.damping.penalty.weight: unknown choice
      found: `bci`
      expected: a finite number, or one of: discrepancy, reml, period, bic
      hint: did you mean `bic`?
    ");
    assert_snapshot!(said(&with("penalty: {kind: tikhonov, order: 1, weight: bic}")), @"
    m.yaml:10:81: functions.damping.penalty.weight: the rule `bic` applies to total variation only
      found: `kind: tikhonov`
      expected: `kind: tv`, or `reml`, `discrepancy` or a number
    ");
    assert_snapshot!(said(&with("penalty: [{kind: tv, weight: bic}, {kind: tikhonov, order: 1, weight: 2}]")), @"
    m.yaml:10:66: functions.damping.penalty[0].weight: a function with the rule `bic` has no other penalty
      found: several penalties of the function
      expected: `{kind: tv, weight: bic}` alone
    ");
    let spline = with(bic).replace("{basis: nodal", "{basis: piecewise-linear, knots: 5");
    assert_snapshot!(said(&spline), @"
    m.yaml:10:86: functions.damping.penalty.weight: the rule `bic` needs a basis of levels
      found: `piecewise-linear`
      expected: `basis: piecewise-constant` or `basis: nodal`, or a number for the weight
    ");
    let mass = |penalty: &str| {
        let mass = format!("start: 2, penalty: {penalty}}}");
        said(
            &with(bic)
                .replace("start: 2}", &mass)
                .replace("basis: piecewise-linear", "basis: piecewise-constant"),
        )
    };
    assert_snapshot!(mass("{kind: tv, weight: bic}"), @"
    m.yaml:10:65: functions.damping.penalty.weight: the rule `bic` is the only rule of a model, for one function
      found: `bic` beside `bic`
      expected: one rule, and numbers for the other weights
    ");
    assert_snapshot!(mass("{kind: tikhonov, order: 1, weight: reml}"), @"
    m.yaml:10:65: functions.damping.penalty.weight: the rule `bic` is the only rule of a model, for one function
      found: `bic` beside `reml`
      expected: one rule, and numbers for the other weights
    ");
    assert_snapshot!(said(&format!("{}fit: {{method: equation-error}}\n", with(bic))), @"
    m.yaml:10:65: functions.damping.penalty.weight: the method `equation-error` has no search for the weight
      found: `bic`
      expected: a number, or `method: gauss-newton`
    ");
    assert_snapshot!(said(&format!("{}fit: {{method: lbfgs}}\n", with(bic))), @"
    m.yaml:12:15: fit.method: this method does not support total variation
      found: `lbfgs`
      expected: `gauss-newton`, which does
    ");
}

#[test]
fn contradictions_name_their_lines() {
    assert_snapshot!(message("
  - {function: mass, min: 1}
  - {function: damping, max: 3}
  - {function: mass, mean: 0.5}"), @"
    m.yaml:14:5: constraints[2]: these constraints contradict each other
      found: `mass >= 1` (line 12) and `mean of mass = 0.5` (line 14)
      expected: constraints that some functions satisfy together
      hint: removing any one of them resolves it
    ");
    assert_snapshot!(message("[{function: damping, at: [1, 1], value: [1, 2]}]"), @"
    m.yaml:11:43: constraints[0].at[1]: these constraints contradict each other
      found: `damping(1) = 1` (line 11) and `damping(1) = 2` (line 11)
      expected: constraints that some functions satisfy together
      hint: removing any one of them resolves it
    ");
    assert_snapshot!(message("[{function: damping, at: 1, value: 1}, {function: damping, at: 1.00000001, value: 2}]"), @"
    m.yaml:11:77: constraints[1].at: these constraints contradict each other
      found: `damping(1) = 1` (line 11) and `damping(1.00000001) = 2` (line 11)
      expected: constraints that some functions satisfy together
      hint: removing any one of them resolves it
    ");
    // Soft constraints contradict no other constraint.
    assert_snapshot!(message("[{function: damping, at: 1, value: 1}, {function: damping, at: 1, value: 2, soft: 1}]"), @"no error []");
}

#[test]
fn fixed_functions() {
    assert_snapshot!(message("[{function: stiffness, min: 0}]"), @"
    m.yaml:11:15: constraints[0]: stiffness is fixed, so it cannot be constrained
      found: a constraint on fixed functions only
      expected: `basis` and `start` instead of `fixed`, or no such constraint
    ");
    assert_snapshot!(message("[{function: stiffness, at: 0, value: 1}]"), @"
    m.yaml:11:41: constraints[0].at: stiffness is fixed, so it cannot be constrained
      found: a constraint on fixed functions only
      expected: `basis` and `start` instead of `fixed`, or no such constraint
    ");
    assert_snapshot!(message("[{function: stiffness, mean: 1}]"), @"
    m.yaml:11:15: constraints[0]: stiffness is fixed, so it cannot be constrained
      found: a constraint on fixed functions only
      expected: `basis` and `start` instead of `fixed`, or no such constraint
    ");
    let both = text("[{frequency: {max: 1}}]")
        .replace("basis: piecewise-linear, knots: 5, start: 2", "fixed: 2");
    assert_snapshot!(said(&both), @"
    m.yaml:11:15: constraints[0]: mass and stiffness are fixed, so they cannot be constrained
      found: a constraint on fixed functions only
      expected: `basis` and `start` instead of `fixed`, or no such constraint
    ");
    let rising = text("[{passive: true}]").replace("fixed: 1", "fixed: {data: c.csv, column: c}");
    assert_snapshot!(said(&rising), @"
    m.yaml:11:15: constraints[0]: no fit can satisfy this constraint
      found: fixed functions violate `passive: k' <= 0` at 0 s
      expected: functions with more freedom, or another constraint
    ");
}

#[test]
fn kinds() {
    assert_snapshot!(message("[]"), @"
    m.yaml:11:14: constraints: there is no constraint
      found: an empty list
      expected: at least one constraint, or no `constraints`
    ");
    assert_snapshot!(message("5"), @"
    m.yaml:11:14: constraints: wrong type of value
      found: the number 5
      expected: a list: lines that begin with `- `, or [ … ]
    ");
    assert_snapshot!(message("[{}]"), @"
    m.yaml:11:15: constraints[0]: empty constraint
      expected: one of: `min` or `max`, `slope`, `shape`, `at` and `value`, `mean`, `integral`, `equal`, `passive`, `frequency`, `damping_ratio`
    ");
    assert_snapshot!(message("[positive]"), @"
    m.yaml:11:15: constraints[0]: wrong type of value
      found: text `positive`
      expected: a map such as {function: mass, shape: non-increasing}
    ");
    assert_snapshot!(message("[{function: mass}]"), @"
    m.yaml:11:15: constraints[0]: empty constraint
      expected: one of: `min` or `max`, `slope`, `shape`, `at` and `value`, `mean`, `integral`, `equal`, `passive`, `frequency`, `damping_ratio`
    ");
    assert_snapshot!(message("[{function: mass, shape: convex, mean: 1}]"), @"
    m.yaml:11:15: constraints[0]: an entry of `constraints` is one constraint
      found: `shape` beside `mean`
      expected: one entry for each
    ");
    assert_snapshot!(message("[{min: 0}]"), @"
    m.yaml:11:15: constraints[0]: this constraint needs a function
      found: `min` or `max` alone
      expected: `function: mass`, `damping` or `stiffness`
    ");
    assert_snapshot!(message("[{function: mass, passive: true}]"), @"
    m.yaml:11:26: constraints[0].function: `passive` concerns mass, damping and stiffness: leave `function` out
      found: `function` beside `passive`
      expected: no `function`
    ");
    assert_snapshot!(message("[{function: mas, min: 0}]"), @"
    m.yaml:11:26: constraints[0].function: unknown choice
      found: `mas`
      expected: one of: mass, damping, stiffness, quadratic_stiffness, cubic_stiffness, quintic_stiffness, quadratic_damping, coulomb_friction, static_force, gap_stiffness
      hint: did you mean `mass`?
    ");
    assert_snapshot!(message("[{function: mass, minimum: 0}]"), @"
    m.yaml:11:32: constraints[0]: unknown key
      found: `minimum`
      expected: one of: function, min, max, slope, shape, at, value, mean, integral, equal, ratio, passive, frequency, damping_ratio, soft
      hint: did you mean `min`?
    ");
    assert_snapshot!(message("[{passive: false}]"), @"
    m.yaml:11:25: constraints[0].passive: this constraint has no effect
      found: false
      expected: `passive: true`, or no such constraint
    ");
    assert_snapshot!(message("[{passive: maybe}]"), @"
    m.yaml:11:25: constraints[0].passive: wrong type of value
      found: text `maybe`
      expected: true or false
    ");
}

#[test]
fn shapes_and_ranges() {
    assert_snapshot!(message("[{function: mass, shape: decreasing}]"), @"
    m.yaml:11:39: constraints[0].shape: unknown choice
      found: `decreasing`
      expected: one of: non-increasing, non-decreasing, convex, concave, or a list of them
      hint: did you mean `non-increasing`?
    ");
    assert_snapshot!(message("[{function: mass, shape: []}]"), @"
    m.yaml:11:39: constraints[0].shape: the list is empty
      found: an empty list
      expected: at least one shape
    ");
    assert_snapshot!(message("[{function: mass, shape: [convex, 5]}]"), @"
    m.yaml:11:48: constraints[0].shape[1]: not one of the choices
      found: the integer 5
      expected: one of: non-increasing, non-decreasing, convex, concave
    ");
    assert_snapshot!(message("[{function: mass, min: 2, max: 1}]"), @"
    m.yaml:11:37: constraints[0].min: min is greater than max
      found: min 2 kg and max 1 kg at 0 s
      expected: min at most max at all times
    ");
    assert_snapshot!(message("[{function: mass, min: 0.2, max: {data: c.csv, column: c}}]"), @"
    m.yaml:11:37: constraints[0].min: min is greater than max
      found: min 0.2 kg and max 0.1 kg at 0 s
      expected: min at most max at all times
    ");
    assert_snapshot!(message("[{function: mass, min: {data: c.csv, column: d}}]"), @"
    m.yaml:11:59: constraints[0].min.column: c.csv: there is no such column
      found: `d`
      expected: one of: t_s, c
    ");
    assert_snapshot!(message("[{function: mass, slope: {}}]"), @"
    m.yaml:11:39: constraints[0].slope: this range has no limit
      found: neither `min` nor `max`
      expected: one of the two, or both
    ");
    assert_snapshot!(message("[{function: mass, slope: {min: 1, max: 0}}]"), @"
    m.yaml:11:45: constraints[0].slope.min: min is greater than max
      found: min 1 and max 0
      expected: min at most max
    ");
    assert_snapshot!(message("[{function: mass, slope: 0.1}]"), @"
    m.yaml:11:39: constraints[0].slope: wrong type of value
      found: the number 0.1
      expected: a map such as {min: 0.1, max: 0.5}
    ");
    assert_snapshot!(message("[{frequency: {min: -1}}]"), @"
    m.yaml:11:33: constraints[0].frequency.min: this limit must be positive
      found: -1
      expected: a number greater than 0
    ");
    assert_snapshot!(message("[{frequency: {min: 2, max: 1}}]"), @"
    m.yaml:11:33: constraints[0].frequency.min: min is greater than max
      found: min 2 and max 1
      expected: min at most max
    ");
    assert_snapshot!(message("[{damping_ratio: {}}]"), @"
    m.yaml:11:31: constraints[0].damping_ratio: this range has no limit
      found: neither `min` nor `max`
      expected: `max`, as in {max: 0.2}
    ");
    assert_snapshot!(message("[{damping_ratio: {min: 0.1}}]"), @"
    m.yaml:11:37: constraints[0].damping_ratio.min: a lower bound on the damping ratio is not supported
      found: 0.1
      expected: `max` alone, because a lower bound is not a convex constraint
    ");
    assert_snapshot!(message("[{damping_ratio: {max: 0}}]"), @"
    m.yaml:11:37: constraints[0].damping_ratio.max: this limit must be positive
      found: 0
      expected: a number greater than 0
    ");
    assert_snapshot!(message("[{function: mass, min: 0, soft: 0}]"), @"
    m.yaml:11:46: constraints[0].soft: the weight of a soft constraint must be positive
      found: 0
      expected: a number greater than 0
    ");
    assert_snapshot!(message("[{damping_ratio: {max: 0.1}, soft: 1}]"), @"
    m.yaml:11:49: constraints[0].soft: a bound of the damping ratio cannot be soft
      found: `soft` beside `damping_ratio`
      expected: no `soft`
    ");
}

#[test]
fn values_at_times() {
    assert_snapshot!(message("[{function: mass, at: 0}]"), @"
    m.yaml:11:36: constraints[0].at: `at` requires `value`
      found: `at` alone
      expected: both, as in {function: stiffness, at: 0.0, value: 1.0}
    ");
    assert_snapshot!(message("[{function: mass, value: 1}]"), @"
    m.yaml:11:39: constraints[0].value: `value` requires `at`
      found: `value` alone
      expected: both, as in {function: stiffness, at: 0.0, value: 1.0}
    ");
    assert_snapshot!(message("[{function: mass, at: 3, value: 1}]"), @"
    m.yaml:11:36: constraints[0].at: this time lies outside the grid
      found: 3
      expected: a time from 0 s to 2 s
    ");
    assert_snapshot!(message("[{function: mass, at: [0, -1], value: 1}]"), @"
    m.yaml:11:40: constraints[0].at[1]: this time lies outside the grid
      found: -1
      expected: a time from 0 s to 2 s
    ");
    assert_snapshot!(message("[{function: mass, at: [], value: 1}]"), @"
    m.yaml:11:36: constraints[0].at: the list is empty
      found: an empty list
      expected: at least one time in s
    ");
    assert_snapshot!(message("[{function: mass, at: [0, 1], value: [1, 2, 3]}]"), @"
    m.yaml:11:51: constraints[0].value: the numbers of values and times differ
      found: 3 values, 2 times
      expected: as many values as times, or one for all
    ");
    assert_snapshot!(message("[{function: mass, at: early, value: 1}]"), @"
    m.yaml:11:36: constraints[0].at: not a number
      found: text `early`
      expected: a finite number, or a list of them
    ");
}

#[test]
fn equalities() {
    assert_snapshot!(message("[{equal: []}]"), @"
    m.yaml:11:23: constraints[0].equal: an equality needs two functions
      found: an empty list
      expected: two functions, as in [damping, stiffness]
    ");
    assert_snapshot!(message("[{equal: [mass]}]"), @"
    m.yaml:11:23: constraints[0].equal: an equality needs two functions
      found: 1 function
      expected: two functions, as in [damping, stiffness]
    ");
    assert_snapshot!(message("[{equal: [mass, mass]}]"), @"
    m.yaml:11:23: constraints[0].equal: the two functions are the same
      found: `mass` twice
      expected: two functions, as in [damping, stiffness]
    ");
    assert_snapshot!(message("[{equal: [mass, dampin]}]"), @"
    m.yaml:11:30: constraints[0].equal[1]: unknown choice
      found: `dampin`
      expected: one of: mass, damping, stiffness, quadratic_stiffness, cubic_stiffness, quintic_stiffness, quadratic_damping, coulomb_friction, static_force, gap_stiffness
      hint: did you mean `damping`?
    ");
    assert_snapshot!(message("[{equal: [mass, damping], ratio: 0}]"), @"
    m.yaml:11:47: constraints[0].ratio: a ratio must not be 0
      found: 0
      expected: a number other than 0; for a function that is zero, `max: 0` and `min: 0`
    ");
    assert_snapshot!(message("[{function: mass, mean: 1, ratio: 2}]"), @"
    m.yaml:11:48: constraints[0].ratio: only `equal` has a ratio
      found: `ratio` beside `mean`
      expected: no `ratio`
    ");
}

#[test]
fn constraints_without_information_are_reported() {
    let free = |constraints: &str| {
        let free = text(constraints).replace("{fixed: 1}", "{basis: nodal, start: 1}");
        let model = read(&free).unwrap_or_else(|error| panic!("{error}"));
        Finding::texts(&model.warnings)
    };
    let nothing = free("[{function: stiffness, shape: non-increasing}]");
    assert_snapshot!(nothing.join("\n"), @"constraints[0].shape: a monotone stiffness carries no information here. Without a force the response determines only k/m and c/m: a factor s(t) of all three functions is undetermined; fix a function, bound the functions on both sides, or add a penalty");
    assert_eq!(free("[{passive: true}]").len(), 1);
    assert_eq!(
        free("[{function: mass, min: 1, max: 3}, {passive: true}]"),
        [""; 0]
    );
    let fixed = read(&text("[{passive: true}]")).unwrap();
    assert!(fixed.warnings.is_empty(), "{:?}", fixed.warnings);
}

#[test]
fn constraints_that_always_hold_are_reported() {
    let constant =
        text("[{function: damping, shape: convex}]").replace("basis: nodal", "basis: constant");
    assert_snapshot!(said(&constant), @r#"no error ["constraints[0].shape has no effect: it holds for all functions"]"#);
}

#[test]
fn constraints_must_permit_a_positive_mass() {
    for held in [
        "max: 0.0",
        "at: 1.0, value: 0.0",
        "mean: -1.0",
        "integral: -2.0",
    ] {
        let said = message(&format!("[{{function: mass, {held}}}]"));
        assert!(
            said.contains("this bound excludes a positive mass"),
            "{held}: {said}"
        );
    }
    assert!(message("[{function: damping, max: -1.0}]").starts_with("no error"));
}

#[test]
fn a_shape_by_half_its_name_is_not_taken_for_the_opposite() {
    let said = message("[{function: mass, shape: decreasing}]");
    assert!(said.contains("did you mean `non-increasing`?"), "{said}");
}
