//! `kmcfit fleet`: one model on many records.

use crate::program::program;
use crate::workbench::Workbench;
use insta::assert_snapshot;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Stdio};
use std::time::Instant;

/// A free decay of known mass.
const MODEL: &str = "\
format: 1
title: Decays
experiments:
  - data: records/r01.csv
    sigma: {displacement: estimate}
    initial: estimate
functions:
  mass:      {fixed: 1.0}
  damping:   {basis: constant, start: 0.1}
  stiffness: {basis: piecewise-linear, knots: 2, start: 4.0}
";

/// Samples of a decay with an angular frequency, with uniform noise of a linear congruential generator.
fn record(frequency: f64) -> String {
    let mut text = String::from("t_s,y_m\n");
    let mut state = frequency.to_bits();
    for i in 0..101 {
        let t = 0.1 * f64::from(i);
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let noise = 0.03 * ((state >> 11) as f64 / (1u64 << 53) as f64 - 0.5);
        text += &format!(
            "{t:.1},{:.5}\n",
            (-0.1 * t).exp() * (frequency * t).cos() + noise
        );
    }
    text
}

/// A folder with the model and `count` records, the natural frequency of which falls from one to the next.
fn bench(count: usize) -> Workbench {
    let bench = Workbench::empty();
    bench.write("model.yaml", MODEL);
    for i in 1..=count {
        let frequency = 2.2 - 0.01 * i as f64;
        bench.write(&format!("records/r{i:02}.csv"), &record(frequency));
    }
    bench
}

/// The rows by their records, without their times.
fn rows(bench: &Workbench, folder: &str) -> BTreeMap<String, Value> {
    let text = bench.read(&format!("{folder}/rows.jsonl"));
    let rows = text.lines().map(|line| {
        let mut row: Value = serde_json::from_str(line).expect("JSON");
        row.as_object_mut().expect("a row").remove("seconds");
        (row["record"].as_str().expect("a name").to_owned(), row)
    });
    rows.collect()
}

const FLEET: [&str; 5] = ["fleet", "model.yaml", "records/*.csv", "--out", "fleet"];

#[test]
fn each_record_has_the_estimates_of_its_own_fit() {
    let bench = bench(3);
    let out = bench.run_to(0, &FLEET);
    assert!(out.contains("3 records, "), "{out}");
    let rows = rows(&bench, "fleet");
    assert_eq!(rows.len(), 3);
    for (name, row) in &rows {
        let keys: Vec<&String> = row.as_object().expect("a map").keys().collect();
        assert_eq!(
            keys,
            [
                "record",
                "sha256",
                "estimates",
                "verdict",
                "warnings",
                "error"
            ]
        );
        let data = format!("experiments.0.data={name}");
        bench.run(&[
            "fit",
            "model.yaml",
            "--set",
            &data,
            "--out",
            "single",
            "--no-report",
        ]);
        let single: Value = serde_json::from_str(&bench.read("single/result.json")).expect("JSON");
        assert_eq!(row["estimates"], single["estimates"], "{name}");
        assert_eq!(row["verdict"], single["verdict"]["level"], "{name}");
    }
    let table = bench.read("fleet/rows.csv");
    assert_eq!(table.lines().count(), 4);
    assert!(
        table.starts_with("record,natural_frequency,natural_frequency_low,"),
        "{table}"
    );
    // The threads change no row.
    let one = [&FLEET[..4], &["one", "--threads", "1"]].concat();
    bench.run_to(0, &one);
    assert_eq!(self::rows(&bench, "one"), rows);
}

/// A record that cannot be fitted has a row with its error, and stops no other one; after a repair it is fitted again. A hostile
/// name is a text.
#[test]
fn bad_records_are_rows() {
    let bench = bench(2);
    let hostile = "records/<img src=x onerror=alert(1)>&.csv";
    bench.write("records/broken.csv", "t_s,y_m\n0,1\n0.1,abc\n");
    bench.write(hostile, &record(2.0));
    let list = [
        "records/r01.csv",
        "records/broken.csv",
        "absent.csv",
        hostile,
    ];
    let fleet = [&["fleet", "model.yaml"][..], &list, &["--out", "fleet"]].concat();
    let out = bench.run_to(0, &fleet);
    assert!(out.contains("2 errors"), "{out}");
    let error = |name: &str| {
        rows(&bench, "fleet")[name]["error"]
            .as_str()
            .unwrap_or_default()
            .to_owned()
    };
    assert!(error("records/broken.csv").starts_with("records/broken.csv:3: "));
    assert!(error("absent.csv").contains("absent.csv"));
    assert_eq!(error("records/r01.csv"), "");
    let page = bench.read("fleet/fleet.html");
    assert!(!page.contains("<img"), "markup of a name");
    roxmltree::Document::parse(page.trim_start_matches("<!DOCTYPE html>\n")).expect("well-formed");
    bench.write("records/broken.csv", &record(2.1));
    let out = bench.run_to(0, &fleet);
    assert!(
        out.contains("1 error\n") && error("records/broken.csv").is_empty(),
        "{out}"
    );
}

/// Killed at any moment, the same command goes on: every record has one row, and no line is damaged.
#[test]
fn killed_fleets_go_on() {
    let bench = bench(12);
    let whole = [&FLEET[..4], &["whole"]].concat();
    let clock = Instant::now();
    bench.run_to(0, &whole);
    let duration = clock.elapsed();
    for moment in 0..8 {
        let mut child = Command::new(program())
            .current_dir(bench.path(""))
            .args(FLEET)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("a process");
        // Whatever the moment is, the rows before it count.
        std::thread::sleep(duration.mul_f64(0.05 * f64::from(moment)));
        child.kill().expect("a child");
        child.wait().expect("ended");
    }
    bench.run_to(0, &FLEET);
    assert_eq!(bench.read("fleet/rows.jsonl").lines().count(), 12);
    assert_eq!(rows(&bench, "fleet"), rows(&bench, "whole"));
    // A line that was written in part is removed.
    let text = bench.read("fleet/rows.jsonl");
    bench.write("fleet/rows.jsonl", &text[..text.len() - 20]);
    bench.run_to(0, &FLEET);
    assert_eq!(rows(&bench, "fleet"), rows(&bench, "whole"));
}

/// Without room the command ends with an error; the rows before are complete, and the same command goes on with room.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_loses_nothing() {
    let bench = bench(6);
    let fleet = format!(
        "'{}' fleet model.yaml 'records/*.csv' --out fleet --threads 1",
        program()
    );
    // Blocks of 512 or 1024 bytes: room for some rows.
    let limited = Command::new("sh")
        .current_dir(bench.path(""))
        .args(["-c", &format!("ulimit -f 4; exec {fleet}")])
        .output()
        .expect("sh runs");
    assert_eq!(limited.status.code(), Some(2));
    let written = rows(&bench, "fleet").len();
    assert!(written < 6, "{written}");
    bench.run_to(0, &FLEET);
    assert_eq!(rows(&bench, "fleet").len(), 6);
}

/// A table states known masses, windows, further keys and columns for the summary.
#[test]
fn a_table_lists_records() {
    let bench = bench(3);
    bench.write(
        "list.csv",
        "file,mass,experiments.0.window.min,experiments.0.window.max,functions.damping.start,load\n\
         records/r01.csv,2.0,0,5,0.2,10\n\
         records/r02.csv,,1,,,20\n\
         records/r03.csv,4.0,,,,30\n",
    );
    bench.run_to(
        0,
        &[
            "fleet",
            "model.yaml",
            "list.csv",
            "--out",
            "fleet",
            "--trend",
            "load",
        ],
    );
    let rows = rows(&bench, "fleet");
    let mass = |name: &str| rows[name]["estimates"]["mass"]["value"].as_f64();
    let names = ["records/r01.csv", "records/r02.csv", "records/r03.csv"];
    assert_eq!(names.map(mass), [2.0, 1.0, 4.0].map(Some));
    assert!(bench.read("fleet/fleet.html").contains("over load"));
    assert!(
        bench
            .read("fleet/rows.csv")
            .starts_with("record,table_load,")
    );
}

/// The shipped model with its records: eleven of twelve have a falling frequency with temperature, one stands out.
#[test]
fn the_footbridge_is_monitored() {
    let bench = Workbench::with_shipped_models();
    let fleet = [
        "fleet",
        "models/footbridge.yaml",
        "data/footbridge.csv",
        "--out",
        "fleets/footbridge",
        "--trend",
        "temperature",
    ];
    let out = bench.run_to(0, &fleet);
    assert!(
        out.contains("12 records, ") && out.contains("outlier footbridge_09.csv"),
        "{out}"
    );
}

/// A fleet none of whose records can be fitted has its rows, and another exit code.
#[test]
fn a_fleet_without_a_result_is_no_success() {
    let bench = bench(1);
    let out = bench.run_to(3, &["fleet", "model.yaml", "absent.csv", "--out", "fleet"]);
    assert!(out.contains("1 error"), "{out}");
}

#[test]
fn wrong_arguments() {
    let bench = bench(2);
    let run = |arguments: &[&str]| {
        let before = bench.contents();
        let (code, out, message) = bench.run(&[&["fleet"], arguments].concat());
        assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}: {message}");
        assert_eq!(bench.contents(), before, "{arguments:?} wrote a file");
        message
    };
    bench.write(
        "two.yaml",
        &MODEL.replace(
            "functions:",
            "  - data: records/r02.csv\n    initial: estimate\nfunctions:",
        ),
    );
    bench.write(
        "none.yaml",
        &MODEL.replace("data: records/r01.csv\n    ", ""),
    );
    bench.write("text.csv", "file,mass\nrecords/r01.csv,heavy\n");
    bench.write("nofile.csv", "file,mass\n,1\n");
    bench.write("short.csv", "file,mass\nrecords/r01.csv\n");
    bench.write("key.csv", "file,functoins.mass\nrecords/r01.csv,1\n");
    bench.write("twice.csv", "file,file\na,b\n");
    bench.write("empty.csv", "file\n");
    bench.write("value.csv", "file,functions.mass\nrecords/r01.csv,}\n");
    bench.write("equal.csv", "file,mass,mass\nrecords/r01.csv,1,50\n");
    bench.write("same.csv", "file,x,x\nrecords/r01.csv,1,50\n");
    bench.write("own/summary.json", "{}");
    let all = [
        run(&["model.yaml", "equal.csv", "--out", "fleet"]),
        run(&["model.yaml", "same.csv", "--out", "fleet"]),
        run(&["model.yaml", "records/*.csv", "--out", "own"]),
        run(&["model.yaml", "absent/*.csv", "--out", "fleet"]),
        run(&["model.yaml", "a[", "--out", "fleet"]),
        run(&["model.yaml", "records", "--out", "fleet"]),
        run(&[
            "model.yaml",
            "records/r01.csv",
            "records/*.csv",
            "--out",
            "fleet",
        ]),
        run(&[
            "model.yaml",
            "records/*.csv",
            "--out",
            "fleet",
            "--threads",
            "0",
        ]),
        run(&[
            "model.yaml",
            "records/*.csv",
            "--out",
            "fleet",
            "--trend",
            "date",
        ]),
        run(&["two.yaml", "records/*.csv", "--out", "fleet"]),
        run(&["none.yaml", "records/*.csv", "--out", "fleet"]),
        run(&["model.yaml", "text.csv", "--out", "fleet"]),
        run(&["model.yaml", "nofile.csv", "--out", "fleet"]),
        run(&["model.yaml", "short.csv", "--out", "fleet"]),
        run(&["model.yaml", "key.csv", "--out", "fleet"]),
        run(&["model.yaml", "twice.csv", "--out", "fleet"]),
        run(&["model.yaml", "empty.csv", "--out", "fleet"]),
        run(&["model.yaml", "value.csv", "--out", "fleet"]),
        run(&["model.yaml", "records/*.csv", "--out", "/proc/fleet"]),
    ];
    assert_snapshot!(all.join("\n"));
}

/// A folder belongs to one fleet, and the rows to the records as they were.
#[test]
fn other_fleets_are_refused() {
    let bench = bench(2);
    bench.write(
        "list.csv",
        "file,note\nrecords/r01.csv,some\nrecords/r02.csv,words\n",
    );
    let fleet = ["fleet", "model.yaml", "list.csv", "--out", "fleet"];
    let refused = |arguments: &[&str]| {
        let before = bench.contents();
        let (code, out, message) = bench.run(arguments);
        assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}: {message}");
        assert_eq!(bench.contents(), before, "{arguments:?} wrote a file");
        message
    };
    bench.run_to(0, &fleet);
    bench.run_to(0, &["fit", "model.yaml", "--out", "run", "--no-report"]);
    bench.write("other.yaml", &MODEL.replace("start: 0.1", "start: 0.2"));
    let mut all = vec![
        refused(&["fleet", "model.yaml", "list.csv", "--out", "run"]),
        refused(&[&fleet[..], &["--trend", "note"]].concat()),
        refused(&["fleet", "other.yaml", "list.csv", "--out", "fleet"]),
        refused(&[&fleet[..], &["--set", "fit.stop.iterations=9"]].concat()),
    ];
    let samples = bench.read("records/r01.csv");
    bench.write("records/r01.csv", &samples.replacen('1', "2", 1));
    all.push(refused(&fleet));
    bench.write("records/r01.csv", &samples);
    let rows = fs::OpenOptions::new()
        .append(true)
        .open(bench.path("fleet/rows.jsonl"));
    let rows = rows.expect("rows");
    rows.lock().expect("a lock");
    all.push(refused(&fleet));
    drop(rows);
    let identity = bench.read("fleet/fleet.json");
    bench.write(
        "fleet/fleet.json",
        &identity.replace(env!("CARGO_PKG_VERSION"), "0.1.0"),
    );
    all.push(refused(&fleet));
    fs::remove_file(bench.path("fleet/fleet.json")).expect("removed");
    all.push(refused(&fleet));
    bench.write("fleet/fleet.json", "{");
    all.push(refused(&fleet));
    bench.write("fleet/fleet.json", &identity);
    bench.write("fleet/rows.jsonl", "text\n");
    all.push(refused(&fleet));
    assert_snapshot!(all.join("\n"));
}
