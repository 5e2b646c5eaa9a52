//! An interrupted and resumed fit is bit-identical to an uninterrupted one.

use kmcfit::config::{BuildMode, Model, ModelFile, build};
use kmcfit::results::{FIT_JOURNAL, FitJournal, Heading, RequestedFiles};
use kmcfit_core::internals::solvers::{
    Fit, IterationRecord, Observer, Status, WeightPath, choose_weight_watched,
    fit_with_noise_watched,
};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A shipped model with some of its text replaced.
fn model(name: &str, changes: &[(&str, &str)]) -> (ModelFile, Model) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("models/{name}.yaml"));
    let mut text = std::fs::read_to_string(&path).expect("a shipped model");
    for (from, to) in changes {
        assert!(text.contains(from), "{name}: {from}");
        text = text.replace(from, to);
    }
    let file = ModelFile::parse(&path, text).expect("a model");
    let model = build(&file, BuildMode::Fit).expect("a model");
    (file, model)
}

/// Fits until the reported iteration `last`.
fn run(model: &Model, journal: Option<&mut FitJournal>, last: u64) -> (Option<WeightPath>, Fit) {
    let mut settings = model.settings.clone();
    let flag = Arc::new(AtomicBool::new(false));
    settings.interrupt = Some(Arc::clone(&flag));
    let mut shown = 0;
    let mut observe = |_: &IterationRecord| {
        shown += 1;
        flag.fetch_or(shown >= last, Ordering::Relaxed);
    };
    let mut watch = Observer::new(&mut observe);
    if let Some(journal) = journal {
        watch = watch.with_checkpoints(journal);
    }
    let (problem, start) = (&model.problem, model.problem.start());
    match &model.weight_rule {
        None => {
            let found = fit_with_noise_watched(problem, &start, &settings, &mut watch);
            (None, found.expect("a motion").1)
        }
        Some(search) => {
            let (rule, which) = (search.rule, &search.penalties);
            let found = choose_weight_watched(problem, &start, &settings, rule, which, &mut watch);
            let (path, _, fit) = found.expect("a motion");
            (Some(path), fit)
        }
    }
}

/// The result of a fit without times; numbers are printed with all digits.
fn told((path, fit): &(Option<WeightPath>, Fit)) -> String {
    format!(
        "{path:?} {:?} {:?} {:?} {:?} {:?} {:?}",
        fit.best, fit.history, fit.snapshots, fit.outcome, fit.counts, fit.attempts
    )
}

/// Interrupts the fit again and again after `each` more iterations until it comes to its end.
fn again_and_again(name: &str, changes: &[(&str, &str)], each: u64) {
    let (file, model) = model(name, changes);
    let whole = run(&model, None, u64::MAX);
    let place = tempfile::tempdir().expect("a folder");
    let heading = Heading::of_model("fit", &file, RequestedFiles::default(), None);
    let mut journal = FitJournal::begin(place.path(), &heading).expect("a journal");
    let mut times = 0;
    let found = loop {
        let found = run(&model, Some(&mut journal), each);
        assert!(journal.trouble().is_none());
        if found.1.outcome.status != Status::Interrupted {
            break found;
        }
        times += 1;
        assert!(times < 1000, "{name} never ends");
        journal = FitJournal::resume(place.path(), &heading).expect("the journal");
    };
    assert!(times >= 2, "{name} was interrupted {times} times only");
    assert!(told(&whole) == told(&found), "{name}: other bits");
    // A journal of which the last line and the checkpoint are torn.
    let path = place.path().join(FIT_JOURNAL);
    let text = std::fs::read(&path).expect("the journal");
    std::fs::write(&path, &text[..text.len() - 7]).expect("room");
    std::fs::write(place.path().join("fit.checkpoint"), "{\"fit\"").expect("room");
    let mut journal = FitJournal::resume(place.path(), &heading).expect("the journal");
    let found = run(&model, Some(&mut journal), u64::MAX);
    assert!(
        told(&whole) == told(&found),
        "{name}: other bits after a tear"
    );
    let healed = std::fs::read(&path).expect("the journal");
    assert_eq!(without_times(&healed), without_times(&text), "{name}");
}

/// The lines of a journal up to the times.
fn without_times(text: &[u8]) -> Vec<String> {
    let text = String::from_utf8(text.to_vec()).expect("text");
    let line = |line: &str| match line.split_once("\"timings\"") {
        Some((before, _)) => before.to_owned(),
        None => line.to_owned(),
    };
    text.lines().map(line).collect()
}

#[test]
fn steepest_descent() {
    again_and_again("paper", &[("iterations: 1000}", "iterations: 40}")], 13);
}

#[test]
fn lbfgs_with_its_memory_full() {
    again_and_again("paper-lbfgs", &[], 150);
}

#[test]
fn gauss_newton_with_many_values() {
    let longer = [("iterations: 100", "iterations: 9"), ("1.0e-6", "1.0e-30")];
    again_and_again("paper-positive", &longer, 2);
}

#[test]
fn projected_gradient() {
    again_and_again("knots", &[("gauss-newton", "projected-gradient")], 17);
}

#[test]
fn rounds_of_sigmas() {
    again_and_again("accelerometer", &[], 2);
}

/// The force as held between its samples leaves residuals that are fitted as correlated noise.
#[test]
fn rounds_of_correlations() {
    let held = [("interpolation: cubic", "interpolation: hold")];
    let (_, model) = model("duffing", &held);
    let start = model.problem.start();
    let mut watch = |_: &IterationRecord| {};
    let mut watch = Observer::new(&mut watch);
    let found = fit_with_noise_watched(&model.problem, &start, &model.settings, &mut watch);
    let (problem, _) = found.expect("a motion");
    assert!(problem.channels().any(|c| c.correlation().is_some()));
    again_and_again("duffing", &held, 3);
}

/// The same with estimated sigmas, each of whose rounds uses the truncated start; interrupted after each iteration in the long run.
#[test]
fn the_beginning_of_a_long_record() {
    let long = [("functions:\n", "grid: {nodes: 40001}\nfunctions:\n")];
    let (_, model) = model("duffing", &long);
    let (_, fit) = run(&model, None, u64::MAX);
    assert_eq!(fit.attempts[0].start.name(), "beginning of the record");
    let each = std::env::var_os("KMCFIT_LONG").map_or(4, |_| 1);
    again_and_again("duffing", &long, each);
}

#[test]
fn a_path_of_weights() {
    let shorter = [
        ("nodes: 2000", "nodes: 400"),
        ("iterations: 40", "iterations: 12"),
    ];
    again_and_again("noisy", &shorter, 9);
}

/// A recalled result whose fingerprint differs is computed again: a journal affects the duration and never the result.
#[test]
fn an_edited_journal_does_not_change_the_result() {
    let (file, model) = model("knots", &[]);
    let whole = run(&model, None, u64::MAX);
    let place = tempfile::tempdir().expect("a folder");
    let heading = Heading::of_model("fit", &file, RequestedFiles::default(), Some(0.0));
    let mut journal = FitJournal::begin(place.path(), &heading).expect("a journal");
    run(&model, Some(&mut journal), 3);
    let path = place.path().join("fit.checkpoint");
    let text = std::fs::read_to_string(&path).expect("a checkpoint");
    let begin = text.find("\"parameters\":\"").expect("parameters") + 14;
    let mut bytes = text.into_bytes();
    bytes[begin + 15] ^= 1;
    std::fs::write(&path, bytes).expect("room");
    let mut journal = FitJournal::resume(place.path(), &heading).expect("the journal");
    let found = run(&model, Some(&mut journal), u64::MAX);
    assert!(told(&whole) == told(&found), "the lie was believed");
}
