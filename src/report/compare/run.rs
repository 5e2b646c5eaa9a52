//! One of the runs that are compared, read from its folder.

use crate::error::InputError;
use crate::input::read_text;
use crate::report::FinishedRun;
use std::path::Path;

/// Longest table or document of a run that is read, bytes.
const LONGEST: u64 = 1 << 30;

/// A finished run and what the comparison needs beside it.
#[derive(Debug, Clone)]
pub struct ComparedRun {
    /// What the comparison calls it; no two runs have the same name.
    pub name: String,
    /// Document, device and truth.
    pub finished: FinishedRun,
    /// Largest violation of a constraint relative to its scale, where the document says it.
    pub max_violation: Option<f64>,
    /// The iterations, from 1.
    pub iterations: Vec<f64>,
    /// `J/J0` after each iteration.
    pub cost_ratio: Vec<f64>,
    /// How each measured motion is matched.
    pub motions: Vec<MatchedMotion>,
}

/// One measured motion and what a run leaves of it.
#[derive(Debug, Clone, PartialEq)]
pub struct MatchedMotion {
    /// Name of the experiment.
    pub experiment: String,
    /// Times of the readings, s.
    pub times: Vec<f64>,
    /// Readings `y_obs`, m.
    pub observed: Vec<f64>,
    /// `y - y_obs`, m.
    pub residual: Vec<f64>,
}

impl ComparedRun {
    /// Reads the folder of a finished run.
    ///
    /// # Errors
    /// If there is no complete run in the folder.
    pub fn read(name: &str, folder: &Path) -> Result<Self, InputError> {
        let finished = FinishedRun::open(folder)?;
        let history = Columns::read(&folder.join("history.csv"))?;
        let trajectory = Columns::read(&folder.join("trajectory.csv"))?;
        let names = finished.document.experiments.iter().map(|e| e.name.clone());
        Ok(Self {
            name: name.into(),
            max_violation: max_violation(folder)?,
            iterations: history.column("iteration").unwrap_or_default(),
            cost_ratio: history.column("cost_ratio").unwrap_or_default(),
            motions: motions(&trajectory, names),
            finished,
        })
    }

    /// Times of the nodes, s.
    pub fn times(&self) -> Vec<f64> {
        self.finished.oscillator.grid.times()
    }
}

/// `constraints.max_violation` of `result.json`; older documents and runs without constraints have
/// none.
fn max_violation(folder: &Path) -> Result<Option<f64>, InputError> {
    let path = folder.join("result.json");
    let text = read_text(&path, "the result of a finished run", LONGEST)?;
    let value: Option<serde_json::Value> = serde_json::from_str(&text).ok();
    let violation = value.as_ref().and_then(|v| {
        let constraints = v.get("constraints")?;
        constraints.get("max_violation")?.as_f64()
    });
    Ok(violation)
}

/// The motions that have readings: `y_m` and `observed_y_m`, or with the number of the experiment
/// where there are several. `names` are those of the experiments with readings, in order.
fn motions(trajectory: &Columns, mut names: impl Iterator<Item = String>) -> Vec<MatchedMotion> {
    let numbered = (1..=trajectory.headers.len()).map(|i| format!("_{i}"));
    let suffixes = std::iter::once(String::new()).chain(numbered);
    let Some(times) = trajectory.column("t_s") else {
        return Vec::new();
    };
    suffixes
        .filter_map(|suffix| {
            let found = trajectory.column(&format!("y_m{suffix}"))?;
            let observed = trajectory.column(&format!("observed_y_m{suffix}"))?;
            let read = |i: &usize| observed[*i].is_finite() && found[*i].is_finite();
            let kept: Vec<usize> = (0..observed.len()).filter(read).collect();
            let at = |f: &dyn Fn(usize) -> f64| kept.iter().map(|&i| f(i)).collect();
            Some(MatchedMotion {
                experiment: names.next().unwrap_or_else(|| "motion".into()),
                times: at(&|i| times[i]),
                observed: at(&|i| observed[i]),
                residual: at(&|i| found[i] - observed[i]),
            })
        })
        .collect()
}

/// A table that a run wrote: unlike a user's, it may have no rows and empty fields.
struct Columns {
    headers: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Columns {
    fn read(path: &Path) -> Result<Self, InputError> {
        let text = read_text(path, "a table written by `kmcfit fit`", LONGEST)?;
        let mut lines = text.lines();
        let headers = lines.next().unwrap_or_default().split(',');
        let number = |field: &str| field.trim().parse().unwrap_or(f64::NAN);
        Ok(Self {
            headers: headers.map(|h| h.trim().to_owned()).collect(),
            rows: lines.map(|l| l.split(',').map(number).collect()).collect(),
        })
    }

    /// A column, not a number where a field is empty; `None` where there is no such column.
    fn column(&self, name: &str) -> Option<Vec<f64>> {
        let index = self.headers.iter().position(|h| h == name)?;
        let field = |row: &Vec<f64>| row.get(index).copied().unwrap_or(f64::NAN);
        Some(self.rows.iter().map(field).collect())
    }
}
