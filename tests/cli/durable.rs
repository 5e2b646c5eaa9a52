//! Crash safety: runs that are killed or interrupted, full disks, folders in use, and files in the way of results.

use crate::program::program;
use crate::workbench::{MODEL, Workbench};
use serde_json::Value;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The results that all runs of a model have in common, bit for bit: the document without its times, and the tables.
fn bits(bench: &Workbench, run: &str) -> Vec<String> {
    let text = bench.read(&format!("{run}/result.json"));
    let mut result: Value = serde_json::from_str(&text).expect("JSON");
    let keys = result.as_object_mut().expect("an object");
    assert!(keys.remove("seconds").is_some() && keys.remove("timings").is_some());
    let tables = ["history.csv", "functions.csv", "trajectory.csv"];
    let tables = tables.map(|name| bench.read(&format!("{run}/{name}")));
    std::iter::once(result.to_string()).chain(tables).collect()
}

/// The paper's problem, with so many iterations.
fn paper(iterations: u64) -> Workbench {
    let bench = Workbench::with_shipped_models();
    let model = bench.read("models/paper.yaml");
    let model = model.replace(
        "{iterations: 1000}",
        &format!("{{iterations: {iterations}}}"),
    );
    bench.write("models/paper.yaml", &model);
    bench
}

fn started(bench: &Workbench, arguments: &[&str]) -> Child {
    Command::new(program())
        .args(arguments)
        .current_dir(bench.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program runs")
}

fn wait_for(what: &str, is_there: impl Fn() -> bool) {
    let begin = Instant::now();
    while !is_there() {
        assert!(begin.elapsed() < Duration::from_secs(60), "no {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Waits for the `line`-th line of a journal.
fn wait_for_line(bench: &Workbench, journal: &str, line: usize) {
    let path = bench.path(journal);
    wait_for("iteration", || {
        std::fs::read(&path).is_ok_and(|t| t.iter().filter(|b| **b == b'\n').count() >= line)
    });
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill")
        .args([name, &child.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
}

/// A fit and its resumptions are killed at fifty random times. After each kill there is either no result or a complete one, and
/// the final result is bit-identical to that of an uninterrupted run.
#[test]
#[cfg(unix)]
fn killed_at_any_moment() {
    const FIT: [&str; 7] = [
        "fit",
        "models/paper.yaml",
        "--no-report",
        "--checkpoint",
        "0.005",
        "--out",
        "run",
    ];
    let bench = paper(250);
    let begin = Instant::now();
    bench.run_to(
        0,
        &["fit", "models/paper.yaml", "--no-report", "--out", "whole"],
    );
    let whole_time = begin.elapsed();
    let whole = bits(&bench, "whole");
    let has = |name: &str| bench.path(&format!("run/{name}")).exists();
    let (mut state, mut finished, mut resumed) = (20_240_229_u64, 0, 0);
    for moment in 0..50 {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let share = (state >> 40) as f64 / (1u64 << 24) as f64;
        let mut child = match has("fit.journal") {
            true => started(&bench, &["resume", "run"]),
            false => started(&bench, &FIT),
        };
        resumed += usize::from(has("fit.checkpoint"));
        std::thread::sleep(whole_time.mul_f64(0.7 * share));
        child.kill().expect("a child");
        child.wait().expect("it ends");
        if has("result.json") {
            assert!(
                bits(&bench, "run") == whole,
                "a bad result after moment {moment}"
            );
            finished += 1;
            std::fs::remove_dir_all(bench.path("run")).expect("a folder");
        }
    }
    // At least some kills must have hit a running fit.
    assert!(resumed >= 5, "{resumed} resumptions, {finished} ends");
    match has("fit.journal") {
        true => bench.run_to(0, &["resume", "run"]),
        false => bench.run_to(0, &FIT),
    };
    assert!(bits(&bench, "run") == whole);
    let mut names: Vec<String> = (std::fs::read_dir(bench.path("run")).expect("a folder"))
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    let expected = [
        "channels",
        "functions.csv",
        "history.csv",
        "kmcfit-manifest.json",
        "parameters.json",
        "result.json",
        "trajectory.csv",
    ];
    assert_eq!(names, expected, "temporary files are left");
}

/// A study that is killed during its fit continues within the fit; one that is interrupted there is reported as interrupted and
/// continues as well.
#[test]
#[cfg(unix)]
fn a_study_whose_fit_is_ended() {
    let bench = Workbench::with_shipped_models();
    let model = bench
        .read("models/knots.yaml")
        .replace("gauss-newton", "projected-gradient");
    let model = model.replace("{iterations: 50, tolerance: 1.0e-10}", "{iterations: 400}");
    // Extremes at one time in place of five: they are most of the study.
    let model = format!("{model}\nstudy: {{extremes: 12.5}}\n");
    bench.write("models/knots.yaml", &model);
    bench.run_to(0, &["study", "models/knots.yaml", "--out", "whole"]);
    for end in ["-KILL", "-INT"] {
        let mut child = started(&bench, &["study", "models/knots.yaml", "--out", "run"]);
        wait_for_line(&bench, "run/fit.journal", 20);
        signal(&child, end);
        let code = child.wait().expect("it ends").code();
        if end == "-INT" {
            assert_eq!(code, Some(130));
            let study: Value = serde_json::from_str(&bench.read("run/study.json")).expect("JSON");
            assert_eq!(study["status"], "interrupted");
        }
        bench.run_to(0, &["resume", "run"]);
        for file in ["study.json", "study.html", "study.journal"] {
            let read = |run: &str| bench.read(&format!("{run}/{file}"));
            assert!(read("run") == read("whole"), "{file} after {end}");
        }
        assert!(!bench.path("run/fit.journal").exists());
    }
}

/// A sequence that Ctrl-C ends and one that is killed continue within a fit; finished fits are kept, and results of older runs in its folders
/// are not used.
#[test]
#[cfg(unix)]
fn a_sequence_whose_fit_is_ended() {
    let bench = paper(60);
    let slow = bench
        .read("models/knots.yaml")
        .replace("gauss-newton", "projected-gradient")
        .replace("{iterations: 50, tolerance: 1.0e-10}", "{iterations: 400}");
    bench.write("models/slow.yaml", &slow);
    bench.run_to(0, &["fit", "models/slow.yaml", "--out", "whole"]);
    bench.run_to(0, &["fit", "models/knots.yaml", "--out", "run/slow"]);
    let sequence = "format: 1\ntitle: Two\nsequence: [paper.yaml, slow.yaml]\n";
    bench.write("models/sequence.yaml", sequence);
    let mut child = started(&bench, &["study", "models/sequence.yaml", "--out", "run"]);
    wait_for_line(&bench, "run/slow/fit.journal", 20);
    signal(&child, "-INT");
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    let ended: serde_json::Value =
        serde_json::from_str(&bench.read("run/slow/result.json")).expect("JSON");
    assert_eq!(ended["outcome"]["status"], "interrupted");
    assert!(bench.read("run/compare.html").contains("interrupted"));
    let first = bench.read("run/paper/result.json");
    let mut child = started(&bench, &["resume", "run"]);
    wait_for_line(&bench, "run/slow/fit.journal", 60);
    child.kill().expect("a child");
    child.wait().expect("it ends");
    bench.run_to(0, &["resume", "run"]);
    assert_eq!(bench.read("run/paper/result.json"), first, "fitted again");
    assert!(bits(&bench, "run/slow") == bits(&bench, "whole"));
    assert!(bench.path("run/compare.html").exists());
}

/// The first Ctrl-C writes the results of the best point, figures included, and `resume` continues the fit.
#[test]
#[cfg(unix)]
fn an_interrupted_fit_is_resumed() {
    let bench = paper(3000);
    let mut child = started(&bench, &["fit", "models/paper.yaml"]);
    wait_for_line(&bench, "runs/paper/fit.journal", 20);
    signal(&child, "-INT");
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    let result: Value = serde_json::from_str(&bench.read("runs/paper/result.json")).expect("JSON");
    assert_eq!(result["outcome"]["status"], "interrupted");
    let stdout = bench.run_to(0, &["resume", "runs/paper", "--verbose"]);
    assert!(
        stdout.contains("all 3000 iterations requested were run"),
        "{stdout}"
    );
    bench.run_to(0, &["fit", "models/paper.yaml", "--out", "whole"]);
    assert!(bits(&bench, "runs/paper") == bits(&bench, "whole"));
    for figure in ["motion", "convergence"] {
        let drawn = |run: &str| bench.read(&format!("{run}/figures/{figure}.svg"));
        assert!(drawn("runs/paper") == drawn("whole"), "{figure}");
    }
    // Resuming a finished run prints its results again.
    assert!(
        bench
            .run_to(0, &["resume", "runs/paper"])
            .starts_with(stdout.split('\n').next().unwrap_or("?"))
    );
}

/// `resume` applies the `--set` options of the interrupted fit or study again; they are part of the inputs that must not have
/// changed.
#[test]
#[cfg(unix)]
fn resume_applies_the_same_overrides() {
    let bench = paper(1000);
    let set = [
        "--set",
        "fit.stop.iterations=2000",
        "--set",
        "functions.stiffness.start=1.5",
    ];
    for (command, journal) in [("fit", "fit.journal"), ("study", "fit.journal")] {
        let arguments = |out| {
            [
                &[command, "models/paper.yaml", "--out", out],
                set.as_slice(),
            ]
            .concat()
        };
        let mut child = started(&bench, &arguments("run"));
        wait_for_line(&bench, &format!("run/{journal}"), 20);
        child.kill().expect("a child");
        child.wait().expect("it ends");
        if command == "study" {
            let heading = bench.read("run/study.journal");
            assert!(heading.contains("fit.stop.iterations=2000"), "{heading}");
            continue;
        }
        let stdout = bench.run_to(0, &["resume", "run", "--verbose"]);
        assert!(
            stdout.contains("all 2000 iterations requested were run"),
            "{stdout}"
        );
        bench.run_to(0, &arguments("whole"));
        assert!(bits(&bench, "run") == bits(&bench, "whole"));
        std::fs::remove_dir_all(bench.path("run")).expect("a folder");
    }
}

/// The second Ctrl-C ends the program at once, in the middle of an iteration.
#[test]
#[cfg(unix)]
fn interrupted_twice() {
    let bench = paper(1000);
    let model = bench.read("models/paper.yaml");
    let slow = model
        .replace("nodes: 2000", "nodes: 400000")
        .replace("continuous", "discrete");
    bench.write("models/paper.yaml", &slow);
    let mut child = started(&bench, &["fit", "models/paper.yaml"]);
    wait_for("journal", || bench.path("runs/paper/fit.journal").exists());
    signal(&child, "-INT");
    std::thread::sleep(Duration::from_millis(20));
    signal(&child, "-INT");
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    assert!(!bench.path("runs/paper/result.json").exists());
}

/// Only one run at a time uses a folder. A killed run does not lock it, and the results that it would have replaced are intact.
#[test]
#[cfg(unix)]
fn a_folder_that_is_taken() {
    let bench = paper(100_000_000);
    bench.run_to(
        0,
        &[
            "fit",
            "models/paper-lbfgs.yaml",
            "--no-report",
            "--out",
            "run",
        ],
    );
    let older = bits(&bench, "run");
    let mut child = started(&bench, &["fit", "models/paper.yaml", "--out", "run"]);
    wait_for_line(&bench, "run/fit.journal", 3);
    for arguments in [
        &["fit", "models/paper-lbfgs.yaml", "--out", "run"][..],
        &["resume", "run"],
        &["study", "models/knots.yaml", "--out", "run"],
        &["compare", "models/knots.yaml", "--out", "run"],
        &["predict", "run", "--initial", "1,0", "--out", "run"],
    ] {
        let (code, stdout, stderr) = bench.run(arguments);
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
        assert!(
            stderr.contains("error: --out: another run is writing to this folder\n  found: run\n"),
            "{stderr}"
        );
    }
    child.kill().expect("a child");
    child.wait().expect("it ends");
    assert!(
        bits(&bench, "run") == older,
        "the older run is gone before the new one is complete"
    );
    bench.run_to(0, &["predict", "run", "--initial", "1,0"]);
    let (code, _, stderr) = bench.run(&["fit", "models/paper-lbfgs.yaml", "--out", "run"]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("unfinished work"), "{stderr}");
    let few = [
        "fit",
        "models/paper.yaml",
        "--set",
        "fit.stop.iterations=5",
        "--out",
        "run",
    ];
    let (code, _, stderr) = bench.run(&few);
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stderr.contains("note: Discarding the unfinished fit in this folder"),
        "{stderr}"
    );
    assert!(!bench.path("run/fit.journal").exists());
}

/// A full disk (here a limit on the size of files) is an error, and the older run is intact.
#[test]
#[cfg(unix)]
fn a_disk_that_is_full() {
    let bench = paper(5);
    bench.run_to(0, &["fit", "models/paper.yaml", "--out", "run"]);
    let before = bench.contents();
    let program = program();
    let line = |out: &str| {
        // The limit is on blocks of 512 or 1024 bytes; the tables are longer than both.
        format!("ulimit -f 60; exec '{program}' fit models/paper-lbfgs.yaml --out {out}")
    };
    for out in ["run", "fresh"] {
        let output = Command::new("sh")
            .args(["-c", &line(out)])
            .current_dir(bench.path(""))
            .output();
        let output = output.expect("a shell");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert!(
            stderr.contains("error: --out: the results cannot be written"),
            "{stderr}"
        );
        assert!(!bench.path("fresh/result.json").exists());
    }
    let after = bench.contents();
    for (name, text) in &before {
        assert!(after.get(name) == Some(text), "{name} is another one");
    }
    // Without the limit the fit is completed from its journal.
    bench.run_to(0, &["resume", "fresh"]);
    bench.run_to(0, &["fit", "models/paper-lbfgs.yaml", "--out", "whole"]);
    assert!(bits(&bench, "fresh") == bits(&bench, "whole"));
}

/// A link in the place of a folder or file of a run is refused before the fit, and its target is unchanged.
#[test]
#[cfg(unix)]
fn links() {
    use std::os::unix::fs::symlink;
    let bench = Workbench::with_small_model();
    bench.write("elsewhere/kept.svg", "kept");
    for name in ["figures", "fit.journal", "fit.checkpoint", "result.json"] {
        std::fs::create_dir(bench.path("run")).expect("a folder");
        let target = match name {
            "figures" => "elsewhere",
            _ => "elsewhere/kept.svg",
        };
        let link = bench.path(&format!("run/{name}"));
        symlink(bench.path(target), &link).expect("a link");
        let (code, stdout, stderr) = bench.run(&["fit", "model.yaml", "--out", "run"]);
        assert_eq!((code, stdout.as_str()), (2, ""), "{stderr}");
        assert!(stderr.contains(&format!("error: run/{name}: ")), "{stderr}");
        assert_eq!(bench.read("elsewhere/kept.svg"), "kept");
        assert!(link.is_symlink());
        std::fs::remove_dir_all(bench.path("run")).expect("a folder");
    }
    // The output folder itself may be a link, because the user names it.
    symlink(bench.path("elsewhere"), bench.path("link")).expect("a link");
    bench.run_to(0, &["fit", "model.yaml", "--out", "link"]);
    assert!(bench.path("elsewhere/result.json").exists());
}

/// Names in a model, and the name of the model, do not lead out of the output folder.
#[test]
fn names_that_look_like_paths() {
    let bench = Workbench::with_small_model();
    let model = MODEL
        .replace("name: free decay", "name: ../../outside")
        .replace("title: Small", "title: ../outside");
    bench.write("...yaml", &model);
    bench.run(&["fit", "...yaml"]);
    bench.run(&["compare", "...yaml", "--out", "side"]);
    for name in bench.contents().keys() {
        let known = ["model.yaml", "samples.csv", "...yaml", "runs", "side"];
        let inside = ["runs/run", "side/"]
            .iter()
            .any(|folder| name.starts_with(folder));
        assert!(inside || known.contains(&name.as_str()), "{name}");
    }
    assert!(bench.path("runs/run/result.json").exists() && bench.path("side/run").is_dir());
}

/// A fit is continued only with the inputs with which it was begun.
#[test]
#[cfg(unix)]
fn a_resumption_that_is_refused() {
    let bench = paper(100_000_000);
    let mut child = started(&bench, &["fit", "models/paper.yaml", "--out", "run"]);
    wait_for_line(&bench, "run/fit.journal", 5);
    child.kill().expect("a child");
    child.wait().expect("it ends");
    // The working folder of the run that was killed may be removed.
    let contents = |bench: &Workbench| {
        let mut files = bench.contents();
        files.retain(|name, _| !name.starts_with("run/.kmcfit-"));
        files
    };
    let refused = |bench: &Workbench| {
        let before = contents(bench);
        let (code, _, stderr) = bench.run(&["resume", "run"]);
        assert_eq!(code, 2, "{stderr}");
        assert!(contents(bench) == before, "{stderr}");
        stderr
    };
    let (model, data, journal) = (
        bench.read("models/paper.yaml"),
        bench.read("data/paper.csv"),
        bench.read("run/fit.journal"),
    );
    bench.write(
        "models/paper.yaml",
        &model.replace("start: 2.0", "start: 2.1"),
    );
    let other_model = refused(&bench);
    bench.write("models/paper.yaml", &model);
    bench.write("data/paper.csv", &format!("{data}\n"));
    let other_data = refused(&bench);
    bench.write("data/paper.csv", &data);
    bench.write(
        "run/fit.journal",
        &journal.replacen("\"version\":\"", "\"version\":\"9.", 1),
    );
    let other_version = refused(&bench);
    bench.write("run/fit.journal", &journal);
    let text = bench.read("run/fit.journal");
    let heading = text.lines().next().and_then(|line| line.rsplit_once('\t'));
    let mut heading: kmcfit::results::Heading =
        serde_json::from_str(heading.expect("a checksum").0).expect("a heading");
    heading.version = "0.0.9".into();
    let older = kmcfit::results::with_checksums(&heading, b"").expect("text");
    std::fs::write(bench.path("run/fit.journal"), older).expect("room");
    let older_version = refused(&bench);
    assert!(
        older_version.contains("this fit was started by another version of kmcfit"),
        "{older_version}"
    );
    bench.write(
        "run/fit.journal",
        &journal.replacen("\"format\":2", "\"format\":7", 1),
    );
    let other_format = refused(&bench);
    bench.write("run/fit.journal", "no journal\n");
    let no_journal = refused(&bench);
    std::fs::remove_file(bench.path("run/fit.journal")).expect("a file");
    let nothing = refused(&bench);
    let all = [
        other_model,
        other_data,
        other_version,
        other_format,
        no_journal,
        nothing,
    ];
    insta::assert_snapshot!(all.join("\n"), @"
    error: models/paper.yaml: this file has changed since the fit was started
      expected: the same model and data, or a new fit

    error: models/../data/paper.csv: this file has changed since the fit was started
      expected: the same model and data, or a new fit

    error: run/fit.journal: not a journal of kmcfit, or it was edited
      found: a first line with a wrong checksum
      expected: the journal of a fit that was started by `kmcfit fit`

    error: run/fit.journal: unsupported format version of the journal
      found: 7
      expected: 2

    error: run/fit.journal: not a journal of kmcfit, or it was edited
      found: a first line that is not JSON
      expected: the journal of a fit that was started by `kmcfit fit`

    error: run: no unfinished run in this folder
      expected: the folder of an unfinished fit, study or comparison
    ");
}

/// A folder that cannot be written to is refused before the fit.
#[test]
#[cfg(target_os = "linux")]
fn a_folder_that_cannot_be_written_to() {
    let bench = Workbench::with_small_model();
    // No folder can be created there, not even by root.
    let (code, stdout, stderr) = bench.run(&["fit", "model.yaml", "--out", "/proc/kmcfit"]);
    assert_eq!((code, stdout.as_str()), (2, ""));
    assert!(
        stderr.starts_with("error: --out: the output folder cannot be created\n"),
        "{stderr}"
    );
}

/// The system clock, which may be set back, is not used: times are taken from monotonic clocks. The page shows the day of the last
/// change of the data files, with which nothing is computed, and a file with another time of change is digested again.
#[test]
fn no_system_clock() {
    fn look(folder: &std::path::Path, found: &mut usize) {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                look(&path, found);
            } else {
                *found += 1;
                let times_of_files = ["config/source.rs", "page/first_screen.rs", "digest.rs"];
                if times_of_files.iter().any(|name| path.ends_with(name)) {
                    continue;
                }
                let text = std::fs::read_to_string(&path).expect("text");
                let asks = ["SystemTime", ".modified()", ".created()"];
                assert!(
                    !asks.iter().any(|word| text.contains(word)),
                    "{}",
                    path.display()
                );
            }
        }
    }
    let mut found = 0;
    look(&crate::workbench::repository("src"), &mut found);
    assert!(found > 100);
}
