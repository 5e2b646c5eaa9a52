//! Known parts of functions and known values with a standard deviation in a model file.

use crate::workbench::Workbench;
use insta::assert_snapshot;
use serde_json::Value;

/// A forced record of a carriage of 2 kg with a block of 1.5 kg, damping 1 N s/m and stiffness 80 N/m, by exact steps of the force.
fn model(functions: &str, own: &str) -> Workbench {
    let bench = Workbench::empty();
    let (mass, damping, stiffness) = (3.5, 1.0, 80.0);
    let mut rows = String::from("t_s,f_N,y_m\n");
    let (mut y, mut v, step) = (0.0f64, 0.0f64, 0.02);
    let noise = |i: u32| 1e-4 * (f64::from((i * i * 7919) % 1009) - 504.0) / 291.0;
    for i in 0..500u32 {
        let t = step * f64::from(i);
        let force = |t: f64| 5.0 * (3.0 * t).sin() + 4.0 * (7.0 * t).cos();
        rows += &format!("{t:.2},{:.6},{:.8}\n", force(t), y + noise(i));
        // Runge and Kutta with a tenth of the step: the error is below 1e-9 of the amplitude.
        for s in 0..10 {
            let h = step / 10.0;
            let at = t + h * f64::from(s);
            let a = |t: f64, y: f64, v: f64| (force(t) - damping * v - stiffness * y) / mass;
            let k1 = [v, a(at, y, v)];
            let k2 = [
                v + 0.5 * h * k1[1],
                a(at + 0.5 * h, y + 0.5 * h * k1[0], v + 0.5 * h * k1[1]),
            ];
            let k3 = [
                v + 0.5 * h * k2[1],
                a(at + 0.5 * h, y + 0.5 * h * k2[0], v + 0.5 * h * k2[1]),
            ];
            let k4 = [v + h * k3[1], a(at + h, y + h * k3[0], v + h * k3[1])];
            y += h / 6.0 * (k1[0] + 2.0 * k2[0] + 2.0 * k3[0] + k4[0]);
            v += h / 6.0 * (k1[1] + 2.0 * k2[1] + 2.0 * k3[1] + k4[1]);
        }
    }
    bench.write("carriage.csv", &rows);
    bench.write(
        "carriage.yaml",
        &format!(
            "format: 1\ntitle: Carriage\nexperiments:\n  - name: block\n    data: carriage.csv\n    \
             columns: {{time: t_s, displacement: y_m, force: f_N}}\n    sigma: {{displacement: 1.0e-4}}\n    \
             initial: {{displacement: 0.0, velocity: 0.0}}\n{own}functions:\n{functions}  \
             damping: {{basis: constant, start: 0.5}}\n  stiffness: {{basis: constant, start: 100.0}}\n"
        ),
    );
    bench
}

fn document(bench: &Workbench) -> Value {
    serde_json::from_str(&bench.read("out/result.json")).expect("a document")
}

const UNKNOWN: &str = "  mass: {basis: constant, start: 1.0}\n";

fn refused(functions: &str, own: &str) -> String {
    let bench = model(functions, own);
    let (code, _, stderr) = bench.run(&["fit", "carriage.yaml", "--out", "out"]);
    assert_eq!(code, 2, "{stderr}");
    stderr
}

/// The unknown mass of the carriage with a weighed block, stated for all experiments and for one.
#[test]
fn a_known_part_is_added_to_the_estimated_mass() {
    let shared = "  mass: {basis: constant, start: 1.0, known_part: {value: 1.5, sigma: 0.01}}\n";
    let own = "    functions: {mass: {known_part: {value: 1.5, sigma: 0.01}}}\n";
    for (functions, own) in [(shared, ""), (UNKNOWN, own)] {
        let bench = model(functions, own);
        let (code, stdout, stderr) = bench.run(&["fit", "carriage.yaml", "--out", "out"]);
        assert_eq!(code, 0, "{stderr}");
        let found = document(&bench);
        let mass = &found["functions"]["mass"];
        let error = mass["standard_error"].as_f64().expect("a standard error");
        // The samples determine the sum far better than the scale the block.
        assert!((error - 0.01).abs() < 5e-4, "{error}\n{stdout}");
        let value = mass["min"].as_f64().expect("a mass");
        assert!((value - 2.0).abs() < 2.0 * error, "{value}");
        let table = bench.read("out/functions.csv");
        assert!(table.starts_with("t_s,mass_kg,"), "{}", &table[..200]);
        assert!(table.contains("known_part_of_mass_kg"), "{}", &table[..200]);
    }
}

#[test]
fn a_known_value_with_a_standard_deviation_is_no_number() {
    let bench = model("  mass: {fixed: {value: 3.5, sigma: 0.07}}\n", "");
    let (code, stdout, stderr) = bench.run(&["fit", "carriage.yaml", "--out", "out"]);
    assert_eq!(code, 0, "{stdout}{stderr}");
    let found = document(&bench);
    let cost = found["model"]["cost_definition"]
        .as_str()
        .unwrap_or_default();
    assert!(cost.ends_with(" + ((mass - 3.5)/0.07)^2"), "{cost}");
}

#[test]
fn messages() {
    let mut all = Vec::new();
    let mass = |text: &str| format!("  mass: {text}\n");
    for functions in [
        "{fixed: {value: 3.5}}",
        "{fixed: {value: 3.5, sigma: -0.1}}",
        "{fixed: {value: 3.5, sgma: 0.1}}",
        "{fixed: {}}",
        "{fixed: -1.0, known_part: 1.0}",
        "{fixed: 3.5, known_part: 1.0}",
        "{known_part: 1.0}",
        "{basis: constant, start: 1.0, known_part: -1.5}",
        "{basis: constant, start: 1.0, known_part: heavy}",
        "{basis: constant, start: 1.0, known_part: {value: 1.0, sigma: 0.1, data: a.csv}}",
        "{basis: constant, start: 1.0, known_prt: 1.0}",
    ] {
        all.push(refused(&mass(functions), ""));
    }
    all.push(refused(
        UNKNOWN,
        "    functions: {cubic_stiffness: {known_part: 1.0}}\n",
    ));
    all.push(refused(
        UNKNOWN,
        "    functions: {mass: {known_part: 1.0, min: 0.0}}\n",
    ));
    let known = "  mass: {basis: constant, start: 1.0, known_part: 1.0}\n";
    let with = |ending: &str| {
        let bench = model(known, "");
        let text = bench.read("carriage.yaml");
        bench.write("carriage.yaml", &(text + ending));
        let (code, _, stderr) = bench.run(&["fit", "carriage.yaml", "--out", "out"]);
        assert_eq!(code, 2, "{stderr}");
        stderr
    };
    all.push(with("constraints: [{damping_ratio: {max: 1.0}}]\n"));
    let unsure = known.replace("1.0}\n", "{value: 1.0, sigma: 0.1}}\n");
    let bench = model(&unsure, "");
    let text = bench.read("carriage.yaml");
    bench.write(
        "carriage.yaml",
        &(text.clone() + "fit: {method: equation-error}\n"),
    );
    all.push(bench.run(&["fit", "carriage.yaml", "--out", "out"]).2);
    bench.write(
        "carriage.yaml",
        &text.replace("    sigma: {displacement: 1.0e-4}\n", ""),
    );
    all.push(bench.run(&["fit", "carriage.yaml", "--out", "out"]).2);
    assert_snapshot!(all.join("\n"));
}
