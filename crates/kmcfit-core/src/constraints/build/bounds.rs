//! Smallest and largest values.

use super::form::group;
use super::sampling::{nodal, value};
use super::{All, Impossible, Limit};
use crate::constraints::RowGroup;

pub(super) fn build(
    all: &All<'_>,
    j: usize,
    min: Option<&Limit>,
    max: Option<&Limit>,
) -> Result<Vec<RowGroup>, Impossible> {
    let name = all.name(j);
    if let (Some(Limit::Number(min)), Some(Limit::Number(max))) = (min, max)
        && min == max
    {
        let forms = all.sum(&[value(j, 1.0)], &[]);
        return Ok(vec![group(format!("{name} = {min}"), &forms, |_| {
            [*min, *max]
        })?]);
    }
    let one = |limit: &Limit, sign: &str, upper: bool| {
        let also = match limit {
            Limit::Number(_) => Vec::new(),
            Limit::Nodal { values, .. } => all.breaks(values),
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

fn at(all: &All<'_>, limit: &Limit, t: f64) -> f64 {
    match limit {
        Limit::Number(value) => *value,
        Limit::Nodal { values, .. } => nodal(all.grid, values, 0, t),
    }
}
