//! Cubic stiffness, `phi = y^3`.

#[inline(always)]
pub fn phi(y: f64, _v: f64) -> f64 {
    y * y * y
}

#[inline(always)]
pub fn partials(y: f64, _v: f64) -> (f64, f64) {
    (3.0 * y * y, 0.0)
}
