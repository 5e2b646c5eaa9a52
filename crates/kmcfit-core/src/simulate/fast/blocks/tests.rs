use super::*;
use crate::simd::LANES;
use crate::simulate::{Engine, reference};
use crate::system::{Grid, Method, Term};

/// Records slightly shorter and longer than whole tiles, and of several tiles.
const NODES: [usize; 8] = [65, 66, 81, 200, 4096, 4097, 4113, 9000];

const INITIAL: State = State {
    displacement: 3.3,
    velocity: -1.0,
};

fn system(nodes: usize) -> System {
    System {
        grid: Grid::new(0.0, 25.0, nodes).unwrap(),
        method: Method::Midpoint,
        terms: vec![Term::Damping, Term::Stiffness],
    }
}

/// Falling mass, damping of both signs, oscillating stiffness.
fn nodal(nodes: usize) -> NodalCoefficients {
    let at = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
        (0..nodes).map(|i| f(i as f64 / nodes as f64)).collect()
    };
    NodalCoefficients {
        mass: at(&|s| 1.5 - s),
        coefficients: vec![
            at(&|s| 0.2 * (9.0 * s).sin()),
            at(&|s| 2.0 + (30.0 * s).cos()),
        ],
    }
}

fn samples(response: &Trajectory) -> Vec<f64> {
    let pairs = response.displacement.iter().enumerate();
    pairs
        .map(|(i, y)| 0.9 * y + 0.1 * (0.03 * i as f64).sin())
        .collect()
}

fn source(response: &Trajectory, velocity: f64) -> Trajectory {
    Trajectory {
        displacement: samples(response),
        velocity: response.velocity.iter().map(|v| velocity * v).collect(),
    }
}

fn squares_of<'a>(nodal: LinearSystem<'a>, samples: &'a [f64]) -> least_squares::LeastSquares<'a> {
    least_squares::LeastSquares {
        nodal,
        initial: INITIAL,
        samples,
        weights: [0.7, 0.2],
    }
}

fn largest(f: &[f64]) -> f64 {
    f.iter().fold(0.0, |most, x| most.max(x.abs()))
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    largest(&difference)
}

/// Bound of the accumulated rounding errors of 25 s: some machine precisions per period.
const ROUNDING: f64 = 1e-12;

#[test]
fn responses_agree_with_sequential_steps() {
    for nodes in NODES {
        let (system, nodal) = (system(nodes), nodal(nodes));
        let one_by_one = system.forward(&nodal, INITIAL, None).unwrap();
        let mut response = Trajectory::zeros(nodes);
        let linear = LinearSystem::of(&system, &nodal, nodes).unwrap();
        linear.forward(INITIAL, &mut response);
        for (a, b) in [
            (&response.displacement, &one_by_one.displacement),
            (&response.velocity, &one_by_one.velocity),
        ] {
            let error = distance(a, b) / largest(b);
            assert!(error < ROUNDING, "{nodes}: {error:e}");
        }
    }
}

#[test]
fn gradients_agree_with_sequential_steps() {
    for (nodes, by_velocity) in NODES.into_iter().flat_map(|n| [(n, 0.0), (n, 0.3)]) {
        let (system, nodal) = (system(nodes), nodal(nodes));
        let response = system.forward(&nodal, INITIAL, None).unwrap();
        let source = source(&response, by_velocity);
        let expected = reference::discrete_adjoint(&system, &nodal, None, &response, &source);
        let linear = LinearSystem::of(&system, &nodal, nodes).unwrap();
        let found = linear.gradient(&response, &source);
        for (a, b) in found.nodal.functions().zip(expected.nodal.functions()) {
            let error = distance(a, b) / largest(b);
            assert!(error < ROUNDING, "{nodes}: {error:e}");
        }
        let a = [found.initial.displacement, found.initial.velocity];
        let b = [expected.initial.displacement, expected.initial.velocity];
        assert!(distance(&a, &b) < ROUNDING * largest(&b), "{nodes}");
    }
}

#[test]
fn least_squares_agree_with_response_and_gradient() {
    let weights = [0.7, 0.2];
    for nodes in NODES {
        let (system, nodal) = (system(nodes), nodal(nodes));
        let response = system.forward(&nodal, INITIAL, None).unwrap();
        let samples = samples(&response);
        let mut source = Trajectory::zeros(nodes);
        let mut cost = 0.0;
        for i in 0..nodes {
            let w = weights[usize::from(i == 0 || i + 1 == nodes)];
            let r = response.displacement[i] - samples[i];
            cost += w * r * r;
            source.displacement[i] = 2.0 * w * r;
        }
        let expected = reference::discrete_adjoint(&system, &nodal, None, &response, &source);
        let mut gradient = nodal.clone();
        let [c, k] = gradient.coefficients.as_mut_slice() else {
            unreachable!("two terms")
        };
        let (found, initial) = crate::simulate::least_squares(
            &system,
            [&nodal.mass, &nodal.coefficients[0], &nodal.coefficients[1]],
            INITIAL,
            &samples,
            weights,
            [&mut gradient.mass, c, k],
        )
        .unwrap();
        assert!(
            (found - cost).abs() < ROUNDING * cost,
            "{nodes}: {found} {cost}"
        );
        for (a, b) in gradient.functions().zip(expected.nodal.functions()) {
            let error = distance(a, b) / largest(b);
            assert!(error < ROUNDING, "{nodes}: {error:e}");
        }
        let a = [initial.displacement, initial.velocity];
        let b = [expected.initial.displacement, expected.initial.velocity];
        assert!(distance(&a, &b) < ROUNDING * largest(&b), "{nodes}");
    }
}

/// A response and its derivatives, with one SIMD arithmetic.
struct Whole<'a>(&'a System, &'a NodalCoefficients);

impl simd::Kernel for Whole<'_> {
    type Output = Vec<u64>;

    #[inline(always)]
    fn run<A: Arithmetic>(self, arithmetic: A) -> Vec<u64> {
        let Self(system, nodal) = self;
        let nodes = nodal.mass.len();
        let linear = LinearSystem::of(system, nodal, nodes).unwrap();
        let mut response = Trajectory::zeros(nodes);
        let mut gradient = NodalCoefficients::zeros(nodes, 2);
        with_workspace(|workspace| {
            forward::BlockForward {
                nodal: linear,
                initial: INITIAL,
                displacement: &mut response.displacement,
                velocity: &mut response.velocity,
                workspace,
            }
            .run(arithmetic);
        });
        let samples = samples(&response);
        let [c, k] = gradient.coefficients.as_mut_slice() else {
            unreachable!("two terms")
        };
        let of = squares_of(linear, &samples);
        let tiles: Vec<Tile> = Tile::cut(nodes - 1).0.collect();
        let mut slopes = [&mut gradient.mass, c, k].map(Vec::as_mut_slice);
        let (cost, _) = with_workspace(|workspace| {
            let first_pass = least_squares::FirstPass {
                of,
                tiles: &tiles,
                workspace,
            };
            let block_maps = first_pass.run(arithmetic);
            let joint = of.join(&tiles, &block_maps, &mut slopes);
            let descent = least_squares::SecondPass {
                of,
                tile_states: &joint.tile_states,
                gradient: slopes
                    .each_mut()
                    .map(|g| &mut g[..tiles.last().map_or(0, |tile| tile.node(LANES, 0))]),
                rates_kept: false,
                workspace,
            };
            let result = descent.run(arithmetic);
            of.finish(&joint, &result, &mut slopes)
        });
        let numbers = response.displacement.iter().chain(&response.velocity);
        let numbers = numbers.chain(gradient.functions().flatten()).chain([&cost]);
        numbers.map(|x| x.to_bits()).collect()
    }
}

#[test]
fn all_arithmetics_give_the_same_bits() {
    for nodes in NODES {
        let (system, nodal) = (system(nodes), nodal(nodes));
        let outputs = simd::on_each(|| Whole(&system, &nodal));
        assert!(
            outputs.iter().all(|output| output == &outputs[0]),
            "{nodes}"
        );
    }
}

/// Masses near the limits of the floating-point range, and responses that exceed it, are integrated sequentially with the
/// results of the reference.
#[test]
fn systems_outside_the_safe_range_are_integrated_sequentially() {
    let nodes = 500;
    let system = system(nodes);
    let mut tiny = nodal(nodes);
    for f in tiny.functions_mut() {
        f.iter_mut().for_each(|x| *x *= 1e-200);
    }
    assert!(LinearSystem::of(&system, &tiny, nodes).is_none());
    let mut response = Trajectory::zeros(nodes);
    Engine::ParallelInTime
        .forward_into(&system, &tiny, INITIAL, None, &mut response)
        .unwrap();
    let expected = system.forward(&tiny, INITIAL, None).unwrap();
    let error = distance(&response.displacement, &expected.displacement);
    assert!(
        error < ROUNDING * largest(&expected.displacement),
        "{error:e}"
    );

    let mut stiff = nodal(nodes);
    stiff.coefficients[1].fill(1e30);
    let expected = system.forward(&stiff, INITIAL, None).unwrap_err();
    let found = Engine::ParallelInTime.forward_into(&system, &stiff, INITIAL, None, &mut response);
    assert_eq!(found.unwrap_err(), expected);
}

/// The mass must be positive on the whole grid, also for a shorter record.
#[test]
fn mass_is_required_beyond_the_end_of_a_record() {
    let nodes = 500;
    let (system, mut nodal) = (system(nodes), nodal(nodes));
    nodal.mass[nodes - 1] = -1.0;
    let mut short = Trajectory::zeros(300);
    let expected = reference::forward_into(&system, &nodal, INITIAL, None, &mut short);
    let found = Engine::ParallelInTime.forward_into(&system, &nodal, INITIAL, None, &mut short);
    assert!(expected.is_err());
    assert_eq!(found, expected);
}

/// At samples equal to the response the derivative of a block's cost is a difference of nearly equal numbers. The
/// cancellation error is below the effect of rounding errors of the response on the residuals: the gradients of two
/// responses that differ by rounding differ more.
#[test]
fn least_squares_are_accurate_for_a_response_equal_to_the_samples() {
    let nodes = 2000;
    let (system, nodal) = (system(nodes), nodal(nodes));
    let one_by_one = system.forward(&nodal, INITIAL, None).unwrap();
    let wave = |(i, y): (usize, &f64)| y + 1e-8 * (0.11 * i as f64).sin();
    let samples: Vec<f64> = one_by_one
        .displacement
        .iter()
        .enumerate()
        .map(wave)
        .collect();
    let linear = LinearSystem::of(&system, &nodal, nodes).unwrap();
    let mut in_blocks = Trajectory::zeros(nodes);
    linear.forward(INITIAL, &mut in_blocks);
    let [expected, other] = [&in_blocks, &one_by_one].map(|response| {
        let mut source = Trajectory::zeros(nodes);
        for (i, s) in source.displacement.iter_mut().enumerate() {
            *s = 2.0 * (response.displacement[i] - samples[i]);
        }
        reference::discrete_adjoint(&system, &nodal, None, response, &source)
    });
    let mut gradient = nodal.clone();
    let [c, k] = gradient.coefficients.as_mut_slice() else {
        unreachable!("two terms")
    };
    linear.least_squares(INITIAL, &samples, [1.0, 1.0], [&mut gradient.mass, c, k]);
    let functions = expected.nodal.functions().zip(other.nodal.functions());
    for (found, (expected, other)) in gradient.functions().zip(functions) {
        assert!(distance(found, expected) < distance(other, expected));
    }
}

/// Results of a tile do not depend on the thread, nor on reuse of its rates.
#[test]
fn results_do_not_depend_on_the_division_into_threads() {
    for nodes in [2000, 4097, 20_000] {
        let (system, nodal) = (system(nodes), nodal(nodes));
        let linear = LinearSystem::of(&system, &nodal, nodes).unwrap();
        let response = system.forward(&nodal, INITIAL, None).unwrap();
        let samples = samples(&response);
        let of = squares_of(linear, &samples);
        let tiles: Vec<Tile> = Tile::cut(nodes - 1).0.collect();
        let bits = |middle: usize| {
            let mut slopes = nodal.clone();
            let [c, k] = slopes.coefficients.as_mut_slice() else {
                unreachable!("two terms")
            };
            let (cost, initial) = of.solve_in_two(&tiles, middle, [&mut slopes.mass, c, k]);
            let others = [cost, initial.displacement, initial.velocity];
            let all = slopes.functions().flatten().chain(&others);
            all.map(|x| x.to_bits()).collect::<Vec<u64>>()
        };
        let whole = bits(tiles.len());
        for middle in 0..tiles.len() {
            assert!(bits(middle) == whole, "{nodes} nodes, cut at {middle}");
        }
    }
}
