//! Standard output and standard error that cannot be written.

use crate::tree::whole_run;
#[cfg(target_os = "linux")]
use crate::unprivileged::run_unprivileged;
use crate::workbench::{MODEL, Workbench};
use std::process::{Command, Stdio};

fn program(bench: &Workbench, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kmcfit"));
    command.args(arguments).current_dir(bench.path(""));
    command
}

/// A model with a warning, so that there is a message before the fit.
fn bench() -> Workbench {
    let bench = Workbench::with_small_model();
    bench.write("wrong.yaml", &MODEL.replace("samples.csv", "nowhere.csv"));
    let mut child = program(&bench, &["fit", "model.yaml", "--out", "killed"]);
    drop(child.output());
    bench
}

/// With a closed standard error the results are written and the exit code is that of the run.
#[test]
#[cfg(unix)]
fn a_closed_standard_error_changes_nothing() {
    let bench = bench();
    for (arguments, expected) in [
        (&["fit", "model.yaml", "--out", "run"][..], 0),
        (
            &["simulate", "model.yaml", "--noise", "0.1", "--seed", "1"],
            0,
        ),
        (&["study", "model.yaml", "--out", "study"], 0),
        (&["fit", "wrong.yaml"], 2),
        (&["fit", "model.yaml", "--checkpoint", "x"], 2),
        (&["resume", "run"], 0),
    ] {
        let mut child = program(&bench, arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program runs");
        drop(child.stderr.take());
        let code = child.wait().expect("it ends").code();
        let expected = match arguments[0] {
            // The study ends without a signal, with any outcome.
            "study" => code.filter(|code| [0, 3].contains(code)),
            _ => Some(expected),
        };
        assert_eq!(code, expected, "{arguments:?}");
    }
    whole_run(&bench.path("run")).expect("a whole run");
}

/// Standard output or standard error on a full disk.
#[test]
#[cfg(target_os = "linux")]
fn full_devices_behind_the_streams() {
    let full = || {
        let device = std::fs::OpenOptions::new().write(true).open("/dev/full");
        Stdio::from(device.expect("/dev/full"))
    };
    let bench = bench();
    let fit = ["fit", "model.yaml", "--out", "run"];
    let status = program(&bench, &fit)
        .stdout(Stdio::null())
        .stderr(full())
        .status();
    assert_eq!(status.expect("it ends").code(), Some(0));
    // The summary is lost, the results are not.
    let output = program(&bench, &fit).stdout(full()).output();
    let output = output.expect("it ends");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("the output cannot be written"), "{stderr}");
    let status = program(&bench, &fit).stdout(full()).stderr(full()).status();
    assert_eq!(status.expect("it ends").code(), Some(2));
    whole_run(&bench.path("run")).expect("a whole run");
    for arguments in [&["--help"][..], &["schema"], &["explain", "grid.nodes"]] {
        let status = program(&bench, arguments).stdout(full()).status();
        assert_eq!(status.expect("it ends").code(), Some(2), "{arguments:?}");
    }
}

/// Without threads from the system, and with more threads than jobs, the results of a study are the same.
#[test]
#[cfg(target_os = "linux")]
fn a_study_without_threads_has_the_same_results() {
    let bench = Workbench::with_shipped_models();
    let study = ["study", "models/linear-mass.yaml", "--out"];
    bench.run_to(0, &[&study[..], &["one", "--threads", "1"]].concat());
    bench.run_to(0, &[&study[..], &["many", "--threads", "100000"]].concat());
    let read = |run: &str| bench.read(&format!("{run}/study.json"));
    assert!(read("one") == read("many"));
    std::fs::create_dir(bench.path("limited")).expect("a folder");
    let one_process = ["prlimit", "--nproc=1"];
    let limited = [&study[..], &["limited", "--threads", "8"]].concat();
    if let Some((code, stderr)) = run_unprivileged(&bench, "true", &one_process, &limited) {
        assert_eq!(code, 0, "{stderr}");
        assert!(read("one") == read("limited"));
    }
}

/// File systems that are full or read-only, where this process may mount some.
#[test]
#[cfg(target_os = "linux")]
fn full_and_read_only_file_systems() {
    let bench = bench();
    std::fs::create_dir(bench.path("disk")).expect("a folder");
    let program = env!("CARGO_BIN_EXE_kmcfit");
    let fit = |model: &str| format!("'{program}' fit {model} --out disk/run");
    bench.write("longer.yaml", &MODEL.replace("nodes: 21", "nodes: 4001"));
    let script = format!(
        "mount -t tmpfs -o size=600k tmpfs disk || exit 99
         {} >/dev/null || exit 9
         cp -r disk/run older
         {} >/dev/null 2>full.txt; [ $? = 2 ] || exit 2
         cp -r disk/run after_full
         mount -o remount,ro disk || exit 99
         {} >/dev/null 2>read_only.txt; [ $? = 2 ] || exit 3
         cp -r disk/run after_read_only
",
        fit("model.yaml"),
        fit("longer.yaml"),
        fit("model.yaml"),
    );
    let output = Command::new("unshare")
        .args(["--mount", "sh", "-c", &script])
        .current_dir(bench.path(""))
        .output();
    let output = match output {
        Ok(output) if output.status.code() != Some(99) && output.status.code() != Some(1) => output,
        other => {
            eprintln!("SKIPPED: no file system can be mounted here: {other:?}");
            return;
        }
    };
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    let older = whole_run(&bench.path("older"));
    assert!(older.is_ok());
    for run in ["after_full", "after_read_only"] {
        assert_eq!(whole_run(&bench.path(run)), older, "{run}");
    }
    let said = |name: &str| bench.read(name);
    assert!(
        said("full.txt").contains("No space left"),
        "{}",
        said("full.txt")
    );
    assert!(
        said("read_only.txt").contains("Read-only file system"),
        "{}",
        said("read_only.txt")
    );
}

/// A limit on the size of files is an error of the write, and the older run is complete.
#[test]
#[cfg(unix)]
fn a_limit_on_the_size_of_files() {
    let bench = bench();
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    let older = whole_run(&bench.path("run")).expect("a whole run");
    let line = format!(
        "ulimit -f 1; exec '{}' fit model.yaml --out run",
        env!("CARGO_BIN_EXE_kmcfit")
    );
    let output = Command::new("sh")
        .args(["-c", &line])
        .current_dir(bench.path(""))
        .output()
        .expect("a shell");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("the results cannot be written"), "{stderr}");
    assert_eq!(whole_run(&bench.path("run")), Ok(older));
}
