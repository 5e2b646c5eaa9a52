//! Warnings and suggestions of a summary: each problem of a record is reported, and following the suggestion removes it.

use crate::workbench::Workbench;
use insta::assert_snapshot;
use serde_json::Value;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A record for a model with a fixed mass.
fn starter(grid: &str, more: &str) -> String {
    format!(
        "format: 1
experiments:
  - data: record.csv
    initial: estimate
{more}grid: {grid}
functions:
  mass: {{fixed: 1.0}}
  damping: {{basis: constant, start: 0.25}}
  stiffness: {{basis: constant, start: 39}}
fit: {{method: gauss-newton}}
"
    )
}

/// A growing oscillation has a negative damping, with its interval in one warning, and as a reason of the verdict.
#[test]
fn a_negative_damping_is_reported() {
    let bench = Workbench::empty();
    let row = |i: u32| {
        let t = 0.05 * f64::from(i);
        let noise = 0.01 * f64::from(i * 7919 % 101) / 101.0;
        format!(
            "{t},{}\n",
            (0.02 * t).exp() * (2.0 * t).cos() + noise - 0.005
        )
    };
    let rows: String = (0..600).map(row).collect();
    bench.write("record.csv", &format!("t,y\n{rows}"));
    let columns = "    columns: {time: t, displacement: y}\n    sigma: {displacement: estimate}\n";
    bench.write("model.yaml", &starter("{}", columns));
    let (_, summary, stderr) = bench.run(&["fit", "model.yaml", "--no-report", "--verbose"]);
    assert!(
        summary.contains("c is negative (95 % CI -"),
        "{summary}{stderr}"
    );
    let reason = "           the damping is negative at most times: the system is not passive\n";
    assert_eq!(summary.matches(reason).count(), 1, "{summary}");
}

/// Pseudo-random numbers from -1/2 to 1/2; a multiplication alone would give a tone at the golden ratio.
fn pseudo_random(i: u32) -> f64 {
    let mixed = i.wrapping_mul(2_654_435_761);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(2_246_822_519);
    f64::from((mixed ^ (mixed >> 13)) >> 8) / f64::from(1 << 24) - 0.5
}

/// A ring-down of m = 1, c = 0.1, k = 4.0025 with pseudo-random errors of up to `size`.
fn ring_down(seconds: u32, size: f64) -> String {
    let rows = (0..=20 * seconds).map(|i| {
        let t = 0.05 * f64::from(i);
        let y = (-0.05 * t).exp() * (2.0 * t).cos() + 2.0 * size * pseudo_random(i);
        format!("{t},{y}\n")
    });
    format!("t_s,y_m\n{}", rows.collect::<String>())
}

/// With residuals a hundred times the given sigma no confidence intervals are reported, in a study neither; the suggestion
/// concerns sigma.
#[test]
fn a_sigma_that_is_too_small_is_reported() {
    let bench = Workbench::empty();
    bench.write("record.csv", &ring_down(20, 1e-2));
    let model = starter("{nodes: 801}", "    sigma: {displacement: 1e-4}\n").replace("39", "3.8");
    bench.write("model.yaml", &model);
    let summary = bench.run_to(0, &["fit", "model.yaml", "--no-report", "--verbose"]);
    let said = " times sigma: the model does not explain the record, or sigma is too small";
    assert_eq!(summary.matches(said).count(), 1, "{summary}");
    assert!(
        summary.contains("sigma is too small: the residuals are "),
        "{summary}"
    );
    assert!(!summary.contains("is identified"), "{summary}");
    let study = bench.run_to(0, &["study", "model.yaml"]);
    assert!(
        study.contains(said) && !study.contains("is identified"),
        "{study}"
    );
    bench.write("model.yaml", &model.replace("1e-4", "estimate"));
    let summary = bench.run_to(0, &["fit", "model.yaml", "--no-report", "--verbose"]);
    assert!(summary.contains("stiffness is identified"), "{summary}");
}

/// A slightly wrong model leaves autocorrelated residuals, and a warning states the covariance of the intervals.
#[test]
fn autocorrelated_residuals_are_reported() {
    let bench = Workbench::empty();
    let beat = (0..=400).map(|i| {
        let t = 0.05 * f64::from(i);
        let y = (-0.05 * t).exp() * ((2.0 * t).cos() + 0.05 * (5.0 * t).sin());
        format!("{t},{y}\n")
    });
    bench.write(
        "record.csv",
        &format!("t_s,y_m\n{}", beat.collect::<String>()),
    );
    let model = starter("{nodes: 801}", "    sigma: {displacement: estimate}\n");
    bench.write("model.yaml", &model.replace("39", "3.8"));
    let summary = bench.run_to(0, &["fit", "model.yaml", "--no-report", "--verbose"]);
    let said = "the residuals are autocorrelated beyond the noise model; the confidence intervals are heteroscedasticity- and \
                autocorrelation-consistent\n";
    assert_eq!(summary.matches(said).count(), 1, "{summary}");
    // A band leaves them autocorrelated.
    assert!(
        summary.contains("Next   one oscillator cannot have two modes"),
        "{summary}"
    );
}

/// With one missing sample aliases still match the others; with uneven times they do not.
#[test]
fn a_gap_hides_no_alias() {
    let bench = Workbench::empty();
    let record = |shift: fn(u32) -> f64| {
        let rows = (0..40u32).filter(|i| *i != 17).map(|i| {
            let t = f64::from(i) + shift(i);
            format!("{t},{}\n", (-0.01 * t).exp() * (2.8 * t).cos())
        });
        format!("t_s,y_m\n{}", rows.collect::<String>())
    };
    let said = "aliasing: with 2.2 samples per period";
    for (shift, aliased) in [
        ((|_| 0.0) as fn(u32) -> f64, true),
        (|i| 0.3 * f64::from(i % 3), false),
    ] {
        bench.write("record.csv", &record(shift));
        bench.write(
            "model.yaml",
            &starter("{nodes: 2001}", "").replace("39", "7.8"),
        );
        let summary = bench
            .run(&["fit", "model.yaml", "--no-report", "--verbose"])
            .1;
        assert_eq!(summary.contains(said), aliased, "{summary}");
    }
}

/// Squares that overflow give an infinite sigma, with which every system would fit.
#[test]
fn samples_whose_squares_overflow_fail_with_that_reason() {
    let bench = Workbench::empty();
    let rows: String = (0..40)
        .map(|i| format!("{i},{}e200\n", (i % 5) - 2))
        .collect();
    bench.write("record.csv", &format!("t_s,y_m\n{rows}"));
    let sigma = "    sigma: {displacement: estimate}\n";
    bench.write("model.yaml", &starter("{nodes: 401}", sigma));
    let (code, summary, _) = bench.run(&["fit", "model.yaml", "--no-report", "--verbose"]);
    assert_eq!(code, 3, "{summary}");
    assert!(
        summary.contains("failed: the squares of the samples overflow"),
        "{summary}"
    );
    assert!(!summary.contains("is identified"), "{summary}");
}

/// A function that is identified on part of the record only is reported with its values there; one that is not identified,
/// without values.
#[test]
fn values_are_reported_where_they_are_identified() {
    let bench = Workbench::empty();
    let found = |end: u32, knots: u32| {
        // A row without a sample extends the grid.
        let record = format!("{}{end},\n", ring_down(20, 1e-3));
        bench.write("record.csv", &record);
        let sigma = "    sigma: {displacement: estimate}\n";
        let model = starter(&format!("{{nodes: {}}}", 40 * end + 1), sigma).replace(
            "{basis: constant, start: 39}",
            &format!("{{basis: piecewise-constant, knots: {knots}, start: 3.8}}"),
        );
        bench.write("model.yaml", &model);
        let (_, summary, stderr) = bench.run(&["fit", "model.yaml", "--no-report", "--verbose"]);
        let (_, line) = summary.split_once("\nstiffness k").expect(&stderr);
        let line = line.split_once('\n').expect("its end").0.to_owned();
        (line, summary)
    };
    let (line, summary) = found(40, 4);
    assert!(
        summary.contains("stiffness is identified only on [0.000, "),
        "{summary}"
    );
    assert!(line.contains(" where it is identified)"), "{line}");
    let (line, summary) = found(600, 49);
    assert!(
        summary.contains("stiffness is not identifiable from these records"),
        "{summary}"
    );
    assert!(line.ends_with("  N/m    not identifiable"), "{line}");
    assert!(!line.contains(|c: char| c.is_ascii_digit()), "{line}");
}

/// A sensor that saturates at 0.5.
#[test]
fn saturated_samples_are_reported() {
    let bench = Workbench::empty();
    let cut = |row: &str| match row.split_once(',') {
        Some((t, y)) => match y.parse::<f64>() {
            Ok(y) => format!("{t},{}\n", y.min(0.5)),
            Err(_) => format!("{row}\n"),
        },
        None => String::new(),
    };
    let record = ring_down(20, 1e-2);
    bench.write("record.csv", &record);
    let check = || {
        bench.write("model.yaml", &starter("{nodes: 401}", ""));
        bench.run(&["check", "model.yaml"]).2
    };
    assert!(!check().contains("equal its extreme value"));
    bench.write("record.csv", &record.lines().map(cut).collect::<String>());
    assert_snapshot!(check(), @"warning: experiments[0] (experiment 1): 66 samples of the displacement equal its extreme value 0.5 m; if the sensor saturates there, leave them out: `exclude: [saturation]`");
}

/// Records of noise, of several seeds: a model may explain three per cent of the variance, and no system is identified.
#[test]
fn noise_identifies_no_system() {
    let bench = Workbench::empty();
    for seed in 1..5u32 {
        let reading = |i: u32| {
            let noise = |j: u32| pseudo_random(seed.wrapping_mul(7919).wrapping_add(3 * i + j));
            format!(
                "{},{}\n",
                0.02 * f64::from(i),
                noise(0) + noise(1) + noise(2)
            )
        };
        let rows: String = (0..400).map(reading).collect();
        bench.write("record.csv", &format!("t_s,y_m\n{rows}"));
        let _ = std::fs::remove_file(bench.path("record.yaml"));
        bench.run_to(0, &["init", "record.csv"]);
        let (_, summary, stderr) = bench.run(&["fit", "record.yaml", "--no-report", "--verbose"]);
        assert!(
            !summary.contains("is identified"),
            "{seed}: {summary}{stderr}"
        );
        assert!(
            summary.contains("the model would fit white noise equally well"),
            "{seed}: {summary}"
        );
    }
}

/// An overdamped system with c/m = 30 on steps that resolve its slow mode only: the estimates depend on the step.
#[test]
fn steps_with_errors_above_the_residuals_are_reported() {
    let bench = Workbench::empty();
    let rows: String = (0..500)
        .map(|i| {
            let t = 0.02 * f64::from(i);
            // The roots of s^2 + 30 s + 100.
            let [slow, fast] = [-3.819_660_112_501_051, -26.180_339_887_498_95f64];
            let y = (fast * (slow * t).exp() - slow * (fast * t).exp()) / (fast - slow);
            format!("{t},{}\n", y + 1e-3 * pseudo_random(i as u32))
        })
        .collect();
    bench.write("record.csv", &format!("t_s,y_m\n{rows}"));
    let sigma = "    sigma: {displacement: estimate}\n";
    let model = starter("{nodes: 39}", sigma);
    let model = model
        .replace("start: 39", "start: 27")
        .replace("start: 0.25", "start: 10");
    bench.write("model.yaml", &model);
    let (_, summary, _) = bench.run(&["fit", "model.yaml", "--no-report", "--verbose"]);
    assert!(
        summary.contains("the error of the time steps is "),
        "{summary}"
    );
    assert!(!summary.contains("is identified"), "{summary}");
    assert!(
        summary.contains("the time step is too coarse: use more nodes: `--set grid.nodes=auto`"),
        "{summary}"
    );
}

/// A validation record that is not predicted is in the first lines of the summary; a negative stiffness is reported.
#[test]
fn failed_validation_and_negative_stiffness_are_in_the_first_lines() {
    let bench = Workbench::empty();
    bench.write("record.csv", &ring_down(20, 1e-2));
    let rows: String = (0..400)
        .map(|i| format!("{},{}\n", 0.05 * f64::from(i), (0.1 * f64::from(i)).cos()))
        .collect();
    bench.write("other.csv", &format!("t_s,y_m\n{rows}"));
    let held = "    sigma: {displacement: estimate}\n  - name: other\n    data: other.csv\n    \
                initial: {displacement: 1, velocity: 0}\n    sigma: {displacement: 0.01}\n    validation: true\n";
    let model = starter("{nodes: 801}", held).replace("start: 39", "start: 3.8");
    bench.write("model.yaml", &model);
    let (_, summary, stderr) = bench.run(&["fit", "model.yaml", "--no-report", "--verbose"]);
    assert!(
        summary.contains("; validation failed: fit "),
        "{summary}{stderr}"
    );
    assert!(
        summary.contains("validation record other is not predicted (fit "),
        "{summary}"
    );
    let rows: String = (0..100)
        .map(|i| format!("{},{}\n", 0.02 * f64::from(i), (0.02 * f64::from(i)).cosh()))
        .collect();
    bench.write("record.csv", &format!("t_s,y_m\n{rows}"));
    let model = starter("{nodes: 801}", "    sigma: {displacement: 0.01}\n")
        .replace("start: 39", "start: -0.5");
    bench.write("model.yaml", &model);
    let (_, summary, stderr) = bench.run(&["fit", "model.yaml", "--no-report", "--verbose"]);
    assert!(
        summary.contains("the stiffness is negative at most times"),
        "{summary}{stderr}"
    );
}

/// Columns of the base, of other quantities, with an invalid cell, and with an offset between two sensors.
#[test]
fn a_starter_reads_the_names_of_columns() {
    let bench = Workbench::empty();
    let record = |header: &str, row: &dyn Fn(f64) -> String| {
        let rows: String = (0..200).map(|i| row(0.02 * f64::from(i)) + "\n").collect();
        bench.write("record.csv", &format!("{header}\n{rows}"));
        let _ = std::fs::remove_file(bench.path("record.yaml"));
        let (code, _, stderr) = bench.run(&["init", "record.csv"]);
        match code {
            0 => bench.read("record.yaml"),
            _ => stderr,
        }
    };
    let two = |t: f64| format!("{t},{},{}", (3.0 * t).sin(), (10.0 * t).cos());
    let model = record("t_s,table_acc_m_per_s2,acc_m_per_s2", &two);
    let columns =
        "columns: {time: t_s, base_acceleration: table_acc_m_per_s2, acceleration: acc_m_per_s2}";
    assert!(model.contains(columns), "{model}");
    let model = record("t_s,f1_ref_Hz,y_m", &two);
    assert!(
        model.contains("columns: {time: t_s, displacement: y_m}"),
        "{model}"
    );
    let off = |t: f64| format!("{t},{},{}", 5.0 + (10.0 * t).sin(), (10.0 * t).cos());
    let model = record("t_s,y_m,a_m_per_s2", &off);
    let sensors = "sensors: {acceleration: {offset: estimate}, displacement: {offset: estimate}}";
    assert!(model.contains(sensors), "{model}");
    // Of several axes the one with a response.
    let axes = |t: f64| format!("{t},{},{},0.1", 0.01 * (40.0 * t).sin(), (10.0 * t).cos());
    let model = record("t_s,acc_x_m_per_s2,acc_y_m_per_s2,acc_z_m_per_s2", &axes);
    assert!(
        model.contains("columns: {time: t_s, acceleration: acc_y_m_per_s2}"),
        "{model}"
    );
    // Columns without units, and angles beside lengths, do not prevent the use of a column with a unit.
    for header in ["t_s,y_mm,y_raw", "t_s,y_mm,roll_deg"] {
        let model = record(header, &|t| {
            format!("{t},{},{}", (10.0 * t).cos(), (9.0 * t).cos())
        });
        assert!(model.contains("displacement: y_mm"), "{model}");
    }
    // A file of an oscilloscope: its first column is the time, whatever its name.
    let model = record("x,signal", &|t| format!("{t},{}", (10.0 * t).cos()));
    assert!(
        model.contains("columns: {time: x, displacement: signal}"),
        "{model}"
    );
    let spikes = |t: f64| {
        let y = if (t * 50.0).round() % 60.0 == 7.0 {
            900.0 + t
        } else {
            (10.0 * t).cos()
        };
        format!("{t},{},{y}", -0.1 * (10.0 * t).cos())
    };
    let model = record("t_s,a_m_per_s2,y_mm", &spikes);
    assert!(model.contains("loss: {displacement: huber}"), "{model}");
    // Spikes of one value are codes.
    let codes = |t: f64| {
        let is_missing = (t * 50.0).round() % 60.0 == 7.0;
        let y = if is_missing {
            -9999.0
        } else {
            (10.0 * t).cos()
        };
        format!("{t},{},{y}", -0.1 * (10.0 * t).cos())
    };
    let model = record("t_s,a_m_per_s2,y_mm", &codes);
    assert!(model.contains("missing: [-9999.0]"), "{model}");
    let drifting = |t: f64| format!("{t},{}", t + (10.0 * t).sin());
    let model = record("t_s,y_m", &drifting);
    assert!(
        model.contains("{displacement: {offset: estimate, drift: estimate}}"),
        "{model}"
    );
    let smooth = record("t_s,f_N,y_m", &two);
    assert!(smooth.contains("force: {interpolation: cubic}"), "{smooth}");
    let jumping = |t: f64| format!("{t},{},{}", if t < 1.0 { 0 } else { 5 }, (10.0 * t).cos());
    let jumping = record("t_s,f_N,y_m", &jumping);
    assert!(
        jumping.contains("force: {interpolation: hold}"),
        "{jumping}"
    );
    let rough = |t: f64| {
        format!(
            "{t},{},{}",
            pseudo_random((50.0 * t) as u32),
            (10.0 * t).cos()
        )
    };
    let rough = record("t_s,f_N,y_m", &rough);
    assert!(rough.contains("force: {interpolation: linear}"), "{rough}");
    let wrong = |t: f64| match (50.0 * t).round() as i32 {
        51 => format!("{t},abc"),
        _ => format!("{t},{}", (10.0 * t).cos()),
    };
    let refused = record("t_s,y_m", &wrong);
    assert!(refused.contains("record.csv:53"), "{refused}");
    assert!(refused.contains("abc"), "{refused}");
}

/// A piecewise-linear stiffness for a system with constant or decreasing stiffness: the p-value agrees with that of the
/// likelihood ratio of two fits.
#[test]
fn the_test_of_a_constant_agrees_with_the_likelihood_ratio() {
    let bench = Workbench::empty();
    for (name, falls) in [("constant", 0.0), ("falling", 0.004)] {
        // y" = -(0.1 y' + k(t) y) with steps of 0.001 s, and noise of 0.01.
        let (mut y, mut v) = (1.0f64, 0.0f64);
        let mut rows = String::from("t_s,y_m\n");
        let mut random = 17u64;
        for i in 0..20_000 {
            let t = 1e-3 * f64::from(i);
            if i % 20 == 0 {
                let mut sum = -6.0;
                for _ in 0..12 {
                    random = random
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1);
                    sum += (random >> 11) as f64 / (1u64 << 53) as f64;
                }
                rows += &format!("{t:.3},{}\n", y + 0.01 * sum);
            }
            let k = |t: f64| 4.0 * (1.0 - falls * t);
            let (ym, vm) = (y + 5e-4 * v, v - 5e-4 * (0.1 * v + k(t) * y));
            (y, v) = (y + 1e-3 * vm, v - 1e-3 * (0.1 * vm + k(t + 5e-4) * ym));
        }
        bench.write("record.csv", &rows);
        let [knots, constant] = ["piecewise-linear, knots: 5", "constant"].map(|basis| {
            let model = starter(
                "{nodes: 2001}",
                "    columns: {time: t_s, displacement: y_m}\n    sigma: {displacement: 0.01}\n",
            )
            .replace(
                "stiffness: {basis: constant, start: 39}",
                &format!("stiffness: {{basis: {basis}, start: 3.9}}"),
            );
            bench.write("model.yaml", &model);
            let printed = bench.run_to(0, &["fit", "model.yaml", "--no-report", "--json"]);
            serde_json::from_str::<Value>(&printed).expect("JSON")
        });
        let misfit = |result: &Value| result["cost"]["misfit"].as_f64().expect("a number");
        let law = ChiSquared::new(4.0).expect("degrees of freedom");
        let expected = law.sf(misfit(&constant) - misfit(&knots));
        let stiffness = &knots["functions"]["stiffness"];
        let found = stiffness["constant_p_value"].as_f64().expect("a number");
        // Up to the nonlinearity of the model in the knot values over the noise.
        assert!(
            (found - expected).abs() <= 0.02,
            "{name}: {found} {expected}"
        );
        assert!(constant["functions"]["stiffness"]["constant_p_value"].is_null());
        let (_, summary, _) = bench.run(&[
            "fit",
            "model.yaml",
            "--no-report",
            "--set",
            "functions.stiffness.basis=piecewise-linear",
            "--set",
            "functions.stiffness.knots=5",
        ]);
        let says = summary.contains("a constant stiffness is not rejected");
        assert_eq!(says, name == "constant", "{found}: {summary}");
    }
}
