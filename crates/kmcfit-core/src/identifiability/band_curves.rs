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
        let at = |values: &dyn Fn(usize) -> f64, t: f64| {
            let next = known.partition_point(|k| *k < t).min(known.len() - 1);
            let before = next.saturating_sub(1);
            match known[next] - known[before] {
                run if known[next] > t && run > 0.0 => {
                    let share = (t - known[before]) / run;
                    values(before) + share * (values(next) - values(before))
                }
                _ => values(next),
            }
        };
        let side = |band: &Band, side: usize| -> Vec<f64> {
            let value = |i: usize| band.pointwise(i)[side];
            times.iter().map(|t| at(&value, *t)).collect()
        };
        list.iter()
            .map(|band| [side(band, 0), side(band, 1)])
            .collect()
    }
}
