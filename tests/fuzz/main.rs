//! Nothing gets in: whatever the bytes of an input are, reading it ends, without a panic and without
//! taking more memory than a multiple of the input.
//!
//! `tests/fuzz/corpus/` has a folder of inputs for each target: good ones, hand-made bad ones, and one for
//! each mistake that was found. They are run with the shipped models and readings, and then so many
//! mutations of them; `KMCFIT_FUZZ=100000` asks for as many of each target instead.

mod corpus;
mod limits;
mod mutate;
mod targets;
mod watched;

use mutate::Mutator;
use targets::{TARGETS, Target};
use watched::Watched;

/// Mutations of each target where nobody asks for more: a few seconds each.
const MUTATIONS: [usize; 5] = [12_000, 6000, 6000, 4000, 1000];

fn mutations(index: usize) -> usize {
    match std::env::var("KMCFIT_FUZZ") {
        Ok(text) => text.parse().expect("KMCFIT_FUZZ is a number of inputs"),
        Err(_) => MUTATIONS[index],
    }
}

fn hold(index: usize) {
    let (name, target): (&str, Target) = TARGETS[index];
    // What is set up once is not counted.
    let mut seeds = corpus::seeds(name);
    target(b"");
    seeds.sort();
    let many = mutations(index);
    let mut watched = Watched::new(name, target);
    for (file, bytes) in &seeds {
        watched.hold(file, bytes.clone());
    }
    let bytes = seeds.into_iter().map(|(_, bytes)| bytes).collect();
    let mut mutator = Mutator::new(bytes);
    for number in 0..many {
        watched.hold(&format!("mutation {number}"), mutator.next());
    }
    println!("{name}: {}", watched.told());
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
