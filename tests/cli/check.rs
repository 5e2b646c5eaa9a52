//! `kmcfit check`: the overview of a model.

use crate::workbench::{MODEL, Workbench};
use insta::assert_snapshot;

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
fn a_model_with_fixed_functions_is_said_to_have_no_parameters() {
    let bench = Workbench::with_small_model();
    let model = MODEL.replace("basis: nodal, start", "fixed");
    bench.write(
        "model.yaml",
        &model.replace("basis: constant, start", "fixed"),
    );
    let (code, stdout, stderr) = bench.run(&["check", "model.yaml"]);
    assert_eq!(code, 0);
    assert!(stdout.contains("0 parameters"), "{stdout}");
    assert_eq!(
        stderr,
        "warning: every function is fixed: there are no parameters to estimate\n"
    );
}
