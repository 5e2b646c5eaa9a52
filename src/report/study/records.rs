//! Records of a study from the analyses of the core.

use super::document::*;
use crate::config::{Candidate, Equivalent, Model, StudyPlan, StudyTarget};
use crate::finding::Finding;
use crate::report::findings;
use kmcfit_core::internals::diagnostics::chi_square_one;
use kmcfit_core::internals::identifiability::{
    self, CandidateChannel, ScalingAmbiguity, Sensitivity, rank_experiments, residual_spread,
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

pub(super) fn finite_numbers(values: &[f64]) -> Numbers {
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
