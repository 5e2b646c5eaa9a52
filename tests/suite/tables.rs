//! The tables of a run open without options in spreadsheets, pandas (`read_csv`) and MATLAB (`readtable`).

use crate::common::repository;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Longest name of a variable in MATLAB.
const LONGEST_NAME: usize = 63;

/// Runs with several records, missing samples, bands, truth and a validation record.
const MODELS: [&str; 4] = [
    "paper-forced",
    "linear-mass",
    "accelerometer",
    "hammer-and-shaker",
];

#[test]
fn tables_open_without_options() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for model in MODELS {
        let out = folder.path().join(model);
        let fit = Command::new(env!("CARGO_BIN_EXE_kmcfit"))
            .args(["fit", "--no-report", "--out"])
            .args([&out, &repository(&format!("models/{model}.yaml"))])
            .output()
            .expect("the program runs");
        assert!(fit.status.success(), "{model}: {fit:?}");
        let tables = tables(&out);
        assert!(tables.len() >= 4, "{model}: {tables:?}");
        tables.iter().for_each(|table| opens(table));
    }
    python_agrees(folder.path());
}

/// All CSV files of a run.
fn tables(out: &Path) -> Vec<PathBuf> {
    let folders = [out.to_path_buf(), out.join("channels")];
    let files = folders
        .iter()
        .flat_map(|f| fs::read_dir(f).expect("a folder"));
    let paths = files.map(|file| file.expect("an entry").path());
    paths
        .filter(|p| p.extension().is_some_and(|e| e == "csv"))
        .collect()
}

/// A row of distinct names that are valid variable names, then rows of numbers or empty fields, in ASCII.
fn opens(table: &Path) {
    let text = fs::read_to_string(table).expect("a table");
    let place = table.display();
    assert!(text.is_ascii() && text.ends_with('\n'), "{place}");
    assert!(!text.contains(['\r', '"', ';', '#', '\t', ' ']), "{place}");
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().expect("a header").split(',').collect();
    for name in &names {
        assert!(is_variable(name), "{place}: `{name}`");
    }
    let distinct: BTreeSet<String> = names.iter().map(|n| n.to_lowercase()).collect();
    assert_eq!(distinct.len(), names.len(), "{place}: {names:?}");
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!(fields.len(), names.len(), "{place}: {line}");
        for field in fields {
            assert!(field.is_empty() || is_number(field), "{place}: `{field}`");
        }
    }
}

fn is_variable(name: &str) -> bool {
    let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(word)
        && name.len() <= LONGEST_NAME
}

/// Numbers with decimal points and without words such as `inf`; exponents only for very small or large numbers.
fn is_number(field: &str) -> bool {
    let signs = |c: char| c.is_ascii_digit() || "+-.e".contains(c);
    field.chars().all(signs) && field.parse::<f64>().is_ok_and(f64::is_finite)
}

/// Reads every table with pandas if it is installed, otherwise with the csv module of Python.
const READER: &str = "
import csv, pathlib, sys
try:
    from pandas import read_csv
except ImportError:
    read_csv = None
for path in pathlib.Path(sys.argv[1]).rglob('*.csv'):
    if read_csv:
        assert all(kind.kind in 'fi' for kind in read_csv(path).dtypes), path
    with open(path, newline='') as file:
        for row in csv.DictReader(file):
            [float(value) for value in row.values() if value != '']
";

fn python_agrees(folder: &Path) {
    let python = Command::new("python3")
        .args(["-c", READER])
        .arg(folder)
        .output();
    match python {
        Ok(python) => assert!(python.status.success(), "{python:?}"),
        Err(error) => eprintln!("SKIPPED: no python3 to read the tables with ({error})"),
    }
}
