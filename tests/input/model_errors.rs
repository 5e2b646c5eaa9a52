//! Messages about invalid model files.

use insta::assert_snapshot;
use kmcfit::config::ModelFile;

use crate::model::{FULL, SHORT};

/// The message about a text.
fn message(text: &str) -> String {
    match ModelFile::parse("m.yaml", text) {
        Ok(_) => "no error".to_owned(),
        Err(error) => error.to_string(),
    }
}

/// The message about the full model with one place changed.
fn changed(from: &str, to: &str) -> String {
    assert!(FULL.contains(from), "{from}");
    message(&FULL.replacen(from, to, 1))
}

/// The message about a file in a temporary folder.
fn file(name: &str, content: &[u8], read: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(name), content).unwrap();
    let error = ModelFile::read(folder.path().join(read)).unwrap_err();
    error
        .to_string()
        .replace(&folder.path().display().to_string(), "DIR")
}

#[test]
fn files() {
    assert_snapshot!(file("model.yaml", b"", "modell.yaml"), @"
    DIR/modell.yaml: no such file
      expected: a model file (YAML)
      hint: did you mean `model.yaml`?
    ");
    assert_snapshot!(file("model.yaml", b"", "deep/model.yaml"), @"
    DIR/deep/model.yaml: no such file
      expected: a model file (YAML)
      hint: the folder DIR/deep does not exist
    ");
    assert_snapshot!(file("model.yaml", b"", "."), @"
    DIR/.: this is a folder, not a file
      expected: a model file (YAML)
    ");
    assert_snapshot!(file("model.yaml", b"", "model.yaml"), @"
    DIR/model.yaml: the file is empty
      expected: a model file (YAML)
      hint: begin with `format: 1`
    ");
    assert_snapshot!(file("model.yaml", b"format: 1\ntitle: a\xb0b\n", "model.yaml"), @"
    DIR/model.yaml:2:9: the file is not UTF-8 text
      found: the byte 0xb0
      expected: a model file (YAML)
      hint: save it as UTF-8, or write only plain letters there
    ");
    assert_snapshot!(file("model.yaml", b"\xff\xfef\0o\0", "model.yaml"), @"
    DIR/model.yaml:1:1: the file is not UTF-8 text
      found: the byte 0xff
      expected: a model file (YAML)
      hint: it looks like UTF-16: save it as UTF-8
    ");
    assert_snapshot!(file("model.yaml", &vec![b' '; 1 << 21], "model.yaml"), @"
    DIR/model.yaml: the file is too large
      found: 2 MiB
      expected: a model file (YAML) of at most 256 KiB
    ");
}

#[test]
fn unknown_keys() {
    assert_snapshot!(changed("title:", "titel:"), @"
    m.yaml:2:1: unknown key
      found: `titel`
      expected: one of: format, title, experiments, grid, functions, constraints, fit, truth, predict, study
      hint: did you mean `title`?
    ");
    assert_snapshot!(changed("velocity: +0.5", "velocity: 0.5\n      acceleration: 1"), @"
    m.yaml:12:7: experiments[1].initial: unknown key
      found: `acceleration`
      expected: one of: displacement, velocity
    ");
    assert_snapshot!(changed("fixed: 1", "Fixed: 1"), @"
    m.yaml:18:32: functions.stiffness: unknown key
      found: `Fixed`
      expected: one of: basis, knots, degree, start, fixed, known_part, min, max, penalty, width
      hint: did you mean `fixed`?
    ");
    assert_snapshot!(changed("cost_ratio", "cost-ratio"), @"
    m.yaml:23:28: fit.stop: unknown key
      found: `cost-ratio`
      expected: one of: iterations, cost_ratio, gradient_ratio, tolerance, step, seconds
      hint: did you mean `cost_ratio`?
    ");
    assert_snapshot!(changed("  mass: {", "  friction: {"), @"
    m.yaml:14:3: functions: unknown key
      found: `friction`
      expected: one of: mass, damping, stiffness, quadratic_stiffness, cubic_stiffness, quintic_stiffness, quadratic_damping, coulomb_friction, static_force, gap_stiffness
    ");
    assert_snapshot!(changed("column: damping", "colunm: damping"), @"
    m.yaml:17:30: functions.damping.start: unknown key
      found: `colunm`
      expected: one of: data, column
      hint: did you mean `column`?
    ");
    assert_snapshot!(changed("time: t_s", "\"ti`me, expected `x\\n\": t_s"), @r"
    m.yaml:6:15: experiments[0].columns: unknown key
      found: `ti`me, expected `x\n`
      expected: one of: time, displacement, velocity, acceleration, force, base_acceleration, base_displacement
    ");
    assert_snapshot!(changed("grid: {nodes", "grid: {<<: {}, nodes"), @"
    m.yaml:12:8: grid: unknown key
      found: `<<`
      expected: one of: nodes, method, duration
      hint: merging maps by `<<` is not supported: write the keys out
    ");
    assert_snapshot!(changed("memory: 10", "12: 10"), @"
    m.yaml:22:3: fit: unknown key
      found: `12`
      expected: one of: method, initial, gradient, qp, refinement, memory, stop
      hint: write 1.0 with a decimal point; in { … } a comma separates entries
    ");
}

#[test]
fn missing_keys() {
    assert_snapshot!(changed("format: 1\n", ""), @"
    m.yaml:1:1: the key `format` is missing
      expected: for instance `format: 1`
      hint: it belongs at the top level of the file, without indentation
    ");
    assert_snapshot!(changed(", velocity: 1}", "}"), @"
    m.yaml:8:5: experiments[0].initial: the key `velocity` is missing
      expected: for instance `velocity: 1.0`
    ");
    assert_snapshot!(changed("      velocity: +0.5\n", ""), @"
    m.yaml:9:5: experiments[1].initial: the key `velocity` is missing
      expected: for instance `velocity: 1.0`
    ");
    assert_snapshot!(changed("  mass: {basis: nodal, start: 2.0}\n", ""), @"
    m.yaml:13:1: functions: the key `mass` is missing
      expected: for instance `mass: {basis: nodal, start: 2.0}`
    ");
    assert_snapshot!(changed(", column: damping_N_s_per_m", ""), @"
    m.yaml:17:5: functions.damping.start: the key `column` is missing
      expected: for instance `column: mass_kg`
    ");
    assert_snapshot!(changed("truth:\n  data: ../data/paper_truth.csv", "truth:"), @"
    m.yaml:24:1: truth: the key `data` is missing
      expected: for instance `data: file.csv`
    ");
    assert_snapshot!(message("format: 1\n"), @"
    m.yaml:1:1: the key `experiments` is missing
      expected: for instance `experiments: [{initial: {displacement: 3.3, velocity: 1.0}}]`
      hint: it belongs at the top level of the file, without indentation
    ");
    assert_snapshot!(changed("    initial: {displacement: 3.3, velocity: 1}\n", ""), @"
    m.yaml:4:5: experiments[0]: the key `initial` is missing
      expected: for instance `initial: {displacement: 3.3, velocity: 1.0}`
    ");
}

#[test]
fn repeated_keys() {
    assert_snapshot!(changed("grid:", "title: again\ngrid:"), @"
    m.yaml:12:1: duplicate key `title`
      found: `title` again; it is first given in line 2
      expected: every key once
    ");
    assert_snapshot!(changed("memory: 10", "memory: 10\n  method: lbfgs"), @"
    m.yaml:23:3: fit: duplicate key `method`
      found: `method` again; it is first given in line 20
      expected: every key once
    ");
    assert_snapshot!(changed("{displacement: 3.3,", "{displacement: 3.3, displacement: 3.3,"), @"
    m.yaml:8:34: experiments[0].initial: duplicate key `displacement`
      found: `displacement` again; it is first given in line 8
      expected: every key once
    ");
}

#[test]
fn numbers() {
    assert_snapshot!(changed("velocity: 1}", "velocity: fast}"), @"
    m.yaml:8:44: experiments[0].initial.velocity: neither a number nor a known word
      found: text `fast`
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: 1.5 m/s}"), @"
    m.yaml:8:44: experiments[0].initial.velocity: not a number
      found: text `1.5 m/s`
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
      hint: write 1.5 alone, without a unit
    ");
    assert_snapshot!(changed("velocity: +0.5", "velocity: 0,5"), @"
    m.yaml:11:17: experiments[1].initial.velocity: not a number
      found: text `0,5`
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
      hint: write 0.5, with a decimal point
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: '1'}"), @"
    m.yaml:8:44: experiments[0].initial.velocity: not a number
      found: text `1`
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
      hint: write 1, without quotes or leading zeros
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: 1e999}"), @"
    m.yaml:8:44: experiments[0].initial.velocity: not a number
      found: text `1e999`
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
      hint: the number is too large
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: .nan}"), @"
    m.yaml:8:44: experiments[0].initial.velocity: not a finite number
      found: .nan, which is not a number
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: -.inf}"), @"
    m.yaml:8:44: experiments[0].initial.velocity: not a finite number
      found: an infinite number
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
    ");
    assert_snapshot!(changed("start: 2.0}", "start: 2.0, min: non}"), @"
    m.yaml:14:41: functions.mass.min: neither a number nor a known word
      found: text `non`
      expected: a finite number, a column: {data: file.csv, column: name}, or `none`
      hint: did you mean `none`?
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: yes}"), @"
    m.yaml:8:44: experiments[0].initial.velocity: neither a number nor a known word
      found: text `yes`
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: true}"), @"
    m.yaml:8:44: experiments[0].initial.velocity: not a number
      found: the boolean true
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: }"), @"
    m.yaml:8:44: experiments[0].initial.velocity: not a number
      found: nothing
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: [1, 2]}"), @"
    m.yaml:8:44: experiments[0].initial.velocity: not a number
      found: a list
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: {a: 2}}"), @"
    m.yaml:8:45: experiments[0].initial.velocity: unknown key
      found: `a`
      expected: one of: start, prior
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: !f 1}"), @"
    m.yaml:8:44: experiments[0].initial.velocity: not a number
      found: a value with a YAML tag (`!…`)
      expected: a finite number, a map such as {start: 1.0, prior: {mean: 1.0, sigma: 0.1}}, or `estimate`
    ");
}

#[test]
fn counts() {
    assert_snapshot!(changed("nodes: 2000", "nodes: 2e3"), @"
    m.yaml:12:15: grid.nodes: not an integer
      found: the floating-point number 2000
      expected: an integer, 0 or more, or `auto`
      hint: write 2000
    ");
    assert_snapshot!(changed("nodes: 2000", "nodes: 2000.0"), @"
    m.yaml:12:15: grid.nodes: not an integer
      found: the floating-point number 2000
      expected: an integer, 0 or more, or `auto`
      hint: write 2000
    ");
    assert_snapshot!(changed("nodes: 2000", "nodes: 2.5"), @"
    m.yaml:12:15: grid.nodes: not an integer
      found: the floating-point number 2.5
      expected: an integer, 0 or more, or `auto`
    ");
    assert_snapshot!(changed("nodes: 2000", "nodes: -3"), @"
    m.yaml:12:15: grid.nodes: a count cannot be negative
      found: the integer -3
      expected: an integer, 0 or more, or `auto`
    ");
    assert_snapshot!(changed("nodes: 2000", "nodes: 2_000"), @"
    m.yaml:12:15: grid.nodes: not an integer
      found: text `2_000`
      expected: an integer, 0 or more, or `auto`
      hint: write 2000
    ");
    assert_snapshot!(changed("nodes: 2000", "nodes: many"), @"
    m.yaml:12:15: grid.nodes: neither a number nor a known word
      found: text `many`
      expected: an integer, 0 or more, or `auto`
    ");
    assert_snapshot!(changed("nodes: 2000", "nodes: 99999999999999999999"), @"
    m.yaml:12:15: grid.nodes: the number is too large
      found: the integer 99999999999999999999
      expected: an integer, 0 or more, or `auto`
    ");
    assert_snapshot!(changed("nodes: 2000", "nodes: 9999999999999999999999999999999999999999999"), @"
    m.yaml:12:15: grid.nodes: not an integer
      found: the floating-point number 1e43
      expected: an integer, 0 or more, or `auto`
    ");
    assert_snapshot!(changed("nodes: 2000", "nodes: [2000]"), @"
    m.yaml:12:15: grid.nodes: not an integer
      found: a list
      expected: an integer, 0 or more, or `auto`
    ");
}

#[test]
fn choices() {
    assert_snapshot!(changed("method: midpoint", "method: rk45"), @"
    m.yaml:12:29: grid.method: unknown choice
      found: `rk45`
      expected: one of: midpoint, rk4
      hint: did you mean `rk4`?
    ");
    assert_snapshot!(changed("method: lbfgs", "method: steepest_descent"), @"
    m.yaml:20:11: fit.method: unknown choice
      found: `steepest_descent`
      expected: one of: steepest-descent, lbfgs, projected-gradient, gauss-newton, equation-error
      hint: did you mean `steepest-descent`?
    ");
    assert_snapshot!(changed("method: lbfgs", "method: magic"), @"
    m.yaml:20:11: fit.method: unknown choice
      found: `magic`
      expected: one of: steepest-descent, lbfgs, projected-gradient, gauss-newton, equation-error
    ");
    assert_snapshot!(changed("method: lbfgs", "method: 3"), @"
    m.yaml:20:11: fit.method: not one of the choices
      found: the integer 3
      expected: one of: steepest-descent, lbfgs, projected-gradient, gauss-newton, equation-error
    ");
    assert_snapshot!(changed("gradient: continuous", "gradient: [discrete]"), @"
    m.yaml:21:13: fit.gradient: not one of the choices
      found: a list
      expected: one of: discrete, continuous
    ");
    assert_snapshot!(changed("basis: constant", "basis: Constant"), @"
    m.yaml:18:22: functions.stiffness.basis: unknown choice
      found: `Constant`
      expected: one of: nodal, constant, piecewise-constant, piecewise-linear, polynomial, b-spline
      hint: did you mean `constant`?
    ");
}

#[test]
fn formats() {
    assert_snapshot!(changed("format: 1", "format: 2"), @"
    m.yaml:1:9: format: this format version is not supported
      found: the integer 2
      expected: 1
      hint: a newer version of kmcfit may read it
    ");
    assert_snapshot!(changed("format: 1", "format: one"), @"
    m.yaml:1:9: format: not a format number
      found: text `one`
      expected: 1
    ");
    assert_snapshot!(changed("format: 1", "format:"), @"
    m.yaml:1:8: format: not a format number
      found: nothing
      expected: 1
    ");
}

#[test]
fn wrong_kinds() {
    assert_snapshot!(message("- format: 1\n"), @"
    m.yaml:1:1: wrong type of value
      found: a list
      expected: a map with the keys format, experiments, functions, fit, …
    ");
    assert_snapshot!(message("only text\n"), @"
    m.yaml:1:1: wrong type of value
      found: text `only text`
      expected: a map with the keys format, experiments, functions, fit, …
    ");
    assert_snapshot!(changed("grid: {nodes: 2000, method: midpoint, duration: 25.0}", "grid: 2000"), @"
    m.yaml:12:7: grid: wrong type of value
      found: the number 2000
      expected: a map such as {nodes: 2000, method: midpoint}
    ");
    assert_snapshot!(changed("grid: {nodes: 2000, method: midpoint, duration: 25.0}", "grid: fine"), @"
    m.yaml:12:7: grid: wrong type of value
      found: text `fine`
      expected: a map such as {nodes: 2000, method: midpoint}
    ");
    assert_snapshot!(changed("  - name: free decay\n", "    name: free decay\n").replace("  - initial", "    other"), @"
    m.yaml:9:3: the file is not valid YAML: this line does not fit the ones before
      found: `- initial:`
      hint: check the indentation, and that quotes and brackets before are closed
    ");
    assert_snapshot!(message(&SHORT.replace("  - initial", "    initial")), @"
    m.yaml:3:5: experiments: wrong type of value
      found: a map
      expected: a list: lines that begin with `- `, or [ … ]
    ");
    assert_snapshot!(message(&SHORT.replace("experiments:\n", "experiments: []\nx:\n")), @"
    m.yaml:3:1: unknown key
      found: `x`
      expected: one of: format, title, experiments, grid, functions, constraints, fit, truth, predict, study
    ");
    assert_snapshot!(message("format: 1\nexperiments: []\nfunctions:\n  mass: {basis: nodal}\n  damping: {basis: nodal}\n  stiffness: {basis: nodal}\n"), @"
    m.yaml:2:14: experiments: no experiment
      found: an empty list
      expected: at least one experiment
    ");
    assert_snapshot!(changed("initial: {displacement: 3.3, velocity: 1}", "initial: [3.3, 1]"), @"
    m.yaml:8:14: experiments[0].initial: wrong type of value
      found: a list
      expected: a map such as {displacement: 3.3, velocity: 1.0}, or `estimate`
    ");
    assert_snapshot!(changed("initial: {displacement: 3.3, velocity: 1}", "initial: true"), @"
    m.yaml:8:14: experiments[0].initial: wrong type of value
      found: the boolean true
      expected: a map such as {displacement: 3.3, velocity: 1.0}, or `estimate`
    ");
    assert_snapshot!(changed("title: Linear mass decay", "title: {a: b}"), @"
    m.yaml:2:8: title: wrong type of value
      found: a map
      expected: text
    ");
    assert_snapshot!(changed("title: Linear mass decay", "title: ''"), @"
    m.yaml:2:8: title: the text is empty
      found: nothing
      expected: text
    ");
    assert_snapshot!(changed("start: 2.0", "start: two"), @"
    m.yaml:14:31: functions.mass.start: not a number
      found: text `two`
      expected: a finite number, a list of numbers, or a column: {data: file.csv, column: name}
    ");
    assert_snapshot!(changed("fixed: 1", "fixed: [1, 1]"), @"
    m.yaml:18:39: functions.stiffness.fixed: not a number
      found: a list
      expected: a finite number, {value: 4.5, sigma: 0.02}, a column: {data: file.csv, column: name}, or `unknown`
    ");
    assert_snapshot!(changed("data: start.csv", "data:"), @"
    m.yaml:17:17: the file is not valid YAML: a space or a value is missing behind this `:`
      found: `:, column: damping_N_s_per_m}`
      hint: write `key: value`, with a space after the colon
    ");
    assert_snapshot!(changed("{displacement: 3.301, velocity: 1.001}", "3.301"), @"
    m.yaml:28:5: predict[0]: wrong type of value
      found: the number 3.301
      expected: a map such as {displacement: 3.3, velocity: 1.0}
    ");
}

#[test]
fn broken_yaml() {
    assert_snapshot!(changed("    basis: nodal", "\tbasis: nodal"), @"
    m.yaml:16:1: a tab is used as indentation
      found: a tab
      expected: spaces: YAML allows no tabs there
      hint: replace every tab at the beginning of a line by spaces
    ");
    assert_snapshot!(changed("  damping:\n", "   damping:\n"), @"
    m.yaml:15:4: the file is not valid YAML: this line does not fit the ones before
      found: `damping:`
      hint: check the indentation, and that quotes and brackets before are closed
    ");
    assert_snapshot!(changed("  gradient: continuous", " gradient: continuous"), @"
    m.yaml:21:2: the file is not valid YAML: this line does not fit the ones before
      found: `gradient: continuous`
      hint: check the indentation, and that quotes and brackets before are closed
    ");
    assert_snapshot!(changed("title: Linear mass decay", "title: Linear: mass decay"), @"
    m.yaml:2:14: the file is not valid YAML: a `:` is not allowed here
      found: `: mass decay`
      hint: check the indentation of this line and the one before; put a text with `: ` in quotes
    ");
    assert_snapshot!(changed("velocity: 1}", "velocity: 1"), @"
    m.yaml:9:12: the file is not valid YAML: a `{` is not closed, or a comma is missing
      found: `:`
      expected: the end of what begins in line 8
      hint: separate the entries of { … } by commas and close the bracket
    ");
    assert_snapshot!(changed("title: Linear mass decay", "title: 'Linear"), @"
    m.yaml:29:1: the file is not valid YAML: a quote is opened and never closed
      found: the end of the file or an empty line
      expected: the end of what begins in line 2
      hint: close the quote
    ");
    assert_snapshot!(changed("title: Linear mass decay", "title: [a, b"), @"
    m.yaml:3:12: the file is not valid YAML: a `[` is not closed, or a comma is missing
      found: `:`
      expected: the end of what begins in line 2
      hint: separate the elements of [ … ] by commas and close the bracket
    ");
    assert_snapshot!(changed("title: Linear mass decay", "title: @home"), @"
    m.yaml:2:8: the file is not valid YAML: invalid first character of a value
      found: `@home`
      hint: put the text in quotes
    ");
    assert_snapshot!(changed("title: Linear mass decay", "title: \"a\\qb\""), @r#"
    m.yaml:2:10: the file is not valid YAML: an unknown escape sequence in double quotes
      found: `\qb"`
      hint: in double quotes write `\\` for a backslash, or use single quotes
    "#);
    assert_snapshot!(changed("title: Linear mass decay", "title: a\u{1}b"), @"
    m.yaml:2:9: a control character is not allowed in YAML
      found: the character U+0001
      expected: printable characters
      hint: remove the character
    ");
    assert_snapshot!(changed("title: Linear mass decay", "title: *home"), @"
    m.yaml:2:8: the file is not valid YAML: an alias (`*name`) without its anchor (`&name`) before it
      found: `*home`
      hint: put a text that begins with `*` in quotes
    ");
    assert_snapshot!(changed("title: Linear mass decay", "title Linear"), @"
    m.yaml:3:1: the file is not valid YAML: a key without `:`
      found: `experiments:`
      hint: write `key: value`, with a space after the colon
    ");
    assert_snapshot!(changed("title: Linear mass decay", "title: - a"), @"
    m.yaml:2:8: the file is not valid YAML: a list element is not allowed here
      found: `- a`
      hint: begin the list in a line of its own
    ");
    assert_snapshot!(changed("  - name: free decay", "  - name: free decay\n  name: x"), @"
    m.yaml:5:3: the file is not valid YAML: this line is not an element of the list before
      found: `name: x`
      hint: begin elements of a list with `- ` in the same column
    ");
    assert_snapshot!(changed("{nodes: 2000,", "{nodes: 2000, ,"), @"
    m.yaml:12:21: the file is not valid YAML: a value is missing here
      found: `, method: midpoint, duration: 25.0}`
      hint: check the commas and brackets, and put special characters in quotes
    ");
    assert_snapshot!(message(&format!("  {FULL}")), @"
    m.yaml:2:1: the file is not valid YAML: this line does not fit the ones before
      found: `title: Linear mass decay`
      hint: check the indentation: keys of one map begin in the same column
    ");
    assert_snapshot!(message(&format!("{SHORT}}}\n")), @"
    m.yaml:8:1: the file is not valid YAML: this line does not fit the ones before
      found: `}`
      hint: check the indentation, and that quotes and brackets before are closed
    ");
    assert_snapshot!(message("{format: 1}}"), @"
    m.yaml:1:12: the file is not valid YAML: this line does not fit the ones before
      found: `}`
      hint: check the indentation: keys of one map begin in the same column
    ");
    assert_snapshot!(message("%TAG x\n"), @"
    m.yaml:1:6: the file is not valid YAML: did not find expected '!' at line 1 column 6, while scanning a tag directive
      found: `x`
    ");
}

#[test]
fn documents_and_limits() {
    assert_snapshot!(message("# nothing\n---\n"), @"
    m.yaml: the file is empty
      expected: a model file (YAML)
      hint: begin with `format: 1`
    ");
    assert_snapshot!(message(&format!("{SHORT}---\n{SHORT}")), @"
    m.yaml:9:1: second YAML document
      found: two documents in one file
      expected: one model per file
      hint: remove the line `---` and what follows, or put it into a file of its own
    ");
    assert_snapshot!(message(&format!("{SHORT}---\n")), @"
    m.yaml:9:1: second YAML document
      found: two documents in one file
      expected: one model per file
      hint: remove the line `---` and what follows, or put it into a file of its own
    ");
    assert_snapshot!(message(&format!("{SHORT}---\ntitle: 'a\n")), @"
    m.yaml:10:1: the file is not valid YAML: a quote is opened and never closed
      found: the end of the file or an empty line
      expected: the end of what begins in line 9
      hint: close the quote
    ");
    assert_snapshot!(message(&format!("title: {}", "[".repeat(300))), @"
    m.yaml:1:208: too many open brackets
      found: more than 200 brackets not closed
      expected: every `[` and `{` closed
    ");
    assert_snapshot!(message("experiments: &a [*a]"), @"
    m.yaml:1:14: experiments[0]: wrong type of value
      found: a list
      expected: a map such as {name: free decay, data: file.csv, initial: {displacement: 3.3, velocity: 1.0}}
    ");
    assert_snapshot!(message("~"), @"
    m.yaml:1:1: wrong type of value
      found: nothing
      expected: a map with the keys format, experiments, functions, fit, …
    ");
}

#[test]
fn repeated_aliases_are_limited() {
    let mut text =
        "format: &a 1\nexperiments:\n  - &s {initial: {displacement: 1, velocity: 1}}\n".to_owned();
    text.push_str(&"  - *s\n".repeat(1000));
    text.push_str(&SHORT[SHORT.find("functions").unwrap()..]);
    assert_eq!(
        ModelFile::parse("m.yaml", text)
            .unwrap()
            .spec
            .experiments
            .len(),
        1001
    );

    let mut bomb = "experiments:\n- &a0 {b: 1}\n".to_owned();
    for level in 1..30 {
        let below = level - 1;
        bomb.push_str(&format!("- &a{level} [*a{below}, *a{below}, *a{below}]\n"));
    }
    assert_snapshot!(message(&bomb), @"
    m.yaml:2:8: experiments[0]: unknown key
      found: `b`
      expected: one of: name, data, format, columns, sample_rate, units, window, time_zero, duplicates, missing, exclude, decimate, band, sigma, loss, noise, sensors, force, base, initial, functions, validation
    ");
}
