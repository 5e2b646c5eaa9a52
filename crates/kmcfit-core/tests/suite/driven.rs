//! Forced responses against closed forms: harmonic, base and transient excitation, Coulomb friction, and samples between
//! nodes.

use crate::common::closed_form::constant_coefficients;
use kmcfit_core::record::ChannelKind;
use kmcfit_core::step::observe;
use kmcfit_core::structure::{Law, Structure};
use kmcfit_core::system::{
    Excitation, Grid, InputSample, Method, NodalCoefficients, StageSamples, State, System,
    TimePoint,
};
use std::f64::consts::PI;

const METHODS: [Method; 2] = [Method::Midpoint, Method::Rk4];
const M: f64 = 2.0;
const C: f64 = 0.6;
const K: f64 = 18.0;
fn rest() -> State {
    State::one(0.0, 0.0)
}

fn system(nodes: usize, duration: f64, method: Method) -> System {
    System {
        grid: Grid::new(0.0, duration, nodes).unwrap(),
        method,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    }
}

fn constants(nodes: usize, values: &[f64]) -> NodalCoefficients {
    let [mass, rest @ ..] = values else {
        panic!("a mass")
    };
    NodalCoefficients {
        inertias: vec![vec![*mass; nodes]],
        coefficients: rest.iter().map(|p| vec![*p; nodes]).collect(),
    }
}

/// A function of time as input of the stepper: exact at both ends and in the middle of each step.
fn sampled(grid: &Grid, f: impl Fn(f64) -> f64) -> StageSamples {
    let h = grid.step();
    let step = |i: usize| [0.0, 0.5, 1.0].map(|x| f(grid.time(i) + x * h));
    StageSamples::new((0..grid.nodes() - 1).map(step))
}

fn pushed(force: StageSamples) -> Excitation {
    Excitation::one(Some(force), None)
}

/// The error falls as the step to the power of the method's order when the step is halved.
fn check_order(method: Method, words: &str, error: impl Fn(usize) -> f64) -> f64 {
    let (coarse, fine) = (error(401), error(801));
    let order = (coarse / fine).log2();
    // The next order of the expansion still shows, one step in a hundred of a period.
    assert!(
        (order - f64::from(method.order())).abs() < 0.15,
        "{words} {method:?}: order {order}, {coarse} {fine}"
    );
    fine
}

/// `A cos(w t) + B sin(w t)` that fits `values` best: amplitude and phase lag behind a cosine.
fn tone(times: &[f64], values: &[f64], w: f64) -> (f64, f64) {
    let (mut cc, mut cs, mut ss, mut cy, mut sy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (t, y) in times.iter().zip(values) {
        let (s, c) = (w * t).sin_cos();
        cc += c * c;
        cs += c * s;
        ss += s * s;
        cy += c * y;
        sy += s * y;
    }
    let determinant = cc * ss - cs * cs;
    let (a, b) = (
        (ss * cy - cs * sy) / determinant,
        (cc * sy - cs * cy) / determinant,
    );
    (a.hypot(b), b.atan2(a))
}

/// Factors of the number of steps of the long records: 0.02 and 0.01 s, 50 and 100 or more steps in
/// the shorter of the periods of force and system.
const STEADY: usize = 30;

/// Far below, near and far above resonance (3 rad/s), long after the transient:
/// `exp(-c t / 2m)` is 1e-13 at 200 s.
#[test]
fn a_harmonic_force_gives_the_steady_state_of_the_textbook() {
    for method in METHODS {
        for w in [0.5, 2.9, 3.0, 7.0] {
            let impedance = (K - M * w * w).hypot(C * w);
            let lag = (C * w).atan2(K - M * w * w);
            let error = |nodes: usize| {
                let nodes = STEADY * (nodes - 1) + 1;
                let system = system(nodes, 240.0, method);
                let grid = system.grid;
                let force = sampled(&grid, |t| 5.0 * (w * t).cos());
                let response = system
                    .forward(&constants(nodes, &[M, C, K]), &rest(), Some(&pushed(force)))
                    .unwrap();
                let settled = nodes * 5 / 6;
                let (amplitude, phase) = tone(
                    &grid.times()[settled..],
                    &response.displacement(0)[settled..],
                    w,
                );
                (amplitude * impedance / 5.0 - 1.0).hypot(phase - lag)
            };
            let left = check_order(method, &format!("w = {w}"), error);
            // (w h)^2 / 6 of the midpoint rule for 0.01 s a step, times a quality of 10.
            assert!(left < 0.01, "{left}");
        }
    }
}

/// A sensor on the base measures the relative motion, one fixed in space the sum of base and relative
/// motion: `|X/B|^2 = (k^2 + (c w)^2) / ((k - m w^2)^2 + (c w)^2)`.
#[test]
fn base_and_relative_motion_together_have_the_transmissibility() {
    for method in METHODS {
        // Not at the peak itself: there the error of the frequency, of order 2, does not show, and
        // that of the damping, of order 3, is as large as the rest.
        for w in [1.0, 2.5, 6.0] {
            let exact = (K * K + (C * w).powi(2)).sqrt() / (K - M * w * w).hypot(C * w);
            for kind in [ChannelKind::Displacement, ChannelKind::Acceleration] {
                let error = |nodes: usize| {
                    let nodes = STEADY * (nodes - 1) + 1;
                    let system = system(nodes, 240.0, method);
                    let grid = system.grid;
                    let of_base = match kind {
                        ChannelKind::Displacement => 1.0,
                        _ => -w * w,
                    };
                    let excitation =
                        Excitation::one(None, Some(sampled(&grid, |t| -w * w * (w * t).cos())));
                    let nodal = constants(nodes, &[M, C, K]);
                    let response = system.forward(&nodal, &rest(), Some(&excitation)).unwrap();
                    let settled: Vec<usize> = (nodes * 5 / 6..nodes).collect();
                    let times: Vec<f64> = settled.iter().map(|i| grid.time(*i)).collect();
                    let relative = settled.iter().map(|i| {
                        let position = TimePoint::node(*i, nodes);
                        let around = excitation.input_at(position);
                        let sensed = observe(
                            &system,
                            kind,
                            &nodal,
                            Some(&excitation),
                            &response,
                            position,
                            around,
                        );
                        sensed.value
                    });
                    let absolute: Vec<f64> = relative
                        .zip(&times)
                        .map(|(x, t)| x + of_base * (w * t).cos())
                        .collect();
                    let (amplitude, _) = tone(&times, &absolute, w);
                    (amplitude / of_base.abs() / exact - 1.0).abs()
                };
                check_order(method, &format!("{kind:?} w = {w}"), error);
            }
        }
    }
}

/// Displacement of `m y'' + c y' + k y = f0` from rest.
fn step_response(t: f64) -> f64 {
    let from = State::one(-1.0 / K, 0.0);
    constant_coefficients((M, C, K), from, t).0 + 1.0 / K
}

/// A constant force that begins at one node and ends at another.
#[test]
fn a_force_that_jumps_at_nodes_gives_the_step_response() {
    for method in METHODS {
        let error = |nodes: usize| {
            let system = system(nodes, 8.0, method);
            let (first, last) = ((nodes - 1) / 8, (nodes - 1) / 2);
            let on = |i: usize| [f64::from(u8::from((first..last).contains(&i))); 3];
            let force = StageSamples::new((0..nodes - 1).map(on));
            let response = system
                .forward(&constants(nodes, &[M, C, K]), &rest(), Some(&pushed(force)))
                .unwrap();
            let after = |t: f64| if t > 0.0 { step_response(t) } else { 0.0 };
            let times = system
                .grid
                .times()
                .into_iter()
                .zip(response.displacement(0));
            times.fold(0.0f64, |most, (t, y)| {
                most.max((y - after(t - 1.0) + after(t - 4.0)).abs())
            })
        };
        check_order(method, "step", error);
    }
}

/// `sin(pi t / 2)` for 2 s, without damping: in closed form during the pulse, free response after it.
#[test]
fn a_half_sine_gives_the_response_of_the_textbook() {
    let (w, wn) = (PI / 2.0, (K / M).sqrt());
    let exact = |t: f64| {
        let during = |t: f64| {
            let scale = 1.0 / (K - M * w * w);
            let y = scale * ((w * t).sin() - w / wn * (wn * t).sin());
            let v = scale * w * ((w * t).cos() - (wn * t).cos());
            (y, v)
        };
        if t <= 2.0 {
            return during(t).0;
        }
        let (displacement, velocity) = during(2.0);
        let left = State::one(displacement, velocity);
        constant_coefficients((M, 0.0, K), left, t - 2.0).0
    };
    for method in METHODS {
        let error = |nodes: usize| {
            let system = system(nodes, 8.0, method);
            let force = sampled(&system.grid, |t| {
                if t < 2.0 + 1e-9 { (w * t).sin() } else { 0.0 }
            });
            let response = system
                .forward(
                    &constants(nodes, &[M, 0.0, K]),
                    &rest(),
                    Some(&pushed(force)),
                )
                .unwrap();
            let times = system
                .grid
                .times()
                .into_iter()
                .zip(response.displacement(0));
            times.fold(0.0f64, |most, (t, y)| most.max((y - exact(t)).abs()))
        };
        check_order(method, "half sine", error);
    }
}

/// A free response under dry friction: its turning points, as displacements.
fn turning_points(friction: f64, width: f64) -> Vec<f64> {
    // A step 1/20 of the time that the speed takes to cross the narrowest width.
    let nodes = 40_001;
    let mut system = system(nodes, 2.0 * PI * 3.2, Method::Rk4);
    system.structure = Structure::one(vec![Law::Stiffness, Law::CoulombFriction { width }]);
    let initial = State::one(1.0, 0.0);
    let response = system
        .forward(&constants(nodes, &[1.0, 1.0, friction]), &initial, None)
        .unwrap();
    let (y, v) = (response.displacement(0), response.velocity(0));
    let turns = (1..nodes - 1).filter(|i| v[*i] * v[i + 1] <= 0.0);
    // At the turn itself: v is a line between the nodes, and y a parabola.
    let h = system.grid.step();
    turns
        .map(|i| y[i] + 0.5 * v[i] * h * v[i] / (v[i] - v[i + 1]))
        .collect()
}

/// Dry friction takes `4 F / k` off the amplitude in every cycle: the envelope is a line. Smoothing
/// over a speed `u` changes the work in half a cycle by `int (1 - |v| / sqrt(v^2 + u^2)) F dy`, which
/// is `F u^2 / w^2 * (ln(2 w A / u) ..)/A`, so the error falls with the square of the width but for a
/// logarithm.
#[test]
fn dry_friction_decays_in_a_line() {
    let friction = 0.04;
    let loss = |width: f64| -> Vec<f64> {
        let turns = turning_points(friction, width);
        let peaks: Vec<f64> = std::iter::once(1.0)
            .chain(turns.into_iter().filter(|y| *y > 0.0))
            .collect();
        assert!(peaks.len() >= 4, "{peaks:?}");
        peaks.windows(2).take(3).map(|w| w[0] - w[1]).collect()
    };
    let expected = 4.0 * friction;
    let mut last: Option<f64> = None;
    for width in [0.04, 0.02, 0.01] {
        let losses = loss(width);
        let error = losses
            .iter()
            .fold(0.0f64, |most, l| most.max((l - expected).abs()));
        println!("width {width}: {losses:?}, off by {error:.2e}");
        // Half a cycle from A to B with v = w sqrt((y - B)(A - y)) nearly: the work that is missing,
        // F int (1 - v / sqrt(v^2 + u^2)) dy, over k A, for the smaller of the amplitudes.
        let amplitude = 1.0 - 3.0 * expected;
        let steps = 200_000;
        let missing: f64 = (0..steps)
            .map(|i| {
                let y = amplitude * (-1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(steps));
                let v = (amplitude * amplitude - y * y).sqrt();
                1.0 - v / (v * v + width * width).sqrt()
            })
            .sum::<f64>()
            * 2.0
            * amplitude
            / f64::from(steps);
        let predicted = 2.0 * friction * missing / amplitude;
        // The amplitude is 5 % to 20 % larger in the rest of the cycle.
        assert!(
            (0.6..1.1).contains(&(error / predicted)),
            "{width}: {error} {predicted}"
        );
        if let Some(last) = last {
            // A factor of 4 less the logarithm, ln(2 A / u) of 40 to 80.
            assert!((3.0..4.0).contains(&(last / error)), "{last} {error}");
        }
        last = Some(error);
    }
}

/// Samples between nodes converge with the order of the stepper: the interpolation has at least this order.
#[test]
fn samples_between_nodes_have_the_order_of_the_stepper() {
    let w = 2.0;
    // Harmonic force in its steady state from the first node on.
    let impedance = (K - M * w * w).hypot(C * w);
    let lag = (C * w).atan2(K - M * w * w);
    let exact = |kind: ChannelKind, t: f64| {
        let (s, c) = (w * t - lag).sin_cos();
        match kind {
            ChannelKind::Displacement => c / impedance,
            ChannelKind::Velocity => -w * s / impedance,
            ChannelKind::Acceleration => -w * w * c / impedance,
        }
    };
    let initial = State::one(
        exact(ChannelKind::Displacement, 0.0),
        exact(ChannelKind::Velocity, 0.0),
    );
    for method in METHODS {
        for kind in ChannelKind::ALL {
            let error = |nodes: usize| {
                // 16 to 32 steps in a period of the system: with more, rounding would show.
                let nodes = (nodes - 1) / 4 + 1;
                let system = system(nodes, 10.0, method);
                let grid = system.grid;
                let excitation = pushed(sampled(&grid, |t| (w * t).cos()));
                let nodal = constants(nodes, &[M, C, K]);
                let response = system.forward(&nodal, &initial, Some(&excitation)).unwrap();
                let mut most = 0.0f64;
                for step in 0..nodes - 1 {
                    for fraction in [0.0, 0.1, 0.31, 0.5, 0.77, 0.99] {
                        let position = TimePoint { step, fraction };
                        let t = grid.time(step) + fraction * grid.step();
                        let around = InputSample {
                            force: (w * t).cos(),
                            base: 0.0,
                        };
                        let seen = observe(
                            &system,
                            kind,
                            &nodal,
                            Some(&excitation),
                            &response,
                            position,
                            around,
                        );
                        most = most.max((seen.value - exact(kind, t)).abs());
                    }
                }
                most
            };
            check_order(method, &format!("{kind:?}"), error);
        }
    }
}
