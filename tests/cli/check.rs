//! `kmcfit check`: validation, and gradients against finite differences.

use crate::workbench::{MODEL, Workbench};
use insta::assert_snapshot;

/// On coarse grids the error of the continuous gradient has a floor, which is not a failure: the exit code depends on the
/// discrete gradient.
#[test]
fn discrete_gradient_passes_where_the_continuous_one_has_a_floor() {
    let bench = Workbench::with_shipped_models();
    let check = [
        "check",
        "models/paper.yaml",
        "--gradient",
        "--nodes",
        "1000,2000",
    ];
    let stdout = bench.run_to(0, &check);
    assert!(
        stdout.ends_with("the discrete gradient is exact: smallest relative error below 1e-6\n")
    );
    assert_eq!(stdout.matches("discrete  ").count(), 2, "{stdout}");
    assert_eq!(stdout.matches("continuous  ").count(), 2, "{stdout}");
}

#[test]
fn the_overview_writes_nothing() {
    let bench = Workbench::with_small_model();
    let before = bench.contents();
    let stdout = bench.run_to(0, &["check", "model.yaml"]);
    assert_snapshot!(stdout, @"
    free decay: 21 samples of the displacement in m (UTF-8; separated by commas; decimal point; column names in line 1)
    free decay: one every 0.1 s (10 Hz) from 0 to 2 s; dominant frequency 0.6103 Hz, 1.2 periods; standard deviation 0.438 m
    Small: 21 nodes over 2 s (midpoint), 43 parameters, lbfgs
    start values: mass 2 kg, damping 1 N s/m, stiffness 1 N/m; natural frequency 0.1125 Hz, damping ratio 0.3536
    no force is measured: (m, c, k) are determined only up to a common constant factor; fix a function, constrain a value or mean, or add a record with a measured force
    undetermined: scale of (m, c, k)
    Check      at the start values the samples determine 20 of 43 parameter combinations
    ");
    assert_eq!(bench.contents(), before);
}

#[test]
fn a_model_with_fixed_functions_has_no_gradient() {
    let bench = Workbench::with_small_model();
    let model = MODEL.replace("basis: nodal, start", "fixed");
    bench.write(
        "model.yaml",
        &model.replace("basis: constant, start", "fixed"),
    );
    let (code, stdout, stderr) = bench.run(&["check", "model.yaml", "--gradient"]);
    assert_eq!(code, 0);
    assert!(stdout.contains("0 parameters"), "{stdout}");
    assert_eq!(
        stderr,
        "warning: every function is fixed: there are no parameters to estimate\n"
    );
}

/// The steps of the differences scale with the cost: a chi-square of a million is checked as accurately as an integral of
/// a hundred.
#[test]
fn steps_follow_the_size_of_the_cost() {
    let bench = Workbench::with_shipped_models();
    let model = bench.read("models/paper-lbfgs.yaml");
    let sigma = |sigma: &str| format!("    sigma: {{displacement: {sigma}}}\n    initial:");
    for value in ["1e-4", "0.1", "1e4"] {
        let spoilt = model.replace("    initial:", &sigma(value));
        bench.write("models/sigma.yaml", &spoilt);
        let stdout = bench.run_to(0, &["check", "models/sigma.yaml", "--gradient"]);
        assert!(stdout.contains("exact"), "{value}: {stdout}");
    }
}
