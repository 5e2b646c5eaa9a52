//! Reading of any input ends without a panic and within memory proportional to the length of the input.
//!
//! `tests/fuzz/corpus/` has a folder of inputs for each target: valid ones, invalid ones written by hand, and one for
//! each defect that was found. They are run together with the shipped models and samples, then mutations of them.
//! `KMCFIT_FUZZ=100000` sets the number of mutations of each target, `KMCFIT_FUZZ_SEED=7` their seed, and `KMCFIT_FUZZ_GROW=1`
//! adds inputs that lead to a new kind of message to the corpus. `.ci/long` sets all three.

mod corpus;
mod growth;
mod limits;
mod mutate;
mod targets;
mod watched;

use growth::Growth;
use mutate::Mutator;
use std::process::Command;
use targets::{TARGETS, Target};
use watched::Watched;

/// Default number of mutations of each target, which take a few seconds.
const MUTATIONS: [usize; 7] = [6000, 3000, 3000, 3000, 3000, 3000, 30_000];

/// Default seed of the mutations, which makes failures reproducible.
const SEED: u64 = 1;

/// A number in a variable of the environment.
fn variable(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(
        text.parse()
            .unwrap_or_else(|_| panic!("{name} is a number")),
    )
}

/// Set for a process that holds one target: memory is counted for the whole process.
const ALONE: &str = "KMCFIT_FUZZ_ALONE";

/// Runs a target in a process of its own; `test` is the name of this test.
fn hold(test: &str, index: usize) {
    if std::env::var_os(ALONE).is_some() {
        return hold_alone(index);
    }
    let program = std::env::current_exe().expect("this program");
    let mut command = Command::new(program);
    command.args(["--exact", test, "--nocapture"]);
    let output = command.env(ALONE, "1").output().expect("a process");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let printed = text(&output.stdout);
    println!("{printed}");
    assert!(output.status.success(), "{}", text(&output.stderr));
    // A process without this test succeeds as well.
    assert!(printed.contains("test result: ok. 1 passed"), "{test}");
}

fn hold_alone(index: usize) {
    let (name, target): (&str, Target) = TARGETS[index];
    // Memory of the setup is not counted.
    let mut seeds = corpus::seeds(name);
    target(b"");
    seeds.sort();
    let many = variable("KMCFIT_FUZZ").unwrap_or(MUTATIONS[index] as u64);
    let seed = variable("KMCFIT_FUZZ_SEED").unwrap_or(SEED);
    let begin = std::time::Instant::now();
    let mut watched = Watched::new(name, target);
    for (file, bytes) in &seeds {
        watched.hold(file, bytes.clone());
    }
    let bytes = seeds.into_iter().map(|(_, bytes)| bytes).collect();
    let mut mutator = Mutator::new(bytes, seed);
    let mut growth = Growth::of(name);
    for number in 0..many {
        let input = mutator.next();
        let known = watched.kinds();
        watched.hold(&format!("mutation {number} of seed {seed}"), input.clone());
        if watched.kinds() > known {
            growth.add(&input);
        }
    }
    println!(
        "{}, {:.0} s, {} added to the corpus",
        watched.row(seed),
        begin.elapsed().as_secs_f64(),
        growth.added()
    );
}

#[test]
fn models() {
    hold("models", 0);
}

#[test]
fn tables() {
    hold("tables", 1);
}

#[test]
fn runs() {
    hold("runs", 2);
}

#[test]
fn yaml_with_aliases() {
    hold("yaml_with_aliases", 3);
}

#[test]
fn overrides() {
    hold("overrides", 4);
}

#[test]
fn binary_files() {
    hold("binary_files", 5);
}
