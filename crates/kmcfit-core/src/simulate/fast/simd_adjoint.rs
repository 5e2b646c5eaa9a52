//! The discrete adjoint with its steps linearised eight at a time: the response is known, so only two
//! products of a step wait for the step after it.

use super::step_linearisation::{self, RequestedDerivatives, StepLinearisation};
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES, Row};
use crate::simulate::reference::equation::EquationOfMotion;
use crate::simulate::{CoefficientGradient, Trajectory};
use crate::system::{FUNCTIONS, Method, NodalCoefficients, State, SystemTangent};

/// As [`discrete_adjoint`](crate::simulate::reference::discrete_adjoint()), to 40 machine precisions of the largest
/// value for each step; not finite where a product of this order
/// of operations leaves the range of numbers.
pub(crate) fn gradient(
    equation: EquationOfMotion,
    method: Method,
    trajectory: &Trajectory,
    source: &Trajectory,
) -> SystemTangent {
    let mut nodal = NodalCoefficients::zeros(equation.nodal.mass.len(), equation.terms.len());
    let gradient = CoefficientGradient::AtNodes(&mut nodal);
    let initial = back(equation, method, trajectory, source, gradient);
    SystemTangent { nodal, initial }
}

/// Goes back through a response: the gradient with respect to the initial state. That with respect to the functions is
/// added to the sums in `gradient`, or is written to the nodes there, which must be zero.
pub(crate) fn back(
    equation: EquationOfMotion,
    method: Method,
    trajectory: &Trajectory,
    source: &Trajectory,
    gradient: CoefficientGradient,
) -> State {
    simd::run(Back {
        equation,
        method,
        trajectory,
        source,
        gradient,
    })
}

struct Back<'a> {
    equation: EquationOfMotion<'a>,
    method: Method,
    trajectory: &'a Trajectory,
    source: &'a Trajectory,
    gradient: CoefficientGradient<'a>,
}

impl Kernel for Back<'_> {
    type Output = State;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> State {
        let (equation, source) = (&self.equation, self.source);
        let mut gradient = self.gradient;
        let mut sums = [[0.0; LANES]; FUNCTIONS];
        let last = self.trajectory.nodes() - 1;
        let mut wanted = RequestedDerivatives::default();
        let asked = match &gradient {
            CoefficientGradient::AtNodes(_) => &mut wanted.ends,
            CoefficientGradient::Summed(_) => &mut wanted.sum,
        };
        asked[..=equation.terms.len()].fill(true);
        let mut maps = StepLinearisation::NOTHING;
        let mut x = [source.displacement[last], source.velocity[last]];
        let mut to = last;
        while to > 0 {
            let from = (to - 1) / LANES * LANES;
            step_linearisation::linearise(
                arithmetic,
                self.method,
                equation,
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
                // In pairs, of which neither waits for the other.
                x = [
                    (x[0] + vy[l] * x[1]) + (source.displacement[i] + yy[l] * x[0]),
                    (x[1] + yv[l] * x[0]) + (source.velocity[i] + vv[l] * x[1]),
                ];
            }
            let ends = [
                Eight::load(arithmetic, &ends[0]),
                Eight::load(arithmetic, &ends[1]),
            ];
            for (f, sum) in sums.iter_mut().enumerate().take(1 + equation.terms.len()) {
                match &mut gradient {
                    CoefficientGradient::AtNodes(nodal) => {
                        let left = share(arithmetic, &maps.left[f], ends);
                        let right = share(arithmetic, &maps.right[f], ends);
                        let values = &mut nodal.function_mut(f)[from..];
                        set(arithmetic, left, right, to - from, values);
                    }
                    CoefficientGradient::Summed(_) => {
                        let share = share(arithmetic, &maps.sum[f], ends);
                        *sum = (Eight::load(arithmetic, sum) + share).row();
                    }
                }
            }
            to = from;
        }
        if let CoefficientGradient::Summed(all) = gradient {
            for (sum, lanes) in all.iter_mut().zip(sums) {
                *sum += lanes.iter().sum::<f64>();
            }
        }
        State {
            displacement: x[0],
            velocity: x[1],
        }
    }
}

/// The shares of eight steps in the gradient of a function, from the answers to it.
#[inline(always)]
fn share<A: Arithmetic>(arithmetic: A, answers: &[Row; 2], ends: [Eight<A>; 2]) -> Eight<A> {
    Eight::load(arithmetic, &answers[0]) * ends[0] + Eight::load(arithmetic, &answers[1]) * ends[1]
}

/// Writes the shares of up to eight steps to the gradient of a function, from their first node on. It is called from
/// the last steps to the first: the node after these has the share of the step that follows, the others have none yet.
#[inline(always)]
fn set<A: Arithmetic>(
    arithmetic: A,
    left: Eight<A>,
    right: Eight<A>,
    steps: usize,
    gradient: &mut [f64],
) {
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
