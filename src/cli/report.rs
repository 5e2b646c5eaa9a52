//! `kmcfit report`: draws the page and the figures of a finished run again.

use super::progress::Activity;
use super::{CommandError, OK, print, unwritable};
use crate::error::InputError;
use crate::report::document::ResultDocument;
use crate::report::{
    DisplayUnits, FigureWidth, FittedModel, Run, RunAssessment, fit_claim, rebuilt_fit,
};
use crate::results::{Manifest, OutputFolder, RequestedFiles};
use crate::text_io::quote;
use std::io;
use std::path::PathBuf;

/// Write the page and the figures of a finished run again, without a fit.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  kmcfit report runs/model\n  kmcfit report runs/model --width 85 --units acceleration=g,force=kN"
)]
pub struct Arguments {
    /// Folder of a finished run.
    run: PathBuf,
    /// Units of page and figures by quantity (displacement, velocity, acceleration, force), as in `acceleration=g,force=kN`; result.json
    /// and the tables keep theirs.
    #[arg(long, value_name = "UNITS")]
    units: Option<String>,
    /// Width of the figures in mm: 85, one column of a journal, or 180, two.
    #[arg(long, value_name = "MM", default_value = "180")]
    width: String,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let width = width(&arguments.width)?;
    let activity = Activity::begin(format!("reading {}", arguments.run.display()));
    let run = Run::open(&arguments.run)?;
    let units = arguments.units.as_ref();
    let display = units.map(|text| DisplayUnits::parse(text, run.document.is_rotation()));
    let display = display.transpose()?.unwrap_or_default();
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
        display,
        computed: Default::default(),
    };
    // A stored map of estimates has the order of its names, the answer that of importance. Records have the units for display.
    let shown = fitted.document();
    let document = ResultDocument {
        estimates: shown.estimates,
        experiments: shown.experiments,
        validation: shown.validation,
        ..run.document.clone()
    };
    activity.stage("drawing the figures and the page");
    let folder = OutputFolder::prepare(&run.folder, fit_claim(&model))?;
    let manifest = Manifest::read(&run.folder)?;
    let kept = manifest.into_iter().flat_map(|manifest| manifest.files);
    let kept: Vec<String> = kept.map(|(name, _)| name).collect();
    write(&folder, &kept, &fitted.drawings(&document, width))
        .map_err(|error| unwritable(folder.path(), &error))?;
    drop(activity);
    print(&format!(
        "report and figures in {}\n",
        folder.path().display()
    ));
    Ok(OK)
}

/// Reads the width of the figures.
fn width(text: &str) -> Result<FigureWidth, InputError> {
    let mut widths = FigureWidth::ALL.into_iter();
    let found = widths.find(|width| width.millimetres().to_string() == text);
    found.ok_or_else(|| {
        InputError::argument("--width", "invalid width of the figures")
            .found(quote(text))
            .expected("85 (one column of a journal) or 180 (two), in mm")
    })
}

/// Starts of the names of figures that need the search: iterates, and the path of penalty weights.
const OF_THE_SEARCH: [&str; 2] = ["figures/motion", "figures/weights"];

/// Replaces the page and the figures; the other files of the run, and its figures of the search, stay as they are.
fn write(folder: &OutputFolder, kept: &[String], drawings: &[(String, String)]) -> io::Result<()> {
    let is_of_search = |name: &str| OF_THE_SEARCH.iter().any(|start| name.starts_with(start));
    let is_kept = |name: &String| is_of_search(name) && kept.contains(name);
    let drawn = || drawings.iter().filter(|(name, _)| !is_kept(name));
    let stage = folder.stage()?;
    for name in kept {
        // A figure that is not drawn any more is one in another unit.
        let is_stale = name.starts_with("figures/") && !is_of_search(name);
        if !is_stale && !drawn().any(|(own, _)| own == name) {
            stage.write(name, std::fs::read(folder.path().join(name))?)?;
        }
    }
    for (name, text) in drawn() {
        stage.write(name, text)?;
    }
    stage.commit()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::Claim;

    /// Of the figures of an earlier report the one that is not drawn any more is removed; tables and figures of the search stay.
    #[test]
    fn figures_that_are_not_drawn_are_removed() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("run");
        let write_run = |kept: &[&str], drawn: &[&str]| {
            let claim = Claim::new("fit").files(["functions.csv"]).family(
                "figures",
                "svg",
                ["motion", "ratios", "spectra"],
            );
            let folder = OutputFolder::prepare(&path, claim).expect("a folder");
            let kept: Vec<String> = kept.iter().map(ToString::to_string).collect();
            let drawn = drawn
                .iter()
                .map(|name| (name.to_string(), name.to_string()));
            write(&folder, &kept, &drawn.collect::<Vec<_>>()).expect("written");
        };
        let first = [
            "functions.csv",
            "figures/motion.svg",
            "figures/ratios.svg",
            "figures/spectra.svg",
        ];
        write_run(&[], &first);
        write_run(&first, &["figures/ratios.svg"]);
        let is_there = first.map(|name| path.join(name).exists());
        assert_eq!(is_there, [true, true, true, false]);
        let manifest = Manifest::read(&path)
            .expect("readable")
            .expect("a manifest");
        assert_eq!(
            manifest.files.keys().collect::<Vec<_>>(),
            ["figures/motion.svg", "figures/ratios.svg", "functions.csv"]
        );
    }
}
