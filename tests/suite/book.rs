//! The reference pages of the book agree with the program: commands and their output, keys, files and links. The tutorial and the
//! page on the choice of methods are tested in `pages.rs`.
#![cfg(unix)]

/// The program of the page on the library, compiled here; a test compares the two texts.
mod library {
    include!("../../examples/library.rs");

    pub fn run() {
        main().expect("the example ends well");
    }
}

use crate::common::pages::{Tour, blocks_in, fresh_clone, output, page};
use crate::common::{paper_problem, repository};
use kmcfit::config::{BuildMode, ModelFile, build};
use kmcfit_core::objective::GradientKind;
use kmcfit_core::solvers::{FitSettings, Solver, Status, Stopping, fit};
use kmcfit_core::system::Method;
use kmcfit_core::threads::{available, map};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;

/// The page of commands, whose first one is the paper's run.
fn tour() -> &'static Tour {
    static TOUR: OnceLock<Tour> = OnceLock::new();
    TOUR.get_or_init(|| Tour::of(&page("docs/commands.md")))
}

#[test]
fn commands_print_what_is_shown() {
    assert!(tour().steps.len() >= 8, "{}", tour().steps.len());
    tour().holds();
    for name in ["records", "paper"] {
        let tour = Tour::of(&page(&format!("docs/{name}.md")));
        assert!(!tour.steps.is_empty(), "{name}");
        tour.holds();
    }
}

#[test]
fn models_are_valid_and_their_gradients_exact() {
    let clone = fresh_clone();
    let pages = ["model_files", "records", "studies"].map(|name| page(&format!("docs/{name}.md")));
    let models: Vec<_> = pages
        .iter()
        .flat_map(|page| blocks_in(page, "yaml"))
        .collect();
    let expected = [
        "2000 nodes over 25 s (midpoint), 2001 parameters, lbfgs",
        "2000 nodes over 25 s (midpoint), 16 parameters, gauss-newton",
        "4801 nodes over 8 s (rk4), 7 parameters, gauss-newton",
        "2000 nodes over 25 s (midpoint), 3 parameters, gauss-newton",
    ];
    assert_eq!(models.len(), expected.len());
    map(models.len(), available(), |i| {
        let name = format!("models/shown-{i}.yaml");
        fs::write(clone.path().join(&name), models[i].text()).expect("a file");
        let printed = output(clone.path(), &format!("kmcfit check {name}"));
        assert!(printed.contains(expected[i]), "{printed}");
        assert!(!printed.contains("no response"), "{printed}");
        let printed = output(clone.path(), &format!("kmcfit fit {name}"));
        assert!(!printed.contains("warning"), "{printed}");
        let end = format!("results in runs/shown-{i}\n");
        assert!(printed.ends_with(&end), "{printed}");
    });
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
    let model = build(&file, BuildMode::Fit).expect("a problem");
    assert_eq!(model.title, "bare");
    assert_eq!(model.problem.experiments[0].name, "experiment 1");
    assert_eq!(model.problem.system.grid.nodes(), 2000);
    assert_eq!(model.problem.system.grid.duration(), 25.0);
    assert_eq!(model.problem.system.method, Method::Rk4);
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
    let programs = blocks_in(&page("docs/library.md"), "rust");
    assert_eq!(programs.len(), 1);
    let example = fs::read_to_string(repository("examples/library.rs")).expect("the example");
    assert_eq!(programs[0].text(), example);
    library::run();
}

#[test]
fn figures_are_those_of_the_run() {
    let clone = &tour().clone;
    for (figure, (name, link)) in [
        ("motion.svg", ("README.md", "docs/motion.svg")),
        ("functions.svg", ("docs/paper.md", "functions.svg")),
    ] {
        assert!(page(name).contains(&format!("]({link})")), "{figure}");
        let shown = fs::read_to_string(repository("docs").join(figure)).expect("a figure");
        let made = clone.path().join("runs/paper/figures").join(figure);
        let made = fs::read_to_string(made).expect("a figure");
        assert!(shown == made, "docs/{figure} is not what the run draws");
    }
}

#[test]
fn columns_keys_and_words_are_named() {
    let clone = &tour().clone;
    let results = page("docs/results.md");
    let named = |word: &str| {
        assert!(
            results.contains(&format!("`{word}`")),
            "{word} is not named"
        );
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
    // Absent from this run: it has no soft constraint and no weight chosen by a rule.
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

/// The table of other initial states agrees with the predictions of the run to the digits shown.
#[test]
fn the_optimum_does_not_predict() {
    let clone = &tour().clone;
    let text = fs::read_to_string(clone.path().join("runs/paper/result.json")).expect("a result");
    let result: Value = serde_json::from_str(&text).expect("JSON");
    let number = |value: &Value| value.as_f64().expect("a number");
    let text = page("docs/paper.md");
    let row = |begin: &str| -> Vec<String> {
        let line = text.lines().find(|line| line.starts_with(begin));
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

/// On half as many nodes the paper's run ends at another point.
#[test]
fn the_paper_s_run_depends_on_rounding() {
    let problem = paper_problem(1000, [2.0, 1.0, 1.0]);
    let settings = FitSettings {
        solver: Solver::SteepestDescent,
        initial: kmcfit_core::solvers::Initial::Functions,
        gradient: GradientKind::Continuous,
        stopping: Stopping::exactly(1000),
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    };
    let found = fit(&problem, &problem.functions.start(), &settings, &mut |_| {})
        .expect("the start has a motion");
    assert_eq!(found.outcome.status, Status::Stalled);
    assert_eq!(format!("{:.4}", found.history[99].cost_ratio), "0.2407");
    assert_eq!(format!("{:.4}", found.cost_ratio()), "0.0436");
    assert!(page("docs/paper.md").contains("| 1000 nodes | 0.2407 | 0.0436, stalled |"));
}

/// Pages of the book, from its summary.
fn pages() -> Vec<String> {
    let names = links(&page("docs/SUMMARY.md"));
    names
        .into_iter()
        .map(|name| format!("docs/{name}"))
        .collect()
}

/// Targets of the links of a page, without those to the network.
fn links(text: &str) -> Vec<String> {
    let targets = text
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next());
    let inside = targets.filter(|target| !target.contains("://") && !target.contains('`'));
    inside.map(str::to_owned).collect()
}

#[test]
fn the_summary_lists_every_page() {
    let listed: BTreeSet<_> = pages().into_iter().collect();
    for entry in fs::read_dir(repository("docs")).expect("a folder") {
        let name = entry.expect("an entry").file_name();
        let name = format!("docs/{}", name.to_string_lossy());
        if name.ends_with(".md") && name != "docs/SUMMARY.md" {
            assert!(listed.contains(&name), "{name}");
        }
    }
}

/// Anchor of a heading, by the rule of GitHub and mdBook.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = text
        .chars()
        .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn links_lead_somewhere() {
    let mut count = 0;
    for name in pages()
        .into_iter()
        .chain(["README.md", "CONTRIBUTING.md"].map(String::from))
    {
        let text = page(&name);
        let folder = Path::new(&name).parent().expect("a folder");
        for link in links(&text) {
            let (file, heading) = link.split_once('#').unwrap_or((&link, ""));
            let target = match file {
                "" => repository(&name),
                file => repository("").join(folder).join(file),
            };
            assert!(target.exists(), "{name}: {link}");
            if !heading.is_empty() {
                let text = fs::read_to_string(&target).expect("a page");
                let headings = text.lines().filter(|line| line.starts_with('#'));
                assert!(headings.map(anchor).any(|a| a == heading), "{name}: {link}");
            }
            count += 1;
        }
    }
    assert!(count > 50, "{count}");
}
