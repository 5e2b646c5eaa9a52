//! Commands and options besides fits: init, explain, schema, demo, --set, completions.

use crate::workbench::{MODEL, Workbench, repository, sample_table};
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
      also     functions.damping.basis, functions.stiffness.basis, functions.quadratic_stiffness.basis, functions.cubic_stiffness.basis and 15 more

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

/// Errors of arguments have the form of all input errors.
#[test]
fn invalid_arguments_have_found_expected_and_hint() {
    let bench = Workbench::with_small_model();
    let lines: [&[&str]; 16] = [
        &["fti", "model.yaml"],
        &["--jsn"],
        &["fit"],
        &["compare"],
        &["fit", "model.yaml", "--jsn"],
        &["fit", "model.yaml", "other.yaml"],
        &["fit", "model.yaml", "--out"],
        &["fit", "model.yaml", "--out", "a", "--out", "b"],
        &["fit", "model.yaml", "--json", "--no-plot"],
        &["fit", "model.yaml", "--plot"],
        &["report", "runs/model"],
        &["simulate", "model.yaml", "--noise", "5%"],
        &["simulate", "model.yaml", "--noise", "0.1"],
        &["completions", "tcsh"],
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
      expected: one of: fit, fleet, simulate, check, predict, compare, verify, study, init, explain, schema, demo, completions
      hint: did you mean `fit`?

    $ kmcfit --jsn
    error: kmcfit: unknown argument
      found: `--jsn`
      expected: kmcfit <COMMAND>
      hint: `kmcfit --help` lists the arguments

    $ kmcfit fit
    error: kmcfit fit: <MODEL|RECORD> is missing
      expected: kmcfit fit [OPTIONS] <MODEL|RECORD>
      hint: `kmcfit fit --help` lists the arguments

    $ kmcfit compare
    error: kmcfit compare: <MODEL|RUN>... is missing
      expected: kmcfit compare [OPTIONS] <MODEL|RUN>...
      hint: `kmcfit compare --help` lists the arguments

    $ kmcfit fit model.yaml --jsn
    error: kmcfit fit: unknown argument
      found: `--jsn`
      expected: one of: --out, --set, --json, --no-report, --tables, --select, --verbose, --strict, --no-plot
      hint: did you mean `--json`?

    $ kmcfit fit model.yaml other.yaml
    error: kmcfit fit: unknown argument
      found: `other.yaml`
      expected: kmcfit fit [OPTIONS] <MODEL|RECORD>
      hint: `kmcfit fit --help` lists the arguments

    $ kmcfit fit model.yaml --out
    error: --out: the value is missing
      expected: --out <OUT>

    $ kmcfit fit model.yaml --out a --out b
    error: --out: given more than once
      expected: this argument at most once

    $ kmcfit fit model.yaml --json --no-plot
    error: --json: cannot be combined with `--no-plot`
      expected: one of the two

    $ kmcfit fit model.yaml --plot
    error: kmcfit: `--plot` is of an earlier version
      hint: the figures are in the page of the run, report.html

    $ kmcfit report runs/model
    error: kmcfit: `report` is of an earlier version
      hint: run `kmcfit fit` again, which writes page and figures

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
        sensors: {displacement: {offset: estimate}}   # the zero of a displacement is seldom that of the rest position; remove the line if yours is
        initial: estimate                             # or {displacement: …, velocity: …} in m and m/s
    grid: {nodes: auto}                               # chosen from the spectrum of the record
    functions:
      mass:      {fixed: unknown}                     # or its value in kg; without it and without a measured force the results are ratios to the mass
      damping:   {basis: constant}                    # 1/s, ratio to the mass; starts from the decay or the frequency response
      stiffness: {basis: constant}                    # 1/s^2, ratio to the mass; starts from the dominant frequency
    # To let a coefficient vary with time, replace {basis: constant}, for example by
    #   {basis: polynomial, degree: 1}                # a straight line over the record
    #   {basis: piecewise-linear, knots: 5}           # straight pieces between five knots
    #   {basis: b-spline, knots: auto}                # smooth; its smoothness follows from the record
    # and compare both models: `kmcfit compare MODEL OTHER_MODEL`. A variation that the record does not show widens all intervals.
    # A known coefficient is fixed: {fixed: 4.5}; a nearly known one: {fixed: {value: 4.5, sigma: 0.02}}.
    # Further force terms:
    #   cubic_stiffness:  {basis: constant, start: 0.0}
    #   coulomb_friction: {basis: constant, start: 0.0, width: 0.001}
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
    assert!(said.contains("every 0.002 s\n"), "{said}");
    assert!(said.contains("not used: `Time [ms]`\n"), "{said}");
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
      expected: a column of times, `--time COLUMN`, or `--sample-rate HZ`
      hint: if another file has the times, write one table of both: `paste -d, TIMES.csv RECORD.csv > both.csv`
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
    assert!(stdout.lines().count() <= 25, "{stdout}");
    let row = |label: &str| {
        let line = stdout.lines().find(|line| line.starts_with(label));
        line.unwrap_or_else(|| panic!("{label} in {stdout}"))
    };
    // The paper's run ends at 8.1e-5 of its first cost, 99 % of the record, with a mass that is wrong by a factor of two and more.
    assert!(row("fit of the displacement").ends_with("99.1         100"));
    assert!(row("largest error of the mass").contains(" 163 "));
    assert!(row("largest error of the mass").ends_with("< 1e-6"));
    assert!(row("paper     ").contains("Check: ") || row("paper     ").contains("by the misfit"));
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
