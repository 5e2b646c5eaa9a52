//! Curves over time, linearised in the parameters: functions, and ratios of functions by the delta method.

use nalgebra::DMatrix;

/// A curve over time, linearised in the parameters.
pub(super) struct LinearisedCurve {
    /// Products with the columns of the covariance root, with all active rows fixed, and with only the equalities fixed; a single one where no
    /// bound is active.
    pub roots: Vec<DMatrix<f64>>,
    /// Slopes in undetermined directions, in the same cases.
    pub hidden: Vec<DMatrix<f64>>,
    /// Norm of the full slope.
    pub sizes: Vec<f64>,
    /// Error of the basis, which the standard errors include.
    pub basis_error: Vec<f64>,
}

impl LinearisedCurve {
    /// Norms of the rows of `roots` and of `hidden`, in one of the cases.
    pub fn norms(&self, case: usize) -> [Vec<f64>; 2] {
        [&self.roots[case], &self.hidden[case]].map(|matrix| {
            let mut squares = vec![0.0; matrix.nrows()];
            for column in matrix.column_iter() {
                for (sum, x) in squares.iter_mut().zip(column.iter()) {
                    *sum += x * x;
                }
            }
            squares.iter().map(|x| x.sqrt()).collect()
        })
    }
}

/// Linear combination `sum_f slope_f(t) p_f(t)`, with the slopes of all functions at each node after one another.
pub(super) fn combine(
    linearised: &[LinearisedCurve],
    functions: &[usize],
    slopes: &[f64],
) -> LinearisedCurve {
    let at_nodes = || slopes.chunks_exact(functions.len());
    let cases = 0..linearised[functions[0]].roots.len();
    let sum = |of: &dyn Fn(&LinearisedCurve) -> &DMatrix<f64>| {
        let first = of(&linearised[functions[0]]);
        let mut all = DMatrix::zeros(first.nrows(), first.ncols());
        for (p, f) in functions.iter().enumerate() {
            let columns = of(&linearised[*f]).column_iter();
            for (mut sum, part) in all.column_iter_mut().zip(columns) {
                for ((sum, x), slopes) in sum.iter_mut().zip(part.iter()).zip(at_nodes()) {
                    *sum += slopes[p] * x;
                }
            }
        }
        all
    };
    let size = |(i, slopes): (usize, &[f64])| {
        let each = functions.iter().zip(slopes);
        let each = each.map(|(f, by)| (linearised[*f].sizes[i] * by).abs());
        each.fold(0.0, f64::max)
    };
    let error = |(i, slopes): (usize, &[f64])| {
        let each = functions.iter().zip(slopes);
        each.map(|(f, by)| linearised[*f].basis_error[i] * by).sum()
    };
    LinearisedCurve {
        roots: cases.clone().map(|case| sum(&|l| &l.roots[case])).collect(),
        hidden: cases.map(|case| sum(&|l| &l.hidden[case])).collect(),
        sizes: at_nodes().enumerate().map(size).collect(),
        basis_error: at_nodes().enumerate().map(error).collect(),
    }
}
