use super::problems::regular;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::record::{Channel, Weighting};
use kmcfit_core::internals::solvers::fit_from;
use kmcfit_core::internals::study::Linear;
use kmcfit_core::internals::study::bootstrap::{ReplicateNoise, bootstrap};

fn optimum(problem: &Problem) -> Vec<f64> {
    let settings = crate::common::synthetic::settings();
    fit_from(problem, &problem.start(), &settings)
        .unwrap()
        .best
        .parameters
}

/// A standard deviation from 2000 replicates has a standard error of 1/sqrt(4000), 1.6 %; the limit of ten per cent is six of those
/// and allows for the nonlinearity of the model.
#[test]
fn the_scatter_of_the_refits_agrees_with_the_covariance() {
    let problem = regular(7);
    let best = optimum(&problem);
    let check = |problem: &Problem, noise: ReplicateNoise| {
        let evaluation = problem.evaluate(&best).unwrap();
        let exact = problem.covariance(&evaluation).unwrap();
        let found = bootstrap(problem, &best, noise, 2000, 11, 2).unwrap();
        assert_eq!(found.failures(), 0);
        let spread = found.covariance().unwrap();
        for j in 0..2 {
            let ratio = (spread[(j, j)] / exact[(j, j)]).sqrt();
            println!("{noise:?} {j}: {ratio:.4}");
            assert!((ratio - 1.0).abs() < 0.1, "{noise:?} {j}: {ratio}");
            let q = Linear::parameter(j);
            let [low, high] = found.interval(&q, 0.95).unwrap();
            let width = (high - low) / (2.0 * 1.96 * exact[(j, j)].sqrt());
            assert!((width - 1.0).abs() < 0.1, "{width}");
            assert!(low < best[j] && best[j] < high);
        }
    };
    check(&problem, ReplicateNoise::Parametric);
    // The standard deviation of 51 residuals is accurate to a tenth; the covariance uses it.
    let problem = problem
        .with(|parts| {
            for experiment in &mut parts.experiments {
                let plain = |c: &Channel| {
                    c.clone()
                        .with_weighting(Weighting::Trapezoid(vec![1.0; c.len()]))
                };
                experiment.channels = experiment.channels.iter().map(plain).collect();
            }
        })
        .unwrap();
    check(&problem, ReplicateNoise::Residual);
}

#[test]
fn the_threads_change_no_bit() {
    let problem = regular(8);
    let best = optimum(&problem);
    for noise in [ReplicateNoise::Parametric, ReplicateNoise::Residual] {
        let [one, three] =
            [1, 3].map(|threads| bootstrap(&problem, &best, noise, 20, 5, threads).unwrap());
        assert_eq!(one, three);
        let other = bootstrap(&problem, &best, noise, 20, 6, 1).unwrap();
        assert_ne!(one.replicates, other.replicates);
    }
}
