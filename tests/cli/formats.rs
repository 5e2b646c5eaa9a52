//! Binary files of data loggers: one record in every format gives the same result; lists, model files and messages.
//!
//! The files of `tests/formats/` were written by SciPy, h5py, pyuff, soundfile and npTDMS: see `make.py` there.

use crate::workbench::{Workbench, repository};
use insta::assert_snapshot;
use serde_json::Value;
use std::fs;

/// A folder with the files of `tests/formats/`.
fn bench() -> Workbench {
    let bench = Workbench::empty();
    for entry in fs::read_dir(repository("tests/formats")).expect("a folder") {
        let file = entry.expect("an entry");
        if file.path().is_file() {
            fs::copy(file.path(), bench.path("").join(file.file_name())).expect("room");
        }
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
        ("v5.mat", columns("test.", names)),
        ("v7.mat", columns("bench.runs.2.", names)),
        ("v73.mat", columns("bench.runs.2.", names)),
        ("record.h5", "columns: {time: test.time, displacement: test.record.1, force: test.record.2}\n    units: {force: N}".into()),
        ("latest.h5", format!("{}\n    units: {{force: 0.0009765625 N}}", columns("test.", names))),
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
    assert_snapshot!(list("v5.mat"), @"
    v5.mat: MATLAB file (version 5 to 7)
      column  name               quantity      unit         samples  rate
      1       test.time          time          s (assumed)  193      64 Hz
      2       test.displacement  displacement  m (assumed)  193      64 Hz
      3       test.force         force         N (assumed)  193      64 Hz
      4       fs                 -             -            1        -
    not usable: `test.operator`, text
    `kmcfit init v5.mat` writes a model file
    ");
    assert_snapshot!(list("v7.mat"), @"
    v7.mat: MATLAB file (version 5 to 7)
      column  name                       quantity      unit         samples  rate
      1       bench.runs.2.time          time          s (assumed)  193      64 Hz
      2       bench.runs.2.displacement  displacement  m (assumed)  193      64 Hz
      3       bench.runs.2.force         force         N (assumed)  193      64 Hz
    not usable: `bench.runs.1`, text
    not usable: `bench.runs.2.operator`, text
    not usable: `bench.spectrum`, complex numbers
      save the real samples in time, for instance `real(x)`
    `kmcfit init v7.mat` writes a model file
    ");
    assert_snapshot!(list("v73.mat"), @"
    v73.mat: MATLAB file (version 7.3)
      column  name                       quantity      unit         samples  rate
      1       bench.runs.2.displacement  displacement  m (assumed)  193      64 Hz
      2       bench.runs.2.force         force         N (assumed)  193      64 Hz
      3       bench.runs.2.time          time          s (assumed)  193      64 Hz
      4       fs                         -             -            1        -
    not usable: `bench.runs.1`, text
    not usable: `bench.runs.2.operator`, text
    not usable: `bench.spectrum`, complex numbers
      save the real samples in time, for instance `real(x)`
    not usable: `empty`, an empty array
    not usable: `log`, an object of the class `table`
      in MATLAB: `S = table2struct(log, 'ToScalar', true); save('v73.mat', 'S', '-v7')`
    `kmcfit init v73.mat` writes a model file
    ");
    assert_snapshot!(list("record.h5"), @"
    record.h5: HDF5 file
      column  name           quantity      unit         samples  rate
      1       test.lzf       -             -            193      64 Hz
      2       test.record.1  displacement  m            193      64 Hz
      3       test.record.2  displacement  m            193      64 Hz
      4       test.time      time          s (assumed)  193      64 Hz
    not usable: `test.cube`, an array with 3 dimensions
      save arrays with two dimensions, for instance `squeeze(x)`
    not usable: `test.never`, an array that was never written
    not usable: `test.note`, texts
    `kmcfit init record.h5` writes a model file
    ");
    assert_snapshot!(list("latest.h5"), @"
    latest.h5: HDF5 file
      column  name               quantity      unit         samples  rate
      1       dense.0            -             -            1        -
      2       dense.1            -             -            1        -
      3       dense.2            -             -            1        -
      4       dense.3            -             -            1        -
      5       dense.4            -             -            1        -
      6       dense.5            -             -            1        -
      7       dense.6            -             -            1        -
      8       dense.7            -             -            1        -
      9       dense.8            -             -            1        -
      10      dense.9            -             -            1        -
      11      test.chunks        -             -            193      64 Hz
      12      test.displacement  displacement  m (assumed)  193      64 Hz
      13      test.force         force         N            193      64 Hz
      14      test.time          time          s (assumed)  193      64 Hz
    `kmcfit init latest.h5` writes a model file
    ");
    assert_snapshot!(list("record.npz"), @"
    record.npz: NumPy archive
      column  name          quantity      unit         samples  rate
      1       time          time          s (assumed)  193      64 Hz
      2       displacement  displacement  m (assumed)  193      64 Hz
      3       force         force         N (assumed)  193      64 Hz
      4       rate          -             -            1        -
    not usable: `note`, texts
    `kmcfit init record.npz` writes a model file
    ");
    assert_snapshot!(list("record.tdms"), @"
    record.tdms: TDMS file
      column  name                 quantity      unit  samples  rate
      1       Test 1.displacement  displacement  m     193      64 Hz
      2       Test 1.force         force         N     193      64 Hz
      -       time                 time          s     193      64 Hz
    not usable: `Notes.remarks`, texts
    `kmcfit init record.tdms` writes a model file
    ");
    assert_snapshot!(list("record.uff"), @"
    record.uff: universal file
      column  name               quantity      unit  samples  rate
      1       displacement_12+Z  displacement  m     193      64 Hz
      2       force_7+Z          force         N     193      64 Hz
      -       time               time          s     193      64 Hz
    not usable: `frequency_response_function_12+Z`, a frequency response function of complex numbers
      kmcfit reads records in time: export the time histories
    `kmcfit init record.uff` writes a model file
    ");
    assert_snapshot!(list("record.wav"), @"
    record.wav: WAV file
      column  name       quantity  unit  samples  rate
      1       channel 1  -         -     193      64 Hz
      2       channel 2  -         -     193      64 Hz
      -       time       time      s     193      64 Hz
    `kmcfit init record.wav` writes a model file
    ");
    assert_snapshot!(list("record.csv"), @"
    record.csv: UTF-8; separated by commas; decimal point; column names in line 1
      column  name          quantity      unit         samples  rate
      1       time          time          s (assumed)  193      64 Hz
      2       displacement  displacement  m (assumed)  193      64 Hz
      3       force         force         N (assumed)  193      64 Hz
    `kmcfit init record.csv` writes a model file
    ");
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
    assert_snapshot!(refused(&bench, &["check", "circle.h5"]), @"
    error: circle.h5: groups, structs or cells are nested too deeply
      found: `a.b.b.b.b.b.b.b.b.b.b.b.b.b.b.b.b.b.b.b.…`
      expected: at most 32 levels
    ");
    assert_snapshot!(refused(&bench, &["init", "objects.npy"]), @"
    error: objects.npy: the NumPy array has no samples that can be used
      found: `objects`: Python objects
      expected: arrays or channels of real numbers
      hint: Python objects are stored as pickles, which can run code: save the numbers with `numpy.savez(file, force=force.astype(float))`
    ");
    assert_snapshot!(refused(&bench, &["check", "frf.unv"]), @"
    error: frf.unv: the universal file has no samples that can be used
      found: `frequency_response_function_12+Z`: a frequency response function of complex numbers
      expected: arrays or channels of real numbers
      hint: kmcfit reads records in time: export the time histories
    ");
    with_bytes(&bench, "record.parquet", b"PAR1");
    assert_snapshot!(refused(&bench, &["check", "record.parquet"]), @"
    error: record.parquet: this is a Parquet file, which is not read
      expected: a text table, or a file of NumPy, MATLAB, HDF5, LabVIEW (TDMS), WAV or UFF
      hint: export it as CSV from pandas: `pandas.read_parquet(file).to_csv('record.csv', index=False)`
    ");
    with_bytes(&bench, "a.csv", b"\x1f\x8b\x08\0");
    assert_snapshot!(refused(&bench, &["check", "a.csv"]), @"
    error: a.csv: the file cannot be read: unexpected end of file
      hint: unpack the file, and name the table in it
    ");
    with_bytes(&bench, "a.npy", b"t,y\n0,1\n");
    assert_snapshot!(refused(&bench, &["check", "a.npy"]), @"
    error: a.npy: the file is no NumPy array, although its name ends with .npy
      found: text
      expected: the first bytes of a NumPy array
      hint: if it is a text table, rename it to .txt
    ");
    fs::copy(bench.path("record.wav"), bench.path("a.mat")).expect("room");
    assert_snapshot!(refused(&bench, &["check", "a.mat"]), @"
    error: a.mat: the file is no MATLAB file (version 5 to 7), although its name ends with .mat
      found: a WAV file
      expected: the first bytes of a MATLAB file (version 5 to 7)
      hint: rename the file to its format
    ");
    fs::copy(bench.path("book.xlsx"), bench.path("book.npz")).expect("room");
    assert_snapshot!(refused(&bench, &["check", "book.npz"]), @"
    error: book.npz: this is a workbook of a spreadsheet, which is not read
      expected: a text table, or a file of NumPy, MATLAB, HDF5, LabVIEW (TDMS), WAV or UFF
      hint: save the sheet as CSV
    ");
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

/// Damaged files of HDF5: the superblock, the members of a group, and the end.
#[test]
fn damaged_hdf5() {
    let hdf5 = |from: &[u8], to: &[u8]| changed("v73.mat", "a.mat", replace(from, to));
    assert_snapshot!(hdf5(b"\x89HDF", b"\x88HDF"), @"
    error: a.mat: the file is damaged: its structure
      found: HDF5 format error: HDF5 signature not found at any valid offset
      hint: export or copy the file again
    ");
    assert_snapshot!(hdf5(b"TREE", b"TREX"), @"
    error: a.mat: the MATLAB file (version 7.3) has no samples that can be used
      found: `/`: data that cannot be read (HDF5 format error: invalid B-tree v1 signature)
      expected: arrays or channels of real numbers
      hint: in MATLAB: `load('a.mat'); save('a.mat', '-v7')`
    ");
    assert_snapshot!(changed("v73.mat", "a.mat", |bytes| bytes.truncate(600)), @"
    error: a.mat: the file is damaged: its structure
      found: HDF5 format error: unexpected EOF: need 96 bytes, have 88
      hint: export or copy the file again
    ");
}

#[test]
fn truncated_files() {
    let cut = |file: &str| changed(file, file, |bytes| bytes.truncate(bytes.len() * 2 / 3));
    assert_snapshot!(cut("record.npy"), @"
    error: record.npy: the file is truncated in the array `record`
      found: 3024 bytes from byte 192 on
      expected: 4632 bytes
      hint: copy or export the file again
    ");
    assert_snapshot!(cut("record.npz"), @"
    error: record.npz: the file is damaged: the list of the archive's files
      found: invalid Zip archive: Could not find EOCD
      hint: export or copy the file again
    ");
    assert_snapshot!(cut("v5.mat"), @"
    error: v5.mat: the file is truncated in a variable
      found: 3314 bytes from byte 136 on
      expected: 4976 bytes
      hint: copy or export the file again
    ");
    assert_snapshot!(cut("v7.mat"), @"
    error: v7.mat: the file is truncated in a variable
      found: 997 bytes from byte 136 on
      expected: 1564 bytes
      hint: copy or export the file again
    ");
    assert_snapshot!(cut("record.wav"), @"
    error: record.wav: the file is truncated in the samples
      found: 500 bytes from byte 44 on
      expected: 772 bytes
      hint: copy or export the file again
    ");
    assert_snapshot!(cut("record.uff"), @"
    error: record.uff:100:1: the file is truncated in data set 58
        |
    100 |   -1.53496093750e+01  -1.50898437500e+01  -1.46591796875e+01  -1.4058
        | ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
      found: the end of the file
      expected: the lines of the data set, and a line `-1`
    ");
    assert_snapshot!(cut("binary.uff"), @"
    error: binary.uff:31:1: the file is truncated in data set 58
       |
    31 |         13    0    0    0 NONE
       | ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^
      found: the end of the file
      expected: the lines of the data set, and a line `-1`
    ");
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
    assert_snapshot!(changed("v5.mat", "run.mat", object("timetable")), @"
    error: run.mat: the MATLAB file (version 5 to 7) has no samples that can be used
      found: `TT`: an object of the class `timetable`
      expected: arrays or channels of real numbers
      hint: in MATLAB: `S = table2struct(timetable2table(TT), 'ToScalar', true); S.Time = seconds(S.Time - S.Time(1)); save('run.mat', 'S', '-v7')`
    ");
    assert_snapshot!(changed("v5.mat", "run.mat", object("table")), @"
    error: run.mat: the MATLAB file (version 5 to 7) has no samples that can be used
      found: `TT`: an object of the class `table`
      expected: arrays or channels of real numbers
      hint: in MATLAB: `S = table2struct(TT, 'ToScalar', true); save('run.mat', 'S', '-v7')`
    ");
    assert_snapshot!(changed("v5.mat", "run.mat", object("timeseries")), @"
    error: run.mat: the MATLAB file (version 5 to 7) has no samples that can be used
      found: `TT`: an object of the class `timeseries`
      expected: arrays or channels of real numbers
      hint: in MATLAB: `S.time = TT.Time; S.data = squeeze(TT.Data); save('run.mat', 'S', '-v7')`
    ");
    assert_snapshot!(changed("v5.mat", "run.mat", object("datetime")), @"
    error: run.mat: the MATLAB file (version 5 to 7) has no samples that can be used
      found: `TT`: an object of the class `datetime`
      expected: arrays or channels of real numbers
      hint: in MATLAB: `S.time = seconds(TT - TT(1)); save('run.mat', 'S', '-v7')`
    ");
    assert_snapshot!(changed("v5.mat", "run.mat", object("duration")), @"
    error: run.mat: the MATLAB file (version 5 to 7) has no samples that can be used
      found: `TT`: an object of the class `duration`
      expected: arrays or channels of real numbers
      hint: in MATLAB: `S.time = seconds(TT); save('run.mat', 'S', '-v7')`
    ");
    assert_snapshot!(changed("v5.mat", "run.mat", object("idpoly")), @"
    error: run.mat: the MATLAB file (version 5 to 7) has no samples that can be used
      found: `TT`: an object of the class `idpoly`
      expected: arrays or channels of real numbers
      hint: in MATLAB: `S = struct(TT); save('run.mat', 'S', '-v7')`
    ");
}

/// Choices of columns in a model file.
#[test]
fn choices_of_columns() {
    let bench = bench();
    let choose = |data: &str| {
        bench.write("model.yaml", &MODEL.replace("DATA", data));
        refused(&bench, &["fit", "model.yaml"])
    };
    assert_snapshot!(choose("data: v5.mat\n    columns: {time: test.time, displacement: test.displacment}"), @"
    error: model.yaml:5:46: experiments[0].columns.displacement: v5.mat: there is no such column
      |
    5 |     columns: {time: test.time, displacement: test.displacment}
      |                                              ^^^^^^^^^^^^^^^^
      found: `test.displacment`
      expected: one of: test.time, test.displacement, test.force, fs
      hint: did you mean `test.displacement`?
    ");
    assert_snapshot!(choose("data: v5.mat\n    columns: {time: time, displacement: test.displacement}"), @"
    error: model.yaml:5:21: experiments[0].columns.time: v5.mat: there is no such column
      |
    5 |     columns: {time: time, displacement: test.displacement}
      |                     ^^^^
      found: `time`
      expected: one of: test.time, test.displacement, test.force, fs
      hint: did you mean `test.time`?
    ");
    assert_snapshot!(choose("data: v5.mat\n    columns: {time: test.time, displacement: fs}"), @"
    error: model.yaml:5:46: experiments[0].columns.displacement: v5.mat: the columns have different times
      |
    5 |     columns: {time: test.time, displacement: fs}
      |                                              ^^
      found: `fs`: 1 sample
      expected: 193 samples, as `test.time`
      hint: name columns of the same length and rate; another channel can have its own `data` and `time`
    ");
    assert_snapshot!(choose("data: v5.mat\n    columns: {time: test.time, displacement: 9}"), @"
    error: model.yaml:5:46: experiments[0].columns.displacement: v5.mat: no such column number
      |
    5 |     columns: {time: test.time, displacement: 9}
      |                                              ^
      found: 9
      expected: 1 to 4
    ");
    assert_snapshot!(choose("data: v7.mat\n    columns: {time: bench.runs.2.time, displacement: bench.spectrum}"), @"
    error: model.yaml:5:54: experiments[0].columns.displacement: v7.mat: `bench.spectrum` holds no samples in time
      |
    5 |     columns: {time: bench.runs.2.time, displacement: bench.spectrum}
      |                                                      ^^^^^^^^^^^^^^
      found: complex numbers
      expected: real numbers
      hint: save the real samples in time, for instance `real(x)`
    ");
    assert_snapshot!(
        choose("data: v5.mat\n    format: {decimal: comma}\n    columns: {time: test.time, displacement: test.displacement}"),
        @"
    error: model.yaml:5:23: experiments[0].format.decimal: a format of text is stated for a binary file
      |
    5 |     format: {decimal: comma}
      |                       ^^^^^
      found: v5.mat, a MATLAB file (version 5 to 7)
      expected: a text table, or no `format`
    "
    );
    assert_snapshot!(choose("data: record.wav\n    columns: {displacement: 1}\n    units: {displacement: 0 m}"), @"
    error: model.yaml:6:27: experiments[0].units.displacement: invalid factor of a unit
      |
    6 |     units: {displacement: 0 m}
      |                           ^^^
      found: `0 m`
      expected: a finite number other than 0 before the unit, as in `50 g`
    ");
    let init = |units: &str| refused(&bench, &["init", "record.wav", "--units", units]);
    assert_snapshot!(init("50 g"), @"
    error: --units: not a name and a unit
      found: `50 g`
      expected: NAME=UNIT with a quantity or a column, as in `time=ms,displacement=mm` or `1=50 g`
    ");
    assert!(init("1=50 gg").contains("--units: unknown unit"));
    // Two records of different length, of which none is named.
    let mut bytes = fs::read(bench.path("v5.mat")).expect("a file");
    bytes.truncate(128);
    bytes.extend(matrix(b"time", 40));
    bytes.extend(matrix(b"acc", 40));
    bytes.extend(matrix(b"t", 30));
    bytes.extend(matrix(b"y", 30));
    with_bytes(&bench, "two.mat", &bytes);
    assert_snapshot!(refused(&bench, &["init", "two.mat"]), @"
    error: two.mat: the file has several sets of channels with different times
      found: `time`, `acc` (40 samples); `t`, `y` (30 samples)
      expected: columns of one of them, named in a model file
      hint: `kmcfit check FILE` lists them; `columns: {time: …, displacement: …}` names them
    ");
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
        let mut bytes = fs::read(repository("tests/formats/record.npy")).expect("a file");
        // Rows of three numbers behind the header; the 11th displacement.
        let at = 192 + 8 * (3 * 10 + 1);
        bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
        with_bytes(&bench, "a.npy", &bytes);
        let keys = "data: a.npy\n    columns: {time: a.time, displacement: a.displacement, force: a.force}";
        bench.write("model.yaml", &MODEL.replace("DATA", keys));
    };
    with(f64::NAN);
    let (_, stdout, _) = bench.run(&["check", "model.yaml"]);
    assert_snapshot!(stdout, @"
    record: 192 samples of the displacement in m (NumPy array)
    record: 1 samples of the displacement not used: missing
    record: one every 0.01562 s (64 Hz) from 0 to 3 s; dominant frequency 0.8666 Hz, 2.6 periods; standard deviation 0.224 m
    record: 1 gap in the displacement, 0.141 to 0.172 s (0.031 s, 1 sample): treated as missing samples
    record: displacement quantised in steps of 0.000977 m: an estimated sigma is at least step/sqrt(12)
    units: displacement in m, force in N and time in s: assumed, the file does not state it; `units` in the model file does
    model: 193 nodes over 3 s (rk4), 3 parameters, gauss-newton
    start values: mass 1.5 kg, damping 1 N s/m, stiffness 80 N/m; natural frequency 1.162 Hz, damping ratio 0.04564
    a measured force determines the scale of (m, c, k)
    at the start values the samples determine 3 of 3 parameter combinations
    Ready      the model and its data are valid
    ");
    with(f64::INFINITY);
    assert_snapshot!(refused(&bench, &["check", "model.yaml"]), @"
    error: a.npy: sample 11 of `a.displacement`: not a finite number
      found: `inf`
      expected: a finite number, or NaN for a missing sample
    ");
}
