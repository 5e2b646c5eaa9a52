//! Other devices that match: tubes, and those with the same motion.

use crate::config::{Equivalent, StudyPlan};
use crate::report::study::*;
use kmcfit_core::internals::diagnostics::chi_square_one;
use kmcfit_core::internals::functions::CoefficientKind;
use kmcfit_core::internals::objective::Evaluation;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::study::equivalent::{Motion, Wish, equivalent};
use kmcfit_core::internals::study::pull_apart::{
    Ended, Extreme, Level, ratios_at, tube, values_at,
};
use kmcfit_core::internals::system::{Grid, NodalCoefficients, State};

/// Roughness that the devices in a tube may have, as a multiple of the optimum's.
const BUDGET: f64 = 2.0;
/// Least stiffness of an equivalent device, as a share of the fit's largest.
const LEAST_STIFFNESS: f64 = 1e-3;
/// A misfit of this share of the level is at it.
const AT_LEVEL: f64 = 0.999;

/// The misfit that devices in the tubes may have.
pub fn level(problem: &Problem, theta: &[f64], evaluation: &Evaluation, plan: &StudyPlan) -> Level {
    let n = problem.reading_count() as f64;
    let sigma = problem.channels().all(|c| c.weighting().is_sigma());
    let allowed = match (plan.level, sigma) {
        (Some(level), _) => level,
        (None, true) => evaluation.misfit + chi_square_one(plan.confidence),
        // n ln J rises by the quantile.
        (None, false) => evaluation.misfit * (chi_square_one(plan.confidence) / n).exp(),
    };
    let mut level = Level::of(allowed);
    // A budget of roughness, where the fit paid for it.
    level.budgets = (problem.penalties.iter())
        .map(|penalty| {
            let range = problem.functions.ranges()[penalty.function].clone();
            let now = penalty.roughness(&theta[range]);
            (penalty.clone(), BUDGET * now.max(f64::MIN_POSITIVE))
        })
        .collect();
    level
}

/// The tubes of all functions that are fitted and of k/m and c/m, and the extreme devices.
pub fn tubes(
    problem: &Problem,
    theta: &[f64],
    level: &Level,
    plan: &StudyPlan,
    threads: usize,
) -> (Vec<TubeRecord>, Vec<Extreme>) {
    let main = problem.functions.assembly(0);
    let mut jobs = Vec::new();
    for &f in main {
        let function = problem.functions.get(f);
        if function.parameters() > 0 {
            let unit = function.quantity.unit().to_owned();
            jobs.push((function.name(), unit, values_at(problem, f, &plan.tubes)));
        }
    }
    let of = |q: CoefficientKind| {
        main.iter()
            .find(|f| problem.functions.get(**f).quantity == q)
    };
    let ratios = [
        ("k/m", CoefficientKind::Stiffness, "1/s^2"),
        ("c/m", CoefficientKind::Damping, "1/s"),
    ];
    for (name, over, unit) in ratios {
        if let (Some(&over), Some(&mass)) = (of(over), of(CoefficientKind::Mass)) {
            let targets = ratios_at(problem, over, mass, &plan.tubes);
            jobs.push((name.to_owned(), unit.to_owned(), targets));
        }
    }
    let mut records = Vec::new();
    let mut extremes = Vec::new();
    for (name, unit, targets) in jobs {
        let starts = [theta.to_vec()];
        let Some(bands) = tube(problem, &starts, &targets, level, threads) else {
            continue;
        };
        let ends = bands.iter().flat_map(|band| [&band.low, &band.high]);
        records.push(TubeRecord {
            name,
            unit,
            times: plan.tubes.clone(),
            low: bands.iter().map(|band| band.low.value).collect(),
            high: bands.iter().map(|band| band.high.value).collect(),
            level: level.misfit,
            devices: ends
                .map(|e| (e.name(), e.misfit, ended(e, level.misfit).to_owned()))
                .collect(),
        });
        extremes.extend(bands.into_iter().flat_map(|band| [band.low, band.high]));
    }
    (records, extremes)
}

/// At the level nothing is left to gain, however the search ended.
fn ended(extreme: &Extreme, level: f64) -> &'static str {
    match extreme.ended {
        Ended::Stuck if extreme.misfit >= AT_LEVEL * level => ENDED,
        Ended::Settled => ENDED,
        Ended::Reach => "at the reach that was stated: no end was met",
        Ended::Stuck => "no trial could be brought back to the level",
        Ended::Programs => "the programs ran out",
    }
}

/// Devices with the same motion as the fit's: those that are `asked` for, or some whose mass is the
/// fit's times a factor over time.
pub fn equivalents(
    problem: &Problem,
    evaluation: &Evaluation,
    asked: &[Equivalent],
) -> Vec<EquivalentRecord> {
    let grid = &problem.oscillator.grid;
    let Some(experiment) = problem.experiments.first() else {
        return Vec::new();
    };
    let linear = problem.oscillator.terms.iter().all(|t| t.is_linear());
    if !linear || experiment.nodes != grid.nodes() {
        return Vec::new();
    }
    let motion = Motion::of(problem, evaluation, 0);
    let device = evaluation.device_of(experiment.device);
    let asked = match asked.is_empty() {
        true => factors(&device.mass),
        false => asked.to_vec(),
    };
    let mut records = vec![record(grid, "the fit", device, 0.0)];
    for Equivalent {
        name,
        mass,
        damping,
    } in asked
    {
        let least = LEAST_STIFFNESS * device.coefficients[1].iter().copied().fold(0.0, f64::max);
        let damping = damping.unwrap_or_else(|| device.coefficients[0].clone());
        let Ok(found) = equivalent(&mass, &motion, &Wish::near(damping, least)) else {
            continue;
        };
        let initial = State {
            displacement: motion.displacement[0],
            velocity: motion.velocity[0],
        };
        let excitation = experiment.excitation.as_ref();
        let Ok(moved) = problem.oscillator.forward(&found, initial, excitation) else {
            continue;
        };
        let largest = motion
            .displacement
            .iter()
            .fold(0.0f64, |m, y| m.max(y.abs()));
        let pairs = moved.displacement.iter().zip(&motion.displacement);
        let off = pairs.fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        let apart = if off == 0.0 { 0.0 } else { off / largest };
        // On steps that are too long for it a device moves otherwise, if at all.
        if apart <= SAME_MOTION {
            records.push(record(grid, &name, &found, apart));
        }
    }
    match records.len() {
        1 => Vec::new(),
        _ => records,
    }
}

/// A device has the motion of the fit if it is no further from it than this share of the largest displacement.
const SAME_MOTION: f64 = 0.1;

/// Masses that grow, fall and swing away from the fit's.
fn factors(mass: &[f64]) -> Vec<Equivalent> {
    let last = (mass.len() - 1) as f64;
    type Factor<'a> = &'a dyn Fn(f64) -> f64;
    let choices: [(&str, Factor); 3] = [
        ("mass that grows by a half", &|x| 1.0 + 0.5 * x),
        ("mass that falls by a third", &|x| 1.0 - x / 3.0),
        ("mass that swings by a fifth", &|x| {
            1.0 + 0.2 * (12.0 * x).sin()
        }),
    ];
    let each = choices.into_iter().map(|(name, factor)| Equivalent {
        name: name.into(),
        mass: (mass.iter().enumerate())
            .map(|(i, m)| m * factor(i as f64 / last))
            .collect(),
        damping: None,
    });
    each.collect()
}

fn record(
    grid: &Grid,
    name: &str,
    device: &NodalCoefficients,
    motion_error: f64,
) -> EquivalentRecord {
    EquivalentRecord {
        name: name.into(),
        times: grid.times(),
        mass: device.mass.clone(),
        damping: device.coefficients[0].clone(),
        stiffness: device.coefficients[1].clone(),
        motion_error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kmcfit_core::internals::builder::{Builder, CoefficientSpec, Record};
    use kmcfit_core::internals::system::Grid;

    /// What is listed of a ring-down of six periods by the midpoint rule, on 61 nodes.
    fn listed(asked: impl Fn(usize) -> Option<f64>) -> Vec<EquivalentRecord> {
        let times = Grid::new(0.0, 20.0, 61).unwrap().times();
        let readings: Vec<f64> = times.iter().map(|t| (2.0 * t).cos()).collect();
        let record = Record::new("ring-down")
            .from_state(1.0, 0.0)
            .displacement(&times, &readings);
        let problem = Builder::new([1.0, 0.1, 4.0].map(CoefficientSpec::constant))
            .record(record)
            .build()
            .unwrap();
        let evaluation = problem.evaluate(&problem.start()).unwrap();
        let mass: Option<Vec<f64>> = (0..61).map(asked).collect();
        let asked = mass.map(|mass| Equivalent {
            name: "asked for".into(),
            mass,
            damping: None,
        });
        equivalents(&problem, &evaluation, asked.as_slice())
    }

    /// Three devices beside the fit share its motion, and so does one that is asked for; one whose mass jumps to next to
    /// nothing at every other node, too fast for the steps, does not and is not listed.
    #[test]
    fn what_leaves_the_motion_is_no_equivalent() {
        let own = listed(|_| None);
        assert_eq!(own.len(), 4);
        assert!(own.iter().all(|device| device.motion_error <= SAME_MOTION));
        let slow = listed(|i| Some(1.0 + 0.01 * i as f64));
        assert_eq!(slow.len(), 2);
        let fast = listed(|i| Some(if i % 2 == 0 { 1.0 } else { 0.01 }));
        assert!(fast.is_empty(), "{}", fast[1].motion_error);
    }
}
