use crate::problems::regular;
use kmcfit::dynamics::{Excitation, State};
use kmcfit::solvers::fit_from;
use kmcfit::study::bootstrap::{Noise, bootstrap};
use kmcfit::study::prediction::{Run, predict};
use kmcfit::study::profile::QUANTILE_95;
use kmcfit::study::pull_apart::{Level, tube};
use kmcfit::study::{Linear, Target};

/// The band is as wide as the spread of the motions of refitted devices; the worst case over the
/// extreme devices, which are at the ends of the same ellipse, is a little narrower than the band
/// where the motion depends on both numbers, and never wider.
#[test]
fn the_band_of_an_unseen_run_is_that_of_refitted_devices() {
    let problem = regular(3);
    let settings = crate::common::synthetic::settings();
    let best = fit_from(&problem, &problem.start(), &settings)
        .unwrap()
        .best;
    let covariance = problem.covariance(&best.evaluation).unwrap();
    let force: Vec<f64> = problem
        .oscillator
        .grid
        .times()
        .iter()
        .map(|t| (1.1 * t).sin())
        .collect();
    let run = Run {
        excitation: Some(Excitation::force_at_nodes(&force)),
        ..Run::free(
            "unseen",
            State {
                displacement: -0.5,
                velocity: 2.0,
            },
        )
    };
    let level = Level::of(best.evaluation.misfit + QUANTILE_95);
    let targets = [0, 1].map(|j| Target::Linear(Linear::parameter(j)));
    let bands = tube(&problem, &[best.parameters.clone()], &targets, &level, 2).unwrap();
    let extremes: Vec<_> = bands.into_iter().flat_map(|b| [b.low, b.high]).collect();
    let found = predict(
        &problem,
        &best.parameters,
        &run,
        Some(&covariance),
        &extremes,
    )
    .unwrap();
    let band = found.band.as_ref().unwrap();
    let worst = found.worst.as_ref().unwrap();
    assert!(found.without_motion.is_empty());
    assert_eq!(band[0], [-0.5, -0.5], "the state at the start is known");

    let refits = bootstrap(&problem, &best.parameters, Noise::Parametric, 1000, 3, 2).unwrap();
    let motions: Vec<Vec<f64>> = refits
        .found()
        .map(|theta| {
            predict(&problem, theta, &run, None, &[])
                .unwrap()
                .motion
                .displacement
        })
        .collect();
    for i in (10..101).step_by(10) {
        let y = found.motion.displacement[i];
        let count = motions.len() as f64;
        let mean = motions.iter().map(|m| m[i]).sum::<f64>() / count;
        let spread = (motions.iter().map(|m| (m[i] - mean).powi(2)).sum::<f64>() / count).sqrt();
        let half = 0.5 * (band[i][1] - band[i][0]);
        let ratio = half / (1.96 * spread);
        println!(
            "{i}: {y:.3} +- {half:.4}, refits {ratio:.3}, worst {:?}",
            worst[i]
        );
        // 1000 replicates know a spread to 2.2 %.
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
