//! `kmcfit report`: draws the page and the figures of a finished run again.

use super::progress::Activity;
use super::{CommandError, OK, print, unwritable};
use crate::report::document::ResultDocument;
use crate::report::{FittedModel, Run, RunAssessment, fit_claim, rebuilt_fit};
use crate::results::{Manifest, OutputFolder, RequestedFiles};
use std::io;
use std::path::PathBuf;

/// Write the page and the figures of a finished run again, without a fit.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit report runs/model")]
pub struct Arguments {
    /// Folder of a finished run.
    run: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let activity = Activity::begin(format!("reading {}", arguments.run.display()));
    let run = Run::open(&arguments.run)?;
    let (model, mut fit) = rebuilt_fit(&run)?;
    fit.history.clone_from(&run.history);
    let run_assessment = RunAssessment::of(&model, &fit);
    let fitted = FittedModel {
        model: &model,
        fit: &fit,
        predictions: &run.document.predictions,
        weights: None,
        run_assessment: &run_assessment,
        requested: RequestedFiles::figures(),
    };
    // A stored map of estimates has the order of its names, the answer that of importance.
    let document = ResultDocument {
        estimates: fitted.document().estimates,
        ..run.document.clone()
    };
    activity.stage("drawing the figures and the page");
    let folder = OutputFolder::prepare(&run.folder, fit_claim(&model))?;
    let manifest = Manifest::read(&run.folder)?;
    let kept = manifest.into_iter().flat_map(|manifest| manifest.files);
    let kept: Vec<String> = kept.map(|(name, _)| name).collect();
    write(&folder, &kept, &fitted.drawings(&document))
        .map_err(|error| unwritable(folder.path(), &error))?;
    drop(activity);
    print(&format!(
        "report and figures in {}\n",
        folder.path().display()
    ));
    Ok(OK)
}

/// Starts of the names of figures that need the search: iterates, and the path of penalty weights.
const OF_THE_SEARCH: [&str; 2] = ["figures/motion", "figures/weights"];

/// Replaces the page and the figures; the other files of the run, and its figures of the search, stay as they are.
fn write(folder: &OutputFolder, kept: &[String], drawings: &[(String, String)]) -> io::Result<()> {
    let is_of_search = |name: &str| OF_THE_SEARCH.iter().any(|start| name.starts_with(start));
    let is_kept = |name: &String| is_of_search(name) && kept.contains(name);
    let drawn = || drawings.iter().filter(|(name, _)| !is_kept(name));
    let mut stage = folder.stage()?;
    for name in kept {
        if !drawn().any(|(own, _)| own == name) {
            stage.write(name, std::fs::read(folder.path().join(name))?)?;
        }
    }
    for (name, text) in drawn() {
        stage.write(name, text)?;
    }
    stage.commit()
}
