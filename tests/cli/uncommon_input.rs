//! Messages about rare mistakes in models, tables and arguments: exit code 2, one message each, no file written.

use crate::workbench::{MODEL, Workbench};
use insta::assert_snapshot;

/// The message of a command that is refused.
fn refused(bench: &Workbench, arguments: &[&str]) -> String {
    let before = bench.contents();
    let (code, stdout, stderr) = bench.run(arguments);
    assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}\n{stderr}");
    assert_eq!(bench.contents(), before, "{arguments:?} wrote a file");
    stderr
}

/// The message about the small model with some texts replaced.
fn changed(command: &str, changes: &[(&str, &str)]) -> String {
    let bench = Workbench::with_small_model();
    let mut model = MODEL.to_owned();
    for (from, to) in changes {
        assert!(model.contains(from), "{from}");
        model = model.replacen(from, to, 1);
    }
    bench.write("model.yaml", &model);
    refused(&bench, &[command, "model.yaml"])
}

const STIFFNESS: &str = "stiffness: {basis: nodal, start: 1.0}";

#[test]
fn own_functions() {
    let second = "  - name: second\n    data: samples.csv\n    columns: {time: t_s, displacement: y_m}\n    initial: {displacement: 1.0, velocity: 0.0}\n    functions: {damping: {basis: constant, start: 1.0}}\ngrid: {nodes: 21";
    let own = "    functions: {damping: {basis: constant, start: 1.0}}\n    initial:";
    let all = [
        changed(
            "fit",
            &[("    initial:", own), ("grid: {nodes: 21", second)],
        ),
        changed(
            "fit",
            &[(
                "    initial:",
                "    functions: {coulomb_friction: {basis: constant, start: 1.0, width: 0.1}}\n    initial:",
            )],
        ),
    ];
    assert_snapshot!(all.join("\n"));
}

#[test]
fn roles_of_experiments() {
    let second = |keys: &str| {
        format!(
            "  - name: second\n    data: samples.csv\n    columns: {{time: t_s, displacement: y_m}}\n    \
             initial: {{displacement: 1.0, velocity: 0.0}}\n    {keys}\ngrid: {{nodes: 21"
        )
    };
    let own = "functions: {damping: {basis: constant, start: 1.0}}\n    validation: true";
    let friction = "functions: {coulomb_friction: {basis: constant, start: 0.2, width: 0.2}}";
    let shared =
        format!("{STIFFNESS}\n  coulomb_friction: {{basis: constant, start: 0.1, width: 0.1}}");
    let sensor = "    sensors: {displacement: {gain: estimate}}\n    initial:";
    let method = (
        "method: lbfgs\n  gradient: discrete\n  stop: {iterations: 5}",
        "method: equation-error",
    );
    let all = [
        changed("fit", &[("grid: {nodes: 21", &second(own))]),
        changed(
            "fit",
            &[
                ("grid: {nodes: 21", &second(friction)),
                (STIFFNESS, &shared),
            ],
        ),
        changed("fit", &[("    initial:", sensor), method]),
    ];
    assert_snapshot!(all.join("\n"));
}

#[test]
fn autoregressive_noise_of_irregular_samples_is_refused() {
    let bench = Workbench::with_shipped_models();
    let noise = "experiments.0.noise={displacement: {ar: 2}}";
    let arguments = ["fit", "models/camera.yaml", "--set", noise];
    assert_snapshot!(refused(&bench, &arguments));
}
