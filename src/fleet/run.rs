//! The fits of a fleet on several threads.

use super::fit::fit_record;
use super::folder::FleetFolder;
use super::records::{FleetRecord, RecordList};
use crate::config::ModelFile;
use crate::error::InputError;
use kmcfit_core::threads::{map, sharing};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Fits the records that have no row yet, and those whose rows have errors. True when all have their rows; false where
/// `interrupt` ended the work. `progress` receives the number of rows and that of all records.
///
/// # Errors
/// If a row cannot be written; the rows before are kept.
pub fn run(
    folder: &mut FleetFolder,
    model: &ModelFile,
    list: &RecordList,
    threads: usize,
    interrupt: &Arc<AtomicBool>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<bool, InputError> {
    let is_open = |record: &&&FleetRecord| {
        folder
            .row(&record.name)
            .is_none_or(|row| row.error.is_some())
    };
    let todo: Vec<&FleetRecord> = list.records.iter().filter(|r| is_open(&r)).collect();
    let before = list.records.len() - todo.len();
    let shared = Mutex::new((folder, 0, None));
    let lock = || shared.lock().unwrap_or_else(PoisonError::into_inner);
    map(todo.len(), threads, |i| {
        if interrupt.load(Ordering::Relaxed) || lock().2.is_some() {
            return;
        }
        // The fits share the processors.
        if let Some(row) = sharing(|| fit_record(model, todo[i], interrupt)) {
            let (folder, written, failure) = &mut *lock();
            match folder.append(row) {
                Ok(()) => {
                    *written += 1;
                    progress(before + *written, list.records.len());
                }
                Err(error) => *failure = Some(error),
            }
        }
    });
    let (_, written, failure) = shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    match failure {
        Some(error) => Err(error),
        None => Ok(written == todo.len()),
    }
}
