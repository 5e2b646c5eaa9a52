//! Results do not depend on the SIMD instruction set of the processor.

use crate::workbench::Workbench;

/// Fits a shipped model with an arithmetic, or with the widest: history and functions.
fn fitted(bench: &Workbench, model: &str, arithmetic: Option<&str>) -> [String; 2] {
    let out = format!("runs/{}", arithmetic.unwrap_or("widest"));
    let path = format!("models/{model}.yaml");
    let mut command = bench.command(&["fit", &path, "--no-report", "--out", &out]);
    if let Some(name) = arithmetic {
        command.env("KMCFIT_ARITHMETIC", name);
    }
    let output = command.output().expect("the program runs");
    let trouble = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{model}: {trouble}");
    ["history.csv", "functions.csv"].map(|file| bench.read(&format!("{out}/{file}")))
}

/// Responses, adjoints, tangents, trial steps and elimination; forced, nonlinear and free.
#[test]
fn every_arithmetic_gives_the_same_bits() {
    for model in [
        "hammer-and-shaker",
        "paper-lbfgs",
        "knots",
        "paper-smooth",
        "duffing",
        "paper-two-records",
    ] {
        let bench = Workbench::with_shipped_models();
        let widest = fitted(&bench, model, None);
        for arithmetic in ["scalar", "AVX2"] {
            let other = fitted(&bench, model, Some(arithmetic));
            assert!(other == widest, "{model}, {arithmetic}");
        }
    }
}

#[test]
fn an_unknown_arithmetic_is_refused() {
    let bench = Workbench::with_shipped_models();
    let mut command = bench.command(&["fit", "models/knots.yaml"]);
    let output = command.env("KMCFIT_ARITHMETIC", "scaler").output();
    let output = output.expect("the program runs");
    let said = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{said}");
    for word in [
        "KMCFIT_ARITHMETIC",
        "`scaler`",
        "scalar, AVX2, AVX-512",
        "did you mean `scalar`?",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
}

/// An empty variable, as a shell or job file may leave it, sets no limit.
#[test]
fn an_empty_arithmetic_is_none() {
    let bench = Workbench::with_shipped_models();
    let mut command = bench.command(&["schema"]);
    let output = command.env("KMCFIT_ARITHMETIC", "").output();
    let output = output.expect("the program runs");
    let said = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(0), "{said}");
}
