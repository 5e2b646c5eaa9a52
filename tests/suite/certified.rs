//! Certified problems in the manner of NIST StRD: estimates and standard errors of `kmcfit fit` against solutions of the
//! exact differential equation that an independent program computed with 64 digits (Taylor series; commit 869eef0a holds it).
//!
//! At the grid of each model file the digits of estimates and standard errors are checked, and with `grid.nodes=auto` the
//! error in standard errors. `tests/certified/README.md` shows the table that the test prints.

use kmcfit::config::{BuildMode, ModelFile, Override, build};
use kmcfit::fitting::{ModelFit, fit_model};
use kmcfit_core::solvers::{Observer, Status};
use kmcfit_core::threads::{available, map};
use serde_json::Value;
use std::fs;
use std::path::PathBuf;

/// Required digits of the estimates, `-log10(|estimate - certified| / |certified|)`.
const ESTIMATE_DIGITS: f64 = 8.0;
/// Required digits of the standard errors.
const ERROR_DIGITS: f64 = 6.0;
/// Digits beyond these are not reported: rounding errors, which differ between processors, set them.
const REPORTED_DIGITS: f64 = 9.0;
/// Largest error with an automatic grid, in standard errors.
const AUTO_ERROR: f64 = 0.1;
/// Fewest problems.
const FEWEST: usize = 12;

/// Certified value of one parameter.
struct Certified {
    estimate: f64,
    standard_error: f64,
}

/// Accuracy of one fit.
#[derive(Clone, Copy)]
struct Accuracy {
    /// Fewest digits of an estimate.
    estimate: f64,
    /// Fewest digits of a standard error.
    standard_error: f64,
    /// Largest error of an estimate, in certified standard errors.
    error: f64,
    nodes: usize,
}

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/certified")
}

fn problems() -> Vec<Value> {
    let text = fs::read_to_string(folder().join("certified.json")).expect("the certified values");
    let document: Value = serde_json::from_str(&text).expect("JSON");
    document["problems"].as_array().expect("a list").clone()
}

/// A field that is a text.
fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key]
        .as_str()
        .unwrap_or_else(|| panic!("{key} of {value}"))
}

/// Keys of the start values of a problem: start 0 or 1 of each coefficient.
fn start_keys(problem: &Value, start: usize) -> Vec<String> {
    let mut lists: Vec<(String, Vec<&str>)> = Vec::new();
    for parameter in problem["parameters"].as_array().expect("a list") {
        // Initial states start from the record.
        let Some(value) = parameter["starts"][start].as_str() else {
            continue;
        };
        let name = text(parameter, "name");
        match name.split_once('[') {
            None => lists.push((name.to_owned(), vec![value])),
            Some((function, _)) => match lists.last_mut() {
                Some((last, values)) if last == function => values.push(value),
                _ => lists.push((function.to_owned(), vec![value])),
            },
        }
    }
    let key = |(name, values): &(String, Vec<&str>)| match values.as_slice() {
        [value] => format!("functions.{name}.start={value}"),
        values => format!("functions.{name}.start=[{}]", values.join(", ")),
    };
    lists.iter().map(key).collect()
}

/// Correct significant digits of `found`.
fn digits(found: f64, certified: f64) -> f64 {
    let error = ((found - certified) / certified).abs();
    if error.is_nan() {
        return 0.0;
    }
    -error.max(1e-16).log10()
}

/// Fits a problem as `kmcfit fit` does.
fn fitted(problem: &Value, start: usize, more: &[&str]) -> Result<Accuracy, String> {
    let name = text(problem, "name");
    let mut keys = start_keys(problem, start);
    keys.extend(more.iter().map(|key| (*key).to_owned()));
    let overrides = Override::parse_all(&keys).expect("keys");
    let path = folder().join(format!("{name}.yaml"));
    let file = ModelFile::read_with_overrides(path, &overrides).map_err(|e| e.to_string())?;
    let model = build(&file, BuildMode::Fit).map_err(|e| e.to_string())?;
    let nothing = &mut |_: &_| {};
    let found = fit_model(&model, &mut Observer::new(nothing)).map_err(|e| e.to_string())?;
    let ModelFit { model, fit, .. } = found;
    if fit.outcome.status != Status::Converged {
        return Err(format!("{:?}", fit.outcome));
    }
    let covariance = model
        .problem
        .covariance(&fit.best.evaluation)
        .ok_or("no covariance")?;
    let certified: Vec<Certified> = problem["parameters"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|parameter| Certified {
            estimate: text(parameter, "certified").parse().expect("a number"),
            standard_error: text(parameter, "standard_error").parse().expect("a number"),
        })
        .collect();
    assert_eq!(certified.len(), fit.best.parameters.len(), "{name}");
    let mut accuracy = Accuracy {
        estimate: f64::INFINITY,
        standard_error: f64::INFINITY,
        error: 0.0,
        nodes: model.problem.functions.nodes(),
    };
    for (i, (found, certified)) in fit.best.parameters.iter().zip(&certified).enumerate() {
        let error = covariance[(i, i)].sqrt();
        accuracy.estimate = accuracy.estimate.min(digits(*found, certified.estimate));
        accuracy.standard_error = accuracy
            .standard_error
            .min(digits(error, certified.standard_error));
        let deviation = ((found - certified.estimate) / certified.standard_error).abs();
        // Not a number counts as a failure.
        accuracy.error = if deviation <= accuracy.error {
            accuracy.error
        } else {
            deviation
        };
    }
    Ok(accuracy)
}

/// Accuracy of both starts; `more` overrides keys of the model.
fn both(problem: &Value, more: &[&str]) -> [Accuracy; 2] {
    [0, 1].map(|start| {
        let found = fitted(problem, start, more);
        found.unwrap_or_else(|e| panic!("{}, start {start}: {e}", text(problem, "name")))
    })
}

/// Fewest digits in words.
fn shown(digits: f64) -> String {
    match digits >= REPORTED_DIGITS {
        true => format!("≥ {REPORTED_DIGITS}"),
        false => format!("{:.1}", (digits * 10.0).floor() / 10.0),
    }
}

#[test]
fn certified_problems_are_solved_to_the_stated_digits() {
    let page = include_str!("../certified/README.md");
    let problems = problems();
    assert!(problems.len() >= FEWEST, "{}", problems.len());
    let rows = map(problems.len(), available(), |i| {
        let problem = &problems[i];
        let name = text(problem, "name");
        let stated = both(problem, &[]);
        let auto = both(problem, &["grid.nodes=auto"]);
        let least = |of: fn(&Accuracy) -> f64| of(&stated[0]).min(of(&stated[1]));
        let estimates = least(|a| a.estimate);
        let errors = least(|a| a.standard_error);
        let off = auto[0].error.max(auto[1].error);
        assert!(estimates >= ESTIMATE_DIGITS, "{name}: {estimates} digits");
        assert!(errors >= ERROR_DIGITS, "{name}: {errors} digits of errors");
        assert!(off <= AUTO_ERROR, "{name}: {off} standard errors");
        let row = format!(
            "| `{name}` | {} | {} | {} | {} | {} | {} | {off:.1e} |",
            text(problem, "title"),
            problem["samples"],
            problem["nodes"],
            shown(estimates),
            shown(errors),
            auto[0].nodes,
        );
        println!("{row}");
        row
    });
    let missing: Vec<String> = rows.into_iter().filter(|r| !page.contains(r)).collect();
    assert!(
        missing.is_empty(),
        "not on the page:\n{}",
        missing.join("\n")
    );
}
