//! Records of a study from the analyses of the core.

use super::document::*;
use crate::config::Model;
use crate::report::findings;
use kmcfit_core::diagnostics::chi_square_one;
use kmcfit_core::finding::Finding;
use kmcfit_core::identifiability::{
    Ranked, ScalingAmbiguity, Sensitivity, Target, rank_experiments,
};
use kmcfit_core::objective::Evaluation;
use kmcfit_core::problem::Problem;
use kmcfit_core::record::Experiment;
use kmcfit_core::study::{
    Choice, Cluster, EquivalentSystem, Extreme, Interval, MisfitLimit, Multistart, PredictionCase,
    ProfileSettings, Ranges, envelopes, equivalent_systems, multistart, profile,
};

/// Most unidentifiable combinations in the document.
const NAMED: usize = 400;

/// Findings on the structural rank of a problem, the rank bound first.
pub fn structural_rank(problem: &Problem) -> Vec<Finding> {
    let count = kmcfit_core::identifiability::structural_rank(problem);
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
        singular_values: spectrum.singular_values().to_vec(),
    }
}

/// Likelihood profile of one quantity.
///
/// # Errors
/// The reason for which there is none.
pub fn profile_of(at: Optimum, of: &Target, model: &Model) -> Result<ProfileRecord, String> {
    let how = ProfileSettings {
        quantile: chi_square_one(model.study.confidence),
        ..ProfileSettings::default()
    };
    let mut found = profile(at.problem, at.theta, of, &how).map_err(|error| error.to_string())?;
    found.unit = model.converted_unit(&found.unit).to_owned();
    Ok(ProfileRecord {
        text: found.sentence(),
        verdict: match found.verdict {
            Interval::Identified => "identified",
            Interval::OneSided => "one-sided",
            Interval::Flat => "flat",
        }
        .into(),
        name: found.name,
        unit: found.unit,
        optimum: found.optimum,
        values: found.values,
        costs: found.costs,
        interval: found.interval,
    })
}

/// Candidate experiments, the most informative first.
pub fn candidates(at: Optimum, list: &[Experiment]) -> Vec<CandidateRecord> {
    let ranked = rank_experiments(at.problem, at.theta, at.evaluation, list);
    let finite = |ratio: f64| ratio.is_finite().then_some(ratio);
    let record = |r: Ranked| {
        let gain = r.gain.as_ref().ok();
        CandidateRecord {
            text: r.sentence(),
            added_rank: gain.map(|g| g.new_directions),
            d_ratio: gain.and_then(|g| finite(g.volume)),
            name: r.name,
        }
    };
    ranked.into_iter().map(record).collect()
}

/// Equivalent systems: other coefficients with the response of the fit.
pub fn equivalent(at: Optimum, asked: &[Choice]) -> Vec<EquivalentSystemRecord> {
    let record = |found: EquivalentSystem| {
        let mut functions = found.nodal.functions().map(<[f64]>::to_vec);
        EquivalentSystemRecord {
            name: found.name,
            times: at.problem.system.grid.times(),
            mass: functions.next().unwrap_or_default(),
            damping: functions.next().unwrap_or_default(),
            stiffness: functions.next().unwrap_or_default(),
            response_error: found.response_error,
        }
    };
    let found = equivalent_systems(at.problem, at.evaluation, asked);
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
        settings: model.settings.clone(),
    };
    let waterfall = multistart(problem, &how);
    let clusters = waterfall.clusters(problem, plan.merge_tolerance);
    let findings = waterfall.findings(problem, at.theta, &clusters);
    let failed = waterfall.runs.iter().filter(|run| run.found.is_none());
    let cluster = |c: &Cluster| ClusterRecord {
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
            status: e.ended_at(&level),
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

fn predictions(model: &Model, at: Optimum, extremes: &[Extreme]) -> Vec<PredictionRecord> {
    let covariance = at.problem.covariance_of_estimates(at.theta, at.evaluation);
    let free = model.predictions.iter().map(|state| {
        let (y, v) = (state.displacement(0), state.velocity(0));
        PredictionCase::free(format!("from y = {y} m, v = {v} m/s"), state.clone())
    });
    let candidates = model.study.candidates.iter().map(|c| PredictionCase {
        excitation: c.excitation.clone(),
        ..PredictionCase::free(format!("`{}`", c.name), c.initial.clone())
    });
    let each = free.chain(candidates).filter_map(|run| {
        let covariance = covariance.as_ref();
        let found = (run.predict(at.problem, at.theta, covariance, extremes)).ok()?;
        Some(PredictionRecord {
            name: found.name,
            times: found.times,
            displacement: found.response.displacement(0).to_vec(),
            band: found.band,
            envelope: found.worst,
            furthest: (found.furthest)
                .map(|(name, difference)| FurthestSystem { name, difference }),
            unbounded: found.unbounded,
        })
    });
    each.collect()
}
