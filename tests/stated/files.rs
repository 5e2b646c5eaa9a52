//! Files of `../shared/faults` (`KMCFIT_SHARED`), with their right values.

use crate::headings::{init, level, value};
use crate::workbench::{Workbench, repository};
use serde_json::Value;
use std::path::PathBuf;

/// A shared file; `None` with a message where there is none.
fn shared(name: &str) -> Option<Vec<u8>> {
    let folder =
        std::env::var_os("KMCFIT_SHARED").map_or_else(|| repository("../shared"), PathBuf::from);
    let found = std::fs::read(folder.join("faults").join(name)).ok();
    if found.is_none() {
        eprintln!("SKIPPED: no shared `{name}`; set KMCFIT_SHARED");
    }
    found
}

/// The fit of a shared file as `init` reads it.
fn fitted(name: &str, arguments: &[&str]) -> Option<(Value, String)> {
    let bench = Workbench::empty();
    let file = name.rsplit('/').next().expect("a name");
    bench.write_bytes(file, &shared(name)?);
    let said = bench.run_to(
        0,
        &[&["init", file, "--out", "model.yaml"], arguments].concat(),
    );
    bench.run_to(0, &["fit", "model.yaml", "--out", "run", "--no-report"]);
    let document = serde_json::from_str(&bench.read("run/result.json")).expect("a document");
    Some((document, said))
}

fn is_near(document: &Value, name: &str, expected: f64, relative: f64) -> bool {
    (value(document, name) / expected - 1.0).abs() < relative
}

/// Ring-downs of 9 Hz and 2 % damping.
#[test]
fn times_and_rates_of_ring_downs() {
    for file in [
        "files/commented_header.csv",
        "files/iso_times.csv",
        "files/motion.at2",
        "files/time_column.lvm",
        "files/multi_time.lvm",
    ] {
        let Some((document, said)) = fitted(file, &[]) else {
            return;
        };
        assert!(
            is_near(&document, "natural_frequency", 9.0, 2e-3),
            "{file}: {said}\n{}",
            document["estimates"]
        );
        assert!(
            is_near(&document, "damping_ratio", 0.02, 0.08),
            "{file}: {}",
            document["estimates"]
        );
        assert!(
            said.contains("acceleration, g") || said.contains("acceleration, G"),
            "{file}: {said}"
        );
    }
}

/// Forced records of known mass: scales, starts, and units of the sets.
#[test]
fn scales_and_clocks_of_forced_records() {
    for (file, mass) in [
        ("files/late_2ms.tdms", 2.001),
        ("files/tdms_group_scale.tdms", 1.5),
        ("files/h5_packed.h5", 1.5),
        ("files/uff_u_kgf_nolabel.uff", 1.5),
        ("files/uff_py_mixed_frf.uff", 1.5),
    ] {
        let Some((document, said)) = fitted(file, &[]) else {
            return;
        };
        assert!(
            is_near(&document, "mass", mass, 0.02),
            "{file}: {said}\n{}",
            document["estimates"]
        );
    }
    let Some((document, said)) = fitted("files/late_2ms.tdms", &[]) else {
        return;
    };
    assert!(said.contains("start up to 0.002 s apart"), "{said}");
    assert!(
        document["data"].to_string().contains("0.002 s apart"),
        "{document}"
    );
}

#[test]
fn volts_and_uneven_sets() {
    let Some((document, _)) = fitted("files/tdms_volts.tdms", &[]) else {
        return;
    };
    let reasons = document["verdict"]["reasons"].to_string();
    assert!(
        level(&document) != "adequate" && reasons.contains("sensitivity"),
        "{reasons}"
    );
    let Some(bytes) = shared("files/uff_py_uneven_b1.uff") else {
        return;
    };
    let said = init("uneven.uff", &bytes, &[]);
    assert!(
        said.contains("4000 samples") && said.contains("displacement, mm"),
        "{said}"
    );
    let Some((document, said)) = fitted("files/cart_voltage.csv", &[]) else {
        return;
    };
    assert!(
        is_near(&document, "natural_frequency", 0.54, 0.02),
        "{said}\n{}",
        document["estimates"]
    );
}

/// A clock that steps back is named by its row, with what to do.
#[test]
fn a_clock_that_steps_back() {
    let Some(bytes) = shared("files/clock_step_back.txt") else {
        return;
    };
    let bench = Workbench::empty();
    bench.write_bytes("clock.txt", bytes.as_ref());
    let (code, _, said) = bench.run(&["init", "clock.txt"]);
    assert!(
        code == 2 && said.contains("186") && said.contains("hint"),
        "{said}"
    );
}

/// Runs side by side have their own times: each is an experiment.
#[test]
fn runs_side_by_side() {
    let Some((document, said)) = fitted("models/runs-mixed/runs.csv", &[]) else {
        return;
    };
    assert!(said.matches("samples over").count() == 3, "{said}");
    assert!(
        is_near(&document, "natural_frequency", 0.7002, 0.01),
        "{said}\n{}",
        document["estimates"]
    );
}

/// Of a TDMS file that was cut while it was written the whole chunks are read, and this is said.
#[test]
fn an_unfinished_segment() {
    let whole = std::fs::read(repository("tests/formats/record.tdms")).expect("a file");
    let bench = Workbench::empty();
    bench.write_bytes("record.tdms", &whole[..whole.len() * 2 / 3]);
    let said = bench.run_to(0, &["check", "record.tdms"]);
    assert!(
        said.contains("interrupted") && said.contains("displacement"),
        "{said}"
    );
    let said = bench.run_to(0, &["init", "record.tdms"]);
    assert!(said.contains("interrupted"), "{said}");
}

/// Dates of NumPy are times since the first; `NaT` is missing.
#[test]
fn dates_of_numpy() {
    let header = "{'descr': [('time', '<M8[us]'), ('', '|V4'), ('y [mm]', '<f4')], 'fortran_order': False, 'shape': (300,), }";
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(119u16.to_le_bytes());
    bytes.extend(format!("{header:<118}\n").bytes());
    for i in 0..300i64 {
        let y = (0.3 * i as f32).cos();
        bytes.extend((1_700_000_000_000_000 + 20_000 * i).to_le_bytes());
        bytes.extend([0; 4]);
        bytes.extend(y.to_le_bytes());
    }
    let said = init("record.npy", &bytes, &[]);
    assert!(
        said.contains("300 samples over 5.98 s") && said.contains("time, µs"),
        "{said}"
    );
}
