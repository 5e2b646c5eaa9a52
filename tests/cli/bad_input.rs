//! Invalid input: exit code 2, a message with location and problem, no file written.

use crate::workbench::{MODEL, Workbench, sample_table};
use insta::assert_snapshot;

/// Message of a command that rejects its input and writes no file.
fn refused(bench: &Workbench, arguments: &[&str]) -> String {
    let before = bench.contents();
    let (code, stdout, stderr) = bench.run(arguments);
    assert_eq!(code, 2, "{arguments:?}\n{stdout}\n{stderr}");
    assert_eq!(stdout, "", "{arguments:?}");
    assert_eq!(bench.contents(), before, "{arguments:?} left something");
    stderr
}

/// Message about a model and its samples; `fit` and `check` print the same.
fn message(bench: &Workbench) -> String {
    let message = refused(bench, &["fit", "model.yaml", "--out", "out"]);
    assert_eq!(refused(bench, &["check", "model.yaml"]), message);
    message
}

/// The message about the small model with one place changed.
fn changed(from: &str, to: &str) -> String {
    assert!(MODEL.contains(from), "{from}");
    let bench = Workbench::with_small_model();
    bench.write("model.yaml", &MODEL.replacen(from, to, 1));
    message(&bench)
}

/// The message about the small model with other samples.
fn with_samples(text: &str) -> String {
    let bench = Workbench::with_small_model();
    bench.write("samples.csv", text);
    message(&bench)
}

/// The samples with a row, counted from 1, replaced.
fn with_row(row: usize, by: &str) -> String {
    let text = sample_table(21);
    let lines = text.lines().enumerate();
    let lines: Vec<&str> = lines.map(|(i, l)| if i == row { by } else { l }).collect();
    with_samples(&(lines.join("\n") + "\n"))
}

#[test]
fn meaning() {
    assert_snapshot!(changed("start: 2.0", "start: 0"), @"
    error: model.yaml:10:36: functions.mass.start: the mass must be positive at all times
       |
    10 |   mass:      {basis: nodal, start: 0}
       |                                    ^
      found: 0
      expected: a number greater than 0, in kg
    ");
    assert_snapshot!(changed("{basis: nodal, start: 2.0}", "{fixed: -1.0}"), @"
    error: model.yaml:10:22: functions.mass.fixed: the mass must be positive at all times
       |
    10 |   mass:      {fixed: -1.0}
       |                      ^^^^
      found: -1
      expected: a number greater than 0, in kg
    ");
    assert_snapshot!(changed("start: 2.0", "start: 2.0, fixed: 2.0"), @"
    error: model.yaml:10:36: functions.mass.start: `fixed` and `start` exclude each other
       |
    10 |   mass:      {basis: nodal, start: 2.0, fixed: 2.0}
       |                                    ^^^
      expected: either `fixed` or `start`
    ");
    assert_snapshot!(changed("start: 2.0", "fixed: 2.0"), @"
    error: model.yaml:10:22: functions.mass.basis: `fixed` and `basis` exclude each other
       |
    10 |   mass:      {basis: nodal, fixed: 2.0}
       |                      ^^^^^
      expected: either `fixed`, or `basis` with `start`
    ");
    assert_snapshot!(changed("fit:", "study: {spread: 2.0}\nfit:"), @"
    error: model.yaml:13:17: study.spread: this key has no effect alone
       |
    13 | study: {spread: 2.0}
       |                 ^^^
      expected: `starts` beside it
    ");
    assert_snapshot!(changed("fit:", "  cubic_stiffness: {basis: nodal}\nfit:"), @"
    error: model.yaml:13:20: functions.cubic_stiffness: this function has neither a start nor a fixed value
       |
    13 |   cubic_stiffness: {basis: nodal}
       |                    ^^^^^^^^^^^^^^
      expected: `start` for a function to be fitted, `fixed` for a known one
      hint: mass, damping and stiffness of a fit start from the record
    ");
    assert_snapshot!(changed("basis: nodal, start: 2.0", "start: 2.0"), @"
    error: model.yaml:10:14: functions.mass: a function to be fitted needs a basis
       |
    10 |   mass:      {start: 2.0}
       |              ^^^^^^^^^^^^
      expected: `basis`, one of nodal, constant, piecewise-constant, piecewise-linear, polynomial, b-spline
    ");
    assert_snapshot!(changed("method: lbfgs", "method: steepest-descent\n  memory: 10"), @"
    error: model.yaml:15:11: fit.memory: the method `steepest-descent` has no memory
       |
    15 |   memory: 10
       |           ^^
      expected: no `memory`, or `method: lbfgs`
    ");
    assert_snapshot!(changed("method: lbfgs", "method: lbfgs\n  memory: 0"), @"
    error: model.yaml:15:11: fit.memory: L-BFGS needs a memory
       |
    15 |   memory: 0
       |           ^
      found: 0
      expected: 1 or more pairs
    ");
    assert_snapshot!(changed("{iterations: 5}", "{iterations: 5, seconds: -1}"), @"
    error: model.yaml:16:34: fit.stop.seconds: this limit must be positive
       |
    16 |   stop: {iterations: 5, seconds: -1}
       |                                  ^^
      found: -1
      expected: a number greater than 0, in s
    ");
}

#[test]
fn sigma() {
    let sigma = |value: &str| format!("    sigma: {{displacement: {value}}}\n    initial");
    assert_snapshot!(changed("    initial", &sigma("0")), @"
    error: model.yaml:7:27: experiments[0].sigma.displacement: a standard deviation must be positive
      |
    7 |     sigma: {displacement: 0}
      |                           ^
      found: 0
      expected: a number greater than 0, in SI units
    ");
    assert_snapshot!(changed("    initial", &sigma("-0.1")), @"
    error: model.yaml:7:27: experiments[0].sigma.displacement: a standard deviation must be positive
      |
    7 |     sigma: {displacement: -0.1}
      |                           ^^^^
      found: -0.1
      expected: a number greater than 0, in SI units
    ");
    let bench = Workbench::with_small_model();
    let model = MODEL.replace("    initial", &sigma("0.1"));
    bench.write("model.yaml", &model.replace("discrete", "continuous"));
    assert_snapshot!(message(&bench), @"
    error: model.yaml:16:13: fit.gradient: the continuous adjoint needs the integral cost with a sample at every node
       |
    16 |   gradient: continuous
       |             ^^^^^^^^^^
      found: `continuous` with a sigma or with fewer samples than nodes
      expected: `discrete`
    ");
}

#[test]
fn grid() {
    assert_snapshot!(changed("nodes: 21", "nodes: 21, duration: -2.0"), @"
    error: model.yaml:8:29: grid.duration: the duration is not positive
      |
    8 | grid: {nodes: 21, duration: -2.0, method: midpoint}
      |                             ^^^^
      found: -2
      expected: a length of time in s, greater than 0
    ");
    assert_snapshot!(changed("nodes: 21", "nodes: 21, duration: 3.0"), @"
    error: model.yaml:8:29: grid.duration: the duration differs from that of the records
      |
    8 | grid: {nodes: 21, duration: 3.0, method: midpoint}
      |                             ^^^
      found: 3
      expected: 2 or no `duration`
    ");
    assert_snapshot!(changed("nodes: 21", "nodes: 2"), @"
    error: model.yaml:8:15: grid.nodes: invalid number of nodes
      |
    8 | grid: {nodes: 2, method: midpoint}
      |               ^
      found: 2
      expected: 3 or more
    ");
}

/// Replaces the available memory, which varies from run to run.
#[test]
fn too_many_nodes_are_refused() {
    let with_nodes = |command: &str, nodes: &str| {
        let bench = Workbench::with_small_model();
        let model = MODEL.replace("nodes: 21", &format!("nodes: {nodes}"));
        bench.write("model.yaml", &model);
        refused(&bench, &[command, "model.yaml"])
    };
    assert_snapshot!(with_nodes("fit", "100000000000"), @"
    error: model.yaml:8:15: grid.nodes: too many nodes
      |
    8 | grid: {nodes: 100000000000, method: midpoint}
      |               ^^^^^^^^^^^^
      found: 100000000000 nodes with 64 or more parameters
      expected: at most 15625000 nodes
    ");
    // The largest integer is rejected in the same way.
    assert_snapshot!(with_nodes("fit", "9223372036854775807"), @"
    error: model.yaml:8:15: grid.nodes: too many nodes
      |
    8 | grid: {nodes: 9223372036854775807, method: midpoint}
      |               ^^^^^^^^^^^^^^^^^^^
      found: 9223372036854775807 nodes with 64 or more parameters
      expected: at most 15625000 nodes
    ");
    // A simulation needs less memory per node.
    let bench = Workbench::with_small_model();
    let with = |command: &[&str]| {
        let nodes = ["model.yaml", "--nodes", "100000000000"];
        refused(&bench, &[command, &nodes].concat())
    };
    assert_snapshot!(with(&["simulate"]), @"
    error: --nodes: too many nodes
      found: 100000000000 nodes with 1 or more parameters
      expected: at most 1000000000 nodes
    ");
    assert_snapshot!(with_nodes("study", "100000000000"), @"
    error: model.yaml:8:15: grid.nodes: too many nodes
      |
    8 | grid: {nodes: 100000000000, method: midpoint}
      |               ^^^^^^^^^^^^
      found: 100000000000 nodes with 64 or more parameters
      expected: at most 15625000 nodes
    ");
    assert_snapshot!(with_nodes("compare", "100000000000"), @"
    error: model.yaml:8:15: grid.nodes: too many nodes
      |
    8 | grid: {nodes: 100000000000, method: midpoint}
      |               ^^^^^^^^^^^^
      found: 100000000000 nodes with 64 or more parameters
      expected: at most 15625000 nodes
    ");
}

#[test]
fn readings_files() {
    assert_snapshot!(changed("data: samples.csv", "data: reading.csv"), @"
    error: model.yaml:5:11: experiments[0].data: reading.csv: no such file
      |
    5 |     data: reading.csv
      |           ^^^^^^^^^^^
      expected: a CSV file with one row of column names and rows of numbers
    ");
    assert_snapshot!(changed("data: samples.csv", "data: data/samples.csv"), @"
    error: model.yaml:5:11: experiments[0].data: data/samples.csv: no such file
      |
    5 |     data: data/samples.csv
      |           ^^^^^^^^^^^^^^^^
      expected: a CSV file with one row of column names and rows of numbers
      hint: the folder data does not exist
    ");
    assert_snapshot!(changed("data: samples.csv", "data: ."), @"
    error: model.yaml:5:11: experiments[0].data: .: this is a folder, not a file
      |
    5 |     data: .
      |           ^
      expected: a CSV file with one row of column names and rows of numbers
    ");
    assert_snapshot!(with_samples(""), @"
    error: model.yaml:5:11: experiments[0].data: samples.csv: the file is empty
      |
    5 |     data: samples.csv
      |           ^^^^^^^^^^^
      expected: a CSV file with one row of column names and rows of numbers
    ");
    assert_snapshot!(with_samples("t_s,y_m\n"), @"
    error: model.yaml:5:11: experiments[0].data: samples.csv: the file has no data
      |
    5 |     data: samples.csv
      |           ^^^^^^^^^^^
      found: a row of column names only
      expected: a CSV file with one row of column names and rows of numbers
    ");
    assert_snapshot!(with_samples(&sample_table(2)), @"
    error: model.yaml:6:40: experiments[0].columns.displacement: too few samples
      |
    6 |     columns: {time: t_s, displacement: y_m}
      |                                        ^^^
      found: 2 samples
      expected: at least 3
    ");
    assert_snapshot!(with_samples("t_s,y_m\n0,1\n"), @"
    error: model.yaml:6:40: experiments[0].columns.displacement: too few samples
      |
    6 |     columns: {time: t_s, displacement: y_m}
      |                                        ^^^
      found: 1 sample
      expected: at least 3
    ");
    assert_snapshot!(changed("displacement: y_m", "displacement: y_mm"), @"
    error: model.yaml:6:40: experiments[0].columns.displacement: samples.csv: there is no such column
      |
    6 |     columns: {time: t_s, displacement: y_mm}
      |                                        ^^^^
      found: `y_mm`
      expected: one of: t_s, y_m
      hint: did you mean `y_m`?
    ");
    assert_snapshot!(changed("time: t_s", "time: seconds"), @"
    error: model.yaml:6:21: experiments[0].columns.time: samples.csv: there is no such column
      |
    6 |     columns: {time: seconds, displacement: y_m}
      |                     ^^^^^^^
      found: `seconds`
      expected: one of: t_s, y_m
    ");
}

#[test]
fn rows() {
    assert_snapshot!(with_row(17, "1.6,off"), @"
    error: samples.csv:18: column `y_m`: not a number
       |
    18 | 1.6,off
       |     ^^^
      found: `off`
      expected: a finite number, or an empty field for a missing sample
    ");
    assert_snapshot!(with_row(17, "1.6"), @"
    error: samples.csv:18: the row does not fit the column names
       |
    18 | 1.6
       | ^^^
      found: 1 field
      expected: 2 fields, one per column
    ");
    assert_snapshot!(with_row(17, "1.4,0.1"), @"
    error: samples.csv:18: column `t_s`: the times do not increase
       |
    18 | 1.4,0.1
       | ^^^
      found: 1.4 after 1.5 in line 17
      expected: a time greater than 1.5
      hint: if the clock restarted there, write the rows from line 18 to a file of their own: a second experiment
    ");
    assert_snapshot!(with_row(17, "1.5,0.1"), @"
    error: samples.csv:18: column `t_s`: two rows with the same time
       |
    18 | 1.5,0.1
       | ^^^
      found: 1.5 after 1.5 in line 17
      expected: a time greater than 1.5
      hint: `duplicates: first` keeps the first row of each time, `duplicates: mean` the mean; 1 row repeats a time: line 18
    ");
}

/// No folder can be created below a regular file, not even by root.
#[test]
fn output_folders() {
    let bench = Workbench::with_small_model();
    assert_snapshot!(refused(&bench, &["fit", "model.yaml", "--out", "model.yaml/out"]), @"
    error: --out: the output folder cannot be created
      found: model.yaml is a file, not a folder
      expected: a folder that can be written to
    ");
    assert_snapshot!(refused(&bench, &["fit", "model.yaml", "--out", "model.yaml"]), @"
    error: --out: the output folder cannot be created
      found: model.yaml is a file, not a folder
      expected: a folder, or a new path
    ");
    assert_snapshot!(
        refused(&bench, &["simulate", "model.yaml", "--out", "model.yaml/motion.csv"]),
        @"
    error: --out: the results cannot be written
      found: model.yaml/motion.csv: model.yaml is a file, not a folder
      expected: a writable folder
    "
    );
    assert_snapshot!(refused(&bench, &["simulate", "model.yaml", "--out", "."]), @"
    error: --out: the results cannot be written
      found: .: this is a folder, not a file
      expected: a writable folder
    ");
}

#[test]
fn simulate_arguments() {
    let bench = Workbench::with_small_model();
    let with = |more: &[&str]| refused(&bench, &[&["simulate", "model.yaml"], more].concat());
    assert_snapshot!(with(&["--noise", "0.1"]), @"
    error: kmcfit simulate: --seed <SEED> is missing
      expected: kmcfit simulate [OPTIONS] <MODEL>
      hint: `kmcfit simulate --help` lists the arguments
    ");
    assert_snapshot!(with(&["--seed", "1"]), @"
    error: kmcfit simulate: --noise <SIGMA> is missing
      expected: kmcfit simulate [OPTIONS] <MODEL>
      hint: `kmcfit simulate --help` lists the arguments
    ");
    assert_snapshot!(with(&["--noise=-1", "--seed", "1"]), @"
    error: --noise: invalid standard deviation
      found: -1
      expected: a finite number, 0 or greater, in m
    ");
    assert_snapshot!(with(&["--experiment", "forced"]), @"
    error: --experiment: no such experiment in the model
      found: `forced`
      expected: one of the experiments of the model: `free decay`
    ");
    assert_snapshot!(with(&["--nodes", "2"]), @"
    error: --nodes: invalid number of nodes
      found: 2
      expected: 3 or more
    ");
    assert_snapshot!(with(&["--nodes", "many"]), @"
    error: --nodes: not a number
      found: `many`
      expected: an integer, 3 or more
    ");
    bench.write("model.yaml", &MODEL.replace("    data: samples.csv\n", ""));
    assert_snapshot!(with(&[]), @"
    error: model.yaml:7:7: grid: the duration is missing
      |
    7 | grid: {nodes: 21, method: midpoint}
      |       ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
      expected: `duration` in s, because there is no record
    ");
}

#[test]
fn predict_arguments() {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &["fit", "model.yaml", "--out", "run", "--no-report"]);
    let from = |run: &str, state: &str| refused(&bench, &["predict", run, "--initial", state]);
    assert_snapshot!(from("run", "3.3"), @"
    error: --initial: invalid initial state
      found: `3.3`
      expected: two numbers: displacement in m, velocity in m/s, as in --initial 3.4,1.1
    ");
    assert_snapshot!(from("run", "-3.3,fast"), @"
    error: --initial: invalid initial state
      found: `-3.3,fast`
      expected: two numbers: displacement in m, velocity in m/s, as in --initial 3.4,1.1
    ");
    assert_snapshot!(from("run", "1,2,3"), @"
    error: --initial: invalid initial state
      found: `1,2,3`
      expected: two numbers: displacement in m, velocity in m/s, as in --initial 3.4,1.1
    ");
    assert_snapshot!(from("run", "nan,0"), @"
    error: --initial: invalid initial state
      found: `nan,0`
      expected: two numbers: displacement in m, velocity in m/s, as in --initial 3.4,1.1
    ");
    assert_snapshot!(from("rum", "1,0"), @"
    error: rum: no such folder
      expected: the folder of a finished run, as written by `kmcfit fit`
    ");
    assert_snapshot!(from("model.yaml", "1,0"), @"
    error: model.yaml: a model file in place of a run
      expected: the folder of a finished run, as written by `kmcfit fit`
      hint: fit it first: `kmcfit fit model.yaml`, then `kmcfit predict runs/model …`
    ");
    assert_snapshot!(refused(&bench, &["predict", "run"]), @"
    error: kmcfit predict: --initial <Y,V> is missing
      expected: kmcfit predict [OPTIONS] <RUN>
      hint: `kmcfit predict --help` lists the arguments
    ");
    bench.write("other/result.json", "{}");
    assert_snapshot!(from("other", "1,0"), @"
    error: other/result.json: format: unsupported format version of the result
      found: none
      expected: 1
    ");
    bench.write("other/result.json", &bench.read("run/result.json"));
    assert_snapshot!(from("other", "1,0"), @"
    error: other/functions.csv: no such file
      expected: a CSV file with one row of column names and rows of numbers
    ");
    bench.write("other/functions.csv", "t_s,mass_kg\n0,1\n");
    assert_snapshot!(from("other", "1,0"), @"
    error: other/functions.csv: the table does not belong to this result
      found: 1 row
      expected: 21 rows, one per node
    ");
}
