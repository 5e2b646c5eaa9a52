//! Scaled directions in parameter space, along which predictions are differentiated.

use crate::objective::Evaluation;
use crate::problem::Problem;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Directions `d_k` of the parameters, `theta = sum_k z_k d_k`, scaled so that `z` is dimensionless.
///
/// With sizes `P_j` of the functions ([`Problem::natural_scales`]) each direction has unit length in the metric
/// `sum_j 1/T integral (delta p_j / P_j)^2 dt + sum_s (delta x_s / size_s)^2`: one unit of `z_k` is a root-mean-square
/// change over the record by 100 % of the natural size. A singular value is therefore the response of all samples, in
/// standard deviations, to such a change, independent of the basis.
///
/// There is one direction per parameter. For problems with too many parameters, hat functions over groups of neighbouring
/// parameters replace them; results then apply to changes that are smooth on the scale of the hats.
#[derive(Debug, Clone)]
pub struct Directions {
    columns: Vec<Vec<(usize, f64)>>,
    /// Directions that change each parameter, and by how much.
    of_parameter: Vec<Vec<(usize, f64)>>,
    metric: Vec<f64>,
    /// Cholesky factor of the inner products of hats; `None` for one direction per parameter, which are orthonormal.
    gram: Option<Cholesky<f64, Dyn>>,
}

impl Directions {
    /// One direction per parameter for at most `most` parameters, otherwise hats, about `coarse` directions in all.
    pub fn new(problem: &Problem, evaluation: &Evaluation, most: usize, coarse: usize) -> Self {
        let sizes = problem.natural_scales(evaluation);
        let duration = problem.system.grid.duration();
        let metric = problem.functions.relative_metric(&sizes, duration);
        let unit = |j: usize| vec![(j, 1.0 / metric[j].sqrt())];
        let parameters = problem.parameters();
        if parameters <= most {
            let columns = (0..parameters).map(unit).collect();
            return Self::of_columns(columns, metric);
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
        let mut directions = Self::of_columns(columns, metric);
        directions.gram = directions.inner_products();
        directions
    }

    fn of_columns(columns: Vec<Vec<(usize, f64)>>, metric: Vec<f64>) -> Self {
        let mut of_parameter = vec![Vec::new(); metric.len()];
        for (k, column) in columns.iter().enumerate() {
            column
                .iter()
                .for_each(|(j, d)| of_parameter[*j].push((k, *d)));
        }
        Self {
            columns,
            of_parameter,
            metric,
            gram: None,
        }
    }

    /// Cholesky factor of the inner products of the hats; of the identity where the square of a function's size overflows.
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

    /// True without directions.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// True if there are fewer directions than parameters.
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

    /// Jacobian along the directions, from the Jacobian with respect to the parameters; for one direction per parameter.
    pub(super) fn of_jacobian(&self, mut jacobian: DMatrix<f64>) -> DMatrix<f64> {
        for (mut column, direction) in jacobian.column_iter_mut().zip(&self.columns) {
            direction.iter().for_each(|(_, d)| column *= *d);
        }
        jacobian
    }

    /// Change of the parameters for coordinates `z`.
    pub fn to_parameters(&self, z: &[f64]) -> Vec<f64> {
        let mut theta = vec![0.0; self.parameters()];
        for (column, z) in self.columns.iter().zip(z) {
            column.iter().for_each(|(j, d)| theta[*j] += d * z);
        }
        theta
    }

    /// Coordinates `z` of the combination of directions nearest to a change of the parameters, in the metric of the directions.
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

    /// Linear functional of the parameters, given by its slopes, in the coordinates `z`.
    pub fn functional(&self, slopes: &[f64]) -> Vec<f64> {
        let of = |column: &Vec<(usize, f64)>| column.iter().map(|(j, d)| d * slopes[*j]).sum();
        self.columns.iter().map(of).collect()
    }

    /// Sparse linear functional of the parameters in the coordinates `z`, each once in ascending order.
    pub(super) fn slope(
        &self,
        entries: impl IntoIterator<Item = (usize, f64)>,
    ) -> Vec<(usize, f64)> {
        let of = |(j, a): (usize, f64)| self.of_parameter[j].iter().map(move |(k, d)| (*k, a * d));
        let mut all: Vec<(usize, f64)> = entries.into_iter().flat_map(of).collect();
        all.sort_by_key(|(k, _)| *k);
        all.dedup_by(|next, kept| {
            let is_same = next.0 == kept.0;
            kept.1 += if is_same { next.1 } else { 0.0 };
            is_same
        });
        all
    }

    /// [`Directions::slope`] with the zeros.
    pub(super) fn row(&self, entries: impl IntoIterator<Item = (usize, f64)>) -> Vec<f64> {
        let mut row = vec![0.0; self.len()];
        self.slope(entries).iter().for_each(|(k, x)| row[*k] = *x);
        row
    }
}

/// Smallest number of hats per function.
const FEWEST_HATS: usize = 8;

/// `count` hats over `parameters` neighbouring parameters, as pairs of index and height.
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
    use crate::builder::{Builder, Record};
    use crate::model::CoefficientSpec;

    /// A problem with nodal functions coarsened to hats, a constant and an estimated initial state.
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
    fn hats_have_unit_length_and_the_requested_number() {
        let (problem, directions) = coarse();
        assert!(directions.is_coarse() && !directions.is_empty());
        // Three functions share the 33 directions: eleven hats for each nodal function, and the constant by itself.
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
    fn a_combination_of_hats_is_its_own_nearest_combination() {
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

    /// Smooth functions are combinations of hats; others have a nearest combination.
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
        // The difference from the nearest combination is orthogonal to every hat.
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
