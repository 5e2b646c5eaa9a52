//! A temporary folder in which tests run the program.

use crate::program::program;
use assert_cmd::Command;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use std::sync::OnceLock;
use std::time::Duration;
use tempfile::TempDir;

/// A small model that is fitted in milliseconds; tests change one place in it.
pub const MODEL: &str = "\
format: 1
title: Small
experiments:
  - name: free decay
    data: samples.csv
    columns: {time: t_s, displacement: y_m}
    initial: {displacement: 1.0, velocity: 0.0}
grid: {nodes: 21, method: midpoint}
functions:
  mass:      {basis: nodal, start: 2.0}
  damping:   {basis: constant, start: 1.0}
  stiffness: {basis: nodal, start: 1.0}
fit:
  method: lbfgs
  gradient: discrete
  stop: {iterations: 5}
";

/// A path in the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// A temporary folder and the program in it.
pub struct Workbench {
    folder: TempDir,
}

impl Workbench {
    /// An empty folder.
    pub fn empty() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        }
    }

    /// A folder with the small model as `model.yaml` and 21 samples over 2 s in `samples.csv`.
    pub fn with_small_model() -> Self {
        let bench = Self::empty();
        bench.write("model.yaml", MODEL);
        bench.write("samples.csv", &sample_table(21));
        bench
    }

    /// A folder with the `models/` and `data/` of the repository.
    pub fn with_shipped_models() -> Self {
        let bench = Self::empty();
        for folder in ["models", "data"] {
            fs::create_dir(bench.path(folder)).expect("a folder");
            for entry in fs::read_dir(repository(folder)).expect("a folder can be listed") {
                let file = entry.expect("an entry");
                let copy = bench.path(folder).join(file.file_name());
                fs::copy(file.path(), copy).expect("a file can be copied");
            }
        }
        bench
    }

    /// The place of a file or folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a text file.
    pub fn write(&self, name: &str, text: &str) {
        self.write_bytes(name, text.as_bytes());
    }

    /// Writes a file.
    pub fn write_bytes(&self, name: &str, text: &[u8]) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a file has a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    }

    /// Reads a file.
    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The program, started in the folder.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(program());
        command.current_dir(self.folder.path()).args(arguments);
        command
    }

    /// Runs the program: exit code, standard output, standard error.
    pub fn run(&self, arguments: &[&str]) -> (i32, String, String) {
        let output = self.command(arguments).output().expect("the program runs");
        let text = |bytes| String::from_utf8(bytes).expect("the program writes UTF-8");
        let code = output.status.code().expect("the program ends by itself");
        (code, text(output.stdout), text(output.stderr))
    }

    /// Runs the program, which must exit with `code`, and returns its standard output.
    pub fn run_to(&self, code: i32, arguments: &[&str]) -> String {
        let (found, stdout, stderr) = self.run(arguments);
        assert_eq!(found, code, "{arguments:?}\n{stdout}\n{stderr}");
        stdout
    }

    /// Runs the program until it has written a `file` of its results in `runs`, where it stages them, and interrupts it as Ctrl-C does.
    #[cfg(unix)]
    pub fn interrupt(&self, arguments: &[&str], file: &str) -> Output {
        let mut command = std::process::Command::new(program());
        command.current_dir(self.path("")).args(arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program runs");
        let is_written = || {
            let staged = fs::read_dir(self.path("runs")).into_iter().flatten();
            staged
                .flatten()
                .any(|folder| folder.path().join(file).exists())
        };
        while !is_written() {
            let ended = child.try_wait().expect("the state of the program");
            assert!(ended.is_none(), "ended without {file}: {ended:?}");
            std::thread::sleep(Duration::from_millis(5));
        }
        let pid = child.id().to_string();
        let killed = std::process::Command::new("kill")
            .args(["-INT", &pid])
            .status();
        assert!(killed.expect("kill runs").success());
        child.wait_with_output().expect("the program ends")
    }

    /// All files with their contents, and all folders, by relative path.
    pub fn contents(&self) -> BTreeMap<String, String> {
        let mut found = BTreeMap::new();
        collect(self.folder.path(), Path::new(""), &mut found);
        found
    }
}

fn collect(root: &Path, below: &Path, found: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(root.join(below)).expect("a folder can be listed") {
        let name = below.join(entry.expect("an entry").file_name());
        let path = root.join(&name);
        let content = match path.is_dir() {
            true => "a folder".to_owned(),
            false => {
                String::from_utf8_lossy(&fs::read(&path).expect("a file can be read")).into_owned()
            }
        };
        found.insert(name.display().to_string(), content);
        if path.is_dir() {
            collect(root, &name, found);
        }
    }
}

/// `rows` samples of a decaying cosine, 0.1 s apart.
pub fn sample_table(rows: usize) -> String {
    let mut text = String::from("t_s,y_m\n");
    for i in 0..rows {
        let t = i as f64 / 10.0;
        text.push_str(&format!("{t},{}\n", (-0.1 * t).exp() * t.cos()));
    }
    text
}

/// A table: the header's names and the rows of numbers.
pub fn table(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let names = lines.next().expect("a header").split(',');
    let row = |line: &str| -> Vec<f64> {
        let number = |field: &str| field.parse().unwrap_or(f64::NAN);
        line.split(',').map(number).collect()
    };
    (names.map(str::to_owned).collect(), lines.map(row).collect())
}

/// `models/paper.yaml` fitted into `runs/paper`, once for all tests.
pub fn paper_run() -> &'static (Workbench, String) {
    static RUN: OnceLock<(Workbench, String)> = OnceLock::new();
    RUN.get_or_init(|| {
        let bench = Workbench::with_shipped_models();
        let stdout = bench.run_to(0, &["fit", "models/paper.yaml"]);
        (bench, stdout)
    })
}

/// The column of a table by its name.
pub fn column(text: &str, name: &str) -> Vec<f64> {
    let (names, rows) = table(text);
    let index = names.iter().position(|n| n == name);
    let index = index.unwrap_or_else(|| panic!("no {name} in {names:?}"));
    rows.iter().map(|row| row[index]).collect()
}
