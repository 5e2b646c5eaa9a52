//! Weights of finite differences on arbitrary nodes (Fornberg, Math. Comp. 51, 1988).

/// Weights of the derivatives of order 0, 1 and 2 at `x` of the interpolation polynomial on `nodes`, one row per order.
pub fn weights(x: f64, nodes: &[f64]) -> [Vec<f64>; 3] {
    let n = nodes.len();
    let mut out = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    out[0][0] = 1.0;
    let mut c1 = 1.0;
    let mut c4 = nodes[0] - x;
    for i in 1..n {
        let highest = i.min(2);
        let mut c2 = 1.0;
        let c5 = c4;
        c4 = nodes[i] - x;
        for j in 0..i {
            let c3 = nodes[i] - nodes[j];
            c2 *= c3;
            if j == i - 1 {
                for k in (1..=highest).rev() {
                    out[k][i] = c1 * (k as f64 * out[k - 1][i - 1] - c5 * out[k][i - 1]) / c2;
                }
                out[0][i] = -c1 * c5 * out[0][i - 1] / c2;
            }
            for k in (1..=highest).rev() {
                out[k][j] = (c4 * out[k][j] - k as f64 * out[k - 1][j]) / c3;
            }
            out[0][j] = c4 * out[0][j] / c3;
        }
        c1 = c2;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_differentiated_exactly() {
        let nodes = [0.0, 1.0, 2.0, 3.5, 4.0, 5.0];
        let p = |t: f64| 1.0 - t + 0.5 * t.powi(3) - 0.1 * t.powi(5);
        let p1 = |t: f64| -1.0 + 1.5 * t.powi(2) - 0.5 * t.powi(4);
        let p2 = |t: f64| 3.0 * t - 2.0 * t.powi(3);
        for x in [0.0, 0.3, 2.0, 4.9] {
            let rows = weights(x, &nodes);
            for (row, exact) in rows.iter().zip([p(x), p1(x), p2(x)]) {
                let found: f64 = row.iter().zip(nodes).map(|(w, t)| w * p(t)).sum();
                // Six weights of some tens times values of some hundreds, in double precision.
                assert!((found - exact).abs() < 1e-10, "{x}: {found} is not {exact}");
            }
        }
    }
}
