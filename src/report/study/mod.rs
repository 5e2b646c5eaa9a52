//! What a study found: pieces that are kept as they are finished, one document, figures, one page.

mod figures;
mod fit;
mod page;
mod pieces;
mod records;
mod text;

pub use pieces::{
    BandRecord, BandsPiece, BootstrapRecord, CandidateRecord, ClusterRecord, DirectionRecord,
    EquivalentRecord, FitPiece, JudgementRecord, MultistartPiece, NamedRecord, Numbers,
    PredictionRecord, ProfilePiece, SpectrumPiece, StudyDocument, TubeRecord, VariesRecord,
};

pub use records::*;

use super::{json, render};
use crate::results::{Claim, OutputFolder};
use std::io;

impl StudyDocument {
    /// The sentences of the study, for a terminal.
    pub fn text(&self) -> String {
        text::text(self)
    }

    /// The files that a study writes.
    pub fn claim() -> Claim {
        Claim::new("study")
            .files(["study.html", "study.json"])
            .family("figures", "svg", figures::NAMES)
    }

    /// Writes `study.json`, `study.html` and `figures/*.svg`.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write(&self, folder: &OutputFolder) -> io::Result<()> {
        let mut stage = folder.stage()?;
        for figure in figures::all(self) {
            stage.write(&format!("figures/{}.svg", figure.name), &render(&figure))?;
        }
        stage.write("study.html", &page::page(self))?;
        stage.write("study.json", &json(self))?;
        stage.commit()
    }
}
