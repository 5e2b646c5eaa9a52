//! The programs in `examples/` compute the values that their comments state.

#[allow(dead_code)]
mod programs {
    pub mod accelerometer {
        include!("../../examples/accelerometer.rs");
    }
    pub mod free_decay {
        include!("../../examples/free_decay.rs");
    }
    pub mod load_a_run {
        include!("../../examples/load_a_run.rs");
    }
    pub mod prior_information {
        include!("../../examples/prior_information.rs");
    }
    pub mod structural_rank {
        include!("../../examples/structural_rank.rs");
    }
}

use programs::{accelerometer, free_decay, load_a_run, prior_information, structural_rank};

#[test]
fn a_free_decay() {
    let [c, k] = free_decay::found().unwrap();
    // RK4 with 125 steps a period: (omega h)^4 / 120 = 5e-8 of the stiffness.
    assert!(
        (c - 2.0).abs() < 2e-3 && (k - 2500.0).abs() < 1e-2,
        "{c} {k}"
    );
    free_decay::main().unwrap();
}

/// `data/shaker.csv` was made by m = 1.2, c = 0.9, k = 480 (see `data/README.md`).
#[test]
fn an_accelerometer() {
    let found = accelerometer::found().unwrap();
    for ([value, error], truth) in found.into_iter().zip(SHAKEN) {
        assert!(
            error > 0.0 && (value - truth).abs() < 4.0 * error,
            "{found:?}"
        );
        assert!(error < 0.05 * truth, "{found:?}");
    }
}

const SHAKEN: [f64; 3] = [1.2, 0.9, 480.0];

#[test]
fn prior_information_determines_the_system() {
    let error = prior_information::found().unwrap();
    assert!(error < 1e-6, "{error}");
}

#[test]
fn the_structural_rank_is_counted() {
    let [(alone, open), (pair, still_open)] = structural_rank::found().unwrap();
    assert!(open && !still_open);
    assert!(alone < pair && pair == 33, "{alone} {pair}");
}

#[test]
fn a_run_is_loaded_back() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let fit = std::process::Command::new(env!("CARGO_BIN_EXE_kmcfit"))
        .args(["fit", "models/linear-mass.yaml", "--no-report", "--out"])
        .arg(&out)
        .output()
        .unwrap();
    assert!(fit.status.success(), "{fit:?}");
    let [ratio, most] = load_a_run::found(&out).unwrap();
    assert!(ratio < 1e-20, "{ratio}");
    // Released at rest at its largest potential energy; a decreasing mass removes energy.
    assert!((1.0..1.01).contains(&most), "{most}");
    assert!(load_a_run::found(folder.path()).is_err());
}
