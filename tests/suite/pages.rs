//! The tutorial and the page on the choice of methods show the output of their commands.
#![cfg(unix)]

use crate::common::pages::{Tour, blocks_in, page};
use crate::common::repository;
use std::fs;

#[test]
fn the_tutorial_is_as_shown() {
    let text = page("docs/tutorial.md");
    let tour = Tour::of(&text);
    assert!(tour.steps.len() >= 12, "{}", tour.steps.len());
    tour.holds();
    let figures = [("functions.svg", "paper"), ("ring-down.svg", "mine")];
    assert_eq!(text.matches(".svg)").count(), figures.len());
    for (figure, run) in figures {
        assert!(text.contains(&format!("]({figure})")), "{figure}");
        let shown = fs::read_to_string(repository("docs").join(figure)).expect("a figure");
        let made = tour
            .clone
            .path()
            .join(format!("runs/{run}/figures/functions.svg"));
        let made = fs::read_to_string(made).expect("a figure");
        if std::env::var_os("KMCFIT_GUIDE").is_some_and(|mode| mode == "write") {
            fs::write(repository("docs").join(figure), &made).expect("a figure");
            continue;
        }
        assert!(shown == made, "docs/{figure} is not what the run draws");
    }
}

#[test]
fn failures_and_cures_are_as_shown() {
    let tour = Tour::of(&page("docs/choosing.md"));
    assert!(tour.steps.len() >= 18, "{}", tour.steps.len());
    tour.holds();
}

/// Commands whose output a page does not show need not match.
#[test]
fn commands_show_something() {
    for name in ["docs/tutorial.md", "docs/choosing.md"] {
        for block in blocks_in(&page(name), "console") {
            let shown = |line: &String| !line.starts_with("$ ") && line != "…";
            assert!(block.lines.iter().any(shown), "{name}: {:?}", block.lines);
        }
    }
}
