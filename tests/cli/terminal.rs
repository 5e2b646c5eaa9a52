//! Output on a terminal: the plot of the summary and the progress, by `script`, which runs a command on a terminal of its own.
#![cfg(target_os = "linux")]

use crate::program::program;
use crate::workbench::Workbench;
use std::io::{Read, Write};
use std::process::{Command, Stdio};
use std::time::Duration;

/// A record whose stiffness falls by a third; the fit determines it at three knots.
fn bench() -> Workbench {
    let bench = Workbench::with_small_model();
    let model = bench.read("model.yaml");
    let model = model
        .replace(
            "mass:      {basis: nodal, start: 2.0}",
            "mass: {fixed: 1.0}",
        )
        .replace(
            "damping:   {basis: constant, start: 1.0}",
            "damping: {fixed: 0.1}",
        )
        .replace(
            "{basis: nodal, start: 1.0}",
            "{basis: piecewise-linear, knots: 3, start: 90.0}",
        )
        .replace("{nodes: 21, method: midpoint}", "{nodes: 801, method: rk4}")
        .replace(
            "    initial:",
            "    sigma: {displacement: 0.05}\n    initial:",
        )
        .replace("lbfgs", "gauss-newton")
        .replace("{iterations: 5}", "{iterations: 30, tolerance: 1e-9}");
    bench.write("model.yaml", &model);
    // The phase of k = 100 - 15 t N/m: the integral of its root.
    let mut text = String::from("t_s,y_m\n");
    for i in 0..201 {
        let t = 0.01 * f64::from(i);
        let root = |k: f64| k.powf(1.5) / 22.5;
        let phase = root(100.0) - root(100.0 - 15.0 * t);
        let noise = 0.05 * (37.0 * t + (53.0 * t).sin()).sin();
        text += &format!("{t},{}\n", (-0.05 * t).exp() * phase.cos() + noise);
    }
    bench.write("samples.csv", &text);
    bench
}

/// What a terminal receives from a command, with variables of the environment.
fn on_terminal(bench: &Workbench, arguments: &str, variables: &[(&str, &str)]) -> String {
    let command = format!("{} {arguments}", program());
    let output = assert_cmd::Command::new("script")
        .current_dir(bench.path(""))
        .env("TERM", "xterm")
        .env("LC_ALL", "C.UTF-8")
        .env_remove("NO_COLOR")
        .envs(variables.iter().copied())
        .args(["-qec", &command, "/dev/null"])
        .write_stdin("")
        .timeout(Duration::from_secs(60))
        .output()
        .expect("script of util-linux");
    let shown = String::from_utf8_lossy(&output.stdout).replace('\r', "");
    assert!(output.status.success(), "{shown}");
    shown
}

/// The plot stands between the estimates and the fit; all other lines are those of a pipe. Without colours, without UTF-8, in a pipe, with
/// `--no-plot` and for a model of constants there is none.
#[test]
fn the_summary_plots_the_varying_coefficient() {
    const FIT: &str = "fit model.yaml --no-report --out run";
    let bench = bench();
    let piped = bench.run_to(0, &FIT.split(' ').collect::<Vec<_>>());
    let estimates = piped.find("\n\nFit ").expect("a line of the fit");
    let (above, below) = piped.split_at(estimates);
    let shown = on_terminal(&bench, FIT, &[]);
    let begin = shown
        .find("stiffness k in N/m; shaded: 95 % band")
        .unwrap_or_else(|| panic!("{shown}"));
    assert!(
        shown[..begin].trim_end().ends_with(above.trim_end()),
        "{shown}"
    );
    let end = shown.find("\n\nFit ").expect("a line of the fit");
    assert_eq!(&shown[end..], below);
    let plot: Vec<&str> = shown[begin..end].lines().collect();
    // A title, six rows, and the times.
    assert_eq!(plot.len(), 8, "{shown}");
    assert!(
        plot.iter().all(|line| line.chars().count() <= 72),
        "{shown}"
    );
    assert!(plot.iter().any(|line| line.contains('░')) && plot[7].trim_end().ends_with("2 s"));
    let has_plot = |arguments: &str, variables: &[(&str, &str)]| {
        on_terminal(&bench, arguments, variables).contains("stiffness k in N/m")
    };
    // A finished run is shown again.
    assert!(has_plot("resume run", &[]));
    for variable in [("NO_COLOR", "1"), ("TERM", "dumb"), ("LC_ALL", "C")] {
        assert!(!has_plot("resume run", &[variable]), "{variable:?}");
    }
    assert!(!has_plot("resume run --no-plot", &[]));
    let constant = "--set 'functions.stiffness={basis: constant, start: 90.0}'";
    assert!(!has_plot(&format!("{FIT} {constant}"), &[]));
}

/// After a second a study shows its analysis of all and the finished refits of all with the remaining time; Ctrl-C then keeps the
/// analyses before.
#[test]
fn a_study_shows_its_progress_and_keeps_what_is_done() {
    let bench = bench();
    let study = "study: {seed: 1, bootstrap: 40000}\n";
    bench.write("model.yaml", &(bench.read("model.yaml") + study));
    let command = format!("{} study model.yaml --out study", program());
    let mut child = Command::new("script")
        .current_dir(bench.path(""))
        .env("TERM", "xterm")
        .args(["-qec", &command, "/dev/null"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("script of util-linux");
    let (mut keys, mut screen) = (
        child.stdin.take().expect("keys"),
        child.stdout.take().expect("a screen"),
    );
    let mut shown = String::new();
    let mut buffer = [0; 4096];
    let mut is_interrupted = false;
    loop {
        let count = screen.read(&mut buffer).expect("a screen");
        if count == 0 {
            break;
        }
        shown += &String::from_utf8_lossy(&buffer[..count]);
        if !is_interrupted && shown.contains("/40000  ") && shown.contains(" remaining") {
            keys.write_all(b"\x03").expect("a key");
            is_interrupted = true;
        }
    }
    let status = child.wait().expect("an end");
    assert!(
        is_interrupted && shown.contains("study 5/6: bootstrap"),
        "{shown}"
    );
    // The first findings stand on the screen while the others are computed.
    let [rank, bands, refits] =
        ["structural-rank: ", "\nbands: ", "study 5/6: bootstrap"].map(|words| shown.find(words));
    assert!(rank.is_some() && rank < bands && bands < refits, "{shown}");
    assert_eq!(status.code(), Some(130), "{shown}");
    let study: serde_json::Value =
        serde_json::from_str(&bench.read("study/study.json")).expect("JSON");
    assert_eq!(study["status"], "interrupted");
    assert!(
        study["sensitivity"].is_object() && study["bands"].is_object(),
        "{study}"
    );
    // The refits that were done are counted, and none is used.
    let failure = &study["failures"][0];
    assert_eq!(failure["analysis"], "bootstrap", "{study}");
    let reason = failure["reason"].as_str().expect("a reason");
    let count = reason.strip_prefix("interrupted after ");
    let count =
        count.and_then(|rest| rest.split_once(" of 40000 jobs; none of its results is used"));
    let count: usize = count
        .and_then(|(n, _)| n.parse().ok())
        .unwrap_or_else(|| panic!("{reason}"));
    assert!((1..40000).contains(&count), "{reason}");
    assert_eq!(study["bootstrap"].as_array().map(Vec::len), Some(0));
}
