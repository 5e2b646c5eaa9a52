//! Reading of a finished run from its output folder.

use super::columns::{interval_columns, named_column};
use super::document::{FORMAT, ResultDocument};
use super::result_table::ResultTable;
use super::run::MODEL;
use crate::config::{ModelFile, Override};
use crate::digest::digest_of_file;
use crate::error::InputError;
use crate::memory;
use crate::results;
use crate::text_io::{JSON, read_text, read_text_within};
use kmcfit_core::solvers::IterationRecord;
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{Method, NodalCoefficients, System};
use serde::Deserialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Longest result document, bytes.
const LONGEST_DOCUMENT: u64 = 1 << 26;
/// Most nodes of a run that is accepted: a hundred GB of memory for a fit with the fewest unknowns.
const MOST_NODES: usize = 1 << 28;

/// Memory for each node of a run that is read, used for predictions, compared and drawn, bytes. Measured: 210 to 450
/// with the eleven columns of a run with true coefficients; the rest is for losses of the allocator.
const PER_NODE: u64 = 600;

/// A finished run, loaded from the folder that `kmcfit fit` wrote it to.
///
/// ```no_run
/// use kmcfit::Run;
/// let run = Run::open("runs/paper")?;
/// println!("{}: J = {:e}", run.document.outcome.status.name(), run.document.cost.r#final);
/// let mass = &run.coefficients.inertias[0];                            // kg, one value per node
/// for (t, m) in run.system.grid.times().iter().zip(mass) {
///     println!("{t} s: {m} kg");
/// }
/// if let Some([low, high]) = run.band("mass") {           // 95 %, where they were computed
///     println!("at the start between {} and {} kg", low[0], high[0]);
/// }
/// # Ok::<(), kmcfit::error::InputError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Run {
    /// Its folder.
    pub folder: PathBuf,
    /// Its copy of the model, as the folder was read; the error if there is none.
    model: Result<String, InputError>,
    /// `result.json`.
    pub document: ResultDocument,
    /// The result document as JSON, unknown keys of later versions included.
    pub value: Value,
    /// Grid, stepper and terms of the run.
    pub system: System,
    /// Estimated nodal coefficients.
    pub coefficients: NodalCoefficients,
    /// True nodal coefficients, if the model names them.
    pub truth: Option<NodalCoefficients>,
    /// The rows of `history.csv` of the search with the result, one per iteration.
    pub history: Vec<IterationRecord>,
    /// `functions.csv`: one row per node, on long grids per several steps; NaN for an empty field.
    pub functions: ResultTable,
    /// `trajectory.csv`: one row per node, on long grids per several steps; NaN beyond the end of a record or without a sample.
    pub trajectory: ResultTable,
}

impl Run {
    /// Reads the folder of a finished run.
    ///
    /// # Errors
    /// If there is no complete run of this format in the folder, or one of its files was edited: the error says which file is missing,
    /// damaged or edited, and where.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self, InputError> {
        let folder = folder.as_ref();
        let _lock = results::read_lock(folder);
        let run = Self::open_edited(folder)?;
        let is_read = |name: &&str| {
            let is_shown = name.ends_with(".svg") || name.ends_with(".html");
            !is_shown && folder.join(name).exists()
        };
        if let Some(name) = run.edited_files().find(is_read) {
            let problem = "this file was changed since kmcfit wrote it";
            return Err(InputError::file(folder.join(name), problem)
                .expected("a run as `kmcfit fit` wrote it")
                .hint("restore the file, or fit the edited model into another folder"));
        }
        Ok(run)
    }

    /// Reads the folder of a finished run whose files may have been edited.
    ///
    /// # Errors
    /// As [`open`](Self::open), edited files aside.
    pub fn open_edited(folder: &Path) -> Result<Self, InputError> {
        if !folder.is_dir() {
            return Err(InputError::file(folder, "no such folder")
                .expected("the folder of a finished run, as written by `kmcfit fit`"));
        }
        let _lock = results::read_lock(folder);
        let value = value(folder)?;
        let document = document(folder, &value)?;
        let (system, quantities) = system(folder, &document)?;
        let nodes = system.grid.nodes();
        memory::check_file(&folder.join("result.json"), nodes as u64 * PER_NODE)?;
        let steps = document.model.steps_per_row.clamp(1, nodes);
        let (rows, what) = rows_of(nodes, steps);
        let functions = ResultTable::read_rows(&folder.join("functions.csv"), rows, &what)?;
        let steps_of_trajectory = document.model.steps_per_trajectory_row.clamp(1, nodes);
        let trajectory = {
            let (rows, what) = rows_of(nodes, steps_of_trajectory);
            ResultTable::read_rows(&folder.join("trajectory.csv"), rows, &what)?
        };
        let has_truth = functions.headers().iter().any(|h| h.starts_with("true_"));
        Ok(Self {
            folder: folder.to_path_buf(),
            model: read_text(&folder.join(MODEL), "the model of a run", LONGEST_DOCUMENT),
            coefficients: coefficients(&functions, "", &quantities, nodes, steps)?,
            truth: has_truth
                .then(|| coefficients(&functions, "true_", &quantities, nodes, steps))
                .transpose()?,
            history: history(folder, document.counts.iterations)?,
            document,
            value,
            system,
            functions,
            trajectory,
        })
    }

    /// Names of the run's files that are not as they were written.
    pub fn edited_files(&self) -> impl Iterator<Item = &str> {
        let listed = self.value["files"].as_object().into_iter().flatten();
        let is_edited = |(name, digest): &(&String, &Value)| {
            digest_of_file(&self.folder.join(name)).map_or(true, |found| **digest != found)
        };
        listed.filter(is_edited).map(|(name, _)| name.as_str())
    }

    /// The files of the fit that have changed since or are missing, each with whether it is the model file, which the run holds.
    pub fn changed_files(&self) -> Vec<(PathBuf, bool)> {
        let model = self.model_path();
        let folder = model.parent().unwrap_or(&model).to_path_buf();
        let is_same =
            |path: &Path, sha256: &str| digest_of_file(path).is_ok_and(|found| found == sha256);
        let data = self.document.sources.iter();
        let data = data.map(|file| (folder.join(&file.name), file.sha256.as_str()));
        let mut changed: Vec<(PathBuf, bool)> = data
            .filter(|(path, sha256)| !is_same(path, sha256))
            .map(|(path, _)| (path, false))
            .collect();
        let own = self.value["files"][MODEL].as_str().unwrap_or_default();
        if !is_same(&model, own) {
            changed.push((model, true));
        }
        changed
    }

    /// Path of the model file: as given, where that leads to it from the current folder.
    fn model_path(&self) -> PathBuf {
        let given = Path::new(&self.document.model.file);
        let name = given.file_name().unwrap_or_default();
        let moved = self.folder.join(&self.document.model.folder).join(name);
        let is_here = given
            .canonicalize()
            .is_ok_and(|here| moved.canonicalize().is_ok_and(|moved| moved == here));
        // A copy of a run elsewhere still names the model.
        match is_here || !moved.exists() && given.exists() {
            true => given.to_path_buf(),
            false => moved,
        }
    }

    /// The model that was fitted, with its overrides, from the run's own copy.
    ///
    /// # Errors
    /// If a data file has changed since the fit or is missing; the error names it.
    pub fn model_file(&self) -> Result<ModelFile, InputError> {
        if let Some((path, _)) = self
            .changed_files()
            .into_iter()
            .find(|(_, is_model)| !is_model)
        {
            let problem = match path.exists() {
                true => "this file has changed since the fit",
                false => "this file of the fit is missing",
            };
            return Err(InputError::file(path, problem)
                .expected(format!("the data of {}", self.folder.display()))
                .hint("restore the file, or fit the model again"));
        }
        self.own_model()
    }

    /// The model that was fitted, with its overrides, from the run's own copy; its data may have changed.
    ///
    /// # Errors
    /// If the copy is missing or damaged.
    pub fn own_model(&self) -> Result<ModelFile, InputError> {
        let text = self.model.clone()?;
        let overrides = Override::parse_all(&self.document.model.overrides)?;
        ModelFile::parse(self.model_path(), text)?.with_overrides(&overrides)
    }

    /// Lower and upper end of the 95 % band of a function or ratio at the nodes, by its name (`mass`, `k/m`, `damping
    /// of shaker`), in its unit; `None` if there is none.
    pub fn band(&self, name: &str) -> Option<[Vec<f64>; 2]> {
        let column = named_column(name, self.document.is_rotation())?;
        let (nodes, steps) = (self.system.grid.nodes(), self.document.model.steps_per_row);
        let [low, high] = interval_columns(&column).map(|header| {
            let rows = self.functions.column(&header)?;
            Some(at_nodes(rows, nodes, steps))
        });
        Some([low?, high?])
    }
}

/// Number of rows of a table with a row for each so many steps, and the distance of its rows in words.
fn rows_of(nodes: usize, steps: usize) -> (usize, String) {
    let what = match steps {
        1 => "node".to_owned(),
        _ => format!("{steps} steps"),
    };
    ((nodes - 1).div_ceil(steps) + 1, what)
}

fn system(
    folder: &Path,
    document: &ResultDocument,
) -> Result<(System, Vec<CoefficientKind>), InputError> {
    let model = &document.model;
    let unusable = |found: String| {
        InputError::file(
            folder.join("result.json"),
            "the result describes no run that can be used",
        )
        .found(found)
        .expected("a result written by `kmcfit fit`")
    };
    let grid = model.grid().filter(|_| model.nodes <= MOST_NODES);
    let grid = grid.ok_or_else(|| unusable(format!("{} nodes", model.nodes)))?;
    let mut steppers = [Method::Midpoint, Method::Rk4].into_iter();
    let method = steppers.find(|m| m.name() == model.stepper);
    let method = method.ok_or_else(|| unusable(format!("stepper `{}`", model.stepper)))?;
    let known = |name: &String| CoefficientKind::named(name);
    let quantities: Option<Vec<CoefficientKind>> = model.terms.iter().map(known).collect();
    let no_terms = || unusable(format!("terms {:?}", model.terms));
    let quantities = quantities.ok_or_else(no_terms)?;
    let width = |q: &CoefficientKind| model.widths.get(q.name()).copied().unwrap_or(f64::NAN);
    let terms = quantities.iter().filter_map(|q| q.law(width(q)));
    let terms: Vec<Law> = terms.collect();
    if !terms.starts_with(&[Law::Damping, Law::Stiffness]) {
        return Err(no_terms());
    }
    let system = System {
        grid,
        method,
        structure: Structure::one(terms),
    };
    Ok((system, quantities))
}

fn value(folder: &Path) -> Result<Value, InputError> {
    let path = folder.join("result.json");
    if let Some(owner) = results::owner(folder).filter(|owner| *owner != "fit") {
        return Err(
            InputError::file(folder, format!("these are results of `kmcfit {owner}`"))
                .expected("the folder of a finished run, as written by `kmcfit fit`"),
        );
    }
    let what = "the result of a finished run";
    let text = read_text_within(&path, what, LONGEST_DOCUMENT, JSON)?;
    let value: Value = serde_json::from_str(&text).map_err(|error| {
        InputError::file(&path, "not a JSON document")
            .found(format!(
                "a syntax error at line {}, column {}",
                error.line(),
                error.column()
            ))
            .expected("a result written by `kmcfit fit`")
    })?;
    let format = value.get("format").and_then(Value::as_u64);
    if format != Some(FORMAT.into()) {
        return Err(
            InputError::file(&path, "unsupported format version of the result")
                .key("format")
                .found(format.map_or("none".into(), |f| f.to_string()))
                .expected(FORMAT.to_string()),
        );
    }
    match value.get("files") {
        Some(_) => Ok(value),
        None => Err(
            InputError::file(&path, "the run of an earlier version of kmcfit")
                .found("no list of its files")
                .expected("a run of this version: fit the model again"),
        ),
    }
}

fn document(folder: &Path, value: &Value) -> Result<ResultDocument, InputError> {
    let path = folder.join("result.json");
    if value.get("model").is_none()
        && let Some(reason) = value.pointer("/outcome/reason").and_then(|r| r.as_str())
    {
        // A run that failed before the fit wrote its outcome only.
        return Err(
            InputError::file(&path, "this run failed and has no estimates")
                .found(reason)
                .expected("the result of a run with estimates"),
        );
    }
    ResultDocument::deserialize(value).map_err(|error| {
        InputError::file(&path, "the result is not complete")
            .found(error)
            .expected("a result written by `kmcfit fit`")
    })
}

fn history(folder: &Path, iterations: u64) -> Result<Vec<IterationRecord>, InputError> {
    let path = folder.join("history.csv");
    let table = ResultTable::read(&path)?;
    let attempts = table.required("attempt")?;
    let last: Vec<usize> = (0..attempts.len())
        .filter(|row| attempts[*row] == 0.0)
        .collect();
    let rows = last.len();
    if rows as u64 != iterations {
        return Err(InputError::file(path, "the table does not fit the result")
            .found(format!("{rows} rows of attempt 0"))
            .expected(format!("{iterations}, one per iteration")));
    }
    let column = |name: &str| {
        let all = table.required(name)?;
        Ok::<Vec<f64>, InputError>(last.iter().map(|row| all[*row]).collect())
    };
    let ratio = "gradient_norm_squared_ratio";
    let (cost, cost_ratio, gradient) = (column("cost")?, column("cost_ratio")?, column(ratio)?);
    let (step, change) = (column("step")?, column("relative_change")?);
    Ok((0..rows)
        .map(|i| IterationRecord {
            iteration: i as u64 + 1,
            cost: cost[i],
            cost_ratio: cost_ratio[i],
            gradient_norm_squared_ratio: gradient[i],
            step: step[i],
            relative_change: change[i],
        })
        .collect())
}

/// The mass and the functions of the terms `quantities`; refuses values that are not finite.
fn coefficients(
    table: &ResultTable,
    prefix: &str,
    quantities: &[CoefficientKind],
    nodes: usize,
    steps: usize,
) -> Result<NodalCoefficients, InputError> {
    let mass_of_rotation = CoefficientKind::MASS.column(true);
    let is_rotation = table
        .column(&format!("{prefix}{mass_of_rotation}"))
        .is_some();
    let column = |quantity: CoefficientKind| {
        let name = quantity.column(is_rotation);
        let rows = table.finite(&format!("{prefix}{name}"))?;
        Ok(at_nodes(rows, nodes, steps))
    };
    Ok::<_, InputError>(NodalCoefficients {
        inertias: vec![column(CoefficientKind::MASS)?],
        coefficients: quantities
            .iter()
            .map(|q| column(*q))
            .collect::<Result<_, _>>()?,
    })
}

/// Values at all nodes from `rows` at every so many steps and at the end, linear in between.
pub(super) fn at_nodes(rows: Vec<f64>, nodes: usize, steps: usize) -> Vec<f64> {
    if steps <= 1 {
        return rows;
    }
    let value = |node: usize| {
        let row = node / steps;
        let next = ((row + 1) * steps).min(nodes - 1);
        match next - row * steps {
            0 => rows[row],
            length => {
                let share = (node - row * steps) as f64 / length as f64;
                rows[row] + share * (rows[row + 1] - rows[row])
            }
        }
    };
    (0..nodes).map(value).collect()
}
