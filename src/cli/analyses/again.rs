//! The same fit again: from many starts, with less freedom, on other noise.

use super::linear;
use crate::config::{Model, StudyPlan};
use crate::report::study::*;
use kmcfit_core::internals::functions::Parameterization;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::study::Linear;
use kmcfit_core::internals::study::bootstrap::{Noise, bootstrap};
use kmcfit_core::internals::study::multistart::{self, Multistart, Ranges, between};
use kmcfit_core::internals::study::variation::{Asking, variation};

/// Steps of the paths between two optima.
const PATH: usize = 40;
/// A path that rises by less than this share of the higher end's cost joins two ends of one valley.
const RISE: f64 = 0.05;

/// Fits from many starts.
pub fn multistart(
    model: &Model,
    problem: &Problem,
    theta: &[f64],
    plan: &StudyPlan,
    threads: usize,
) -> MultistartPiece {
    let how = Multistart {
        // Between the bounds, where all functions have them on both sides.
        ranges: Ranges::of_bounds(problem)
            .unwrap_or_else(|| Ranges::Constants(ranges(&problem.functions, plan.spread))),
        starts: plan.starts,
        seed: plan.seed,
        threads,
        attempts: false,
        settings: model.settings.clone(),
    };
    let waterfall = multistart::multistart(problem, &how);
    let tolerance = multistart::Distance {
        ratios: plan.same,
        motions: plan.same,
    };
    let clusters = waterfall.clusters(problem, tolerance);
    let mut sentences = vec![match waterfall.costs().first() {
        None => format!("none of {} starts led anywhere", plan.starts),
        Some(lowest) => format!(
            "{} of {} starts led to {} different points; the lowest cost is {lowest:.6e}",
            waterfall.order.len(),
            plan.starts,
            clusters.len().max(1),
        ),
    }];
    let of = |cluster: &multistart::Cluster| {
        let found = waterfall.runs[cluster.members[0]].found.as_ref();
        found.map(|f| f.parameters.clone())
    };
    if let (Some(first), Some(second)) = (clusters.first(), clusters.get(1))
        && let (Some(a), Some(b)) = (of(first), of(second))
    {
        let paths = between(problem, &a, &b, PATH);
        let rise = RISE * second.cost.max(first.cost);
        sentences.push(match paths.one_valley(rise) {
            true => "the two lowest are ends of one valley: a path between them hardly rises".into(),
            false => {
                "between the two lowest the cost rises on the straight path and along the gauge: no \
                 path without a rise was found"
                    .into()
            }
        });
    }
    // Below this share of what there is to explain a difference of costs is rounding.
    let rounding = 1e-12 * problem.zero_response_misfit();
    if let (Ok(here), Some(best)) = (problem.evaluate(theta), waterfall.costs().first()) {
        if *best < here.cost * (1.0 - 1e-6) - rounding {
            sentences.push(format!(
                "a start led lower than the fit: {best:.6e} instead of {:.6e}",
                here.cost
            ));
        } else if *best > here.cost * 1.01 + rounding {
            sentences.push(format!(
                "no start reached the fit, whose cost is {:.6e}: they were too far off, or got stuck",
                here.cost
            ));
        }
    }
    MultistartPiece {
        costs: waterfall.costs(),
        failures: (waterfall.runs.iter())
            .filter(|run| run.found.is_none())
            .map(|run| run.reason.clone())
            .collect(),
        clusters: (clusters.iter())
            .map(|c| ClusterRecord {
                starts: c.members.len(),
                cost: c.cost,
            })
            .collect(),
        sentences,
    }
}

/// Between the start divided and multiplied by `spread`; about zero where the start is zero.
fn ranges(functions: &Parameterization, spread: f64) -> Vec<[f64; 2]> {
    let around = |start: f64, size: f64| match start == 0.0 {
        true => [-size, size],
        false => {
            let (a, b) = (start / spread, start * spread);
            [a.min(b), a.max(b)]
        }
    };
    let of_functions = functions.iter().map(|f| {
        let mut values = vec![0.0; functions.nodes()];
        f.values_into(&f.start, &mut values);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        around(mean, 1.0)
    });
    let of_scalars = functions.scalars().iter().map(|s| around(s.start, s.size));
    of_functions.chain(of_scalars).collect()
}

/// Whether each function varies.
///
/// # Errors
/// Why it cannot be said.
pub fn varies(
    problem: &Problem,
    theta: &[f64],
    plan: &StudyPlan,
    threads: usize,
) -> Result<Vec<VariesRecord>, String> {
    let asking = Asking {
        level: 1.0 - plan.confidence,
        seed: plan.seed,
        threads,
        ..Asking::default()
    };
    let found = variation(problem, theta, &asking).map_err(|breakdown| breakdown.to_string())?;
    let record = |v: kmcfit_core::internals::study::variation::Varies| VariesRecord {
        sentence: v.sentence(),
        p_value: v.p_value,
        name: v.function,
    };
    Ok(found.into_iter().map(record).collect())
}

/// Intervals of the profiled numbers and of all constants and scalars from refits.
///
/// # Errors
/// Why there are none.
pub fn refits(
    problem: &Problem,
    theta: &[f64],
    plan: &StudyPlan,
    threads: usize,
) -> Result<Vec<BootstrapRecord>, String> {
    let evaluation = problem.evaluate(theta).map_err(|b| b.to_string())?;
    if problem.covariance(&evaluation).is_none() {
        return Err(
            "the readings do not determine all parameters, or these are more than 64: refits from the \
             optimum would not move where nothing is seen"
                .into(),
        );
    }
    let found = bootstrap(
        problem,
        theta,
        match plan.residual_noise {
            true => Noise::Residual,
            false => Noise::Parametric,
        },
        plan.replicates,
        plan.seed,
        threads,
    );
    let found = found.map_err(|breakdown| breakdown.to_string())?;
    let constants = problem.functions.iter().enumerate();
    let constants = constants
        .filter(|(_, f)| f.parameters() == 1)
        .map(|(f, _)| Linear::mean(problem, f));
    let scalars = 0..problem.functions.scalars().len();
    let scalars = scalars.map(|i| Linear::scalar(problem, i));
    let asked = plan.profiles.iter().filter_map(|t| linear(problem, t));
    let mut records: Vec<BootstrapRecord> = Vec::new();
    for of in constants.chain(scalars).chain(asked) {
        if records.iter().all(|r| r.name != of.name) {
            records.push(BootstrapRecord {
                interval: found.interval(&of, plan.confidence),
                name: of.name,
                unit: of.unit,
            });
        }
    }
    Ok(records)
}
