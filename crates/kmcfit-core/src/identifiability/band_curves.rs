//! Bands interpolated to given times.

use super::band::Band;
use super::bands::Bands;

impl Bands {
    /// Lower and upper ends of the 95 % bands in `list` at `times` (s), interpolated linearly.
    pub fn curves(&self, list: &[Band], times: &[f64]) -> Vec<[Vec<f64>; 2]> {
        let known = &self.times;
        if known.is_empty() {
            return Vec::new();
        }
        let places = times.iter().map(|t| {
            let next = known.partition_point(|k| k < t).min(known.len() - 1);
            let before = next.saturating_sub(1);
            match known[next] - known[before] {
                run if known[next] > *t && run > 0.0 => (next, (t - known[before]) / run),
                _ => (next, 1.0),
            }
        });
        let places: Vec<(usize, f64)> = places.collect();
        let side = |values: &[f64]| -> Vec<f64> {
            let at = |(next, share): &(usize, f64)| match *share < 1.0 {
                true => {
                    let before = values[next - 1];
                    before + share * (values[*next] - before)
                }
                false => values[*next],
            };
            places.iter().map(at).collect()
        };
        let curves = list.iter().map(|band| {
            let ends = (0..known.len()).map(|i| band.pointwise(i));
            let (low, high): (Vec<f64>, Vec<f64>) = ends.map(|[l, h]| (l, h)).unzip();
            [side(&low), side(&high)]
        });
        curves.collect()
    }
}
