//! Least squares in few variables by one triangular factor.

use super::Subproblem;
use crate::simd::tall_qr::{BLOCK_ROWS, RowBlock, Triangle};

/// Share of its length below which the rest of a column depends on the previous columns.
pub const INDEPENDENT: f64 = 1e-14;

/// Minimiser of `|F z - f|^2 + sum d z^2` subject to `E z = e` for one `f`, by reflecting all rows into a triangle; `None` if the variables
/// have an elimination order of several places, if an equality has more than one variable, or if the minimum is not unique.
pub fn minimise(sub: &Subproblem, target: &[f64]) -> Option<Vec<f64>> {
    let mut reduced = Reduced::new(sub, target)?;
    for (j, x) in reduced
        .free
        .iter()
        .zip(reduced.triangle.solve(INDEPENDENT)?)
    {
        reduced.z[*j] = x;
    }
    let z = reduced.z;
    z.iter().all(|z| z.is_finite()).then_some(z)
}

/// The cost of the variables that no equality holds, as a triangle.
pub struct Reduced {
    /// Held variables; NaN for the free ones.
    pub z: Vec<f64>,
    /// The free variables in order.
    pub free: Vec<usize>,
    /// `|R x - b|^2` of the free variables `x` is the cost but for a constant.
    pub triangle: Triangle,
}

impl Reduced {
    /// `None` if the variables have an elimination order of several places, or if an equality has more than one variable.
    pub fn new(sub: &Subproblem, target: &[f64]) -> Option<Self> {
        let at_once = sub.elimination_order.len() == sub.variables
            && sub.elimination_order.iter().all(|s| *s == 0);
        at_once.then_some(())?;
        let mut z = vec![f64::NAN; sub.variables];
        for i in 0..sub.equalities.len() {
            let mut entries = sub.equalities.row(i).filter(|(_, a)| *a != 0.0);
            let (Some((j, a)), None) = (entries.next(), entries.next()) else {
                return None;
            };
            let value = sub.equalities.right()[i] / a;
            if !z[j].is_nan() && z[j] != value {
                return None;
            }
            z[j] = value;
        }
        let free: Vec<usize> = (0..sub.variables).filter(|j| z[*j].is_nan()).collect();
        let triangle = triangle(sub, target, &z, &free);
        Some(Self { z, free, triangle })
    }
}

/// The rows of the residuals and of the proximal terms in the `free` variables, with the others at `z`.
fn triangle(sub: &Subproblem, target: &[f64], z: &[f64], free: &[usize]) -> Triangle {
    let mut positions = vec![None; sub.variables];
    for (position, j) in free.iter().enumerate() {
        positions[*j] = Some(position);
    }

    // Largest rows first, which preserves the digits of much smaller ones.
    let count = sub.residuals.len();
    let size = |i: &usize| -> f64 {
        match free.get(i.wrapping_sub(count)) {
            Some(j) => sub.proximal[*j].sqrt(),
            None => sub
                .residuals
                .row(*i)
                .fold(0.0, |most, (_, a)| most.max(a.abs())),
        }
    };
    let proximal = (count..).zip(free).filter(|(_, j)| sub.proximal[**j] > 0.0);
    let rows = (0..count).chain(proximal.map(|(i, _)| i));
    let mut rows: Vec<(f64, usize)> = rows.map(|i| (size(&i), i)).collect();
    rows.sort_by(|(a, _), (b, _)| b.total_cmp(a));

    let mut triangle = Triangle::new(free.len());
    let mut block = RowBlock::new(free.len());
    let mut right = [0.0; BLOCK_ROWS];
    for part in rows.chunks(BLOCK_ROWS) {
        block.clear();
        block.count = part.len();
        for (r, &(size, i)) in part.iter().enumerate() {
            right[r] = 0.0;
            if i >= count {
                block.column_mut(i - count)[r] = size;
                continue;
            }
            right[r] = target[i];
            for (j, a) in sub.residuals.row(i) {
                match positions[j] {
                    Some(position) => block.column_mut(position)[r] = a,
                    None => right[r] -= a * z[j],
                }
            }
        }
        triangle.add(&mut block, &right[..part.len()]);
    }
    triangle
}
