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

use kmcfit::config::{ModelFile, Purpose, build};
use kmcfit::dynamics::Method;
use kmcfit::objective::GradientKind;
use kmcfit::solvers::{FitSettings, Solver, Status, Stopping, fit};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use tempfile::TempDir;

/// A code block: its language and its lines.
struct Block {
    language: String,
    lines: Vec<String>,
}

impl Block {
    fn text(&self) -> String {
        self.lines.iter().map(|line| format!("{line}\n")).collect()
    }
}

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn readme() -> String {
    fs::read_to_string(repository("README.md")).expect("the README")
}

fn blocks() -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut open = false;
    for line in readme().lines() {
        match line.strip_prefix("```") {
            Some(language) if !open => {
                open = true;
                blocks.push(Block {
                    language: language.to_owned(),
                    lines: Vec::new(),
                });
            }
            Some(_) => open = false,
            None if open => blocks.last_mut().expect("a block").lines.push(line.into()),
            None => {}
        }
    }
    assert!(!open, "a block is not closed");
    blocks
}

fn blocks_in(language: &str) -> Vec<Block> {
    let blocks = blocks().into_iter();
    blocks.filter(|block| block.language == language).collect()
}

/// A folder with the shipped models and data, in which the README's commands are run in order.
fn fresh_clone() -> TempDir {
    let clone = tempfile::tempdir().expect("a temporary folder");
    for folder in ["models", "data"] {
        fs::create_dir(clone.path().join(folder)).expect("a folder");
        for entry in fs::read_dir(repository(folder)).expect("a folder can be listed") {
            let file = entry.expect("an entry");
            let copy = clone.path().join(folder).join(file.file_name());
            fs::copy(file.path(), copy).expect("a file can be copied");
        }
    }
    clone
}

/// What a command of the README prints, `kmcfit` being the program under test.
fn output(folder: &Path, command: &str) -> String {
    let program = Path::new(env!("CARGO_BIN_EXE_kmcfit"));
    let programs = program.parent().expect("the program is in a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    let command = command.replace("cargo run --release --", "kmcfit");
    let output = Command::new("sh")
        .args(["-c", &command])
        .current_dir(folder)
        .env("PATH", format!("{}:{path}", programs.display()))
        .output()
        .expect("a shell");
    let text = [output.stdout, output.stderr].concat();
    String::from_utf8(text).expect("the program writes UTF-8")
}

/// A command of the README, the output shown for it, and what it prints.
struct Step {
    command: String,
    shown: String,
    printed: String,
}

/// The folder after all commands of the README, and those commands.
struct Tour {
    clone: TempDir,
    steps: Vec<Step>,
}

fn tour() -> &'static Tour {
    static TOUR: OnceLock<Tour> = OnceLock::new();
    TOUR.get_or_init(|| {
        let clone = fresh_clone();
        let mut steps: Vec<Step> = Vec::new();
        for block in blocks_in("console") {
            for line in &block.lines {
                match line.strip_prefix("$ ") {
                    Some(command) => steps.push(Step {
                        command: command.to_owned(),
                        shown: String::new(),
                        printed: output(clone.path(), command),
                    }),
                    None => {
                        let step = steps.last_mut().expect("a command before its output");
                        step.shown.push_str(line);
                        step.shown.push('\n');
                    }
                }
            }
        }
        Tour { clone, steps }
    })
}

/// Below this an error is rounding, and differs from machine to machine.
const ROUNDING: f64 = 1e-7;

/// How far a shown number may be from the printed one, as a part of it: libraries of elementary
/// functions differ in the last digit, and L-BFGS works in logarithms.
const SLACK: f64 = 0.01;

/// Whether two texts are the same word by word, and number by number within the slack.
fn same(shown: &str, printed: &str) -> bool {
    let words = |text: &str| -> Vec<String> {
        let lines = text.lines().map(|line| match line.split_once(" solves, ") {
            // The seconds that a run takes.
            Some((before, _)) => before.to_owned(),
            None => line.to_owned(),
        });
        let text: Vec<String> = lines.collect();
        let apart = |c: char| c.is_whitespace() || ",;:()".contains(c);
        let words = text.iter().flat_map(|line| line.split(apart));
        words.filter(|w| !w.is_empty()).map(str::to_owned).collect()
    };
    let (shown, printed) = (words(shown), words(printed));
    shown.len() == printed.len() && shown.iter().zip(&printed).all(|(a, b)| same_word(a, b))
}

fn same_word(shown: &str, printed: &str) -> bool {
    match (shown.parse::<f64>(), printed.parse::<f64>()) {
        (Ok(a), Ok(b)) => {
            let small = a.abs() < ROUNDING && b.abs() < ROUNDING;
            small || (a - b).abs() <= SLACK * a.abs().max(b.abs())
        }
        _ => shown == printed,
    }
}

#[test]
fn the_first_block_is_two_commands() {
    let blocks = blocks();
    let first = blocks.first().expect("a block");
    assert_eq!(first.language, "sh");
    assert_eq!(
        first.lines,
        ["cargo run --release -- fit models/paper.yaml", "cargo test"]
    );
    assert_eq!(blocks_in("sh").len(), 1);
}

#[test]
fn commands_print_what_is_shown() {
    let Tour { clone, steps } = tour();
    assert!(steps.len() >= 8, "{}", steps.len());
    for step in steps {
        let (shown, printed) = (&step.shown, &step.printed);
        assert!(
            same(shown, printed),
            "$ {}\nshown:\n{shown}\nprinted:\n{printed}",
            step.command
        );
    }
    // The first block's command, which the tour repeats, leaves the results that the text promises.
    assert!(clone.path().join("runs/paper/result.json").exists());
}

#[test]
fn models_are_valid_and_their_gradients_exact() {
    let clone = fresh_clone();
    let models = blocks_in("yaml");
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
    let programs = blocks_in("rust");
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
        initial: kmcfit::solvers::Initial::Functions,
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
