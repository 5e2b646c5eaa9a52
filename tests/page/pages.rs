//! Pages for the tests, each generated once.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use tempfile::TempDir;

/// Text that must not become markup.
pub const HOSTILE: &str = "<script>alert(1)</script></script>\"'&";

/// A light system with a force, a known truth, an active constraint, and names that contain markup.
const MODEL: &str = "format: 1
title: TITLE
experiments:
  - name: NAME
    data: samples.csv
    sigma: {displacement: 0.02}
    initial: {displacement: 1.0, velocity: 0.0}
grid: {nodes: 201}
functions:
  mass: {basis: polynomial, degree: 1, start: [1.5, 0.0]}
  damping: {basis: constant, start: 0.3, min: 0.107}
  stiffness: {fixed: 1.0}
truth: {data: truth.csv}
predict:
  - {displacement: 2.0, velocity: 0.0}
fit: {stop: {iterations: 30, tolerance: 1e-10}}
study: {starts: 2}
";

const DEVICE: &str = "format: 1
experiments:
  - initial: {displacement: 1.0, velocity: 0.0}
grid: {nodes: 201, duration: 20.0}
functions:
  mass: {fixed: 1.0}
  damping: {fixed: 0.1}
  stiffness: {fixed: 1.0}
";

/// A folder with pages.
pub struct Pages {
    folder: TempDir,
}

impl Pages {
    fn make() -> Self {
        let pages = Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        };
        let quoted = |text: &str| format!("'{}'", text.replace('\'', "''"));
        let model = |title: &str| {
            let model = MODEL.replace("TITLE", &quoted(title));
            model.replace("NAME", &quoted(title))
        };
        let truth: String = (0..201)
            .map(|i| format!("{},1.0,0.1,1.0\n", f64::from(i) * 0.1))
            .collect();
        let heads = "t_s,mass_kg,damping_N_s_per_m,stiffness_N_per_m\n";
        pages.write("truth.csv", &(heads.to_string() + &truth));
        pages.write("device.yaml", DEVICE);
        pages.write("plain.yaml", &model("A plain run"));
        pages.write("hostile.yaml", &model(HOSTILE));
        let noise = ["--noise", "0.02", "--seed", "5", "--out", "samples.csv"];
        pages.run(&[&["simulate", "device.yaml"][..], &noise].concat());
        pages.run(&["fit", "plain.yaml"]);
        pages.run(&["fit", "hostile.yaml"]);
        pages.run(&["compare", "runs/plain", "runs/hostile"]);
        pages.run(&["study", "plain.yaml", "--out", "runs/study"]);
        pages
    }

    fn run(&self, arguments: &[&str]) {
        let output = Command::new(env!("CARGO_BIN_EXE_kmcfit"))
            .current_dir(self.folder.path())
            .args(arguments)
            .output()
            .expect("the program runs");
        assert!(output.status.success(), "{arguments:?} {output:?}");
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).expect("a file");
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }
}

/// The pages of all tests.
pub const PAGES: [&str; 4] = [
    "runs/plain/report.html",
    "runs/hostile/report.html",
    "runs/compare/compare.html",
    "runs/study/study.html",
];

pub fn pages() -> &'static Pages {
    static MADE: OnceLock<Pages> = OnceLock::new();
    MADE.get_or_init(Pages::make)
}

/// A folder of the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}
