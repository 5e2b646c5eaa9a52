//! Upper bound of the damping ratio, as second-order cones.

use super::All;
use super::linear_form::LinearForm;
use super::sampling::value;
use crate::constraints::{Cone, ConeGroup, Rows};

pub(super) fn build(all: &All<'_>, [m, c, k]: [usize; 3], zeta: f64) -> ConeGroup {
    let s = balance(all, m, k);
    let parts = [value(m, s), value(c, 1.0 / zeta), value(k, 1.0 / s)];
    let each = all.each(&parts);
    let samples = each[0].iter().zip(&each[1]).zip(&each[2]);
    let mut cones = Vec::new();
    let mut times = Vec::new();
    for ((m, c), k) in samples {
        let cone = cone(m, c, k);
        // At a time without a jump both sides give the same cone.
        if cones.last() != Some(&cone) {
            cones.push(cone);
            times.push(m.time);
        }
    }
    ConeGroup {
        name: format!("damping ratio <= {zeta}"),
        cones,
        times,
    }
}

fn cone(m: &LinearForm, c: &LinearForm, k: &LinearForm) -> Cone {
    let mut sum = m.clone();
    sum.add(1.0, k);
    let mut difference = m.clone();
    difference.add(-1.0, k);
    let mut rows = Rows::new();
    for form in [&sum, c, &difference] {
        rows.push(form.entries.iter().copied(), -form.constant);
    }
    Cone { rows }
}

/// Power of two nearest to `sqrt(k/m)`, from the largest values at the start.
fn balance(all: &All<'_>, m: usize, k: usize) -> f64 {
    let start = all.functions.nodal(&all.functions.start());
    let sizes: Vec<f64> = (start.functions())
        .map(|f| f.iter().fold(0.0f64, |most, p| most.max(p.abs())))
        .collect();
    let exponent = (0.5 * (sizes[k] / sizes[m]).log2()).round();
    match exponent.is_finite() {
        true => exponent.exp2(),
        false => 1.0,
    }
}
