//! From a model to its results in memory: with the data in memory too it needs no files and threads, and no clock but that of the
//! [`Host`](kmcfit_core::host::Host).

use crate::config::{BuildMode, ModelFile, build};
use crate::error::InputError;
use crate::fitting::fit_or_no_response;
use crate::report::document::{ResultDocument, Verdict};
use crate::report::trial::advice;
use crate::report::{AnswerRow, CompletedFit, RequestedFiles, answer, summary};
use kmcfit_core::solvers::{IterationRecord, Observer};

/// A fitted model with its results.
#[derive(Debug, Clone)]
pub struct Analysis {
    /// The fit with its assessment.
    pub fit: CompletedFit,
    /// The result document: verdict, estimates with intervals, findings, advice.
    pub document: ResultDocument,
}

/// Reads the data of a model, fits and assesses it, and tries what it advises; `observe` is called after each iteration of the fit.
///
/// ```
/// use kmcfit::config::{ModelFile, Source, Statements, scaffold};
///
/// let decay = |t: f64| (-0.5 * t).exp() * (8.0 * t).cos() + 0.002 * (900.0 * t * t).sin();
/// let rows = (0..200).map(|i| f64::from(i) * 0.02).map(|t| format!("{t},{}\n", decay(t)));
/// let record = format!("t (s),y (mm)\n{}", rows.collect::<String>()).into_bytes();
///
/// let source = Source::in_memory("decay.csv", record.clone());
/// let model = scaffold(&[source], &Statements::default())?.text;
/// let file = ModelFile::parse("decay.yaml", model)?.with_files([("decay.csv".to_owned(), record.into())]);
/// let found = kmcfit::analyse(&file, &mut |_| {})?;
/// assert!(found.text().starts_with("decay: "));
/// assert!(found.page().contains("natural frequency"));
/// # Ok::<(), kmcfit::error::InputError>(())
/// ```
///
/// # Errors
/// At the first invalid key or sample; at the model file where no starting point can be simulated.
pub fn analyse(
    file: &ModelFile,
    observe: &mut dyn FnMut(&IterationRecord),
) -> Result<Analysis, InputError> {
    let model = build(file, BuildMode::Fit)?;
    let found = fit_or_no_response(&model, &mut Observer::new(observe))
        .map_err(|reason| InputError::file(&file.path, reason))?;
    let fit = CompletedFit::of(found);
    let mut document = fit.fitted(RequestedFiles::figures()).document();
    document.advice = advice(file, &fit.model, &fit.fit, &document);
    Ok(Analysis { fit, document })
}

impl Analysis {
    /// Estimates with 95 % intervals, units and how they were obtained.
    pub fn estimates(&self) -> Vec<AnswerRow> {
        answer(&self.document)
    }

    /// The verdict and its reasons, one on each line.
    pub fn verdict(&self) -> String {
        let verdict = self.document.verdict.as_ref();
        verdict.map_or_else(String::new, Verdict::lines)
    }

    /// The text of `kmcfit fit`: verdict, estimates with intervals, fit of the samples, advice.
    pub fn text(&self) -> String {
        summary(&self.document, false, None)
    }

    /// The report page, one HTML file without external resources.
    pub fn page(&self) -> String {
        self.fit
            .fitted(RequestedFiles::figures())
            .page(&self.document)
    }
}
