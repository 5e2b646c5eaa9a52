//! Measurements for `benches/race.py` besides benchmark times: limits of the machine, memory of an evaluation, throughput of a
//! study. One line of JSON each:
//!
//! ```text
//! measure limit                     ns of a multiply and a multiply-add that wait for each other
//! measure triad                     memory bandwidth of one core, bytes/s
//! measure evaluation NODES SECONDS  cost and discrete gradient of the paper's problem
//! measure starts STARTS THREADS     a study of so many starts of models/knots.yaml
//! measure chain COORDINATES NODES METHOD   response, and its adjoint, of a chain of masses: midpoint, rk4 or implicit-midpoint
//! ```

mod common;

/// The allocator of the program.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

use kmcfit_core::objective::GradientKind;
use kmcfit_core::step::{Driven, EngineMode, Trajectory};
use kmcfit_core::structure::{Ends, Law, Structure};
use kmcfit_core::study::multistart;
use kmcfit_core::system::{
    Excitation, Grid, Method, NodalCoefficients, StageSamples, State, System,
};
use std::hint::black_box;
use std::time::Instant;

/// Links of the chain whose latency is the limit of a sweep.
const LINKS: u32 = 10_000_000;
/// Elements of each array of the triad: far more than caches hold.
const TRIAD: usize = 1 << 25;
/// Repetitions, of which the fastest counts.
const REPETITIONS: usize = 7;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words.as_slice() {
        ["limit"] => limit(),
        ["triad"] => triad(),
        ["evaluation", nodes, seconds] => evaluation(number(nodes), number(seconds)),
        ["starts", starts, threads] => study(number(starts), number(threads)),
        ["chain", coordinates, nodes, method] => {
            chain_of_masses(number(coordinates), number(nodes), method);
        }
        // `cargo bench` and `cargo test --benches` call every benchmark without such words.
        _ => println!("measure: see benches/race.py"),
    }
}

fn number<T: std::str::FromStr>(word: &str) -> T {
    let Ok(number) = word.parse() else {
        eprintln!("not a number: {word}");
        std::process::exit(2);
    };
    number
}

/// Lower bound of the time of a step: its states depend on those of the previous step through a multiply and a
/// multiply-add.
fn limit() {
    let best = (0..REPETITIONS)
        .map(|_| {
            let clock = Instant::now();
            black_box(chain(black_box(0.5), black_box(0.999_999), black_box(1e-7)));
            clock.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min);
    println!("{{\"ns_per_link\": {:.4}}}", best / f64::from(LINKS) * 1e9);
}

#[cfg(target_arch = "x86_64")]
fn chain(x: f64, a: f64, b: f64) -> f64 {
    #[target_feature(enable = "fma")]
    fn fused(x: f64, a: f64, b: f64) -> f64 {
        (0..LINKS).fold(x, |x, _| (x * a).mul_add(a, b))
    }
    match std::arch::is_x86_feature_detected!("fma") {
        // SAFETY: the processor has the feature.
        true => unsafe { fused(x, a, b) },
        false => (0..LINKS).fold(x, |x, _| x * a * a + b),
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn chain(x: f64, a: f64, b: f64) -> f64 {
    (0..LINKS).fold(x, |x, _| (x * a).mul_add(a, b))
}

/// `a = b + s c` over arrays that exceed the caches; 24 bytes per element are counted.
fn triad() {
    let (b, c) = (vec![1.0f64; TRIAD], vec![2.0f64; TRIAD]);
    let mut a = vec![0.0f64; TRIAD];
    let s = black_box(3.0);
    let best = (0..REPETITIONS)
        .map(|_| {
            let clock = Instant::now();
            for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
                *a = b + s * c;
            }
            black_box(&mut a);
            clock.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min);
    println!(
        "{{\"bytes_per_second\": {:.6e}}}",
        24.0 * TRIAD as f64 / best
    );
}

/// Median times over as many evaluations as take `seconds`, and the memory at the peak of those of
/// cost and gradient together.
fn evaluation(nodes: usize, seconds: f64) {
    refuse_beyond_memory(nodes);
    let problem = common::paper(nodes);
    let theta = problem.start();
    let mut gradient = vec![0.0; theta.len()];
    // The memory that it took to make the problem is not that of an evaluation.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    let mut cost = f64::NAN;
    let both = repeated(seconds, || {
        cost = problem
            .cost_and_gradient(black_box(&theta), &mut gradient)
            .expect("a motion");
    });
    let peak = peak_bytes();
    let mut point = problem.workspace();
    let sweeps = repeated(0.3 * seconds, || {
        let ok = problem.evaluate_into(black_box(&theta), &mut point);
        ok.expect("a motion");
    });
    let gradients = repeated(0.3 * seconds, || {
        black_box(problem.gradient(&theta, &point, GradientKind::Discrete));
    });
    println!(
        "{{\"nodes\": {nodes}, \"seconds\": {both:.6e}, \"cost_seconds\": {sweeps:.6e}, \
         \"gradient_seconds\": {gradients:.6e}, \"cost\": {cost:.12e}, \"peak_bytes\": {}}}",
        peak.map_or("null".into(), |bytes| bytes.to_string()),
    );
}

/// Bytes that making a problem of so many nodes, evaluating it and its gradient take at most, per node.
const BYTES_A_NODE: f64 = 600.0;

/// Ends the program where so many nodes do not fit into what memory is free, if the system says how much that is.
fn refuse_beyond_memory(nodes: usize) {
    let Ok(text) = std::fs::read_to_string("/proc/meminfo") else {
        return;
    };
    let line = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"));
    let kilobytes = line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok());
    let (needed, free) = (BYTES_A_NODE * nodes as f64, kilobytes.map(|k| k * 1024.0));
    if let Some(free) = free.filter(|free| needed > *free) {
        let [needed, free] = [needed, free].map(|bytes| bytes * 1e-9);
        eprintln!("{nodes} nodes take some {needed:.1} GB; {free:.1} GB of memory are free");
        std::process::exit(2);
    }
}

/// Median time of one call over as many as take `seconds`, at least five.
fn repeated(seconds: f64, mut call: impl FnMut()) -> f64 {
    let mut times = Vec::new();
    let start = Instant::now();
    while times.len() < 5 || start.elapsed().as_secs_f64() < seconds {
        let clock = Instant::now();
        call();
        times.push(clock.elapsed().as_secs_f64());
    }
    median(&mut times)
}

/// Times of the response, and of response and nodal gradient, of a chain of masses, springs and dampers with a force at its end.
fn chain_of_masses(n: usize, nodes: usize, method: &str) {
    let ends = |j: usize| match j {
        0 => Ends::ground(0),
        _ => Ends::between(j, j - 1),
    };
    let elements = (0..n).flat_map(|j| [(Law::Damping, ends(j)), (Law::Stiffness, ends(j))]);
    let structure = Structure::new(n, 0, (0..n).map(Ends::ground).collect(), elements.collect())
        .expect("a chain");
    let methods = [Method::Midpoint, Method::Rk4, Method::ImplicitMidpoint];
    let method = methods.into_iter().find(|m| m.name() == method);
    let system = System {
        grid: Grid::new(0.0, 0.0125 * (nodes - 1) as f64, nodes).expect("a grid"),
        method: method.expect("a method"),
        structure,
    };
    let constant = |level: f64| vec![level; nodes];
    let nodal = NodalCoefficients {
        inertias: vec![constant(1.0); n],
        coefficients: (0..2 * n).map(|e| constant([0.3, 40.0][e % 2])).collect(),
    };
    let force: Vec<f64> = (0..nodes).map(|i| (0.07 * i as f64).sin()).collect();
    let excitation = Excitation {
        forces: vec![(n - 1, StageSamples::linear(&force))],
        ..Excitation::default()
    };
    let driven = Driven {
        system: &system,
        nodal: &nodal,
        excitation: Some(&excitation),
    };
    let initial = State::rest(n);
    let mut states = Trajectory::zeros(n, nodes);
    let mut respond = || {
        let found = driven.respond(EngineMode::Fastest, black_box(&initial), &mut states);
        found.expect("a motion");
    };
    let forward = repeated(0.5, &mut respond);
    respond();
    let source = states.clone();
    let both = repeated(0.5, || {
        let found = driven.respond(EngineMode::Fastest, black_box(&initial), &mut states);
        found.expect("a motion");
        black_box(driven.nodal_adjoint(&states, &source));
    });
    println!(
        "{{\"coordinates\": {n}, \"nodes\": {nodes}, \"forward_seconds\": {forward:.6e}, \"seconds\": {both:.6e}}}"
    );
}

fn study(starts: usize, threads: usize) {
    let model = common::model("knots", &[]);
    let how = common::many_starts(&model, starts, threads);
    let clock = Instant::now();
    let found = multistart(&model.problem, &how);
    let seconds = clock.elapsed().as_secs_f64();
    let iterations = found.runs.iter().filter_map(|run| run.found.as_ref());
    println!(
        "{{\"starts\": {starts}, \"threads\": {threads}, \"seconds\": {seconds:.6e}, \
         \"failures\": {}, \"iterations\": {}, \"lowest\": {:.6e}}}",
        found.runs.len() - found.order.len(),
        iterations.map(|found| found.iterations).sum::<usize>(),
        found.costs().first().copied().unwrap_or(f64::MAX),
    );
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Peak of the resident memory; `None` where the system does not say.
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM"))?;
    let kilobytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024 * kilobytes)
}
