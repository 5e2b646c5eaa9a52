//! SIGTERM and kills of long commands.

use crate::tree::whole_run;
use crate::workbench::{Workbench, sample_table};
use serde_json::Value;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn started(bench: &Workbench, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_kmcfit"))
        .args(arguments)
        .current_dir(bench.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program runs")
}

fn wait_for_lines(bench: &Workbench, journal: &str, lines: usize) {
    let begin = Instant::now();
    let count = || {
        let text = std::fs::read(bench.path(journal)).unwrap_or_default();
        text.iter().filter(|b| **b == b'\n').count()
    };
    while count() < lines {
        assert!(begin.elapsed() < Duration::from_secs(60), "no {journal}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill")
        .args([name, &child.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
}

/// Models of which the second takes long enough to be ended in its middle.
fn bench() -> Workbench {
    let bench = Workbench::with_shipped_models();
    let slow = bench
        .read("models/knots.yaml")
        .replace("gauss-newton", "projected-gradient")
        .replace("{iterations: 50, tolerance: 1.0e-10}", "{iterations: 400}");
    assert!(slow.contains("iterations: 400"));
    bench.write("models/slow.yaml", &slow);
    bench
}

/// SIGTERM ends a fit as Ctrl-C does, with exit code 143, and `resume` completes it.
#[test]
#[cfg(unix)]
fn sigterm_writes_the_best_so_far() {
    let bench = bench();
    let mut child = started(&bench, &["fit", "models/slow.yaml", "--out", "run"]);
    wait_for_lines(&bench, "run/fit.journal", 20);
    signal(&child, "-TERM");
    assert_eq!(child.wait().expect("it ends").code(), Some(143));
    whole_run(&bench.path("run")).expect("a whole run");
    let result: Value = serde_json::from_str(&bench.read("run/result.json")).expect("JSON");
    assert_eq!(result["outcome"]["status"], "interrupted");
    bench.run_to(0, &["resume", "run"]);
    bench.run_to(0, &["fit", "models/slow.yaml", "--out", "whole"]);
    for table in ["history.csv", "functions.csv", "trajectory.csv"] {
        let read = |run: &str| bench.read(&format!("{run}/{table}"));
        assert!(read("run") == read("whole"), "{table}");
    }
}

/// A comparison that is killed or interrupted during its second fit is resumed with an unchanged first fit.
#[test]
#[cfg(unix)]
fn a_comparison_is_resumed() {
    let bench = bench();
    let models = ["models/linear-mass.yaml", "models/slow.yaml"];
    let compare = |out| [&["compare"], &models[..], &["--out", out]].concat();
    bench.run_to(0, &compare("whole"));
    for (end, code) in [("-KILL", None), ("-TERM", Some(143)), ("-INT", Some(130))] {
        let mut child = started(&bench, &compare("run"));
        wait_for_lines(&bench, "run/slow/fit.journal", 20);
        signal(&child, end);
        assert_eq!(child.wait().expect("it ends").code(), code, "{end}");
        let first = bench.read("run/linear-mass/result.json");
        bench.run_to(0, &["resume", "run"]);
        assert_eq!(bench.read("run/linear-mass/result.json"), first, "{end}");
        for table in ["history.csv", "functions.csv", "trajectory.csv"] {
            let read = |run: &str| bench.read(&format!("{run}/slow/{table}"));
            assert!(read("run") == read("whole"), "{table} after {end}");
        }
        assert!(bench.path("run/compare.html").exists());
        std::fs::remove_dir_all(bench.path("run")).expect("removed");
    }
}

/// Ctrl-C within 100,000 refits ends the study; the analyses before them are kept. All refits take
/// minutes; the end within one shows that they did not start.
#[test]
#[cfg(unix)]
fn refits_do_not_start_after_an_interrupt() {
    let bench = Workbench::with_small_model();
    let model = bench.read("model.yaml").replace("nodal", "constant");
    let model = model.replace("{basis: constant, start: 2.0}", "{fixed: 1.0}");
    let model = model.replace("nodes: 21", "nodes: 2001");
    bench.write(
        "model.yaml",
        &format!("{model}study: {{bootstrap: 100000}}\n"),
    );
    bench.write("samples.csv", &sample_table(2001));
    let study = ["study", "model.yaml", "--out", "run", "--threads", "2"];
    let mut child = started(&bench, &study);
    // Heading, fit, sensitivity, bands and equivalent systems; the refits are next.
    wait_for_lines(&bench, "run/study.journal", 5);
    std::thread::sleep(Duration::from_millis(300));
    signal(&child, "-INT");
    let begin = Instant::now();
    let code = loop {
        if let Some(status) = child.try_wait().expect("its state") {
            break status.code();
        }
        if begin.elapsed() > Duration::from_secs(60) {
            child.kill().expect("a child");
            panic!("the refits go on");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    assert_eq!(code, Some(130));
    let study: Value = serde_json::from_str(&bench.read("run/study.json")).expect("JSON");
    assert_eq!(study["status"], "interrupted");
    assert!(study["bands"]["bands"].is_array() && study["sensitivity"]["rank"].is_u64());
    assert_eq!(study["bootstrap"].as_array().map(Vec::len), Some(0));
    let journal = bench.read("run/study.journal");
    assert!(!journal.contains("\"bootstrap\"") && journal.lines().count() == 5);
}

/// A signal that was ignored when the process started stays ignored.
#[test]
#[cfg(target_os = "linux")]
fn an_ignored_signal_stays_ignored() {
    let bench = bench();
    let line = format!(
        "trap '' TERM; exec '{}' fit models/slow.yaml --out run",
        env!("CARGO_BIN_EXE_kmcfit")
    );
    let mut child = Command::new("sh")
        .args(["-c", &line])
        .current_dir(bench.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("a shell");
    wait_for_lines(&bench, "run/fit.journal", 20);
    signal(&child, "-TERM");
    let code = child.wait().expect("it ends").code();
    assert!(matches!(code, Some(0 | 3)), "{code:?}");
    let result: Value = serde_json::from_str(&bench.read("run/result.json")).expect("JSON");
    assert_ne!(result["outcome"]["status"], "interrupted");
}
