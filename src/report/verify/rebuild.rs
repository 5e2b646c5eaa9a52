//! The fitted model of a finished run, rebuilt from its model file, data and parameters.

use crate::config::{BuildMode, Model, ModelFile, Override, build};
use crate::error::InputError;
use crate::report::Run;
use crate::report::parameters::{ChannelNoise, ParametersDocument};
use kmcfit_core::internals::problem::ProblemParts;
use kmcfit_core::internals::record::{Channel, NoiseEstimate, Weighting};
use kmcfit_core::internals::solvers::{Fit, stored_fit};

/// The model of a run as fitted and its fit, from its model file, data and `parameters.json`.
///
/// # Errors
/// If model file, data or `parameters.json` are missing or invalid or belong to another model; for fits that cannot be rebuilt.
pub fn rebuilt_fit(run: &Run) -> Result<(Model, Fit), InputError> {
    let (parameters, _) = ParametersDocument::read(&run.folder)?;
    let Rebuilt { model, fit } = rebuilt(run, &parameters)?;
    Ok((model, fit))
}

/// The model of a run as fitted, and its fit at the stored parameters.
pub(super) struct Rebuilt {
    pub model: Model,
    pub fit: Fit,
}

/// Rebuilds the model and the fit of a run.
///
/// # Errors
/// If the model file or its data are missing or invalid, or do not give the parameters and the grid of the run; for the kinds of fits
/// that cannot be rebuilt.
pub(super) fn rebuilt(run: &Run, parameters: &ParametersDocument) -> Result<Rebuilt, InputError> {
    let document = &run.document;
    let overrides = Override::parse_all(&document.model.overrides)?;
    let file = ModelFile::read_with_overrides(&document.model.file, &overrides)
        .map_err(|error| error.hint("run this command in the folder in which the run was made"))?;
    let model = build(&file, BuildMode::Fit)?;
    let mut model = on_grid(run, model)?;
    if let Some(width) = document.model.friction_width {
        model = model.with_friction_width(width);
    }
    check_parameters(run, &model, parameters)?;
    let (problem, noise) = (model.problem.clone(), &parameters.noise);
    let factors: Vec<f64> = (model.notes.iter().flatten())
        .map(|note| note.unit.factor())
        .collect();
    let is_noise_stated = noise.len() == problem.channels().count();
    let weights: Vec<f64> = document.penalties.iter().map(|p| p.weight).collect();
    let change = |parts: &mut ProblemParts| {
        for (penalty, weight) in parts.penalties.iter_mut().zip(&weights) {
            penalty.weight = *weight;
        }
        let channels = parts.experiments.iter_mut().flat_map(|e| &mut e.channels);
        let factors = factors.iter().copied().chain(std::iter::repeat(1.0));
        for ((channel, stored), factor) in channels.zip(noise).zip(factors) {
            *channel = with_noise(channel.clone(), stored, factor);
        }
    };
    let changed = (is_noise_stated && weights.len() == problem.penalties.len())
        .then(|| problem.with(change).ok())
        .flatten();
    model.problem = changed.ok_or_else(|| differs(run, "its channels or penalties", "others"))?;
    let fit = stored_fit(
        &model.problem,
        &parameters.values,
        &model.settings,
        document.outcome.status,
        document.optimality.is_some(),
    );
    match fit {
        Ok(Some(fit)) => Ok(Rebuilt { model, fit }),
        Ok(None) => Err(uncovered(
            run,
            "an equation error with nonlinear terms or a robust loss",
        )),
        Err(breakdown) => Err(differs(run, "a response", &breakdown.to_string())),
    }
}

/// The model on the grid of the run.
fn on_grid(run: &Run, model: Model) -> Result<Model, InputError> {
    let nodes = run.document.model.nodes;
    let own = model.problem.system.grid.nodes();
    if own == nodes {
        return Ok(model);
    }
    let finer = model.on_nodes(nodes);
    let finer = finer.filter(|finer| finer.problem.system.grid.nodes() == nodes);
    finer.ok_or_else(|| differs(run, &format!("{nodes} nodes"), &format!("{own} nodes")))
}

/// Refuses parameters of another model, and the fits that parameters and noise do not describe.
fn check_parameters(
    run: &Run,
    model: &Model,
    parameters: &ParametersDocument,
) -> Result<(), InputError> {
    let (stored, own) = (parameters.values.len(), model.problem.parameters());
    let has_jumps = parameters.functions.iter().any(|f| f.has_jumps);
    let has_input_errors = (parameters.noise.iter())
        .any(|noise| noise.correlation.as_ref().is_some_and(|c| c.input_errors));
    match () {
        () if has_jumps => Err(uncovered(run, "a coefficient with jumps found by `bic`")),
        () if has_input_errors => Err(uncovered(run, "errors of the input (`sigma.force`)")),
        () if stored != own => Err(differs(
            run,
            &format!("{stored} parameters"),
            &format!("{own} parameters"),
        )),
        () => Ok(()),
    }
}

/// The model file does not give what the run has.
fn differs(run: &Run, expected: &str, found: &str) -> InputError {
    InputError::file(
        &run.document.model.file,
        "the model file does not give the model of the run",
    )
    .found(found)
    .expected(format!("{expected}, as in {}", run.folder.display()))
    .hint("the model file or its data have changed since the fit: fit again")
}

fn uncovered(run: &Run, found: &str) -> InputError {
    InputError::file(&run.folder, "this kind of fit cannot be rebuilt")
        .found(found)
        .expected("a fit that its parameters and the noise of its channels describe")
        .hint("fit the model again into another folder and compare the result documents")
}

/// A channel with its stored noise; `factor` is that from the unit of the file to SI.
fn with_noise(channel: Channel, stored: &ChannelNoise, factor: f64) -> Channel {
    let channel = match (channel.weighting(), stored.sigma) {
        (Weighting::Estimated { .. }, Some(sigma)) => {
            channel.with_weighting(Weighting::Estimated {
                sigma: sigma * factor,
            })
        }
        _ => channel,
    };
    let noise = NoiseEstimate {
        correlation: stored.law(channel.times()),
        covariance: stored.covariance(),
        scores: stored.scores,
    };
    match noise.correlation.is_some() && !channel.weighting().is_sigma() {
        true => channel,
        false => channel.with_noise(noise),
    }
}
