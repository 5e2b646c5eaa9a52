//! The continuous adjoint, Eq. 13 of the paper, discretised as the paper does.
//!
//! It is derived for functions of time and only then discretised, so it is consistent with the
//! discrete cost but not its exact derivative: the relative error levels off at a floor that
//! falls with the step (about 2e-5 at 1000 nodes, 4e-6 at 2000). Kept to reproduce the paper and to
//! show the difference; [`super::discrete`] has no floor.

use crate::dynamics::quadrature::{curvature, slope};
use crate::dynamics::{Device, DeviceTangent, Excitation, Oscillator, State, Term, Trajectory};
use crate::lanes::{self, Arithmetic, Eight, Kernel, LANES, Row, window};
use std::borrow::Cow;

/// Gradient of `J = integral (y - y_obs)^2 dt` with respect to all functions, in the L2 inner
/// product: functions of time at the nodes, not multiplied by quadrature weights.
///
/// Integrates, backward from `z = z' = 0` at the end,
/// `m z'' + (2 m' - C) z' + (m'' - C' + K) z = 2 (y - y_obs)` with `C = sum_j p_j dphi_j/dv` and
/// `K = sum_j p_j dphi_j/dy` along the motion (for the paper's terms `C = c`, `K = k`), and returns
/// `-z (y'' + b'')` for the mass and `-z phi_j` for term `j`. Derivatives are taken by differences,
/// `y''` too. The stepper is the explicit midpoint rule whatever the forward solve uses, in the order
/// of operations of the paper's run.
///
/// The gradient with respect to the initial state are numbers: `dJ/dv(0) = m z` and
/// `dJ/dy(0) = C z - (m z)'` at the beginning.
///
/// # Panics
/// If the motion, the readings or a function of the device end before the grid does.
pub fn gradient(
    oscillator: &Oscillator,
    device: &Device,
    excitation: Option<&Excitation>,
    trajectory: &Trajectory,
    observed: &[f64],
) -> DeviceTangent {
    let nodes = oscillator.grid.nodes();
    assert_eq!(trajectory.nodes(), nodes, "a motion over the whole grid");
    let dt = oscillator.grid.step();
    let [c, k] = linearised_coefficients(oscillator, device, trajectory);
    let y = trajectory.displacement.as_slice();
    let mut z = vec![0.0; nodes];
    let m = device.mass.as_slice();
    let (m1, m2, c1) = (slope(m, dt), curvature(m, dt), slope(&c, dt));
    let lists = [m, &m1, &m2, &c, &c1, &k, y, observed];
    assert!(
        lists.iter().all(|list| list.len() == nodes),
        "lists over the whole grid"
    );
    let first_slope = lanes::run(Sweep {
        dt,
        lists,
        z: &mut z,
    });
    let mut acceleration = curvature(y, dt);
    if let Some(base) = excitation.and_then(|e| e.base.as_ref()) {
        let base = base.at_nodes();
        acceleration.iter_mut().zip(base).for_each(|(a, b)| *a += b);
    }
    // Taken from zero, so that no zero has a sign.
    let against = |response: &[f64]| -> Vec<f64> {
        let pairs = z.iter().zip(response);
        pairs.map(|(z, x)| 0.0 - z * x).collect()
    };
    let motion = trajectory.displacement.iter().zip(&trajectory.velocity);
    let by_term = |term: &Term| match term {
        Term::Damping => against(&trajectory.velocity),
        Term::Stiffness => against(&trajectory.displacement),
        other => {
            let response: Vec<f64> = motion.clone().map(|(y, v)| other.phi(*y, *v)).collect();
            against(&response)
        }
    };
    let momentum_slope = m1[0] * z[0] + device.mass[0] * first_slope;
    DeviceTangent {
        device: Device {
            mass: against(&acceleration),
            coefficients: oscillator.terms.iter().map(by_term).collect(),
        },
        initial: State {
            displacement: c[0] * z[0] - momentum_slope,
            velocity: device.mass[0] * z[0],
        },
    }
}

/// Functions of time that a step back needs.
const LISTS: usize = 8;

/// The way back. What a step needs and does not wait for is made for eight steps at a time, in lanes, between the steps
/// of the eight before, each of which waits for the one before it: so it takes no time of its own.
///
/// In a step the rate is divided by the mass twice, and all that follows waits for the quotients. A division takes 13 cycles,
/// a product with the reciprocal and what its rounding lost 7, and differs only where the quotient is next to the middle
/// between two numbers. So steps go on with the product while the division is done beside it; eight steps in which they
/// differ once are done again by divisions.
struct Sweep<'a> {
    dt: f64,
    /// `m`, `m'`, `m''`, `C`, `C'`, `K`, `y` and `y_obs` at the nodes.
    lists: [&'a [f64]; LISTS],
    /// The adjoint displacement at the nodes.
    z: &'a mut [f64],
}

/// What eight steps need, each at its right node and at mid-step: `m`, `C - 2 m'`, `m'' - C' + K` and `2 (y - y_obs) / m`, and
/// `1 / m` in two parts.
#[repr(align(64))]
struct Coefficients {
    mass: Row,
    damping: Row,
    stiffness: Row,
    source: Row,
    reciprocal: [Row; 2],
}

/// Eight steps back, or less.
struct Eighth<'a> {
    dt: f64,
    /// At the right nodes, and at mid-step.
    at: [Coefficients; 2],
    /// The adjoint displacement at the left nodes.
    z: &'a mut [f64],
}

impl Eighth<'_> {
    /// Goes back from `(z, z')`, with products in place of divisions if `FUSED`; whether these had the same bits.
    #[inline(always)]
    fn back<const FUSED: bool>(&mut self, [z, w]: [f64; 2]) -> ([f64; 2], bool) {
        let Self { dt, at, z: out } = self;
        let half_dt = 0.5 * *dt;
        let (mut z, mut w) = (z, w);
        let mut is_same = true;
        for (j, out) in out.iter_mut().enumerate().rev() {
            let mut slope = |at: &Coefficients, w: f64, z: f64| {
                let (m, [reciprocal, lost]) = (at.mass[j], &at.reciprocal);
                let divided = w / m;
                let mut quotient = divided;
                if FUSED {
                    quotient = w.mul_add(reciprocal[j], w * lost[j]);
                    is_same &= quotient == divided;
                }
                quotient * at.damping[j] - z / m * at.stiffness[j] + at.source[j]
            };
            let wh = w - half_dt * slope(&at[0], w, z);
            let zh = z - half_dt * w;
            w -= *dt * slope(&at[1], wh, zh);
            z -= *dt * wh;
            *out = z;
        }
        ([z, w], is_same)
    }
}

impl Kernel for Sweep<'_> {
    /// `z'` at the first node.
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> f64 {
        let Sweep { dt, lists, z } = self;
        let last = z.len() - 1;
        z[last] = 0.0;
        let mut state = [0.0; 2];
        for first in (0..last).step_by(LANES).rev() {
            let of = |list: usize| right_and_middle(arithmetic, lists[list], first);
            let [m, m1, m2, c] = [of(0), of(1), of(2), of(3)];
            let [c1, k, y, observed] = [of(4), of(5), of(6), of(7)];
            let at = [
                coefficients([m[0], m1[0], m2[0], c[0], c1[0], k[0], y[0], observed[0]]),
                coefficients([m[1], m1[1], m2[1], c[1], c1[1], k[1], y[1], observed[1]]),
            ];
            let end = last.min(first + LANES);
            let mut steps = Eighth {
                dt,
                at,
                z: &mut z[first..end],
            };
            let (mut after, mut is_same) = ([0.0; 2], false);
            if A::IS_FUSED {
                (after, is_same) = steps.back::<true>(state);
            }
            if !is_same {
                (after, _) = steps.back::<false>(state);
            }
            state = after;
        }
        state[1]
    }
}

/// Values at the right nodes of the eight steps from `first` on, and their means with those at the left nodes.
#[inline(always)]
fn right_and_middle<A: Arithmetic>(arithmetic: A, f: &[f64], first: usize) -> [Eight<A>; 2] {
    let nine = f[first..].first_chunk::<{ LANES + 1 }>();
    let inside = nine.and_then(|nine| Some((nine.first_chunk()?, nine.last_chunk()?)));
    let (left, right) = match inside {
        Some((left, right)) => (
            Eight::load(arithmetic, left),
            Eight::load(arithmetic, right),
        ),
        None => {
            let (left, right) = (window(f, first), window(f, first + 1));
            (
                Eight::load(arithmetic, &left),
                Eight::load(arithmetic, &right),
            )
        }
    };
    [right, (right + left) * Eight::splat(arithmetic, 0.5)]
}

/// What eight steps need at one place, from the values there, in the order of [`Sweep::lists`].
#[inline(always)]
fn coefficients<A: Arithmetic>(values: [Eight<A>; LISTS]) -> Coefficients {
    let [m, m1, m2, c, c1, k, y, observed] = values;
    let [reciprocal, lost] = m.reciprocal();
    Coefficients {
        mass: m.row(),
        damping: (c - (m1 + m1)).row(),
        stiffness: (m2 - c1 + k).row(),
        source: ((y - observed + (y - observed)) / m).row(),
        reciprocal: [reciprocal.row(), lost.row()],
    }
}

/// `(C, K)` at the nodes: what damping and stiffness the motion sees when it is disturbed.
fn linearised_coefficients<'a>(
    oscillator: &Oscillator,
    device: &'a Device,
    trajectory: &Trajectory,
) -> [Cow<'a, [f64]>; 2] {
    let nodes = trajectory.displacement.len();
    if oscillator.terms == [Term::Damping, Term::Stiffness] {
        return [0, 1].map(|j| Cow::Borrowed(device.coefficients[j].as_slice()));
    }
    let (mut c, mut k) = (vec![0.0; nodes], vec![0.0; nodes]);
    for (term, p) in oscillator.terms.iter().zip(&device.coefficients) {
        for i in 0..nodes {
            let (phi_y, phi_v) = term.partials(trajectory.displacement[i], trajectory.velocity[i]);
            c[i] += p[i] * phi_v;
            k[i] += p[i] * phi_y;
        }
    }
    [c, k].map(Cow::Owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps with products, and the same with divisions; whether the products were the same.
    struct Both {
        mass: f64,
        rate: f64,
    }

    impl Kernel for Both {
        type Output = Option<([[f64; 2]; 2], bool)>;

        #[inline(always)]
        fn run<A: Arithmetic>(self, arithmetic: A) -> Self::Output {
            let of = |x: f64| Eight::splat(arithmetic, x);
            let values = || {
                [
                    of(self.mass),
                    of(0.0),
                    of(0.1),
                    of(0.3),
                    of(0.0),
                    of(2.0),
                    of(0.0),
                    of(0.0),
                ]
            };
            let mut z = [0.0; LANES];
            let mut steps = Eighth {
                dt: 0.01,
                at: [coefficients(values()), coefficients(values())],
                z: &mut z,
            };
            let state = [0.7, self.rate];
            let (with_products, is_same) = steps.back::<true>(state);
            let (with_divisions, _) = steps.back::<false>(state);
            A::IS_FUSED.then_some(([with_products, with_divisions], is_same))
        }
    }

    #[test]
    fn products_that_are_no_quotients_are_noticed() {
        // Numbers with 53 bits whose quotient is as near to the middle between two numbers as can be.
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(99);
            state
        };
        let mut noticed = 0;
        for _ in 0..2000 {
            let [rate, mass] = lanes::tests::hardest(&mut random);
            for ([products, divisions], is_same) in
                lanes::on_each(|| Both { mass, rate }).into_iter().flatten()
            {
                assert!(!is_same || products == divisions, "{mass} {rate}");
                noticed += usize::from(!is_same);
            }
            // All others are the same.
            for ([products, divisions], is_same) in lanes::on_each(|| Both {
                mass: 1.3,
                rate: 0.9,
            })
            .into_iter()
            .flatten()
            {
                assert!(is_same && products == divisions);
            }
        }
        let is_fused = lanes::on_each(|| Both {
            mass: 1.0,
            rate: 1.0,
        })
        .iter()
        .any(Option::is_some);
        assert_eq!(noticed > 0, is_fused, "{noticed} of 2000");
    }
}
