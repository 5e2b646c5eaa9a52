use super::problems::regular;
use crate::common;
use kmcfit_core::functions::{Basis, Penalty, Ratio};
use kmcfit_core::identifiability::{Curve, Target};
use kmcfit_core::solvers::fit_from;
use kmcfit_core::study::{MisfitLimit, PredictionCase, QUANTILE_95, extreme_pairs};
use kmcfit_core::system::{Excitation, State};

/// The band is as wide as the spread of the responses of refitted systems. The envelope over the extreme systems, at the ends of
/// the same ellipse, is slightly narrower than the band where the response depends on both parameters, and never wider.
#[test]
fn the_band_of_a_prediction_agrees_with_refits() {
    let problem = regular(3);
    let settings = crate::common::synthetic::settings();
    let best = fit_from(&problem, &problem.start(), &settings)
        .unwrap()
        .best;
    let covariance = problem.covariance(&best.evaluation).unwrap();
    let force: Vec<f64> = problem
        .system
        .grid
        .times()
        .iter()
        .map(|t| (1.1 * t).sin())
        .collect();
    let run = PredictionCase {
        excitation: Some(Excitation::force_at_nodes(&force)),
        ..PredictionCase::free("another state", State::one(-0.5, 2.0))
    };
    let level = MisfitLimit::of(best.evaluation.misfit + QUANTILE_95);
    let targets = [0, 1].map(Target::parameter);
    let bands = extreme_pairs(
        &problem,
        std::slice::from_ref(&best.parameters),
        &targets,
        &level,
        2,
    )
    .unwrap();
    let extremes: Vec<_> = bands.into_iter().flat_map(|b| [b.low, b.high]).collect();
    let found = run
        .predict(&problem, &best.parameters, Some(&covariance), &extremes)
        .unwrap();
    let band = found.band.as_ref().unwrap();
    let worst = found.worst.as_ref().unwrap();
    assert!(found.unbounded.is_empty());
    assert_eq!(band[0], [-0.5, -0.5], "the state at the start is known");

    let responses: Vec<Vec<f64>> = (4..504)
        .map(|seed| {
            let again = regular(seed);
            let theta = fit_from(&again, &best.parameters, &settings)
                .unwrap()
                .best
                .parameters;
            let found = run.predict(&problem, &theta, None, &[]).unwrap();
            found.response.displacement(0).to_vec()
        })
        .collect();
    for i in (10..101).step_by(10) {
        let y = found.response.displacement(0)[i];
        let count = responses.len() as f64;
        let mean = responses.iter().map(|m| m[i]).sum::<f64>() / count;
        let spread = (responses.iter().map(|m| (m[i] - mean).powi(2)).sum::<f64>() / count).sqrt();
        let half = 0.5 * (band[i][1] - band[i][0]);
        let ratio = half / (1.96 * spread);
        println!(
            "{i}: {y:.3} +- {half:.4}, refits {ratio:.3}, worst {:?}",
            worst[i]
        );
        // A standard deviation from 500 records has a standard error of 3.2 %.
        assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
        assert!(worst[i][0] <= y && y <= worst[i][1]);
        assert!(
            worst[i][1] - worst[i][0] <= 2.2 * half,
            "{:?} {half}",
            worst[i]
        );
    }
    let (name, distance) = found.furthest.unwrap();
    assert!(name.contains("parameter") && distance > 0.0);
}

/// On the paper's data the extreme systems at its misfit have similar responses from nearly the same initial state, and
/// different ones from another state.
#[test]
fn systems_of_equal_fit_differ_in_prediction() {
    let nodes = 200;
    let mut problem = common::paper_problem(nodes, [2.0, 1.0, 1.0]);
    let grid = problem.system.grid;
    for f in [0, 2] {
        for j in problem.functions.ranges()[f].clone() {
            super::problems::bound(&mut problem, "positive", j, [0.05, f64::INFINITY]);
        }
    }
    let nodal = common::paper_system(nodes);
    let [c, k] = [0, 1].map(|j| &nodal.coefficients[j][..]);
    let truth = [&nodal.inertias[0][..], c, k].concat();
    let rows = |f: usize| Penalty::new(f, 2, 1.0, Basis::Nodal.roughness(&grid, 2));
    let level = MisfitLimit {
        budgets: (0..3).map(|f| (rows(f), 1e-3)).collect(),
        reach: 3.0,
        programs: 15,
        ..MisfitLimit::of(0.0114)
    };
    // Extremes of c/m and k/m, the ratios that a free response determines.
    let ratios = [Ratio::DampingOverMass, Ratio::StiffnessOverMass].map(Curve::Ratio);
    let targets = ratios.map(|ratio| Target::Value(ratio, 12.0));
    let bands = extreme_pairs(&problem, std::slice::from_ref(&truth), &targets, &level, 2).unwrap();
    for band in &bands {
        println!(
            "{}: {:.3} .. {:.3}, {} + {} programs",
            band.low.function,
            band.low.value,
            band.high.value,
            band.low.programs,
            band.high.programs
        );
    }
    let extremes: Vec<_> = bands.into_iter().flat_map(|b| [b.low, b.high]).collect();
    let distance = |displacement: f64, velocity: f64| {
        let run = PredictionCase::free("other", State::one(displacement, velocity));
        let found = run.predict(&problem, &truth, None, &extremes).unwrap();
        let worst = found.worst.unwrap();
        let response = found.response.displacement(0);
        let inside = worst
            .iter()
            .zip(response)
            .all(|(w, y)| w[0] <= *y && *y <= w[1]);
        assert!(inside && found.band.is_none());
        found.furthest.unwrap().1
    };
    let (near, far) = (distance(3.301, 1.001), distance(-3.3, 1.0));
    println!("from nearly the same state {near:.3} m, from another {far:.3} m");
    assert!(far > 3.0 * near, "{near} {far}");
}
