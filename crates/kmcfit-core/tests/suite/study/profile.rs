use super::problems::knots;
use super::problems::{
    Record, bound, constants, linear, nodal, problem, regular, samples, scalar, system,
};
use kmcfit_core::constraints::RowGroup;
use kmcfit_core::functions::{Basis, CoefficientFunction, Penalty, ScalarValue};
use kmcfit_core::identifiability::{Curve, Target};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, Sensor, Weighting};
use kmcfit_core::solvers::{fit, fit_from};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::study::{
    End, Interval, MisfitLimit, Profile, ProfileSettings, QUANTILE_95, extreme_pairs, profile,
};
use kmcfit_core::system::{Excitation, Method};
use nalgebra::DMatrix;

fn optimum(problem: &Problem) -> Vec<f64> {
    let settings = crate::common::synthetic::settings();
    fit_from(problem, &problem.start(), &settings)
        .unwrap()
        .best
        .parameters
}

fn of(problem: &Problem, j: usize) -> Profile {
    profile(
        problem,
        &optimum(problem),
        &Target::parameter(j),
        &ProfileSettings::default(),
    )
    .unwrap()
}

/// Standard error of a quantity at `theta`.
pub(super) fn error(
    problem: &Problem,
    q: &Target,
    theta: &[f64],
    covariance: &DMatrix<f64>,
) -> f64 {
    let q = q.at(problem, theta).unwrap();
    q.with_covariance(covariance, f64::INFINITY).standard_error
}

/// `q +- sqrt(3.841 C_qq)` where the predictions are linear in the parameters.
fn is_closed_form(problem: &Problem, q: &Target) {
    let best = optimum(problem);
    let evaluation = problem.evaluate(&best).unwrap();
    let covariance = problem.covariance(&evaluation).unwrap();
    let half = (QUANTILE_95 * error(problem, q, &best, &covariance).powi(2)).sqrt();
    let found = profile(problem, &best, q, &ProfileSettings::default()).unwrap();
    assert_eq!(found.verdict, Interval::Identified);
    let [low, high] = found.interval.map(Option::unwrap);
    let expected = [
        q.at(problem, &best).unwrap().value - half,
        q.at(problem, &best).unwrap().value + half,
    ];
    println!(
        "{}: {low} {high}, {expected:?}, {} fits",
        found.name,
        found.values.len()
    );
    assert!(
        (low - expected[0]).abs() < 1e-6 * half,
        "{low} {expected:?}"
    );
    assert!(
        (high - expected[1]).abs() < 1e-6 * half,
        "{high} {expected:?}"
    );
    assert_eq!(found.ends, [End::Rise, End::Rise]);
    assert!(found.better_optimum.is_none());
    // The cost is the parabola at every value on the way.
    for (value, cost) in found.values.iter().zip(&found.costs) {
        let parabola = QUANTILE_95 * ((value - q.at(problem, &best).unwrap().value) / half).powi(2);
        let rise = cost - found.optimum_cost;
        assert!(
            (rise - parabola).abs() < 1e-6 * (1.0 + parabola),
            "{value}: {rise} {parabola}"
        );
    }
}

#[test]
fn initial_state_and_offset_have_the_intervals_of_linear_regression() {
    let problem = linear(1);
    for index in 0..3 {
        is_closed_form(&problem, &Target::Scalar(index));
    }
}

#[test]
fn the_gain_of_a_driven_sensor_has_its_closed_form() {
    let system = system(10.0, 201);
    let force: Vec<f64> = system
        .grid
        .times()
        .iter()
        .map(|t| (1.3 * t).sin())
        .collect();
    let excitation = Excitation::force_at_nodes(&force);
    let truth = [1.0, 0.1, 2.0];
    let values = samples(&system, &nodal(201, truth), Some(&excitation), 4, 0.05, 2);
    let record = Record {
        sensor: Sensor {
            gain: ScalarValue::Estimated(0),
            offset: ScalarValue::Estimated(1),
            ..Sensor::default()
        },
        excitation: Some(excitation),
        ..Record::of(values, 4)
    };
    let scalars = vec![scalar("gain", 0.7, None), scalar("offset", 0.1, None)];
    let problem = problem(system, constants(201, [None; 3], truth), scalars, record);
    is_closed_form(&problem, &Target::Scalar(0));
}

#[test]
fn damping_and_stiffness_of_a_known_mass_are_identified() {
    let problem = regular(3);
    for j in 0..2 {
        let found = of(&problem, j);
        let evaluation = problem.evaluate(&optimum(&problem)).unwrap();
        let covariance = problem.covariance(&evaluation).unwrap();
        let deviation = error(
            &problem,
            &Target::parameter(j),
            &optimum(&problem),
            &covariance,
        );
        let [low, high] = found.interval.map(Option::unwrap);
        println!("{}", found.sentence());
        assert_eq!(found.verdict, Interval::Identified);
        // 1.96 standard deviations up to the nonlinearity of the model, a few per cent here.
        let width = (high - low) / (2.0 * 1.96 * deviation);
        assert!((width - 1.0).abs() < 0.1, "{width}");
        assert!(found.sentence().contains("identified"));
    }
}

/// A free response determines k/m and c/m; m, c and k themselves are not identifiable.
#[test]
fn the_mass_of_a_free_response_has_a_flat_profile() {
    let system = system(10.0, 101);
    let values = samples(&system, &nodal(101, [1.0, 0.2, 2.0]), None, 2, 0.05, 3);
    let list = constants(101, [Some(1.0), Some(0.2), Some(2.0)], [0.0; 3]);
    let mut problem = problem(system, list, Vec::new(), Record::of(values, 2));
    bound(&mut problem, "mass from 0.5 to 3", 0, [0.5, 3.0]);
    let found = of(&problem, 0);
    println!("{}", found.sentence());
    assert_eq!(found.verdict, Interval::Flat);
    assert_eq!(found.ends, [End::Bound, End::Bound]);
    assert!(
        (found.values[0] - 0.5).abs() < 1e-6 && (found.values.last().unwrap() - 3.0).abs() < 1e-6
    );
    let most = found
        .costs
        .iter()
        .fold(0.0f64, |m, c| m.max(c - found.optimum_cost));
    assert!(most < 1e-6, "{most}");
    assert!(found.sentence().contains("not identifiable"));
}

/// The noise permits zero damping: the lower end of the profile is the bound.
#[test]
fn a_damping_near_its_bound_is_one_sided() {
    let system = system(10.0, 101);
    let values = samples(&system, &nodal(101, [1.0, 0.0, 2.0]), None, 2, 0.05, 5);
    let list = constants(101, [None, Some(0.02), Some(2.0)], [1.0, 0.0, 0.0]);
    let mut problem = problem(system, list, Vec::new(), Record::of(values, 2));
    bound(&mut problem, "damping >= 0", 0, [0.0, f64::INFINITY]);
    let found = of(&problem, 0);
    println!("{}", found.sentence());
    assert_eq!(found.verdict, Interval::OneSided);
    assert_eq!(found.ends, [End::Bound, End::Rise]);
    assert!(found.interval[0].is_none() && found.interval[1].is_some());
    assert!(found.sentence().contains("at most"));
}

/// The same free response, but the stiffness must not exceed 3: a mass above 1.5 times its ratio fits
/// worse, though the samples do not determine the mass.
#[test]
fn a_rise_caused_by_another_bound_is_reported() {
    let system = system(10.0, 101);
    let values = samples(&system, &nodal(101, [1.0, 0.2, 2.0]), None, 2, 0.05, 3);
    let list = constants(101, [Some(1.0), Some(0.2), Some(2.0)], [0.0; 3]);
    let mut problem = problem(system, list, Vec::new(), Record::of(values, 2));
    bound(&mut problem, "mass from 0.5 to 5", 0, [0.5, 5.0]);
    bound(&mut problem, "stiffness <= 3", 2, [f64::NEG_INFINITY, 3.0]);
    let found = of(&problem, 0);
    println!("{}", found.sentence());
    assert_eq!(found.verdict, Interval::OneSided);
    assert_eq!(found.ends[1], End::RiseBy(vec!["stiffness <= 3".into()]));
    assert!(found.sentence().contains("stiffness <= 3"));
    // k/m is 2 within one per cent or two.
    assert!((found.interval[1].unwrap() - 1.5).abs() < 0.05);
}

/// From a local minimum the profile reaches the global one and reports it.
#[test]
fn a_better_optimum_on_the_way_is_reported() {
    let problem = super::multistart::aliased(0.0);
    let how = ProfileSettings {
        limits: [1.0, 60.0],
        // Above the maxima between the minima, of some thousands.
        quantile: 1e5,
        step: Some(0.1),
        ..ProfileSettings::default()
    };
    let q = Target::parameter(0);
    let found = profile(&problem, &[7.546], &q, &how).unwrap();
    println!("{}", found.sentence());
    let better = found.better_optimum.as_ref().expect("2.25 or 22.88");
    assert!(problem.evaluate(better).unwrap().cost < found.optimum_cost - 100.0);
    assert!(found.sentence().contains("better minimum"));
}

/// One value of m at each of 101 nodes, smoothed: the profile of one of them holds the truth, and the
/// cost at its ends is the quantile above the optimum's.
#[test]
fn a_nodal_function_has_a_profile() {
    let sigma = 0.02;
    let system = crate::common::system(101, Method::Rk4);
    let nodal = crate::common::paper_system(101);
    let values = crate::common::noisy(&system, &nodal, sigma, 5);
    let mut list = constants(101, [None; 3], [1.0, 0.0, 1.0]);
    list[0] = CoefficientFunction::nodal(CoefficientKind::MASS, vec![1.0; 101]);
    let mut problem = crate::common::problem_of(system, list, values, Some(sigma));
    let rows = Basis::Nodal.roughness(&problem.system.grid, 2);
    problem.penalize(Penalty::new(0, 2, 1e4, rows)).unwrap();
    let settings = crate::common::synthetic::settings();
    let best = fit(&problem, &problem.start(), &settings, &mut |_| {}).unwrap();
    let q = Target::Value(Curve::Function(0), 12.5);
    let how = ProfileSettings::default();
    let found = profile(&problem, &best.best.parameters, &q, &how).unwrap();
    println!("{} ({} fits)", found.sentence(), found.values.len());
    let [low, high] = found.interval.map(Option::unwrap);
    let truth = nodal.inertias[0][50];
    assert!(low < truth && truth < high, "{low} {truth} {high}");
    for end in [low, high] {
        let i = found.values.iter().position(|v| *v == end).unwrap();
        let rise = found.costs[i] - found.optimum_cost;
        assert!((rise / QUANTILE_95 - 1.0).abs() < 1e-6, "{rise}");
    }
}

/// Without sigma, `n ln(1 + d^2/(SSR V)) = 3.841` where the predictions are linear, `V` the
/// parameter's diagonal of `(J'J)^-1`: the covariance is `V SSR/(n - p)`.
#[test]
fn without_sigma_the_interval_is_that_of_the_likelihood_ratio() {
    let problem = linear(4);
    let problem = problem
        .with(|parts| {
            for experiment in &mut parts.experiments {
                let plain = |c: &Channel| {
                    let weights = vec![1.0; c.len()];
                    c.clone().with_weighting(Weighting::Trapezoid(weights))
                };
                experiment.channels = experiment.channels.iter().map(plain).collect();
            }
        })
        .unwrap();
    let best = optimum(&problem);
    let covariance = problem
        .covariance(&problem.evaluate(&best).unwrap())
        .unwrap();
    let (n, p) = (problem.sample_count() as f64, 3.0);
    let q = Target::Scalar(1);
    let half =
        ((QUANTILE_95 / n).exp_m1() * (n - p)).sqrt() * error(&problem, &q, &best, &covariance);
    let found = profile(&problem, &best, &q, &ProfileSettings::default()).unwrap();
    let [low, high] = found.interval.map(Option::unwrap);
    let middle = q.at(&problem, &best).unwrap().value;
    println!("{low} {high}, {} {}", middle - half, middle + half);
    assert!((low - (middle - half)).abs() < 1e-6 * half);
    assert!((high - (middle + half)).abs() < 1e-6 * half);
}

/// A mean over time, under constraints about several parameters at once (a falling stiffness): the
/// profile and the extremes give the same interval.
#[test]
fn the_mean_of_a_monotone_function_has_the_same_ends_both_ways() {
    let mut problem = knots(&|t| 2.0 - 0.02 * t, 6, 0.05, 9);
    let first = problem.functions.ranges()[2].start;
    let mut group = RowGroup::new("stiffness falls");
    for j in first..first + 5 {
        group.push(
            [(j, -1.0), (j + 1, 1.0)],
            [f64::NEG_INFINITY, 0.0],
            [0.0, 10.0],
        );
    }
    problem = problem
        .with(|parts| {
            parts.constraints.groups.push(group);
        })
        .unwrap();
    let best = optimum(&problem);
    let misfit = problem.evaluate(&best).unwrap().misfit;
    let q = Target::Mean(Curve::Function(2));
    let at = Target::Value(Curve::Function(2), 4.0);
    let (nodal, theta) = (problem.functions.nodal(&best), &best);
    let node = (4.0 / problem.system.grid.step()).round() as usize;
    assert!((at.at(&problem, theta).unwrap().value - nodal.coefficients[1][node]).abs() < 1e-12);
    assert!(
        Target::Value(Curve::Function(2), 10.1)
            .at(&problem, &best)
            .is_none()
    );
    let list = [q, at];
    let how = ProfileSettings::default();
    let found = list
        .each_ref()
        .map(|of| profile(&problem, &best, of, &how).unwrap());
    let level = MisfitLimit::of(misfit + QUANTILE_95);
    let bands = extreme_pairs(&problem, std::slice::from_ref(&best), &list, &level, 1).unwrap();
    for (profile, band) in found.iter().zip(&bands) {
        let [low, high] = profile.interval.map(Option::unwrap);
        // Clarabel keeps rows about several parameters to 1e-9 of their size; along a level's root
        // that is some 1e-5 of the width.
        let tolerance = 1e-4 * (high - low);
        assert!((band.low.value - low).abs() < tolerance);
        assert!((band.high.value - high).abs() < tolerance);
    }
}
