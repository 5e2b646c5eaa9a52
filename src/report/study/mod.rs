//! Results of a study: `study.json`, `study.html` and figures.

mod bands;
mod document;
mod figures;
mod fit;
mod page;
mod records;
mod text;

pub use document::{
    AnalysisFailure, BandRecord, BandsRecord, CandidateRecord, ClassificationRecord, ClusterRecord,
    EquivalentSystemRecord, ExtremeSystemRecord, ExtremesRecord, FurthestSystem, MultistartRecord,
    Numbers, PredictionRecord, ProfileRecord, SensitivityRecord, StudiedFit, StudyDocument,
    UnidentifiableRecord,
};

pub use bands::bands;
pub use records::*;

use super::extent::size_in_words;
use super::page::source_line;
use super::render;
use crate::config::Model;
use crate::results::OutputFolder;
use kmcfit_core::record::Channel;
use std::io;

/// Status of a study with all its analyses.
pub const COMPLETE: &str = "complete";

impl StudyDocument {
    /// True if all analyses were finished.
    pub fn is_complete(&self) -> bool {
        self.status == COMPLETE
    }

    /// The findings as sentences, each with the name of its part, in the order of the page.
    pub fn findings(&self) -> Vec<(&'static str, String)> {
        let parts = text::PARTS.into_iter();
        let of = |part: text::Part| {
            let sentences = (part.sentences)(self).into_iter();
            sentences.map(move |sentence| (part.anchor, sentence))
        };
        parts.flat_map(of).collect()
    }

    /// The study as text for a terminal.
    pub fn text(&self) -> String {
        text::text(self)
    }

    /// Writes `study.json`, `study.html` and `figures/*.svg` of the study of a model.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn write(&self, folder: &OutputFolder, model: &Model) -> io::Result<()> {
        for figure in text::PARTS.iter().filter_map(|part| (part.figure)(self)) {
            folder.write(&format!("figures/{}.svg", figure.name), render(&figure))?;
        }
        let samples = model.problem.channels().map(Channel::len).sum();
        let duration = model.problem.system.grid.duration();
        let size = size_in_words(samples, model.problem.experiments.len(), duration);
        let source = source_line(&model.source.data, Some(size));
        folder.write("study.html", page::page(self, &source))?;
        folder.commit(self)
    }
}
