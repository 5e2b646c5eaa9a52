//! Output on a terminal: the plot of the summary and the progress, by `script`, which runs a command on a terminal of its own.
#![cfg(target_os = "linux")]

use crate::program::program;
use crate::workbench::Workbench;
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
    assert!(has_plot(FIT, &[]));
    for variable in [("NO_COLOR", "1"), ("TERM", "dumb"), ("LC_ALL", "C")] {
        assert!(!has_plot(FIT, &[variable]), "{variable:?}");
    }
    assert!(!has_plot(&format!("{FIT} --no-plot"), &[]));
    let constant = "--set 'functions.stiffness={basis: constant, start: 90.0}'";
    assert!(!has_plot(&format!("{FIT} {constant}"), &[]));
}
