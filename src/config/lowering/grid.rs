//! The time grid: given by the model file, one node per sample, or an automatic number of nodes.

mod auto;
mod finer;

pub(super) use finer::{FinerNodes, stable_nodes};

use super::BuildMode;
use super::experiments::{RawChannel, RawRecord};
use super::functions;
use crate::config::ModelFile;
use crate::error::{InputError, Location};
use crate::memory::MOST_NODES_TIMES_PARAMETERS;
use kmcfit_core::finding::Finding;
use kmcfit_core::model::{BasisName, FitMethod, KnotSpec, Nodes};
use kmcfit_core::number_format::significant;
use kmcfit_core::problem::FEW_PARAMETERS;
use kmcfit_core::system::{Grid, Method};

/// Most nodes of an automatic choice: the same on every machine.
pub(super) const MOST_CHOSEN: usize = 10_000_000;

/// The grid, and the numbers of nodes for finer ones where it is automatic.
#[derive(Debug, Clone, Copy)]
pub(super) struct GridChoice {
    pub grid: Grid,
    pub finer: Option<FinerNodes>,
}

/// Chooses the grid; an automatic one has at least `least` nodes.
pub(super) fn build(
    file: &ModelFile,
    mode: BuildMode,
    records: &[Option<RawRecord>],
    least: usize,
    notes: &mut Vec<Finding>,
) -> Result<GridChoice, InputError> {
    let asked = file.spec.grid.as_ref().and_then(|g| g.nodes.as_ref());
    let asked = match (mode.nodes(), asked) {
        (Some(nodes), _) => Some(Nodes::Count(nodes)),
        (None, asked) => asked.copied(),
    };
    let (start, duration) = span(file, records)?;
    let measured = records.iter().flatten().any(|r| !r.channels.is_empty());
    // Without a statement, samples that are equally spaced stay on nodes.
    let sampling = match asked {
        None => node_per_sample(records),
        Some(_) => None,
    };
    let stated = match asked {
        Some(Nodes::Count(count)) => Some(count),
        _ if !measured => {
            return Err(file
                .error_at("grid", "the number of nodes is missing")
                .expected("`nodes`, because there is no record"));
        }
        Some(Nodes::Auto(_)) => None,
        None if is_automatic(file) => None,
        None => sampling,
    };
    let (nodes, finer) = match stated {
        Some(nodes) => (nodes, None),
        None => {
            let mut finer =
                FinerNodes::of(records, duration, MOST_CHOSEN, sampling, asked.is_some());
            let mut choice = Vec::new();
            let first = auto::nodes(
                method(file),
                records,
                duration,
                MOST_CHOSEN,
                &finer,
                &mut choice,
            );
            // One node per sample needs no explanation.
            finer.is_per_sample = sampling == Some(first);
            if !finer.is_per_sample {
                notes.append(&mut choice);
            }
            (finer.at_least(least.max(first)), Some(finer))
        }
    };
    if nodes < Grid::FEWEST_NODES {
        return Err(about_nodes(file, mode, "invalid number of nodes")
            .found(nodes)
            .expected(format!("{} or more", Grid::FEWEST_NODES)));
    }
    check_size(file, mode, nodes)?;
    let grid = Grid::new(start, duration, nodes).ok_or_else(|| {
        file.error_at("grid", "invalid time axis")
            .found(format!("{nodes} nodes over {duration:?} s"))
            .expected("a positive duration whose steps are not zero")
    })?;
    Ok(GridChoice { grid, finer })
}

fn about_nodes(file: &ModelFile, mode: BuildMode, problem: &str) -> InputError {
    match mode.nodes() {
        Some(_) => InputError::new(Location::Argument("--nodes".into()), problem),
        None => file.error_at("grid.nodes", problem),
    }
}

/// Error about steps that let the response at the start grow, where `least` nodes have stable ones.
pub(super) fn unstable_steps(
    file: &ModelFile,
    mode: BuildMode,
    grid: &Grid,
    least: usize,
) -> InputError {
    let problem = "the steps are unstable at the start values of the functions";
    let (nodes, step) = (grid.nodes(), significant(grid.step(), 3));
    let error = about_nodes(file, mode, problem).found(format!("{nodes} nodes, steps of {step} s"));
    let error = error.expected(format!("at least {least} nodes"));
    error.hint("a response to these steps grows, whatever the system does")
}

/// Note on steps that are unstable at the start of a search, where `least` nodes have stable ones.
pub(super) fn unstable_start(grid: &Grid, least: usize) -> Finding {
    let nodes = grid.nodes();
    let text = format!(
        "grid: with {nodes} nodes the steps are unstable at the start values of the functions; at least {least} nodes have stable ones"
    );
    let finding = Finding::new("unstable_start", text);
    finding.with("nodes", nodes).with("stable_nodes", least)
}

/// Refuses a grid with too many nodes for the parameters of the functions.
fn check_size(file: &ModelFile, mode: BuildMode, nodes: usize) -> Result<(), InputError> {
    let counts = functions::all(file)
        .into_iter()
        .map(|(_, spec)| match spec.basis {
            _ if matches!(mode, BuildMode::Simulate { .. }) => 0,
            None => 0,
            Some(BasisName::Constant) => 1,
            Some(BasisName::Polynomial) => spec.degree.map_or(1, |degree| degree.saturating_add(1)),
            Some(BasisName::Nodal) => FEW_PARAMETERS,
            Some(_) => match &spec.knots {
                Some(KnotSpec::Count(count)) => *count,
                Some(KnotSpec::Times(times)) => times.len(),
                _ => FEW_PARAMETERS,
            },
        });
    let parameters = counts.fold(1, usize::saturating_add).min(FEW_PARAMETERS);
    let most = MOST_NODES_TIMES_PARAMETERS / parameters;
    match nodes <= most {
        true => Ok(()),
        false => Err(about_nodes(file, mode, "too many nodes")
            .found(format!(
                "{nodes} nodes with {parameters} or more parameters"
            ))
            .expected(format!("at most {most} nodes"))),
    }
}

/// True if a model without a number of nodes has an automatic one: it states no stepper either, and its method refines the grid by
/// the standard errors, for which every experiment has a sigma.
fn is_automatic(file: &ModelFile) -> bool {
    let has_stepper = file.spec.grid.as_ref().is_some_and(|g| g.method.is_some());
    let method = file.spec.fit.as_ref().and_then(|fit| fit.method);
    let refines = matches!(
        method,
        None | Some(FitMethod::GaussNewton | FitMethod::ProjectedGradient)
    );
    let has_sigma = file.spec.experiments.iter().all(|e| e.sigma.is_some());
    !has_stepper && refines && has_sigma
}

/// Number of nodes for one node per sample, if all channels of all records have the same equally spaced times.
fn node_per_sample(records: &[Option<RawRecord>]) -> Option<usize> {
    let mut channels = records.iter().flatten().flat_map(|r| &r.channels);
    let first = channels.next()?;
    let spacing = first.spacing?;
    let same = |c: &RawChannel| {
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-6 * spacing;
        c.times.len() == first.times.len()
            && c.spacing.is_some_and(|s| close(s, spacing))
            && close(c.times[0], first.times[0])
    };
    let usable = !first.decimated && first.span[0] == first.times[0];
    (usable && channels.all(same)).then_some(first.times.len())
}

/// First time and length of the records, s; without samples the length given by the model.
fn span(file: &ModelFile, records: &[Option<RawRecord>]) -> Result<(f64, f64), InputError> {
    let asked = file.spec.grid.as_ref().and_then(|g| g.duration.as_ref());
    if let Some(duration) = asked
        && *duration <= 0.0
    {
        return Err(file
            .error_at("grid.duration", "the duration is not positive")
            .found(duration)
            .expected("a length of time in s, greater than 0"));
    }
    let measured = || records.iter().flatten().filter(|r| !r.channels.is_empty());
    let Some(first) = measured().next() else {
        let duration = asked.ok_or_else(|| {
            file.error_at("grid", "the duration is missing")
                .expected("`duration` in s, because there is no record")
        })?;
        return Ok((0.0, *duration));
    };
    let start = measured()
        .map(RawRecord::start)
        .fold(f64::INFINITY, f64::min);
    let end = measured()
        .map(RawRecord::end)
        .fold(f64::NEG_INFINITY, f64::max);
    let duration = end - start;
    if let Some(asked) = asked
        && (asked - duration).abs() > first.spacing() * 1e-6
    {
        return Err(file
            .error_at(
                "grid.duration",
                "the duration differs from that of the records",
            )
            .found(asked)
            .expected(format!("{duration} or no `duration`")));
    }
    Ok((start, asked.copied().unwrap_or(duration)))
}

/// The stepper; classical Runge–Kutta unless the model says otherwise.
pub(super) fn method(file: &ModelFile) -> Method {
    let method = file.spec.grid.as_ref().and_then(|g| g.method);
    method.unwrap_or(Method::Rk4)
}
