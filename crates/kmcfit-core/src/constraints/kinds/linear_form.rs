//! Affine forms of the parameters, and groups of rows built from them.

use super::ConstraintError;
use crate::constraints::{RowGroup, TOLERANCE};
use crate::rows::merge_columns;
use std::collections::HashMap;

/// Affine form `sum entries theta + constant`, valid on an interval of time.
#[derive(Debug, Clone)]
pub(super) struct LinearForm {
    pub entries: Vec<(usize, f64)>,
    pub constant: f64,
    /// Time at which time-dependent bounds are evaluated, s.
    pub time: f64,
    pub span: [f64; 2],
}

impl LinearForm {
    /// Adds `factor * other`.
    pub fn add(&mut self, factor: f64, other: &LinearForm) {
        self.constant += factor * other.constant;
        let scaled = other.entries.iter().map(|(j, a)| (*j, factor * a));
        self.entries.extend(scaled);
    }

    fn size(&self) -> f64 {
        let entries = self.entries.iter().map(|(_, a)| a.abs());
        entries.fold(self.constant.abs(), f64::max)
    }
}

/// A row to be created, with the tightest bounds of all equal forms.
struct PendingRow {
    entries: Vec<(usize, f64)>,
    limits: [f64; 2],
    span: [f64; 2],
}

/// Group of rows `lower <= form <= upper` with bounds that may depend on time. Forms without parameters are checked and
/// omitted; equal forms become one row.
pub(super) fn group(
    name: impl Into<String>,
    forms: &[LinearForm],
    bounds: impl Fn(f64) -> [f64; 2],
) -> Result<RowGroup, ConstraintError> {
    let mut rows: Vec<PendingRow> = Vec::new();
    let mut known: HashMap<Vec<(usize, u64)>, usize> = HashMap::new();
    let name = name.into();
    let broken = |time| ConstraintError::Broken {
        name: name.clone(),
        time,
    };
    for form in forms {
        let limits = bounds(form.time);
        let [lower, upper] = limits.map(|limit| limit - form.constant);
        let mut entries = form.entries.clone();
        merge_columns(&mut entries);
        entries.retain(|(_, a)| *a != 0.0);
        if entries.is_empty() {
            let slack = TOLERANCE * form.size().max(finite(limits));
            if lower > slack || upper < -slack {
                return Err(broken(form.time));
            }
            continue;
        }
        let key = entries.iter().map(|(j, a)| (*j, a.to_bits())).collect();
        let position = *known.entry(key).or_insert(rows.len());
        match rows.get_mut(position) {
            None => rows.push(PendingRow {
                entries,
                limits: [lower, upper],
                span: form.span,
            }),
            Some(row) => {
                row.limits = [row.limits[0].max(lower), row.limits[1].min(upper)];
                row.span = [row.span[0].min(form.span[0]), row.span[1].max(form.span[1])];
            }
        }
    }
    let mut group = RowGroup::new(name.clone());
    for row in rows {
        let PendingRow {
            entries,
            mut limits,
            span,
        } = row;
        if limits[0] > limits[1] {
            // Two rows of one equality differ by rounding, or contradict each other.
            if limits[0] - limits[1] > TOLERANCE * finite(limits) {
                return Err(broken(span[0]));
            }
            limits = [0.5 * (limits[0] + limits[1]); 2];
        }
        group.push(entries, limits, span);
    }
    Ok(group)
}

fn finite(limits: [f64; 2]) -> f64 {
    let sizes = limits.iter().map(|b| b.abs()).filter(|b| b.is_finite());
    sizes.fold(0.0, f64::max)
}
