//! Cubic splines with not-a-knot end conditions, represented by their second derivatives `M_i` at the samples (de Boor, A Practical
//! Guide to Splines, ch. IV).

/// Second derivatives of the spline at the samples.
///
/// With spacings `h_i` and slopes `d_i` the inner samples give
///
/// ```text
/// h_{i-1} M_{i-1} + 2 (h_{i-1} + h_i) M_i + h_i M_{i+1} = 6 (d_i - d_{i-1})
/// ```
///
/// and a third derivative that is continuous at the second sample gives `M_0 = (1 + h_0/h_1) M_1 - h_0/h_1 M_2`, likewise at the other
/// end. The resulting system is diagonally dominant for any spacings and needs no pivoting.
pub fn curvatures(times: &[f64], values: &[f64]) -> Vec<f64> {
    let n = times.len();
    if n < 3 {
        return vec![0.0; n];
    }
    let spacings: Vec<f64> = times.windows(2).map(|t| t[1] - t[0]).collect();
    let rises = values.windows(2).map(|y| y[1] - y[0]);
    let slopes: Vec<f64> = rises.zip(&spacings).map(|(rise, h)| rise / h).collect();
    if n == 3 {
        let bend = 2.0 * (slopes[1] - slopes[0]) / (spacings[0] + spacings[1]);
        return vec![bend; 3];
    }
    let inner = n - 2;
    let mut below: Vec<f64> = spacings[..inner].to_vec();
    let mut above: Vec<f64> = spacings[1..].to_vec();
    let mut diagonal: Vec<f64> = spacings.windows(2).map(|h| 2.0 * (h[0] + h[1])).collect();
    let mut right: Vec<f64> = slopes.windows(2).map(|d| 6.0 * (d[1] - d[0])).collect();
    let first = spacings[0] / spacings[1];
    diagonal[0] += spacings[0] * (1.0 + first);
    above[0] -= spacings[0] * first;
    let last = spacings[n - 2] / spacings[n - 3];
    diagonal[inner - 1] += spacings[n - 2] * (1.0 + last);
    below[inner - 1] -= spacings[n - 2] * last;

    for i in 1..inner {
        let factor = below[i] / diagonal[i - 1];
        diagonal[i] -= factor * above[i - 1];
        right[i] -= factor * right[i - 1];
    }
    let mut bends = vec![0.0; n];
    for i in (0..inner).rev() {
        // In the last row the superdiagonal entry belongs to the eliminated end.
        let next = if i + 1 < inner {
            above[i] * bends[i + 2]
        } else {
            0.0
        };
        bends[i + 1] = (right[i] - next) / diagonal[i];
    }
    bends[0] = (1.0 + first) * bends[1] - first * bends[2];
    bends[n - 1] = (1.0 + last) * bends[n - 2] - last * bends[n - 3];
    bends
}

/// Spline between two samples.
#[derive(Debug, Clone, Copy)]
pub struct SplineSegment {
    pub times: [f64; 2],
    pub values: [f64; 2],
    pub curvatures: [f64; 2],
}

impl SplineSegment {
    /// Shares `A`, `B` of the interval on the right and the left of a time, and its length.
    fn parts(&self, t: f64) -> (f64, f64, f64) {
        let h = self.times[1] - self.times[0];
        ((self.times[1] - t) / h, (t - self.times[0]) / h, h)
    }

    /// Value `A y_0 + B y_1 + ((A³ - A) M_0 + (B³ - B) M_1) h²/6`.
    pub fn value(&self, t: f64) -> f64 {
        let (a, b, h) = self.parts(t);
        let line = a * self.values[0] + b * self.values[1];
        let [left, right] = self.curvatures;
        line + ((a * a * a - a) * left + (b * b * b - b) * right) * h * h / 6.0
    }

    /// First derivative.
    pub fn derivative(&self, t: f64) -> f64 {
        let (a, b, h) = self.parts(t);
        let slope = (self.values[1] - self.values[0]) / h;
        let [left, right] = self.curvatures;
        slope + ((1.0 - 3.0 * a * a) * left + (3.0 * b * b - 1.0) * right) * h / 6.0
    }

    /// Second derivative `A M_0 + B M_1`.
    pub fn second_derivative(&self, t: f64) -> f64 {
        let (a, b, _) = self.parts(t);
        a * self.curvatures[0] + b * self.curvatures[1]
    }
}
