//! Quadratic damping, `phi = |v| v`: drag. Its second derivative jumps at `v = 0`, its first does not.

#[inline(always)]
pub fn phi(_y: f64, v: f64) -> f64 {
    v.abs() * v
}

#[inline(always)]
pub fn partials(_y: f64, v: f64) -> (f64, f64) {
    (0.0, 2.0 * v.abs())
}
