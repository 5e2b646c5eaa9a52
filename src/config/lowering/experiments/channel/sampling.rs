//! Sampling of a channel: equal spacing, decimation, and the band-pass filter.

use super::super::column_samples;
use crate::config::lowering::ModelKey;
use crate::error::InputError;
use kmcfit_core::model::ExperimentSpec;
use kmcfit_core::number_format::count;
use kmcfit_core::signal::{SecondOrder, band_pass, even_spacing, high_pass, low_pass};

/// Order of the filter of a band, run forward and backward.
const BAND_ORDER: usize = 2;

/// Keeps every `factor`-th sample after a low-pass filter.
pub(super) fn decimate(
    at: &ModelKey<'_>,
    factor: usize,
    source: &mut column_samples::ColumnSamples,
    ignored: &mut Vec<(usize, String)>,
) -> Result<(), InputError> {
    let at = at.below("decimate");
    if factor == 0 {
        return Err(at
            .error("the decimation factor must not be 0")
            .found(factor)
            .expected("an integer, 1 or more"));
    }
    let whole = source.values.iter().all(|v| !v.is_nan());
    if !whole || source.times.len() < 2 || even_spacing(&source.times).is_none() {
        return Err(at
            .error("decimation needs equally spaced samples without gaps")
            .found(match whole {
                true => "times that are not equally spaced",
                false => "missing samples",
            })
            .expected("no `decimate`, or a window without gaps"));
    }
    let before = source.values.len();
    source.values = kmcfit_core::signal::decimate(&source.values, factor);
    source.times = source.times.iter().copied().step_by(factor).collect();
    if let Some(beside) = &mut source.beside {
        *beside = beside.iter().copied().step_by(factor).collect();
    }
    let dropped = before - source.values.len();
    if dropped > 0 {
        ignored.push((dropped, format!("removed by decimation by {factor}")));
    }
    Ok(())
}

/// The filter of the band.
pub(super) fn band(
    at: &ModelKey<'_>,
    spec: &ExperimentSpec,
    spacing: Option<f64>,
    missing: usize,
) -> Result<Vec<SecondOrder>, InputError> {
    let Some(band) = &spec.band else {
        return Ok(Vec::new());
    };
    let at = at.below("band");
    let Some(spacing) = spacing else {
        return Err(at
            .error("filtering needs equally spaced samples without gaps")
            .found(match missing {
                0 => "times that are not equally spaced".to_owned(),
                some => count(some, "missing sample"),
            })
            .expected("no `band`, or a window without gaps"));
    };
    let rate = 1.0 / spacing;
    let (low, high) = (band.min, band.max);
    let sections = match (low, high) {
        (Some(low), Some(high)) => band_pass(BAND_ORDER, low, high, rate),
        (Some(low), None) => high_pass(BAND_ORDER, low, rate),
        (None, Some(high)) => low_pass(BAND_ORDER, high, rate),
        (None, None) => None,
    };
    sections.ok_or_else(|| {
        let end = |f: Option<f64>| f.map_or("open".to_owned(), |f| format!("{f} Hz"));
        at.error("invalid frequency band")
            .found(format!("{} to {}", end(low), end(high)))
            .expected(format!(
                "`min`, `max` or both, with 0 < min < max < {} Hz, half the sampling rate",
                0.5 * rate
            ))
    })
}
