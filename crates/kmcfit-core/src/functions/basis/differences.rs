//! Divided differences of values at unequal spacings: roughness of functions without square-integrable derivative.

use crate::rows::Rows;

/// Rows `sqrt(h) (p_{j+1} - p_j) / h` for values with the spacings `h` (s).
pub(super) fn first(spacings: &[f64]) -> Rows {
    let mut rows = Rows::of_width(spacings.len() + 1);
    for (j, h) in spacings.iter().enumerate() {
        let factor = 1.0 / h.sqrt();
        rows.push([(j, -factor), (j + 1, factor)], 0.0);
    }
    rows
}

/// Rows `sqrt(h) ((p_{j+1} - p_j) / h_after - (p_j - p_{j-1}) / h_before) / h`, `h` the mean of the
/// spacings before and after (s).
pub(super) fn second(spacings: &[f64]) -> Rows {
    let mut rows = Rows::of_width(spacings.len() + 1);
    for (j, pair) in spacings.windows(2).enumerate() {
        let factor = 1.0 / (0.5 * (pair[0] + pair[1])).sqrt();
        let (before, after) = (factor / pair[0], factor / pair[1]);
        rows.push(
            [(j, before), (j + 1, -(before + after)), (j + 2, after)],
            0.0,
        );
    }
    rows
}
