//! Curves over time, linearised in the parameters: functions, and ratios of functions by the delta method.

use nalgebra::DMatrix;

/// A curve over time, linearised in the parameters.
pub(super) struct LinearisedCurve {
    /// Products with the columns of the covariance root, with all active rows fixed, and with only the equalities fixed.
    pub roots: [DMatrix<f64>; 2],
    /// Norm of the slope in undetermined directions, in both cases.
    pub hidden: [DMatrix<f64>; 2],
    /// Norm of the full slope.
    pub sizes: Vec<f64>,
    /// Error of the basis, which the standard errors include.
    pub basis_error: Vec<f64>,
}

/// Linear combination `sum_f slope_f(t) p_f(t)`, with slopes at each node.
pub(super) fn combine(
    linearised: &[LinearisedCurve],
    functions: &[usize],
    slopes: &[Vec<f64>],
) -> LinearisedCurve {
    let sum = |of: &dyn Fn(&LinearisedCurve) -> &DMatrix<f64>| {
        let parts = functions.iter().enumerate().map(|(p, f)| {
            let mut part = of(&linearised[*f]).clone();
            for (mut row, slopes) in part.row_iter_mut().zip(slopes) {
                row *= slopes[p];
            }
            part
        });
        parts
            .reduce(|sum, part| sum + part)
            .expect("at least one function")
    };
    let size = |(i, slopes): (usize, &Vec<f64>)| {
        let each = functions.iter().zip(slopes);
        let each = each.map(|(f, by)| (linearised[*f].sizes[i] * by).abs());
        each.fold(0.0, f64::max)
    };
    let error = |(i, slopes): (usize, &Vec<f64>)| {
        let each = functions.iter().zip(slopes);
        each.map(|(f, by)| linearised[*f].basis_error[i] * by).sum()
    };
    LinearisedCurve {
        roots: [sum(&|l| &l.roots[0]), sum(&|l| &l.roots[1])],
        hidden: [sum(&|l| &l.hidden[0]), sum(&|l| &l.hidden[1])],
        sizes: slopes.iter().enumerate().map(size).collect(),
        basis_error: slopes.iter().enumerate().map(error).collect(),
    }
}
