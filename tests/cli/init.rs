//! `kmcfit init`: options, several records, units and the known scale.

use crate::workbench::Workbench;
use insta::assert_snapshot;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write;

/// Samples of a decay of 2 Hz and 1 % damping, `scale` times a displacement in m, at times `second` times those in s.
fn decay(header: &str, second: f64, scale: f64) -> String {
    let mut text = format!("{header}\n");
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for i in 0..600 {
        let t = 0.01 * f64::from(i);
        let noise = random.random_range(-0.5..0.5);
        let y = 0.02 * (-0.126 * t).exp() * (12.566 * t).cos() + 2e-4 * noise;
        let _ = writeln!(text, "{},{:.6}", second * t, scale * y);
    }
    text
}

/// Base of messages: 2, nothing on standard output, no file.
fn refused(bench: &Workbench, arguments: &[&str]) -> String {
    let before = bench.contents();
    let (code, stdout, stderr) = bench.run(arguments);
    assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
    assert_eq!(bench.contents(), before, "{arguments:?} left something");
    stderr
}

/// The keys of a model file, without comments.
fn keys(text: &str) -> String {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let lines = lines.map(|line| line.split("  #").next().unwrap_or_default().trim_end());
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn several_records_are_the_experiments_of_one_model() {
    let bench = Workbench::empty();
    bench.write("hit_1.csv", &decay("t,y", 1000.0, 1000.0));
    bench.write("hit_2.csv", &decay("t,y", 1000.0, 900.0));
    let arguments = [
        "init",
        "hit_1.csv",
        "hit_2.csv",
        "--mass",
        "4.5",
        "--units",
        "time=ms,y=mm",
        "--out",
        "hits.yaml",
    ];
    assert_snapshot!(bench.run_to(0, &arguments), @"
    hit_1.csv
      600 samples over 5.99 s, one every 0.01 s
      column `t`: time, ms
      column `y`: displacement, mm
      dominant frequency 2 Hz: 12 periods in the record
    hit_2.csv
      600 samples over 5.99 s, one every 0.01 s
      column `t`: time, ms
      column `y`: displacement, mm
      dominant frequency 2 Hz: 12 periods in the record
      schema for editors: kmcfit.schema.json
    Model hits.yaml; review it, then run
      kmcfit check hits.yaml
      kmcfit fit hits.yaml
    ");
    assert_snapshot!(keys(&bench.read("hits.yaml")), @r#"
    format: 1
    title: hit_1
    experiments:
      - name: "record 1: hit_1"
        data: hit_1.csv
        columns: {time: t, displacement: y}
        units: {time: ms, displacement: mm}
        sigma: {displacement: estimate}
        sensors: {displacement: {offset: estimate}}
        initial: estimate
      - name: "record 2: hit_2"
        data: hit_2.csv
        columns: {time: t, displacement: y}
        units: {time: ms, displacement: mm}
        sigma: {displacement: estimate}
        sensors: {displacement: {offset: estimate}}
        initial: estimate
    grid: {nodes: auto}
    functions:
      mass:      {fixed: 4.5}
      damping:   {basis: constant}
      stiffness: {basis: constant}
    fit: {method: gauss-newton, stop: {iterations: 100, tolerance: 1.0e-8}}
    "#);
    let (code, stdout, stderr) = bench.run(&["check", "hits.yaml"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(!stdout.contains("assumed"), "{stdout}");
    assert!(!stderr.contains("warning"), "{stderr}");
    // Starts follow the mass and the dominant frequency: k = m (2 pi f)^2 within the resolution of the spectrum.
    let start = |set: &str| {
        let stdout = bench.run_to(0, &["check", "hits.yaml", "--set", set]);
        let (_, rest) = stdout.split_once("stiffness ").expect("a start");
        let number: f64 = rest
            .split(' ')
            .next()
            .and_then(|x| x.parse().ok())
            .expect("a number");
        number
    };
    let stiffness = start("functions.mass.fixed=4.5");
    assert!(
        (stiffness / (4.5 * 12.566f64.powi(2)) - 1.0).abs() < 0.05,
        "{stiffness}"
    );
    assert!((start("functions.mass.fixed=45") / stiffness - 10.0).abs() < 0.01);
}

/// A unit states the quantity of a column whose name does not.
#[test]
fn columns_are_stated_by_options() {
    let bench = Workbench::empty();
    let mut text = String::from("t,ch1,ch2,ch3\n");
    for i in 0..400 {
        let t = 0.01 * f64::from(i);
        let _ = writeln!(
            text,
            "{t},{},{},{}",
            (9.0 * t).sin(),
            (12.0 * t).cos(),
            (7.0 * t).sin()
        );
    }
    bench.write("logger.csv", &text);
    let columns = |arguments: &[&str]| {
        let _ = std::fs::remove_file(bench.path("logger.yaml"));
        bench.run_to(0, &[&["init", "logger.csv"], arguments].concat());
        let text = keys(&bench.read("logger.yaml"));
        let lines = text.lines().filter(|line| {
            ["    columns", "    units"]
                .iter()
                .any(|key| line.starts_with(key))
        });
        lines.map(str::trim).collect::<Vec<_>>().join("\n")
    };
    assert_snapshot!(columns(&["--units", "ch1=kN,ch2=50 g"]), @r#"
    columns: {time: t, force: ch1, acceleration: ch2}
    units: {force: kN, acceleration: "50 g"}
    "#);
    assert_snapshot!(columns(&["--units", "2=kN,acceleration=g"]), @"
    columns: {time: t, force: ch1, acceleration: ch2}
    units: {force: kN, acceleration: g}
    ");
    assert_snapshot!(columns(&[]), @"columns: {time: t, displacement: ch1}");
}

#[test]
fn invalid_statements_have_messages() {
    let bench = Workbench::empty();
    bench.write("ring.csv", &decay("t_s,y_m", 1.0, 1.0));
    let with = |more: &[&str]| refused(&bench, &[&["init", "ring.csv"], more].concat());
    let cases: [&[&str]; 13] = [
        &["--mass", "heavy"],
        &["--mass", "0"],
        &["--mass", "-4.5"],
        &["--fix", "stiffness"],
        &["--force", "y"],
        &["--base", "9"],
        &["--units", "time=mm"],
        &["--units", "displacment=mm"],
        &["--units", "y_m=mmm"],
        &["--units", "force=kN"],
        &["--units", "50 g"],
        &["--units", "displacement=0 mm"],
        &["ring.csv"],
    ];
    let mut all = String::new();
    for arguments in cases {
        let _ = writeln!(all, "{}\n{}", arguments.join(" "), with(arguments));
    }
    assert_snapshot!("statements_of_init", all);
}

/// A record in place of a model file, text or binary, is answered with the command that makes one, except by `fit`.
#[test]
fn a_record_in_place_of_a_model_leads_to_init() {
    let bench = Workbench::empty();
    bench.write("ring.csv", &decay("t_s,y_m", 1.0, 1.0));
    assert_snapshot!(refused(&bench, &["study", "ring.csv"]), @"
    error: ring.csv: a record in place of a model file
      expected: a model file (YAML)
      hint: `kmcfit init ring.csv` writes a model file for the record, `kmcfit fit ring.csv` fits it
    ");
    std::fs::write(bench.path("ring.mat"), [0u8, 159, 146, 150]).expect("room");
    assert_snapshot!(refused(&bench, &["fit", "ring.mat"]), @"
    error: ring.mat: the file is no MATLAB file (version 5 to 7), although its name ends with .mat
      found: the bytes 00 9f 92 96
      expected: the first bytes of a MATLAB file (version 5 to 7)
      hint: if it is a text table, rename it to .txt
    ");
}

/// Without a known scale the results are ratios to the mass, and no result depends on an assumed mass.
#[test]
fn an_unknown_mass_leaves_ratios() {
    let bench = Workbench::empty();
    bench.write("ring.csv", &decay("t_s,y_m", 1.0, 1.0));
    bench.run_to(0, &["init", "ring.csv"]);
    let text = bench.read("ring.yaml");
    assert!(text.contains("{fixed: unknown}"), "{text}");
    let run = |more: &[&str]| {
        let text = bench.run_to(
            0,
            &[&["fit", "ring.yaml", "--json", "--no-report"], more].concat(),
        );
        let result: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        result
    };
    let result = run(&[]);
    let estimates = result["estimates"].as_object().expect("estimates");
    let names: Vec<&String> = estimates.keys().collect();
    assert_eq!(
        names,
        ["natural_frequency", "damping_ratio", "k_over_m", "c_over_m"]
    );
    assert_eq!(result["model"]["mass_unknown"], true);
    assert_eq!(result["functions"]["stiffness"]["unit"], "1/s^2");
    assert_eq!(result["verdict"]["level"], "adequate");
    // The same ratios as with a mass.
    let with_mass = run(&["--set", "functions.mass.fixed=4.5", "--out", "weighed"]);
    for name in ["natural_frequency", "damping_ratio", "k_over_m", "c_over_m"] {
        let [a, b] = [&result, &with_mass].map(|r| {
            let estimate = &r["estimates"][name];
            [
                &estimate["value"],
                &estimate["ci95"][0],
                &estimate["ci95"][1],
            ]
            .map(|x| x.as_f64().expect("a number"))
        });
        for (a, b) in a.iter().zip(b) {
            // Both fits stop at a relative change of J of 1e-8.
            assert!((a / b - 1.0).abs() < 1e-5, "{name}: {a} {b}");
        }
    }
    // A further term is a ratio as well.
    let cubic = run(&[
        "--set",
        "functions.cubic_stiffness={basis: constant, start: 0.0}",
        "--out",
        "cubic",
    ]);
    let ratio = &cubic["estimates"]["cubic_stiffness_over_m"];
    assert_eq!(ratio["unit"], "1/(m^2 s^2)");
    assert_eq!(ratio["status"], "estimated");
    assert_eq!(cubic["estimates"].get("cubic_stiffness"), None);
    assert_snapshot!(bench.run_to(0, &["fit", "ring.yaml", "--out", "shown"]), @"
    ring: 600 samples, 5.99 s
    Adequate   no significant autocorrelation of the residuals; step-size check passed; no candidate is preferred to the model

                                estimate  95 % CI               unit   status
    undamped natural frequency  2.000001  1.999957 to 2.000046  Hz     estimated
    damping ratio               0.010047  0.010025 to 0.010069         estimated
    stiffness / mass            157.9139  157.9068 to 157.9209  1/s^2  estimated
    damping / mass               0.25250  0.25195 to 0.25306    1/s    estimated

    Mass   the mass is unknown: all coefficients are ratios to it; `--set functions.mass.fixed=4.5` (kg) states it
    Fit    99.44 % of displacement; residual 5.74e-5 m rms
           extremes of the decay 2.0015 Hz, damping ratio 0.01007 (logarithmic decrement): agree with the estimates
    results in shown
    ");
    bench.write("force.csv", "t_s,f_N\n0,1\n1,2\n2,1\n");
    assert_snapshot!(refused(&bench, &["predict", "shown", "--force", "force.csv"]), @"
    error: --force: the mass of the fitted system is unknown
      found: force.csv
      expected: a motion of the base: `--base FILE`; the response to a force depends on the mass
      hint: fit with the mass: `--set functions.mass.fixed=4.5` (kg)
    ");
}

/// The written model is accepted as it is, whatever the columns are.
#[test]
fn a_written_model_passes_check_and_fit() {
    let headers = [
        "t_s,base_displacement_mm,displacement_mm",
        "t_s,base_acceleration_m_s2,displacement_mm",
        "t_s,force_N,velocity_mm_s",
        "t_s,displacement_mm,velocity_mm_s",
        "t_s,force_N,acceleration_g",
    ];
    for header in headers {
        let bench = Workbench::empty();
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut text = format!("{header}\n");
        for i in 0..600 {
            let t = 0.01 * f64::from(i);
            let noise = 0.01 * random.random_range(-0.5..0.5);
            let [one, two] = [(9.0 * t).sin(), (9.0 * t - 0.5).sin() + noise];
            let _ = writeln!(text, "{t:.2},{one:.6},{two:.6}");
        }
        bench.write("a.csv", &text);
        bench.run_to(0, &["init", "a.csv"]);
        bench.run_to(0, &["check", "a.yaml"]);
        // The fit may end before it converges: the columns are no response of one oscillator.
        let (code, _, message) = bench.run(&["fit", "a.yaml", "--out", "run", "--no-report"]);
        assert!(matches!(code, 0 | 3), "{header}: {message}");
    }
}
