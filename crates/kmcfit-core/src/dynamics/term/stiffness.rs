//! Linear stiffness, `phi = y`.

#[inline(always)]
pub fn phi(y: f64, _v: f64) -> f64 {
    y
}

#[inline(always)]
pub fn partials(_y: f64, _v: f64) -> (f64, f64) {
    (1.0, 0.0)
}
