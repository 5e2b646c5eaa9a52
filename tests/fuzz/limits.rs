//! Inputs that are too large, or not regular files, are rejected at once, with the limit.

use assert_cmd::Command;
use std::fs::{self, File};
use std::path::Path;
use std::time::Duration;
use tempfile::TempDir;

const MODEL: &str = "format: 1
experiments: [{data: DATA, initial: {displacement: 1, velocity: 0}}]
functions: {mass: {basis: constant, start: 2}, damping: {fixed: 0}, stiffness: {fixed: 1}}
fit: {stop: {iterations: 2}}
";

/// Message of a command that must reject its input within seconds.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_kmcfit"))
        .current_dir(folder)
        .args(arguments)
        .timeout(Duration::from_secs(60))
        .output()
        .expect("the program runs");
    let stderr = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
    assert!(!folder.join("runs").exists(), "something was written");
    stderr
}

/// A folder with the model, which reads `data`.
fn bench(data: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("m.yaml"), MODEL.replace("DATA", data)).expect("room");
    folder
}

/// A sparse file of ten gigabytes without a line break.
#[test]
fn files_of_ten_gigabytes() {
    let folder = bench("long.csv");
    let hole = |name: &str| {
        let file = File::create(folder.path().join(name)).expect("room");
        file.set_len(10 << 30).expect("a file with a hole");
    };
    hole("long.csv");
    hole("long.yaml");
    let said = refused(folder.path(), &["fit", "m.yaml"]);
    assert!(
        said.contains("experiments[0].data")
            && said.contains("10 GiB")
            && said.contains("at most 4 GiB"),
        "{said}"
    );
    let said = refused(folder.path(), &["fit", "long.yaml"]);
    assert!(said.contains("is too large"), "{said}");
    fs::create_dir(folder.path().join("run")).expect("room");
    hole("run/result.json");
    let said = refused(folder.path(), &["predict", "run", "--initial", "1,0"]);
    assert!(said.contains("too large"), "{said}");
}

#[test]
fn a_long_line_and_many_columns() {
    let folder = bench("wide.csv");
    let path = folder.path().join("wide.csv");
    fs::write(&path, format!("t_s,y_m\n0,{}\n", "1".repeat(2 << 20))).expect("room");
    let said = refused(folder.path(), &["fit", "m.yaml"]);
    assert!(
        said.contains("wide.csv:2:1: the line is longer than 1048576 bytes"),
        "{said}"
    );
    fs::write(&path, "1,".repeat(20_000)).expect("room");
    let said = refused(folder.path(), &["fit", "m.yaml"]);
    assert!(
        said.contains("found: 20001 fields\n  expected: at most 10000"),
        "{said}"
    );
}

#[test]
fn models_that_expand_beyond_the_limit() {
    let folder = bench("d.csv");
    let refuse = |text: String| {
        fs::write(folder.path().join("m.yaml"), text).expect("room");
        refused(folder.path(), &["fit", "m.yaml"])
    };
    let said = refuse(format!("a: &a 1\nb: [{}]\n", "*a,".repeat(1001)));
    assert!(said.contains("m.yaml:2:3005: too many aliases"), "{said}");
    let said = refuse(format!(
        "a: &a [{}]\nb: [{}]\n",
        "1, ".repeat(20_000),
        "*a, ".repeat(900)
    ));
    assert!(
        said.contains("m.yaml: the model file with aliases is too large"),
        "{said}"
    );
    let said = refuse("[".repeat(1000));
    assert!(said.contains("too many open brackets"), "{said}");
    let record = "- {data: d.csv, initial: {displacement: 1, velocity: 0}}\n";
    let rest = &MODEL[MODEL.find("functions").expect("a key")..];
    let said = refuse(format!(
        "format: 1\nexperiments:\n{}{rest}",
        record.repeat(2001)
    ));
    assert!(
        said.contains("experiments[2000]: too many experiments\n"),
        "{said}"
    );
    assert!(
        said.contains("found: 2001\n  expected: at most 2000"),
        "{said}"
    );
}

/// Inputs without an end are not read.
#[test]
#[cfg(unix)]
fn inputs_that_are_not_regular_files_are_refused() {
    use std::os::unix::fs::symlink;
    use std::os::unix::net::UnixListener;
    let folder = bench("data");
    let position = folder.path();
    let data = position.join("data");
    let refuse = |what: &str| {
        for command in ["fit", "check", "study"] {
            let said = refused(position, &[command, "m.yaml"]);
            assert!(said.contains(what), "{said}");
        }
        fs::remove_file(&data).expect("it was there");
    };
    let pipe = || {
        let made = std::process::Command::new("mkfifo").arg(&data).status();
        assert!(made.expect("mkfifo runs").success());
    };
    pipe();
    refuse("this is a pipe, not a file");
    symlink("/dev/zero", &data).expect("room");
    refuse("this is a device, not a file");
    let socket = UnixListener::bind(&data).expect("a socket");
    refuse("this is a device, not a file");
    drop(socket);
    symlink("..", &data).expect("room");
    refuse("this is a folder, not a file");
    // The model itself, and samples that a simulation does not need.
    pipe();
    let said = refused(position, &["fit", "data"]);
    assert!(said.contains("this is a pipe"), "{said}");
    let text = MODEL.replace("DATA", "data") + "grid: {nodes: 9, duration: 1}\n";
    fs::write(position.join("m.yaml"), text).expect("room");
    let simulated = Command::new(env!("CARGO_BIN_EXE_kmcfit"))
        .current_dir(position)
        .args(["simulate", "m.yaml", "--out", "s.csv"])
        .timeout(Duration::from_secs(60))
        .output()
        .expect("the program runs");
    assert!(
        simulated
            .status
            .code()
            .is_some_and(|code| [0, 2].contains(&code))
    );
}

/// A pipe that the caller opened is a valid input.
#[test]
#[cfg(target_os = "linux")]
fn the_program_s_own_pipe() {
    let folder = bench("/dev/stdin");
    let rows: String = (0..21)
        .map(|i| 0.1 * f64::from(i))
        .map(|t| format!("{t},{}\n", t.cos()))
        .collect();
    Command::new(env!("CARGO_BIN_EXE_kmcfit"))
        .current_dir(folder.path())
        .args(["check", "m.yaml"])
        .write_stdin(format!("t_s,y_m\n{rows}"))
        .timeout(Duration::from_secs(60))
        .assert()
        .success();
}

/// Text from inputs cannot control the terminal, and names in them do not lead out of the output folder.
#[test]
fn names_are_only_names() {
    let folder = bench("d.csv");
    let position = folder.path();
    let rows: String = (0..21)
        .map(|i| 0.1 * f64::from(i))
        .map(|t| format!("{t},{}\n", t.cos()))
        .collect();
    fs::write(position.join("d.csv"), format!("t_s,../../y\n{rows}")).expect("room");
    let hostile = "\\e]0;owned\\a../../../<script>alert(1)</script>/dev/x";
    let text = MODEL.replace(
        "DATA",
        &format!("d.csv, name: \"{hostile}\", columns: {{displacement: ../../y}}"),
    ) + &format!("title: \"{hostile}\"\npredict: [{{displacement: 1, velocity: 0}}]\n");
    fs::create_dir_all(position.join("in/side")).expect("room");
    fs::write(
        position.join("in/side/m.yaml"),
        text.replace("d.csv", "../../d.csv"),
    )
    .expect("room");
    let output = Command::new(env!("CARGO_BIN_EXE_kmcfit"))
        .current_dir(position.join("in/side"))
        .args(["fit", "m.yaml", "--out", "run"])
        .output()
        .expect("the program runs");
    for said in [&output.stdout, &output.stderr] {
        assert!(!said.contains(&0x1b), "{}", String::from_utf8_lossy(said));
    }
    assert!(position.join("in/side/run/result.json").exists());
    let names = |folder: &str| {
        let entries = fs::read_dir(position.join(folder)).expect("a folder");
        let mut names: Vec<_> = entries.map(|e| e.expect("an entry").file_name()).collect();
        names.sort();
        names
    };
    assert_eq!(names(""), ["d.csv", "in", "m.yaml"]);
    assert_eq!(names("in"), ["side"]);
    assert_eq!(names("in/side"), ["m.yaml", "run"]);
    let page = fs::read_to_string(position.join("in/side/run/report.html")).expect("a page");
    assert!(
        !page.contains("<script>alert") && page.contains("&lt;script&gt;alert"),
        "not escaped"
    );
    assert!(!page.contains('\u{1b}'));
}
