//! Random output folders (files, folders and links of the user, older runs of this and of other commands, edited and
//! read-only entries) and random commands: afterwards every file of the user has its bytes, and of each run that
//! was there the old or the new one is complete.
//!
//! `KMCFIT_SEED` draws other folders, `KMCFIT_CASES` more of them.

use crate::faults::few;
use crate::program::is_long;
use crate::tree::{Entry, Tree, copy, settled, tree, whole_run};
use crate::workbench::{MODEL, Workbench};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fs;

const OUT: &str = "out";
/// Commands that write into the folder.
const COMMANDS: [&[&str]; 10] = [
    &["fit", "model.yaml", "--out", OUT],
    &["fit", "model.yaml", "--out", OUT, "--no-report"],
    &["check", "model.yaml", "--gradient", "--out", OUT],
    &["predict", "done", "--initial", "1,0", "--out", OUT],
    &["compare", "model.yaml", "done", "--out", OUT],
    &["compare", "done", "done", "--out", OUT],
    &["simulate", "model.yaml", "--out", "out/history.csv"],
    &["init", "samples.csv", "--out", "out/model.yaml"],
    &["resume", OUT],
    &["study", "few.yaml", "--out", OUT, "--threads", "1"],
];
/// Two fits of 2000 nodes: only in `.ci/long`.
const DEMO: &[&str] = &["demo", "--out", OUT];
/// Names that commands write, and names that no command writes.
const NAMES: [&str; 22] = [
    "result.json",
    "history.csv",
    "history.csv.json",
    "functions.csv",
    "report.html",
    "figures/motion.svg",
    "figures/functions.svg",
    "figures/predictions.svg",
    "figures/mine.svg",
    "channels/1-displacement.csv",
    "channels/mine.csv",
    "compare.csv",
    "compare.html",
    "gradient.csv",
    "predictions.csv",
    "kmcfit-manifest.json",
    "fit.journal",
    "compare.journal",
    "model/result.json",
    "model/mine.txt",
    ".kmcfit-mine/notes.txt",
    "mine.txt",
];

fn variable(name: &str, default: u64) -> u64 {
    let given = std::env::var(name).ok();
    given.and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Finished runs of every kind, to be copied.
fn templates() -> Workbench {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &["fit", "model.yaml", "--out", "done"]);
    bench.write("few.yaml", &few());
    let other = MODEL.replace("iterations: 5", "iterations: 3");
    bench.write("other.yaml", &other);
    bench.run_to(0, &["fit", "other.yaml", "--out", "kinds/fit"]);
    bench.run_to(
        0,
        &["check", "other.yaml", "--gradient", "--out", "kinds/check"],
    );
    bench.run_to(
        0,
        &[
            "predict",
            "done",
            "--initial",
            "2,0",
            "--out",
            "kinds/predict",
        ],
    );
    bench.run_to(
        0,
        &["compare", "other.yaml", "done", "--out", "kinds/compare"],
    );
    bench
}

/// Creates a file, folder or link of the user.
fn add_foreign(bench: &Workbench, random: &mut ChaCha8Rng) {
    let name = NAMES[random.random_range(0..NAMES.len())];
    let path = bench.path(OUT).join(name);
    let parent = path.parent().expect("a folder");
    if path.symlink_metadata().is_ok() || fs::create_dir_all(parent).is_err() {
        return;
    }
    match random.random_range(0..6) {
        0 => fs::create_dir(&path).expect("a folder"),
        1 => {
            #[cfg(unix)]
            std::os::unix::fs::symlink(bench.path("elsewhere/file.txt"), &path).expect("a link");
        }
        2 => {
            #[cfg(unix)]
            std::os::unix::fs::symlink(bench.path("elsewhere"), &path).expect("a link");
        }
        3 => {
            fs::write(&path, "mine, read-only\n").expect("a file");
            let mut permissions = path.metadata().expect("a file").permissions();
            permissions.set_readonly(true);
            fs::set_permissions(&path, permissions).expect("permissions");
        }
        _ => fs::write(&path, format!("mine {}\n", random.random::<u32>())).expect("a file"),
    }
}

/// Edits a file of a run, which then belongs to the user.
fn edit(bench: &Workbench, random: &mut ChaCha8Rng) {
    if !bench.path(OUT).is_dir() {
        return;
    }
    let files: Vec<String> = (tree(&bench.path(OUT)).into_iter())
        .filter(|(_, entry)| matches!(entry, Entry::File(_)))
        .map(|(name, _)| name)
        .collect();
    if files.is_empty() {
        return;
    }
    let path = bench
        .path(OUT)
        .join(&files[random.random_range(0..files.len())]);
    match random.random_range(0..3) {
        0 => fs::remove_file(path).expect("removed"),
        _ => fs::write(path, "edited\n").expect("a file"),
    }
}

/// The entries that belong to runs, by the manifests in the folder and in those below it.
fn own(bench: &Workbench, before: &Tree) -> Vec<String> {
    let mut own = Vec::new();
    let below = before.iter().filter(|(_, entry)| **entry == Entry::Folder);
    let runs = below.map(|(name, _)| format!("{name}/"));
    for run in std::iter::once(String::new()).chain(runs) {
        let folder = bench.path(OUT).join(&run);
        let Ok(Some(manifest)) = kmcfit::results::Manifest::read(&folder) else {
            continue;
        };
        own.push(format!("{run}kmcfit-manifest.json"));
        for (name, record) in &manifest.files {
            let name = format!("{run}{name}");
            if let Some(Entry::File(bytes)) = before.get(&name)
                && kmcfit::results::FileRecord::of(bytes) == *record
            {
                own.push(name);
            }
        }
    }
    own
}

#[test]
fn files_of_the_user_stay_and_runs_are_whole() {
    let templates = templates();
    let seed = variable("KMCFIT_SEED", 4711);
    let is_long = is_long();
    let (mut refused, mut done) = (0, 0);
    for number in 0..variable("KMCFIT_CASES", 100) {
        let mut random = ChaCha8Rng::seed_from_u64(seed.wrapping_add(number));
        let bench = Workbench::in_memory();
        copy(&templates.path(""), &bench.path(""));
        bench.write("elsewhere/file.txt", "mine\n");
        let kinds = ["fit", "check", "predict", "compare"];
        if random.random_range(0..3) > 0 {
            let kind = kinds[random.random_range(0..kinds.len())];
            copy(&bench.path(&format!("kinds/{kind}")), &bench.path(OUT));
        }
        if random.random_range(0..2) == 0 {
            for _ in 0..random.random_range(1..4) {
                add_foreign(&bench, &mut random);
            }
        }
        if random.random_range(0..4) == 0 {
            edit(&bench, &mut random);
        }
        for step in 0..2 {
            let before = tree(&bench.path(""));
            let own: Vec<String> = match bench.path(OUT).is_dir() {
                true => {
                    let inside = tree(&bench.path(OUT));
                    own(&bench, &inside)
                        .iter()
                        .map(|name| format!("{OUT}/{name}"))
                        .collect()
                }
                false => Vec::new(),
            };
            let command = match random.random_range(0..COMMANDS.len() + usize::from(is_long)) {
                index if index < COMMANDS.len() => COMMANDS[index],
                _ => DEMO,
            };
            let what = format!("case {number} of seed {seed}, step {step}: {command:?}");
            let (code, _, stderr) = bench.run(command);
            let after = tree(&bench.path(""));
            assert!([0, 2, 3].contains(&code), "{what}: {code} {stderr}");
            // Journals and the record of simulated measurements are the program's, where it wrote them.
            let is_written = |name: &str| {
                own.iter().any(|known| known == name)
                    || name.ends_with(".journal") && is_journal(before.get(name))
                    || command[0] == "simulate" && is_simulated(&before, name)
            };
            for (name, entry) in &before {
                if !is_written(name) {
                    assert!(
                        after.get(name) == Some(entry),
                        "{what}: {name} is not what it was: {stderr}"
                    );
                }
            }
            match code {
                2 => {
                    refused += 1;
                    assert!(settled(&after) == settled(&before), "{what}: {stderr}");
                }
                _ => done += 1,
            }
            if code != 2 && !["simulate", "init", "resume"].contains(&command[0]) {
                whole_run(&bench.path(OUT)).unwrap_or_else(|why| panic!("{what}: {why}"));
            }
        }
    }
    // At least some commands must have written results.
    assert!(refused > 20 && done > 20, "{refused} refused, {done} done");
}

/// True if an entry is a journal of the program: it has a heading with a checksum.
fn is_journal(entry: Option<&Entry>) -> bool {
    matches!(entry, Some(Entry::File(bytes)) if bytes.starts_with(b"{\"format\":2,"))
}

/// True if a file is a table of `simulate`, or its provenance file.
fn is_simulated(before: &Tree, name: &str) -> bool {
    let record = match name.strip_suffix(".json") {
        Some(_) => name.to_owned(),
        None => format!("{name}.json"),
    };
    matches!(before.get(&record), Some(Entry::File(bytes)) if bytes.starts_with(b"{\n  \"made_by\""))
}
