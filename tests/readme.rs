//! What the README shows is what happens.
#![cfg(unix)]

mod common;

/// The program of the README, compiled here; a test compares the two texts.
mod library {
    include!("../examples/library.rs");

    pub fn run() {
        main().expect("the example ends well");
    }
}

use common::pages::{Tour, blocks, blocks_in, fresh_clone, output, page};
use common::repository;
use kmcfit::config::{ModelFile, Purpose, build};
use kmcfit_core::internals::objective::GradientKind;
use kmcfit_core::internals::solvers::{FitSettings, Solver, Status, Stopping, fit};
use kmcfit_core::internals::system::Method;
use serde_json::Value;
use std::fs;
use std::sync::OnceLock;

fn readme() -> String {
    page("README.md")
}

fn tour() -> &'static Tour {
    static TOUR: OnceLock<Tour> = OnceLock::new();
    TOUR.get_or_init(|| Tour::of(&readme()))
}

#[test]
fn the_first_block_is_two_commands() {
    let blocks = blocks(&readme());
    let first = blocks.first().expect("a block");
    assert_eq!(first.language, "sh");
    assert_eq!(
        first.lines,
        ["cargo run --release -- fit models/paper.yaml", "cargo test"]
    );
    assert_eq!(blocks_in(&readme(), "sh").len(), 1);
}

#[test]
fn commands_print_what_is_shown() {
    let tour = tour();
    assert!(tour.steps.len() >= 8, "{}", tour.steps.len());
    tour.holds();
    // The first block's command, which the tour repeats, leaves the results that the text promises.
    assert!(tour.clone.path().join("runs/paper/result.json").exists());
}

#[test]
fn models_are_valid_and_their_gradients_exact() {
    let clone = fresh_clone();
    let models = blocks_in(&readme(), "yaml");
    let expected = [
        "2000 nodes over 25 s (midpoint), 2001 parameters, lbfgs",
        "2000 nodes over 25 s (midpoint), 16 parameters, gauss-newton",
        "4801 nodes over 8 s (rk4), 7 parameters, gauss-newton",
        "2000 nodes over 25 s (midpoint), 3 parameters, gauss-newton",
    ];
    assert_eq!(models.len(), expected.len());
    for (model, expected) in models.iter().zip(expected) {
        fs::write(clone.path().join("models/shown.yaml"), model.text()).expect("a file");
        let printed = output(clone.path(), "kmcfit check models/shown.yaml");
        assert!(printed.contains(expected), "{printed}");
        let verdict = "the discrete gradient is exact: least error below 1e-6\n";
        assert!(printed.ends_with(verdict), "{printed}");
        let printed = output(clone.path(), "kmcfit fit models/shown.yaml");
        assert!(!printed.contains("warning"), "{printed}");
        assert!(printed.ends_with("results in runs/shown\n"), "{printed}");
    }
}

#[test]
fn defaults_are_what_is_said() {
    let text = "
format: 1
experiments:
  - {data: data/paper.csv, initial: {displacement: 3.3, velocity: 1.0}}
functions:
  mass: {basis: nodal, start: 2.0}
  damping: {basis: constant, start: 1.0}
  stiffness: {fixed: 1.0}
";
    let file = ModelFile::parse(repository("bare.yaml"), text).expect("a model");
    let model = build(&file, Purpose::Fit).expect("a problem");
    assert_eq!(model.title, "bare");
    assert_eq!(model.problem.experiments[0].name, "experiment 1");
    assert_eq!(model.problem.oscillator.grid.nodes(), 2000);
    assert_eq!(model.problem.oscillator.grid.duration(), 25.0);
    assert_eq!(model.problem.oscillator.method, Method::Rk4);
    assert_eq!(model.settings.solver, Solver::GaussNewton);
    assert_eq!(model.settings.gradient, GradientKind::Discrete);
    let stopping = Stopping {
        tolerance: Some(1e-10),
        ..Stopping::exactly(1000)
    };
    assert_eq!(model.settings.stopping, stopping);
}

#[test]
fn the_program_is_the_example() {
    let programs = blocks_in(&readme(), "rust");
    assert_eq!(programs.len(), 1);
    let example = fs::read_to_string(repository("examples/library.rs")).expect("the example");
    assert_eq!(programs[0].text(), example);
    library::run();
}

#[test]
fn figures_are_those_of_the_run() {
    let clone = &tour().clone;
    for figure in ["motion.svg", "functions.svg"] {
        assert!(readme().contains(&format!("](docs/{figure})")), "{figure}");
        let shown = fs::read_to_string(repository("docs").join(figure)).expect("a figure");
        let made = clone.path().join("runs/paper/figures").join(figure);
        let made = fs::read_to_string(made).expect("a figure");
        assert!(shown == made, "docs/{figure} is not what the run draws");
    }
}

#[test]
fn columns_keys_and_words_are_named() {
    let clone = &tour().clone;
    let readme = readme();
    let named = |word: &str| {
        assert!(readme.contains(&format!("`{word}`")), "{word} is not named");
    };
    let run = clone.path().join("runs/paper");
    let read = |name: &str| fs::read_to_string(run.join(name)).expect("a result");
    for table in ["history.csv", "functions.csv", "trajectory.csv"] {
        let text = read(table);
        let header = text.lines().next().expect("a header");
        header
            .split(',')
            .filter(|c| !c.starts_with("true_"))
            .for_each(named);
    }
    // Absent from this run: nothing is soft, and no rule chose a weight.
    ["slack", "weights"].into_iter().for_each(named);
    let result: Value = serde_json::from_str(&read("result.json")).expect("JSON");
    let keys = |value: &Value| -> Vec<String> {
        let map = value.as_object().expect("a map");
        map.keys().cloned().collect()
    };
    let maps = [
        "/outcome",
        "/cost",
        "/counts",
        "/timings",
        "/functions/mass",
        "/constraints",
    ];
    let maps = maps.map(|pointer| result.pointer(pointer).expect("a map"));
    for key in keys(&result)
        .into_iter()
        .chain(maps.into_iter().flat_map(keys))
    {
        named(&key);
    }
    let statuses = [
        Status::Converged,
        Status::Completed,
        Status::MaxIterations,
        Status::TimeLimit,
        Status::Stalled,
        Status::Interrupted,
        Status::Infeasible,
        Status::Failed,
    ];
    statuses.iter().for_each(|status| named(status.name()));
}

/// The table of other initial states holds the predictions of the run, to the digits given.
#[test]
fn the_optimum_does_not_predict() {
    let clone = &tour().clone;
    let text = fs::read_to_string(clone.path().join("runs/paper/result.json")).expect("a result");
    let result: Value = serde_json::from_str(&text).expect("JSON");
    let number = |value: &Value| value.as_f64().expect("a number");
    let readme = readme();
    let row = |begin: &str| -> Vec<String> {
        let line = readme.lines().find(|line| line.starts_with(begin));
        let line = line.unwrap_or_else(|| panic!("no row {begin}"));
        line.split('|').map(|cell| cell.trim().to_owned()).collect()
    };
    let close = |shown: &str, value: f64| {
        let digits = shown.split_once('.').map_or(0, |(_, digits)| digits.len());
        assert_eq!(shown, format!("{value:.digits$}"));
    };
    close(&row("| 3.3, 1 ")[2], number(&result["cost"]["final"]));
    let predictions = result["predictions"].as_array().expect("predictions");
    assert_eq!(predictions.len(), 5);
    for prediction in predictions {
        let (y, v) = (
            number(&prediction["displacement"]),
            number(&prediction["velocity"]),
        );
        let row = row(&format!("| {y}, {v} |"));
        close(&row[2], number(&prediction["cost"]));
        close(&row[3], number(&prediction["energy"]));
    }
}

/// On half as many nodes the paper's run ends elsewhere.
#[test]
fn the_run_hangs_on_its_rounding() {
    let problem = common::paper_problem(1000, [2.0, 1.0, 1.0]);
    let settings = FitSettings {
        solver: Solver::SteepestDescent,
        initial: kmcfit_core::internals::solvers::Initial::Functions,
        gradient: GradientKind::Continuous,
        stopping: Stopping::exactly(1000),
        interrupt: None,
    };
    let found = fit(&problem, &problem.functions.start(), &settings, &mut |_| {})
        .expect("the start has a motion");
    assert_eq!(found.outcome.status, Status::Stalled);
    assert_eq!(format!("{:.4}", found.history[99].cost_ratio), "0.2407");
    assert_eq!(format!("{:.4}", found.cost_ratio()), "0.0436");
    assert!(readme().contains("| 1000 nodes | 0.2407 | 0.0436, where it is stuck |"));
}
