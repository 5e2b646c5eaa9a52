//! Warnings and suggestions of a summary: each problem of a record is reported, and following the suggestion removes it.

use crate::workbench::Workbench;
use insta::assert_snapshot;
use kmcfit::report::Run;
use kmcfit_core::internals::assessment::ResidualPattern;
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

/// From equal samples no model is scaffolded, and no fit is made.
#[test]
fn a_record_at_rest_is_refused() {
    let bench = Workbench::empty();
    let rows: String = (0..12).map(|i| format!("{i},1\n")).collect();
    bench.write("record.csv", &format!("t,y\n{rows}"));
    let (code, _, stderr) = bench.run(&["init", "record.csv"]);
    assert_eq!(code, 2);
    assert_snapshot!(stderr, @"
    error: record.csv: all samples are equal
      found: 12 samples, all 1
      expected: a record of a moving system
    ");
    for grid in ["{nodes: 9}", "{nodes: auto}", "{}", "{nodes: 200}"] {
        bench.write(
            "model.yaml",
            &starter(grid, "    columns: {time: t, displacement: y}\n"),
        );
        let (code, _, stderr) = bench.run(&["fit", "model.yaml", "--no-report", "--verbose"]);
        assert_eq!(code, 2, "{grid}: {stderr}");
        assert!(
            stderr.contains("columns.displacement: all samples are equal"),
            "{grid}: {stderr}"
        );
        assert!(
            stderr.contains("found: 12 samples, all 1 m\n"),
            "{grid}: {stderr}"
        );
    }
}

/// A growing oscillation has a negative damping, with its interval and in one warning.
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
    assert!(!summary.contains("the damping is negative"), "{summary}");
}

/// With few samples, two per period, the frequency is at best an alias of others.
#[test]
fn a_short_record_near_the_nyquist_frequency_has_no_intervals() {
    let bench = Workbench::empty();
    let rows: String = (0..8).map(|i| format!("{i},{}\n", 1 - i % 2 * 2)).collect();
    bench.write("record.csv", &format!("t_s,y_m\n{rows}"));
    bench.run_to(0, &["init", "record.csv"]);
    let summary = bench
        .run(&["fit", "record.yaml", "--no-report", "--verbose"])
        .1;
    let said = "aliasing: with 2.0 samples per period at 0.500 Hz, systems of other natural frequencies fit equally well";
    assert!(summary.contains(said), "{summary}");
}

/// Disturbance of the sample with this index at this time.
type Spoiler = fn(usize, f64) -> f64;

/// The suggestions for outliers, an offset and a drift remove these.
#[test]
fn suggestions_improve_the_fit() {
    let bench = Workbench::empty();
    let ring_down = |spoilt: Spoiler| {
        let rows = (0..401).map(|i| {
            let t = 0.05 * i as f64;
            let noise = 1e-3 * (12.9898 * i as f64).sin();
            let y = (-0.05 * t).exp() * (2.0 * t).cos() + noise;
            format!("{t},{}\n", y + spoilt(i, t))
        });
        format!("t_s,y_m\n{}", rows.collect::<String>())
    };
    let error = || {
        let printed = bench.run_to(0, &["fit", "model.yaml", "--no-report", "--json"]);
        let result: Value = serde_json::from_str(&printed).expect("JSON");
        let of = |f: &str| result["functions"][f]["max"].as_f64().expect("a number");
        let stiffness = (of("stiffness") / 4.0025 - 1.0).abs();
        stiffness.max((of("damping") / 0.1 - 1.0).abs())
    };
    let spoilers: [(Spoiler, &str, &str); 3] = [
        (
            |i, _| if [60, 61, 200].contains(&i) { 9.0 } else { 0.0 },
            "displacement: 3 outliers, the first at 3 s: use a robust loss (`loss: {displacement: huber}`)",
            "    loss: {displacement: huber}\n",
        ),
        (
            |_, _| 0.1,
            "displacement: the residuals have an offset: estimate it (`sensors: {displacement: {offset: estimate}}`)",
            "    sensors: {displacement: {offset: estimate}}\n",
        ),
        (
            |_, t| 0.01 * (t - 10.0),
            "displacement: the residuals drift: estimate offset and drift (`sensors: {displacement: {offset: estimate, \
             drift: estimate}}`)",
            "    sensors: {displacement: {offset: estimate, drift: estimate}}\n",
        ),
    ];
    for (spoilt, advice, cure) in spoilers {
        bench.write("record.csv", &ring_down(spoilt));
        let sigma = "    sigma: {displacement: 0.001}\n";
        let spoilt = starter("{nodes: 801}", sigma).replace("start: 39", "start: 3.8");
        bench.write("model.yaml", &spoilt);
        let (_, summary, _) = bench.run(&["fit", "model.yaml", "--no-report", "--verbose"]);
        assert!(summary.contains(&format!("Next   {advice}\n")), "{summary}");
        let run = Run::open(bench.path("runs/model")).expect("a run");
        let first = run.document.advice.first().expect("a suggestion");
        assert_eq!(first.kind, "pattern");
        assert_eq!(first.quantities["channel"], "displacement");
        let pattern = first.quantities["pattern"].clone();
        let pattern: ResidualPattern = serde_json::from_value(pattern).expect("a pattern");
        let is_named = match pattern {
            ResidualPattern::Outliers { samples, .. } => samples == 3 && cure.contains("huber"),
            ResidualPattern::Offset => !cure.contains("drift"),
            ResidualPattern::Drift => cure.contains("drift"),
            ResidualPattern::Tone { .. } => false,
        };
        assert!(is_named, "{pattern:?}");
        bench.write(
            "model.yaml",
            &spoilt.replace(sigma, &format!("{sigma}{cure}")),
        );
        assert!(error() < 0.01, "{advice}: {}", error());
    }
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
    let said = "no confidence intervals: the residuals are ";
    assert!(
        summary.contains(&format!("Warnings        {said}")),
        "{summary}"
    );
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
    let said = "the residuals are autocorrelated beyond the noise model: the confidence intervals come from a \
                heteroscedasticity- and autocorrelation-consistent covariance";
    assert!(
        summary.contains(&format!("Warnings        {said}")),
        "{summary}"
    );
    assert!(
        summary.contains("Next   displacement: the residuals oscillate at 0.796 Hz"),
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

/// A five-minute record of a ring-down that lasts one minute: the number of nodes follows the response, not the noise after it.
#[test]
fn nodes_are_not_chosen_for_noise() {
    let bench = Workbench::empty();
    bench.write("record.csv", &ring_down(300, 1e-2));
    bench.run_to(0, &["init", "record.csv"]);
    let (code, _, notes) = bench.run(&["check", "record.yaml"]);
    assert_eq!(code, 0, "{notes}");
    let nodes = notes.split_once("grid: ").expect("a remark").1;
    let nodes: f64 = (nodes.split_once(' ').expect("words").0)
        .parse()
        .expect("a number");
    // By the rule of auto, for 0.32 Hz over 300 s and a phase error of 3e-3 rad by the noise: 300 s / (0.36 / 600)^(1/4) * 2 rad/s = 3800;
    // for noise up to 10 Hz it would be 64 per sample.
    assert!((2e3..8e3).contains(&nodes), "{notes}");
}

/// A table with a number added to its second column.
fn shifted(table: &str, offset: f64) -> String {
    let far = |row: &str| match row.split_once(',') {
        Some((t, y)) => match y.parse::<f64>() {
            Ok(y) => format!("{t},{}\n", y + offset),
            Err(_) => format!("{row}\n"),
        },
        None => String::new(),
    };
    table.lines().map(far).collect()
}

/// An offset of half the standard deviation of the noise is a warning, and its suggestion removes it.
#[test]
fn a_mean_of_the_residuals_is_reported() {
    let bench = Workbench::empty();
    bench.write("record.csv", &shifted(&ring_down(20, 1e-3), 3e-4));
    let sigma = "    sigma: {displacement: estimate}\n";
    let model = starter("{nodes: 801}", sigma).replace("39", "3.8");
    bench.write("model.yaml", &model);
    let summary = bench.run_to(0, &["fit", "model.yaml", "--no-report", "--verbose"]);
    let said =
        "the residuals of the displacement of experiment 1 have a mean of 0.48 standard deviations";
    assert!(summary.contains(said), "{summary}");
    let remedy = "sensors: {displacement: {offset: estimate}}";
    let advice = format!(
        "Next   displacement of experiment 1: estimate the offset of the sensor (`{remedy}`) or, nearly equivalent, \
         a static force (`static_force: {{basis: constant, start: 0.0}}` under `functions`)\n"
    );
    assert!(summary.contains(&advice), "{summary}");
    for (place, change) in [
        (sigma, format!("{sigma}    {remedy}\n")),
        (
            "fit: {",
            "  static_force: {basis: constant, start: 0.0}\nfit: {".to_owned(),
        ),
    ] {
        bench.write("model.yaml", &model.replace(place, &change));
        let summary = bench.run_to(0, &["fit", "model.yaml", "--no-report", "--verbose"]);
        assert!(!summary.contains("have a mean"), "{summary}");
    }
}

/// Two modes under a measured force are a warning before the fit.
#[test]
fn two_modes_of_a_forced_record_are_reported() {
    let bench = Workbench::empty();
    let modes = [[1.0, 0.03], [2.6, 0.03]].map(|[frequency, ratio]: [f64; 2]| {
        let omega = std::f64::consts::TAU * frequency;
        [omega * omega, 2.0 * ratio * omega]
    });
    let step = 0.0025;
    let mut states = [[0.0f64; 2]; 2];
    let mut rows = String::new();
    for i in 0..160_000u32 {
        let force = pseudo_random(i / 20);
        if i % 20 == 0 {
            let y: f64 = states.iter().map(|[y, _]| y).sum();
            rows += &format!("{},{force},{y}\n", step * f64::from(i));
        }
        for ([k, c], [y, v]) in modes.iter().zip(&mut states) {
            *v += step * (force - c * *v - k * *y);
            *y += step * *v;
        }
    }
    bench.write("record.csv", &format!("t_s,F_N,y_m\n{rows}"));
    let columns = "    columns: {displacement: y_m, force: F_N}\n    force: {interpolation: hold}\n    \
                   sigma: {displacement: estimate}\n";
    bench.write("model.yaml", &starter("{nodes: auto}", columns));
    let (_, _, notes) = bench.run(&["check", "model.yaml"]);
    assert!(
        notes.contains("two modes vibrate in the displacement, at 1 and 2.6"),
        "{notes}"
    );
}

/// A laser at a stand-off distance: the samples oscillate about an offset.
#[test]
fn a_displacement_with_an_offset_gets_an_estimated_offset() {
    let bench = Workbench::empty();
    bench.write("record.csv", &shifted(&ring_down(20, 1e-2), 5.0));
    bench.run_to(0, &["init", "record.csv"]);
    let model = bench.read("record.yaml");
    assert!(
        model.contains("sensors: {displacement: {offset: estimate}}"),
        "{model}"
    );
    let summary = bench.run_to(0, &["fit", "record.yaml", "--no-report", "--verbose"]);
    assert!(summary.contains("stiffness is identified"), "{summary}");
}

/// For a column of times that do not increase, the message gives the row.
#[test]
fn a_starter_shows_where_times_do_not_increase() {
    let bench = Workbench::empty();
    let rows: String = (0..20)
        .map(|i| format!("{},{}\n", i - 2 * (i / 12), i % 4))
        .collect();
    bench.write("record.csv", &format!("time_s,y_m\n{rows}"));
    let (code, _, stderr) = bench.run(&["init", "record.csv"]);
    assert_eq!(code, 2);
    assert_snapshot!(stderr, @"
    error: record.csv:14: column `time_s`: the times do not increase
       |
    14 | 10,0
       | ^^
      found: 10 after 11 in line 13
      expected: a time greater than 11
      hint: correct the times in the file; `--sample-rate HZ` replaces them if the samples are equally spaced
    ");
}

/// A system with m = 1, c = 0.2, k = 9 from rest under a force that is recorded with the wrong sign.
#[test]
fn a_force_of_the_wrong_sign_is_suggested() {
    let bench = Workbench::empty();
    let force = |t: f64| (0.3 * t + 0.05 * t * t).sin();
    let acceleration = |t: f64, y: f64, v: f64| force(t) - 0.2 * v - 9.0 * y;
    let (mut y, mut v) = (0.0f64, 0.0f64);
    let mut rows = [String::new(), String::new()];
    let step = 0.001;
    for i in 0..=20_000 {
        let t = step * f64::from(i);
        if i % 50 == 0 {
            rows[0] += &format!("{t},{},{y}\n", force(t));
            rows[1] += &format!("{t},{},{y}\n", -force(t));
        }
        let half = [y + 0.5 * step * v, v + 0.5 * step * acceleration(t, y, v)];
        y += step * half[1];
        v += step * acceleration(t + 0.5 * step, half[0], half[1]);
    }
    let fitted = |rows: &str, initial: &str| {
        bench.write("record.csv", &format!("t_s,F_N,y_m\n{rows}"));
        let model = starter(
            "{nodes: 801}",
            "    columns: {time: t_s, force: F_N, displacement: y_m}\n    sigma: {displacement: estimate}\n",
        );
        let model = model.replace("{fixed: 1.0}", "{basis: constant, start: 1.2}");
        // No system follows the wrong sign: the search ends at its limit of iterations.
        let model = model
            .replace("start: 39", "start: 8")
            .replace("initial: estimate", initial)
            .replace("gauss-newton}", "gauss-newton, stop: {iterations: 60}}");
        bench.write("model.yaml", &model);
        bench
            .run(&["fit", "model.yaml", "--no-report", "--verbose"])
            .1
    };
    let right = fitted(&rows[0], "initial: estimate");
    assert!(right.contains("stiffness is identified"), "{right}");
    assert!(!right.contains("check sign"), "{right}");
    let wrong = fitted(&rows[1], "initial: estimate");
    assert!(
        wrong.contains("check sign") && wrong.contains("of the force"),
        "{wrong}"
    );
    assert!(!wrong.contains("initial: estimate"), "{wrong}");
    let wrong = fitted(&rows[1], "initial: {displacement: 0, velocity: 0}");
    assert!(
        wrong.contains("the initial state (`initial: estimate`)"),
        "{wrong}"
    );
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

/// On fine grids bands are computed at some of the nodes and interpolated between them; each row has the band of its time.
#[test]
fn bands_contain_the_functions_on_many_nodes() {
    let bench = Workbench::empty();
    bench.write("record.csv", &ring_down(20, 1e-2));
    let sigma = "    sigma: {displacement: estimate}\n";
    let model = starter("{nodes: 9001}", sigma).replace(
        "{basis: constant, start: 39}",
        "{basis: piecewise-linear, knots: 5, start: 3.8}",
    );
    bench.write("model.yaml", &model);
    bench.run_to(
        0,
        &[
            "fit",
            "model.yaml",
            "--no-report",
            "--tables",
            "--out",
            "out",
        ],
    );
    let table = bench.read("out/functions.csv");
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let column = |name: &str| header.iter().position(|h| *h == name).expect(name);
    let [value, low, high] = [
        "stiffness_N_per_m",
        "stiffness_N_per_m_lo95",
        "stiffness_N_per_m_hi95",
    ]
    .map(column);
    let mut rows = 0;
    for line in lines {
        let numbers: Vec<f64> = line.split(',').map(|x| x.parse().expect(line)).collect();
        // The ends are interpolated linearly between every third node; the knots lie on some of the others.
        let slack = 1e-3 * (numbers[high] - numbers[low]);
        assert!(
            numbers[low] - slack <= numbers[value] && numbers[value] <= numbers[high] + slack,
            "{line}"
        );
        rows += 1;
    }
    assert_eq!(rows, 9001);
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

/// `samples` at every 0.05 s, as a table.
fn table_of(samples: impl Fn(u32, f64) -> f64) -> String {
    let row = |i: u32| {
        let t = 0.05 * f64::from(i);
        format!("{t},{}\n", samples(i, t))
    };
    format!("t_s,y_mm\n{}", (0..=400).map(row).collect::<String>())
}

/// A system that is released after four seconds at rest, and one that is struck then.
#[test]
fn rest_at_the_beginning_is_excluded() {
    let bench = Workbench::empty();
    for (is_held, begins) in [(true, "4.4"), (false, "4.1")] {
        let reading = |i: u32, t: f64| {
            let t = t - 4.0;
            let phase = if is_held {
                (2.0 * t).cos()
            } else {
                (2.0 * t).sin()
            };
            let swing = match t >= 0.0 {
                true => (-0.05 * t).exp() * phase,
                false => f64::from(u8::from(is_held)),
            };
            swing + 0.01 * pseudo_random(i)
        };
        bench.write("record.csv", &table_of(reading));
        let _ = std::fs::remove_file(bench.path("record.yaml"));
        let said = bench.run_to(0, &["init", "record.csv"]);
        let moves = format!("at rest before {begins} s: excluded by `window`\n");
        assert!(said.contains(&moves), "{said}");
        let window = format!("window: {{min: {begins}}}");
        assert!(bench.read("record.yaml").contains(&window));
        let (code, _, told) = bench.run(&["check", "record.yaml"]);
        assert!(code == 0 && !told.contains("warning"), "{told}");
        let whole = bench
            .read("record.yaml")
            .replace(&window, "window: {min: 0}");
        bench.write("whole.yaml", &whole);
        let (_, _, told) = bench.run(&["check", "whole.yaml"]);
        let hint =
            format!("the displacement is at rest before {begins} s; a free decay must begin");
        assert!(told.contains(&hint) && told.contains(&window), "{told}");
        // On the clock of the logger, and with `time_zero`.
        let late = |row: &str| match row.split_once(',').map(|(t, y)| (t.parse::<f64>(), y)) {
            Some((Ok(t), y)) => format!("{:.2},{y}\n", 1_700_006_000.0 + t),
            _ => format!("{row}\n"),
        };
        let table = bench.read("record.csv");
        bench.write("late.csv", &table.lines().map(late).collect::<String>());
        let _ = std::fs::remove_file(bench.path("late.yaml"));
        bench.run_to(0, &["init", "late.csv"]);
        let window = format!("window: {{min: 170000600{begins}}}");
        let late = bench.read("late.yaml");
        assert!(late.contains(&window), "{late}");
        let zero = late.replace(&window, "time_zero: 1700006000");
        bench.write("late.yaml", &zero);
        let (code, _, told) = bench.run(&["check", "late.yaml"]);
        assert!(code == 0 && told.contains(&window), "{told}");
    }
}

/// Sentinel values among the samples, under a quadratic and under a robust loss: the second fit is assessed by the samples that are not
/// outliers, for a right and a wrong model.
#[test]
fn a_robust_fit_is_assessed_without_outliers() {
    let bench = Workbench::empty();
    let reading = |i: u32, t: f64| match i % 90 {
        17 => -9999.0,
        _ => 3.0 * (-0.05 * t).exp() * (2.0 * t).cos() + 0.03 * pseudo_random(i),
    };
    bench.write("record.csv", &table_of(reading));
    let said = bench.run_to(0, &["init", "record.csv"]);
    let far = "5 outliers (first: -9999): if these stand for missing samples, use empty fields; the model has a robust loss\n";
    assert!(said.contains(far), "{said}");
    assert!(said.contains("dominant frequency 0.31"), "{said}");
    let robust = bench.read("record.yaml");
    let loss = "loss: {displacement: huber}";
    assert!(robust.contains(loss));
    let squares = robust.replace(loss, "");
    bench.write("squares.yaml", &squares);
    let (_, _, told) = bench.run(&["check", "squares.yaml"]);
    let lie =
        "5 outliers in the displacement, the first -9999 mm at 0.85 s; delete them (empty fields)";
    assert!(told.contains(lie), "{told}");

    let fit = [
        "fit",
        "record.yaml",
        "--no-report",
        "--set",
        "grid.nodes=801",
        "--verbose",
    ];
    let summary = bench.run_to(0, &fit);
    let matched = "5 outliers rejected\n";
    assert!(summary.contains(matched), "{summary}");
    assert!(summary.contains("\nFit    99."), "{summary}");
    assert!(summary.contains("stiffness is identified"), "{summary}");
    assert!(
        summary.contains("no significant autocorrelation of the residuals"),
        "{summary}"
    );
    // Without a sigma a robust loss needs one, too.
    bench.write(
        "bare.yaml",
        &squares
            .replace("sigma: {displacement: estimate}", "")
            .replace("knots: auto", "knots: 11"),
    );
    let (_, _, told) = bench.run(&["check", "bare.yaml"]);
    assert!(
        told.contains("(`loss: {displacement: huber}`, with `sigma`)"),
        "{told}"
    );
    // A model that cannot match the samples.
    let wrong =
        "functions={mass: {fixed: 1.0}, damping: {basis: constant}, stiffness: {fixed: 9.0}}";
    let wrong = ["--set", wrong];
    let summary = bench.run_to(0, &[fit.as_slice(), &wrong].concat());
    assert!(!summary.contains("is identified"), "{summary}");
    assert!(
        summary.contains("the residuals are large and autocorrelated"),
        "{summary}"
    );
}

/// Two sensors of one response, of which one may be reversed.
#[test]
fn a_reversed_sensor_is_reported() {
    let bench = Workbench::empty();
    let table = |sign: f64| {
        let rows = (0..=400).map(|i| {
            let t = 0.05 * f64::from(i);
            let (decay, phase) = ((-0.05 * t).exp(), 2.0 * t);
            let y = decay * phase.cos() + 0.02 * pseudo_random(i) + 0.3 + 0.01 * t;
            let v = decay * (-0.05 * phase.cos() - 2.0 * phase.sin());
            let a = decay * ((0.0025 - 4.0) * phase.cos() + 0.2 * phase.sin());
            format!("{t},{y},{},{}\n", sign * v, sign * a)
        });
        format!("t_s,y_m,v_mps,a_mps2\n{}", rows.collect::<String>())
    };
    let check = |kinds: [&str; 2], more: &str| {
        let columns = [
            ("displacement", "y_m"),
            ("velocity", "v_mps"),
            ("acceleration", "a_mps2"),
        ];
        let named = columns.into_iter().filter(|(kind, _)| kinds.contains(kind));
        let columns: String = named
            .map(|(kind, column)| format!("{kind}: {column}, "))
            .collect();
        let sigma = kinds.map(|kind| format!("{kind}: 0.02")).join(", ");
        let lines = format!("    columns: {{{columns}}}\n    sigma: {{{sigma}}}\n{more}");
        bench.write("model.yaml", &starter("{nodes: 401}", &lines));
        let (code, _, said) = bench.run(&["check", "model.yaml"]);
        assert_eq!(code, 0, "{said}");
        said.contains("opposite signs")
    };
    let pairs = [
        ["displacement", "velocity"],
        ["displacement", "acceleration"],
        ["velocity", "acceleration"],
    ];
    let turned = "    sensors: {velocity: {gain: -1}}\n";
    bench.write("record.csv", &table(1.0));
    assert_eq!(pairs.map(|pair| check(pair, "")), [false; 3]);
    assert!(check(pairs[0], turned));
    bench.write("record.csv", &table(-1.0));
    assert_eq!(pairs.map(|pair| check(pair, "")), [true, true, false]);
    assert!(!check(pairs[0], turned));
    assert!(!check(pairs[0], &turned.replace("-1", "{start: 1}")));
    assert!(check(pairs[2], turned));
    // In a monotone decay both have the same sign.
    let falls = (0..=400).map(|i| (0.05 * f64::from(i), (-0.02 * f64::from(i)).exp()));
    let rows: String = falls
        .map(|(t, y)| format!("{t},{y},{},{}\n", -0.4 * y, 0.16 * y))
        .collect();
    bench.write("record.csv", &format!("t_s,y_m,v_mps,a_mps2\n{rows}"));
    assert_eq!(pairs.map(|pair| check(pair, "")), [false; 3]);
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
    assert!(summary.contains("times the rms residual"), "{summary}");
    assert!(!summary.contains("is identified"), "{summary}");
    assert!(
        summary.contains("the time step is too coarse: use grid.nodes=auto"),
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
        summary.contains("validation record `other`: fit "),
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
            900.0
        } else {
            (10.0 * t).cos()
        };
        format!("{t},{},{y}", -0.1 * (10.0 * t).cos())
    };
    let model = record("t_s,a_m_per_s2,y_mm", &spikes);
    assert!(model.contains("loss: {displacement: huber}"), "{model}");
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

/// A second mode, or mains hum: residuals that oscillate at another frequency, which `band` removes.
#[test]
fn a_tone_in_the_residuals_is_named() {
    let bench = Workbench::empty();
    let rows: String = (0..500)
        .map(|i| {
            let t = 0.02 * f64::from(i);
            let y =
                (-0.2 * t).exp() * (10.0 * t).cos() + 0.3 * (-0.05 * t).exp() * (23.0 * t).cos();
            format!("{t},{}\n", y + 1e-2 * pseudo_random(i as u32))
        })
        .collect();
    bench.write("record.csv", &format!("t_s,y_m\n{rows}"));
    let model = starter("{nodes: 2001}", "    sigma: {displacement: estimate}\n")
        .replace("start: 39", "start: 100");
    bench.write("model.yaml", &model);
    let (_, summary, _) = bench.run(&["fit", "model.yaml", "--no-report", "--verbose"]);
    let advice = "displacement: the residuals oscillate at 3.66 Hz, the response at 1.59 Hz";
    assert!(summary.contains(advice), "{summary}");
    assert!(
        summary.contains("`band` with a `max` between the two"),
        "{summary}"
    );
    let set = "experiments.0.band={max: 2.5}";
    let (_, better, stderr) = bench.run(&["fit", "model.yaml", "--no-report", "--set", set]);
    let fit = |text: &str| -> f64 {
        let (_, fit) = text.split_once("\nFit    ").expect("a fit");
        fit.split_once(" %")
            .expect("per cent")
            .0
            .parse()
            .expect("a number")
    };
    assert!(fit(&better) > fit(&summary) + 10.0, "{better}{stderr}");
}

/// An oscillation sustained by an unknown force, with a random phase, is not a ring-down: its displacement is hardly fitted, its
/// acceleration is.
#[test]
fn an_unknown_force_is_suggested_for_sustained_oscillations() {
    let bench = Workbench::empty();
    let rows: String = (0..2000)
        .map(|i| {
            let t = 0.05 * f64::from(i);
            let y = (6.2 * t + 3.0 * (0.31 * t).sin() + 2.0 * (0.17 * t).sin()).cos();
            format!("{t},{y}\n")
        })
        .collect();
    bench.write("record.csv", &format!("t_s,y_m\n{rows}"));
    let columns = "    columns: {time: t_s, displacement: y_m}\n";
    bench.write("model.yaml", &starter("{nodes: 2000}", columns));
    let advice = "if an unmeasured force acts, fit the equation of motion instead (fit.method=equation-error)";
    let fit = ["fit", "model.yaml", "--no-report", "--verbose"];
    let (_, summary, stderr) = bench.run(&fit);
    assert!(summary.contains(advice), "{summary}{stderr}");
    bench.run_to(
        0,
        &[
            "fit",
            "model.yaml",
            "--no-report",
            "--set",
            "fit.method=equation-error",
            "--out",
            "again",
        ],
    );
    let again = bench.read("again/result.json");
    let result: Value = serde_json::from_str(&again).expect("JSON");
    let stiffness = result["functions"]["stiffness"]["max"]
        .as_f64()
        .expect("a number");
    // The frequency varies from 4.9 to 7.5 rad/s about 6.2 rad/s.
    assert!((24.0..56.0).contains(&stiffness), "{stiffness}");
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
