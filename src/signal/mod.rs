//! stub
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondOrder {
    pub b: [f64; 3],
    pub a: [f64; 2],
}
pub fn zero_phase(_s: &[SecondOrder], x: &[f64]) -> Vec<f64> {
    x.to_vec()
}
pub fn zero_phase_transpose(_s: &[SecondOrder], x: &[f64]) -> Vec<f64> {
    x.to_vec()
}

pub struct Spectrum {
    f: f64,
}
impl Spectrum {
    pub fn of(_v: &[f64], _h: f64) -> Option<Self> {
        Some(Self { f: 1.0 })
    }
    pub fn dominant(&self) -> f64 {
        self.f
    }
}
