//! Sparse symmetric LDL factorisation with iterative refinement, for the plain step.

use clarabel::algebra::CscMatrix;
use clarabel::qdldl::{QDLDLFactorisation, QDLDLSettingsBuilder};

/// Diagonal regularisation that makes the equilibrated matrix quasi-definite; refinement removes its effect.
const SHIFT: f64 = 1e-9;
/// Residual, relative to the right-hand side, at which refinement ends.
const RESIDUAL: f64 = 1e-13;
/// Largest number of refinement steps; each gains several digits.
const REFINEMENTS: usize = 20;
/// Rounds of equilibration.
const EQUILIBRATIONS: usize = 6;

/// A symmetric matrix, by its upper triangle, with the required signs of its pivots.
pub struct Symmetric {
    entries: Vec<(usize, usize, f64)>,
    signs: Vec<i8>,
}

impl Symmetric {
    /// The zero matrix whose pivots have these signs.
    pub fn new(signs: Vec<i8>) -> Self {
        Self {
            entries: Vec::new(),
            signs,
        }
    }

    /// Adds `value` at `(i, j)` and `(j, i)`.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.entries.push((i.min(j), i.max(j), value));
    }

    /// Solutions of `A x = b` for several right-hand sides, each with its residual relative to `b`; `None` if the factorisation fails.
    pub fn solve(mut self, sides: &[Vec<f64>]) -> Option<Vec<(Vec<f64>, f64)>> {
        let n = self.signs.len();
        let scale = self.equilibrate();
        let shifts = self.signs.iter().enumerate();
        let shifted = shifts.map(|(i, sign)| (i, i, SHIFT * f64::from(*sign)));
        let all: Vec<_> = self.entries.iter().copied().chain(shifted).collect();
        let triangle = upper_triangle(n, &all);
        let settings = QDLDLSettingsBuilder::default()
            .Dsigns(self.signs.clone())
            .build()
            .ok()?;
        let mut factor = QDLDLFactorisation::new(&triangle, Some(settings)).ok()?;
        let solution = |b: &Vec<f64>| {
            let right: Vec<f64> = b.iter().zip(&scale).map(|(b, s)| b * s).collect();
            let (mut x, residual) = self.refine(&mut factor, &right);
            x.iter_mut().zip(&scale).for_each(|(x, s)| *x *= s);
            x.iter().all(|x| x.is_finite()).then_some((x, residual))
        };
        sides.iter().map(solution).collect()
    }

    /// Solution of `A x = b` as a correction of `start`, with the smallest residual of the refinement; `None` if the factorisation fails.
    pub fn solve_from(self, start: &[f64], b: &[f64]) -> Option<Vec<f64>> {
        let side = self.residual(start, b);
        let (correction, _) = self.solve(&[side])?.pop()?;
        let sums = start.iter().zip(&correction);
        Some(sums.map(|(x, d)| x + d).collect())
    }

    /// Scales rows and columns symmetrically until their largest entries are near 1; returns the scales.
    ///
    /// Such scalings are not unique. This one starts from the diagonal, so that pivots keep their size relative to the regularisation, also with
    /// large entries in their rows.
    fn equilibrate(&mut self) -> Vec<f64> {
        let mut total = vec![1.0; self.signs.len()];
        self.rescale(&mut total, &self.scales_from_diagonal());
        for _ in 0..EQUILIBRATIONS {
            let mut largest = vec![0.0f64; total.len()];
            for &(i, j, a) in &self.entries {
                largest[i] = largest[i].max(a.abs());
                largest[j] = largest[j].max(a.abs());
            }
            let scale: Vec<f64> = largest
                .iter()
                .map(|&l| if l > 0.0 { 1.0 / l.sqrt() } else { 1.0 })
                .collect();
            self.rescale(&mut total, &scale);
        }
        total
    }

    /// Initial scales: 1 for nonzero negative pivots, then for each row the factor that scales its largest entry in scaled columns to 1.
    fn scales_from_diagonal(&self) -> Vec<f64> {
        let mut scales: Vec<Option<f64>> = vec![None; self.signs.len()];
        for &(i, j, a) in &self.entries {
            if i == j && a < 0.0 {
                scales[i] = Some(1.0 / (-a).sqrt());
            }
        }
        for _ in 0..2 {
            let mut largest = vec![0.0f64; scales.len()];
            for &(i, j, a) in &self.entries {
                if i == j {
                    largest[i] = largest[i].max(a.abs().sqrt());
                    continue;
                }
                for (i, j) in [(i, j), (j, i)] {
                    if let Some(scale) = scales[j] {
                        largest[i] = largest[i].max(a.abs() * scale);
                    }
                }
            }
            for (scale, largest) in scales.iter_mut().zip(&largest) {
                if scale.is_none() && *largest > 0.0 {
                    *scale = Some(1.0 / largest);
                }
            }
        }
        scales
            .into_iter()
            .map(|scale| scale.unwrap_or(1.0))
            .collect()
    }

    fn rescale(&mut self, total: &mut [f64], scale: &[f64]) {
        for (i, j, a) in &mut self.entries {
            *a *= scale[*i] * scale[*j];
        }
        total.iter_mut().zip(scale).for_each(|(t, s)| *t *= s);
    }

    /// Refinement by conjugate residuals (Eisenstat, Elman and Schultz 1983): a few eigenvalues of the size of the regularisation take as many
    /// steps, where plain refinement would gain little with each.
    fn refine(&self, factor: &mut QDLDLFactorisation<f64>, b: &[f64]) -> (Vec<f64>, f64) {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let add = |to: &mut Vec<f64>, factor: f64, from: &[f64]| {
            to.iter_mut().zip(from).for_each(|(t, f)| *t += factor * f);
        };
        let zeros = vec![0.0; b.len()];
        let reference = dot(b, b).sqrt().max(f64::MIN_POSITIVE);
        let (mut x, mut residual, mut left) = (zeros.clone(), b.to_vec(), 1.0);
        // Steps and their images `-A d`, orthogonal to each other.
        let mut known: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
        for _ in 0..REFINEMENTS {
            let mut step = residual.clone();
            factor.solve(&mut step);
            let mut image = self.residual(&step, &zeros);
            for (other, of_other) in &known {
                let share = -dot(&image, of_other) / dot(of_other, of_other);
                add(&mut step, share, other);
                add(&mut image, share, of_other);
            }
            let length = -dot(&residual, &image) / dot(&image, &image);
            let mut trial = x.clone();
            add(&mut trial, length, &step);
            let next = self.residual(&trial, b);
            let size = dot(&next, &next).sqrt() / reference;
            // False for NaN.
            if size < left {
                (x, residual, left) = (trial, next, size);
            } else {
                break;
            }
            if left <= RESIDUAL {
                break;
            }
            known.push((step, image));
        }
        (x, left)
    }

    fn residual(&self, x: &[f64], b: &[f64]) -> Vec<f64> {
        let mut r = b.to_vec();
        for &(i, j, a) in &self.entries {
            r[i] -= a * x[j];
            if i != j {
                r[j] -= a * x[i];
            }
        }
        r
    }
}

/// Compressed columns of the upper triangle; repeated entries are added.
fn upper_triangle(n: usize, entries: &[(usize, usize, f64)]) -> CscMatrix<f64> {
    let (mut rows, mut columns, mut values) = (
        Vec::with_capacity(entries.len()),
        Vec::with_capacity(entries.len()),
        Vec::with_capacity(entries.len()),
    );
    for &(i, j, a) in entries {
        rows.push(i);
        columns.push(j);
        values.push(a);
    }
    CscMatrix::new_from_triplets(n, n, rows, columns, values)
}
