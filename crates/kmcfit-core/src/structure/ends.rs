//! Combinations of coordinates.

use crate::simd::Real;

/// How the elongation of an element, or the acceleration of an inertia, follows from the coordinates: `sum_k factor_k q_k`.
///
/// Indices below the number of coordinates are coordinates, those from there on are supports.
#[derive(Debug, Clone, PartialEq)]
pub struct Ends(Vec<(usize, f64)>);

impl Ends {
    /// Between a coordinate and the ground.
    pub fn ground(coordinate: usize) -> Self {
        Self(vec![(coordinate, 1.0)])
    }

    /// Between two coordinates: `q_from - q_to`.
    pub fn between(from: usize, to: usize) -> Self {
        Self::combination([(from, 1.0), (to, -1.0)])
    }

    /// Any combination, as for inclined or torsional members and consistent mass matrices; factors of the same coordinate are added.
    pub fn combination(entries: impl IntoIterator<Item = (usize, f64)>) -> Self {
        let mut sorted: Vec<(usize, f64)> = entries.into_iter().collect();
        sorted.sort_by_key(|(index, _)| *index);
        let mut merged: Vec<(usize, f64)> = Vec::with_capacity(sorted.len());
        for (index, factor) in sorted {
            match merged.last_mut() {
                Some((last, sum)) if *last == index => *sum += factor,
                _ => merged.push((index, factor)),
            }
        }
        merged.retain(|(_, factor)| *factor != 0.0);
        Self(merged)
    }

    /// Indices and factors, by index.
    pub fn entries(&self) -> &[(usize, f64)] {
        &self.0
    }

    /// The combination of the values `x` of all coordinates and supports.
    #[inline]
    pub(crate) fn across<T: Real>(&self, x: &[T]) -> T {
        let zero = x[0].like(0.0);
        let terms = self.0.iter().map(|(j, factor)| x[*j].scale(*factor));
        terms.fold(zero, |sum, term| sum + term)
    }

    /// Adds `force` times the factors to the coordinates among `out`, which supports are beyond.
    #[inline]
    pub(crate) fn spread<T: Real>(&self, force: T, out: &mut [T]) {
        for (j, factor) in &self.0 {
            if let Some(out) = out.get_mut(*j) {
                *out = *out + force.scale(*factor);
            }
        }
    }
}
