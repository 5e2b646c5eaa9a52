//! Messages about rare mistakes in models, tables and arguments: exit code 2, one message each, no file written. The list
//! of all messages (`tests/snapshots/kmcfit__messages__messages.snap`) takes them from here.

use crate::workbench::{MODEL, Workbench, sample_table};
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

const DATA: &str = "    data: samples.csv\n";
const COLUMNS: &str = "    columns: {time: t_s, displacement: y_m}\n";
const DAMPING: &str = "{basis: constant, start: 1.0}";
const STIFFNESS: &str = "stiffness: {basis: nodal, start: 1.0}";

#[test]
fn models() {
    let second = "grid: {nodes: 21, method: midpoint}";
    let with = |line: &str| format!("{COLUMNS}    {line}\n");
    let all = [
        changed(
            "fit",
            &[(
                DAMPING,
                "{basis: nodal, start: 1.0, penalty: {kind: tikhonov, weight: 1.0}}",
            )],
        ),
        changed(
            "fit",
            &[(
                DAMPING,
                "{basis: nodal, start: 1.0, penalty: {kind: tv, weight: 1.0, order: 1}}",
            )],
        ),
        changed(
            "fit",
            &[(
                DAMPING,
                "{basis: nodal, start: 1.0, penalty: {kind: tikhonov, order: 3, weight: 1.0}}",
            )],
        ),
        changed(
            "fit",
            &[(
                DAMPING,
                "{basis: nodal, start: 1.0, penalty: {kind: tikhonov, order: 1, weight: 1.0, reference: 0.5}}",
            )],
        ),
        changed(
            "fit",
            &[(
                STIFFNESS,
                "stiffness: {basis: nodal, start: 1.0}\n  coulomb_friction: {basis: constant, start: 0.1, width: 0}",
            )],
        ),
        changed(
            "fit",
            &[(DAMPING, "{basis: constant, start: 1.0, width: auto}")],
        ),
        changed(
            "fit",
            &[(
                STIFFNESS,
                "stiffness: {basis: nodal, start: 1.0}\n  coulomb_friction: {basis: constant, start: 0.1, width: atuo}",
            )],
        ),
        changed(
            "simulate",
            &[
                (DATA, ""),
                (COLUMNS, ""),
                ("method: midpoint", "method: midpoint, duration: 2.0"),
                (
                    STIFFNESS,
                    "stiffness: {basis: nodal, start: 1.0}\n  coulomb_friction: {fixed: 0.1, width: auto}",
                ),
            ],
        ),
        changed(
            "fit",
            &[(
                STIFFNESS,
                "stiffness: {basis: nodal, start: 1.0}\n  quintic: {fixed: 0.1}",
            )],
        ),
        changed("fit", &[("method: lbfgs", "method: lbfgs\n  qp: clarabel")]),
        changed(
            "fit",
            &[
                ("method: lbfgs", "method: steepest-descent"),
                (
                    "fit:\n",
                    "constraints:\n  - {function: damping, min: 0.0}\nfit:\n",
                ),
            ],
        ),
        changed(
            "fit",
            &[(
                COLUMNS,
                &with("loss: {displacement: {name: huber, threshold: 0}}"),
            )],
        ),
        changed("fit", &[(COLUMNS, &with("loss: {displacement: huber}"))]),
        changed("fit", &[(COLUMNS, &with("noise: {displacement: {ar: 2}}"))]),
        changed(
            "fit",
            &[(COLUMNS, &with("noise: {displacement: {ar: 13}}"))],
        ),
        changed("fit", &[(COLUMNS, &with("noise: {displacement: whit}"))]),
        changed(
            "fit",
            &[(
                COLUMNS,
                &with("force: {shape: constant, amplitude: 1.0, interpolation: linear}"),
            )],
        ),
        changed(
            "fit",
            &[(
                COLUMNS,
                "    columns: {time: t_s, displacement: y_m, base_displacement: y_m}\n    base: {interpolation: linear}\n",
            )],
        ),
        changed(
            "fit",
            &[(COLUMNS, &with("sensors: {displacement: {absolute: true}}"))],
        ),
        changed(
            "study",
            &[(
                "fit:\n",
                "study: {profiles: [{function: cubic_stiffness, at: 0.5}]}\nfit:\n",
            )],
        ),
        changed(
            "study",
            &[(
                "method: lbfgs\n  gradient: discrete\n  stop: {iterations: 5}",
                "method: equation-error",
            )],
        ),
        changed(
            "study",
            &[
                ("{basis: nodal, start: 2.0}", "{fixed: 2.0}"),
                (DAMPING, "{fixed: 1.0}"),
                ("{basis: nodal, start: 1.0}", "{fixed: 1.0}"),
            ],
        ),
        changed(
            "simulate",
            &[(
                "{displacement: 1.0, velocity: 0.0}",
                "{displacement: 1.0, velocity: estimate}",
            )],
        ),
        changed(
            "simulate",
            &[(DATA, ""), (COLUMNS, ""), (second, "grid: {duration: 2.0}")],
        ),
        changed(
            "simulate",
            &[
                (DATA, ""),
                (COLUMNS, ""),
                (second, "grid: {nodes: 21, duration: 1e-323}"),
            ],
        ),
        changed(
            "fit",
            &[
                (second, "grid: {nodes: 21, method: midpoint}"),
                (
                    "fit:\n",
                    "constraints:\n  - {function: mass, max: -1.0}\nfit:\n",
                ),
                (
                    "method: lbfgs\n  gradient: discrete\n",
                    "method: gauss-newton\n",
                ),
            ],
        ),
        changed(
            "fit",
            &[(
                "  - name: free decay",
                "  - name: free decay\n    validation: true\n    functions: {mass: {fixed: 1.0}}",
            )],
        ),
        changed(
            "fit",
            &[(
                second,
                "  - name: free decay\n    data: samples.csv\n    columns: {time: t_s, displacement: y_m}\n    initial: {displacement: 1.0, velocity: 0.0}\ngrid: {nodes: 21}",
            )],
        ),
    ];
    assert_snapshot!(all.join("\n"));
}

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
        changed(
            "fit",
            &[
                (
                    "grid: {nodes: 21",
                    &second(&friction.replace("0.2}}", "auto}}")),
                ),
                (STIFFNESS, &shared),
            ],
        ),
        changed("fit", &[("    initial:", sensor), method]),
    ];
    assert_snapshot!(all.join("\n"));
}

#[test]
fn tables() {
    let bench = Workbench::with_small_model();
    let with = |name: &str, text: &str, model: &str| {
        bench.write(name, text);
        bench.write("model.yaml", model);
        refused(&bench, &["fit", "model.yaml"])
    };
    let uneven = sample_table(21).replace("\n0.1,", "\n0.13,");
    let row = |(i, line): (usize, &str)| match i {
        6 => "0.5,
"
        .to_owned(),
        _ => format!(
            "{line}
"
        ),
    };
    let gap: String = sample_table(21).lines().enumerate().map(row).collect();
    let line = |key: &str| MODEL.replacen(COLUMNS, &format!("{COLUMNS}    {key}\n"), 1);
    let wide = format!(
        "{}\n{}\n",
        vec!["a"; 10_001].join(","),
        vec!["1"; 10_001].join(",")
    );
    let minutes = "t_s [min],c\n0,1\n2,1\n".to_owned();
    bench.write("minutes.csv", &minutes);
    let column = MODEL.replacen("start: 2.0", "start: {data: minutes.csv, column: c}", 1);
    let all = [
        with("samples.csv", &uneven, &line("decimate: 2")),
        with("samples.csv", &uneven, &line("band: {max: 2.0}")),
        with("samples.csv", &gap, &line("band: {max: 2.0}")),
        with("samples.csv", &wide, MODEL),
        with("samples.csv", &sample_table(21), &column),
    ];
    assert_snapshot!(all.join("\n"));
}

#[test]
fn aliases_and_lists() {
    let bench = Workbench::with_small_model();
    let with = |text: &str| {
        bench.write("model.yaml", text);
        refused(&bench, &["fit", "model.yaml"])
    };
    let nested: String = (1..12)
        .map(|i| {
            format!(
                "a{i}: &a{i} [{}]\n",
                vec![format!("*a{}", i - 1); 9].join(", ")
            )
        })
        .collect();
    let element = "  - {initial: {displacement: 1.0, velocity: 0.0}}\n";
    let many = format!(
        "format: 1\nexperiments:\n{}{}",
        element.repeat(2001),
        &MODEL[MODEL.find("functions:").expect("functions")..]
    );
    let all = [
        with(&format!("{MODEL}a0: &a0 [1, 1]\n{nested}")),
        with(&format!("a: &a 1\nb: [{}]\n", vec!["*a"; 1001].join(", "))),
        with(&many),
    ];
    assert_snapshot!(all.join("\n"));
}

#[test]
fn arguments() {
    let bench = Workbench::with_small_model();
    let temperature = |i: u32| format!("{i},{}\n", 20 + i * i % 7);
    let rows: String = (0..20).map(temperature).collect();
    bench.write("words.csv", &format!("time_s,force_N\n{rows}"));
    bench.write("sequence.yaml", "format: 1\nsequence: [model.yaml]\n");
    let mut all = vec![
        refused(&bench, &["fit", "model.yaml", "--checkpoint", "-1"]),
        refused(
            &bench,
            &["study", "sequence.yaml", "--set", "fit.stop.iterations=5"],
        ),
        refused(&bench, &["simulate", "model.yaml", "--out", "model.yaml"]),
        refused(&bench, &["simulate", "model.yaml", "--out", "words.csv"]),
        refused(&bench, &["init", "words.csv", "--out", "new.yaml"]),
    ];
    bench.write("empty.yaml", "format: 1\nsequence: []\n");
    all.push(refused(&bench, &["study", "empty.yaml"]));
    let mut command = bench.command(&["fit", "model.yaml"]);
    let output = command
        .env("KMCFIT_ARITHMETIC", "AVX")
        .output()
        .expect("the program runs");
    all.push(String::from_utf8(output.stderr).expect("UTF-8"));
    bench.write("file", "mine\n");
    all.push(refused(&bench, &["fit", "model.yaml", "--out", "file"]));
    bench.write("run/result.json", "mine\n");
    all.push(refused(&bench, &["fit", "model.yaml", "--out", "run"]));
    bench.write(
        "plan.yaml",
        &MODEL.replace("fit:\n", "study: {starts: 2}\nfit:\n"),
    );
    bench.write("broken/result.json", "{\"format\": 1}\n");
    all.push(refused(&bench, &["compare", "broken", "model.yaml"]));
    bench.write("text/result.json", "no JSON\n");
    all.push(refused(&bench, &["compare", "text", "model.yaml"]));
    assert_snapshot!(all.join("\n"));
}

#[test]
fn autoregressive_noise_of_irregular_samples_is_refused() {
    let bench = Workbench::with_shipped_models();
    let noise = "experiments.0.noise={displacement: {ar: 2}}";
    let arguments = ["fit", "models/camera.yaml", "--set", noise];
    assert_snapshot!(refused(&bench, &arguments));
}
