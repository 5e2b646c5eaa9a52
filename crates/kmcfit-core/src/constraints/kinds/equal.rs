//! Equality of one function and a multiple of another.

use super::linear_form::{LinearForm, group};
use super::sampling::value;
use super::{All, ConstraintError};
use crate::constraints::RowGroup;
use crate::functions::Basis;

/// Residual of a row after elimination, relative to its size, below which it depends on the previous rows.
const DEPENDENT: f64 = 1e-10;
/// Largest residual of the right-hand side of a dependent row, relative to its size.
const CONSISTENT: f64 = 1e-8;
/// Number of parameters up to which dependent rows are eliminated; nodal functions have none.
const MOST_PARAMETERS: usize = 400;

pub(super) fn build(
    all: &All<'_>,
    [a, b]: [usize; 2],
    ratio: f64,
) -> Result<RowGroup, ConstraintError> {
    let (first, second) = (all.list[a], all.list[b]);
    let name = match ratio {
        1.0 => format!("{} = {}", all.name(a), all.name(b)),
        _ => format!("{} = {ratio} {}", all.name(a), all.name(b)),
    };
    if first.basis == second.basis {
        return group(name, &by_parameter(all, [a, b], ratio), |_| [0.0, 0.0]);
    }
    let parts = [value(a, 1.0), value(b, -ratio)];
    let nodal = [first, second]
        .iter()
        .any(|f| f.basis == Some(Basis::Nodal));
    let forms = match nodal {
        // At the nodes only: equality everywhere would remove kinks at knots between nodes.
        true => at_nodes(all, [a, b], ratio),
        false => all.sum(&parts, &[]),
    };
    let all_rows = group(name, &forms, |_| [0.0, 0.0])?;
    match first.parameters() + second.parameters() <= MOST_PARAMETERS {
        true => independent(all_rows, all.functions.parameters()),
        false => Ok(all_rows),
    }
}

fn by_parameter(all: &All<'_>, [a, b]: [usize; 2], ratio: f64) -> Vec<LinearForm> {
    let ranges = all.functions.ranges();
    let knots = (all.list[a].basis.as_ref()).map_or(Vec::new(), |b| b.knot_times(all.grid));
    let ends = all.ends();
    let form = |(i, j): (usize, usize)| {
        let span = match knots.len() == ranges[a].len() {
            true => [knots[i - ranges[a].start]; 2],
            false => ends,
        };
        LinearForm {
            entries: vec![(i, 1.0), (j, -ratio)],
            constant: 0.0,
            time: span[0],
            span,
        }
    };
    let pairs = ranges[a].clone().zip(ranges[b].clone());
    pairs.map(form).collect()
}

fn at_nodes(all: &All<'_>, [a, b]: [usize; 2], ratio: f64) -> Vec<LinearForm> {
    let times = all.grid.times();
    let mut forms = all.forms(a, 0, &times);
    for (form, other) in forms.iter_mut().zip(all.forms(b, 0, &times)) {
        form.add(-ratio, &other);
    }
    forms
}

/// Independent equalities, by elimination with the most independent row first.
fn independent(group: RowGroup, parameters: usize) -> Result<RowGroup, ConstraintError> {
    let count = group.rows.len();
    let mut rest: Vec<Vec<f64>> = (0..count)
        .map(|i| {
            // The right-hand side follows the parameters.
            let mut row = vec![0.0; parameters + 1];
            group.rows.row(i).for_each(|(j, a)| row[j] = a);
            row[parameters] = group.upper[i];
            row
        })
        .collect();
    let norms = |rest: &[Vec<f64>]| -> Vec<f64> {
        let norm = |row: &Vec<f64>| row[..parameters].iter().map(|a| a * a).sum::<f64>().sqrt();
        rest.iter().map(norm).collect()
    };
    let first = norms(&rest);
    let largest = first.iter().copied().fold(0.0, f64::max);
    let mut left = first;
    let mut chosen = Vec::new();
    while let Some((pivot, norm)) =
        (left.iter().copied().enumerate()).max_by(|a, b| a.1.total_cmp(&b.1))
        && norm > DEPENDENT * largest
    {
        let unit: Vec<f64> = rest[pivot].iter().map(|a| a / norm).collect();
        for row in &mut rest {
            let along: f64 = unit[..parameters]
                .iter()
                .zip(&*row)
                .map(|(u, r)| u * r)
                .sum();
            row.iter_mut().zip(&unit).for_each(|(r, u)| *r -= along * u);
        }
        rest[pivot].fill(0.0);
        chosen.push(pivot);
        left = norms(&rest);
    }
    let right = group
        .upper
        .iter()
        .fold(largest, |most, b| most.max(b.abs()));
    if let Some(i) = rest
        .iter()
        .position(|row| row[parameters].abs() > CONSISTENT * right)
    {
        return Err(ConstraintError::Broken {
            name: group.name.clone(),
            time: group.times[i][0],
        });
    }
    chosen.sort_unstable();
    let mut kept = RowGroup::new(group.name.clone());
    for i in chosen {
        kept.push(group.rows.row(i), group.bounds(i), group.times[i]);
    }
    Ok(kept)
}
