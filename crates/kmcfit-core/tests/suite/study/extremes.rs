use super::problems::{linear, regular};
use super::profile::error;
use crate::common::{csv, initial, paper_problem, paper_system, shared};
use kmcfit_core::constraints::RowGroup;
use kmcfit_core::functions::{Basis, Penalty, Ratio};
use kmcfit_core::identifiability::{Curve, Target};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::Loss;
use kmcfit_core::solvers::fit_from;
use kmcfit_core::study::{
    ExtremeStatus, MisfitLimit, ProfileSettings, QUANTILE_95, extreme, extreme_pairs,
    is_within_rounding, profile, values_at,
};

fn optimum(problem: &Problem) -> (Vec<f64>, f64) {
    let settings = crate::common::synthetic::settings();
    let best = fit_from(problem, &problem.start(), &settings).unwrap().best;
    (best.parameters, best.evaluation.misfit)
}

/// Linear predictions: `misfit = best + d' C^-1 d`, so the extreme of `q` is `sqrt(rise q' C q)` away.
#[test]
fn the_extremes_of_an_ellipse_are_those_of_its_closed_form() {
    let problem = linear(1);
    let (best, misfit) = optimum(&problem);
    let covariance = problem
        .covariance(&problem.evaluate(&best).unwrap())
        .unwrap();
    let level = MisfitLimit::of(misfit + QUANTILE_95);
    let mixed = Target::Parameters(vec![(0, 1.0), (1, -0.5)]);
    for q in [Target::parameter(0), Target::parameter(1), mixed] {
        let half = QUANTILE_95.sqrt() * error(&problem, &q, &best, &covariance);
        for (largest, expected) in [
            (true, q.at(&problem, &best).unwrap().value + half),
            (false, q.at(&problem, &best).unwrap().value - half),
        ] {
            let found = extreme(&problem, &best, &q, largest, &level).unwrap();
            println!(
                "{}: {} {expected}, {:?} {}",
                found.name(),
                found.value,
                found.ended,
                found.programs
            );
            assert!((found.value - expected).abs() < 1e-6 * half, "{found:?}");
            assert_eq!(found.ended, ExtremeStatus::Converged);
            let fresh = problem.evaluate(&found.parameters).unwrap().misfit;
            assert!(fresh == found.misfit && fresh <= level.misfit);
        }
    }
}

/// Profiles and extremes give the same interval.
#[test]
fn the_extremes_are_the_ends_of_the_profile() {
    let problem = regular(3);
    let (best, misfit) = optimum(&problem);
    let level = MisfitLimit::of(misfit + QUANTILE_95);
    for j in 0..2 {
        let q = Target::parameter(j);
        let profile = profile(&problem, &best, &q, &ProfileSettings::default()).unwrap();
        let [low, high] = profile.interval.map(Option::unwrap);
        let bands = extreme_pairs(&problem, std::slice::from_ref(&best), &[q], &level, 2).unwrap();
        let found = [bands[0].low.value, bands[0].high.value];
        println!("{found:?} {low} {high}");
        let q = Target::parameter(j);
        let one = extreme_pairs(&problem, std::slice::from_ref(&best), &[q], &level, 1).unwrap();
        assert_eq!(one, bands, "the threads change no bit");
        let tolerance = 1e-6 * (high - low);
        assert!((found[0] - low).abs() < tolerance && (found[1] - high).abs() < tolerance);
    }
}

/// A robust loss with outliers.
#[test]
fn with_a_robust_loss_the_extremes_are_the_ends_of_the_profile() {
    let problem = regular(3);
    let channel = problem.experiments[0].channels[0].clone();
    let far = |i: usize| if i % 10 == 3 { 1.0 } else { 0.0 };
    let samples = channel.observed().iter().enumerate();
    let samples = samples.map(|(i, y)| y + far(i)).collect();
    let channel = channel.with_samples(samples);
    let channel = channel.with_loss(Loss::Huber { threshold: 1.345 });
    let problem = problem
        .with(|parts| parts.experiments[0].channels[0] = channel)
        .unwrap();
    let (best, misfit) = optimum(&problem);
    let level = MisfitLimit::of(misfit + QUANTILE_95);
    let q = Target::parameter(1);
    let how = ProfileSettings::default();
    let profile = profile(&problem, &best, &q, &how).unwrap();
    let [low, high] = profile.interval.map(Option::unwrap);
    let targets = [q];
    let bands = extreme_pairs(&problem, std::slice::from_ref(&best), &targets, &level, 2).unwrap();
    let found = [bands[0].low.value, bands[0].high.value];
    println!("{found:?} {low} {high}");
    // Few samples cross the threshold near the misfit limit, so the error of reweighting is small: 1e-7.
    let tolerance = 1e-5 * (high - low);
    assert!((found[0] - low).abs() < tolerance && (found[1] - high).abs() < tolerance);
}

const NODES: usize = 200;

/// The paper's problem with 200 nodes, `m >= 0.05` and `k >= 0.05`.
fn positive() -> Problem {
    let mut problem = paper_problem(NODES, [2.0, 1.0, 1.0]);
    for f in [0, 2] {
        let mut group = RowGroup::new(format!("function {f} >= 0.05"));
        for j in problem.functions.ranges()[f].clone() {
            group.push([(j, 1.0)], [0.05, f64::INFINITY], [0.0, 25.0]);
        }
        problem = problem
            .with(|parts| {
                parts.constraints.groups.push(group);
            })
            .unwrap();
    }
    problem
}

/// 200 nodes, the misfit of the paper's own optimum, 0.0114 m^2 s: the extremes, started at the true
/// system, contain the paper's optimum.
#[test]
fn extremes_of_the_paper_s_data_contain_the_truth_and_the_paper_s_optimum() {
    let problem = positive();
    let nodal = paper_system(NODES);
    let truth = [
        &nodal.inertias[0][..],
        &nodal.coefficients[0],
        &nodal.coefficients[1],
    ]
    .concat();
    let level = MisfitLimit {
        reach: 4.0,
        programs: 25,
        ..MisfitLimit::of(0.0114)
    };
    let times = [5.0, 15.0];
    let optimum = shared("reference").map(|folder| csv(&folder.join("paper_optimum.csv")));
    let columns = [1, 3, 2];
    for f in 0..3 {
        let targets = values_at(&problem, Curve::Function(f), &times);
        let clock = std::time::Instant::now();
        let bands =
            extreme_pairs(&problem, std::slice::from_ref(&truth), &targets, &level, 2).unwrap();
        for (band, time) in bands.iter().zip(times) {
            let [low, high] = [&band.low, &band.high];
            println!(
                "{} .. {}: {:.4} ({:?} {}) .. {:.4} ({:?} {}), {:.1} s",
                low.name(),
                high.name(),
                low.value,
                low.ended,
                low.programs,
                high.value,
                high.ended,
                high.programs,
                clock.elapsed().as_secs_f64()
            );
            for end in [low, high] {
                let fresh = problem.evaluate(&end.parameters).unwrap();
                assert!(fresh.misfit <= 0.0114 && fresh.misfit == end.misfit);
                assert!(problem.constraints.hold(&end.parameters, 1e-9));
                assert_eq!(
                    fresh.trajectories[0].displacement(0)[0],
                    initial().displacement(0)
                );
            }
            let node = (time / problem.system.grid.step()) as usize;
            let exact = truth[f * NODES + node];
            assert!(low.value < exact && exact < high.value, "{low:?} {high:?}");
            if let Some(rows) = &optimum {
                let row = (time / 25.0 * 1999.0) as usize;
                let paper = rows[row][columns[f]];
                assert!(
                    low.value < paper && paper < high.value,
                    "{} {paper} {}",
                    low.value,
                    high.value
                );
            }
        }
    }
}

/// A free response determines k/m: its extremes are bounded, those of k and m are not.
#[test]
fn ratios_have_extremes_of_their_own() {
    let problem = regular(3);
    let system = problem.system.clone();
    let n = system.grid.nodes();
    let list = super::problems::constants(n, [Some(1.0), Some(0.2), Some(2.0)], [0.0; 3]);
    let functions = kmcfit_core::functions::Parameterization::new(list, n, system.grid.step());
    let problem = problem
        .with(|parts| parts.functions = functions.unwrap())
        .unwrap();
    let (best, misfit) = optimum(&problem);
    let level = MisfitLimit::of(misfit + QUANTILE_95);
    let targets = values_at(&problem, Curve::Ratio(Ratio::StiffnessOverMass), &[3.0]);
    let bands = extreme_pairs(&problem, std::slice::from_ref(&best), &targets, &level, 2).unwrap();
    let (known, start) = (regular(3), best[2] / best[0]);
    let (fixed, _) = optimum(&known);
    let profile = profile(
        &known,
        &fixed,
        &Target::parameter(1),
        &ProfileSettings::default(),
    )
    .unwrap();
    let [low, high] = profile.interval.map(Option::unwrap);
    println!(
        "{} {start} {}; {low} {high}",
        bands[0].low.value, bands[0].high.value
    );
    // With the mass known to be 1, k/m is k.
    let tolerance = 1e-5 * (high - low);
    assert!((bands[0].low.value - low).abs() < tolerance);
    assert!((bands[0].high.value - high).abs() < tolerance);
}

/// With the scale fixed by k(0) = 1 and smooth functions the extremes are bounded, and a smaller limit
/// makes them narrower.
#[test]
fn roughness_limits_bound_the_extremes() {
    let mut problem = positive();
    let k0 = problem.functions.ranges()[2].start;
    super::problems::bound(&mut problem, "k(0) = 1", k0, [1.0, 1.0]);
    let nodal = paper_system(NODES);
    let truth = [
        &nodal.inertias[0][..],
        &nodal.coefficients[0],
        &nodal.coefficients[1],
    ]
    .concat();
    let grid = problem.system.grid;
    let mut before: Option<[f64; 2]> = None;
    for budget in [1e-3, 1e-5] {
        let rows = |f: usize| Penalty::new(f, 2, 1.0, Basis::Nodal.roughness(&grid, 2));
        let level = MisfitLimit {
            budgets: (0..3).map(|f| (rows(f), budget)).collect(),
            ..MisfitLimit::of(0.0114)
        };
        let targets = values_at(&problem, Curve::Function(0), &[15.0]);
        let clock = std::time::Instant::now();
        let band =
            &extreme_pairs(&problem, std::slice::from_ref(&truth), &targets, &level, 2).unwrap()[0];
        let ends = [&band.low, &band.high];
        println!(
            "budget {budget:e}: {:?} in {:.1} s",
            ends.map(|e| (e.value, e.ended, e.programs)),
            clock.elapsed().as_secs_f64()
        );
        let exact = nodal.inertias[0][(15.0 / grid.step()) as usize];
        assert!(band.low.value < exact && exact < band.high.value);
        for end in ends {
            assert!(end.misfit <= 0.0114);
            for f in 0..3 {
                let range = problem.functions.ranges()[f].clone();
                assert!(rows(f).roughness(&end.parameters[range]) <= budget * 1.0001);
            }
        }
        let found = ends.map(|e| e.value);
        if let Some(wider) = before {
            assert!(wider[0] < found[0] && found[1] < wider[1]);
        }
        before = Some(found);
    }
}

/// On the paper's grid its optimum is within the misfit limit, and the search starts there.
#[test]
fn the_paper_s_optimum_is_within_its_level_on_its_grid() {
    let Some(folder) = shared("reference") else {
        return;
    };
    let rows = csv(&folder.join("paper_optimum.csv"));
    let n = rows.len();
    let problem = paper_problem(n, [2.0, 1.0, 1.0]);
    let column = |c: usize| rows.iter().map(|r| r[c]).collect::<Vec<f64>>();
    let optimum = [column(1), column(3), column(2)].concat();
    let level = MisfitLimit {
        programs: 4,
        ..MisfitLimit::of(0.0114)
    };
    let clock = std::time::Instant::now();
    let q = values_at(&problem, Curve::Function(0), &[12.5]).remove(0);
    let found = extreme(&problem, &optimum, &q, false, &level).unwrap();
    println!(
        "{}: {} from {}, {:?}, {:.1} s",
        found.name(),
        found.value,
        q.at(&problem, &optimum).unwrap().value,
        found.ended,
        clock.elapsed().as_secs_f64()
    );
    assert!(found.misfit <= 0.0114 && found.value < q.at(&problem, &optimum).unwrap().value);
}

/// Samples that the response matches to machine precision give no limit of the misfit once penalties determine every function.
#[test]
fn an_exact_fit_of_penalised_functions_has_no_range() {
    let n = 100;
    let mut problem = paper_problem(n, [2.0, 1.0, 1.0]);
    let truth = paper_system(n);
    let theta = [
        truth.inertias[0].clone(),
        truth.coefficients[0].clone(),
        truth.coefficients[1].clone(),
    ];
    let theta = theta.concat();
    let exact = problem.evaluate(&theta).unwrap();
    assert!(!is_within_rounding(&problem, &exact));
    for f in 0..3 {
        let rows = Basis::Nodal.roughness(&problem.system.grid, 1);
        problem.penalize(Penalty::new(f, 1, 1.0, rows)).unwrap();
    }
    let exact = problem.evaluate(&theta).unwrap();
    assert!(is_within_rounding(&problem, &exact));
    let mut other = theta;
    other[n / 2] *= 1.001;
    let off = problem.evaluate(&other).unwrap();
    assert!(!is_within_rounding(&problem, &off));
}
