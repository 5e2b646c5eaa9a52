//! Starting point fitted to growing parts of the record.

use crate::problem::Problem;
use crate::solvers::executor::search;
use crate::solvers::observer::Observer;
use crate::solvers::settings::FitSettings;
use crate::solvers::solve_counts::SolveCounts;
use crate::solvers::timings::Timings;

/// Parts of the record fitted before the whole record.
const HORIZONS: [f64; 3] = [0.125, 0.25, 0.5];
/// Iteration limit on each part.
const HORIZON_ITERATIONS: u64 = 20;

/// Parameters `from` fitted to growing parts of the record, and the work.
pub(in crate::solvers) fn growing_horizon_start(
    problem: &Problem,
    from: Vec<f64>,
    settings: &FitSettings,
    observer: &mut Observer,
) -> (Vec<f64>, SolveCounts, Timings) {
    let (mut counts, mut timings) = (SolveCounts::default(), Timings::default());
    let mut parameters = from;
    let mut short = settings.clone();
    short.stopping.iterations = HORIZON_ITERATIONS;
    for share in HORIZONS {
        let part = problem.truncated(share);
        let found =
            observer.unreported(|observer| search(&part, &parameters, &short, None, observer));
        if let Ok(fit) = found {
            counts += fit.counts;
            timings += fit.timings;
            parameters = fit.best.parameters;
        }
    }
    (parameters, counts, timings)
}
