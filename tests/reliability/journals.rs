//! Journals that were edited or truncated, or belong to other work: they affect the duration and never a result.

use crate::workbench::Workbench;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A study of a model with few parameters.
fn study() -> Workbench {
    let bench = Workbench::with_shipped_models();
    bench.run_to(0, &["study", "models/linear-mass.yaml", "--out", "whole"]);
    bench
}

/// A line with an edited digit, and all later lines, are not recalled.
#[test]
fn edited_numbers_in_a_study_journal_are_not_taken_over() {
    let bench = study();
    let journal = bench.read("whole/study.journal").into_bytes();
    let heading = journal.iter().position(|b| *b == b'\n').expect("lines");
    let digits: Vec<usize> = (heading..journal.len())
        .filter(|i| journal[*i].is_ascii_digit())
        .collect();
    let mut random = ChaCha8Rng::seed_from_u64(23);
    for _ in 0..18 {
        let at = digits[random.random_range(0..digits.len())];
        let mut edited = journal.clone();
        edited[at] = match edited[at] {
            b'9' => b'1',
            digit => digit + 1,
        };
        let _ = std::fs::remove_dir_all(bench.path("run"));
        bench.write("run/study.journal", "");
        std::fs::write(bench.path("run/study.journal"), &edited).expect("room");
        bench.run_to(0, &["resume", "run"]);
        for file in ["study.json", "study.journal"] {
            let read = |run: &str| bench.read(&format!("{run}/{file}"));
            assert!(read("run") == read("whole"), "{file} after an edit at {at}");
        }
    }
}

/// Lines that were moved, removed or duplicated are not recalled.
#[test]
fn reordered_lines_are_not_taken_over() {
    let bench = study();
    let journal = bench.read("whole/study.journal");
    let lines: Vec<&str> = journal.lines().collect();
    assert!(lines.len() > 4, "{}", lines.len());
    let swapped = [lines[0], lines[2], lines[1], lines[3]];
    let skipped = [lines[0], lines[1], lines[3]];
    let doubled = [lines[0], lines[1], lines[1], lines[2]];
    for kept in [&swapped[..], &skipped, &doubled] {
        let _ = std::fs::remove_dir_all(bench.path("run"));
        bench.write("run/study.journal", &(kept.join("\n") + "\n"));
        bench.run_to(0, &["resume", "run"]);
        assert!(bench.read("run/study.json") == bench.read("whole/study.json"));
    }
}

/// The heading has the version of the program; an edited heading is rejected.
#[test]
fn an_edited_heading_is_refused() {
    let bench = study();
    let journal = bench.read("whole/study.journal");
    let version = format!("\"version\":\"{}\"", env!("CARGO_PKG_VERSION"));
    for (from, to) in [
        (version.as_str(), "\"version\":\"0.0.1\""),
        ("\"command\":\"study\"", "\"command\":\"fit\""),
        ("linear-mass.yaml", "knots.yaml"),
    ] {
        assert!(journal.contains(from), "{from}");
        bench.write("run/study.journal", &journal.replacen(from, to, 1));
        let (code, _, stderr) = bench.run(&["resume", "run"]);
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.starts_with("error: run/study.journal: "), "{stderr}");
    }
}
