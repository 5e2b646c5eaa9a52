//! The fit of one record.

use super::model::FleetModel;
use super::records::Record;
use super::row::{Curve, Row};
use crate::config::{BuildMode, Model, build};
use crate::error::InputError;
use crate::finding::Finding;
use crate::fitting::fit_or_no_response;
use crate::report::CompletedFit;
use crate::results::RequestedFiles;
use kmcfit_core::internals::solvers::{IterationRecord, Observer, Status};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Points of a curve.
const POINTS: usize = 101;
/// Beginning of the error of a row that a time limit ended.
pub const TIME_LIMIT: &str = "time limit";

/// What ends a fit.
#[derive(Debug, Clone, Default)]
pub struct Limits {
    /// Set where the fit is to end.
    pub interrupt: Arc<AtomicBool>,
    /// Longest time of a record.
    pub time: Option<Duration>,
}

/// The result of a record.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Its row.
    pub row: Row,
    /// The coefficients that vary.
    pub curves: Vec<Curve>,
    /// Estimated parameters of the functions; `None` without a fit.
    pub parameters: Option<Vec<f64>>,
}

/// Fits a record, from the parameters `from` of the functions where they are as many; `None` if `limits.interrupt` was set before the time
/// limit. Every failure, a panic included, is the error of the row.
pub fn fit_record(
    model: &FleetModel,
    record: &Record,
    content: Option<Arc<[u8]>>,
    from: Option<&[f64]>,
    limits: &Limits,
) -> Option<Fitted> {
    let clock = Instant::now();
    // The fit shares no state with others that a panic could leave half changed.
    let result = catch_unwind(AssertUnwindSafe(|| {
        fitted(model, record, content, from, limits)
    }));
    let elapsed = clock.elapsed();
    let seconds = (elapsed.as_secs_f64() * 1e6).round() / 1e6;
    let failed = |error: String| Fitted {
        row: Row::failed(&record.name, seconds, error),
        curves: Vec::new(),
        parameters: None,
    };
    if let Some(limit) = limits.time.filter(|limit| elapsed > *limit) {
        let text = format!(
            "{TIME_LIMIT}: the record took more than {} s",
            limit.as_secs_f64()
        );
        return Some(failed(text));
    }
    match result {
        Ok(Ok(_) | Err(_)) if limits.interrupt.load(Ordering::Relaxed) => None,
        Ok(Ok(mut found)) => {
            found.row.seconds = seconds;
            Some(found)
        }
        Ok(Err(error)) => Some(failed(error)),
        Err(_) => Some(failed("internal error: the fit panicked".to_owned())),
    }
}

fn fitted(
    fleet: &FleetModel,
    record: &Record,
    content: Option<Arc<[u8]>>,
    from: Option<&[f64]>,
    limits: &Limits,
) -> Result<Fitted, String> {
    let text = |error: InputError| error.to_string();
    let file = fleet.with_record(record, content).map_err(text)?;
    let mut model = build(&file, BuildMode::Fit).map_err(text)?;
    model.settings.interrupt = Some(Arc::clone(&limits.interrupt));
    let own = model.settings.stopping.limit;
    model.settings.stopping.limit = own.into_iter().chain(limits.time).min();
    start_from(&mut model, from);
    let mut ignore = |_: &IterationRecord| {};
    let found = fit_or_no_response(&model, &mut Observer::new(&mut ignore))
        .map_err(|breakdown| format!("the start cannot be evaluated: {breakdown}"))?;
    if found.fit.outcome.status == Status::Interrupted {
        return Err("interrupted".to_owned());
    }
    let done = CompletedFit::of(found);
    let document = done.fitted(RequestedFiles::default()).document();
    let mut warnings = Vec::new();
    if let Some(verdict) = &document.verdict {
        warnings.extend(Finding::texts(&verdict.reasons));
    }
    for warning in Finding::texts(&document.warnings) {
        if !warnings.contains(&warning) {
            warnings.push(warning);
        }
    }
    let functions = done.model.problem.functions.scalar_range().start;
    Ok(Fitted {
        row: Row {
            record: record.name.clone(),
            estimates: document.estimates,
            verdict: document.verdict.map(|verdict| verdict.level),
            warnings,
            seconds: 0.0,
            error: None,
        },
        curves: curves(&done, &record.name),
        parameters: done
            .fit
            .best
            .parameters
            .get(..functions)
            .map(<[f64]>::to_vec),
    })
}

/// Starts the functions at other estimates of as many parameters.
fn start_from(model: &mut Model, from: Option<&[f64]>) {
    let mut start = model.problem.start();
    let functions = model.problem.functions.scalar_range().start;
    if let Some(from) = from.filter(|from| from.len() == functions) {
        start[..functions].copy_from_slice(from);
        model.problem.start_from(&start);
    }
}

/// The coefficients that vary, at equal distances.
fn curves(done: &CompletedFit, record: &str) -> Vec<Curve> {
    let all = done.curves(POINTS).into_iter();
    let all = all.map(|curve| Curve {
        record: record.to_owned(),
        function: curve.name,
        t: curve.t,
        value: curve.value,
        low: curve.low,
        high: curve.high,
    });
    all.collect()
}
