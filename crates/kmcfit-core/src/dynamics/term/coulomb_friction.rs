//! Coulomb friction, smoothed: `phi = v / sqrt(v^2 + width^2)`.
//!
//! Differs from the sign of `v` by `width^2 / (2 v^2)` at speeds well above the width. A square root,
//! unlike a hyperbolic tangent, is the same to the last bit on every machine.

#[inline(always)]
pub fn phi(_y: f64, v: f64, width: f64) -> f64 {
    v / (v * v + width * width).sqrt()
}

#[inline(always)]
pub fn partials(_y: f64, v: f64, width: f64) -> (f64, f64) {
    let square = v * v + width * width;
    (0.0, width * width / (square * square.sqrt()))
}
