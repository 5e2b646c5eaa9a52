//! `kmcfit verify`: fits the model of a run again and compares every number.

use super::fit::{RunLocation, fit_into, read};
use super::progress::Progress;
use super::{CommandError, NOT_CONVERGED, OK, print, unwritable};
use crate::error::InputError;
use crate::report::{RequestedFiles, Run};
use crate::results::{OutputFolder, RESULT};
use crate::text_io::{LONGEST_TABLE, read_text};
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Fit the model of a finished run again and compare every number of its files.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  kmcfit verify runs/model\n\nExit status: 0 if all numbers agree, 3 if not."
)]
pub struct Arguments {
    /// Folder of a finished run.
    run: PathBuf,
}

/// Largest difference of two numbers, relative to the larger one. A fit has the same bits on all processors but for the last ones of sines
/// and exponentials, which the steps of a fit may amplify by some orders of magnitude.
const RELATIVE: f64 = 1e-7;
/// Largest difference of numbers near zero, relative to the largest one of their list or column.
const OF_LARGEST: f64 = 1e-12;
/// Keys of the result document that are no results.
const LEFT_OUT: [&str; 6] = ["seconds", "timings", "version", "files", "folder", "file"];
/// Most differences that are printed.
const MOST_SHOWN: usize = 20;

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let run = Run::open_edited(&arguments.run)?;
    let file = run.model_file()?;
    let model = read(&file)?;
    let requested = RequestedFiles {
        figures: false,
        tables: run.document.model.steps_per_row == 1,
    };
    let location =
        tempfile::tempdir().map_err(|error| unwritable(&std::env::temp_dir(), &error))?;
    let again = location.path().join("run");
    let folder = OutputFolder::prepare(&again, "fit", [])?;
    let progress = Progress::new("fitting again");
    let new_run = RunLocation {
        folder: &folder,
        inside: None,
    };
    fit_into(new_run, &file, &model, &progress, requested, false)?;
    let mut found = Compared::default();
    let names = std::iter::once(RESULT.to_owned()).chain(folder.files());
    for name in names.filter(|name| name.ends_with(".json") || name.ends_with(".csv")) {
        found.files(&name, &run.folder, &again)?;
    }
    found.changed(&run);
    print(&found.text());
    Ok(match found.differences.is_empty() {
        true => OK,
        false => NOT_CONVERGED,
    })
}

/// The comparison of two runs.
#[derive(Default)]
struct Compared {
    values: usize,
    differences: Vec<String>,
}

impl Compared {
    /// Compares a file of both runs.
    fn files(&mut self, name: &str, run: &Path, again: &Path) -> Result<(), InputError> {
        let text = |folder: &Path| read_text(&folder.join(name), "a file of a run", LONGEST_TABLE);
        let (stored, new) = (text(run), text(again)?);
        let Ok(stored) = stored else {
            self.differences.push(format!("{name}: missing"));
            return Ok(());
        };
        if name.ends_with(".csv") {
            self.values(name, &table(&stored), &table(&new), 0.0);
            return Ok(());
        }
        let value = |text: &str| serde_json::from_str(text).unwrap_or(Value::Null);
        self.values(name, &value(&stored), &value(&new), 0.0);
        Ok(())
    }

    /// Adds files that are not as they were written, such as the page.
    fn changed(&mut self, run: &Run) {
        let edited = run.edited_files();
        let edited = edited.map(|name| format!("{name}: not as it was written"));
        self.differences.extend(edited);
    }

    /// Compares two values at a place; `floor` is a difference of numbers that is rounding.
    fn values(&mut self, location: &str, stored: &Value, new: &Value, floor: f64) {
        match (stored, new) {
            (Value::Object(stored), Value::Object(new)) => {
                let names = stored
                    .keys()
                    .chain(new.keys().filter(|name| !stored.contains_key(*name)));
                for name in names.filter(|name| !LEFT_OUT.contains(&name.as_str())) {
                    let [stored, new] =
                        [stored, new].map(|map| map.get(name).unwrap_or(&Value::Null));
                    self.values(&format!("{location}/{name}"), stored, new, floor);
                }
            }
            (Value::Array(stored), Value::Array(new)) if stored.len() == new.len() => {
                let sizes = new.iter().filter_map(Value::as_f64).map(f64::abs);
                let floor = OF_LARGEST * sizes.fold(0.0, f64::max);
                for (i, (stored, new)) in stored.iter().zip(new).enumerate() {
                    self.values(&format!("{location}/{}", i + 1), stored, new, floor);
                }
            }
            _ => {
                self.values += 1;
                let is_near = match (stored.as_f64(), new.as_f64()) {
                    (Some(a), Some(b)) => {
                        (a - b).abs() <= floor.max(RELATIVE * a.abs().max(b.abs()))
                    }
                    _ => stored == new,
                };
                if !is_near {
                    self.differences
                        .push(format!("{location}: {stored} in the run, {new} again"));
                }
            }
        }
    }

    fn text(&self) -> String {
        let count = self.differences.len();
        if count == 0 {
            return format!("verified: {} values agree with a new fit\n", self.values);
        }
        let mut text = format!("{count} of {} values differ from a new fit\n", self.values);
        for difference in self.differences.iter().take(MOST_SHOWN) {
            let _ = writeln!(text, "  {difference}");
        }
        if count > MOST_SHOWN {
            let _ = writeln!(text, "  and {} more", count - MOST_SHOWN);
        }
        text
    }
}

/// A table as lists of values by the names of its columns; texts where a field is no number.
fn table(text: &str) -> Value {
    let mut lines = text.lines().filter(|line| !line.is_empty());
    let names = lines.next().unwrap_or_default().split(',');
    let mut columns: Vec<(String, Vec<Value>)> =
        names.map(|name| (name.to_owned(), Vec::new())).collect();
    for line in lines {
        for ((_, column), field) in columns.iter_mut().zip(line.split(',')) {
            let number = field.parse::<f64>().map(Value::from);
            column.push(number.unwrap_or_else(|_| field.into()));
        }
    }
    columns.into_iter().collect()
}
