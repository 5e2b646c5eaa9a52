//! The cost of the paper's problem and its discrete gradient: `cargo bench --bench evaluation`.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use kmcfit_core::objective::GradientKind;
use std::hint::black_box;

/// The paper's number of nodes, and one that exceeds the caches.
const NODES: [usize; 2] = [2000, 1_000_000];

fn evaluation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("evaluation");
    for nodes in NODES {
        let problem = common::paper(nodes);
        let theta = problem.start();
        let mut point = problem.workspace();
        group.throughput(Throughput::Elements(nodes as u64));
        if nodes > 100_000 {
            group.sample_size(10);
        }
        group.bench_function(BenchmarkId::new("cost", nodes), |b| {
            b.iter(|| problem.evaluate_into(black_box(&theta), &mut point));
        });
        problem.evaluate_into(&theta, &mut point).expect("a motion");
        for kind in [GradientKind::Discrete, GradientKind::Continuous] {
            let name = format!("{} gradient", kind.name());
            group.bench_function(BenchmarkId::new(name, nodes), |b| {
                b.iter(|| problem.gradient(black_box(&theta), &point, kind));
            });
        }
        group.bench_function(BenchmarkId::new("cost and gradient", nodes), |b| {
            let mut gradient = vec![0.0; theta.len()];
            b.iter(|| problem.cost_and_gradient(black_box(&theta), &mut gradient));
        });
    }
}

criterion_group!(benches, evaluation);
criterion_main!(benches);
