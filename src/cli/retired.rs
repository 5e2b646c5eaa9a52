//! Commands and options of earlier versions, each with what takes its place.

use crate::error::InputError;
use std::ffi::OsString;

/// Words of the command line.
const RETIRED: [(&[&str], &str); 14] = [
    (
        &["resume"],
        "run the command again: a fit takes seconds, and `kmcfit fleet` goes on after its rows",
    ),
    (
        &["report"],
        "run `kmcfit fit` again, which writes page and figures",
    ),
    (
        &["man"],
        "`kmcfit --help` and `kmcfit COMMAND --help` have its text",
    ),
    (
        &["fleet", "collect"],
        "`kmcfit fleet` writes table and page when all records have their rows",
    ),
    (
        &["fleet", "page"],
        "`kmcfit fit MODEL --set experiments.0.data=RECORD` makes the page of a record",
    ),
    (
        &["--retry-errors"],
        "the same command fits the records with errors again",
    ),
    (
        &["--checkpoint"],
        "an interrupted fit writes its best point: run it again",
    ),
    (
        &["--shard"],
        "for many machines use `fit_many` of the Python package with an executor",
    ),
    (
        &["check", "--gradient"],
        "the tests of the program check the gradient: `cargo test -p kmcfit-core gradient`",
    ),
    (
        &["--plot"],
        "the figures are in the page of the run, report.html",
    ),
    (
        &["fit", "--draws"],
        "parameters.json has the covariance of the estimates, from which draws are made",
    ),
    (&["--warm-start"], "each fit starts as the model states"),
    (
        &["--timings"],
        "`seconds` and `timings` of result.json have the computing times",
    ),
    (&["--time-limit"], "state `fit.stop.seconds` in the model"),
];

/// The error of a command line with a word of an earlier version.
pub fn error(words: &[OsString]) -> Option<InputError> {
    let words: Vec<&str> = words
        .iter()
        .skip(1)
        .filter_map(|word| word.to_str())
        .collect();
    let is_there = |old: &str| words.iter().any(|word| word.split('=').next() == Some(old));
    let is_used = |(old, _): &&(&[&str], &str)| match old {
        [command, option] if option.starts_with("--") => {
            words.first() == Some(command) && is_there(option)
        }
        [option] if option.starts_with("--") => is_there(option),
        command => words.starts_with(command),
    };
    let (old, instead) = RETIRED.iter().find(is_used)?;
    let problem = format!("`{}` is of an earlier version", old.join(" "));
    Some(InputError::argument("kmcfit", problem).hint(*instead))
}
