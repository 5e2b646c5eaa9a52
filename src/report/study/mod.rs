//! Results of a study: `study.json`, `study.html` and figures. The records of finished analyses are kept in a journal.

mod bands;
mod document;
mod figures;
mod fit;
mod page;
mod records;
mod text;

pub use document::{
    ActiveFrom, AnalysisFailure, BandRecord, BandsRecord, BootstrapRecord, CandidateRecord,
    ClassificationRecord, ClusterRecord, ConstancyRecord, DirectionRecord, EquivalentSystemRecord,
    ExtremeSearch, ExtremeSystemRecord, ExtremesRecord, FurthestSystem, MultistartRecord, Numbers,
    PredictionRecord, ProfileRecord, SensitivityRecord, StudiedFit, StudyDocument,
    UnidentifiableRecord,
};

pub use bands::bands;
pub use records::*;

use super::{json, render};
use crate::results::{Claim, OutputFolder};
use std::io;

impl StudyDocument {
    /// The study as text for a terminal.
    pub fn text(&self) -> String {
        text::text(self)
    }

    /// Files that a study writes.
    pub fn claim() -> Claim {
        Claim::new("study")
            .files(["study.html", "study.json"])
            .family("figures", "svg", figures::NAMES)
    }

    /// Writes `study.json`, `study.html` and `figures/*.svg`.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn write(&self, folder: &OutputFolder) -> io::Result<()> {
        let mut stage = folder.stage()?;
        for figure in figures::all(self) {
            stage.write(&format!("figures/{}.svg", figure.name), render(&figure))?;
        }
        stage.write("study.html", page::page(self))?;
        stage.write("study.json", json(self))?;
        stage.commit()
    }
}
