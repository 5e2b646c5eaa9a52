//! Bounds of function values.

use super::linear_form::group;
use super::sampling::{nodal, value};
use super::{All, ConstraintError, TimeHistory};
use crate::constraints::RowGroup;

pub(super) fn build(
    all: &All<'_>,
    j: usize,
    min: Option<&TimeHistory>,
    max: Option<&TimeHistory>,
) -> Result<Vec<RowGroup>, ConstraintError> {
    let name = all.name(j);
    if let (Some(TimeHistory::Constant(min)), Some(TimeHistory::Constant(max))) = (min, max)
        && min == max
    {
        let forms = all.sum(&[value(j, 1.0)], &[]);
        return Ok(vec![group(format!("{name} = {min}"), &forms, |_| {
            [*min, *max]
        })?]);
    }
    let one = |limit: &TimeHistory, sign: &str, upper: bool| {
        let also = match limit {
            TimeHistory::Constant(_) => Vec::new(),
            TimeHistory::Nodal { values, .. } => all.breaks(values),
        };
        let forms = all.sum(&[value(j, 1.0)], &also);
        group(format!("{name} {sign} {limit}"), &forms, |t| {
            let limit = at(all, limit, t);
            match upper {
                true => [f64::NEG_INFINITY, limit],
                false => [limit, f64::INFINITY],
            }
        })
    };
    let min = min.map(|limit| one(limit, ">=", false));
    let max = max.map(|limit| one(limit, "<=", true));
    min.into_iter().chain(max).collect()
}

fn at(all: &All<'_>, limit: &TimeHistory, t: f64) -> f64 {
    match limit {
        TimeHistory::Constant(value) => *value,
        TimeHistory::Nodal { values, .. } => nodal(all.grid, values, 0, t),
    }
}
