//! Commands and options besides fits: init, explain, schema, demo, --set, completions, man.

use crate::workbench::{MODEL, Workbench, column, repository, sample_table};
use insta::assert_snapshot;
use serde_json::Value;

#[test]
fn keys_are_explained() {
    let bench = Workbench::empty();
    assert_snapshot!(bench.run_to(0, &["explain", "tolerance"]), @"
    fit.stop.tolerance
      Relative change of J and of the functions in one iteration, for convergence.
      type     a number
      default  1e-10, if no other rule is given
      range    greater than 0
      example  tolerance: 1e-10
    ");
    assert_snapshot!(bench.run_to(0, &["explain", "functions.mass.basis"]), @"
    functions.mass.basis
      Basis of an estimated function, which defines its parameters.
      type     one of the values below
      needs    `start`
      example  basis: piecewise-linear
      also     functions.damping.basis, functions.stiffness.basis, functions.quadratic_stiffness.basis, functions.cubic_stiffness.basis and 13 more

      nodal               One parameter per node of the grid.
      constant            One constant.
      piecewise-constant  One value per interval between knots.
      piecewise-linear    One value per knot, linear in between.
      polynomial          Polynomial over the whole record.
      b-spline            Cubic B-spline.
    ");
    assert_snapshot!(bench.run_to(0, &["explain", "experiments[0].initial"]), @"
    experiments.initial
      Initial state, or `estimate` for displacement and velocity.
      type     `estimate`, or a map with the keys below
      default  none (required)
      example  initial: {displacement: 3.3, velocity: 1.0}

      Initial state: each component a number, `estimate`, or an estimate with a start value or a prior.
      displacement  Initial displacement.
      velocity      Initial velocity.
    ");
    assert_snapshot!(bench.run_to(0, &["explain"]), @"
    Keys of a model file (`kmcfit explain KEY` explains one):

      format       Version of the file format.
      title        Title for reports.
      experiments  Records of one system on a common time axis, measured or to be simulated.
      grid         Time grid and stepper.
      functions    Coefficient functions of the equation of motion.
      constraints  Constraints on the functions beyond their own `min` and `max`; one map for each.
      fit          Method, start and stopping tests of the fit.
      truth        True functions, for reports only.
      predict      Initial states for which the free response is predicted.
      study        Analyses of `kmcfit study`.
    ");
    let (code, stdout, stderr) = bench.run(&["explain", "fit.stop.tolerence"]);
    assert_eq!((code, stdout.as_str()), (2, ""));
    assert_snapshot!(stderr, @"
    error: explain: unknown key
      found: `fit.stop.tolerence`
      expected: a key of a model file, such as `sigma` or `functions.mass`; `kmcfit explain` lists the top-level keys
      hint: did you mean `fit.stop.tolerance`?
    ");
    let stderr = bench.run(&["explain", "nods"]).2;
    assert!(stderr.contains("did you mean `nodes`?"), "{stderr}");
    assert!(bench.contents().is_empty());
}

#[test]
fn the_schema_is_printed() {
    let printed = Workbench::empty().run_to(0, &["schema"]);
    let shipped = std::fs::read_to_string(repository("docs/kmcfit.schema.json")).expect("a file");
    assert!(printed == shipped);
}

/// Each scaffolded model is read without a warning, and its fit explains the record if the table has all information that this
/// needs.
#[test]
fn starters_can_be_fitted() {
    let bench = Workbench::with_shipped_models();
    for (data, fits) in [
        ("paper.csv", 80.0),
        ("accelerometer.txt", 97.0),
        ("roll.tsv", 90.0),
        ("hammer_1.csv", 99.0),
        ("shaker.csv", 99.0),
        ("table.csv", 99.0),
        ("camera.csv", 0.0),
        ("duffing.csv", 0.0),
        ("moving_support.csv", 0.0),
    ] {
        let (data, model) = (format!("data/{data}"), format!("{data}.yaml"));
        bench.run_to(0, &["init", &data, "--out", &model]);
        assert!(bench.read(&model).contains(&format!("data: {data}\n")));
        let (code, _, stderr) = bench.run(&["check", &model]);
        assert_eq!(code, 0, "{model}: {stderr}");
        assert!(!stderr.contains("warning"), "{model}: {stderr}");
        if fits > 0.0 {
            let fit = bench.run_to(0, &["fit", &model, "--no-report", "--json"]);
            let result: Value = serde_json::from_str(&fit).expect("JSON");
            let percent = &result["experiments"][0]["channels"][0]["fit_percent"];
            assert!(
                percent.as_f64().expect("a number") > fits,
                "{model}: {percent}"
            );
        }
    }
    let schema: Value = serde_json::from_str(&bench.read("kmcfit.schema.json")).expect("JSON");
    assert_eq!(schema["title"], "kmcfit model file");
}

/// Errors of arguments have the form of all input errors.
#[test]
fn invalid_arguments_have_found_expected_and_hint() {
    let bench = Workbench::with_small_model();
    let lines: [&[&str]; 15] = [
        &["fti", "model.yaml"],
        &["--jsn"],
        &["fit"],
        &["compare"],
        &["fit", "model.yaml", "--jsn"],
        &["fit", "model.yaml", "other.yaml"],
        &["fit", "model.yaml", "--out"],
        &["fit", "model.yaml", "--out", "a", "--out", "b"],
        &["fit", "model.yaml", "--json", "--plot"],
        &["simulate", "model.yaml", "--noise", "5%"],
        &["simulate", "model.yaml", "--noise", "0.1"],
        &["completions", "tcsh"],
        &["fit", "samples.csv"],
        &["init", "."],
        &["explain", "functions.penalty"],
    ];
    let mut all = String::new();
    for arguments in lines {
        let (code, stdout, said) = bench.run(arguments);
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}");
        all += &format!("$ kmcfit {}\n{said}\n", arguments.join(" "));
    }
    assert_snapshot!(all, @"
    $ kmcfit fti model.yaml
    error: kmcfit: unknown command
      found: `fti`
      expected: one of: fit, fleet, simulate, check, predict, compare, verify, report, study, resume, init, explain, schema, demo, completions, man
      hint: did you mean `fit`?

    $ kmcfit --jsn
    error: kmcfit: unknown argument
      found: `--jsn`
      expected: kmcfit <COMMAND>
      hint: `kmcfit --help` lists the arguments

    $ kmcfit fit
    error: kmcfit fit: <MODEL> is missing
      expected: kmcfit fit [OPTIONS] <MODEL>
      hint: `kmcfit fit --help` lists the arguments

    $ kmcfit compare
    error: kmcfit compare: <MODEL|RUN>... is missing
      expected: kmcfit compare [OPTIONS] <MODEL|RUN>...
      hint: `kmcfit compare --help` lists the arguments

    $ kmcfit fit model.yaml --jsn
    error: kmcfit fit: unknown argument
      found: `--jsn`
      expected: one of: --out, --set, --json, --no-report, --tables, --draws, --timings, --verbose, --strict, --plot, --no-plot, --checkpoint
      hint: did you mean `--json`?

    $ kmcfit fit model.yaml other.yaml
    error: kmcfit fit: unknown argument
      found: `other.yaml`
      expected: kmcfit fit [OPTIONS] <MODEL>
      hint: `kmcfit fit --help` lists the arguments

    $ kmcfit fit model.yaml --out
    error: --out: the value is missing
      expected: --out <OUT>

    $ kmcfit fit model.yaml --out a --out b
    error: --out: given more than once
      expected: this argument at most once

    $ kmcfit fit model.yaml --json --plot
    error: --json: cannot be combined with `--plot`
      expected: one of the two

    $ kmcfit simulate model.yaml --noise 5%
    error: --noise: not a number
      found: `5%`
      expected: a number
      hint: percent is not accepted: write 0.05

    $ kmcfit simulate model.yaml --noise 0.1
    error: kmcfit simulate: --seed <SEED> is missing
      expected: kmcfit simulate [OPTIONS] <MODEL>
      hint: `kmcfit simulate --help` lists the arguments

    $ kmcfit completions tcsh
    error: <SHELL>: invalid value
      found: `tcsh`
      expected: one of: bash, elvish, fish, powershell, zsh

    $ kmcfit fit samples.csv
    error: samples.csv: a record in place of a model file
      expected: a model file (YAML)
      hint: `kmcfit init samples.csv` writes a model file for the record

    $ kmcfit init .
    error: .: this is a folder
      expected: a record: a text table, or a file of NumPy, MATLAB, HDF5, TDMS, WAV or UFF

    $ kmcfit explain functions.penalty
    error: explain: unknown key
      found: `functions.penalty`
      expected: a key of a model file, such as `sigma` or `functions.mass`; `kmcfit explain` lists the top-level keys
      hint: did you mean `functions.mass.penalty`?
    ");
}

#[test]
fn invalid_numbers_have_messages() {
    let bench = Workbench::with_small_model();
    let (code, _, said) = bench.run(&["fit", "model.yaml", "--checkpoint", "often"]);
    assert_eq!(code, 2);
    assert_snapshot!(said, @"
    error: --checkpoint: not a number
      found: `often`
      expected: a number
    ");
    let (code, _, said) = bench.run(&["check", "model.yaml", "--gradient", "--nodes", "100,many"]);
    assert_eq!(code, 2);
    assert_snapshot!(said, @"
    error: --nodes: not a number
      found: `many`
      expected: an integer, 3 or more
    ");
}

#[test]
fn init_prints_the_properties_of_the_record() {
    let bench = Workbench::empty();
    let text = sample_table(201).replace("t_s,y_m", "Time [ms],Weg_mm");
    bench.write("run 1/my data.csv", &text);
    assert_snapshot!(bench.run_to(0, &["init", "run 1/my data.csv"]), @"
    run 1/my data.csv
      201 samples over 0.02 s, one every 0.0001 s
      column `Time [ms]`: time, ms
      column `Weg_mm`: displacement, mm
      dominant frequency 159.6 Hz: 3 periods in the record
      the mass is unknown: the results are ratios to it; `--mass KG` states it
      schema for editors: run 1/kmcfit.schema.json
    Model run 1/my data.yaml; review it, then run
      kmcfit check 'run 1/my data.yaml'
      kmcfit fit 'run 1/my data.yaml'
    ");
    assert_snapshot!(bench.read("run 1/my data.yaml"), @r#"
    # yaml-language-server: $schema=kmcfit.schema.json
    # Model file written by `kmcfit init`. Check it with `kmcfit check`, fit it with `kmcfit fit`;
    # `kmcfit explain KEY` explains a key.
    format: 1
    title: my data
    experiments:
      - name: record 1
        data: my data.csv
        columns: {time: "Time [ms]", displacement: Weg_mm}  # by name or by number from 1
        units: {displacement: mm}                     # converted to SI
        sigma: {displacement: estimate}               # standard deviation of a sample, SI; give a number if it is known
        initial: estimate                             # or {displacement: …, velocity: …} in m and m/s
    grid: {nodes: auto}                               # chosen from the spectrum of the record
    functions:
      mass:      {fixed: unknown}                     # or its value in kg; without it and without a measured force the results are ratios to the mass
      damping:   {basis: constant}                    # 1/s, ratio to the mass; starts from the decay or the frequency response
      stiffness: {basis: constant}                    # 1/s^2, ratio to the mass; the record is too short to show a variation
    # truth: {data: truth.csv}                        # the true functions, where they are known
    fit: {method: gauss-newton, stop: {iterations: 100, tolerance: 1.0e-8}}
    "#);
    let again = bench.run(&["init", "run 1/my data.csv"]);
    assert_eq!(again.0, 2);
    assert_snapshot!(again.2, @"
    error: run 1/my data.yaml: the file exists already
      expected: another name: --out MODEL
    ");
    let said = bench.run_to(
        0,
        &[
            "init",
            "run 1/my data.csv",
            "--sample-rate",
            "500",
            "--out",
            "other.yaml",
        ],
    );
    let taken = "`--sample-rate 500` is used, although `Time [ms]` has 10000 Hz\n";
    assert!(said.contains(taken), "{said}");
    bench.write("bare.csv", &text.replace("Time [ms],Weg_mm", "t,y"));
    let said = bench.run_to(0, &["init", "bare.csv"]);
    assert!(
        said.contains("column `y`: displacement, m; the unit is assumed, please check\n"),
        "{said}"
    );
    bench.write("empty.csv", "t_s,y_m\n0,\n1,\n2,\n");
    assert_snapshot!(bench.run(&["init", "empty.csv"]).2, @"
    error: empty.csv: all samples are missing
      found: no number in the column `y_m`
      expected: at least one sample
    ");
    bench.write("only.csv", "acc\n1\n2\n1\n");
    assert_snapshot!(bench.run(&["init", "only.csv"]).2, @"
    error: only.csv: no column of times
      found: no column whose numbers increase from row to row
      expected: a column of times, or `--sample-rate HZ`
    ");
    assert_snapshot!(bench.run(&["init", "only.csv", "--sample-rate", "0"]).2, @"
    error: --sample-rate: invalid sampling rate
      found: 0.0
      expected: samples per second, a number from 1e-12 to 1e12
    ");
    // The smallest positive number: its reciprocal is infinite.
    let rate = ["init", "only.csv", "--sample-rate", "5e-324"];
    assert_snapshot!(bench.run(&rate).2, @"
    error: --sample-rate: invalid sampling rate
      found: 5e-324
      expected: samples per second, a number from 1e-12 to 1e12
    ");
    assert_snapshot!(bench.run(&["init", "onli.csv"]).2, @"
    error: onli.csv: no such file
      expected: a CSV file with one row of column names and rows of numbers
      hint: did you mean `only.csv`?
    ");
    assert!(!bench.path("only.yaml").exists());
}

#[test]
fn values_are_set() {
    let bench = Workbench::with_small_model();
    let fit = |set: &[&str], out: &str| -> Value {
        let mut arguments = vec!["fit", "model.yaml", "--out", out, "--json"];
        arguments.extend(set.iter().flat_map(|s| ["--set", *s]));
        serde_json::from_str(&bench.run_to(0, &arguments)).expect("JSON")
    };
    let sets = [
        "fit.stop.iterations=3",
        "functions.mass={fixed: 2.5}",
        "experiments.0.sigma.displacement=0.1",
    ];
    let result = fit(&sets, "set");
    assert_eq!(result["counts"]["iterations"], 3);
    assert_eq!(result["functions"]["mass"]["max"], 2.5);
    assert_eq!(result["model"]["cost_kind"], "chi-square");
    assert_eq!(result["model"]["overrides"], serde_json::json!(sets));
    let page = bench.read("set/report.html");
    assert!(page.contains("kmcfit fit model.yaml --set fit.stop.iterations=3 --set"));
    // Equal to a model file with this value.
    let written = MODEL
        .replace("iterations: 5", "iterations: 3")
        .replace("{basis: nodal, start: 2.0}", "{fixed: 2.5}")
        .replace("    initial", "    sigma: {displacement: 0.1}\n    initial");
    bench.write("model.yaml", &written);
    let same = fit(&[], "written");
    assert_eq!(result["cost"], same["cost"]);
    assert_eq!(same["model"].get("overrides"), None);
    assert_eq!(
        bench.read("set/functions.csv"),
        bench.read("written/functions.csv")
    );
}

#[test]
fn check_and_simulate_take_values_too() {
    let bench = Workbench::with_shipped_models();
    let check = [
        "check",
        "models/paper-lbfgs.yaml",
        "--set",
        "grid.nodes=1000",
    ];
    assert!(bench.run_to(0, &check).contains(": 1000 nodes over 25 s"));
    let set = "functions.stiffness={fixed: 4.0}";
    let simulate = [
        "simulate",
        "models/paper-device.yaml",
        "--set",
        set,
        "--out",
        "m.csv",
    ];
    bench.run_to(0, &simulate);
    let record: Value = serde_json::from_str(&bench.read("m.csv.json")).expect("JSON");
    assert_eq!(record["overrides"], serde_json::json!([set]));
    assert_ne!(
        column(&bench.read("m.csv"), "y_m"),
        column(&bench.read("data/paper.csv"), "y_m")
    );
}

#[test]
fn invalid_overrides_have_messages() {
    let bench = Workbench::with_small_model();
    let said = |set: &str| {
        let before = bench.contents();
        let (code, stdout, stderr) = bench.run(&["fit", "model.yaml", "--set", set]);
        assert_eq!((code, stdout.as_str()), (2, ""), "{set}");
        assert_eq!(bench.contents(), before);
        stderr
    };
    let sets = [
        "fit.stop.iteration=5",
        "fitt.stop=5",
        "fit.stop.iterations=2e3",
        "functions.mass.basis=nodes",
        "functions.mass.start=-1",
        "experiments.sigma=1",
        "experiments.3.sigma.displacement=1",
        "title.en=a",
        "fit.0=a",
        "fit.stop.iterations",
        "=5",
        "fit.stop={iterations: ",
        "fit.stop.iterations=",
        "functions.mass.start={data: nothing.csv, column: m}",
    ];
    let all: Vec<String> = sets.iter().map(|set| said(set)).collect();
    assert_snapshot!(all.join("\n"), @"
    error: --set fit.stop.iteration=5: fit.stop: unknown key
      found: `iteration`
      expected: one of: iterations, cost_ratio, gradient_ratio, tolerance, step, seconds
      hint: did you mean `iterations`?

    error: --set fitt.stop=5: unknown key
      found: `fitt`
      expected: one of: format, title, experiments, grid, functions, constraints, fit, truth, predict, study
      hint: did you mean `fit`?

    error: --set fit.stop.iterations=2e3: fit.stop.iterations: not an integer
      found: the floating-point number 2000
      expected: an integer
      hint: write 2000

    error: --set functions.mass.basis=nodes: functions.mass.basis: unknown choice
      found: `nodes`
      expected: one of: nodal, constant, piecewise-constant, piecewise-linear, polynomial, b-spline

    error: --set functions.mass.start=-1: functions.mass.start: the mass must be positive at all times
      found: -1
      expected: a number greater than 0, in kg

    error: --set experiments.sigma=1: experiments is a list
      found: `sigma`
      expected: a position, as in experiments.0.sigma

    error: --set experiments.3.sigma.displacement=1: no such element in the list experiments
      found: position 3
      expected: the position 0

    error: --set title.en=a: title is one value in this model, with no keys below it
      expected: title=VALUE, which replaces it

    error: --set fit.0=a: fit is a map
      found: position 0
      expected: a key

    error: --set: missing `=`
      found: `fit.stop.iterations`
      expected: KEY=VALUE, for instance fit.stop.iterations=50

    error: --set: missing key before `=`
      found: `=5`
      expected: KEY=VALUE, for instance fit.stop.iterations=50

    error: --set: the value cannot be read
      found: `fit.stop={iterations: `
      expected: a value as in a model file: 50, constant, {order: 2, weight: 0.1}, …

    error: --set: the value cannot be read
      found: `fit.stop.iterations=`
      expected: a value as in a model file: 50, constant, {order: 2, weight: 0.1}, …

    error: --set functions.mass.start={data: nothing.csv, column: m}: functions.mass.start.data: nothing.csv: no such file
      expected: a CSV file with one row of column names and rows of numbers
    ");
}

#[test]
fn help_has_help() {
    let bench = Workbench::empty();
    assert_eq!(
        bench.run_to(0, &["help", "--help"]),
        bench.run_to(0, &["help"])
    );
}

#[test]
fn the_demo_needs_nothing() {
    let bench = Workbench::empty();
    let stdout = bench.run_to(0, &["demo"]);
    assert!(stdout.contains("but not by the true system"), "{stdout}");
    assert!(
        stdout.contains("true system recovered: k/m within"),
        "{stdout}"
    );
    assert!(bench.path("runs/demo/results/compare.html").exists());
    for name in ["paper.csv", "paper_truth.csv"] {
        let shipped = std::fs::read_to_string(repository("data").join(name)).expect("a file");
        assert!(bench.read(&format!("runs/demo/data/{name}")) == shipped);
    }
    let model = "runs/demo/models/physical.yaml";
    assert!(stdout.contains(&format!("kmcfit fit {model}")), "{stdout}");
    bench.run_to(0, &["check", model]);
}

/// Every command, by the program's own help.
fn commands(bench: &Workbench) -> Vec<String> {
    let help = bench.run_to(0, &["--help"]);
    let (_, commands) = help.split_once("Commands:\n").expect("commands");
    let (commands, _) = commands.split_once("\n\n").expect("options");
    let is_new = |line: &&str| line.starts_with("  ") && !line.starts_with("   ");
    let names = commands.lines().filter(is_new);
    let names = names.filter_map(|line| line.split_whitespace().next());
    let names: Vec<String> = names.map(str::to_owned).collect();
    assert!(names.len() > 10, "{help}");
    names
}

#[test]
fn completions_know_all_commands() {
    let bench = Workbench::empty();
    let script = bench.run_to(0, &["completions", "bash"]);
    for command in commands(&bench) {
        assert!(script.contains(&format!("kmcfit,{command})")), "{command}");
    }
    for option in ["--set", "--sample-rate"] {
        assert!(script.contains(option), "{option}");
    }
    for shell in ["zsh", "fish", "powershell", "elvish"] {
        assert!(
            bench
                .run_to(0, &["completions", shell])
                .contains("simulate")
        );
    }
}

#[test]
fn the_manual_has_all_options() {
    let bench = Workbench::empty();
    let page = bench.run_to(0, &["man"]).replace("\\-", "-");
    assert!(page.contains(".TH kmcfit 1"), "{page}");
    for command in commands(&bench).iter().filter(|c| *c != "help") {
        assert!(page.contains(&format!(".SS {command}\n")), "{command}");
        let help = bench.run_to(0, &[command, "--help"]);
        let words = help
            .split_whitespace()
            .map(|w| w.trim_end_matches([',', ']']));
        for option in words.filter(|w| w.starts_with("--") && w.len() > 2) {
            assert!(page.contains(option), "{command} {option}");
        }
    }
}
