//! Response of an oscillator, by an integrator of the tests' own.

/// Displacements from rest at every one of `steps` steps between samples of the force that are `spacing` (s) apart, by the fourth-order method
/// of Runge and Kutta for the acceleration `a(t, y, v, f)`; the force is linear between its samples.
pub fn displacements(
    force: &[f64],
    spacing: f64,
    steps: usize,
    acceleration: impl Fn(f64, f64, f64, f64) -> f64,
) -> Vec<f64> {
    let h = spacing / steps as f64;
    let (mut y, mut v) = (0.0, 0.0);
    let mut all = vec![y];
    for (i, pair) in force.windows(2).enumerate() {
        for s in 0..steps {
            let slope = |part: f64, y: f64, v: f64| {
                let share = (s as f64 + part) / steps as f64;
                let f = pair[0] + share * (pair[1] - pair[0]);
                [v, acceleration(spacing * (i as f64 + share), y, v, f)]
            };
            let a = slope(0.0, y, v);
            let b = slope(0.5, y + 0.5 * h * a[0], v + 0.5 * h * a[1]);
            let c = slope(0.5, y + 0.5 * h * b[0], v + 0.5 * h * b[1]);
            let d = slope(1.0, y + h * c[0], v + h * c[1]);
            y += h / 6.0 * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0]);
            v += h / 6.0 * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1]);
            all.push(y);
        }
    }
    all
}
