//! Folders of runs: files of the user, kills and signals at any moment, full disks, files that change, runs and what they read.

use crate::program::program;
use crate::workbench::{MODEL, Workbench, sample_table};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

const FIT: [&str; 4] = ["fit", "model.yaml", "--out", "run"];

/// The program exits with code 2 and a message about this path, and changes no file.
fn refused(bench: &Workbench, arguments: &[&str], about: &str) -> String {
    let before = bench.contents();
    let (code, stdout, stderr) = bench.run(arguments);
    assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
    assert!(
        stderr.starts_with(&format!("error: {about}: ")),
        "{arguments:?}: {stderr}"
    );
    assert!(bench.contents() == before, "{arguments:?}: {stderr}");
    stderr
}

/// The files of a whole run, whose document lists all of them with their digests.
fn whole_run(folder: &Path) -> BTreeMap<String, String> {
    let text = fs::read_to_string(folder.join("result.json")).expect("a document");
    let document: Value = serde_json::from_str(&text).expect("JSON");
    let files = document["files"].as_object().expect("files");
    let files: BTreeMap<String, String> = (files.iter())
        .map(|(name, digest)| (name.clone(), digest.as_str().expect("a digest").to_owned()))
        .collect();
    for (name, expected) in &files {
        let digest = Sha256::digest(fs::read(folder.join(name)).expect(name));
        let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(&digest, expected, "{name}");
    }
    files
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

#[test]
fn files_of_the_user_are_refused_before_the_fit() {
    for name in ["notes.txt", "result.json", "figures/my_drawing.svg"] {
        let bench = Workbench::with_small_model();
        bench.write(&format!("run/{name}"), "mine\n");
        refused(&bench, &FIT, &format!("run/{name}"));
    }
    let bench = Workbench::with_small_model();
    bench.run_to(0, &FIT);
    let text = bench.read("run/history.csv");
    bench.write("run/history.csv", &text.replacen('1', "2", 1));
    let stderr = refused(&bench, &FIT, "run/history.csv");
    assert!(stderr.contains("changed since kmcfit wrote it"), "{stderr}");
    bench.write("run/history.csv", &text);
    bench.run_to(0, &FIT);
    // The current folder cannot be replaced.
    refused(&bench, &["fit", "model.yaml", "--out", "."], "--out");
    bench.write("file", "mine");
    refused(&bench, &["fit", "model.yaml", "--out", "file"], "--out");
    refused(&bench, &["fit", "model.yaml", "--out", "file/run"], "--out");
}

#[test]
fn inputs_are_never_replaced() {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &FIT);
    let start = "start: {data: run/functions.csv, column: mass_kg}";
    bench.write("next.yaml", &MODEL.replace("start: 2.0", start));
    let next = ["fit", "next.yaml", "--out", "run"];
    let inside = fs::canonicalize(bench.path("run/functions.csv")).expect("a file");
    let stderr = refused(&bench, &next, &inside.display().to_string());
    assert!(stderr.contains("input"), "{stderr}");
    bench.run_to(0, &["fit", "next.yaml", "--out", "other"]);
}

/// A folder belongs to one command, that of a fleet included.
#[test]
fn the_results_of_another_command_are_refused() {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &FIT);
    for arguments in [
        &["compare", "model.yaml", "--out", "run"][..],
        &["predict", "run", "--initial", "1,0", "--out", "run"],
        &["study", "model.yaml", "--out", "run"],
        &["demo", "--out", "run"],
    ] {
        let stderr = refused(&bench, arguments, "--out");
        assert!(stderr.contains("results of `kmcfit fit`"), "{stderr}");
    }
    bench.run_to(0, &["fleet", "model.yaml", "samples.csv", "--out", "fleet"]);
    let into_fleet = ["fit", "model.yaml", "--out", "fleet"];
    assert!(refused(&bench, &into_fleet, "--out").contains("results of `kmcfit fleet`"));
    let into_run = ["fleet", "model.yaml", "samples.csv", "--out", "run"];
    assert_eq!(bench.run(&into_run).0, 2);
    // Nor does one write into the folder of another, which would no longer be replaced.
    let inside = ["fit", "model.yaml", "--out", "run/mine"];
    assert!(refused(&bench, &inside, "--out").contains("inside results of kmcfit"));
    for command in [&["study", "fleet"][..], &["verify", "fleet"]] {
        let stderr = refused(&bench, command, "fleet");
        assert!(stderr.contains("results of `kmcfit fleet`"), "{stderr}");
    }
}

#[test]
fn simulate_replaces_its_own_tables_only() {
    let bench = Workbench::with_small_model();
    let simulate = ["simulate", "model.yaml", "--out", "made.csv"];
    bench.write("made.csv", "t_s,y_m\n0,1\n");
    refused(&bench, &simulate, "--out");
    fs::remove_file(bench.path("made.csv")).expect("removed");
    bench.run_to(0, &simulate);
    bench.run_to(0, &[&simulate[..], &["--nodes", "11"]].concat());
    let text = bench.read("made.csv");
    bench.write("made.csv", &format!("{text}2.1,0\n"));
    refused(&bench, &simulate, "--out");
}

/// Killed at any instant, a fit leaves the old or the new run, and nothing stays beside it for longer than until the next one.
#[test]
fn kills_leave_the_old_or_the_new_run() {
    let bench = Workbench::with_small_model();
    let clock = Instant::now();
    bench.run_to(0, &FIT);
    let duration = clock.elapsed();
    for kill in 0..50 {
        let iterations = format!("fit.stop.iterations={}", 1 + kill % 5);
        let mut child = started(&bench, &[&FIT[..], &["--set", &iterations]].concat());
        // Whatever the moment is, the run must be whole.
        std::thread::sleep(duration.mul_f64(f64::from(kill) / 40.0));
        child.kill().expect("a child");
        child.wait().expect("it ends");
        whole_run(&bench.path("run"));
    }
    bench.run_to(0, &FIT);
    let names = fs::read_dir(bench.path("")).expect("a folder");
    let names = names.map(|entry| entry.expect("an entry").file_name());
    let left: Vec<_> = names
        .filter(|name| name.to_string_lossy().starts_with(".kmcfit"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

/// Runs that are being replaced are read whole.
#[test]
fn readers_see_one_of_two_runs() {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &FIT);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for i in 0..10 {
                let iterations = format!("fit.stop.iterations={}", 1 + i % 2);
                bench.run_to(0, &[&FIT[..], &["--set", &iterations]].concat());
            }
        });
        for i in 0..10 {
            let out = format!("compared-{i}");
            let (code, _, stderr) = bench.run(&["compare", "run", "--out", &out]);
            assert_eq!(code, 0, "{stderr}");
        }
    });
}

/// A model whose fit takes minutes.
fn slow() -> Workbench {
    let bench = Workbench::with_small_model();
    bench.write("samples.csv", &sample_table(2001));
    let model = MODEL
        .replace("nodes: 21", "nodes: 20001")
        .replace("iterations: 5", "iterations: 1000000");
    bench.write(
        "model.yaml",
        &model.replace("method: lbfgs", "method: steepest-descent"),
    );
    bench
}

/// The fit has begun once its folder stands beside the place of the run.
fn has_begun(bench: &Workbench) -> bool {
    let mut entries = fs::read_dir(bench.path("")).expect("a folder");
    entries.any(|entry| {
        let path = entry.expect("an entry").path();
        path.file_name()
            .is_some_and(|name| name.to_string_lossy().starts_with(".kmcfit"))
            && path.join("model.yaml").exists()
    })
}

/// True if this process, and so the program, was started with SIGHUP ignored.
#[cfg(unix)]
fn ignores_hang_up() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    ignored.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).is_ok_and(|mask| mask & 1 == 1))
}

/// SIGTERM and SIGHUP end a fit as Ctrl-C does; two signals at once are one; a later second one ends the process.
#[test]
#[cfg(unix)]
fn signals_write_the_best_so_far() {
    for (signals, code) in [
        (&["-TERM"][..], 143),
        (&["-HUP"], 143),
        (&["-INT"], 130),
        (&["-TERM", "-TERM"], 143),
    ] {
        // Below `nohup` the program ignores SIGHUP, as it must.
        if signals == ["-HUP"] && ignores_hang_up() {
            continue;
        }
        let bench = slow();
        let mut child = started(&bench, &FIT);
        while !has_begun(&bench) {
            assert_eq!(
                child.try_wait().expect("a child"),
                None,
                "it ended by itself"
            );
        }
        for signal in signals {
            let sent = Command::new("kill")
                .args([signal, child.id().to_string().as_str()])
                .status();
            assert!(sent.expect("kill runs").success());
        }
        assert_eq!(
            child.wait().expect("it ends").code(),
            Some(code),
            "{signals:?}"
        );
        whole_run(&bench.path("run"));
        let result: Value = serde_json::from_str(&bench.read("run/result.json")).expect("JSON");
        assert_eq!(result["outcome"]["status"], "interrupted");
    }
}

/// A full disk, a read-only one, and a limit on the size of files: the run before is unchanged.
#[test]
#[cfg(target_os = "linux")]
fn a_run_that_cannot_be_written_leaves_the_one_before() {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &FIT);
    let before = whole_run(&bench.path("run"));
    let line = format!("ulimit -f 1; exec '{}' fit model.yaml --out run", program());
    let mut shell = Command::new("sh");
    let output = shell
        .args(["-c", &line])
        .current_dir(bench.path(""))
        .output()
        .expect("a shell");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("the results cannot be written"), "{stderr}");
    assert_eq!(whole_run(&bench.path("run")), before);
    fs::create_dir(bench.path("disk")).expect("a folder");
    bench.write("longer.yaml", &MODEL.replace("nodes: 21", "nodes: 4001"));
    let fit = |model: &str| format!("'{}' fit {model} --out disk/run", program());
    let script = format!(
        "mount -t tmpfs -o size=900k tmpfs disk || exit 99
         {} >/dev/null || exit 9
         {} >/dev/null 2>full.txt; [ $? = 2 ] || exit 2
         mount -o remount,ro disk || exit 99
         {} >/dev/null 2>read_only.txt; [ $? = 2 ] || exit 3
         cp -r disk/run after
",
        fit("model.yaml"),
        fit("longer.yaml"),
        fit("model.yaml"),
    );
    let mut unshare = Command::new("unshare");
    let output = unshare
        .args(["--mount", "sh", "-c", &script])
        .current_dir(bench.path(""))
        .output();
    match output {
        Ok(output) if !matches!(output.status.code(), Some(1 | 99)) => {
            let stderr = String::from_utf8_lossy(&output.stderr);
            assert_eq!(
                output.status.code(),
                Some(0),
                "{stderr}{}",
                bench.read("full.txt")
            );
            whole_run(&bench.path("after"));
            assert!(bench.read("full.txt").contains("No space left"));
            assert!(
                bench
                    .read("read_only.txt")
                    .contains("Read-only file system")
            );
        }
        other => eprintln!("SKIPPED: no file system can be mounted here: {other:?}"),
    }
}

/// Closed and full streams behind standard output and standard error.
#[test]
#[cfg(target_os = "linux")]
fn streams_that_cannot_be_written_change_no_result() {
    let bench = Workbench::with_small_model();
    let full = || {
        let device = fs::OpenOptions::new().write(true).open("/dev/full");
        Stdio::from(device.expect("/dev/full"))
    };
    let run = |stdout: Stdio, stderr: Stdio| {
        let mut command = Command::new(program());
        let command = command.args(FIT).current_dir(bench.path(""));
        command
            .stdout(stdout)
            .stderr(stderr)
            .status()
            .expect("it ends")
            .code()
    };
    assert_eq!(run(Stdio::null(), full()), Some(0));
    // The summary is lost, the results are not.
    assert_eq!(run(full(), Stdio::null()), Some(2));
    whole_run(&bench.path("run"));
}

/// A run holds its model; data that have changed since the fit are named.
#[test]
fn a_run_knows_what_it_read() {
    let bench = Workbench::with_small_model();
    let fit = [&FIT[..], &["--set", "fit.stop.iterations=4", "--no-report"]].concat();
    bench.run_to(0, &fit);
    let result: Value = serde_json::from_str(&bench.read("run/result.json")).expect("JSON");
    assert_eq!(bench.read("run/model.yaml"), bench.read("model.yaml"));
    let source = &result["sources"][0];
    let digest = Sha256::digest(bench.read("samples.csv"));
    let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(
        (source["name"].as_str(), source["sha256"].as_str()),
        (Some("samples.csv"), Some(&*digest))
    );
    let verified = bench.run_to(0, &["verify", "run"]);
    assert!(verified.starts_with("verified: "), "{verified}");
    // The model of the run, not that of the folder, is studied and verified.
    bench.write("model.yaml", &MODEL.replace("start: 2.0", "start: 3.0"));
    bench.run_to(0, &["verify", "run"]);
    let samples = bench.read("samples.csv");
    bench.write("samples.csv", &samples.replacen('1', "2", 1));
    for command in [&["verify", "run"][..], &["study", "run"]] {
        let stderr = refused(&bench, command, "samples.csv");
        assert!(stderr.contains("has changed since the fit"), "{stderr}");
    }
    let (code, _, stderr) = bench.run(&["predict", "run", "--initial", "1,0"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stderr.contains("samples.csv has changed since the fit"),
        "{stderr}"
    );
    fs::remove_file(bench.path("samples.csv")).expect("removed");
    let stderr = refused(&bench, &["verify", "run"], "samples.csv");
    assert!(stderr.contains("missing"), "{stderr}");
    bench.write("samples.csv", &samples);
    bench.run_to(0, &["verify", "run"]);
    // Commands that read the files of a run refuse edited ones; `verify` names them.
    for name in ["model.yaml", "functions.csv"] {
        let path = format!("run/{name}");
        let text = bench.read(&path);
        bench.write(&path, &format!("{}9\n", text.trim_end()));
        for command in [
            &["study", "run"][..],
            &["predict", "run", "--initial", "1,0"],
            &["compare", "run", "model.yaml"],
        ] {
            let stderr = refused(&bench, command, &path);
            assert!(stderr.contains("changed since kmcfit wrote it"), "{stderr}");
            assert!(stderr.contains("into another folder"), "{stderr}");
        }
        bench.write(&path, &text);
    }
}

/// Edits by 1e-6 of any number are found.
#[test]
fn verify_finds_edits() {
    let bench = Workbench::with_shipped_models();
    bench.run_to(0, &["fit", "models/duffing.yaml", "--no-report"]);
    for (name, key) in [
        ("result.json", "\"final\": "),
        ("parameters.json", "\"values\": [\n    "),
        ("functions.csv", "\n"),
        ("channels/1-displacement.csv", "\n0.1,"),
    ] {
        let path = format!("runs/duffing/{name}");
        let text = bench.read(&path);
        let at = text.find(key).unwrap_or_else(|| panic!("{key} in {name}")) + key.len();
        let end = at + text[at..].find([',', '\n']).expect("an end");
        let number: f64 = text[at..end].trim().parse().expect("a number");
        let edited = if number == 0.0 {
            1e-6
        } else {
            number * (1.0 + 1e-6)
        };
        bench.write(&path, &format!("{}{edited}{}", &text[..at], &text[end..]));
        let (code, stdout, _) = bench.run(&["verify", "runs/duffing"]);
        assert!(code == 3 && stdout.contains(name), "{name}: {stdout}");
        bench.write(&path, &text);
    }
    bench.run_to(0, &["verify", "runs/duffing"]);
}

/// A removed command, option or older run gets one sentence that names what takes its place.
#[test]
fn what_was_removed_is_named() {
    let bench = Workbench::with_small_model();
    for arguments in [
        &["resume", "run"][..],
        &["report", "run"],
        &["fleet", "collect", "fleet"],
        &["fit", "model.yaml", "--checkpoint", "1"],
        &[
            "fleet",
            "model.yaml",
            "samples.csv",
            "--out",
            "fleet",
            "--shard=1/2",
        ],
    ] {
        let stderr = refused(&bench, arguments, "kmcfit");
        assert!(
            stderr.contains("of an earlier version\n  hint: "),
            "{stderr}"
        );
    }
    bench.run_to(0, &FIT);
    let text = bench.read("run/result.json");
    let files = text.find(",\n  \"files\"").expect("files");
    bench.write("run/result.json", &format!("{}\n}}\n", &text[..files]));
    let stderr = refused(&bench, &["verify", "run"], "run/result.json");
    assert!(stderr.contains("fit the model again"), "{stderr}");
    bench.write("run/kmcfit-manifest.json", "{}");
    let stderr = refused(&bench, &FIT, "run/");
    assert!(stderr.contains("of an earlier version"), "{stderr}");
    bench.write("fleet/fleet.json", "{\"version\": \"0.1.0\"}");
    let fleet = ["fleet", "model.yaml", "samples.csv", "--out", "fleet"];
    let stderr = refused(&bench, &fleet, "fleet/fleet.json");
    assert!(stderr.contains("of an earlier version"), "{stderr}");
    // Keys and choices, also those of one experiment.
    let own = "    functions: {mass: {basis: nodal, start: 2.0, penalty: {kind: tikhonov, weight: gcv}}}\ngrid:";
    for (key, model) in [
        ("sequence", "format: 1\nsequence: [model.yaml]\n".to_owned()),
        (
            "smooth",
            MODEL.replace("start: 2.0", "start: 2.0, smooth: {order: 2}"),
        ),
        ("gcv", MODEL.replace("grid:", own)),
        (
            "auto",
            MODEL.replace(
                "functions:",
                "functions:\n  coulomb_friction: {basis: constant, start: 1.0, width: auto}",
            ),
        ),
    ] {
        bench.write("old.yaml", &model);
        let (code, _, stderr) = bench.run(&["fit", "old.yaml"]);
        assert_eq!(code, 2, "{stderr}");
        assert!(
            stderr.contains("was removed") && stderr.contains(key),
            "{stderr}"
        );
    }
    for name in ["study.bootstrap", "gcv"] {
        let (_, _, stderr) = bench.run(&["explain", name]);
        assert!(stderr.contains("was removed\n"), "{stderr}");
    }
}

/// The model of a record stands in no file: its errors name the record.
#[test]
fn errors_of_the_model_of_a_record_name_the_record() {
    let bench = Workbench::with_small_model();
    let (code, _, stderr) =
        bench.run(&["fit", "samples.csv", "--set", "functions.stiffness.fixed=3"]);
    assert_eq!(code, 2, "{stderr}");
    assert!(
        stderr.contains("error: samples.csv: functions.stiffness"),
        "{stderr}"
    );
    assert!(stderr.contains("`kmcfit init samples.csv`"), "{stderr}");
}
