//! Confidence band of one function or ratio over time.

use super::quantity::Quantity;

/// Confidence band of one function or ratio over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// `mass`, ..., `k/m`, `c/m`, `natural frequency`, `damping ratio`.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Values at the times of [`Bands::times`](super::Bands::times); NaN where a frequency or damping ratio is undefined, as
    /// reported in a note.
    pub points: Vec<Quantity>,
    /// Notes on the band.
    pub notes: Vec<String>,
}

impl Band {
    /// The values.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        self.points.iter().map(|point| point.value)
    }

    /// Lower and upper ends of the pointwise 95 % band at `times` (s), interpolated linearly between `known` ones, those of the points.
    pub fn curves(&self, known: &[f64], times: &[f64]) -> [Vec<f64>; 2] {
        let ends: Vec<[f64; 2]> = (self.points.iter())
            .map(|point| point.ends(point.half_width()))
            .collect();
        let at = |t: &f64| {
            let next = known.partition_point(|k| k < t).min(known.len() - 1);
            let before = next.saturating_sub(1);
            let share = match known[next] - known[before] {
                run if known[next] > *t && run > 0.0 => (t - known[before]) / run,
                _ => 1.0,
            };
            [0, 1].map(|side| match share < 1.0 {
                true => {
                    let from = ends[before][side];
                    from + share * (ends[next][side] - from)
                }
                false => ends[next][side],
            })
        };
        times
            .iter()
            .map(at)
            .map(|[low, high]| (low, high))
            .unzip()
            .into()
    }
}
