//! The directions of the parameters along which predictions are differentiated.

use crate::objective::Evaluation;
use crate::problem::Problem;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Directions `d_k` of the parameters, `theta = sum_k z_k d_k`, scaled so that `z` has no unit.
///
/// With sizes `P_j` of the functions ([`Problem::natural_scales`]) each direction has length one in
/// `sum_j 1/T integral (delta p_j / P_j)^2 dt + sum_s (delta x_s / size_s)^2`: one unit of `z_k` is a
/// change by 100 % of the natural size, root mean square over the record. So a singular value says by
/// how many standard deviations all samples together answer to such a change, whatever the basis.
///
/// There is one direction per parameter, or, where these would be too many, hat functions over groups
/// of neighbouring parameters: a coarser set of smooth directions. What is said of those holds for
/// changes that are smooth on their scale; rougher ones are not looked at.
#[derive(Debug, Clone)]
pub struct Directions {
    columns: Vec<Vec<(usize, f64)>>,
    metric: Vec<f64>,
    /// Of the inner products of hats; `None` for one direction per parameter, which are orthonormal.
    gram: Option<Cholesky<f64, Dyn>>,
}

impl Directions {
    /// One direction per parameter if there are at most `most`, else hats: so many that there are
    /// about `coarse` directions in all.
    pub fn new(problem: &Problem, evaluation: &Evaluation, most: usize, coarse: usize) -> Self {
        let sizes = problem.natural_scales(evaluation);
        let duration = problem.system.grid.duration();
        let metric = problem.functions.relative_metric(&sizes, duration);
        let unit = |j: usize| vec![(j, 1.0 / metric[j].sqrt())];
        let parameters = problem.parameters();
        if parameters <= most {
            let columns = (0..parameters).map(unit).collect();
            return Self {
                columns,
                metric,
                gram: None,
            };
        }
        let ranges = problem.functions.ranges();
        let free = ranges.iter().filter(|r| !r.is_empty()).count();
        let each = (coarse / free.max(1)).max(FEWEST_HATS);
        let mut columns = Vec::new();
        for range in ranges {
            if range.len() <= each {
                columns.extend(range.clone().map(unit));
                continue;
            }
            for hat in hats(range.len(), each) {
                let squares = hat.iter().map(|(j, h)| metric[range.start + j] * h * h);
                let norm = squares.sum::<f64>().sqrt();
                columns.push((hat.iter().map(|(j, h)| (range.start + j, h / norm))).collect());
            }
        }
        columns.extend(problem.functions.scalar_range().map(unit));
        let mut directions = Self {
            columns,
            metric,
            gram: None,
        };
        directions.gram = directions.inner_products();
        directions
    }

    /// The factor of the inner products of the hats, which are independent; that of 1 where the square of a function's size
    /// overflows and nothing can be told of them.
    fn inner_products(&self) -> Option<Cholesky<f64, Dyn>> {
        let n = self.len();
        let mut gram = DMatrix::zeros(n, n);
        for k in 0..n {
            let weighted = self.column(k).into_iter().zip(&self.metric);
            let weighted: Vec<f64> = weighted.map(|(d, m)| d * m).collect();
            gram.set_column(k, &DVector::from_vec(self.functional(&weighted)));
        }
        gram.cholesky()
            .or_else(|| DMatrix::identity(n, n).cholesky())
    }

    /// Number of directions.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// Whether they are fewer than the parameters.
    pub fn is_coarse(&self) -> bool {
        self.gram.is_some()
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.metric.len()
    }

    /// Direction `k` as a change of all parameters.
    pub fn column(&self, k: usize) -> Vec<f64> {
        let mut theta = vec![0.0; self.parameters()];
        self.columns[k].iter().for_each(|(j, d)| theta[*j] = *d);
        theta
    }

    /// A Jacobian with respect to the parameters along the directions, of which there is one for each parameter.
    pub(super) fn of_jacobian(&self, mut jacobian: DMatrix<f64>) -> DMatrix<f64> {
        for (mut column, direction) in jacobian.column_iter_mut().zip(&self.columns) {
            direction.iter().for_each(|(_, d)| column *= *d);
        }
        jacobian
    }

    /// The change of the parameters that `z` stands for.
    pub fn to_parameters(&self, z: &[f64]) -> Vec<f64> {
        let mut theta = vec![0.0; self.parameters()];
        for (column, z) in self.columns.iter().zip(z) {
            column.iter().for_each(|(j, d)| theta[*j] += d * z);
        }
        theta
    }

    /// The `z` that comes nearest to a change of the parameters, in the length that the directions
    /// are scaled by.
    pub fn nearest(&self, theta: &[f64]) -> Vec<f64> {
        let weighted: Vec<f64> = (theta.iter().zip(&self.metric))
            .map(|(t, m)| t * m)
            .collect();
        let dual = self.functional(&weighted);
        let Some(factor) = &self.gram else {
            return dual;
        };
        factor.solve(&DVector::from_vec(dual)).as_slice().to_vec()
    }

    /// A linear function of the parameters, given by its slopes, as one of `z`.
    pub fn functional(&self, slopes: &[f64]) -> Vec<f64> {
        let of = |column: &Vec<(usize, f64)>| column.iter().map(|(j, d)| d * slopes[*j]).sum();
        self.columns.iter().map(of).collect()
    }

    /// A linear function of the parameters with few slopes, as one of `z`.
    pub(super) fn row(&self, entries: impl Iterator<Item = (usize, f64)>) -> Vec<f64> {
        let mut slopes = vec![0.0; self.parameters()];
        entries.for_each(|(j, a)| slopes[j] += a);
        self.functional(&slopes)
    }
}

/// Fewest hats that a function is coarsened to.
const FEWEST_HATS: usize = 8;

/// `count` hats over `parameters` neighbouring parameters: where each is not zero, and its height.
fn hats(parameters: usize, count: usize) -> Vec<Vec<(usize, f64)>> {
    let spacing = (parameters - 1) as f64 / (count - 1) as f64;
    let hat = |k: usize| {
        let centre = k as f64 * spacing;
        let height = |j: usize| 1.0 - (j as f64 - centre).abs() / spacing;
        let entries = (0..parameters).map(|j| (j, height(j)));
        entries.filter(|(_, h)| *h > 1e-12).collect()
    };
    (0..count).map(hat).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::{Builder, CoefficientSpec, Record};

    /// One value a node, on so many that hats stand for them, a constant beside them, and a state that is estimated.
    fn coarse() -> (Problem, Directions) {
        let times: Vec<f64> = (0..=200).map(|i| 0.05 * f64::from(i)).collect();
        let samples: Vec<f64> = times.iter().map(|t| (1.1 * t).cos()).collect();
        let record = Record::new("decay").displacement(&times, &samples);
        let parts = [
            CoefficientSpec::nodal(1.0),
            CoefficientSpec::constant(0.1),
            CoefficientSpec::nodal(1.2),
        ];
        let problem = Builder::new(parts).record(record).build().unwrap();
        let evaluation = problem.evaluate(&problem.start()).unwrap();
        let directions = Directions::new(&problem, &evaluation, 100, 33);
        (problem, directions)
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-11 * a.abs().max(b.abs()).max(1.0)
    }

    #[test]
    fn hats_are_of_length_one_and_as_many_as_are_asked_for() {
        let (problem, directions) = coarse();
        assert!(directions.is_coarse() && !directions.is_empty());
        // Three functions share the 33: eleven hats for each of many values, and the constant by itself.
        let scalars = problem.functions.scalars().len();
        assert_eq!(directions.len(), 11 + 1 + 11 + scalars);
        assert_eq!(directions.parameters(), problem.parameters());
        for k in 0..directions.len() {
            let column = directions.column(k).into_iter().zip(&directions.metric);
            let square: f64 = column.map(|(d, m)| m * d * d).sum();
            assert!(near(square, 1.0), "{k}: {square}");
        }
    }

    #[test]
    fn what_hats_hold_comes_back() {
        let (_, directions) = coarse();
        let z: Vec<f64> = (0..directions.len())
            .map(|k| (1.7 * k as f64).sin())
            .collect();
        let theta = directions.to_parameters(&z);
        for (back, z) in directions.nearest(&theta).iter().zip(&z) {
            assert!(near(*back, *z), "{back} {z}");
        }
        let slopes: Vec<f64> = (0..theta.len()).map(|j| (0.3 * j as f64).cos()).collect();
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let functional = directions.functional(&slopes);
        assert!(near(product(&functional, &z), product(&slopes, &theta)));
        let row = directions.row(slopes.iter().copied().enumerate());
        assert_eq!(row, functional);
    }

    /// What is smooth on the scale of the hats is one of their sums, what is rough has a nearest one.
    #[test]
    fn constants_and_lines_are_sums_of_hats() {
        let (problem, directions) = coarse();
        let range = problem.functions.ranges()[0].clone();
        let mut theta = vec![0.0; problem.parameters()];
        for j in range.clone() {
            theta[j] = 2.0 - 0.004 * j as f64;
        }
        let nearest = directions.to_parameters(&directions.nearest(&theta));
        for (there, theta) in nearest.iter().zip(&theta) {
            assert!((there - theta).abs() < 1e-10, "{there} {theta}");
        }
        // The residual of the nearest one is orthogonal to every hat.
        for j in range {
            theta[j] = if j % 3 == 0 { 1.0 } else { 0.0 };
        }
        let nearest = directions.to_parameters(&directions.nearest(&theta));
        let pairs = theta.iter().zip(&nearest).zip(&directions.metric);
        let residual: Vec<f64> = pairs.map(|((t, n), m)| m * (t - n)).collect();
        assert!(residual.iter().any(|r| r.abs() > 1e-6));
        let most =
            (directions.functional(&residual).into_iter()).fold(0.0f64, |m, x| m.max(x.abs()));
        assert!(most < 1e-12, "{most}");
    }
}
