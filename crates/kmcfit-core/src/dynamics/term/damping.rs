//! Viscous damping, `phi = v`.

#[inline(always)]
pub fn phi(_y: f64, v: f64) -> f64 {
    v
}

#[inline(always)]
pub fn partials(_y: f64, _v: f64) -> (f64, f64) {
    (0.0, 1.0)
}
