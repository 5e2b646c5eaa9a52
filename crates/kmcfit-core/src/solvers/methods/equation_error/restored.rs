//! High frequencies of a smoothed state, restored by the equation of motion.
//!
//! Nonlinear terms need the state itself and not averages of it: the sign of a smoothed velocity is wrong near its zeros, which lowers
//! an estimate of Coulomb friction and raises that of damping. A smoother `S` passes the low frequencies of the velocity; the equation of
//! motion with the parameters of a first minimum has the others:
//!
//! ```text
//! v = S v_measured + (1 - S) integral ((f - sum_j p_j phi_j(y, v))/m - b'') dt
//! ```
//!
//! and likewise the displacement with `integral v dt`. `S` is the smoother of the state; for a state of several channels, whose smoother has no
//! such form, it passes frequencies up to three times that of the acceleration, `rms(y'')/rms(y')`, and is applied to the smoothed state. As `1 - S` removes slow errors of the integrals, errors of the parameters and of the
//! force enter at high frequencies only.

use super::response::blend;
use crate::problem::Problem;
use crate::record::Measured;
use crate::simd::sum::rms;
use crate::solvers::state_estimation::smooth;
use crate::system::NodalCoefficients;

/// Rounds: the forces of damping and friction in the integral are those of the state of the previous round.
const ROUNDS: usize = 3;
/// Frequency at which `S` halves a state of several channels, relative to that of the acceleration.
const HALVED: f64 = 3.0;

/// Displacement and velocity with restored high frequencies; `None` without inputs at the times of the state.
pub(super) fn restored(
    problem: &Problem,
    measured: &Measured,
    nodal: &NodalCoefficients,
) -> Option<[Vec<f64>; 2]> {
    let inputs = measured.unsmoothed.as_ref()?;
    let passed = HALVED * rms(&measured.a) / rms(&measured.v);
    let weight = (measured.smoothing).unwrap_or((passed * measured.weight).powi(-6));
    let high = |series: Vec<f64>| -> Option<Vec<f64>> {
        let low = smooth(&series, weight)?;
        Some(series.iter().zip(&low).map(|(x, low)| x - low).collect())
    };
    let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect::<Vec<f64>>();
    let low = |series: &[f64]| match measured.smoothing {
        Some(_) => Some(series.to_vec()),
        None => smooth(series, weight),
    };
    let [low_y, low_v] = [low(&measured.y)?, low(&measured.v)?];
    let [mut y, mut v] = [measured.y.clone(), measured.v.clone()];
    for _ in 0..ROUNDS {
        let acceleration = measured.positions.iter().enumerate().map(|(i, position)| {
            let terms = problem.system.laws().iter().zip(&nodal.coefficients);
            let forces = terms.map(|(term, p)| blend(p, *position) * term.phi(y[i], v[i]));
            let force = inputs.force[i] - forces.sum::<f64>();
            force / blend(&nodal.inertias[0], *position) - inputs.base[i]
        });
        let acceleration: Vec<f64> = acceleration.collect();
        v = sum(&low_v, &high(integral(&acceleration, measured.weight))?);
        y = sum(&low_y, &high(integral(&v, measured.weight))?);
    }
    let is_finite = y.iter().chain(&v).all(|x| x.is_finite());
    is_finite.then_some([y, v])
}

/// Integral of a series by the trapezoid rule, from its first value.
fn integral(series: &[f64], spacing: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let steps = series.windows(2).map(|pair| {
        sum += 0.5 * spacing * (pair[0] + pair[1]);
        sum
    });
    std::iter::once(0.0).chain(steps).collect()
}
