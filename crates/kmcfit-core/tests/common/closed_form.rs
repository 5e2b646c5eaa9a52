//! Responses in closed form.

use kmcfit_core::system::State;

/// m = 1 - a t, c = 0, k = 1: `y = sqrt(x) [A J1(z) + B Y1(z)]`, `x = 1 - a t`, `z = 2 sqrt(x)/a`.
pub struct Bessel {
    pub rate: f64,
    pub a: f64,
    pub b: f64,
}

impl Bessel {
    /// y(0) = 3.3, v(0) = 1, a = 0.02.
    pub const PAPER: Self = Self {
        rate: 0.02,
        a: -43.2406529071,
        b: 1.75804247628,
    };

    pub fn mass(&self, t: f64) -> f64 {
        1.0 - self.rate * t
    }

    pub fn displacement(&self, t: f64) -> f64 {
        let root = self.mass(t).sqrt();
        let z = 2.0 * root / self.rate;
        root * (self.a * libm::j1(z) + self.b * libm::y1(z))
    }
}

/// Displacement and velocity at `t` of `m y'' + c y' + k y = 0`.
pub fn constant_coefficients((m, c, k): (f64, f64, f64), initial: State, t: f64) -> (f64, f64) {
    let (y0, v0) = (initial.displacement(0), initial.velocity(0));
    let decay = c / (2.0 * m);
    let discriminant = decay * decay - k / m;
    let envelope = (-decay * t).exp();
    // y = e^(-decay t) (y0 C(t) + (v0 + decay y0) S(t)) with C' = discriminant S, S' = C.
    let (cosine, sine) = if discriminant > 0.0 {
        let s = discriminant.sqrt();
        ((s * t).cosh(), (s * t).sinh() / s)
    } else if discriminant < 0.0 {
        let s = (-discriminant).sqrt();
        ((s * t).cos(), (s * t).sin() / s)
    } else {
        (1.0, t)
    };
    let push = v0 + decay * y0;
    let y = envelope * (y0 * cosine + push * sine);
    let v = envelope * (y0 * discriminant * sine + push * cosine) - decay * y;
    (y, v)
}
