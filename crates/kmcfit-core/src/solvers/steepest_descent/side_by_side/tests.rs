use super::*;
use crate::dynamics::{Grid, Method, Oscillator, State, Term};
use crate::functions::{Basis, CoefficientFunction, Functions, Quantity};
use crate::objective::Channel;
use crate::problem::Experiment;
use crate::solvers::{Fit, FitSettings, Solver, Stopping, fit_from};

const NODES: usize = 401;

/// The paper's problem, smaller, and yet worth a second thread.
fn problem() -> Problem {
    let grid = Grid::new(0.0, 10.0, NODES).expect("a grid");
    let oscillator = Oscillator {
        grid,
        method: Method::Midpoint,
        terms: vec![Term::Damping, Term::Stiffness],
    };
    let nodal = |quantity, start: f64| {
        CoefficientFunction::free(quantity, Basis::Nodal, &grid, vec![start; NODES])
    };
    let list = vec![
        nodal(Quantity::Mass, 2.0),
        nodal(Quantity::Damping, 1.0),
        nodal(Quantity::Stiffness, 1.0),
    ];
    let functions = Functions::new(list, NODES, grid.step()).expect("functions");
    let times = grid.times().into_iter();
    let readings = times.map(|t| (-0.05 * t).exp() * (1.1 * t).cos()).collect();
    let spacing = grid.step();
    let weighting = Weighting::Integral { spacing };
    let channel = Channel::displacement_at_nodes(readings, 1, weighting, &grid);
    let initial = State {
        displacement: 1.0,
        velocity: 0.0,
    };
    let experiment = Experiment::free("decay", initial, NODES).with_channel(channel);
    Problem::new(oscillator, functions, vec![experiment])
}

fn settings() -> FitSettings {
    FitSettings {
        solver: Solver::SteepestDescent,
        gradient: GradientKind::Continuous,
        stopping: Stopping {
            iterations: 60,
            ..Stopping::default()
        },
        ..FitSettings::default()
    }
}

fn fitted(problem: &Problem) -> Fit {
    fit_from(problem, &problem.start(), &settings()).expect("a motion")
}

/// A search of some steps, with what is done to the second thread before each.
fn search(problem: &Problem, steps: usize, before: impl Fn(usize, &mut SideBySide)) -> Vec<Point> {
    let settings = settings();
    let mut counted = argmin::core::Problem::new(problem);
    let mut work = Work::new(&mut counted, None, &settings);
    let mut evaluation = problem.workspace();
    let evaluated = work.evaluate_into(&problem.start(), &mut evaluation);
    evaluated.expect("a motion");
    let mut points = vec![work.complete(problem.start(), evaluation)];
    let (mut side_by_side, mut spare) = (SideBySide::default(), Vec::new());
    for step in 0..steps {
        before(step, &mut side_by_side);
        let point = points.last().expect("a point");
        let lengths = lengths(point);
        let ray = ray(problem, point, &lengths).expect("the paper's problem");
        let best = side_by_side.lowest(&mut work, point, ray, &lengths, &mut spare);
        let best = best.expect("a lower cost");
        points.push(work.complete(best.parameters, best.evaluation));
    }
    points
}

/// Each step is the best of the trials that are evaluated one by one, whether there is a second thread or not.
#[test]
fn steps_are_the_best_of_all_trials() {
    let problem = problem();
    let together = search(&problem, 12, |_, _| {});
    let alone = crate::threads::sharing(|| search(&problem, 12, |_, _| {}));
    for (step, pair) in together.windows(2).enumerate() {
        let (before, after) = (&pair[0], &pair[1]);
        let mut lowest = (before.evaluation.cost, 0.0);
        for length in lengths(before) {
            let mut evaluation = problem.workspace();
            let parameters = trial(before, length);
            let evaluated = problem.evaluate_in_order_into(&parameters, &mut evaluation);
            if evaluated.is_ok() && evaluation.cost < lowest.0 {
                lowest = (evaluation.cost, length);
            }
        }
        assert_eq!(after.evaluation.cost, lowest.0, "step {step}");
        assert!(after.parameters == trial(before, lowest.1), "step {step}");
        assert!(alone[step + 1].parameters == after.parameters);
        assert!(alone[step + 1].gradient == after.gradient);
    }
}

/// Where the second thread is elsewhere, or has not begun, its share is done here.
#[test]
fn a_second_thread_that_is_elsewhere_changes_nothing() {
    let problem = problem();
    let together = search(&problem, 12, |step, side_by_side| {
        let Some(companion) = &mut side_by_side.companion else {
            return;
        };
        match step % 5 {
            // It takes the step and another one.
            0 => {
                companion.finish();
                companion.post(|follower| {
                    let states = follower.trials.states((0, 0));
                    let length = 1e-6;
                    follower.step = states.map(|states| Taken { length, states });
                });
            }
            // What it has been told is taken back.
            3 => {
                companion.finish();
            }
            _ => {}
        }
    });
    let alone = crate::threads::sharing(|| search(&problem, 12, |_, _| {}));
    for (together, alone) in together.iter().zip(&alone) {
        assert!(together.parameters == alone.parameters && together.gradient == alone.gradient);
    }
}

#[test]
fn fits_do_not_depend_on_the_second_thread() {
    let problem = problem();
    let (together, alone) = (
        fitted(&problem),
        crate::threads::sharing(|| fitted(&problem)),
    );
    assert_eq!(together.history.len(), 60);
    assert!(together.history == alone.history);
    assert!(together.best.parameters == alone.best.parameters);
}

/// The other thread's way by itself: the same point, and the trials of its rows.
#[test]
fn the_follower_comes_to_the_same_point() {
    let problem = problem();
    let points = search(&problem, 3, |_, _| {});
    let mut follower = Follower {
        problem: problem.clone(),
        kind: GradientKind::Continuous,
        point: points[0].clone(),
        step: None,
        trials: Trials::default(),
    };
    follower.go();
    for pair in points.windows(2) {
        let (before, after) = (&pair[0], &pair[1]);
        let lengths = lengths(before);
        let ray = ray(&problem, before, &lengths).expect("the paper's problem");
        let (layout, mut trials) = (Layout::new(ray, &lengths), Trials::default());
        trials.run(ray, &layout, 0..rows_of_the_other(layout.rows()));
        assert_eq!(follower.trials.costs(), trials.costs());
        let taken = lengths
            .iter()
            .position(|a| trial(before, *a) == after.parameters);
        let taken = taken.expect("one of the trials");
        let (row, lane) = layout.place(taken);
        let first = row / 4 * 4;
        trials.run(ray, &layout, first..layout.rows().min(first + 4));
        follower.step = Some(Taken {
            length: lengths[taken],
            states: trials.states((row, lane)).expect("states"),
        });
        follower.go();
        assert!(follower.point.parameters == after.parameters);
        assert!(follower.point.gradient == after.gradient);
        assert!(follower.point.evaluation.trajectories == after.evaluation.trajectories);
    }
}

/// States that are not those of the motion lead to the motion all the same.
#[test]
fn a_motion_does_not_depend_on_its_states() {
    let problem = problem();
    let mut expected = problem.workspace();
    let evaluated = problem.evaluate_in_order_into(&problem.start(), &mut expected);
    evaluated.expect("a motion");
    let mut found = problem.workspace();
    for states in [[[0.0; LANES]; 2], [[f64::NAN; LANES]; 2]] {
        assert!(move_to(&problem, &problem.start(), states, &mut found));
        assert!(found.device == expected.device && found.trajectories == expected.trajectories);
        assert!(found.predictions == expected.predictions);
    }
    let mut without_mass = problem.start();
    without_mass[7] = -1.0;
    assert!(!move_to(
        &problem,
        &without_mass,
        [[0.0; LANES]; 2],
        &mut found
    ));
}
