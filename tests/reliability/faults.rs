//! Every operation that writes, renames, syncs, removes or spawns fails once, fails from then on, or is the moment of a
//! kill (`src/faults.rs`), for every command that writes files. The short run tries a quarter of the operations that
//! `.ci/long faults` tries.

use crate::program::is_long;
use crate::tree::{Entry, Tree, settled, tree, whole_run};
use crate::workbench::{MODEL, Workbench};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// A command, and where its results are.
struct Case {
    arguments: &'static [&'static str],
    /// Folders of runs that it writes, and single files that belong together.
    runs: &'static [&'static str],
    files: &'static [&'static str],
    /// Stride of the tried operations in the long run: long commands have many.
    stride: usize,
}

const fn case(
    arguments: &'static [&'static str],
    runs: &'static [&'static str],
    files: &'static [&'static str],
    stride: usize,
) -> Case {
    Case {
        arguments,
        runs,
        files,
        stride,
    }
}

const CASES: [Case; 9] = [
    case(&["fit", "model.yaml", "--out", "run"], &["run"], &[], 1),
    case(
        &["fit", "model.yaml", "--out", "run", "--checkpoint", "0"],
        &["run"],
        &[],
        3,
    ),
    case(&["resume", "killed"], &["killed"], &[], 3),
    case(
        &["check", "model.yaml", "--gradient", "--out", "checked"],
        &["checked"],
        &[],
        1,
    ),
    case(
        &["predict", "done", "--initial", "1,0", "--out", "predicted"],
        &["predicted"],
        &[],
        1,
    ),
    case(
        &["compare", "model.yaml", "done", "--out", "compared"],
        &["compared", "compared/model"],
        &[],
        3,
    ),
    case(
        &["study", "few.yaml", "--out", "studied", "--threads", "2"],
        &["studied"],
        &[],
        5,
    ),
    case(
        &["simulate", "model.yaml", "--out", "made.csv"],
        &[],
        &["made.csv", "made.csv.json"],
        1,
    ),
    case(
        &["init", "other.csv", "--out", "new/other.yaml"],
        &[],
        &["new/other.yaml", "new/kmcfit.schema.json"],
        1,
    ),
];

/// Two fits of 2000 nodes: only in `.ci/long`.
const DEMO: Case = case(
    &["demo", "--out", "demo"],
    &[
        "demo",
        "demo/results",
        "demo/results/paper",
        "demo/results/physical",
    ],
    &[],
    7,
);

/// A model with few parameters, whose study takes a fraction of a second.
pub fn few() -> String {
    MODEL
        .replace("{basis: nodal, start: 2.0}", "{fixed: 2.0}")
        .replace(
            "{basis: nodal, start: 1.0}",
            "{basis: constant, start: 2.0}",
        )
        .replace("lbfgs", "gauss-newton")
        .replace(
            "stop: {iterations: 5}",
            "stop: {iterations: 20, tolerance: 1.0e-9}",
        )
}

fn bench() -> Workbench {
    let bench = Workbench::with_small_model();
    bench.write("few.yaml", &few());
    bench.write("other.csv", &bench.read("samples.csv"));
    bench.run_to(0, &["fit", "model.yaml", "--out", "done"]);
    // Killed while it writes its results.
    let fit = ["fit", "model.yaml", "--out", "killed", "--checkpoint", "0"];
    let (output, was_reached) = run_with(&bench, &fit, "60!");
    assert!(was_reached && output.status.code().is_none());
    assert!(bench.path("killed/fit.journal").exists());
    bench
}

fn run_with(bench: &Workbench, arguments: &[&str], fault: &str) -> (Output, bool) {
    let log = bench.path("../").join(format!(
        "{}.log",
        bench
            .path("")
            .file_name()
            .expect("a name")
            .to_string_lossy()
    ));
    let _ = fs::remove_file(&log);
    let output = Command::new(env!("CARGO_BIN_EXE_kmcfit"))
        .args(arguments)
        .current_dir(bench.path(""))
        .env("KMCFIT_FAULT", fault)
        .env("KMCFIT_FAULT_LOG", &log)
        .output()
        .expect("the program starts");
    let was_reached = fs::remove_file(&log).is_ok();
    (output, was_reached)
}

/// The files of a run, by their manifest.
fn contents(folder: &Path) -> Result<Tree, String> {
    let files = whole_run(folder)?;
    let all = tree(folder);
    Ok(all
        .into_iter()
        .filter(|(name, _)| files.contains_key(name))
        .collect())
}

/// Files that may stand in the folder beside the results of a run.
fn is_known(name: &str) -> bool {
    let beside = [
        "kmcfit-manifest.json",
        "fit.journal",
        "fit.checkpoint",
        "study.journal",
        "compare.journal",
    ];
    beside
        .iter()
        .any(|known| name == *known || name.ends_with(&format!("/{known}")))
}

#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Once,
    FromThenOn,
    Kill,
}

fn check(case: &Case, mode: Mode, over_an_older_run: bool) {
    let suffix = match mode {
        Mode::Once => "",
        Mode::FromThenOn => "+",
        Mode::Kill => "!",
    };
    let template = bench();
    if over_an_older_run && !["init", "resume"].contains(&case.arguments[0]) {
        // A run of another model, so that old and new results differ.
        let other = MODEL.replace("iterations: 5", "iterations: 3");
        template.write("model.yaml", &other);
        template.write("few.yaml", &few().replace("start: 2.0", "start: 2.2"));
        template.run(case.arguments);
        template.write("model.yaml", MODEL);
        template.write("few.yaml", &few());
    }
    let before = tree(&template.path(""));
    let older: Vec<_> = case
        .runs
        .iter()
        .map(|run| contents(&template.path(run)))
        .collect();
    let whole = Workbench::in_memory();
    crate::tree::copy(&template.path(""), &whole.path(""));
    let (expected, _, stderr) = whole.run(case.arguments);
    assert!(
        expected == 0 || expected == 3,
        "{:?}: {stderr}",
        case.arguments
    );
    let new_files = tree(&whole.path(""));
    // The short run takes other operations over an empty folder than over older results.
    let (mut number, stride) = match is_long() {
        true => (1, case.stride),
        false => (1 + 2 * usize::from(over_an_older_run), 4 * case.stride),
    };
    let mut tried = 0;
    loop {
        let bench = Workbench::in_memory();
        crate::tree::copy(&template.path(""), &bench.path(""));
        let fault = format!("{number}{suffix}");
        let what = format!("{:?} with fault {fault}", case.arguments);
        let (output, was_reached) = run_with(&bench, case.arguments, &fault);
        if !was_reached {
            break;
        }
        tried += 1;
        let stderr = String::from_utf8_lossy(&output.stderr);
        let code = output.status.code();
        match mode {
            Mode::Kill => assert_eq!(code, None, "{what}: {stderr}"),
            _ => {
                assert!(
                    code == Some(expected) || code == Some(2),
                    "{what}: {code:?} {stderr}"
                );
                assert!(!stderr.contains("panicked"), "{what}: {stderr}");
            }
        }
        // At this instant each run is whole: the old one, or the new one, which the next command that opens the
        // folder puts into place.
        for (run, older) in case.runs.iter().zip(&older) {
            let folder = bench.path(run);
            if !folder.is_dir() {
                assert!(older.is_err(), "{what}: {run} is gone");
                continue;
            }
            kmcfit::results::complete(&folder)
                .unwrap_or_else(|error| panic!("{what}: {run}: {error}"));
            match (contents(&folder), older) {
                (Ok(found), Ok(older)) if found == *older => {}
                (Ok(found), _) => is_new(&found, &whole.path(run), &what),
                (Err(why), Ok(_)) => panic!("{what}: {run}: {why}"),
                // There were no results before, and there are only temporary files now.
                (Err(_), Err(_)) => {
                    let left = settled(&tree(&folder));
                    for (name, entry) in &left {
                        let is_fine =
                            is_known(name) || *entry == Entry::Folder || run_below(name, run, case);
                        assert!(is_fine, "{what}: {run} has {name}");
                    }
                }
            }
        }
        let after = tree(&bench.path(""));
        let is_result = |name: &String| {
            case.files.contains(&name.as_str())
                || case.runs.iter().any(|run| name.starts_with(*run))
        };
        for (name, entry) in before.iter().filter(|(name, _)| !is_result(name)) {
            assert!(after.get(name) == Some(entry), "{what}: {name} changed");
        }
        let one_of = |name: &str| {
            let new = new_files.get(name).cloned();
            let (found, old) = (after.get(name), before.get(name));
            assert!(found == old || found == new.as_ref(), "{what}: {name}");
            found == old
        };
        // Files that belong together are all old or all new; a kill may come between them.
        let states: Vec<bool> = case.files.iter().map(|name| one_of(name)).collect();
        let is_mixed = states.windows(2).any(|pair| pair[0] != pair[1]);
        let is_same = new_files == after;
        let may_be_mixed = mode == Mode::Kill || is_same || code == Some(2);
        assert!(!is_mixed || may_be_mixed, "{what}: {states:?}");
        // Without a fault the same command works.
        let is_done = match case.arguments[0] {
            "init" => bench.path("new/other.yaml").exists(),
            // There is no unfinished work to resume, or it was completed.
            "demo" => true,
            _ => false,
        };
        if !is_done {
            let (code, _, stderr) = bench.run(case.arguments);
            assert_eq!(code, expected, "{what}, then without: {stderr}");
        }
        number += stride;
    }
    // The shortest commands have few operations, of which the short run takes a quarter.
    let least = if is_long() { 5 } else { 2 };
    assert!(tried >= least, "{:?}: {tried} faults", case.arguments);
    println!("{:?}: {tried} faults", case.arguments);
}

/// Folders of other runs inside one.
fn run_below(name: &str, run: &str, case: &Case) -> bool {
    let path = format!("{run}/{name}");
    case.runs
        .iter()
        .any(|other| path.starts_with(*other) && *other != run)
}

/// The results equal those of a run without a fault, except for times in the documents and effects of the fault. A journal
/// that could not be written does not affect the results.
fn is_new(found: &Tree, whole: &Path, what: &str) {
    let expected = contents(whole).expect("a whole run");
    let names = |tree: &Tree| tree.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(found), names(&expected), "{what}");
    for (name, entry) in found {
        let has_times = ["result.json", "report.html", "compare.html", "compare.csv"];
        assert!(
            has_times.contains(&name.as_str()) || expected.get(name) == Some(entry),
            "{what}: {name}"
        );
    }
}

fn check_all(mode: Mode) {
    if !cfg!(debug_assertions) {
        eprintln!("SKIPPED: faults are injected in builds with debug assertions only");
        return;
    }
    for case in CASES.iter().chain(is_long().then_some(&DEMO)) {
        for over_an_older_run in [false, true] {
            check(case, mode, over_an_older_run);
        }
    }
}

#[test]
fn every_operation_fails_once() {
    check_all(Mode::Once);
}

#[test]
fn every_operation_fails_and_all_later_ones() {
    check_all(Mode::FromThenOn);
}

#[test]
fn a_kill_at_every_operation() {
    check_all(Mode::Kill);
}

/// A file of an exchange that was damaged after the kill is not put into place, and neither are the others.
#[test]
fn a_damaged_exchange_is_refused() {
    if !cfg!(debug_assertions) {
        eprintln!("SKIPPED: faults are injected in builds with debug assertions only");
        return;
    }
    let template = bench();
    let fit = ["fit", "model.yaml", "--out", "run"];
    template.run_to(0, &fit);
    let exchange = "run/.kmcfit-exchange";
    let killed = (1..).find_map(|number| {
        let bench = Workbench::in_memory();
        crate::tree::copy(&template.path(""), &bench.path(""));
        let (_, was_reached) = run_with(&bench, &fit, &format!("{number}!"));
        assert!(was_reached, "no exchange in {number} operations");
        let has_new = bench.path(&format!("{exchange}/new/result.json")).exists();
        has_new.then_some(bench)
    });
    let killed = killed.expect("an exchange");
    // `None` removes the file.
    let damages = [
        ("new/result.json", Some("{}")),
        ("new/result.json", None),
        ("plan.json", None),
        ("plan.json", Some("{}")),
    ];
    for (name, damage) in damages {
        let bench = Workbench::in_memory();
        crate::tree::copy(&killed.path(""), &bench.path(""));
        let path = bench.path(&format!("{exchange}/{name}"));
        match damage {
            Some(text) => fs::write(path, text).expect("room"),
            None => fs::remove_file(path).expect("removed"),
        }
        let before = tree(&bench.path("run"));
        let (code, _, stderr) = bench.run(&["predict", "run", "--initial", "1,0"]);
        assert_eq!(code, 2, "{name}: {stderr}");
        assert!(
            stderr.contains(exchange) && stderr.contains("hint: move it away"),
            "{stderr}"
        );
        assert!(tree(&bench.path("run")) == before, "{name}");
    }
}
