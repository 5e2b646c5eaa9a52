//! The public API, name by name.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// `api.txt` lists what the public modules of the core offer, as `topic::Name`: a new name is added to both.
#[test]
fn the_public_names_are_those_of_the_list() {
    let list: BTreeSet<String> = listed().collect();
    assert_eq!(public_names(), list);
}

/// What no one uses is not public.
#[test]
fn every_public_name_is_used_outside_the_core() {
    let root = core().join("../..");
    let folders = [
        "src",
        "python/src",
        "examples",
        "benches",
        "tests",
        "crates/kmcfit-core/tests",
    ];
    let files = folders
        .iter()
        .flat_map(|folder| sources(&root.join(folder)));
    let used: BTreeSet<String> = files.flat_map(|file| used_names(&text(&file))).collect();
    let unused: Vec<String> = listed().filter(|name| !used.contains(name)).collect();
    assert_eq!(unused, Vec::<String>::new());
}

fn listed() -> impl Iterator<Item = String> {
    include_str!("../api.txt").lines().map(str::to_owned)
}

fn core() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn text(file: &Path) -> String {
    fs::read_to_string(file).expect("a source")
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let below = |path: PathBuf| match path.is_dir() {
        true => sources(&path),
        false => vec![path],
    };
    let files = paths.flat_map(below);
    files
        .filter(|path| path.extension().is_some_and(|e| e == "rs"))
        .collect()
}

/// Re-exports and items of the modules that `src/lib.rs` makes public.
fn public_names() -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let library = text(&core().join("src/lib.rs"));
    let topics = library
        .lines()
        .filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';'));
    for topic in topics {
        let file = core().join("src").join(format!("{topic}.rs"));
        let folder = core().join("src").join(topic).join("mod.rs");
        let source = text(if file.exists() { &file } else { &folder });
        for item in source.split("\npub ").skip(1) {
            let (kind, rest) = item.split_once(' ').expect("an item");
            let found = match kind {
                "use" => leaves(rest.split(';').next().expect("an export")),
                "struct" | "enum" | "trait" | "type" | "fn" | "const" => {
                    words(rest).take(1).collect()
                }
                other => panic!("{topic}: pub {other}"),
            };
            names.extend(found.into_iter().map(|name| format!("{topic}::{name}")));
        }
    }
    names
}

/// `A` and `B` of `a::b::{A, B}`.
fn leaves(path: &str) -> Vec<&str> {
    words(path.rsplit_once("::").map_or(path, |(_, names)| names)).collect()
}

/// Each `topic::Name` that follows the name of the crate.
fn used_names(source: &str) -> Vec<String> {
    let mut names = Vec::new();
    for path in source.split("kmcfit_core::").skip(1) {
        let Some((topic, rest)) = path.split_once("::") else {
            continue;
        };
        let found: Vec<&str> = match rest.strip_prefix('{') {
            Some(list) => words(list.split('}').next().unwrap_or_default()).collect(),
            None => words(rest).take(1).collect(),
        };
        names.extend(found.into_iter().map(|name| format!("{topic}::{name}")));
    }
    names
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_')
        .filter(|word| !word.is_empty())
}
