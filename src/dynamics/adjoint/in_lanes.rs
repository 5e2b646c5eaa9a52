//! The discrete adjoint with its steps linearised eight at a time: the motion is known, so only two
//! products of a step wait for the step after it.

use crate::dynamics::maps::{self, FUNCTIONS, Maps};
use crate::dynamics::stages::Rhs;
use crate::dynamics::{Device, DeviceTangent, Method, State, Trajectory};
use crate::lanes::{self, Arithmetic, Eight, Kernel, LANES, Row};

/// As [`super::discrete::gradient_in_order`], to rounding; not finite where a product of this order
/// of operations leaves the range of numbers.
pub(super) fn gradient(
    rhs: Rhs,
    method: Method,
    trajectory: &Trajectory,
    source: &Trajectory,
) -> DeviceTangent {
    let mut gradient = Device::zeros(rhs.device.mass.len(), rhs.terms.len());
    let initial = lanes::run(Back {
        rhs,
        method,
        trajectory,
        source,
        gradient: &mut gradient,
    });
    DeviceTangent {
        device: gradient,
        initial,
    }
}

struct Back<'a> {
    rhs: Rhs<'a>,
    method: Method,
    trajectory: &'a Trajectory,
    source: &'a Trajectory,
    gradient: &'a mut Device,
}

impl Kernel for Back<'_> {
    type Output = State;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> State {
        let (rhs, source) = (&self.rhs, self.source);
        let last = self.trajectory.nodes() - 1;
        let mut wanted = [false; FUNCTIONS];
        wanted[..=rhs.terms.len()].fill(true);
        let mut maps = Maps::NOTHING;
        let mut x = [source.displacement[last], source.velocity[last]];
        let mut to = last;
        while to > 0 {
            let from = (to - 1) / LANES * LANES;
            maps::linearise(
                arithmetic,
                self.method,
                rhs,
                self.trajectory,
                from,
                &wanted,
                &mut maps,
            );
            // The adjoint at the right node of each step; zero where there is no step.
            let mut ends = [[0.0; LANES]; 2];
            let [[yy, yv], [vy, vv]] = &maps.growth;
            for i in (from..to).rev() {
                let l = i - from;
                (ends[0][l], ends[1][l]) = (x[0], x[1]);
                x = [
                    x[0] + (yy[l] * x[0] + vy[l] * x[1] + source.displacement[i]),
                    x[1] + (yv[l] * x[0] + vv[l] * x[1] + source.velocity[i]),
                ];
            }
            let ends = [
                Eight::load(arithmetic, &ends[0]),
                Eight::load(arithmetic, &ends[1]),
            ];
            let all =
                std::iter::once(&mut self.gradient.mass).chain(&mut self.gradient.coefficients);
            for (f, values) in all.enumerate() {
                let (left, right) = (&maps.left[f], &maps.right[f]);
                set(
                    arithmetic,
                    left,
                    right,
                    ends,
                    to - from,
                    &mut values[from..],
                );
            }
            to = from;
        }
        State {
            displacement: x[0],
            velocity: x[1],
        }
    }
}

/// Takes the shares of up to eight steps to the gradient of a function from their first node on: the node behind
/// them has its share of the step behind, the others have none yet.
#[inline(always)]
fn set<A: Arithmetic>(
    arithmetic: A,
    left: &[Row; 2],
    right: &[Row; 2],
    ends: [Eight<A>; 2],
    steps: usize,
    gradient: &mut [f64],
) {
    let left =
        Eight::load(arithmetic, &left[0]) * ends[0] + Eight::load(arithmetic, &left[1]) * ends[1];
    let right =
        Eight::load(arithmetic, &right[0]) * ends[0] + Eight::load(arithmetic, &right[1]) * ends[1];
    let right = right.row();
    // The share of the step before a node.
    let mut before = [0.0; LANES];
    before[1..].copy_from_slice(&right[..LANES - 1]);
    let nodes = (left + Eight::load(arithmetic, &before)).row();
    match (steps, gradient.first_chunk_mut::<LANES>()) {
        (LANES, Some(values)) => *values = nodes,
        _ => gradient[..steps].copy_from_slice(&nodes[..steps]),
    }
    gradient[steps] += right[steps - 1];
}
