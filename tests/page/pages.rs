//! Pages for the tests, each generated once.

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;
use tempfile::TempDir;

/// Text that must not become markup.
pub const HOSTILE: &str = "<script>alert(1)</script></script>\"'&";

/// Names of a data file and of a model file that must not become markup.
pub const HOSTILE_FILE: &str = "<i>&'data.csv";
pub const HOSTILE_STEM: &str = "<b>&'model";

/// A light system with a force, a known truth, an active constraint, and names that contain markup.
const MODEL: &str = "format: 1
title: TITLE
experiments:
  - name: NAME
    data: DATA
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
study:
  starts: 2
  profiles: [{function: damping}]
  candidates:
    - {name: CANDIDATE, initial: {displacement: 2.0, velocity: 0.0}}
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
        let model = |title: &str, data: &str| {
            let model = MODEL.replace("TITLE", &quoted(title));
            let model = model.replace("DATA", &quoted(data));
            model
                .replace("NAME", &quoted(title))
                .replace("CANDIDATE", &quoted(title))
        };
        let truth: String = (0..201)
            .map(|i| format!("{},1.0,0.1,1.0\n", f64::from(i) * 0.1))
            .collect();
        let heads = "t_s,mass_kg,damping_N_s_per_m,stiffness_N_per_m\n";
        pages.write("truth.csv", &(heads.to_string() + &truth));
        pages.write("device.yaml", DEVICE);
        pages.write("plain.yaml", &model("A plain run", "samples.csv"));
        // Names of files and columns that contain markup.
        let hostile = model(HOSTILE, HOSTILE_FILE).replace(
            &format!("data: {}", quoted(HOSTILE_FILE)),
            &format!(
                "data: {}\n    columns: {{time: '<t>', displacement: '<y>&'}}",
                quoted(HOSTILE_FILE)
            ),
        );
        pages.write("hostile.yaml", &hostile);
        pages.write(&format!("{HOSTILE_STEM}.yaml"), &hostile);
        let noise = ["--noise", "0.02", "--seed", "5", "--out", "samples.csv"];
        pages.run(&[&["simulate", "device.yaml"][..], &noise].concat());
        let samples = pages.read("samples.csv");
        let rows = samples
            .lines()
            .filter(|line| !line.starts_with('#'))
            .skip(1);
        let rows: String = rows.map(|row| row.to_owned() + "\n").collect();
        pages.write(HOSTILE_FILE, &("<t>,<y>&\n".to_owned() + &rows));
        pages.run(&["fit", "plain.yaml"]);
        pages.run(&["fit", "hostile.yaml"]);
        pages.run(&["compare", "runs/plain", "runs/hostile"]);
        pages.run(&["study", "hostile.yaml", "--out", "runs/study"]);
        let hostile = format!("{HOSTILE_STEM}.yaml");
        pages.run(&["compare", "plain.yaml", &hostile, "--out", "runs/models"]);
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
pub const PAGES: [&str; 5] = [
    "runs/plain/report.html",
    "runs/hostile/report.html",
    "runs/compare/compare.html",
    "runs/study/study.html",
    "runs/models/compare.html",
];

pub fn pages() -> &'static Pages {
    static MADE: OnceLock<Pages> = OnceLock::new();
    MADE.get_or_init(Pages::make)
}

/// Fewest figures of a page: a comparison has one.
pub fn least_figures(page: &str) -> usize {
    match page.ends_with("compare.html") {
        true => 1,
        false => 2,
    }
}
