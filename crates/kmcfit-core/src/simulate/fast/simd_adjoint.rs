//! The discrete adjoint with steps linearised eight at a time. The response is known, so only two products of a step depend
//! on the following step.

use super::step_linearisation::{self, RequestedDerivatives, StepLinearisation};
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES, Row};
use crate::simulate::reference::equation::EquationOfMotion;
use crate::simulate::{CoefficientGradient, Trajectory};
use crate::system::{FUNCTIONS, Method, NodalCoefficients, State, SystemTangent};

/// Adjoint; agrees with [`discrete_adjoint`](crate::simulate::reference::discrete_adjoint()) to 40 machine precisions of
/// the largest value per step. Not finite where a product in this order of operations exceeds the floating-point range.
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

/// Integrates the adjoint backwards; returns the gradient with respect to the initial state. The gradient with respect to
/// the functions is added to the sums in `gradient`, or written to its nodal values, which must be zero.
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
            // Adjoint at the right node of each step; zero for lanes without a step.
            let mut ends = [[0.0; LANES]; 2];
            let [[yy, yv], [vy, vv]] = &maps.growth;
            for i in (from..to).rev() {
                let l = i - from;
                (ends[0][l], ends[1][l]) = (x[0], x[1]);
                // In independent pairs.
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

/// Contributions of eight steps to the gradient of a function.
#[inline(always)]
fn share<A: Arithmetic>(arithmetic: A, answers: &[Row; 2], ends: [Eight<A>; 2]) -> Eight<A> {
    Eight::load(arithmetic, &answers[0]) * ends[0] + Eight::load(arithmetic, &answers[1]) * ends[1]
}

/// Writes the contributions of up to eight steps to the gradient of a function, from their first node. Calls proceed from
/// the last steps to the first: the node after these holds the contribution of the following step, the others are zero.
#[inline(always)]
fn set<A: Arithmetic>(
    arithmetic: A,
    left: Eight<A>,
    right: Eight<A>,
    steps: usize,
    gradient: &mut [f64],
) {
    let right = right.row();
    // Contribution of the step before a node.
    let mut before = [0.0; LANES];
    before[1..].copy_from_slice(&right[..LANES - 1]);
    let nodes = (left + Eight::load(arithmetic, &before)).row();
    match (steps, gradient.first_chunk_mut::<LANES>()) {
        (LANES, Some(values)) => *values = nodes,
        _ => gradient[..steps].copy_from_slice(&nodes[..steps]),
    }
    gradient[steps] += right[steps - 1];
}
