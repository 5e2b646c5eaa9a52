//! Whole fits, from a problem in memory to its optimum: `cargo bench --bench fits`.

mod common;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use kmcfit::config::{BuildMode, ModelFile, build};
use kmcfit_core::study::multistart;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;

/// Iterations of the paper's run that are timed; the run has 1000, each costs the same.
const PAPER_ITERATIONS: usize = 20;
/// Nodes of the smooth fit beyond the paper's 2000.
const LONG: [usize; 3] = [8000, 40_000, 200_000];
/// Knots per function.
const KNOTS: [usize; 3] = [4, 11, 64];
/// Starts of a study.
const STARTS: usize = 16;
/// Samples of each sensor of the forced, nonlinear record.
const SAMPLES: usize = 65_000;

fn fits(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("fits");
    group.sample_size(10);

    let iterations = format!("iterations: {PAPER_ITERATIONS}");
    let paper = common::model("paper", &[("iterations: 1000", &iterations)]);
    group.bench_function(BenchmarkId::new("paper", PAPER_ITERATIONS), |b| {
        b.iter(|| common::fitted(&paper));
    });

    let lbfgs = common::model("paper-lbfgs", &[("cost_ratio: 1e-6", "cost_ratio: 1e-4")]);
    group.bench_function("lbfgs to 1e-4", |b| b.iter(|| common::fitted(&lbfgs)));

    let smooth = common::model("paper-smooth", &[]);
    group.bench_function(BenchmarkId::new("smooth", 2000), |b| {
        b.iter(|| common::fitted(&smooth));
    });
    for nodes in LONG {
        let smooth = common::smooth(nodes);
        group.bench_function(BenchmarkId::new("smooth", nodes), |b| {
            b.iter(|| common::fitted(&smooth));
        });
    }

    for knots in KNOTS {
        let model = common::model("knots", &[("knots: 11", &format!("knots: {knots}"))]);
        group.bench_function(BenchmarkId::new("knots", knots), |b| {
            b.iter(|| common::fitted(&model));
        });
    }

    let knots = common::model("knots", &[]);
    for threads in [1, 2] {
        let how = common::many_starts(&knots, STARTS, threads);
        group.bench_function(BenchmarkId::new("study of starts, threads", threads), |b| {
            b.iter(|| multistart(&knots.problem, &how));
        });
    }

    let (duffing, settings) = common::duffing(SAMPLES);
    group.bench_function(BenchmarkId::new("duffing", SAMPLES), |b| {
        b.iter(|| common::fit_problem(&duffing, &settings));
    });
}

/// Work of the program before a fit.
fn sample(criterion: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/knots.yaml");
    criterion.bench_function("read and build a model", |b| {
        b.iter(|| {
            let file = ModelFile::read(black_box(&path)).expect("a model");
            build(&file, BuildMode::Fit).expect("a model")
        });
    });
}

/// The whole run of the program.
fn start_up(criterion: &mut Criterion) {
    criterion.bench_function("kmcfit --help", |b| {
        b.iter(|| {
            let program = Command::new(env!("CARGO_BIN_EXE_kmcfit"))
                .arg("--help")
                .output();
            assert!(program.expect("the program").status.success());
        });
    });
}

criterion_group!(benches, fits, sample, start_up);
criterion_main!(benches);
