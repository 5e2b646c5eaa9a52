//! Line search for the weak Wolfe conditions, by bracketing and interpolation.

/// Sufficient decrease: `phi(a) <= phi(0) + 1e-4 a phi'(0)`.
const DECREASE: f64 = 1e-4;
/// Curvature: `phi'(a) >= 0.9 phi'(0)`.
const CURVATURE: f64 = 0.9;
/// Largest number of trials, enough to halve a step to 1e-9 of its first length.
const TRIALS: u32 = 30;
/// Largest growth factor of the step between trials.
const GROWTH: f64 = 4.0;

/// Cost along a line, `phi(a)`.
pub(super) trait LineFunction {
    /// Cost at step `a`; `None` if the simulation fails.
    fn cost(&mut self, a: f64) -> Option<f64>;
    /// Slope at the step of the last call of [`LineFunction::cost`].
    fn slope(&mut self) -> f64;
}

/// Finds a step that satisfies the weak Wolfe conditions, from the first trial `first`; `cost` and `slope < 0` belong to
/// step 0. A step whose simulation fails is too long. Returns the last step with sufficient decrease, which is the last one
/// whose slope was evaluated; `None` if there was none.
///
/// Slopes are evaluated only at steps with sufficient decrease, so a rejected trial costs one forward solve and no adjoint.
pub(super) fn weak_wolfe(
    line: &mut dyn LineFunction,
    cost: f64,
    slope: f64,
    first: f64,
) -> Option<f64> {
    let (mut low, mut high) = (0.0, f64::INFINITY);
    let mut low_slope = slope;
    let mut a = first;
    let mut accepted = None;
    for _ in 0..TRIALS {
        let trial = line.cost(a);
        let lower = trial.filter(|c| *c <= cost + DECREASE * a * slope);
        if lower.is_none() {
            high = a;
            let fallback = 0.5 * (low + high);
            a = match trial {
                Some(trial) if low == 0.0 => parabola(cost, slope, a, trial),
                _ => fallback,
            };
            continue;
        }
        let here = line.slope();
        accepted = Some(a);
        if here >= CURVATURE * slope {
            return accepted;
        }
        let next = secant(low, low_slope, a, here);
        (low, low_slope) = (a, here);
        a = if high.is_finite() {
            0.5 * (low + high)
        } else {
            next.clamp(1.5 * a, GROWTH * a)
        };
    }
    accepted
}

/// Minimiser of the parabola through `phi(0)`, `phi'(0)`, `phi(a)`, limited to `[0.1 a, 0.5 a]`.
fn parabola(cost: f64, slope: f64, a: f64, trial: f64) -> f64 {
    let minimiser = -slope * a * a / (2.0 * (trial - cost - slope * a));
    if minimiser.is_finite() {
        minimiser.clamp(0.1 * a, 0.5 * a)
    } else {
        0.5 * a
    }
}

/// Zero of the slope by the secant method.
fn secant(a: f64, slope_a: f64, b: f64, slope_b: f64) -> f64 {
    let zero = b - slope_b * (b - a) / (slope_b - slope_a);
    if zero.is_finite() { zero } else { GROWTH * b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_minimiser_of_the_parabola_is_limited() {
        // 3 - 4 x + 1.5 x^2 at x = 4, and parabolas whose minimum is nearer or farther.
        let at = |bend: f64| parabola(3.0, -4.0, 4.0, 3.0 - 16.0 + 16.0 * bend);
        assert!((at(1.5) - 4.0 / 3.0).abs() < 1e-15);
        assert_eq!(at(100.0), 0.4);
        assert_eq!(at(0.6), 2.0);
        // A line has no minimum.
        assert_eq!(at(0.0), 2.0);
        assert_eq!(secant(1.0, -3.0, 3.0, -1.0), 4.0);
    }
}
