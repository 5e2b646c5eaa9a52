//! The paper's run: each published and each recomputed number.

use crate::common;
use kmcfit::report::predict;
use kmcfit_core::objective::GradientKind;
use kmcfit_core::solvers::{Fit, FitSettings, Initial, Solver, Status, Stopping, fit};
use kmcfit_core::system::{State, System, trapezoid};
use std::sync::OnceLock;

/// Iteration, J/J0 after it, G^2/G0^2 before it: computed from the formulas of the paper in plain
/// IEEE doubles by an independent program.
const HISTORY: [(u64, f64, f64); 49] = [
    (1, 0.805374434665086, 1.0),
    (2, 0.728959452813438, 0.235024066349757),
    (3, 0.668523789135147, 0.0912043611597697),
    (5, 0.545037108290288, 0.0987439684408027),
    (7, 0.527024781653273, 0.129462046601463),
    (10, 0.502271088537243, 0.114630444991764),
    (15, 0.431198494796304, 0.239693215138396),
    (20, 0.41099425657481, 0.139819830084462),
    (25, 0.392767073790552, 0.173915795846029),
    (30, 0.377092896580953, 0.131680031790557),
    (32, 0.370766794570182, 0.0932941405672427),
    (40, 0.345222057826488, 0.0863441829520068),
    (50, 0.277010846877836, 0.0484514843340164),
    (60, 0.24127278399035, 0.0565848875535385),
    (70, 0.231708142432112, 0.0508068420203588),
    (80, 0.219532060079902, 0.27365658018525),
    (90, 0.177151603597215, 0.123761612464179),
    (100, 0.124736721348246, 0.12170780606402),
    (110, 0.111144322699304, 0.0789993227497019),
    (120, 0.0960638112995387, 0.204665277218206),
    (130, 0.0838470995917502, 0.124276243781549),
    (140, 0.0559140241421977, 0.0828728198789365),
    (150, 0.0305804882345867, 0.0761628596243313),
    (160, 0.00829081159968554, 0.0334890742399075),
    (170, 0.00538644690761671, 0.0160603803192188),
    (180, 0.00489441721366908, 0.0137381440204285),
    (190, 0.00359235787787141, 0.0026031866548629),
    (200, 0.00341651324122044, 0.0041834764808023),
    (225, 0.00182656275239142, 0.00054055036334855),
    (250, 0.00152063281709599, 0.000284277032080636),
    (275, 0.00148130822544269, 0.000347767920009583),
    (300, 0.00143919669834257, 0.000129852107093535),
    (350, 0.0013077213852325, 7.86387249969741e-05),
    (400, 0.00120638162822363, 0.000270346702929553),
    (450, 0.000797691311767803, 3.54202936117151e-05),
    (500, 0.000496723080486514, 5.7584438308408e-05),
    (550, 0.000346592105960926, 0.000129796870235027),
    (600, 0.000322989432695989, 0.000116786207987121),
    (650, 0.000239320687365664, 8.33893240053437e-06),
    (700, 0.000207875964741642, 7.77239193217152e-06),
    (750, 0.000196158246860949, 6.97394636536692e-06),
    (800, 0.000159697114428443, 5.55546917243632e-06),
    (850, 0.000133923220809894, 4.79302019172114e-06),
    (900, 0.000103220833760037, 2.48001258107586e-06),
    (907, 9.80758778088539e-05, 0.00113521079483597),
    (908, 9.80440626184717e-05, 6.3412915229787e-06),
    (950, 9.15813615445858e-05, 1.40309662277112e-05),
    (999, 8.13430772414773e-05, 2.66087818500128e-06),
    (1000, 8.13015527774769e-05, 1.06256344103462e-05),
];

/// Tolerance of J/J0. Both programs do the same operations in the same order, so only a change of the arithmetic changes J/J0,
/// and by far more than this.
const TOLERANCE: f64 = 1e-9;

fn settings(stopping: Stopping) -> FitSettings {
    FitSettings {
        solver: Solver::SteepestDescent,
        initial: Initial::Functions,
        gradient: GradientKind::Continuous,
        stopping,
        qp: kmcfit_core::solvers::QpSolver::Auto,
        interrupt: None,
    }
}

fn paper_run() -> &'static Fit {
    static RUN: OnceLock<Fit> = OnceLock::new();
    RUN.get_or_init(|| {
        let problem = common::paper_problem(2000, [2.0, 1.0, 1.0]);
        let start = problem.functions.start();
        fit(
            &problem,
            &start,
            &settings(Stopping::exactly(1000)),
            &mut |_| {},
        )
        .unwrap()
    })
}

#[test]
fn the_paper_s_run_is_reproduced() {
    let run = paper_run();
    assert_eq!(run.outcome.status, Status::Completed);
    assert_eq!(run.history.len(), 1000);
    assert!((run.initial_cost / 139.826904874 - 1.0).abs() < 1e-11);
    for (iteration, cost_ratio, gradient_ratio) in HISTORY {
        let row = &run.history[iteration as usize - 1];
        assert!(
            (row.cost_ratio / cost_ratio - 1.0).abs() < TOLERANCE,
            "{row:?}"
        );
        assert!(
            (row.gradient_norm_squared_ratio / gradient_ratio - 1.0).abs() < TOLERANCE,
            "{row:?}"
        );
    }
}

#[test]
fn all_rows_and_the_optimum_follow_the_shared_reference() {
    let Some(folder) = common::shared("reference") else {
        return;
    };
    let run = paper_run();
    let history = common::csv(&folder.join("paper_history.csv"));
    assert_eq!(history.len(), 1000);
    for (row, expected) in run.history.iter().zip(&history) {
        assert!(
            (row.cost_ratio / expected[2] - 1.0).abs() < TOLERANCE,
            "{row:?}"
        );
    }
    let optimum = common::csv(&folder.join("paper_optimum.csv"));
    let device = &run.best.evaluation.nodal;
    for (i, row) in optimum.iter().enumerate() {
        assert!((device.inertias[0][i] - row[1]).abs() < 1e-9);
        assert!((device.coefficients[1][i] - row[2]).abs() < 1e-9);
        assert!((device.coefficients[0][i] - row[3]).abs() < 1e-9);
    }
}

#[test]
fn the_gradient_at_the_start_has_the_known_norm_and_integrals() {
    let problem = common::paper_problem(2000, [2.0, 1.0, 1.0]);
    let here = problem.evaluate(&problem.functions.start()).unwrap();
    let gradient = problem.gradient(&problem.functions.start(), &here, GradientKind::Continuous);
    assert!((gradient.norm_squared / 1127.38210431 - 1.0).abs() < 1e-11);
    let dt = problem.system.grid.step();
    let expected = [23.47941458, -9.07073615, -37.88810824];
    for (range, expected) in problem.functions.ranges().iter().zip(expected) {
        let integral = trapezoid(&gradient.l2[range.clone()], dt);
        assert!((integral - expected).abs() < 5.1e-9, "{integral}");
    }
}

#[test]
fn the_paper_s_stopping_rule_is_first_met_at_iteration_908() {
    let problem = common::paper_problem(2000, [2.0, 1.0, 1.0]);
    let rule = Stopping {
        cost_ratio: Some(1e-4),
        gradient_ratio: Some(1e-4),
        ..Stopping::exactly(1000)
    };
    let run = fit(
        &problem,
        &problem.functions.start(),
        &settings(rule),
        &mut |_| {},
    )
    .unwrap();
    assert_eq!(run.outcome.status, Status::Converged);
    assert_eq!(run.history.len(), 908);
}

#[test]
fn the_paper_s_optimum_does_not_predict() {
    let expected = [
        (3.301, 1.001, 0.011391, 131.7),
        (3.31, 1.01, 0.012036, 132.6),
        (3.4, 1.1, 0.061533, 141.5),
        (-1.0, 0.0, 0.91209, 10.89),
        (-3.3, 1.0, 39.730, 126.9),
    ];
    let system: System = common::system(2000, kmcfit_core::system::Method::Midpoint);
    let states: Vec<State> = expected
        .iter()
        .map(|&(displacement, velocity, ..)| State::one(displacement, velocity))
        .collect();
    let truth = common::paper_system(2000);
    let device = &paper_run().best.evaluation.nodal;
    let motions = predict(&system, device, Some(&truth), &states).unwrap();
    for (motion, (.., cost, energy)) in motions.iter().zip(expected) {
        let found = (motion.summary.cost.unwrap(), motion.summary.energy.unwrap());
        // Five digits of the cost and four of the energy are known.
        assert!((found.0 / cost - 1.0).abs() < 5e-5, "{found:?}");
        assert!((found.1 / energy - 1.0).abs() < 5e-4, "{found:?}");
    }
}

#[test]
fn steepest_descent_with_the_discrete_gradient_also_descends() {
    let problem = common::paper_problem(2000, [2.0, 1.0, 1.0]);
    let with = |gradient| FitSettings {
        gradient,
        ..settings(Stopping::exactly(30))
    };
    let start = problem.functions.start();
    let [discrete, continuous] = [GradientKind::Discrete, GradientKind::Continuous]
        .map(|kind| fit(&problem, &start, &with(kind), &mut |_| {}).unwrap());
    // The two gradients differ by at most 5e-3 at N = 2000, so the first steps agree.
    let ratio = discrete.history[0].cost / continuous.history[0].cost;
    assert!((ratio - 1.0).abs() < 5e-3, "{ratio}");
    assert!(discrete.cost_ratio() < 0.5, "{}", discrete.cost_ratio());
}
