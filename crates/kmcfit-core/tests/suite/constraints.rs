//! Constraints: every kind on every basis against a dense evaluation of the functions.

use kmcfit_core::constraints::{Constraint, Constraints, RowGroup, Shape, TimeHistory};
use kmcfit_core::functions::{Basis, CoefficientFunction, Parameterization, uniform_knots};
use kmcfit_core::problem::Problem;
use kmcfit_core::qp::{ConicStatus, project};
use kmcfit_core::record::Experiment;
use kmcfit_core::solvers::StartProjection;
use kmcfit_core::structure::{CoefficientKind, Law, Structure};
use kmcfit_core::system::{Grid, Method, State, System};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MASS: CoefficientKind = CoefficientKind::MASS;
const DAMPING: CoefficientKind = CoefficientKind::DAMPING;
const STIFFNESS: CoefficientKind = CoefficientKind::STIFFNESS;
const NODES: usize = 41;

fn grid() -> Grid {
    Grid::new(1.0, 10.0, NODES).unwrap()
}

/// Every basis, with knots on nodes and off them.
fn bases() -> Vec<Basis> {
    let listed = vec![1.0, 2.13, 4.0, 7.7, 11.0];
    vec![
        Basis::Nodal,
        Basis::Constant,
        Basis::PiecewiseConstant {
            knots: listed.clone(),
        },
        Basis::PiecewiseLinear {
            knots: listed.clone(),
        },
        Basis::PiecewiseLinear {
            knots: uniform_knots(&grid(), 11),
        },
        Basis::Polynomial { degree: 1 },
        Basis::Polynomial { degree: 4 },
        Basis::BSpline { knots: listed },
    ]
}

/// True if the functions of a basis are linear between knots, so that constraints hold everywhere.
fn is_piecewise(basis: &Basis) -> bool {
    !matches!(
        basis,
        Basis::Polynomial { degree: 2.. } | Basis::BSpline { .. }
    )
}

fn free(quantity: CoefficientKind, basis: &Basis, value: f64) -> CoefficientFunction {
    let start = basis.constant(&grid(), value);
    CoefficientFunction::free(quantity, basis.clone(), &grid(), start)
}

fn collect(list: Vec<CoefficientFunction>) -> Parameterization {
    Parameterization::new(list, NODES, grid().step()).unwrap()
}

/// Mass, damping and stiffness of these bases.
fn functions(bases: [&Basis; 3]) -> Parameterization {
    let list = [MASS, DAMPING, STIFFNESS].into_iter().zip(bases);
    collect(list.map(|(q, basis)| free(q, basis, 1.0)).collect())
}

fn random(count: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| random.random_range(-2.0..3.0)).collect()
}

/// A derivative of function `j` at `times`, straight from the basis.
fn dense(
    functions: &Parameterization,
    theta: &[f64],
    j: usize,
    q: usize,
    times: &[f64],
) -> Vec<f64> {
    let basis = functions.iter().nth(j).unwrap().basis.clone().unwrap();
    let part = &theta[functions.ranges()[j].clone()];
    let rows = basis.rows(&grid(), times, q);
    rows.multiply(part)
}

/// Times ten times finer than the nodes.
fn fine() -> Vec<f64> {
    let count = 10 * (NODES - 1) + 1;
    grid().with_nodes(count).unwrap().times()
}

fn built(statement: &Constraint, functions: &Parameterization) -> Constraints {
    statement.build(&grid(), functions).unwrap()
}

/// The nearest feasible point.
fn inside(constraints: &Constraints, functions: &Parameterization, seed: u64) -> Vec<f64> {
    let start = random(functions.parameters(), seed);
    let metric = functions.relative_metric(&[1.0; 3], 10.0);
    let projection = project(constraints, &start, &metric);
    let solved = [ConicStatus::Solved, ConicStatus::Almost].contains(&projection.status);
    assert!(solved, "{:?}", projection.status);
    let worst = constraints.largest_violation(&projection.theta).unwrap();
    assert!(worst.relative <= 1e-7, "{worst:?}");
    projection.theta
}

fn bounds(of: CoefficientKind, min: f64, max: f64) -> Constraint {
    Constraint::Bounds {
        of,
        min: Some(TimeHistory::Constant(min)),
        max: Some(TimeHistory::Constant(max)),
    }
}

fn shape(of: CoefficientKind, shape: Shape) -> Constraint {
    Constraint::Shape { of, shape }
}

/// True if a derivative of function `j` is non-increasing everywhere, or for smooth bases at all nodes.
fn falls(functions: &Parameterization, theta: &[f64], j: usize, q: usize) -> bool {
    let basis = functions.iter().nth(j).unwrap().basis.clone().unwrap();
    let slack = 1e-6;
    if is_piecewise(&basis) {
        let values = dense(functions, theta, j, q, &fine());
        values.windows(2).all(|w| w[1] <= w[0] + slack)
    } else {
        let rates = dense(functions, theta, j, q + 1, &grid().times());
        rates.iter().all(|rate| *rate <= slack)
    }
}

/// Times at which a constraint on a basis is tested independently.
fn tested(basis: &Basis) -> Vec<f64> {
    match is_piecewise(basis) {
        true => fine(),
        false => grid().times(),
    }
}

#[test]
fn rows_agree_with_the_functions() {
    for basis in bases() {
        let functions = functions([&basis, &Basis::Nodal, &Basis::Constant]);
        let theta = random(functions.parameters(), 1);
        let held = Constraint::Value {
            of: MASS,
            at: 3.3,
            value: 0.0,
        };
        let group = &built(&held, &functions).groups[0];
        let value = dense(&functions, &theta, 0, 0, &[3.3])[0];
        let found = group.rows.multiply(&theta)[0];
        assert!((found - value).abs() < 1e-12, "{basis:?}: {found} {value}");

        // By the midpoint rule with enough cells for an error of at most 1e-6.
        let count = 200_000;
        let step = 10.0 / count as f64;
        let middles: Vec<f64> = (0..count).map(|i| 1.0 + (i as f64 + 0.5) * step).collect();
        let integral: f64 = dense(&functions, &theta, 0, 0, &middles)
            .iter()
            .map(|p| p * step)
            .sum();
        let (of, value) = (MASS, 1.0);
        let group = &built(&Constraint::Integral { of, value }, &functions).groups[0];
        let found = group.rows.multiply(&theta)[0];
        assert!(
            (found - integral).abs() < 1e-3,
            "{basis:?}: {found} {integral}"
        );
        let group = &built(&Constraint::Mean { of, value }, &functions).groups[0];
        let mean = group.rows.multiply(&theta)[0];
        assert!((mean - found / 10.0).abs() < 1e-12, "{basis:?}");
        assert_eq!(group.name, "mean of mass = 1");
        assert_eq!(group.bounds(0), [1.0, 1.0]);

        let slope = Constraint::Slope {
            of,
            min: Some(-1.0),
            max: None,
        };
        for group in &built(&slope, &functions).groups {
            if matches!(basis, Basis::PiecewiseConstant { .. }) {
                continue;
            }
            for (i, value) in group.rows.multiply(&theta).iter().enumerate() {
                let [from, to] = group.times[i];
                let slope = dense(&functions, &theta, 0, 1, &[0.5 * (from + to)])[0];
                assert!(
                    (value - slope).abs() < 1e-9 * (1.0 + slope.abs()),
                    "{basis:?}"
                );
            }
        }
    }
}

#[test]
fn projected_functions_satisfy_the_constraint_between_nodes() {
    let limit = |t: f64| 0.2 + 0.3 * (t - 1.0) / 10.0 * ((t - 1.0) * 2.0).sin();
    let moving = Constraint::Bounds {
        of: MASS,
        min: Some(TimeHistory::Nodal {
            name: "a column".into(),
            values: grid().times().iter().map(|t| limit(*t)).collect(),
        }),
        max: None,
    };
    for (seed, basis) in bases().iter().enumerate() {
        let functions = functions([basis, &Basis::Nodal, &Basis::Nodal]);
        let times = tested(basis);
        let values = |statement: &Constraint, q: usize| {
            let theta = inside(&built(statement, &functions), &functions, seed as u64);
            dense(&functions, &theta, 0, q, &times)
        };
        let slack = 1e-7;
        for p in values(&bounds(MASS, 0.5, 1.5), 0) {
            assert!((0.5 - slack..=1.5 + slack).contains(&p), "{basis:?} {p}");
        }
        for (p, t) in values(&moving, 0).iter().zip(&times) {
            // Limits are linear between the nodes.
            let x = (t - 1.0) / grid().step();
            let cell = (x as usize).min(NODES - 2);
            let share = x - cell as f64;
            let [a, b] = [limit(grid().time(cell)), limit(grid().time(cell + 1))];
            let least = a * (1.0 - share) + b * share;
            assert!(*p >= least - slack, "{basis:?} {t}: {p} {least}");
        }
        if matches!(basis, Basis::Constant) {
            continue;
        }
        let theta =
            |statement: &Constraint| inside(&built(statement, &functions), &functions, seed as u64);
        let falling = theta(&shape(MASS, Shape::NonIncreasing));
        assert!(falls(&functions, &falling, 0, 0), "{basis:?}");
        if !matches!(basis, Basis::PiecewiseConstant { .. }) {
            let slope = Constraint::Slope {
                of: MASS,
                min: Some(-0.1),
                max: Some(0.2),
            };
            for p in values(&slope, 1) {
                assert!((-0.1 - slack..=0.2 + slack).contains(&p), "{basis:?} {p}");
            }
        }
        if !matches!(
            basis,
            Basis::PiecewiseConstant { .. } | Basis::Polynomial { degree: 1 }
        ) {
            let bent = theta(&shape(MASS, Shape::Concave));
            assert!(falls(&functions, &bent, 0, 1), "{basis:?}");
        }
    }
}

/// The rows hold where functions known at the nodes satisfy them.
fn holds(constraints: &Constraints, nodal: [&dyn Fn(f64) -> f64; 3]) -> bool {
    let values = |f: &dyn Fn(f64) -> f64| grid().times().into_iter().map(f).collect::<Vec<_>>();
    let theta = nodal.map(values).concat();
    constraints.hold(&theta, 1e-9)
}

#[test]
fn the_true_system_is_passive_and_a_stiffening_spring_is_not() {
    let nodal = functions([&Basis::Nodal; 3]);
    let passive = built(&Constraint::Passive, &nodal);
    let names: Vec<&str> = passive.groups.iter().map(|g| g.name.as_str()).collect();
    assert_eq!(names, ["passive: c >= m'/2", "passive: k' <= 0"]);
    let decay = |t: f64| 1.0 - 0.02 * t;
    assert!(holds(&passive, [&decay, &|_| 0.0, &|_| 1.0]));
    assert!(!holds(&passive, [&decay, &|_| 0.0, &|t| 1.0 + 0.01 * t]));
    let growth = |t: f64| 1.0 + 0.02 * t;
    assert!(!holds(&passive, [&growth, &|_| 0.0, &|_| 1.0]));
    assert!(holds(&passive, [&growth, &|_| 0.01, &|_| 1.0]));

    // A mass with jumps may only jump down, and does not limit the damping in between.
    let knots = uniform_knots(&grid(), 3);
    let jumps = functions([
        &Basis::PiecewiseConstant { knots },
        &Basis::Constant,
        &Basis::Constant,
    ]);
    let passive = built(&Constraint::Passive, &jumps);
    assert!(passive.hold(&[1.0, 0.9, 0.0, 1.0], 0.0));
    assert!(!passive.hold(&[1.0, 1.1, 5.0, 1.0], 1e-9));
    assert!(!passive.hold(&[1.0, 0.9, -0.1, 1.0], 1e-9));
}

#[test]
fn the_cone_is_the_bound_on_the_damping_ratio() {
    let constants = |mass: f64, stiffness: f64| {
        let list = [(MASS, mass), (DAMPING, 1.0), (STIFFNESS, stiffness)];
        collect(list.map(|(q, p)| free(q, &Basis::Constant, p)).into())
    };
    let zeta: f64 = 0.2;
    for [mass, stiffness] in [[1.0, 1.0], [1e-3, 5e4], [2e5, 3.0]] {
        let functions = constants(mass, stiffness);
        let cones = built(&Constraint::DampingRatio { max: zeta }, &functions);
        assert_eq!(cones.cones[0].cones.len(), 1);
        let mut random = ChaCha8Rng::seed_from_u64(7);
        for _ in 0..1000 {
            let m: f64 = mass * random.random_range(0.0..2.0);
            let k: f64 = stiffness * random.random_range(0.0..2.0);
            let limit = 2.0 * zeta * (m * k).sqrt();
            let c = limit * random.random_range(-2.0..2.0);
            if (c.abs() - limit).abs() < 1e-6 * limit {
                continue;
            }
            let capped = c * c <= 4.0 * zeta * zeta * m * k;
            assert_eq!(cones.hold(&[m, c, k], 1e-12), capped, "{m} {c} {k}");
        }
        assert!(!cones.hold(&[-mass, 0.0, -stiffness], 1e-9));
    }
    // It holds between nodes as well, and fixed functions are constants of the cone.
    let nodal = functions([&Basis::Nodal, &Basis::Nodal, &Basis::Nodal]);
    let cap = built(&Constraint::DampingRatio { max: zeta }, &nodal);
    assert_eq!(cap.cones[0].cones.len(), NODES);
    let theta = inside(&cap, &nodal, 5);
    let [m, c, k] = [0, 1, 2].map(|j| dense(&nodal, &theta, j, 0, &fine()));
    for ((m, c), k) in m.iter().zip(&c).zip(&k) {
        assert!(c * c <= 4.0 * zeta * zeta * m * k + 1e-6, "{m} {c} {k}");
    }
    let known = CoefficientFunction::fixed(STIFFNESS, vec![4.0; NODES]);
    let list = vec![
        free(MASS, &Basis::Constant, 1.0),
        free(DAMPING, &Basis::Constant, 1.0),
        known,
    ];
    let cap = built(&Constraint::DampingRatio { max: zeta }, &collect(list));
    assert!(cap.hold(&[1.0, 0.8], 1e-12));
    assert!(!cap.hold(&[1.0, 0.81], 1e-12));
}

#[test]
fn bounds_and_fixed_values_hold_exactly() {
    for basis in bases() {
        if !is_piecewise(&basis) || matches!(basis, Basis::Polynomial { .. }) {
            continue;
        }
        let functions = functions([&basis; 3]);
        let (low, high) = (0.1 + 0.2, 1.0 / 0.7);
        let mut constraints = built(&bounds(MASS, low, high), &functions);
        constraints.extend(built(&bounds(DAMPING, 0.3, 0.3), &functions));
        constraints.extend(built(
            &Constraint::Value {
                of: STIFFNESS,
                at: 1.0,
                value: 0.7,
            },
            &functions,
        ));
        assert!(constraints.are_simple(), "{basis:?}");
        let mut theta = random(functions.parameters(), 9);
        constraints.clip(&mut theta);
        assert!(constraints.hold(&theta, 0.0));
        let knots = basis.knot_times(&grid());
        let m = dense(&functions, &theta, 0, 0, &knots);
        assert!(m.iter().all(|m| (low..=high).contains(m)), "{basis:?}");
        assert!(
            dense(&functions, &theta, 1, 0, &knots)
                .iter()
                .all(|c| *c == 0.3)
        );
        assert_eq!(dense(&functions, &theta, 2, 0, &[1.0]), [0.7]);
    }
}

fn problem(functions: Parameterization) -> Problem {
    let system = System {
        grid: grid(),
        method: Method::Midpoint,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    };
    let initial = State::one(1.0, 0.0);
    let experiment = Experiment::free("none", initial, system.grid.nodes());
    Problem::new(system, functions, vec![experiment]).unwrap()
}

#[test]
fn a_contradiction_names_exactly_the_two() {
    let functions = functions([&Basis::Nodal; 3]);
    let statements = [
        bounds(DAMPING, 0.0, 5.0),
        bounds(MASS, 1.0, 3.0),
        shape(MASS, Shape::NonIncreasing),
        Constraint::Mean {
            of: MASS,
            value: 0.5,
        },
        Constraint::Value {
            of: STIFFNESS,
            at: 1.0,
            value: 1.0,
        },
    ];
    let mut problem = problem(functions);
    for statement in &statements {
        let rows = built(statement, &problem.functions);
        problem = problem
            .with(|parts| {
                parts.constraints.extend(rows);
            })
            .unwrap();
    }
    let start = problem.functions.start();
    assert_eq!(
        problem.feasible_start(&start),
        StartProjection::Contradiction(vec!["mass >= 1".into(), "mean of mass = 0.5".into()])
    );
    let kept = |g: &RowGroup| g.name != "mean of mass = 0.5";
    let problem = problem
        .with(|parts| parts.constraints.groups.retain(kept))
        .unwrap();
    assert_eq!(problem.feasible_start(&start), StartProjection::Kept(start));
}
