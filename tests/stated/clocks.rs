//! Times and rates: dates with slashes, rates beside times, times in another file, clocks that differ by part of a step.

use crate::headings::{forced, init, level, value};
use crate::properties::{Property, tdms};
use crate::workbench::Workbench;
use std::f64::consts::TAU;
use std::fmt::Write;

/// A table of 300 rows at 50 Hz: times as `time` writes them, and a vibration of 2 Hz.
fn table(head: &str, time: impl Fn(usize) -> String) -> String {
    let mut text = format!("{head}\n");
    for i in 0..300 {
        let y = (TAU * 2.0 * 0.02 * i as f64).cos() + 1e-3 * (i * 7919 % 101) as f64 / 101.0;
        let _ = writeln!(text, "{}{y:.6}", time(i));
    }
    text
}

/// Day and month follow from a value above 12, else from times that increase within the shorter span.
#[test]
fn dates_with_slashes() {
    let clock = |i: usize| {
        let seconds = 86_398.0 + 0.02 * i as f64;
        let day = seconds % 86_400.0;
        let (hours, minutes) = ((day / 3600.0).floor(), (day / 60.0).floor() % 60.0);
        (
            usize::from(seconds >= 86_400.0),
            format!("{hours:02}:{minutes:02}:{:06.3}", day % 60.0),
        )
    };
    for (order, dates) in [
        ("month first", ["1/3/2024", "1/4/2024"]),
        ("day first", ["3/1/2024", "4/1/2024"]),
        ("day first", ["12/1/2024", "13/1/2024"]),
        ("day first", ["31/1/2024", "1/2/2024"]),
        ("month first", ["1/31/2024", "2/1/2024"]),
        ("month first", ["12/12/2024", "12/13/2024"]),
    ] {
        let text = table("time,y (mm)", |i| {
            let (day, time) = clock(i);
            format!("{} {time},", dates[day])
        });
        let said = init("r.csv", text.as_bytes(), &[]);
        assert!(
            said.contains(order) && said.contains("300 samples over 5.98 s"),
            "{dates:?}: {said}"
        );
    }
    // A record of months.
    let text = table("time,y (mm)", |i| {
        format!("{}/{}/2024 12:00,", 1 + i % 28, 1 + i / 28)
    });
    let said = init("r.csv", text.as_bytes(), &[]);
    assert!(said.contains("day first"), "{said}");
}

/// A rate beside times that contradict it is named, and a reason of the verdict; without times it is that of the samples.
#[test]
fn rates_beside_times() {
    let time = |i: usize| format!("{:.2},", 0.02 * i as f64);
    let heads = [
        "Sampling rate: @ Hz\ntime (s),y (mm)",
        "# fs = @\ntime (s),y (mm)",
        "Logger\nSAMPLING_RATE;@Hz\nUser;ab\ntime (s),y (mm)",
    ];
    for head in heads {
        let text = |rate: &str| table(&head.replace('@', rate), time);
        let said = init("r.csv", text("50").as_bytes(), &[]);
        assert!(!said.contains("not applied"), "{said}");
        let bench = Workbench::empty();
        bench.write("r.csv", &text("100"));
        let said = bench.run_to(0, &["init", "r.csv"]);
        assert!(
            said.contains("a sampling rate of 100 Hz (by its times: 50 Hz)"),
            "{said}"
        );
        let listed = bench.run_to(0, &["check", "r.csv"]);
        assert!(listed.contains("100 Hz (by its times"), "{listed}");
        bench.run_to(0, &["fit", "r.yaml", "--out", "run", "--no-report"]);
        let document = serde_json::from_str(&bench.read("run/result.json")).expect("a document");
        assert_ne!(level(&document), "adequate");
        let reasons = document["verdict"]["reasons"].to_string();
        assert!(reasons.contains("sampling rate of 100 Hz"), "{reasons}");
        let without = table(&head.replace('@', "50").replace("time (s),", ""), |_| {
            String::new()
        });
        let said = init("r.csv", without.as_bytes(), &[]);
        assert!(
            said.contains("sample_rate: 50 ") && said.contains("300 samples over 5.98 s"),
            "{head}: {said}"
        );
    }
    // A number of the sample is no time and no response.
    let text = table("SAMPLING_RATE;50Hz\nnumber;Ch X", |i| format!("{i};"));
    let said = init("r.csv", text.as_bytes(), &[]);
    assert!(
        said.contains("`Ch X`: displacement") && said.contains("5.98 s"),
        "{said}"
    );
}

/// Times in another file are asked for in one table.
#[test]
fn times_in_another_file() {
    let bench = Workbench::empty();
    bench.write("values.csv", &table("acc (g)", |_| String::new()));
    bench.write("times.csv", "t\n0\n1\n2\n");
    for arguments in [
        &["values.csv"][..],
        &["values.csv", "--time", "times.csv:t"],
    ] {
        let (code, _, said) = bench.run(&[&["init"], arguments].concat());
        assert!(code == 2 && said.contains("paste -d,"), "{said}");
    }
    // An app of phones names the sensor in the name of the file.
    let text = table("time,x,y,z", |i| {
        format!(
            "{},0.1,0.2,",
            1_760_000_000_123_456_789 + 20_000_000 * i as u64
        )
    });
    let said = init("Accelerometer.csv", text.as_bytes(), &[]);
    assert!(
        said.contains("`z`: acceleration") && said.contains("time, ns"),
        "{said}"
    );
}

/// Channels whose clocks differ by part of a step keep their times.
#[test]
fn clocks_that_differ_by_part_of_a_step() {
    let rows = forced(15_000, 2e-4);
    let column = |from: usize, of: usize| -> Vec<f64> {
        rows.iter()
            .skip(from)
            .step_by(10)
            .map(|row| row[of])
            .collect()
    };
    let property = |unit, fraction: f64| {
        let fraction = (fraction * 2f64.powi(64)) as u64;
        [
            ("unit_string", Property::Text(unit)),
            ("wf_increment", Property::Number(2e-3)),
            ("wf_start_time", Property::Time(3_700_000_000, fraction)),
        ]
    };
    // The force earlier or later by 0.6 ms, or 7 ms and 0.4 ms.
    for (force, acceleration) in [(0, 3), (3, 0), (0, 37)] {
        let start = |from: usize| 0.25 + 2e-4 * from as f64;
        let bytes = tdms(&[
            (
                "/'g'/'force'",
                &property("N", start(force)),
                &column(force, 1),
            ),
            (
                "/'g'/'acc'",
                &property("m/s^2", start(acceleration)),
                &column(acceleration, 2),
            ),
        ]);
        let bench = Workbench::empty();
        bench.write_bytes("r.tdms", &bytes);
        let said = bench.run_to(0, &["init", "r.tdms"]);
        assert!(said.contains("that each channel keeps"), "{said}");
        bench.run_to(0, &["fit", "r.yaml", "--out", "run", "--no-report"]);
        let document = serde_json::from_str(&bench.read("run/result.json")).expect("a document");
        let mass = value(&document, "mass");
        assert!((mass / 2.0 - 1.0).abs() < 2e-3, "{force}: {mass} kg");
    }
}
