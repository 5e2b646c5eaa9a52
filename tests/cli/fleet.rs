//! `kmcfit fleet`: one model on many records.

use crate::program::program;
use crate::workbench::Workbench;
use insta::assert_snapshot;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

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

/// The rows of all shards by their records, without their times.
fn rows(bench: &Workbench, folder: &str) -> BTreeMap<String, Value> {
    lines(bench, folder, "rows-")
        .into_iter()
        .map(|mut row| {
            row.as_object_mut().expect("a row").remove("seconds");
            (row["record"].as_str().expect("a name").to_owned(), row)
        })
        .collect()
}

/// The lines of the files whose names begin with `start`.
fn lines(bench: &Workbench, folder: &str, start: &str) -> Vec<Value> {
    let files = fs::read_dir(bench.path(folder)).expect("a folder");
    let names = files.map(|file| {
        file.expect("a file")
            .file_name()
            .into_string()
            .expect("UTF-8")
    });
    let names = names.filter(|name| name.starts_with(start) && name.ends_with(".jsonl"));
    let texts: Vec<String> = names
        .map(|name| bench.read(&format!("{folder}/{name}")))
        .collect();
    let lines = texts.iter().flat_map(|text| text.lines());
    lines
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect()
}

#[test]
fn each_record_has_the_estimates_of_its_own_fit() {
    let bench = bench(3);
    let out = bench.run_to(
        0,
        &["fleet", "model.yaml", "records/*.csv", "--out", "fleet"],
    );
    assert!(out.contains("3 records, "), "{out}");
    let rows = rows(&bench, "fleet");
    assert_eq!(rows.len(), 3);
    for (name, row) in &rows {
        let keys: Vec<&String> = row.as_object().expect("a map").keys().collect();
        assert_eq!(
            keys,
            ["error", "estimates", "record", "verdict", "warnings"]
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
    let curves = lines(&bench, "fleet", "curves-");
    assert_eq!(curves.len(), 3);
    let length = |key: &str| curves[0][key].as_array().map_or(0, Vec::len);
    assert_eq!(["t", "value", "low", "high"].map(length), [101; 4]);
    for file in ["rows.parquet", "curves.parquet"] {
        let bytes = fs::read(bench.path("fleet").join(file)).expect("a table");
        assert!(
            bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"),
            "{file}"
        );
    }
    let summary: Value = serde_json::from_str(&bench.read("fleet/summary.json")).expect("JSON");
    assert_eq!(summary["records"], 3);
}

/// Threads, shards, their number and the order in which they run change no row.
#[test]
fn rows_depend_neither_on_threads_nor_on_shards() {
    let bench = bench(7);
    for warm in [&[][..], &["--warm-start"]] {
        let fleet = |out: &str, more: &[&str]| {
            let fixed = ["fleet", "model.yaml", "records/*.csv", "--out", out];
            bench.run_to(0, &[&fixed[..], more, warm].concat());
        };
        fleet("one", &["--threads", "1"]);
        fleet("three", &["--threads", "3"]);
        for shard in ["3/3", "1/3", "2/3"] {
            fleet("shards", &["--shard", shard]);
        }
        // The rows that shards of another number wrote count.
        fleet("mixed", &["--shard", "2/2"]);
        fleet("mixed", &[]);
        bench.run_to(0, &["fleet", "collect", "shards"]);
        let one = rows(&bench, "one");
        assert_eq!(one.len(), 7);
        for other in ["three", "shards", "mixed"] {
            assert_eq!(rows(&bench, other), one, "{other}");
        }
        let statistics = |folder: &str| {
            let text = bench.read(&format!("{folder}/summary.json"));
            let mut value: Value = serde_json::from_str(&text).expect("JSON");
            value.as_object_mut().expect("a map").remove("seconds");
            value
        };
        assert_eq!(statistics("shards"), statistics("one"));
        assert_eq!(lines(&bench, "mixed", "rows-").len(), 7, "no record twice");
        for folder in ["one", "three", "shards", "mixed"] {
            fs::remove_dir_all(bench.path(folder)).expect("removed");
        }
    }
}

/// With warm starts the estimates are those of cold ones: the convergence test bounds their distance by a small part of a standard error.
#[test]
fn warm_starts_end_at_the_same_estimates() {
    let bench = bench(5);
    let fixed = ["fleet", "model.yaml", "records/*.csv", "--out"];
    bench.run_to(0, &[&fixed[..], &["cold"]].concat());
    bench.run_to(0, &[&fixed[..], &["warm", "--warm-start"]].concat());
    let (cold, warm) = (rows(&bench, "cold"), rows(&bench, "warm"));
    for (name, cold) in &cold {
        for quantity in ["damping", "stiffness"] {
            let of = |row: &Value| row["estimates"][quantity].clone();
            let [a, b] =
                [of(cold), of(&warm[name])].map(|e| e["value"].as_f64().expect("a number"));
            let interval = &of(cold)["ci95"];
            let width =
                interval[1].as_f64().expect("a limit") - interval[0].as_f64().expect("a limit");
            assert!((a - b).abs() < 1e-3 * width, "{name} {quantity}: {a} {b}");
        }
    }
}

/// A record that cannot be fitted has a row with its error, and stops no other one. A hostile name is a text.
#[test]
fn bad_records_are_rows() {
    let bench = bench(2);
    bench.write("records/broken.csv", "t_s,y_m\n0,1\n0.1,abc\n");
    bench.write("records/<img src=x onerror=alert(1)>&.csv", &record(2.0));
    let list = [
        "records/r01.csv",
        "records/broken.csv",
        "absent.csv",
        "records/<img src=x onerror=alert(1)>&.csv",
    ];
    let out = bench.run_to(
        0,
        &[&["fleet", "model.yaml"][..], &list, &["--out", "fleet"]].concat(),
    );
    assert!(out.contains("2 errors"), "{out}");
    let rows = rows(&bench, "fleet");
    assert_eq!(rows.len(), 4);
    let error = |name: &str| rows[name]["error"].as_str().unwrap_or_default().to_owned();
    assert!(
        error("records/broken.csv").starts_with("records/broken.csv:3: "),
        "{}",
        error("records/broken.csv")
    );
    assert!(
        error("absent.csv").contains("absent.csv"),
        "{}",
        error("absent.csv")
    );
    assert_eq!(rows["records/r01.csv"]["error"], Value::Null);
    let page = bench.read("fleet/fleet.html");
    assert!(!page.contains("<img"), "markup of a name");
    roxmltree::Document::parse(page.trim_start_matches("<!DOCTYPE html>\n")).expect("well-formed");
    let names: Vec<String> = bench
        .contents()
        .into_keys()
        .filter(|name| name.contains("img"))
        .collect();
    assert_eq!(
        names,
        ["records/<img src=x onerror=alert(1)>&.csv"],
        "written elsewhere"
    );
    // Its own page, on demand, in a folder with a plain name.
    bench.run(&["fleet", "page", "fleet", list[3]]);
    assert!(bench.path("fleet/page-000004/report.html").is_file());
}

/// Killed at any moment, the same command goes on: every record has one row, and no line is damaged.
#[test]
fn killed_fleets_go_on() {
    let bench = bench(12);
    let arguments = [
        "fleet",
        "model.yaml",
        "records/*.csv",
        "--out",
        "fleet",
        "--threads",
        "2",
    ];
    let kills = std::env::var("KMCFIT_KILLS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(4u64);
    for moment in 0..kills {
        let mut child = Command::new(program())
            .current_dir(bench.path(""))
            .args(arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("a process");
        std::thread::sleep(Duration::from_millis(15 + 17 * (moment * 7 % 10)));
        // Succeeds for a process that has ended, too.
        child.kill().expect("a child");
        child.wait().expect("ended");
    }
    bench.run_to(0, &arguments);
    assert_eq!(lines(&bench, "fleet", "rows-").len(), 12);
    let found = rows(&bench, "fleet");
    bench.run_to(
        0,
        &["fleet", "model.yaml", "records/*.csv", "--out", "whole"],
    );
    assert_eq!(found, rows(&bench, "whole"));
}

/// A line that was written in part is removed, and its record fitted again.
#[test]
fn a_partial_line_is_removed() {
    let bench = bench(2);
    let arguments = ["fleet", "model.yaml", "records/*.csv", "--out", "fleet"];
    bench.run_to(0, &arguments);
    let whole = rows(&bench, "fleet");
    let path = "fleet/rows-1-of-1.jsonl";
    let text = bench.read(path);
    bench.write(path, &text[..text.len() - 20]);
    bench.run_to(0, &arguments);
    assert_eq!(rows(&bench, "fleet"), whole);
}

/// Without room the command ends with an error; the rows before are complete, and the same command goes on with room.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_loses_nothing() {
    let bench = bench(6);
    let program = program();
    let fleet = format!("'{program}' fleet model.yaml 'records/*.csv' --out fleet --threads 1");
    // Blocks of 512 or 1024 bytes: room for some rows, whose curves are longer than they are.
    let limited = Command::new("sh")
        .current_dir(bench.path(""))
        .args(["-c", &format!("ulimit -f 16; exec {fleet}")])
        .output()
        .expect("sh runs");
    assert_eq!(limited.status.code(), Some(2));
    let message = String::from_utf8_lossy(&limited.stderr).into_owned();
    assert!(message.contains("a row cannot be written"), "{message}");
    let written = lines(&bench, "fleet", "rows-").len();
    assert!(written < 6, "{written}");
    bench.run_to(
        0,
        &["fleet", "model.yaml", "records/*.csv", "--out", "fleet"],
    );
    assert_eq!(rows(&bench, "fleet").len(), 6);
}

#[test]
fn a_time_limit_marks_rows() {
    let bench = bench(2);
    let out = bench.run_to(
        0,
        &[
            "fleet",
            "model.yaml",
            "records/*.csv",
            "--out",
            "fleet",
            "--time-limit",
            "1e-6",
        ],
    );
    assert!(
        out.contains("2 errors, of these 2 by the time limit"),
        "{out}"
    );
    for row in rows(&bench, "fleet").values() {
        assert_eq!(
            row["error"],
            "time limit: the record took more than 0.000001 s"
        );
        assert_eq!(row["estimates"], serde_json::json!({}));
    }
}

/// A record that was repaired is fitted again on request, and its row takes the place of the error.
#[test]
fn repaired_records_are_fitted_again() {
    let bench = bench(3);
    let arguments = ["fleet", "model.yaml", "records/*.csv", "--out", "fleet"];
    let whole = record(2.18);
    bench.write("records/r02.csv", "");
    bench.write("records/r03.csv", "t_s,y_m\n");
    assert!(bench.run_to(0, &arguments).contains("2 errors"));
    bench.write("records/r02.csv", &whole);
    bench.write("records/r03.csv", "t_s,z\n0,1\n");
    assert!(bench.run_to(0, &arguments).contains("2 errors"));
    let again = [&arguments[..], &["--retry-errors"]].concat();
    let out = bench.run_to(0, &again);
    // Of two errors the last one counts.
    assert!(
        out.contains("1 error\n") && out.contains("error   records/r03.csv"),
        "{out}"
    );
    let line = out
        .lines()
        .find(|line| line.contains("r03"))
        .expect("an error");
    assert!(line.contains("`z`") || line.contains("column"), "{line}");
    let rows = lines(&bench, "fleet", "rows-");
    assert_eq!(rows.len(), 5);
    assert!(bench.run_to(0, &arguments).contains("1 error\n"));
    let single = bench.run_to(0, &["fleet", "page", "fleet", "r02.csv"]);
    assert!(single.starts_with("records/r02.csv: "), "{single}");
    // The page is of the file as it is now.
    bench.write("records/r02.csv", &record(2.0));
    let (code, _, notes) = bench.run(&["fleet", "page", "fleet", "r02.csv"]);
    assert_eq!(code, 0, "{notes}");
    assert!(
        notes.contains("warning: the results differ from the row of the record"),
        "{notes}"
    );
}

/// Of many errors five are listed and the others counted; a fleet in which every record has its row is not incomplete.
#[test]
fn long_lists_are_cut_with_a_word() {
    let bench = bench(1);
    for i in 2..=8 {
        bench.write(&format!("records/r{i:02}.csv"), "");
    }
    let out = bench.run_to(
        0,
        &["fleet", "model.yaml", "records/*.csv", "--out", "fleet"],
    );
    assert_eq!(out.matches("error   records/").count(), 5, "{out}");
    assert!(out.contains("error   and 2 more: fleet.html\n"), "{out}");
    let page = bench.read("fleet/fleet.html");
    assert!(page.contains("Some errors") && !page.contains("Incomplete"));
}

/// A column of a logger with the number of each record makes a file no table of records.
#[test]
fn records_may_have_a_column_of_their_numbers() {
    let bench = bench(1);
    bench.write("logger.csv", &record(2.0).replace("y_m", "record"));
    let model = MODEL.replace(
        "sigma:",
        "columns: {time: t_s, displacement: record}\n    sigma:",
    );
    bench.write("model.yaml", &model);
    let out = bench.run_to(0, &["fleet", "model.yaml", "logger.csv", "--out", "fleet"]);
    assert!(
        out.contains("1 record, ") && out.contains("0 errors"),
        "{out}"
    );
}

/// Files of the same names in another folder are other records.
#[test]
fn records_of_another_folder_are_others() {
    let bench = bench(1);
    let list = "file\nr.csv\n";
    for (folder, frequency) in [("a", 2.0), ("b", 2.2)] {
        bench.write(&format!("{folder}/list.csv"), list);
        bench.write(&format!("{folder}/r.csv"), &record(frequency));
    }
    bench.run_to(0, &["fleet", "model.yaml", "a/list.csv", "--out", "fleet"]);
    let (code, _, message) = bench.run(&["fleet", "model.yaml", "b/list.csv", "--out", "fleet"]);
    assert_eq!(code, 2);
    assert!(message.contains("a fleet of other records"), "{message}");
}

/// The axis of a fleet is kept for its collection; a record without a place on it is no outlier of the trend.
#[test]
fn a_trend_over_a_column_with_gaps() {
    let bench = bench(12);
    let mut table = String::from("file,when\n");
    for i in 1..=12 {
        let place = if i == 4 {
            String::new()
        } else {
            (10 * i).to_string()
        };
        table += &format!("records/r{i:02}.csv,{place}\n");
    }
    bench.write("list.csv", &table);
    let arguments = ["fleet", "model.yaml", "list.csv", "--out", "fleet"];
    let out = bench.run_to(0, &[&arguments[..], &["--trend", "when"]].concat());
    let axis = "11 of 12 records have a when; the others are compared with the median of all";
    assert!(
        out.contains(axis) && !out.contains("outlier records/r04"),
        "{out}"
    );
    assert!(out.contains("change per when (95 % CI)"), "{out}");
    let collected = bench.run_to(0, &["fleet", "collect", "fleet"]);
    assert_eq!(collected, out);
    let summary: Value = serde_json::from_str(&bench.read("fleet/summary.json")).expect("JSON");
    let frequency = &summary["distributions"][0];
    assert_eq!(frequency["name"], "natural_frequency");
    let slope = |value: &Value| value.as_f64().expect("a slope");
    // The angular frequency falls by 0.01 from one record to the next.
    let expected = -0.01 / 10.0 / std::f64::consts::TAU;
    let trend = &frequency["trend"];
    assert!(
        (slope(&trend["slope"]) / expected - 1.0).abs() < 0.05,
        "{trend}"
    );
    let [low, high] = [0, 1].map(|i| slope(&trend["slope95"][i]));
    assert!(low < expected && expected < high, "{trend}");
}

/// A table states known masses, windows, further keys and columns for the summary.
#[test]
fn a_table_lists_records() {
    let bench = bench(3);
    bench.write(
        "list.csv",
        "file,mass,start,end,functions.damping.start,date,system\n\
         records/r01.csv,2.0,0,5,0.2,2026-01-01,a\n\
         records/r02.csv,,1,,,2026-02-01,a\n\
         records/r03.csv,4.0,,,,2026-03-01,b\n",
    );
    let (code, out, notes) = bench.run(&[
        "fleet",
        "model.yaml",
        "list.csv",
        "--out",
        "fleet",
        "--trend",
        "date",
    ]);
    assert_eq!(code, 0, "{out}{notes}");
    assert_snapshot!(notes, @"note: columns: `file` names the record; `mass` is the known mass; `start` is the first time used; `end` is the last time used; `functions.damping.start` overrides that key; `date` is kept for the summary; `system` groups records of one system");
    let rows = rows(&bench, "fleet");
    let mass = |name: &str| rows[name]["estimates"]["mass"]["value"].as_f64();
    assert_eq!(mass("records/r01.csv"), Some(2.0));
    assert_eq!(mass("records/r02.csv"), Some(1.0));
    assert_eq!(mass("records/r03.csv"), Some(4.0));
    let curves = lines(&bench, "fleet", "curves-");
    let last = |name: &str| {
        let curve = curves
            .iter()
            .find(|curve| curve["record"] == name)
            .expect("a curve");
        curve["t"]
            .as_array()
            .expect("times")
            .last()
            .and_then(Value::as_f64)
    };
    assert_eq!(last("records/r01.csv"), Some(5.0));
    assert!(bench.read("fleet/fleet.html").contains("over date"));
    // The page of a record is the fit with the values of the table.
    bench.run(&["fleet", "page", "fleet", "records/r01.csv"]);
    let single: Value =
        serde_json::from_str(&bench.read("fleet/page-000001/result.json")).expect("JSON");
    assert_eq!(single["estimates"], rows["records/r01.csv"]["estimates"]);
}

#[test]
fn two_processes_do_not_share_a_shard() {
    let bench = bench(1);
    let arguments = ["fleet", "model.yaml", "records/*.csv", "--out", "fleet"];
    bench.run_to(0, &arguments);
    let rows = fs::OpenOptions::new()
        .append(true)
        .open(bench.path("fleet/rows-1-of-1.jsonl"))
        .expect("the journal");
    rows.lock().expect("a lock");
    let (code, _, message) = bench.run(&arguments);
    assert_eq!(code, 2);
    assert_snapshot!(message, @"
    error: fleet/rows-1-of-1.jsonl: another process works on this shard
      expected: one process for each shard
      hint: wait for it, or give each process a shard of its own
    ");
}

/// The shipped model with its records: eleven of twelve have a falling frequency with temperature, one stands out.
#[test]
fn the_footbridge_is_monitored() {
    let bench = Workbench::with_shipped_models();
    let out = bench.run_to(
        0,
        &[
            "fleet",
            "models/footbridge.yaml",
            "data/footbridge.csv",
            "--out",
            "fleets/footbridge",
            "--trend",
            "temperature",
        ],
    );
    assert!(out.contains("12 records, "), "{out}");
    assert!(out.contains("outlier footbridge_09.csv"), "{out}");
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
    bench.write("path.csv", "Path,mass\nrecords/r01.csv,1\n");
    bench.write("equal.csv", "file,mass,mass\nrecords/r01.csv,1,50\n");
    bench.write("same.csv", "file,x,x\nrecords/r01.csv,1,50\n");
    fs::write(
        bench.path("latin.csv"),
        b"file,syst\xe8me\nrecords/r01.csv,1\n",
    )
    .expect("written");
    bench.write("one.csv", "file\nrecords/r01.csv\n");
    bench.write("own/summary.json", "{}");
    let all = [
        run(&["model.yaml", "path.csv", "--out", "fleet"]),
        run(&["model.yaml", "equal.csv", "--out", "fleet"]),
        run(&["model.yaml", "same.csv", "--out", "fleet"]),
        run(&["model.yaml", "latin.csv", "--out", "fleet"]),
        run(&["model.yaml", "one.csv", "records/r02.csv", "--out", "fleet"]),
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
            "--shard",
            "3/2",
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
            "--time-limit",
            "-1",
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
        run(&["model.yaml", "", "--out", "fleet"]),
        run(&["model.yaml", "records/*.csv", "--out", "/proc/fleet"]),
        run(&["collect", "records"]),
        run(&["page", "records", "r01.csv"]),
    ];
    assert_snapshot!(all.join("\n"), @r#"
    error: path.csv:1:1: a table of records without the column `file`
      |
    1 | Path,mass
      | ^^^^^^^^^
      found: `Path`
      expected: the column `file`, with the paths of the records

    error: equal.csv:1:1: two columns of one name
      |
    1 | file,mass,mass
      | ^^^^^^^^^^^^^^
      found: `mass`
      expected: every column once

    error: same.csv:1:1: two columns of one name
      |
    1 | file,x,x
      | ^^^^^^^^
      found: `x`
      expected: every column once

    error: latin.csv:1:10: the file is not UTF-8 text
      |
    1 | file,syst�me
      |          ^^^
      found: the byte 0xe8
      expected: a table of records
      hint: save it as UTF-8, or write only plain letters there

    error: one.csv: a table of records among several arguments
      expected: one table of records alone, or files and patterns

    error: own: the folder holds a file that the fleet would replace
      found: summary.json
      expected: a folder of its own for the fleet

    error: RECORDS: no file matches this pattern
      found: `absent/*.csv`
      expected: a pattern such as "records/*.csv"

    error: RECORDS: the pattern cannot be read
      found: `a[`
      expected: a pattern such as "records/*.csv"
      hint: Pattern syntax error near position 1: invalid range pattern

    error: records: a folder in place of records
      expected: files, or a pattern in quotes
      hint: "records/*.csv"

    error: RECORDS: two records have the same name
      found: `records/r01.csv` as number 1 and number 2
      expected: every record once

    error: --shard: no such shard
      found: `3/2`
      expected: I/N with I from 1 to N, as 2/10 for the second of ten shards

    error: --threads: invalid number of threads
      found: 0
      expected: 1 to 256

    error: --time-limit: invalid time
      found: -1
      expected: seconds, greater than 0

    error: --trend: no such column
      found: `date`
      expected: a table of records with further columns

    error: two.yaml:7:5: experiments[1]: the model of a fleet has one experiment
      |
    7 |   - data: records/r02.csv
      |     ^^^^
      found: 2 experiments
      expected: one experiment, whose `data` each record replaces

    error: none.yaml:4:5: experiments[0].data: the experiment has no data
      |
    4 |   - sigma: {displacement: estimate}
      |     ^^^^^
      expected: `data: FILE`, in whose place each record is read

    error: text.csv:2:1: not a number
      |
    2 | records/r01.csv,heavy
      | ^^^^^^^^^^^^^^^^^^^^^
      found: `heavy` in the column `mass`
      expected: a number, or nothing

    error: nofile.csv:2:1: a row without a file
      |
    2 | ,1
      | ^^
      expected: the path of a record

    error: short.csv:2:1: a row of another length
      |
    2 | records/r01.csv
      | ^^^^^^^^^^^^^^^
      found: 1 values
      expected: 2, one for each column

    error: key.csv:1:1: a column with the name of no key
      |
    1 | file,functoins.mass
      | ^^^^^^^^^^^^^^^^^^^
      found: `functoins.mass`
      expected: a key that begins with one of: experiments, functions, fit, grid, constraints, parameters, or a name without a point
      hint: did you mean `functions`?

    error: twice.csv:1:1: two columns `file`
      |
    1 | file,file
      | ^^^^^^^^^
      expected: one

    error: RECORDS: no records
      expected: files, patterns in quotes, or a table with a column `file`

    error: value.csv:2:1: the value cannot be read
      |
    2 | records/r01.csv,}
      | ^^^^^^^^^^^^^^^^^
      found: `functions.mass=}`
      expected: a value as in a model file: 50, constant, {order: 2, weight: 0.1}, …

    error: : the path of the record is invalid
      found: cannot make an empty path absolute

    error: /proc/fleet: the folder of the fleet cannot be written to
      found: No such file or directory (os error 2)
      expected: a folder that can be written to

    error: records: this is not the folder of a fleet
      found: no fleet.json
      expected: the folder of `kmcfit fleet --out`

    error: records: this is not the folder of a fleet
      found: no fleet.json
      expected: the folder of `kmcfit fleet --out`
    "#);
}

/// A folder belongs to one fleet.
#[test]
fn other_fleets_are_refused() {
    let bench = bench(2);
    bench.write(
        "list.csv",
        "file,note\nrecords/r01.csv,some\nrecords/r02.csv,words\n",
    );
    let refused = |arguments: &[&str]| {
        let before = bench.contents();
        let (code, out, message) = bench.run(&[&["fleet"], arguments].concat());
        assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}: {message}");
        assert_eq!(bench.contents(), before, "{arguments:?} wrote a file");
        message
    };
    bench.run_to(0, &["fleet", "model.yaml", "list.csv", "--out", "fleet"]);
    bench.run_to(0, &["fit", "model.yaml", "--out", "run", "--no-report"]);
    let mut all = vec![
        refused(&["model.yaml", "records/r01.csv", "--out", "fleet"]),
        refused(&["model.yaml", "list.csv", "--out", "fleet", "--warm-start"]),
        refused(&["model.yaml", "list.csv", "--out", "run"]),
        refused(&["collect", "fleet", "--trend", "notes"]),
        refused(&["collect", "fleet", "--trend", "note"]),
        refused(&["page", "fleet", "records/r1.csv"]),
    ];
    bench.write("other.yaml", &MODEL.replace("start: 0.1", "start: 0.2"));
    all.push(refused(&["other.yaml", "list.csv", "--out", "fleet"]));
    bench.write("model.yaml", &MODEL.replace("start: 0.1", "start: 0.3"));
    all.push(refused(&["model.yaml", "list.csv", "--out", "fleet"]));
    let identity = bench.read("fleet/fleet.json");
    let old = identity.replace(env!("CARGO_PKG_VERSION"), "0.1.0");
    bench.write("model.yaml", MODEL);
    bench.write("fleet/fleet.json", &old);
    all.push(refused(&["model.yaml", "list.csv", "--out", "fleet"]));
    fs::remove_file(bench.path("fleet/fleet.json")).expect("removed");
    all.push(refused(&["model.yaml", "list.csv", "--out", "fleet"]));
    bench.write("fleet/fleet.json", "{");
    all.push(refused(&["model.yaml", "list.csv", "--out", "fleet"]));
    bench.write("fleet/fleet.json", &identity);
    let records = bench.read("fleet/records.jsonl");
    let first: String = records
        .lines()
        .take(2)
        .map(|line| format!("{line}\n"))
        .collect();
    bench.write("fleet/records.jsonl", &first);
    all.push(refused(&["collect", "fleet"]));
    bench.write("fleet/records.jsonl", "text\n");
    all.push(refused(&["collect", "fleet"]));
    bench.write("fleet/records.jsonl", &records);
    // A record of arrays has the digest of its content in place of a path.
    let parts: Vec<&str> = records.split('"').collect();
    let path = parts.iter().find(|part| part.ends_with("/records/r01.csv"));
    bench.write(
        "fleet/records.jsonl",
        &records.replace(path.expect("a path"), "sha256:0"),
    );
    all.push(refused(&["page", "fleet", "records/r01.csv"]));
    bench.write("fleet/records.jsonl", &records);
    bench.write("model.yaml", &MODEL.replace("fixed: 1.0", "fixed: 5.0"));
    all.push(refused(&["page", "fleet", "records/r01.csv"]));
    bench.write("model.yaml", MODEL);
    let rows = bench.read("fleet/rows-1-of-1.jsonl");
    bench.write("fleet/rows-1-of-1.jsonl", &rows.replace("r01", "r07"));
    all.push(refused(&["collect", "fleet"]));
    bench.write("fleet/rows-1-of-1.jsonl", "text\n");
    all.push(refused(&["model.yaml", "list.csv", "--out", "fleet"]));
    // The numbers of lines and columns in messages of the parser of JSON are its own.
    assert_snapshot!(all.join("\n"), @"
    error: fleet: the folder belongs to a fleet of other records
      found: 2 records
      expected: the same records in the same order, of which 1 are given
      hint: give another folder with --out

    error: fleet: the fleet began with another option
      found: without --warm-start
      expected: without --warm-start
      hint: give another folder with --out

    error: run: the folder holds a run of another command
      found: kmcfit-manifest.json
      expected: a folder of its own for the fleet

    error: --trend: no such column
      found: `notes`
      expected: `note`
      hint: did you mean `note`?

    error: --trend: the column holds neither numbers nor dates
      found: `note`
      expected: a column of which at least half of the cells are numbers, or dates such as 2026-03-02

    error: RECORD: no such record in this fleet
      found: `records/r1.csv`
      expected: a record as its row names it
      hint: did you mean `records/r01.csv`?

    error: fleet: the folder belongs to a fleet of another model
      found: `model.yaml`
      expected: the same model
      hint: give another folder with --out

    error: fleet: the model has changed since this fleet began
      found: `model.yaml`
      expected: the same model
      hint: give another folder with --out

    error: fleet: the fleet began with another version of kmcfit
      found: 0.1.0
      expected: 0.2.0-dev
      hint: give another folder with --out

    error: fleet: the folder holds rows of an unknown fleet
      found: rows without fleet.json
      expected: a folder of its own for the fleet

    error: fleet/fleet.json: the identity of the fleet is damaged
      found: EOF while parsing an object at line 1 column 1

    error: fleet/records.jsonl: the list of records is damaged
      found: 1 records
      expected: 2

    error: fleet/records.jsonl: the list of records cannot be read
      found: expected ident at line 1 column 2

    error: RECORD: the record was in memory, not in a file
      found: `records/r01.csv`
      expected: a record of a file

    error: fleet: the model has changed since this fleet began
      found: `model.yaml`
      expected: the same model
      hint: give another folder with --out

    error: fleet/rows-1-of-1.jsonl: the fleet cannot be collected
      found: a record of another fleet: records/r07.csv

    note: columns: `file` names the record; `note` is kept for the summary
    error: fleet/rows-1-of-1.jsonl: the rows cannot be read or written to
      found: expected ident at line 1 column 2
      expected: a journal of a fleet that can be written to
    ");
}
