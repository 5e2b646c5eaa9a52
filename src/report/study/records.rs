//! Records of a study from the analyses of the core.

use super::document::*;
use crate::config::{Candidate, Equivalent, Model, StudyPlan, StudyTarget};
use crate::finding::Finding;
use crate::number_format::{resolved, significant};
use crate::report::findings;
use kmcfit_core::internals::assessment::Plausibility;
use kmcfit_core::internals::diagnostics::{chi_square_one, normal_half_width};
use kmcfit_core::internals::functions::Ratios;
use kmcfit_core::internals::identifiability::{
    self, Band, BandSettings, Bands, CandidateChannel, Classification, FunctionClassification,
    RelativeChange, ScalingAmbiguity, Sensitivity, anchors, classify_functions, rank_experiments,
    residual_spread,
};
use kmcfit_core::internals::objective::Evaluation;
use kmcfit_core::internals::problem::Problem;
use kmcfit_core::internals::study::bootstrap::{
    NoRefits, NumberInterval, ReplicateNoise, intervals,
};
use kmcfit_core::internals::study::constancy_test::{
    ConstancySettings, ConstancyTest, constancy_tests,
};
use kmcfit_core::internals::study::extremes::{Extreme, ExtremeStatus, MisfitLimit, envelopes};
use kmcfit_core::internals::study::multistart::{self, Multistart, Ranges};
use kmcfit_core::internals::study::profile_likelihood::{Interval, ProfileSettings};
use kmcfit_core::internals::study::{
    Choice, EquivalentSystem, Linear, equivalent_systems, prediction, profile,
};

/// Parameter combinations in the figures, from each end of the spectrum.
const DIRECTIONS: usize = 3;
/// Most unidentifiable combinations in the document.
const NAMED: usize = 400;
/// Random draws for the simultaneous bands.
const DRAWS: usize = 10_000;

/// Findings on the structural rank of a problem, the rank bound first.
pub fn structural_rank(problem: &Problem) -> Vec<Finding> {
    let count = identifiability::structural_rank(problem);
    let bound = Finding::new("rank_bound", count.headline());
    let bound = bound.with("rank_bound", count.rank_bound);
    let bound = bound.with("parameters", count.parameters);
    let others = count.findings.iter().map(findings::rank);
    std::iter::once(bound).chain(others).collect()
}

/// The problem with the weights and sigmas of the fit, the parameters of its optimum, and the evaluation at them.
#[derive(Debug, Clone, Copy)]
pub struct Optimum<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// The parameters.
    pub theta: &'a [f64],
    /// The evaluation.
    pub evaluation: &'a Evaluation,
}

fn finite_numbers(values: &[f64]) -> Numbers {
    let finite = |x: &f64| x.is_finite().then_some(*x);
    values.iter().map(finite).collect()
}

/// Sensitivity of the samples to the parameters.
pub fn sensitivity(at: Optimum) -> SensitivityRecord {
    let spectrum = Sensitivity::of(at.problem, at.evaluation).spectrum();
    let unidentifiable = ScalingAmbiguity::at(at.problem, at.theta).undetermined(&spectrum);
    let unidentifiable = unidentifiable.into_iter().take(NAMED);
    let records = |list: Vec<identifiability::ResolvedDirection>| {
        let record = |resolved: identifiability::ResolvedDirection| DirectionRecord {
            singular_value: resolved.singular_value,
            functions: resolved.functions,
        };
        list.into_iter().map(record).collect()
    };
    SensitivityRecord {
        text: spectrum.sentence(),
        rank: spectrum.rank(),
        combinations: spectrum.of(),
        unidentifiable: unidentifiable
            .map(|named| UnidentifiableRecord {
                name: named.name,
                share: named.share,
            })
            .collect(),
        times: at.problem.system.grid.times(),
        best: records(spectrum.best(at.problem, DIRECTIONS)),
        worst: records(spectrum.worst(at.problem, DIRECTIONS)),
        singular_values: spectrum.singular_values().to_vec(),
    }
}

/// Confidence bands and the classification by them.
pub fn bands(at: Optimum, model: &Model) -> BandsRecord {
    let (plan, truth) = (&model.study, model.truth.as_ref());
    let (problem, evaluation) = (at.problem, at.evaluation);
    let settings = BandSettings {
        draws: DRAWS,
        seed: plan.seed,
    };
    let mut bands = Bands::at(problem, at.theta, evaluation, &settings);
    for band in &mut bands.functions {
        band.unit = model.converted_unit(&band.unit).to_owned();
    }
    let factor = normal_half_width(plan.confidence);
    let plausibility = Plausibility::at(problem, evaluation);
    let judged = match plausibility.errors_hold {
        true => classify_functions(problem, evaluation, &bands),
        false => Vec::new(),
    };
    let mut notes = bands.notes.clone();
    notes.extend((plausibility.unidentified.iter()).map(|why| findings::unidentified(why).text));
    notes.extend((plausibility.warnings.iter()).map(|w| findings::warning(w).text));
    let ratios = truth.map(Ratios::of);
    let of_ratio = |part: fn(&Ratios) -> &Vec<f64>| ratios.as_ref().map(|r| part(r).as_slice());
    let list = bands.functions.iter().chain(&bands.ratios);
    let records = list.enumerate().map(|(i, band)| {
        let real = match band.name.as_str() {
            "k/m" => of_ratio(|r| &r.k_over_m),
            "c/m" => of_ratio(|r| &r.c_over_m),
            "natural frequency" => of_ratio(|r| &r.frequency),
            "damping ratio" => of_ratio(|r| &r.damping_ratio),
            _ => truth.and_then(|t| t.functions().nth(i)),
        };
        band_record(band, factor, real)
    });
    let grid = &problem.system.grid;
    let fixed = evaluation.trajectories.first().map(|m| anchors(grid, m));
    let [turning_points, zero_crossings] =
        fixed.map_or_else(Default::default, |a| [a.turning_points, a.zero_crossings]);
    BandsRecord {
        times: bands.times.clone(),
        bands: records.collect(),
        notes,
        classification: (judged.into_iter())
            .map(|j| ClassificationRecord {
                text: with_numbers(at, &bands, &j),
                verdict: j.verdict.name().into(),
                name: j.name,
            })
            .collect(),
        turning_points,
        zero_crossings,
    }
}

/// A classification with the mean over the record, its interval, and for a function that varies its largest change.
fn with_numbers(at: Optimum, bands: &Bands, found: &FunctionClassification) -> String {
    let is_identified = matches!(
        found.verdict,
        Classification::Identified { .. } | Classification::Conditional { .. }
    );
    let means = bands.means();
    let place = (at.problem.functions.iter()).position(|f| f.name() == found.name);
    let mean = match place {
        Some(f) => means.functions.get(f).copied(),
        None => means.ratio(&found.name),
    };
    let (Some(mean), true) = (mean, is_identified) else {
        return found.sentence.clone();
    };
    let Some([low, high]) = mean.interval() else {
        return found.sentence.clone();
    };
    let list = bands.functions.iter().chain(&bands.ratios);
    let band = list.into_iter().find(|band| band.name == found.name);
    let is_constant = |band: &Band| band.values.iter().all(|x| *x == band.values[0]);
    let of_mean = match band.is_some_and(is_constant) {
        true => "",
        false => "mean ",
    };
    let unit = band.map_or("", |band| band.unit.as_str());
    let half = 0.5 * (high - low);
    let [value, low, high] = resolved([mean.value, low, high], half);
    let mut text = format!(
        "{}: {of_mean}{value} {unit} (95 % CI {low} to {high})",
        found.name
    );
    if mean.value.abs() < half {
        text += ", does not differ from zero";
    }
    let change = place.and_then(|f| bands.relative_change(at.problem, at.theta, f));
    text += &change.map(change_in_words).unwrap_or_default();
    let on = match &found.verdict {
        Classification::Conditional { .. } => format!("; {}", found.sentence),
        _ => String::new(),
    };
    text + &on
}

/// `; falls by 18 % (95 % CI 17 to 19 %) between 4 s and 9 s`.
fn change_in_words(change: RelativeChange) -> String {
    let [from, to] = change.times.map(|t| significant(t, 3));
    let [low, high] = change.interval;
    let half = 50.0 * (high - low);
    if low <= 0.0 && high >= 0.0 {
        let [low, high] = resolved([100.0 * low, 100.0 * high], half);
        return format!(
            "; its change between {from} s and {to} s is not significant (95 % CI {low} to {high} %)"
        );
    }
    let sign = 100.0 * change.relative.signum();
    let mut numbers = [sign * change.relative, sign * low, sign * high];
    numbers[1..].sort_by(f64::total_cmp);
    let [size, low, high] = resolved(numbers, half);
    let verb = match change.relative < 0.0 {
        true => "falls",
        false => "rises",
    };
    format!("; {verb} by {size} % (95 % CI {low} to {high} %) between {from} s and {to} s")
}

fn band_record(band: &Band, factor: f64, truth: Option<&[f64]>) -> BandRecord {
    let ends = |factor: f64| -> [Numbers; 2] {
        let each = (0..band.values.len()).map(|t| band.ends(t, factor));
        let (low, high): (Vec<f64>, Vec<f64>) = each.map(|[low, high]| (low, high)).unzip();
        [finite_numbers(&low), finite_numbers(&high)]
    };
    let [low, high] = ends(factor);
    let [simultaneous_low, simultaneous_high] = band.simultaneous.map(ends).unwrap_or_default();
    BandRecord {
        name: band.name.clone(),
        unit: band.unit.clone(),
        values: finite_numbers(&band.values),
        low,
        high,
        simultaneous_low,
        simultaneous_high,
        truth: truth.map(finite_numbers).unwrap_or_default(),
        notes: band.notes.clone(),
    }
}

/// The linear functional of a target.
pub fn linear(problem: &Problem, target: &StudyTarget) -> Option<Linear> {
    match target {
        StudyTarget::Value { function, time } => Linear::value(problem, *function, *time),
        StudyTarget::Mean { function } => Some(Linear::mean(problem, *function)),
        StudyTarget::Scalar { index } => Some(Linear::scalar(problem, *index)),
    }
}

/// Likelihood profile of one quantity.
///
/// # Errors
/// The reason for which there is none.
pub fn profile_of(at: Optimum, of: &Linear, model: &Model) -> Result<ProfileRecord, String> {
    let how = ProfileSettings {
        quantile: chi_square_one(model.study.confidence),
        ..ProfileSettings::default()
    };
    let mut found = profile(at.problem, at.theta, of, &how).map_err(|error| error.to_string())?;
    found.unit = model.converted_unit(&found.unit).to_owned();
    let marks = found.marks.iter();
    Ok(ProfileRecord {
        text: found.sentence(),
        verdict: match found.verdict {
            Interval::Identified => "identified",
            Interval::OneSided => "one-sided",
            Interval::Flat => "flat",
        }
        .into(),
        active_from: marks
            .map(|m| ActiveFrom {
                value: m.value,
                constraint: m.constraint.clone(),
            })
            .collect(),
        name: found.name,
        unit: found.unit,
        optimum: found.optimum,
        values: found.values,
        costs: found.costs,
        interval: found.interval,
    })
}

/// Candidate experiments, the most informative first.
pub fn candidates(at: Optimum, list: &[Candidate]) -> Vec<CandidateRecord> {
    let spread = residual_spread(at.problem, at.evaluation);
    let described = list.iter().map(|c| identifiability::CandidateExperiment {
        name: c.name.clone(),
        initial: c.experiment.initial,
        excitation: c.experiment.excitation.clone(),
        channels: (c.experiment.channels.iter().take(1))
            .map(|channel| CandidateChannel {
                kind: channel.kind(),
                sigma: channel.weighting().sigma(0).unwrap_or(spread),
            })
            .collect(),
    });
    let described: Vec<_> = described.collect();
    let ranked = rank_experiments(at.problem, at.theta, at.evaluation, &described, false);
    let finite = |ratio: f64| ratio.is_finite().then_some(ratio);
    let record = |r: identifiability::Ranked| {
        let gain = r.gain.as_ref().ok();
        CandidateRecord {
            text: r.sentence(),
            added_rank: gain.map(|g| g.new_directions),
            d_ratio: gain.and_then(|g| finite(g.volume)),
            a_ratio: gain.and_then(|g| finite(g.average)),
            e_ratio: gain.and_then(|g| finite(g.worst)),
            name: r.name,
        }
    };
    ranked.into_iter().map(record).collect()
}

/// Equivalent systems: other coefficients with the response of the fit.
pub fn equivalent(at: Optimum, asked: &[Equivalent]) -> Vec<EquivalentSystemRecord> {
    let choice = |asked: &Equivalent| Choice {
        name: asked.name.clone(),
        mass: asked.mass.clone(),
        damping: asked.damping.clone(),
    };
    let choices: Vec<Choice> = asked.iter().map(choice).collect();
    let record = |found: EquivalentSystem| {
        let mut coefficients = found.nodal.coefficients.into_iter();
        EquivalentSystemRecord {
            name: found.name,
            times: at.problem.system.grid.times(),
            mass: found.nodal.mass,
            damping: coefficients.next().unwrap_or_default(),
            stiffness: coefficients.next().unwrap_or_default(),
            response_error: found.response_error,
        }
    };
    let found = equivalent_systems(at.problem, at.evaluation, &choices);
    found.into_iter().map(record).collect()
}

/// Fits from random starting points.
pub fn starts(model: &Model, at: Optimum, threads: usize) -> MultistartRecord {
    let (plan, problem) = (&model.study, at.problem);
    let how = Multistart {
        // Ranges between the bounds if every function has both, otherwise around the start values.
        ranges: Ranges::of_bounds(problem)
            .unwrap_or_else(|| Ranges::around_starts(&problem.functions, plan.spread)),
        starts: plan.starts,
        seed: plan.seed,
        threads,
        attempts: false,
        settings: model.settings.clone(),
    };
    let waterfall = multistart::multistart(problem, &how);
    let tolerance = multistart::Distance {
        ratios: plan.merge_tolerance,
        responses: plan.merge_tolerance,
    };
    let clusters = waterfall.clusters(problem, tolerance);
    let findings = waterfall.findings(problem, at.theta, &clusters);
    let failed = waterfall.runs.iter().filter(|run| run.found.is_none());
    let cluster = |c: &multistart::Cluster| ClusterRecord {
        starts: c.members.len(),
        cost: c.cost,
    };
    MultistartRecord {
        costs: waterfall.costs(),
        failures: failed.map(|run| run.reason.clone()).collect(),
        clusters: clusters.iter().map(cluster).collect(),
        findings: (findings.iter())
            .map(|finding| findings::of_starts(finding, plan.starts))
            .collect(),
    }
}

/// Likelihood-ratio test of a constant for each function.
///
/// # Errors
/// The reason for which there is none.
pub fn constancy_test(
    at: Optimum,
    plan: &StudyPlan,
    threads: usize,
) -> Result<Vec<ConstancyRecord>, String> {
    let asking = ConstancySettings {
        level: 1.0 - plan.confidence,
        seed: plan.seed,
        threads,
        ..ConstancySettings::default()
    };
    let found =
        constancy_tests(at.problem, at.theta, &asking).map_err(|error| error.to_string())?;
    let record = |v: ConstancyTest| ConstancyRecord {
        text: v.sentence(),
        p_value: v.p_value,
        name: v.function,
    };
    Ok(found.into_iter().map(record).collect())
}

/// Bootstrap intervals of the profiled quantities, the constants and the nuisance parameters.
///
/// # Errors
/// The reason for which there are none.
pub fn refits(
    at: Optimum,
    plan: &StudyPlan,
    threads: usize,
) -> Result<Vec<BootstrapRecord>, String> {
    let noise = match plan.residual_noise {
        true => ReplicateNoise::Residual,
        false => ReplicateNoise::Parametric,
    };
    let profiled = plan.profiles.iter().filter_map(|t| linear(at.problem, t));
    let how = (noise, plan.replicates, plan.seed);
    let found = intervals(
        at.problem,
        at.theta,
        profiled,
        how,
        plan.confidence,
        threads,
    );
    let found = found.map_err(|why| match why {
        NoRefits::Undetermined => {
            "bootstrap intervals need identifiable parameters, at most 64 of them: a refit does not move along a \
             combination that is not identifiable"
                .into()
        }
        NoRefits::NoResponse(error) => error.to_string(),
    })?;
    let record = |(of, interval): NumberInterval| BootstrapRecord {
        interval,
        name: of.name,
        unit: of.unit,
    };
    Ok(found.into_iter().map(record).collect())
}

/// Data-consistent extremes of all estimated functions and of k/m and c/m, and the predictions of the model file and of the
/// candidate experiments with their envelopes over the extreme systems.
pub fn extremes(
    model: &Model,
    at: Optimum,
    threads: usize,
) -> (Vec<ExtremesRecord>, Vec<PredictionRecord>) {
    let plan = &model.study;
    let level = MisfitLimit::at(
        at.problem,
        at.theta,
        at.evaluation,
        plan.misfit_limit,
        plan.confidence,
    );
    let mut records = Vec::new();
    let mut extremes = Vec::new();
    for found in envelopes(at.problem, at.theta, &level, &plan.extremes, threads) {
        let ends = found.bands.iter().flat_map(|band| [&band.low, &band.high]);
        let system = |e: &Extreme| ExtremeSystemRecord {
            name: e.name(),
            misfit: e.misfit,
            status: status(e.ended_at(&level)),
        };
        records.push(ExtremesRecord {
            name: found.name,
            unit: model.converted_unit(found.unit).to_owned(),
            times: plan.extremes.clone(),
            low: found.bands.iter().map(|band| band.low.value).collect(),
            high: found.bands.iter().map(|band| band.high.value).collect(),
            misfit_limit: level.misfit,
            systems: ends.map(system).collect(),
        });
        extremes.extend(found.bands.into_iter().flat_map(|b| [b.low, b.high]));
    }
    (records, predictions(model, at, &extremes))
}

/// End of the search for an extreme.
fn status(ended: ExtremeStatus) -> ExtremeSearch {
    match ended {
        ExtremeStatus::Converged => ExtremeSearch::Converged,
        ExtremeStatus::SearchLimit => ExtremeSearch::RangeLimit,
        ExtremeStatus::NoFeasibleStep => ExtremeSearch::Stalled,
        ExtremeStatus::ProgramLimit => ExtremeSearch::IterationLimit,
    }
}

fn predictions(model: &Model, at: Optimum, extremes: &[Extreme]) -> Vec<PredictionRecord> {
    let covariance = at.problem.covariance_of_estimates(at.theta, at.evaluation);
    let free = model.predictions.iter().map(|state| {
        let (y, v) = (state.displacement, state.velocity);
        prediction::PredictionCase::free(format!("from y = {y} m, v = {v} m/s"), *state)
    });
    let candidates = model
        .study
        .candidates
        .iter()
        .map(|c| prediction::PredictionCase {
            excitation: c.experiment.excitation.clone(),
            ..prediction::PredictionCase::free(format!("`{}`", c.name), c.experiment.initial)
        });
    let each = free.chain(candidates).filter_map(|run| {
        let covariance = covariance.as_ref();
        let found = prediction::predict(at.problem, at.theta, &run, covariance, extremes).ok()?;
        Some(PredictionRecord {
            name: found.name,
            times: found.times,
            displacement: found.response.displacement,
            band: found.band,
            envelope: found.worst,
            furthest: (found.furthest)
                .map(|(name, difference)| FurthestSystem { name, difference }),
            unbounded: found.unbounded,
        })
    });
    each.collect()
}
