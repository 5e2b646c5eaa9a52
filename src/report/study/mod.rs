//! What a study found: pieces that are kept as they are finished, one document, figures, one page.

mod figures;
pub mod gather;
mod page;
mod pieces;
mod text;

pub use pieces::{
    BandRecord, BandsPiece, BootstrapRecord, CandidateRecord, ClusterRecord, DirectionRecord,
    EquivalentRecord, FitPiece, JudgementRecord, MultistartPiece, NamedRecord, Numbers,
    PredictionRecord, ProfilePiece, SpectrumPiece, StudyDocument, TubeRecord, VariesRecord,
};

use super::files::OutputFolder;
use super::{json, render};
use std::io;

impl StudyDocument {
    /// The sentences of the study, for a terminal.
    pub fn text(&self) -> String {
        text::text(self)
    }

    /// Writes `study.json`, `study.html` and `figures/*.svg`.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write(&self, folder: &OutputFolder) -> io::Result<()> {
        let mut stage = folder.stage()?;
        let mut batch = stage.batch();
        for figure in figures::all(self) {
            batch.write(&format!("figures/{}.svg", figure.name), &render(&figure))?;
        }
        batch.write("study.html", &page::page(self))?;
        batch.write("study.json", &json(self))?;
        batch.finish()?;
        stage.commit()
    }
}
