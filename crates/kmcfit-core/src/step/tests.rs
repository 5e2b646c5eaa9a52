//! Operations on systems of one coordinate against each other, over random systems, records, methods and excitations.

use super::engine::Driven;
use super::nodal_observations::{Accelerations, NodalObservations};
use super::tangents::{ConstantPerturbation, Slot, TILE, Tangents};
use super::{CoefficientGradient, EngineMode, SearchRay, Trajectory, least_squares, observe};
use crate::record::ChannelKind;
use crate::simd::{self, Arithmetic, Eight, Kernel, LANES};
use crate::structure::{CoefficientKind, Law, Structure};
use crate::system::quadrature::trapezoid;
use crate::system::{
    Excitation, Grid, Method, NodalCoefficients, StageSamples, State, System, SystemTangent,
    TimePoint,
};
use properties::properties;
use proptest::prelude::*;
use std::ops::Range;

#[path = "../../tests/common/properties.rs"]
mod properties;

/// Largest difference of two responses or gradients per step, in machine precisions of the largest value: each step rounds
/// about ten operations, and the errors accumulate.
const PER_STEP: f64 = 40.0;

/// A random system with a random record.
#[derive(Debug, Clone)]
struct Case {
    system: System,
    nodal: NodalCoefficients,
    excitation: Option<Excitation>,
    initial: State,
    /// Random numbers in (-1, 1), three per node.
    numbers: Vec<f64>,
}

impl Case {
    fn nodes(&self) -> usize {
        self.system.grid.nodes()
    }

    fn excitation(&self) -> Option<&Excitation> {
        self.excitation.as_ref()
    }

    fn response(&self) -> Trajectory {
        let found = (self.system).forward(&self.nodal, &self.initial, self.excitation());
        found.expect("a response")
    }

    /// Series `which` of random numbers, one per node.
    fn series(&self, which: usize) -> Vec<f64> {
        let nodes = self.nodes();
        (0..nodes)
            .map(|i| self.numbers[(which * nodes + i) % self.numbers.len()])
            .collect()
    }

    fn source(&self) -> Trajectory {
        Trajectory::of_columns(&[&self.series(0), &self.series(1)])
    }

    fn driven(&self) -> Driven<'_> {
        Driven {
            system: &self.system,
            nodal: &self.nodal,
            excitation: self.excitation(),
        }
    }

    /// Checks that two series agree.
    fn agree(&self, a: &[f64], b: &[f64]) -> Result<(), TestCaseError> {
        let largest = |f: &mut dyn Iterator<Item = f64>| f.fold(0.0f64, |m, x| m.max(x.abs()));
        let scale = largest(&mut b.iter().copied());
        let error = largest(&mut a.iter().zip(b).map(|(a, b)| a - b));
        let bound = PER_STEP * self.nodes() as f64 * f64::EPSILON * scale;
        prop_assert!(
            error <= bound,
            "{error:e} of {scale:e}, more than {bound:e}"
        );
        Ok(())
    }

    fn agree_responses(&self, a: &Trajectory, b: &Trajectory) -> Result<(), TestCaseError> {
        self.agree(a.displacement(0), b.displacement(0))?;
        self.agree(a.velocity(0), b.velocity(0))
    }
}

fn terms() -> impl Strategy<Value = Vec<Law>> {
    let linear = vec![Law::Damping, Law::Stiffness];
    let duffing = vec![Law::Damping, Law::Stiffness, Law::CubicStiffness];
    let all = (0.05..0.5f64).prop_map(|width| {
        let kinds = CoefficientKind::ALL.into_iter();
        kinds
            .filter_map(|kind| kind.law(width))
            .collect::<Vec<Law>>()
    });
    let some = all
        .prop_flat_map(|all| prop::sample::subsequence(all.clone(), 0..=all.len()))
        .prop_map(|mut some| {
            // A quadratic spring alone pushes away from the origin on one side.
            if !some.contains(&Law::Stiffness) {
                some.retain(|term| *term != Law::QuadraticStiffness);
            }
            some
        })
        .prop_shuffle();
    prop_oneof![2 => Just(linear), 1 => Just(duffing), 3 => some]
}

/// Range of a function.
fn range(term: Option<&Law>) -> Range<f64> {
    match term {
        None => 0.5..3.0,
        Some(Law::Stiffness) => 0.5..5.0,
        Some(Law::Offset) => -1.0..1.0,
        // The springs of higher powers remain weaker than the linear one: no escape, and a period of many steps.
        Some(Law::QuadraticStiffness) => 0.0..0.02,
        Some(Law::QuinticStiffness) => 0.0..0.01,
        Some(_) => 0.0..0.5,
    }
}

/// A function: nodal values, a constant, or two levels.
fn function(range: Range<f64>, nodes: usize) -> impl Strategy<Value = Vec<f64>> {
    let levels = (range.clone(), range.clone(), 0..nodes);
    prop_oneof![
        prop::collection::vec(range.clone(), nodes),
        range.prop_map(move |x| vec![x; nodes]),
        levels.prop_map(move |(first, second, position)| {
            let mut values = vec![first; nodes];
            values[position..].fill(second);
            values
        })
    ]
}

fn stepwise(nodes: usize) -> impl Strategy<Value = Option<StageSamples>> {
    let steps = prop::collection::vec(prop::array::uniform3(-1.0..1.0f64), nodes - 1);
    prop::option::of(steps.prop_map(StageSamples::new))
}

fn case_of(
    terms: impl Strategy<Value = Vec<Law>>,
    method: impl Strategy<Value = Method>,
    nodes: Range<usize>,
    is_driven: bool,
) -> impl Strategy<Value = Case> {
    (terms, method, nodes, 0.01..0.1f64).prop_flat_map(move |(terms, method, nodes, step)| {
        let functions: Vec<_> = std::iter::once(None)
            .chain(terms.iter().map(Some))
            .map(|term| function(range(term), nodes))
            .collect();
        let excitation = (stepwise(nodes), stepwise(nodes))
            .prop_map(move |(force, base)| is_driven.then_some(Excitation::one(force, base)));
        let system = System {
            grid: Grid::new(0.0, step * (nodes - 1) as f64, nodes).expect("a grid"),
            method,
            structure: Structure::one(terms),
        };
        let numbers = prop::collection::vec(-1.0..1.0f64, 3 * nodes);
        (functions, excitation, -3.0..3.0f64, -3.0..3.0f64, numbers).prop_map(
            move |(functions, excitation, displacement, velocity, numbers)| {
                let mut functions = functions.into_iter();
                Case {
                    system: system.clone(),
                    nodal: NodalCoefficients {
                        inertias: vec![functions.next().expect("a mass")],
                        coefficients: functions.collect(),
                    },
                    excitation,
                    initial: State::one(displacement, velocity),
                    numbers,
                }
            },
        )
    })
}

fn methods() -> impl Strategy<Value = Method> {
    prop_oneof![
        Just(Method::Midpoint),
        Just(Method::Rk4),
        Just(Method::ImplicitMidpoint)
    ]
}

/// Any system.
fn any_case() -> impl Strategy<Value = Case> {
    case_of(terms(), methods(), 3..200, true)
}

/// Linear systems in free response by the midpoint rule; some records have several tiles.
fn linear_free_case() -> impl Strategy<Value = Case> {
    let case = |nodes| {
        let terms = Just(vec![Law::Damping, Law::Stiffness]);
        case_of(terms, Just(Method::Midpoint), nodes, false)
    };
    prop_oneof![4 => case(65..300), 1 => case(300..5000)]
}

/// Accelerations and their derivatives at eight nodes.
struct Observe<'a>(NodalObservations<'a>, usize, [f64; 2]);

impl Kernel for Observe<'_> {
    type Output = Accelerations;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> Accelerations {
        let Self(nodes, node, around) = self;
        let mut seen = Accelerations::NOTHING;
        let around = around.map(|x| Eight::splat(arithmetic, x));
        nodes.accelerations(arithmetic, node, around, &mut seen);
        seen
    }
}

/// The functions that are constants along the directions of a group, one along each: the first ones, or the last ones.
fn held(case: &Case) -> Range<usize> {
    let functions = 1 + case.system.laws().len();
    let first = match case.numbers[0] > 0.0 {
        true => functions.saturating_sub(LANES),
        false => 0,
    };
    first..functions.min(first + LANES)
}

/// A direction for each lane of a group: random nodal values, or one number for a constant function.
fn directions(case: &Case, holds: bool) -> [SystemTangent; LANES] {
    let functions = 1 + case.system.laws().len();
    std::array::from_fn(|lane| {
        let mut nodal = NodalCoefficients::zeros(case.nodes(), 1, functions - 1);
        for (f, values) in nodal.functions_mut().enumerate() {
            match holds {
                true if held(case).nth(lane) == Some(f) => values.fill(case.numbers[lane]),
                true => {}
                false => values.clone_from(&case.series(7 * lane + f)),
            }
        }
        SystemTangent {
            nodal,
            initial: State::one(case.numbers[lane], -0.5),
        }
    })
}

/// All tangents of a group.
fn sensitivities(case: &Case, response: &Trajectory, holds: bool) -> [Trajectory; LANES] {
    let directions = directions(case, holds);
    let functions = 1 + case.system.laws().len();
    let slots = (0..functions).map(|function| Slot { group: 0, function });
    let row = |f: &dyn Fn(&SystemTangent) -> f64| directions.each_ref().map(f);
    let initial = [
        row(&|d| d.initial.displacement(0)),
        row(&|d| d.initial.velocity(0)),
    ];
    let mut tangents = Tangents::new(slots.collect(), &[initial]);
    let mut out = [(); LANES].map(|()| Trajectory::zeros(1, case.nodes()));
    let last = case.nodes() - 1;
    for first in (0..last).step_by(TILE) {
        let count = TILE.min(last - first);
        for slot in 0..functions {
            if holds {
                let lane = held(case).position(|function| function == slot);
                if let (0, Some(lane)) = (first, lane) {
                    let value = case.numbers[lane];
                    tangents.set_constant(slot, ConstantPerturbation { lane, value });
                }
                continue;
            }
            let rows = tangents.changes_mut(slot);
            for (i, row) in rows.iter_mut().enumerate().take(count + 1) {
                let at = |d: &SystemTangent| {
                    d.nodal.functions().nth(slot).expect("a function")[first + i]
                };
                *row = directions.each_ref().map(at);
            }
        }
        tangents.advance(case.driven(), response, first..first + count);
        for (i, [y, v]) in tangents.states(0).iter().enumerate().take(count + 1) {
            for (lane, out) in out.iter_mut().enumerate() {
                (
                    out.component_mut(0)[first + i],
                    out.component_mut(1)[first + i],
                ) = (y[lane], v[lane]);
            }
        }
    }
    out
}

proptest! {
    #![proptest_config(properties(150, 1))]

    /// Fast ones and those in the paper's order with those of the assembled structure.
    #[test]
    fn responses_agree(case in any_case()) {
        let mut assembled = Trajectory::zeros(1, case.nodes());
        let x = case.initial.components();
        let found = case.driven().with_motion(|motion| motion.respond(x, &mut assembled));
        found.expect("a response");
        for mode in [EngineMode::Fastest, EngineMode::Reference] {
            let mut response = Trajectory::zeros(1, case.nodes());
            (case.driven().respond(mode, &case.initial, &mut response)).expect("a response");
            case.agree_responses(&response, &assembled)?;
        }
    }

    #[test]
    fn sums_are_those_of_the_derivatives_at_the_nodes(case in any_case()) {
        let (response, source) = (case.response(), case.source());
        let exact = case.driven().nodal_adjoint(&response, &source);
        let mut sums = vec![0.0; 1 + case.system.laws().len()];
        let gradient = CoefficientGradient::Summed(&mut sums);
        let initial = case.driven().adjoint(&response, &source, gradient);
        prop_assert_eq!(initial, exact.initial);
        for (sum, values) in sums.iter().zip(exact.nodal.functions()) {
            let size: f64 = values.iter().map(|x| x.abs()).sum();
            let error = (sum - values.iter().sum::<f64>()).abs();
            prop_assert!(error <= PER_STEP * case.nodes() as f64 * f64::EPSILON * size);
        }
    }

    #[test]
    fn the_adjoint_is_the_transpose_of_the_tangent(case in any_case()) {
        let (response, source) = (case.response(), case.source());
        let direction = &directions(&case, false)[0];
        let found = case.driven().nodal_adjoint(&response, &source);
        let tangent = case.driven().tangent(&response, direction);
        let dot = |a: &[f64], b: &[f64]| -> [f64; 2] {
            let products = || a.iter().zip(b).map(|(a, b)| a * b);
            [products().sum(), products().map(f64::abs).sum()]
        };
        let flat = |d: &SystemTangent| -> Vec<f64> {
            let functions = d.nodal.functions().flatten().copied();
            functions.chain([d.initial.displacement(0), d.initial.velocity(0)]).collect()
        };
        let all = |t: &Trajectory| [t.displacement(0), t.velocity(0)].concat();
        let [left, size] = dot(&all(&tangent), &all(&source));
        let [right, other] = dot(&flat(&found), &flat(direction));
        prop_assert!((left - right).abs() <= 1e-11 * size.max(other), "{left} {right}");
    }

    #[test]
    fn least_squares_in_place_agree_with_response_and_adjoint(case in linear_free_case()) {
        let (system, nodal) = (&case.system, &case.nodal);
        let (response, observed, weights) = (case.response(), case.series(2), [0.7, 0.2]);
        let last = case.nodes() - 1;
        let mut source = Trajectory::zeros(1, case.nodes());
        let mut cost = 0.0;
        for (i, (y, o)) in response.displacement(0).iter().zip(&observed).enumerate() {
            let w = weights[usize::from(i == 0 || i == last)];
            cost += w * (y - o) * (y - o);
            source.component_mut(0)[i] = 2.0 * w * (y - o);
        }
        let exact = case.driven().nodal_adjoint(&response, &source);
        let mut gradient = nodal.clone();
        let [c, k] = gradient.coefficients.as_mut_slice() else { unreachable!("two terms") };
        let functions = [&nodal.inertias[0], &nodal.coefficients[0], &nodal.coefficients[1]];
        let found = least_squares(
            system,
            functions.map(Vec::as_slice),
            &case.initial,
            &observed,
            weights,
            [&mut gradient.inertias[0], c, k],
        );
        case.agree(&[found.expect("a long free record")], &[cost])?;
        for (found, exact) in gradient.functions().zip(exact.nodal.functions()) {
            case.agree(found, exact)?;
        }
    }

    #[test]
    fn sensitivities_agree_with_the_tangent(case in any_case(), holds in any::<bool>()) {
        let response = case.response();
        let fast = sensitivities(&case, &response, holds);
        for (fast, direction) in fast.iter().zip(&directions(&case, holds)) {
            let exact = case.driven().tangent(&response, direction);
            case.agree_responses(fast, &exact)?;
        }
    }

    #[test]
    fn accelerations_at_nodes_agree_with_observations(case in any_case()) {
        let (system, nodal) = (&case.system, &case.nodal);
        let states = case.response();
        let around = [case.numbers[0], case.numbers[1]];
        let surroundings = crate::system::InputSample { force: around[0], base: around[1] };
        for first in (0..case.nodes()).step_by(LANES) {
            let nodes = NodalObservations { system, nodal, states: &states };
            let seen = simd::run(Observe(nodes, first, around));
            for node in first..case.nodes().min(first + LANES) {
                let position = TimePoint::node(node, case.nodes());
                let kind = ChannelKind::Acceleration;
                let exact = observe(
                    system, kind, nodal, case.excitation(), &states, position, surroundings,
                );
                let (lane, side) = (node - first, usize::from(position.fraction == 1.0));
                let functions = 1 + system.laws().len();
                let list = |value: f64, states: [f64; 2], functions: Vec<f64>| {
                    [vec![value], states.to_vec(), functions].concat()
                };
                let fast = list(
                    seen.value[lane],
                    seen.states.map(|row| row[lane]),
                    seen.functions[..functions].iter().map(|row| row[lane]).collect(),
                );
                let exact = list(
                    exact.value,
                    [exact.states[2 * side], exact.states[2 * side + 1]],
                    exact.functions[side][..functions].to_vec(),
                );
                case.agree(&fast, &exact)?;
            }
        }
    }

    #[test]
    fn the_best_trial_is_a_candidate(case in linear_free_case(), count in 1usize..50) {
        let Case { system, nodal, initial, .. } = &case;
        let (step, observed) = (system.grid.step(), case.series(0));
        let direction = [case.series(1), case.series(2), case.series(3)];
        let ray = SearchRay {
            functions: [&nodal.inertias[0], &nodal.coefficients[0], &nodal.coefficients[1]]
                .map(Vec::as_slice),
            direction: direction.each_ref().map(Vec::as_slice),
            initial,
            samples: &observed,
            step,
        };
        let lengths: Vec<f64> = (1..=count).map(|i| 1.0 / (i * i) as f64).collect();
        let alone = lengths.iter().map(|a| {
            let mut nodal = nodal.clone();
            for (values, direction) in nodal.functions_mut().zip(&direction) {
                values.iter_mut().zip(direction).for_each(|(p, g)| *p -= a * g);
            }
            system.forward(&nodal, &*initial, None).map_or(f64::INFINITY, |response| {
                let pairs = response.displacement(0).iter().zip(&observed);
                let squares: Vec<f64> = pairs.map(|(y, o)| (y - o) * (y - o)).collect();
                trapezoid(&squares, step)
            })
        });
        let alone: Vec<f64> = alone.collect();
        let best = (0..count).min_by(|a, b| alone[*a].total_cmp(&alone[*b])).expect("a trial");
        prop_assert!(!alone[best].is_finite() || ray.candidates(&lengths).contains(&best));
    }
}
