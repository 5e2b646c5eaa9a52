//! Settings of the key `study`.

use super::experiments;
use super::functions::values;
use crate::config::ModelFile;
use crate::config::lowering::ModelKey;
use crate::error::InputError;
use crate::spelling::did_you_mean;
use crate::text_io::{one_of, quote};
use kmcfit_core::identifiability::{Curve, Target};
use kmcfit_core::model::{CandidateSpec, EquivalentSpec, ProfileSpec, StudySpec};
use kmcfit_core::problem::Problem;
use kmcfit_core::record::{Channel, ChannelKind, Experiment, Input, Waveform, Weighting};
use kmcfit_core::structure::CoefficientKind;
use kmcfit_core::study::Choice;
use kmcfit_core::system::State;

/// Settings of the analyses of `study`.
#[derive(Debug, Clone)]
pub struct StudyPlan {
    /// Confidence of bands and intervals, between 0 and 1.
    pub confidence: f64,
    /// Seed of everything random.
    pub seed: u64,
    /// Quantities with a profile likelihood.
    pub profiles: Vec<Target>,
    /// Times of the extremes, s.
    pub extremes: Vec<f64>,
    /// Largest cost J of the extremes; `None` for the limit from the confidence level.
    pub misfit_limit: Option<f64>,
    /// Number of starting points of the multistart search; 0 for none.
    pub starts: usize,
    /// Largest factor between starting points and start values.
    pub spread: f64,
    /// Relative difference of ratios and responses up to which two optima count as one.
    pub merge_tolerance: f64,
    /// Requested equivalent systems, which have the response of the fit.
    pub equivalent_systems: Vec<Choice>,
    /// Candidate experiments, with one channel read at every node; only the noise of its samples is used.
    pub candidates: Vec<Experiment>,
}

impl StudyPlan {
    /// Number of analyses, the fit included.
    pub fn analyses(&self) -> usize {
        // Fit, sensitivity, bands, equivalent systems, extremes.
        let always = 5;
        let asked = [!self.candidates.is_empty(), self.starts > 0];
        always + self.profiles.len() + asked.into_iter().filter(|asked| *asked).count()
    }
}

const CONFIDENCE: f64 = 0.95;
const SEED: u64 = 1;
const SPREAD: f64 = 3.0;
const WIDEST_SPREAD: f64 = 1e6;
/// Most starting points; more would run for days.
const MOST_STARTS: usize = 100_000;
/// Default of `merge_tolerance`.
const SAME: f64 = 1e-3;
/// Default number of times of the extremes.
const EXTREME_TIMES: usize = 5;

pub(super) fn build(file: &ModelFile, problem: &Problem) -> Result<StudyPlan, InputError> {
    let none = StudySpec::default();
    let spec = file.spec.study.as_ref().unwrap_or(&none);
    let at = ModelKey::new(file, "study");
    let confidence = (spec.confidence, CONFIDENCE);
    let confidence = within(&at, "confidence", confidence, |x| x > 0.0 && x < 1.0)?;
    let spread = (spec.spread, SPREAD);
    let spread = within(&at, "spread", spread, |x| x > 1.0 && x <= WIDEST_SPREAD)?;
    let tolerance = (spec.merge_tolerance, SAME);
    let merge_tolerance = within(&at, "merge_tolerance", tolerance, |x| x > 0.0)?;
    check(&at, spec)?;
    let profiles = each(&at, problem, "profiles", spec.profiles.as_deref(), target)?;
    let candidates = each(
        &at,
        problem,
        "candidates",
        spec.candidates.as_deref(),
        candidate,
    )?;
    let equivalent = each(
        &at,
        problem,
        "equivalent_systems",
        spec.equivalent_systems.as_deref(),
        equivalent,
    )?;
    Ok(StudyPlan {
        equivalent_systems: equivalent,
        confidence,
        seed: spec.seed.map_or(SEED, |seed| seed as u64),
        profiles,
        extremes: extremes(&at, problem, spec)?,
        misfit_limit: spec.misfit_limit,
        starts: spec.starts.unwrap_or(0),
        spread,
        merge_tolerance,
        candidates,
    })
}

/// Reads a list of `study`.
fn each<S, T>(
    at: &ModelKey<'_>,
    problem: &Problem,
    name: &str,
    list: Option<&[S]>,
    read: fn(&ModelKey<'_>, &Problem, &S) -> Result<T, InputError>,
) -> Result<Vec<T>, InputError> {
    let list = list.unwrap_or_default().iter().enumerate();
    list.map(|(i, spec)| read(&at.below(&format!("{name}[{i}]")), problem, spec))
        .collect()
}

/// Refuses an invalid limit, count or time.
fn check(at: &ModelKey<'_>, spec: &StudySpec) -> Result<(), InputError> {
    if let Some(level) = spec.misfit_limit.filter(|l| *l <= 0.0) {
        return Err(at
            .error_in("misfit_limit", "the largest J must be positive")
            .found(level)
            .expected("a number greater than 0 (dimensionless with `sigma`, otherwise m² s)"));
    }
    for (key, is_given) in [
        ("spread", spec.spread.is_some()),
        ("merge_tolerance", spec.merge_tolerance.is_some()),
    ] {
        if is_given && spec.starts.is_none() {
            return Err(at
                .error_in(key, "this key has no effect alone")
                .expected("`starts` beside it"));
        }
    }
    let is_invalid = |count: &usize| !(1..=MOST_STARTS).contains(count);
    if let Some(count) = spec.starts.filter(is_invalid) {
        return Err(at
            .error_in("starts", "invalid number")
            .found(count)
            .expected(format!("1 to {MOST_STARTS}, or no `starts`")));
    }
    let extremes = spec.extremes.as_ref();
    if extremes.is_some_and(|extremes| extremes.values().is_empty()) {
        return Err(at
            .error_in("extremes", "the list of times is empty")
            .found("an empty list")
            .expected("times in s, or no `extremes` for five over the record"));
    }
    Ok(())
}

fn equivalent(
    at: &ModelKey<'_>,
    problem: &Problem,
    spec: &EquivalentSpec,
) -> Result<Choice, InputError> {
    let grid = &problem.system.grid;
    let mass_at = at.below("mass");
    let mass = values(&mass_at, grid, &spec.mass)?;
    if let Some(least) = mass.iter().find(|m| **m <= 0.0) {
        return Err(mass_at
            .error("the mass must be positive at all times")
            .found(least)
            .expected("a number greater than 0, in kg"));
    }
    let damping = spec.damping.as_ref();
    let damping = damping.map(|d| values(&at.below("damping"), grid, d));
    Ok(Choice {
        name: spec.name.clone(),
        mass,
        damping: damping.transpose()?,
    })
}

fn within(
    at: &ModelKey<'_>,
    key: &str,
    (given, usual): (Option<f64>, f64),
    fits: fn(f64) -> bool,
) -> Result<f64, InputError> {
    match given {
        Some(number) if !fits(number) => Err(at
            .error_in(key, "invalid number")
            .found(number)
            .expected(match key {
                "confidence" => "a number between 0 and 1, for instance 0.95",
                "spread" => "a factor greater than 1, at most 1e6",
                _ => "a number greater than 0",
            })),
        given => Ok(given.unwrap_or(usual)),
    }
}

/// Times on the grid; evenly spread where none are given.
fn extremes(
    at: &ModelKey<'_>,
    problem: &Problem,
    spec: &StudySpec,
) -> Result<Vec<f64>, InputError> {
    let grid = &problem.system.grid;
    let Some(given) = &spec.extremes else {
        let time =
            |i: usize| grid.start() + grid.duration() * i as f64 / (EXTREME_TIMES - 1) as f64;
        return Ok((0..EXTREME_TIMES).map(time).collect());
    };
    for (i, time) in given.values().iter().enumerate() {
        let at = at.below(&format!("extremes{}", given.suffix(i)));
        on_grid(&at, problem, *time)?;
    }
    Ok(given.values().to_vec())
}

fn on_grid(at: &ModelKey<'_>, problem: &Problem, time: f64) -> Result<(), InputError> {
    let grid = &problem.system.grid;
    match kmcfit_core::system::TimePoint::of(grid, time) {
        Some(_) => Ok(()),
        None => Err(at
            .error("this time is outside the record")
            .found(time)
            .expected(format!(
                "{} s to {} s",
                grid.start(),
                grid.start() + grid.duration()
            ))),
    }
}

fn target(at: &ModelKey<'_>, problem: &Problem, spec: &ProfileSpec) -> Result<Target, InputError> {
    let mean = spec.mean == Some(true);
    match (spec.function, &spec.parameter) {
        (Some(name), None) => {
            let function = function(at, problem, name)?;
            match (spec.at, mean) {
                (Some(time), false) => {
                    on_grid(&at.below("at"), problem, time)?;
                    Ok(Target::Value(Curve::Function(function), time))
                }
                (None, true) => Ok(Target::Mean(Curve::Function(function))),
                (None, false) if problem.functions.get(function).parameters() == 1 => {
                    Ok(Target::Mean(Curve::Function(function)))
                }
                _ => Err(at
                    .error("a profile needs one quantity")
                    .expected("`at: TIME` or `mean: true`")),
            }
        }
        (None, Some(name)) => {
            let scalars = problem.functions.scalars();
            let found = scalars.iter().position(|s| s.name == *name);
            found.map(Target::Scalar).ok_or_else(|| {
                let names = || scalars.iter().map(|s| s.name.as_str());
                let error = at
                    .error_in("parameter", "no such nuisance parameter")
                    .found(quote(name))
                    .expected(match scalars.is_empty() {
                        true => "a model that estimates initial states or sensors".to_owned(),
                        false => one_of(names()),
                    });
                match did_you_mean(name, names()) {
                    Some(hint) => error.hint(hint),
                    None => error,
                }
            })
        }
        _ => Err(at
            .error("a profile needs one quantity")
            .expected("either `function` or `parameter`")),
    }
}

/// The index of a fitted function common to all experiments.
fn function(
    at: &ModelKey<'_>,
    problem: &Problem,
    quantity: CoefficientKind,
) -> Result<usize, InputError> {
    let main = problem.functions.coefficient_set(0);
    let of = |f: &&usize| problem.functions.get(**f).quantity == quantity;
    let (at, name) = (at.below("function"), quantity.name());
    match main.iter().find(of) {
        Some(&f) if problem.functions.get(f).parameters() > 0 => Ok(f),
        Some(_) => Err(at
            .error(format!("the {name} is fixed, so it has no profile"))
            .found(format!("`{name}`"))
            .expected("a function that is fitted")),
        None => Err(at
            .error(format!("the model has no {name}"))
            .found(format!("`{name}`"))
            .expected("a function of the model")),
    }
}

fn candidate(
    at: &ModelKey<'_>,
    problem: &Problem,
    spec: &CandidateSpec,
) -> Result<Experiment, InputError> {
    let grid = &problem.system.grid;
    let nodes = grid.nodes();
    let initial = State::one(spec.initial.displacement, spec.initial.velocity);
    let mut experiment = Experiment::free(spec.name.clone(), initial, nodes);
    if let Some(force) = &spec.force {
        let force = Some(Waveform::Shape(experiments::shape(at, force)?));
        experiment.input = Input {
            force,
            ..Input::default()
        };
        experiment.excitation = Some(experiment.input.on(grid, nodes));
    }
    let kind = spec.channel.unwrap_or(ChannelKind::Displacement);
    let weighting = match (spec.sigma, problem.channels().next()) {
        (Some(sigma), _) if sigma <= 0.0 => {
            return Err(at
                .error_in("sigma", "a standard deviation must be positive")
                .found(sigma)
                .expected("a number greater than 0, in SI units"));
        }
        (Some(sigma), _) => Weighting::Sigma(sigma),
        (None, Some(channel)) => match channel.weighting() {
            Weighting::Sigmas(sigmas) => Weighting::Sigma(sigmas[0]),
            Weighting::Trapezoid(_) => Weighting::Integral {
                spacing: grid.step(),
            },
            Weighting::Integral { .. } => Weighting::Integral {
                spacing: grid.step(),
            },
            other => other.clone(),
        },
        (None, None) => Weighting::Integral {
            spacing: grid.step(),
        },
    };
    let channel = Channel::new(kind, grid.times(), vec![0.0; nodes], weighting, grid, nodes);
    experiment.channels.extend(channel);
    Ok(experiment)
}
