//! Keys for faulty records: repeated times, excluded samples, delays, quantisation; what `check`, the summary and `result.json` state about
//! them, and invalid values.

use crate::corruptions::{Good, MODEL, table};
use crate::workbench::{Workbench, sample_table};
use insta::assert_snapshot;
use serde_json::Value;

/// A folder with a good record and a model with a key.
fn bench(rows: &[[f64; 3]], key: &str) -> Workbench {
    let bench = Workbench::empty();
    bench.write("record.csv", &table(rows));
    bench.write("model.yaml", &MODEL.replace("#key", key));
    bench
}

fn document(bench: &Workbench, run: &str) -> Value {
    serde_json::from_str(&bench.read(&format!("{run}/result.json"))).expect("JSON")
}

/// The message about a model with a key.
fn refused(key: &str) -> String {
    let bench = bench(&Good::new(0).rows(0.0, 0.0), key);
    let (code, stdout, stderr) = bench.run(&["check", "model.yaml"]);
    assert_eq!(code, 2, "{key}\n{stdout}{stderr}");
    stderr
}

#[test]
fn invalid_keys_of_faulty_records() {
    assert_snapshot!(refused("duplicates: fist"));
    assert_snapshot!(refused("exclude: [dropouts, spike]"));
    assert_snapshot!(refused("sensors: {displacement: {delay: estimat}}"));
    assert_snapshot!(refused(
        "sensors: {displacement: {delay: {min: 0.1, max: -0.1}}}"
    ));
    assert_snapshot!(refused(
        "sensors: {displacement: {delay: {min: -30.0, max: 30.0}}}"
    ));
    assert_snapshot!(refused("sensors: {base_acceleration: {delay: estimate}}"));
    assert_snapshot!(refused("sensors: {force: {gain: 2.0}}"));
    assert_snapshot!(refused(
        "sensors: {displacement: {delay: estimate}, force: {delay: estimate}}"
    ));
}

/// A delay beside a force and a motion of the base could be that of either.
#[test]
fn a_delay_of_one_of_two_inputs_is_refused() {
    let bench = bench(
        &Good::new(0).rows(0.0, 0.0),
        "sensors: {force: {delay: estimate}}",
    );
    let model = bench.read("model.yaml");
    let record = bench.read("record.csv");
    let wider = record.lines().enumerate().map(|(i, line)| match i {
        0 => format!("{line},b_m_per_s2\n"),
        _ => format!("{line},{}\n", i % 7),
    });
    bench.write("record.csv", &wider.collect::<String>());
    let both = model.replace("force: F_N", "force: F_N, base_acceleration: b_m_per_s2");
    assert_ne!(both, model);
    bench.write("model.yaml", &both);
    let (code, _, stderr) = bench.run(&["check", "model.yaml"]);
    assert_eq!(code, 2);
    assert_snapshot!(stderr);
}

/// Every other line of 21 is repeated with another value: `init` writes a model that reads it, and the file without the key is refused.
#[test]
fn repeated_times_are_merged_by_a_setting() {
    let bench = Workbench::empty();
    let text = sample_table(21);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines.insert(
        6,
        format!("{},0.123", lines[5].split(',').next().expect("a time")),
    );
    lines.insert(9, lines[8].clone());
    bench.write("samples.csv", &(lines.join("\n") + "\n"));
    bench.run_to(0, &["init", "samples.csv"]);
    let model = bench.read("samples.yaml");
    assert!(model.contains("    duplicates: first"), "{model}");
    assert!(
        model.contains("times are repeated in lines 7, 10"),
        "{model}"
    );
    let shown = bench.run_to(0, &["check", "samples.yaml"]);
    assert!(
        shown.contains("2 rows repeat a time (lines 7, 10): the first row of each time is used"),
        "{shown}"
    );
    assert!(shown.contains("21 samples of the displacement"), "{shown}");
    bench.write(
        "samples.yaml",
        &model.replace("duplicates: first", "duplicates: error"),
    );
    let (code, _, stderr) = bench.run(&["check", "samples.yaml"]);
    assert_eq!(code, 2);
    assert_snapshot!(stderr);
}

/// Samples held for 20 samples and two spikes: named, left out by the key, and stated in `check`, in the summary and in `result.json`.
#[test]
fn excluded_samples_are_stated_everywhere() {
    let good = Good::new(1);
    let mut rows = good.rows(0.0, 0.0);
    let held = rows[149][2];
    rows[150..170].iter_mut().for_each(|row| row[2] = held);
    for at in [60, 300] {
        rows[at][2] += 60.0 * good.sigma;
    }
    let named = bench(&rows, "# none");
    named.run(&["fit", "model.yaml", "--out", "run", "--no-report"]);
    let before = document(&named, "run");
    assert_ne!(before["verdict"]["level"], "adequate");
    let kinds = |document: &Value, list: &str| -> Vec<String> {
        let each = document[list].as_array().into_iter().flatten();
        each.map(|f| f["kind"].as_str().expect("a kind").to_owned())
            .collect()
    };
    assert_eq!(kinds(&before, "warnings"), ["dropouts", "spikes"]);
    let bench = bench(&rows, "exclude: [dropouts, spikes]");
    let shown = bench.run_to(0, &["check", "model.yaml"]);
    for line in [
        "377 samples of the displacement in m",
        "21 samples of the displacement not used: dropouts",
        "2 samples of the displacement not used: spikes",
        "held at a constant value, 7.45 to 8.45 s: left out",
        "2 spikes in the displacement, at 3, 15 s: left out",
    ] {
        assert!(shown.contains(line), "{line}\n{shown}");
    }
    let summary = bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    assert!(summary.contains("left out"), "{summary}");
    let page = bench.read("run/report.html");
    assert!(page.contains(">Data</h2>") && page.contains("2 spikes in the displacement"));
    let after = document(&bench, "run");
    assert_eq!(after["verdict"]["level"], "adequate");
    assert_eq!(kinds(&after, "data"), ["dropouts", "spikes"]);
    assert_eq!(after["data"][0]["action"], "excluded");
    assert_eq!(
        after["data"][0]["places"][0],
        serde_json::json!([7.45, 8.45])
    );
    assert_eq!(after["data"][1]["count"], 2);
}
