//! From a fitted problem to the pieces of a study.

use super::pieces::*;
use crate::config::{Candidate, Equivalent, Model, StudyPlan, StudyTarget};
use crate::diagnostics::{chi_square_one, normal_half_width};
use crate::dynamics::{Device, Grid, State};
use crate::functions::{Functions, Quantity, Ratios};
use crate::identifiability::{
    self, BandSettings, Bands, CandidateChannel, Gauge, Sensitivity, Spectrum, Verdict, anchors,
    rank_experiments, verdicts,
};
use crate::objective::{Evaluation, Weighting};
use crate::problem::Problem;
use crate::report::meaning::Doubts;
use crate::report::measured;
use crate::solvers::Fit;
use crate::study::bootstrap::{Noise, bootstrap};
use crate::study::equivalent::{Motion, Wish, equivalent};
use crate::study::multistart::{self, Multistart, Ranges, between};
use crate::study::profile::profile;
use crate::study::profile::{ProfileSettings, Verdict as ProfileVerdict};
use crate::study::pull_apart::{Ended, Extreme, Level, ratios_at, tube, values_at};
use crate::study::variation::{Asking, variation};
use crate::study::{Linear, prediction};

/// Directions that are drawn of each end of the spectrum.
const DIRECTIONS: usize = 3;
/// Unseen directions that are named one by one.
const NAMED: usize = 400;
/// Draws of the simultaneous bands.
const DRAWS: usize = 10_000;
/// Roughness that the devices in a tube may have, as a multiple of the optimum's.
const BUDGET: f64 = 2.0;
/// Least stiffness of an equivalent device, as a share of the fit's largest.
const LEAST_STIFFNESS: f64 = 1e-3;
/// A misfit of this share of the level is at it.
const AT_LEVEL: f64 = 0.999;
/// Steps of the paths between two optima.
const PATH: usize = 40;
/// A path that rises by less than this share of the higher end's cost joins two ends of one valley.
const RISE: f64 = 0.05;

fn known(values: &[f64]) -> Numbers {
    let finite = |x: &f64| x.is_finite().then_some(*x);
    values.iter().map(finite).collect()
}

/// The fit that is studied.
pub fn fit(problem: &Problem, fit: &Fit) -> FitPiece {
    let sigma = |c: &crate::objective::Channel| match c.weighting() {
        Weighting::Estimated { sigma } => Some(*sigma),
        _ => None,
    };
    FitPiece {
        status: fit.outcome.status.name().into(),
        reason: fit.outcome.reason.clone(),
        cost: fit.best.evaluation.cost,
        misfit: fit.best.evaluation.misfit,
        parameters: fit.best.parameters.clone(),
        weights: problem.penalties.iter().map(|p| p.weight).collect(),
        sigmas: problem.channels().map(sigma).collect(),
    }
}

/// Whether a fit that was kept has the shape of this problem's: a journal may be damaged.
pub fn is_of(problem: &Problem, fit: &FitPiece) -> bool {
    let lengths = [fit.parameters.len(), fit.weights.len(), fit.sigmas.len()];
    let expected = [
        problem.parameters(),
        problem.penalties.len(),
        problem.channels().count(),
    ];
    let is_positive = |sigma: &f64| sigma.is_finite() && *sigma > 0.0;
    lengths == expected && fit.sigmas.iter().flatten().all(is_positive)
}

/// The problem with the sigmas that the fit estimated and the weights that it chose.
pub fn as_fitted(problem: &Problem, fit: &FitPiece) -> Problem {
    let mut problem = problem.clone();
    for (penalty, weight) in problem.penalties.iter_mut().zip(&fit.weights) {
        penalty.weight = *weight;
    }
    let channels = problem.experiments.iter_mut().flat_map(|e| &mut e.channels);
    for (channel, sigma) in channels.zip(&fit.sigmas) {
        if let Some(sigma) = *sigma {
            *channel = channel
                .clone()
                .with_weighting(Weighting::Estimated { sigma });
        }
    }
    problem
}

/// What the readings see.
pub fn spectrum(problem: &Problem, theta: &[f64], evaluation: &Evaluation) -> SpectrumPiece {
    let spectrum: Spectrum = Sensitivity::of(problem, evaluation).spectrum();
    let gauge = Gauge::at(problem, theta);
    let mut unseen = gauge.unseen(&spectrum);
    unseen.truncate(NAMED);
    let record = |seen: identifiability::Seen| DirectionRecord {
        singular_value: seen.singular_value,
        functions: seen.functions,
    };
    SpectrumPiece {
        sentence: spectrum.sentence(),
        rank: spectrum.rank,
        of: spectrum.of(),
        unseen: (unseen.into_iter())
            .map(|named| NamedRecord {
                name: named.name,
                share: named.share,
            })
            .collect(),
        times: problem.oscillator.grid.times(),
        best: (spectrum.best(problem, DIRECTIONS).into_iter())
            .map(record)
            .collect(),
        worst: (spectrum.worst(problem, DIRECTIONS).into_iter())
            .map(record)
            .collect(),
        singular_values: spectrum.singular_values,
    }
}

/// Bands, verdicts and anchors.
pub fn bands(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    plan: &StudyPlan,
    truth: Option<&Device>,
) -> BandsPiece {
    let settings = BandSettings {
        draws: DRAWS,
        seed: plan.seed,
    };
    let bands = Bands::at(problem, theta, evaluation, &settings);
    let factor = normal_half_width(plan.confidence);
    let doubts = Doubts::of(
        problem,
        evaluation,
        &measured::refined(problem, evaluation),
        &measured::statistics(problem, evaluation),
    );
    let judged = match doubts.errors_hold {
        true => verdicts(problem, evaluation, &bands),
        false => Vec::new(),
    };
    let mut notes = bands.notes.clone();
    notes.extend(doubts.no_device.into_iter().chain(doubts.open));
    let ratios = truth.map(Ratios::of);
    let list = bands.functions.iter().chain(&bands.ratios);
    let records = list.enumerate().map(|(i, band)| {
        let ends = |factor: f64| -> [Numbers; 2] {
            let each: Vec<[f64; 2]> = (0..band.values.len())
                .map(|t| band.ends(t, factor))
                .collect();
            [0, 1].map(|side| known(&each.iter().map(|e| e[side]).collect::<Vec<f64>>()))
        };
        let [low, high] = ends(factor);
        let [simultaneous_low, simultaneous_high] = match band.simultaneous {
            Some(factor) => ends(factor),
            None => [Vec::new(), Vec::new()],
        };
        let true_values: Option<&[f64]> = match band.name.as_str() {
            "k/m" => ratios.as_ref().map(|r| r.k_over_m.as_slice()),
            "c/m" => ratios.as_ref().map(|r| r.c_over_m.as_slice()),
            "natural frequency" => ratios.as_ref().map(|r| r.frequency.as_slice()),
            "damping ratio" => ratios.as_ref().map(|r| r.damping_ratio.as_slice()),
            _ => truth.and_then(|t| t.functions().nth(i)),
        };
        BandRecord {
            name: band.name.clone(),
            unit: band.unit.clone(),
            values: known(&band.values),
            low,
            high,
            simultaneous_low,
            simultaneous_high,
            truth: true_values.map(known).unwrap_or_default(),
            notes: band.notes.clone(),
        }
    });
    let word = |verdict: &Verdict| match verdict {
        Verdict::Identified { .. } => "identified",
        Verdict::OnlyRatio(_) => "only-ratio",
        Verdict::OnlyOn(_) => "only-on",
        Verdict::NotSeen => "not-seen",
        Verdict::Fixed => "fixed",
    };
    let grid = &problem.oscillator.grid;
    let fixed = evaluation.trajectories.first().map(|m| anchors(grid, m));
    BandsPiece {
        times: bands.times.clone(),
        bands: records.collect(),
        notes,
        verdicts: (judged.into_iter())
            .map(|j| JudgementRecord {
                verdict: word(&j.verdict).into(),
                name: j.name,
                sentence: j.sentence,
            })
            .collect(),
        turning_points: fixed
            .as_ref()
            .map_or(Vec::new(), |a| a.turning_points.clone()),
        zero_crossings: fixed.map_or(Vec::new(), |a| a.zero_crossings),
    }
}

/// The number that a target asks about.
pub fn linear(problem: &Problem, target: &StudyTarget) -> Option<Linear> {
    match target {
        StudyTarget::Value { function, time } => Linear::value(problem, *function, *time),
        StudyTarget::Mean { function } => Some(Linear::mean(problem, *function)),
        StudyTarget::Scalar { index } => Some(Linear::scalar(problem, *index)),
    }
}

/// One profile.
///
/// # Errors
/// Why there is none.
pub fn profile_of(
    problem: &Problem,
    theta: &[f64],
    of: &Linear,
    plan: &StudyPlan,
) -> Result<ProfilePiece, String> {
    let how = ProfileSettings {
        quantile: chi_square_one(plan.confidence),
        ..ProfileSettings::default()
    };
    let found = profile(problem, theta, of, &how).map_err(|breakdown| breakdown.to_string())?;
    Ok(ProfilePiece {
        sentence: found.sentence(),
        verdict: match found.verdict {
            ProfileVerdict::Identified => "identified",
            ProfileVerdict::OneSided => "one-sided",
            ProfileVerdict::Flat => "flat",
        }
        .into(),
        marks: (found.marks.iter())
            .map(|mark| (mark.value, mark.constraint.clone()))
            .collect(),
        name: found.name,
        unit: found.unit,
        optimum: found.optimum,
        values: found.values,
        costs: found.costs,
        interval: found.interval,
    })
}

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
    let of = |q: Quantity| {
        main.iter()
            .find(|f| problem.functions.get(**f).quantity == q)
    };
    let ratios = [
        ("k/m", Quantity::Stiffness, "1/s^2"),
        ("c/m", Quantity::Damping, "1/s"),
    ];
    for (name, over, unit) in ratios {
        if let (Some(&over), Some(&mass)) = (of(over), of(Quantity::Mass)) {
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
        Ended::Stuck if extreme.misfit >= AT_LEVEL * level => super::text::ENDED,
        Ended::Settled => super::text::ENDED,
        Ended::Reach => "at the reach that was stated: no end was met",
        Ended::Stuck => "no trial could be brought back to the level",
        Ended::Programs => "the programs ran out",
    }
}

/// Devices with the same motion as the fit's: those that the plan asks for, or some whose mass is the
/// fit's times a factor over time.
pub fn equivalents(
    problem: &Problem,
    evaluation: &Evaluation,
    plan: &StudyPlan,
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
    let asked = match plan.equivalents.is_empty() {
        true => factors(&device.mass),
        false => plan.equivalents.clone(),
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
        records.push(record(
            grid,
            &name,
            &found,
            if off == 0.0 { 0.0 } else { off / largest },
        ));
    }
    match records.len() {
        1 => Vec::new(),
        _ => records,
    }
}

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

fn record(grid: &Grid, name: &str, device: &Device, motion_error: f64) -> EquivalentRecord {
    EquivalentRecord {
        name: name.into(),
        times: grid.times(),
        mass: device.mass.clone(),
        damping: device.coefficients[0].clone(),
        stiffness: device.coefficients[1].clone(),
        motion_error,
    }
}

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
        ladder: false,
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
    let rounding = 1e-12 * problem.misfit_of_silence();
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
fn ranges(functions: &Functions, spread: f64) -> Vec<[f64; 2]> {
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
    let record = |v: crate::study::variation::Varies| VariesRecord {
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

/// The candidates, best first.
pub fn candidates(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    list: &[Candidate],
) -> Vec<CandidateRecord> {
    let spread = residual_spread(problem, evaluation);
    let channel = |c: &Candidate| {
        let channel = c.experiment.channels.first();
        channel.map(|channel| CandidateChannel {
            kind: channel.kind(),
            sigma: channel.weighting().sigma(0).unwrap_or(spread),
        })
    };
    let described: Vec<identifiability::Candidate> = (list.iter())
        .map(|c| identifiability::Candidate {
            name: c.name.clone(),
            initial: c.experiment.initial,
            excitation: c.experiment.excitation.clone(),
            channels: channel(c).into_iter().collect(),
        })
        .collect();
    let ranked = rank_experiments(problem, theta, evaluation, &described, false);
    let gain = |r: &identifiability::Ranked, of: fn(&identifiability::Gain) -> f64| {
        let of = r.gain.as_ref().ok().map(of);
        of.filter(|ratio| ratio.is_finite())
    };
    let record = |r: identifiability::Ranked| CandidateRecord {
        sentence: r.sentence(),
        new_directions: r.gain.as_ref().ok().map(|g| g.new_directions),
        volume: gain(&r, |g| g.volume),
        average: gain(&r, |g| g.average),
        worst: gain(&r, |g| g.worst),
        name: r.name,
    };
    ranked.into_iter().map(record).collect()
}

/// Root-mean-square residual of the first channel: the noise, where nobody gave any.
fn residual_spread(problem: &Problem, evaluation: &Evaluation) -> f64 {
    let pairs = problem
        .channels()
        .zip(evaluation.predictions.iter().flatten());
    let mut spreads = pairs.map(|(channel, predicted)| {
        let residuals: Vec<f64> = channel.residuals(predicted).collect();
        crate::diagnostics::rms(&residuals)
    });
    spreads.next().unwrap_or(1.0).max(f64::MIN_POSITIVE.sqrt())
}

/// The motions from the initial states that the model asks for, and in the experiments that might be
/// made.
pub fn predictions(
    problem: &Problem,
    theta: &[f64],
    evaluation: &Evaluation,
    model: &Model,
    extremes: &[Extreme],
) -> Vec<PredictionRecord> {
    let covariance = problem.covariance(evaluation);
    let free = model.predictions.iter().map(|state| {
        let (y, v) = (state.displacement, state.velocity);
        prediction::Run::free(format!("from y = {y} m, v = {v} m/s"), *state)
    });
    let candidates = model.study.candidates.iter().map(|c| prediction::Run {
        excitation: c.experiment.excitation.clone(),
        ..prediction::Run::free(format!("`{}`", c.name), c.experiment.initial)
    });
    let each = free.chain(candidates).filter_map(|run| {
        let found =
            prediction::predict(problem, theta, &run, covariance.as_ref(), extremes).ok()?;
        Some(PredictionRecord {
            name: found.name,
            times: found.times,
            displacement: found.motion.displacement,
            band: found.band,
            worst: found.worst,
            furthest: found.furthest,
        })
    });
    each.collect()
}
