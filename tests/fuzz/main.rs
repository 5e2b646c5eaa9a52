//! Nothing gets in: whatever the bytes of an input are, reading it ends, without a panic and without
//! taking more memory than a multiple of the input.
//!
//! `tests/fuzz/corpus/` has a folder of inputs for each target: good ones, hand-made bad ones, and one for
//! each mistake that was found. They are run with the shipped models and samples, and then so many
//! mutations of them; `KMCFIT_FUZZ=100000` asks for as many of each target instead, `KMCFIT_FUZZ_SEED=7`
//! draws other ones, and `KMCFIT_FUZZ_GROW=1` keeps those in the corpus that led to a message of a new
//! kind. `.ci/long` does all three.

mod corpus;
mod growth;
mod limits;
mod mutate;
mod targets;
mod watched;

use growth::Growth;
use mutate::Mutator;
use targets::{TARGETS, Target};
use watched::Watched;

/// Mutations of each target where nothing else is asked for: a few seconds each.
const MUTATIONS: [usize; 8] = [12_000, 6000, 6000, 4000, 1000, 6000, 6000, 6000];

/// The seed of the mutations where nothing else is asked for, so that a failure comes again.
const SEED: u64 = 1;

/// A number in a variable of the environment.
fn variable(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(
        text.parse()
            .unwrap_or_else(|_| panic!("{name} is a number")),
    )
}

fn hold(index: usize) {
    let (name, target): (&str, Target) = TARGETS[index];
    // What is set up once is not counted.
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
    hold(0);
}

#[test]
fn tables() {
    hold(1);
}

#[test]
fn runs() {
    hold(2);
}

#[test]
fn journals_of_fits() {
    hold(3);
}

#[test]
fn journals_of_studies() {
    hold(4);
}

#[test]
fn yaml_with_aliases() {
    hold(5);
}

#[test]
fn overrides() {
    hold(6);
}

#[test]
fn sequences_of_models() {
    hold(7);
}
