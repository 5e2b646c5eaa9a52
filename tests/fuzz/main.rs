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
use targets::{TARGETS, Target};
use watched::Watched;

/// Default number of mutations of each target, which take a few seconds.
const MUTATIONS: [usize; 9] = [12_000, 6000, 6000, 2000, 500, 6000, 6000, 6000, 60_000];

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

fn hold(index: usize) {
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

#[test]
fn binary_files() {
    hold(8);
}
