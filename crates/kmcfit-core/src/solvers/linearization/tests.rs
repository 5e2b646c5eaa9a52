use super::halves::Half;
use super::*;
use crate::builder::{Builder, Record};
use crate::functions::{
    Basis, CoefficientFunction, CoefficientKind, Parameterization, ScalarParameter,
};
use crate::model::CoefficientSpec;
use crate::noise::{Autoregression, Correlation, CorrelationLaw};
use crate::objective::GradientKind;
use crate::record::{Channel, ChannelKind, Experiment, NoiseEstimate, Weighting};
use crate::signal::low_pass;
use crate::solvers::settings::FitSettings;
use crate::solvers::solve_counts::SolveCounts;
use crate::solvers::{Fit, fit, fit_from};
use crate::step::tangents::TILE;
use crate::structure::{Law, Structure};
use crate::system::{Excitation, Grid, Method, State, System};
use crate::threads;

fn fitted(problem: &Problem) -> Fit {
    let settings = FitSettings::default();
    fit(problem, &problem.start(), &settings, &mut |_| {}).expect("a motion")
}

/// A driven oscillator over a long record with displacements at every seventh node, accelerations at every node and
/// velocities between nodes; the initial velocity is estimated. The stiffness has `knots` knots, or is a constant.
fn long_problem(knots: Option<u32>) -> Problem {
    let grid = Grid::new(0.0, 330.0, 33_001).expect("a grid");
    let nodes = grid.nodes();
    let constant = |quantity, start| CoefficientFunction::constant(quantity, start, nodes);
    let stiffness = match knots {
        None => constant(CoefficientKind::STIFFNESS, 2.2),
        Some(knots) => {
            let spacing = grid.duration() / f64::from(knots - 1);
            let knots: Vec<f64> = (0..knots).map(|i| f64::from(i) * spacing).collect();
            let start = knots.iter().map(|t| 2.2 + 1e-3 * t).collect();
            let basis = Basis::PiecewiseLinear { knots };
            CoefficientFunction::free(CoefficientKind::STIFFNESS, basis, &grid, start)
        }
    };
    let list = vec![
        constant(CoefficientKind::MASS, 1.1),
        constant(CoefficientKind::DAMPING, 0.3),
        stiffness,
    ];
    let speed = ScalarParameter {
        name: "speed".into(),
        unit: "m/s".into(),
        start: 0.1,
        size: 1.0,
        prior: None,
    };
    let functions = Parameterization::new(list, nodes, grid.step()).expect("functions");
    let times = grid.times();
    let force: Vec<f64> = (times.iter())
        .map(|t| (0.9 * t).sin() + (1.7 * t).cos())
        .collect();
    let read = |t: &f64| (0.9 * t).cos() - (1.7 * t).sin();
    let channel = |kind, times: Vec<f64>| {
        let values = times.iter().map(read).collect();
        let weighting = Weighting::Sigma(0.1);
        Channel::new(kind, times, values, weighting, &grid, nodes).expect("samples")
    };
    let sevenths = times.iter().step_by(7).copied().collect();
    let between = times.iter().step_by(50).map(|t| t + 0.3 * grid.step());
    let between = between.filter(|t| *t < grid.duration()).collect();
    let record = Experiment {
        initial_parameters: vec![None, Some(0)],
        ..Experiment::free("driven", State::rest(1), nodes)
            .with_excitation(Excitation::force_at_nodes(&force))
            .with_channel(channel(ChannelKind::Displacement, sevenths))
            .with_channel(channel(ChannelKind::Velocity, between))
            .with_channel(channel(ChannelKind::Acceleration, times.clone()))
    };
    let system = System {
        grid,
        method: Method::Rk4,
        structure: Structure::one(vec![Law::Damping, Law::Stiffness]),
    };
    let functions = functions.with_scalars(vec![speed]);
    Problem::new(system, functions, vec![record]).unwrap()
}

/// The second half begins where a tile of the first ends, and the halves differ by less than two tiles. A short record has no
/// middle.
#[test]
fn the_middle_of_a_long_record_is_the_last_end_of_a_tile_in_its_first_half() {
    let problem = long_problem(None);
    let half = (problem.experiments[0].nodes - 1) / 2;
    let middle = problem.middle().expect("one long record");
    assert!(middle.is_multiple_of(TILE), "{middle}");
    assert!((0..TILE).contains(&(half - middle)), "{middle} of {half}");
    assert_eq!(short_problem().middle(), None);
}

/// The joined halves agree with the reduction of the whole record and with the adjoint: for few parameters, and for numbers
/// of parameters that leave one SIMD lane or none for the state in the middle.
#[test]
fn halves_of_a_long_record_agree_with_the_whole() {
    for (knots, parameters) in [(None, 4), (Some(4), 7), (Some(5), 8)] {
        let problem = long_problem(knots);
        assert_eq!(problem.parameters(), parameters);
        let theta = problem.start();
        let halfway = halfway(&problem).expect("it is long");
        let evaluation = problem.evaluate(&theta).expect("a motion");
        let second = Half::second(&problem, &evaluation, halfway);
        let joined = Half::first(&problem, &evaluation, halfway).join(&second);
        let whole = Reduced::block_by_block(&problem, &evaluation, &mut Timings::default());
        let solution = |reduced: &Reduced| reduced.solution().expect("independent columns");
        for (joined, whole) in solution(&joined).iter().zip(solution(&whole)) {
            let off = (joined - whole).abs();
            assert!(off <= 1e-10 * whole.abs(), "{joined} {whole}");
        }
        let found = joined.misfit_gradient().expect("finite numbers");
        let expected = problem.gradient(&theta, &evaluation, GradientKind::Discrete);
        for (found, expected) in found.iter().zip(&expected.euclidean) {
            let off = (found - expected).abs();
            assert!(off <= 1e-10 * expected.abs(), "{found} {expected}");
        }
    }
}

/// After short steps adjoint solves replace tangents, with the same result: the gradient is that of an adjoint, and the
/// linearised samples predict no further step.
#[test]
fn the_jacobian_is_reused_after_short_steps() {
    let mut problem = long_problem(None);
    let truth: Vec<f64> = problem.start().iter().map(|p| 1.02 * p).collect();
    let response = problem.evaluate(&truth).expect("a motion");
    let channels = problem.parts_mut().experiments[0].channels.iter_mut();
    for (channel, predicted) in channels.zip(&response.predictions[0]) {
        let samples = predicted.iter().enumerate();
        let noisy = samples.map(|(i, y)| y + (7.0 * i as f64).sin()).collect();
        *channel = channel.clone().with_samples(noisy);
    }
    let settings = FitSettings::default();
    let fit = fit_from(&problem, &problem.start(), &settings).expect("a motion");
    let points = fit.history.len() as u64 + 1;
    let parameters = problem.parameters() as u64;
    let SolveCounts {
        adjoint, tangent, ..
    } = fit.counts;
    assert!(0 < adjoint && adjoint < points);
    // One at each point without an adjoint, and where a step with an earlier one fails at the level of rounding.
    let jacobians = tangent / parameters;
    assert_eq!(tangent, jacobians * parameters);
    assert!((points - adjoint..points).contains(&jacobians));
    let theta = &fit.best.parameters;
    // The gradient at the end may come from either method: both have the rounding error of the one at the start.
    let at_start = problem.evaluate(&problem.start()).expect("a motion");
    let at_start = problem.gradient(&problem.start(), &at_start, GradientKind::Discrete);
    let expected = problem.gradient(theta, &fit.best.evaluation, GradientKind::Discrete);
    let gradients = fit.best.gradient.euclidean.iter().zip(&expected.euclidean);
    for ((found, expected), size) in gradients.zip(&at_start.euclidean) {
        assert!(
            (found - expected).abs() <= 1e-11 * size.abs(),
            "{found} {expected} {size}"
        );
    }
    let mut timings = Timings::default();
    let reduced = reduce(&problem, &fit.best.evaluation, &mut timings);
    let step = reduced.solution().expect("independent columns");
    let order = problem.positions();
    // What the last step, with a Jacobian computed before, has left: less than the tolerance of the cost.
    let mut minimum = theta.clone();
    (step.iter().zip(order)).for_each(|(step, j)| minimum[j] += step);
    let lowest = problem.evaluate(&minimum).expect("a motion").cost;
    let cost = fit.best.evaluation.cost;
    assert!(cost - lowest <= 1e-10 * cost, "{cost} {lowest}");
}

/// Results on one thread and on two are bit-identical.
#[test]
fn a_long_record_has_the_same_result_on_two_threads() {
    let problem = long_problem(None);
    let alone = threads::sharing(|| fitted(&problem));
    let together = threads::given(2, || fitted(&problem));
    assert!(together.history == alone.history && !together.history.is_empty());
    assert_eq!(together.counts, alone.counts);
    assert_eq!(together.best.parameters, alone.best.parameters);
}

/// The continuous gradient, which needs an adjoint, is available for long records.
#[test]
fn a_long_record_is_fitted_by_the_continuous_gradient() {
    let mut problem = long_problem(None);
    let grid = problem.system.grid;
    let samples = grid.times().iter().map(|t| (0.9 * t).cos()).collect();
    let spacing = grid.step();
    let weighting = Weighting::Integral { spacing };
    let channel = Channel::displacement_at_nodes(samples, 1, weighting, &grid);
    problem.parts_mut().experiments[0].channels = vec![channel];
    assert!(problem.supports_continuous() && halfway(&problem).is_some());
    let mut settings = FitSettings {
        gradient: GradientKind::Continuous,
        ..FitSettings::default()
    };
    settings.stopping.iterations = 3;
    let run = || fit(&problem, &problem.start(), &settings, &mut |_| {}).expect("a motion");
    let (alone, together) = (threads::sharing(run), threads::given(2, run));
    assert!(together.history == alone.history && !together.history.is_empty());
    assert_eq!(together.counts, alone.counts);
}

/// A driven oscillator with displacements at nodes and accelerations between them, and seven parameters.
fn short_problem() -> Problem {
    let grid = Grid::new(0.0, 8.0, 161).expect("a grid");
    let force: Vec<f64> = grid.times().iter().map(|t| (2.0 * t).sin()).collect();
    let knots = CoefficientSpec::piecewise_linear(5, 4.0);
    let constants = [1.2, 0.3].map(CoefficientSpec::constant);
    let [mass, damping] = constants;
    let between: Vec<f64> = grid.times().iter().take(150).map(|t| t + 0.02).collect();
    let values = |times: &[f64]| -> Vec<f64> { times.iter().map(|t| 0.1 * t.cos()).collect() };
    let record = Record::new("driven")
        .from_state(0.1, 0.0)
        .force(&grid.times(), &force)
        .displacement(&grid.times(), &values(&grid.times()))
        .sigma(0.05)
        .acceleration(&between, &values(&between))
        .sigma(0.05);
    Builder::new([mass, damping, knots])
        .record(record)
        .grid(grid)
        .build()
        .expect("a problem")
}

/// The step with the states as unknowns is that of the whole Jacobian.
fn assert_steps_agree_with_and_without_states(problem: &Problem) {
    let evaluation = problem.evaluate(&problem.start()).expect("a motion");
    let whole = of_whole_jacobian(problem, &evaluation, &mut Timings::default());
    let steps = structured::steps(problem, &evaluation);
    let with_states = structured::subproblem(problem, &evaluation, &steps);
    let [expected, found] = [whole, with_states].map(|sub| {
        let step = sub.solve_equality_constrained().expect("one minimum");
        step[..problem.parameters()].to_vec()
    });
    for (found, expected) in found.iter().zip(&expected) {
        // Both are orthogonal eliminations of a Jacobian with a condition below 1e4.
        assert!(
            (found - expected).abs() <= 1e-9 * expected.abs().max(1e-3),
            "{found} {expected}"
        );
    }
}

/// Under correlated noise the step is that of the whitened Jacobian.
#[test]
fn steps_under_correlated_noise_agree_with_and_without_states() {
    let mut problem = short_problem();
    for channel in &mut problem.parts_mut().experiments[0].channels {
        let process = Autoregression::new(vec![0.8, -0.4]).expect("stationary");
        let law = CorrelationLaw::Autoregressive(process);
        let noise = NoiseEstimate {
            correlation: Correlation::new(law, channel.times()),
            ..NoiseEstimate::default()
        };
        *channel = channel.clone().with_noise(noise);
    }
    assert_steps_agree_with_and_without_states(&problem);
}

/// The recurrences of a filter of two sections, forward and backward, are the filter of each column of the Jacobian.
#[test]
fn steps_from_filtered_channels_agree_with_and_without_states() {
    let mut problem = short_problem();
    let filter = low_pass(4, 3.0, 20.0).expect("a filter");
    for channel in &mut problem.parts_mut().experiments[0].channels {
        *channel = channel.clone().with_filter(filter.clone());
    }
    assert_steps_agree_with_and_without_states(&problem);
}
