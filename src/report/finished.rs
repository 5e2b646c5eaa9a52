//! Reading a finished run back.

use super::document::{FORMAT, ResultDocument};
use crate::dynamics::{Device, Method, Oscillator, Term};
use crate::error::InputError;
use crate::functions::Quantity;
use crate::input::read_text;
use crate::observations::Table;
use std::path::Path;

/// Longest result document, bytes.
const LONGEST_DOCUMENT: u64 = 1 << 26;

/// A finished run: its document and its device.
#[derive(Debug, Clone)]
pub struct FinishedRun {
    /// `result.json`.
    pub document: ResultDocument,
    /// Grid, stepper and terms of the run.
    pub oscillator: Oscillator,
    /// The device that was found.
    pub device: Device,
    /// The true device, where the model named it.
    pub truth: Option<Device>,
}

impl FinishedRun {
    /// Reads the folder of a finished run.
    ///
    /// # Errors
    /// If there is no complete run of this format in the folder.
    pub fn open(folder: &Path) -> Result<Self, InputError> {
        if !folder.is_dir() {
            return Err(InputError::file(folder, "there is no such folder")
                .expected("the folder of a finished run, as written by `kmcfit fit`"));
        }
        let document = document(folder)?;
        let path = folder.join("result.json");
        let unusable = |found: String| {
            InputError::file(&path, "the result describes no run that can be used")
                .found(found)
                .expected("a result written by `kmcfit fit`")
        };
        let grid = (document.model.grid())
            .ok_or_else(|| unusable(format!("{} nodes", document.model.nodes)))?;
        let steppers = [Method::Midpoint, Method::Rk4];
        let method = (steppers
            .into_iter()
            .find(|m| m.name() == document.model.stepper))
        .ok_or_else(|| unusable(format!("stepper `{}`", document.model.stepper)))?;
        let width = document.model.friction_width.unwrap_or(f64::NAN);
        let known = |name: &String| Quantity::ALL.into_iter().find(|q| q.name() == name);
        let quantities: Option<Vec<Quantity>> = document.model.terms.iter().map(known).collect();
        let quantities =
            quantities.ok_or_else(|| unusable(format!("terms {:?}", document.model.terms)))?;
        let terms: Vec<Term> = quantities.iter().filter_map(|q| q.term(width)).collect();
        if !terms.starts_with(&[Term::Damping, Term::Stiffness]) {
            return Err(unusable(format!("terms {:?}", document.model.terms)));
        }
        let table = Table::read(folder.join("functions.csv"))?;
        if table.rows() != grid.nodes() {
            return Err(
                InputError::file(table.path(), "the table does not belong to this result")
                    .found(format!("{} rows", table.rows()))
                    .expected(format!("{} rows, one per node", grid.nodes())),
            );
        }
        let has_truth = table.headers().iter().any(|h| h.starts_with("true_"));
        Ok(Self {
            document,
            oscillator: Oscillator {
                grid,
                method,
                terms,
            },
            device: device(&table, "", &quantities)?,
            truth: has_truth
                .then(|| device(&table, "true_", &quantities))
                .transpose()?,
        })
    }
}

fn document(folder: &Path) -> Result<ResultDocument, InputError> {
    let path = folder.join("result.json");
    let text = read_text(&path, "the result of a finished run", LONGEST_DOCUMENT)?;
    let value: serde_json::Value = serde_json::from_str(&text).map_err(|error| {
        InputError::file(&path, "this is no JSON document")
            .found(error)
            .expected("a result written by `kmcfit fit`")
    })?;
    let format = value.get("format").and_then(serde_json::Value::as_u64);
    if format != Some(FORMAT.into()) {
        return Err(
            InputError::file(&path, "the result has another format version")
                .key("format")
                .found(format.map_or("none".into(), |f| f.to_string()))
                .expected(FORMAT.to_string()),
        );
    }
    if value.get("model").is_none()
        && let Some(reason) = value.pointer("/outcome/reason").and_then(|r| r.as_str())
    {
        // Written by a run that could not begin: its outcome is all there is.
        return Err(
            InputError::file(&path, "this run failed and found no device")
                .found(reason)
                .expected("the result of a run that found one"),
        );
    }
    serde_json::from_value(value).map_err(|error| {
        InputError::file(&path, "the result is not complete")
            .found(error)
            .expected("a result written by `kmcfit fit`")
    })
}

/// The mass and the functions of the terms `quantities`.
fn device(table: &Table, prefix: &str, quantities: &[Quantity]) -> Result<Device, InputError> {
    let column = |quantity: Quantity| {
        let name = format!("{prefix}{}", quantity.column());
        table.column(&name).map(<[f64]>::to_vec)
    };
    Ok(Device {
        mass: column(Quantity::Mass)?,
        coefficients: quantities
            .iter()
            .map(|q| column(*q))
            .collect::<Result<_, _>>()?,
    })
}
