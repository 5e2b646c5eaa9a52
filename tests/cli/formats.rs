//! Binary files of data loggers: one record in every format gives the same result; lists, model files and messages.
//!
//! The files of `tests/formats/` were written by SciPy, pyuff, soundfile, npTDMS and pandas: see `make.py` there.

use crate::workbench::{Workbench, repository};
use insta::assert_snapshot;
use serde_json::Value;
use std::fs;

/// A folder with the files of `tests/formats/`.
fn bench() -> Workbench {
    let bench = Workbench::empty();
    for entry in fs::read_dir(repository("tests/formats")).expect("a folder") {
        let file = entry.expect("an entry");
        fs::copy(file.path(), bench.path("").join(file.file_name())).expect("room");
    }
    bench
}

const MODEL: &str = "\
format: 1
experiments:
  - name: record
    DATA
    sigma: {displacement: estimate}
    initial: {displacement: 0.0, velocity: 0.0}
grid: {nodes: 193}
functions:
  mass:      {basis: constant, start: 1.5}
  damping:   {basis: constant, start: 1.0}
  stiffness: {basis: constant, start: 80.0}
fit: {stop: {iterations: 30, tolerance: 1.0e-10}}
";

/// Numbers of a document with their paths, apart from times of the computation.
fn numbers(value: &Value, path: &str, found: &mut Vec<(String, u64)>) {
    match value {
        Value::Number(number) => {
            let number = number.as_f64().expect("a double");
            found.push((path.to_owned(), number.to_bits()));
        }
        Value::Array(items) => {
            let items = items.iter().enumerate();
            items.for_each(|(i, item)| numbers(item, &format!("{path}[{i}]"), found));
        }
        Value::Object(fields) => {
            let fields = fields
                .iter()
                .filter(|(key, _)| !["timings", "sources", "seconds"].contains(&key.as_str()));
            fields.for_each(|(key, value)| numbers(value, &format!("{path}.{key}"), found));
        }
        _ => {}
    }
}

/// The numbers of `result.json` of a fit to a record.
fn fitted(bench: &Workbench, data: &str) -> Vec<(String, u64)> {
    bench.write("model.yaml", &MODEL.replace("DATA", data));
    bench.run_to(0, &["fit", "model.yaml", "--out", "run", "--no-report"]);
    let document: Value = serde_json::from_str(&bench.read("run/result.json")).expect("JSON");
    let mut found = Vec::new();
    numbers(&document, "", &mut found);
    found
}

/// The record consists of numbers that every format holds exactly, so the bits of all results are equal.
#[test]
fn every_format_gives_the_same_bits() {
    let bench = bench();
    let columns = |prefix: &str, names: [&str; 3]| {
        let [time, displacement, force] = names.map(|name| format!("{prefix}{name}"));
        format!("columns: {{time: {time}, displacement: {displacement}, force: {force}}}")
    };
    let names = ["time", "displacement", "force"];
    let indices = ["1", "2", "3"];
    let expected = fitted(
        &bench,
        &format!("data: record.csv\n    {}", columns("", names)),
    );
    assert!(expected.len() > 50, "{}", expected.len());
    let mass = expected
        .iter()
        .find(|(path, _)| path == ".estimates.mass.value");
    let mass = f64::from_bits(mass.expect("the mass").1);
    // The record was simulated with 2 kg, and rounded to 1/1024 m.
    assert!((mass - 2.0).abs() < 0.01, "{mass}");
    for (file, keys) in [
        ("record.npy", columns("record.", names)),
        ("record.npz", columns("", names)),
        ("stored.npz", columns("record.", indices)),
        ("v4.mat", columns("record.", indices)),
        ("v5.mat", columns("test.", names)),
        ("v7.mat", columns("bench.runs.2.", names)),
        ("record.tdms", "columns: {displacement: Test 1.displacement, force: Test 1.force}".into()),
        ("record.tdms", "columns: {time: time, displacement: 1, force: 2}".into()),
        ("record.uff", "columns: {displacement: displacement_12+Z, force: force_7+Z}".into()),
        ("binary.uff", "columns: {displacement: displacement_12+Z, force: force_7+Z}".into()),
        (
            "record.wav",
            "columns: {displacement: channel 1, force: 2}\n    units: {displacement: 32 m, force: 32 N}".into(),
        ),
    ] {
        let found = fitted(&bench, &format!("data: {file}\n    {keys}"));
        assert_eq!(found, expected, "{file}");
    }
}

/// Lists of the files.
#[test]
fn lists_of_channels() {
    let bench = bench();
    let list = |file: &str| {
        let before = bench.contents();
        let text = bench.run_to(0, &["check", file]);
        assert_eq!(bench.contents(), before, "something was written");
        text
    };
    assert_snapshot!(list("v5.mat"), @"");
    assert_snapshot!(list("v7.mat"), @"");
    assert_snapshot!(list("record.npz"), @"");
    assert_snapshot!(list("record.tdms"), @"");
    assert_snapshot!(list("record.uff"), @"");
    assert_snapshot!(list("record.wav"), @"");
    assert_snapshot!(list("record.csv"), @"");
}

/// Model files from binary files: quantities by the last part of a path.
#[test]
fn model_files() {
    let bench = bench();
    let init = |arguments: &[&str]| {
        let _ = fs::remove_file(bench.path("made.yaml"));
        let arguments = [&["init", "--out", "made.yaml"], arguments].concat();
        bench.run_to(0, &arguments);
        bench.run_to(0, &["check", "made.yaml", "--no-gradient"]);
        let text = bench.read("made.yaml");
        let keys = text.lines().filter(|l| {
            ["    columns", "    units"]
                .iter()
                .any(|k| l.starts_with(k))
        });
        let keys = keys.map(|line| line.split("  #").next().unwrap_or_default().trim());
        keys.collect::<Vec<_>>().join("\n")
    };
    assert_snapshot!(init(&["v5.mat"]), @"");
    assert_snapshot!(init(&["v7.mat"]), @"");
    assert_snapshot!(init(&["record.npy"]), @"");
    assert_snapshot!(init(&["record.tdms"]), @"");
    assert_snapshot!(init(&["binary.uff"]), @"");
    assert_snapshot!(init(&["record.wav", "--units", "32000 mm,32 N"]), @"");
}

/// A file of these bytes.
fn with_bytes(bench: &Workbench, name: &str, bytes: &[u8]) {
    fs::write(bench.path(name), bytes).expect("room");
}

/// Messages of `check FILE`, for exit code 2.
fn refused(bench: &Workbench, arguments: &[&str]) -> String {
    let before = bench.contents();
    let (code, stdout, stderr) = bench.run(arguments);
    assert_eq!((code, &*stdout), (2, ""), "{arguments:?}: {stderr}");
    assert_eq!(bench.contents(), before, "something was written");
    stderr
}

/// Files that are refused as a whole, with the way out.
#[test]
fn refused_files() {
    let bench = bench();
    assert_snapshot!(refused(&bench, &["check", "v73.mat"]), @"");
    assert_snapshot!(refused(&bench, &["init", "objects.npy"]), @"");
    assert_snapshot!(refused(&bench, &["check", "frf.unv"]), @"");
    with_bytes(&bench, "a.parquet", b"PAR1....PAR1");
    assert_snapshot!(refused(&bench, &["check", "a.parquet"]), @"");
    with_bytes(&bench, "a.csv", b"\x1f\x8b\x08\0");
    assert_snapshot!(refused(&bench, &["check", "a.csv"]), @"");
    with_bytes(&bench, "a.npy", b"t,y\n0,1\n");
    assert_snapshot!(refused(&bench, &["check", "a.npy"]), @"");
    fs::copy(bench.path("record.wav"), bench.path("a.mat")).expect("room");
    assert_snapshot!(refused(&bench, &["check", "a.mat"]), @"");
    fs::copy(bench.path("book.xlsx"), bench.path("book.npz")).expect("room");
    assert_snapshot!(refused(&bench, &["check", "book.npz"]), @"");
}

/// The message about a changed file of `tests/formats/`.
fn changed(file: &str, name: &str, change: impl Fn(&mut Vec<u8>)) -> String {
    let bench = Workbench::empty();
    let mut bytes = fs::read(repository("tests/formats").join(file)).expect("a file");
    change(&mut bytes);
    with_bytes(&bench, name, &bytes);
    refused(&bench, &["check", name])
}

/// Replaces the first occurrence.
fn replace<'a>(from: &'a [u8], to: &'a [u8]) -> impl Fn(&mut Vec<u8>) + 'a {
    move |bytes| {
        let at = bytes.windows(from.len()).position(|w| w == from);
        let at = at.expect("the bytes to be replaced");
        bytes.splice(at..at + from.len(), to.iter().copied());
    }
}

#[test]
fn truncated_files() {
    let cut = |file: &str| changed(file, file, |bytes| bytes.truncate(bytes.len() * 2 / 3));
    assert_snapshot!(cut("record.npy"), @"");
    assert_snapshot!(cut("record.npz"), @"");
    assert_snapshot!(cut("v4.mat"), @"");
    assert_snapshot!(cut("v5.mat"), @"");
    assert_snapshot!(cut("v7.mat"), @"");
    assert_snapshot!(cut("record.tdms"), @"");
    assert_snapshot!(cut("record.wav"), @"");
    assert_snapshot!(cut("record.uff"), @"");
    assert_snapshot!(cut("binary.uff"), @"");
}

/// Files with a changed byte, or that state lengths which they do not have.
#[test]
fn damaged_files_of_numpy() {
    let header = "'shape': (193,), }        ";
    let shape = |to: &'static str| replace(header.as_bytes(), to.as_bytes());
    assert_snapshot!(changed("record.npy", "text.npy", shape("'shape': (1e3,), }        ")), @"");
    assert_snapshot!(changed("record.npy", "long.npy", shape("'shape': (999999999999,), }")), @"");
    assert_snapshot!(changed("record.npz", "crc.npz", |bytes| bytes[100] ^= 0x55), @"");
    // In the list of the archive: flags, method, and length of the first array.
    let in_list = |at: usize, value: u8| {
        move |bytes: &mut Vec<u8>| {
            let list = bytes.windows(4).position(|w| w == b"PK\x01\x02");
            bytes[list.expect("the list") + at] = value;
        }
    };
    assert_snapshot!(changed("stored.npz", "encrypted.npz", in_list(8, 1)), @"");
    assert_snapshot!(changed("stored.npz", "lzma.npz", in_list(10, 14)), @"");
    assert_snapshot!(changed("record.npz", "short.npz", in_list(24, 7)), @"");
    assert_snapshot!(changed("record.npz", "bomb.npz", in_list(27, 0x7f)), @"");
}

#[test]
fn damaged_files_of_matlab() {
    assert_snapshot!(changed("v7.mat", "zlib.mat", |bytes| bytes[200] ^= 0x55), @"");
    let dims = |bytes: &mut Vec<u8>| {
        bytes.truncate(128);
        let mut matrix = matrix(b"y", 30);
        matrix[32] = 31;
        bytes.extend(matrix);
    };
    assert_snapshot!(changed("v5.mat", "dims.mat", dims), @"");
    let long = |bytes: &mut Vec<u8>| {
        bytes.truncate(128);
        bytes.extend(matrix(&[b'a'; 2000], 30));
    };
    assert_snapshot!(changed("v5.mat", "name.mat", long), @"");
    let many = |bytes: &mut Vec<u8>| {
        bytes.truncate(128);
        (0..=10_000).for_each(|_| bytes.extend(matrix(b"a", 1)));
    };
    assert_snapshot!(changed("v5.mat", "many.mat", many), @"");
    let deep = |bytes: &mut Vec<u8>| {
        bytes.truncate(128);
        let nested = (0..40).fold(matrix(b"", 1), |inner, _| array(1, b"c", 1, &inner));
        bytes.extend(nested);
    };
    assert_snapshot!(changed("v5.mat", "deep.mat", deep), @"");
    // 40 MB of zeros in 40 kB.
    let bomb = |bytes: &mut Vec<u8>| {
        bytes.truncate(128);
        let zeros = miniz_oxide::deflate::compress_to_vec_zlib(&vec![0; 40_000_000], 6);
        bytes.extend([15u32.to_le_bytes(), (zeros.len() as u32).to_le_bytes()].concat());
        bytes.extend(zeros);
    };
    assert_snapshot!(changed("v5.mat", "bomb.mat", bomb), @"");
}

/// An object of MATLAB: its class gives the lines that export it.
#[test]
fn objects_of_matlab() {
    let object = |class: &'static str| {
        move |bytes: &mut Vec<u8>| {
            bytes.truncate(128);
            let parts = [
                element(6, &[17u32.to_le_bytes(), [0; 4]].concat()),
                element(1, b"TT"),
                element(1, b"MCOS"),
                element(1, class.as_bytes()),
                array(13, b"", 1, &[]),
            ];
            bytes.extend(element(14, &parts.concat()));
        }
    };
    assert_snapshot!(changed("v5.mat", "run.mat", object("timetable")), @"");
    assert_snapshot!(changed("v5.mat", "run.mat", object("table")), @"");
    assert_snapshot!(changed("v5.mat", "run.mat", object("timeseries")), @"");
    assert_snapshot!(changed("v5.mat", "run.mat", object("datetime")), @"");
    assert_snapshot!(changed("v5.mat", "run.mat", object("duration")), @"");
    assert_snapshot!(changed("v5.mat", "run.mat", object("idpoly")), @"");
}

#[test]
fn damaged_files_of_loggers() {
    assert_snapshot!(changed("record.wav", "a-law.wav", |bytes| bytes[20] = 6), @"");
    assert_snapshot!(changed("record.wav", "channels.wav", |bytes| bytes[22] = 0), @"");
    assert_snapshot!(changed("record.wav", "empty.wav", |bytes| bytes.truncate(36)), @"");
    assert_snapshot!(changed("record.tdms", "daqmx.tdms", |bytes| bytes[4] |= 0x80), @"");
    let kind = replace(&[10, 0, 0, 0, 1, 0, 0, 0], &[0x77, 0, 0, 0, 1, 0, 0, 0]);
    assert_snapshot!(changed("record.tdms", "kind.tdms", kind), @"");
    assert_snapshot!(changed("record.tdms", "segment.tdms", |bytes| bytes.extend(b"end of the file and more bytes")), @"");
}

#[test]
fn damaged_universal_files() {
    let number = replace(b"2.14843750000e-02", b"2.1484375000Oe-02");
    assert_snapshot!(changed("record.uff", "letter.uff", number), @"");
    let count = replace(b"         4       193", b"         4       199");
    assert_snapshot!(changed("record.uff", "few.uff", count), @"");
    assert_snapshot!(changed("record.uff", "form.uff", replace(b"         4       193", b"      four       193")), @"");
    let count = replace(b"         4       193", b"         4       199");
    assert_snapshot!(changed("binary.uff", "few.uff", count), @"");
    let format = |from: &'static [u8], to: &'static [u8]| {
        changed("binary.uff", "form.uff", replace(from, to))
    };
    assert_snapshot!(format(b"58b     1     2", b"58b     1     3"), @"");
    assert_snapshot!(format(b"58b     1     2  ", b"58b     x     y z"), @"");
}

/// Choices of columns in a model file.
#[test]
fn choices_of_columns() {
    let bench = bench();
    let choose = |data: &str| {
        bench.write("model.yaml", &MODEL.replace("DATA", data));
        refused(&bench, &["fit", "model.yaml"])
    };
    assert_snapshot!(choose("data: v5.mat\n    columns: {time: test.time, displacement: test.displacment}"), @"");
    assert_snapshot!(choose("data: v5.mat\n    columns: {time: time, displacement: test.displacement}"), @"");
    assert_snapshot!(choose("data: v5.mat\n    columns: {time: test.time, displacement: fs}"), @"");
    assert_snapshot!(choose("data: v5.mat\n    columns: {time: test.time, displacement: 9}"), @"");
    assert_snapshot!(choose("data: v7.mat\n    columns: {time: bench.runs.2.time, displacement: bench.spectrum}"), @"");
    assert_snapshot!(
        choose("data: v5.mat\n    format: {decimal: comma}\n    columns: {time: test.time, displacement: test.displacement}"),
        @""
    );
    assert_snapshot!(choose("data: record.wav\n    columns: {displacement: 1}\n    units: {displacement: 0 m}"), @"");
    let init = |units: &str| refused(&bench, &["init", "record.wav", "--units", units]);
    assert_snapshot!(init("50 g"), @"");
    assert_snapshot!(init("50 gg,1 N"), @"");
    assert_snapshot!(refused(&bench, &["init", "v5.mat", "--units", "50 g"]), @"");
    // Two records of different length, of which none is named.
    let mut bytes = fs::read(bench.path("v5.mat")).expect("a file");
    bytes.truncate(128);
    bytes.extend(matrix(b"time", 40));
    bytes.extend(matrix(b"acc", 40));
    bytes.extend(matrix(b"t", 30));
    bytes.extend(matrix(b"y", 30));
    with_bytes(&bench, "two.mat", &bytes);
    assert_snapshot!(refused(&bench, &["init", "two.mat"]), @"");
}

/// An element of version 5 of MATLAB.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// An array of version 5 of MATLAB: class, name, number of rows in one column, and content.
fn array(class: u32, name: &[u8], rows: u32, content: &[u8]) -> Vec<u8> {
    let words = |words: [u32; 2]| words.map(u32::to_le_bytes).concat();
    let parts = [
        element(6, &words([class, 0])),
        element(5, &words([rows, 1])),
        element(1, name),
        content.to_vec(),
    ];
    element(14, &parts.concat())
}

/// A column of the numbers 1 to `count`.
fn matrix(name: &[u8], count: u32) -> Vec<u8> {
    let numbers: Vec<u8> = (1..=count)
        .flat_map(|x| f64::from(x).to_le_bytes())
        .collect();
    array(6, name, count, &element(9, &numbers))
}

/// Missing and infinite samples are reported with their channel and number.
#[test]
fn samples_that_are_no_numbers() {
    let bench = bench();
    let with = |value: f64| {
        let mut bytes = fs::read(repository("tests/formats/v4.mat")).expect("a file");
        // The header of 20 bytes, `record` and a zero; the 11th displacement.
        let at = 27 + 8 * (193 + 10);
        bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
        with_bytes(&bench, "v4.mat", &bytes);
        let keys =
            "data: v4.mat\n    columns: {time: record.1, displacement: record.2, force: record.3}";
        bench.write("model.yaml", &MODEL.replace("DATA", keys));
    };
    with(f64::NAN);
    let (_, stdout, _) = bench.run(&["check", "model.yaml", "--no-gradient"]);
    assert_snapshot!(stdout, @"");
    with(f64::INFINITY);
    assert_snapshot!(refused(&bench, &["check", "model.yaml"]), @"");
}
