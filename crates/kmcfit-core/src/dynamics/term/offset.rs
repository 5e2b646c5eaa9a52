//! Constant offset, `phi = 1`: a force that does not depend on the motion.

#[inline(always)]
pub fn phi(_y: f64, _v: f64) -> f64 {
    1.0
}

#[inline(always)]
pub fn partials(_y: f64, _v: f64) -> (f64, f64) {
    (0.0, 0.0)
}
