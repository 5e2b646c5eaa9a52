//! The README shows the output of its commands.
#![cfg(unix)]

use crate::common::pages::{Tour, blocks, blocks_in, fresh_clone, output, page};
use crate::common::repository;
use std::fs;

fn readme() -> String {
    page("README.md")
}

#[test]
fn the_first_block_is_two_commands() {
    let blocks = blocks(&readme());
    let first = blocks.first().expect("a block");
    assert_eq!(first.language, "sh");
    assert_eq!(first.lines, ["cargo run --release -- demo", "cargo test"]);
    assert_eq!(blocks_in(&readme(), "sh").len(), 1);
}

/// The README has a limited length; details are in the book.
#[test]
fn it_is_short() {
    let lines = readme().lines().count();
    assert!(lines <= 200, "{lines} lines");
}

#[test]
fn commands_print_what_is_shown() {
    let tour = Tour::of(&readme());
    assert_eq!(tour.steps.len(), 2);
    tour.holds();
}

#[test]
fn the_model_is_valid() {
    let clone = fresh_clone();
    let models = blocks_in(&readme(), "yaml");
    assert_eq!(models.len(), 1);
    fs::write(clone.path().join("models/shown.yaml"), models[0].text()).expect("a file");
    let printed = output(clone.path(), "kmcfit check models/shown.yaml");
    assert!(printed.contains("12 parameters, gauss-newton"), "{printed}");
    let printed = output(clone.path(), "kmcfit fit models/shown.yaml");
    assert!(!printed.contains("warning"), "{printed}");
}

/// Every command of the program is in the table of commands.
#[test]
fn commands_are_listed() {
    let help = output(&repository(""), "kmcfit --help");
    let begin = help.find("Commands:").expect("a list");
    let commands = help[begin..].lines().filter_map(|line| {
        let name = line.strip_prefix("  ")?.split(' ').next()?;
        (!name.is_empty()).then(|| name.to_owned())
    });
    let commands: Vec<_> = commands
        .filter(|name| name != "help" && !name.starts_with('-'))
        .collect();
    assert!(commands.len() > 10, "{commands:?}");
    for name in commands {
        let is_listed =
            readme().contains(&format!("`{name}`")) || readme().contains(&format!("`{name} "));
        assert!(is_listed, "{name}");
    }
}
