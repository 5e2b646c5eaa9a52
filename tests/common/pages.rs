//! Pages of the documentation: their commands are run, and the shown output is compared with the printed one.

use super::repository;
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// The text of a page.
pub fn page(path: &str) -> String {
    fs::read_to_string(repository(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// A code block: its language and its lines.
pub struct Block {
    pub language: String,
    pub lines: Vec<String>,
}

impl Block {
    pub fn text(&self) -> String {
        self.lines.iter().map(|line| format!("{line}\n")).collect()
    }
}

/// The code blocks of a page.
pub fn blocks(page: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut open = false;
    for line in page.lines() {
        match line.strip_prefix("```") {
            Some(language) if !open => {
                open = true;
                blocks.push(Block {
                    language: language.to_owned(),
                    lines: Vec::new(),
                });
            }
            Some(_) => open = false,
            None if open => blocks.last_mut().expect("a block").lines.push(line.into()),
            None => {}
        }
    }
    assert!(!open, "a block is not closed");
    blocks
}

/// The code blocks in one language.
pub fn blocks_in(page: &str, language: &str) -> Vec<Block> {
    let blocks = blocks(page).into_iter();
    blocks.filter(|block| block.language == language).collect()
}

/// A folder with the shipped models and data, in which the commands of a page are run in order.
pub fn fresh_clone() -> TempDir {
    let clone = tempfile::tempdir().expect("a temporary folder");
    for folder in ["models", "data"] {
        copy(&repository(folder), &clone.path().join(folder));
    }
    clone
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder can be listed") {
        let (entry, to) = entry
            .map(|entry| (entry.path(), to.join(entry.file_name())))
            .expect("an entry");
        if entry.is_dir() {
            copy(&entry, &to);
        } else {
            fs::copy(entry, to).expect("a file can be copied");
        }
    }
}

/// Output of a command of a page, with `kmcfit` as the program under test.
pub fn output(folder: &Path, command: &str) -> String {
    let program = Path::new(env!("CARGO_BIN_EXE_kmcfit"));
    let programs = program.parent().expect("the program is in a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    let command = command.replace("cargo run --release --", "kmcfit");
    let output = Command::new("sh")
        .args(["-c", &command])
        .current_dir(folder)
        .env("PATH", format!("{}:{path}", programs.display()))
        .output()
        .expect("a shell");
    let text = [output.stdout, output.stderr].concat();
    String::from_utf8(text).expect("the program writes UTF-8")
}

/// A command of a page with its shown and its printed output.
pub struct Step {
    pub command: String,
    pub shown: String,
    pub printed: String,
}

/// The folder after all commands of a page, and those commands.
pub struct Tour {
    pub clone: TempDir,
    pub steps: Vec<Step>,
}

impl Tour {
    /// Runs the commands of a page.
    pub fn of(page: &str) -> Self {
        let clone = fresh_clone();
        let mut steps: Vec<Step> = Vec::new();
        for block in blocks_in(page, "console") {
            for line in &block.lines {
                match line.strip_prefix("$ ") {
                    Some(command) => steps.push(Step {
                        command: command.to_owned(),
                        shown: String::new(),
                        printed: output(clone.path(), command),
                    }),
                    None => {
                        let step = steps.last_mut().expect("a command before its output");
                        step.shown.push_str(line);
                        step.shown.push('\n');
                    }
                }
            }
        }
        Self { clone, steps }
    }

    /// Every command prints what is shown; a line `…` stands for any number of lines.
    pub fn holds(&self) {
        let wrong = self.steps.iter().filter(|s| !shows(&s.shown, &s.printed));
        let wrong: String = wrong
            .map(|step| {
                let (shown, printed) = (&step.shown, &step.printed);
                format!("$ {}\nshown:\n{shown}\nprinted:\n{printed}\n", step.command)
            })
            .collect();
        assert!(wrong.is_empty(), "{wrong}");
    }
}

/// Mark for omitted lines.
const CUT: &str = "…";

/// Relative errors below this are rounding errors and depend on the machine.
const ROUNDING: f64 = 1e-7;

/// Largest relative difference of a shown and a printed number: implementations of elementary functions differ in the last
/// digit, and L-BFGS uses logarithmic coordinates.
const SLACK: f64 = 0.01;

/// True if a shown text equals the printed one, except for omitted lines.
fn shows(shown: &str, printed: &str) -> bool {
    let (shown, printed): (Vec<&str>, Vec<&str>) =
        (shown.lines().collect(), printed.lines().collect());
    shows_lines(&shown, &printed)
}

fn shows_lines(shown: &[&str], printed: &[&str]) -> bool {
    let Some((first, rest)) = shown.split_first() else {
        return printed.is_empty();
    };
    if *first == CUT {
        return (0..=printed.len()).any(|from| shows_lines(rest, &printed[from..]));
    }
    let Some((line, after)) = printed.split_first() else {
        return false;
    };
    same(first, line) && shows_lines(rest, after)
}

/// True if two lines have equal words, and equal numbers within the tolerance.
fn same(shown: &str, printed: &str) -> bool {
    let words = |line: &str| -> Vec<String> {
        // The next number is the duration of a run.
        let line = line
            .split_once(" solves, ")
            .map_or(line, |(before, _)| before);
        let words = line.split(|c: char| c.is_whitespace() || ",;:()".contains(c));
        words.filter(|w| !w.is_empty()).map(str::to_owned).collect()
    };
    let (shown, printed) = (words(shown), words(printed));
    shown.len() == printed.len() && shown.iter().zip(&printed).all(|(a, b)| same_word(a, b))
}

fn same_word(shown: &str, printed: &str) -> bool {
    match (shown.parse::<f64>(), printed.parse::<f64>()) {
        (Ok(a), Ok(b)) => {
            let small = a.abs() < ROUNDING && b.abs() < ROUNDING;
            small || (a - b).abs() <= SLACK * a.abs().max(b.abs())
        }
        _ => shown == printed,
    }
}
