//! The fit of one record of a fleet.

use super::records::FleetRecord;
use crate::config::{BuildMode, ModelFile, build};
use crate::digest::digest;
use crate::error::InputError;
use crate::fitting::fit_or_no_response;
use crate::report::document::Estimates;
use crate::report::{CompletedFit, RequestedFiles};
use crate::text_io::{LONGEST_TABLE, read_bytes};
use kmcfit_core::assessment::VerdictLevel;
use kmcfit_core::host::Instant;
use kmcfit_core::solvers::{IterationRecord, Observer, Status};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Result of the fit of one record: a line of `rows.jsonl`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The record: its path as given.
    pub record: String,
    /// SHA-256 digest of its content and of the values that its table states for it; empty for a record that could not be read.
    #[serde(default)]
    pub sha256: String,
    /// Estimates, as in the result document of a fit; empty where there is an error.
    pub estimates: Estimates,
    /// Verdict; none where there is an error.
    pub verdict: Option<VerdictLevel>,
    /// Reasons of the verdict, then warnings.
    pub warnings: Vec<String>,
    /// Time of reading and fit, s.
    pub seconds: f64,
    /// Why the record has no estimates.
    pub error: Option<String>,
}

impl Row {
    /// The row of a record without estimates.
    pub fn failed(record: &str, error: impl Into<String>) -> Self {
        Self {
            record: record.to_owned(),
            error: Some(error.into()),
            ..Self::default()
        }
    }
}

/// The model of a fleet: it has one experiment, whose data are those of each record in turn.
///
/// # Errors
/// If the model has several experiments, or one without `data`.
pub fn check_model(file: ModelFile) -> Result<ModelFile, InputError> {
    let experiments = &file.spec.experiments;
    if experiments.len() > 1 {
        return Err(file
            .error_at("experiments[1]", "the model of a fleet has one experiment")
            .found(format!("{} experiments", experiments.len()))
            .expected("one experiment, whose `data` each record replaces"));
    }
    match experiments.first().is_some_and(|e| e.data.is_some()) {
        true => Ok(file),
        false => Err(file
            .error_at("experiments[0].data", "the experiment has no data")
            .expected("`data: FILE`, in whose place each record is read")),
    }
}

/// The content of a record and the digest of it and of its own values.
///
/// # Errors
/// If the file cannot be read.
pub fn content_of(record: &FleetRecord) -> Result<(Arc<[u8]>, String), InputError> {
    let content: Arc<[u8]> = match &record.content {
        Some(content) => Arc::clone(content),
        None => read_bytes(&record.path, "a record", LONGEST_TABLE)?.into(),
    };
    let values: String = record
        .overrides
        .iter()
        .map(|change| format!("{change}\n"))
        .collect();
    let sha256 = match values.is_empty() {
        true => digest(&content),
        false => digest(format!("{} {values}", digest(&content)).as_bytes()),
    };
    Ok((content, sha256))
}

/// Fits a record; `None` where `interrupt` ended it. Every failure, a panic included, is the error of the row.
pub fn fit_record(
    model: &ModelFile,
    record: &FleetRecord,
    interrupt: &Arc<AtomicBool>,
) -> Option<Row> {
    let clock = Instant::now();
    let found = content_of(record).map(|(content, sha256)| {
        // The fit shares no state with others that a panic could leave half changed.
        let fit = || fitted(model, record, content, interrupt);
        let row = catch_unwind(AssertUnwindSafe(fit));
        (
            sha256,
            row.unwrap_or_else(|_| Err("internal error: the fit panicked".into())),
        )
    });
    let (sha256, row) = found.unwrap_or_else(|error| (String::new(), Err(error.to_string())));
    let row = row.unwrap_or_else(|error| Some(Row::failed(&record.name, error)))?;
    let seconds = (clock.elapsed().as_secs_f64() * 1e6).round() / 1e6;
    Some(Row {
        sha256,
        seconds,
        ..row
    })
}

/// The row of a record without digest and time; `None` where the fit was interrupted.
fn fitted(
    fleet: &ModelFile,
    record: &FleetRecord,
    content: Arc<[u8]>,
    interrupt: &Arc<AtomicBool>,
) -> Result<Option<Row>, String> {
    let text = |error: InputError| error.to_string();
    let file = fleet.clone();
    let file = file.with_overrides(&record.overrides).map_err(text)?;
    let name = record.path.to_string_lossy();
    // The name of a file in memory states its format; that of another one is shown in messages.
    let name = if record.content.is_some() {
        &*name
    } else {
        &record.name
    };
    let mut model = build(&file.with_record(name, content), BuildMode::Fit).map_err(text)?;
    model.settings.interrupt = Some(Arc::clone(interrupt));
    let mut ignore = |_: &IterationRecord| {};
    let found = fit_or_no_response(&model, &mut Observer::new(&mut ignore))?;
    if found.fit.outcome.status == Status::Interrupted {
        return Ok(None);
    }
    let completed = CompletedFit::of(found);
    if !completed.assessment.not_done.is_empty() {
        return Ok(None);
    }
    let document = completed.fitted(RequestedFiles::default()).document();
    let reasons = document.verdict.iter().flat_map(|verdict| &verdict.reasons);
    let findings = reasons.chain(&document.warnings);
    let mut warnings: Vec<String> = findings.map(|finding| finding.sentence.clone()).collect();
    let mut seen = HashSet::new();
    warnings.retain(|text| seen.insert(text.clone()));
    Ok(Some(Row {
        record: record.name.clone(),
        estimates: document.estimates,
        verdict: document.verdict.map(|verdict| verdict.level),
        warnings,
        ..Row::default()
    }))
}
