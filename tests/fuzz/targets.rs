//! Fuzz targets as functions of bytes: each reads its input as the program does and must return a value or a message for
//! any bytes. The tests run them on the corpus and on mutations of it; `fuzz/` runs the same functions.

use kmcfit::Run;
use kmcfit::config::values::{Count, Nodes};
use kmcfit::config::{BuildMode, Model, ModelFile, Override, Sequence, build};
use kmcfit::error::InputError;
use kmcfit::formats::{self, recognise};
use kmcfit::report::study::StudyDocument;
use kmcfit::report::{DisplayUnits, FittedModel, RunAssessment, fit_claim, json, predict};
use kmcfit::results::{
    AnalysisJournal, CHECKPOINT, FIT_JOURNAL, FitJournal, Heading, OutputFolder, RESULT,
    STUDY_JOURNAL, with_checksums,
};
use kmcfit::tables::{ColumnName, Table, TableFormat, times};
use kmcfit_core::internals::solvers::{Fit, Observer, fit_with_noise_watched};
use kmcfit_core::internals::system::State;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};
use tempfile::TempDir;

/// A fuzz target.
pub type Target = fn(&[u8]) -> Verdict;

/// Result of an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    Accepted,
    Refused,
}

/// Kinds of messages so far: messages without numbers and quotations.
pub static KINDS: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// All targets, by the names of their folders in the corpus.
pub const TARGETS: [(&str, Target); 9] = [
    ("model", model),
    ("table", table),
    ("run", run),
    ("fit_journal", fit_journal),
    ("study_journal", study_journal),
    ("yaml", yaml),
    ("override", overrides),
    ("sequence", sequence),
    ("channels", channels),
];

/// Largest number of nodes on which a model is built; larger ones are reduced to limit the time.
const MANY_NODES: usize = 300;
/// Number of nodes that exceeds any memory: rejected, and therefore not reduced.
const TOO_MANY_NODES: usize = 1_000_000_000;
/// Largest number of lines of each file of samples.
const LINES: usize = 60;

const METHODS: [&str; 4] = [
    "lbfgs",
    "gauss-newton",
    "projected-gradient",
    "steepest-descent",
];

/// Names, models and samples that the targets work on.
struct Workshop {
    folder: TempDir,
    /// For each method a model and its problem.
    fits: Vec<(Heading, Model)>,
}

impl Workshop {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

/// Working folder: the shipped samples, truncated, and a finished run.
fn workshop() -> &'static Workshop {
    static WORKSHOP: OnceLock<Workshop> = OnceLock::new();
    WORKSHOP.get_or_init(|| {
        // In memory where that can be had: each input is written and synced.
        let memory = Path::new("/dev/shm");
        let folder = match memory.is_dir() {
            true => tempfile::tempdir_in(memory),
            false => tempfile::tempdir(),
        };
        let folder = folder.expect("a folder");
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR"));
        let shipped = match shipped.join("data").is_dir() {
            true => shipped.join("data"),
            false => shipped.join("../data"),
        };
        for name in ["data", "models", "run", "fit", "study"] {
            fs::create_dir(folder.path().join(name)).expect("a folder");
        }
        for entry in fs::read_dir(shipped).expect("the folder of samples") {
            let path = entry.expect("an entry").path();
            let text = fs::read(&path).expect("samples");
            let lines: Vec<&[u8]> = text.split_inclusive(|b| *b == b'\n').take(LINES).collect();
            let name = path.file_name().expect("a name");
            fs::write(folder.path().join("data").join(name), lines.concat()).expect("room");
        }
        let fits = METHODS.map(|method| small(folder.path(), method));
        let workshop = Workshop {
            folder,
            fits: fits.into(),
        };
        finish(&workshop);
        workshop
    })
}

/// A small problem on few nodes, for targets that read journals.
fn small(folder: &Path, method: &str) -> (Heading, Model) {
    let text = format!(
        "format: 1\ntitle: Small\nexperiments:\n  - {{data: ../data/paper.csv, sigma: {{displacement: 0.1}}, \
         initial: {{displacement: 3.3, velocity: 1.0}}}}\ngrid: {{method: midpoint, nodes: 16}}\nfunctions:\n  \
         mass: {{basis: polynomial, degree: 1, start: 2.0, min: 0.1}}\n  damping: {{basis: constant, \
         start: 1.0}}\n  stiffness: {{fixed: 1.0}}\nfit: {{method: {method}, \
         stop: {{iterations: 5}}}}\n"
    );
    let text = match method {
        "lbfgs" | "steepest-descent" => text.replace(", min: 0.1", ""),
        _ => text,
    };
    let file = ModelFile::parse(folder.join("models/m.yaml"), text).expect("a model");
    let heading = Heading {
        // Making files durable takes most of the time.
        checkpoint: Some(1e9),
        ..Heading::new("fit", vec!["m.yaml".into()])
    };
    (heading, build(&file, BuildMode::Fit).expect("a problem"))
}

/// Fits a model with a journal.
fn fitted(model: &Model, journal: &mut FitJournal) -> Fit {
    let start = model.problem.start();
    let mut observe = |_: &_| {};
    let mut watch = Observer::new(&mut observe).with_checkpoints(journal);
    let found = fit_with_noise_watched(&model.problem, &start, &model.settings, &mut watch);
    found.expect("a motion").1
}

/// Writes the finished run.
fn finish(workshop: &Workshop) {
    let (heading, model) = &workshop.fits[0];
    let mut journal = FitJournal::begin(&workshop.path("fit"), heading).expect("room");
    let fit = fitted(model, &mut journal);
    let run_assessment = RunAssessment::of(model, &fit);
    let finished = FittedModel {
        model,
        fit: &fit,
        predictions: &[],
        weights: None,
        run_assessment: &run_assessment,
        requested: heading.requested,
        display: DisplayUnits::default(),
        computed: Default::default(),
    };
    let folder = OutputFolder::prepare(&workshop.path("run"), fit_claim(model)).expect("a folder");
    let stage = folder.stage().expect("room");
    let document = finished.document();
    finished.write(&stage, &document).expect("a run is written");
    stage.write(RESULT, json(&document)).expect("room");
    stage.commit().expect("a run");
}

/// Inputs generated by the program, for files whose contents depend on the build.
pub fn made(target: &str) -> Vec<Vec<u8>> {
    let workshop = workshop();
    match target {
        "run" => [
            "result.json",
            "functions.csv",
            "history.csv",
            "trajectory.csv",
        ]
        .map(|name| fs::read(workshop.path("run").join(name)).expect("a run"))
        .into(),
        "fit_journal" => (METHODS.iter().zip(&workshop.fits))
            .map(|(method, (heading, model))| {
                let folder = workshop.path("fit");
                let heading = Heading {
                    checkpoint: Some(0.0),
                    ..heading.clone()
                };
                let mut journal = FitJournal::begin(&folder, &heading).expect("room");
                fitted(model, &mut journal);
                let read = |name| fs::read_to_string(folder.join(name)).expect("a journal");
                // Without headings and checksums, which belong to this build.
                let json = |text: &str| -> String {
                    let lines = text.lines().skip(1);
                    let json = lines.filter_map(|line| line.rsplit_once('\t'));
                    json.map(|(json, _)| format!("{json}\n")).collect()
                };
                let (rows, standing) = (json(&read(FIT_JOURNAL)), json(&read(CHECKPOINT)));
                format!("{method}\n{rows}{SEPARATOR}{standing}").into_bytes()
            })
            .collect(),
        _ => Vec::new(),
    }
}

/// Separator of journal and checkpoint.
const SEPARATOR: &str = "---\n";

/// Checks that a message is printable text and begins with its location.
fn told(error: &InputError) -> Verdict {
    let text = error.to_string();
    assert!(!text.is_empty());
    let is_odd = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    assert!(!text.contains(is_odd), "{text:?}");
    let kind = kind(&error.problem) + &kind(error.hint.as_deref().unwrap_or_default());
    let mut kinds = KINDS.lock().unwrap_or_else(PoisonError::into_inner);
    kinds.insert(kind);
    Verdict::Refused
}

/// A message without numbers and quotations.
fn kind(text: &str) -> String {
    let unquoted = text.split('`').step_by(2);
    let words: String = unquoted.collect();
    words.chars().filter(|c| !c.is_ascii_digit()).collect()
}

/// A YAML text with aliases after a valid model: read again with an override, and searched for its data files, as the commands
/// do.
pub fn yaml(bytes: &[u8]) -> Verdict {
    let place = workshop().path("models/m.yaml");
    let text = String::from_utf8_lossy(bytes);
    let file = match ModelFile::parse(&place, text) {
        Ok(file) => file,
        Err(error) => return told(&error),
    };
    file.data_files();
    let change = Override::parse("title=x").expect("an override");
    match file.with_overrides(&[change]) {
        Err(error) => told(&error),
        Ok(file) => {
            file.data_files();
            told(&file.error_at("experiments[0].initial.velocity", "a mistake"));
            Verdict::Accepted
        }
    }
}

/// `KEY=VALUE` applied to a model.
pub fn overrides(bytes: &[u8]) -> Verdict {
    let text = String::from_utf8_lossy(bytes);
    let place = workshop().path("models/m.yaml");
    let model = "format: 1\nexperiments:\n  - {data: ../data/paper.csv, initial: {displacement: 3.3, velocity: \
                 1.0}}\ngrid: {nodes: 16}\nfunctions: {mass: {basis: nodal, start: 2}, damping: {fixed: 0}, \
                 stiffness: {fixed: 1}}\n";
    let file = ModelFile::parse(&place, model).expect("a model");
    let change = match Override::parse(&text) {
        Ok(change) => change,
        Err(error) => return told(&error),
    };
    match file.with_overrides(&[change]) {
        Err(error) => told(&error),
        Ok(file) => {
            file.data_files();
            Verdict::Accepted
        }
    }
}

/// A sequence of models.
pub fn sequence(bytes: &[u8]) -> Verdict {
    let path = workshop().path("models/sequence.yaml");
    fs::write(&path, bytes).expect("room");
    match Sequence::read(&path) {
        Err(error) => told(&error),
        Ok(_) => Verdict::Accepted,
    }
}

/// A model file: parsed, built in every mode, and evaluated once.
pub fn model(bytes: &[u8]) -> Verdict {
    let place = workshop().path("models/m.yaml");
    let text = String::from_utf8_lossy(bytes);
    let mut file = match ModelFile::parse(&place, text) {
        Ok(file) => file,
        Err(error) => return told(&error),
    };
    file.data_files();
    if let Some(grid) = &mut file.spec.grid
        && let Some(Nodes::Count(count)) = &mut grid.nodes
        && (MANY_NODES..TOO_MANY_NODES).contains(&count.0)
    {
        *count = Count(MANY_NODES);
    }
    let purposes = [
        BuildMode::Fit,
        BuildMode::Check { nodes: None },
        BuildMode::Simulate { nodes: Some(21) },
    ];
    let mut verdict = Verdict::Accepted;
    for purpose in purposes {
        match build(&file, purpose) {
            Err(error) => verdict = told(&error),
            Ok(model) => {
                let start = model.problem.start();
                assert!(start.iter().all(|x| x.is_finite()));
                if let Ok(evaluation) = model.problem.evaluate(&start) {
                    assert!(evaluation.cost.is_finite());
                }
            }
        }
    }
    verdict
}

/// A table in any format.
pub fn table(bytes: &[u8]) -> Verdict {
    let any = TableFormat::default();
    let formats = [
        TableFormat {
            delimiter: Some(' '),
            units_row: Some(true),
            ..any
        },
        TableFormat {
            decimal: Some(','),
            skip: Some(2),
            ..any
        },
        TableFormat {
            header: Some(false),
            units_row: Some(true),
            ..any
        },
        TableFormat {
            header: Some(true),
            ..any
        },
    ];
    let mut verdict = Verdict::Accepted;
    for format in [any, formats[bytes.len() % formats.len()]] {
        match Table::parse_with("t.csv", bytes, &format) {
            Err(error) => verdict = told(&error),
            Ok(table) => columns(&table),
        }
    }
    verdict
}

fn columns(table: &Table) {
    assert!(table.rows() > 0 && table.rows() == table.lines().len());
    assert!(table.lines().is_sorted());
    for index in 0..table.width().min(20) {
        if let Some(number) = table.number(index) {
            assert_eq!(table.find(&ColumnName::Number(number)), Ok(index));
        }
        table.unit(index);
        let _ = table.check_stated_unit(index);
        if let Ok(samples) = table.samples(index) {
            assert_eq!(samples.len(), table.rows());
        }
    }
    for name in table.headers().iter().take(20) {
        if let Err(error) = times::equally_spaced(table, name) {
            told(&error);
        }
    }
}

/// A binary file of a data logger: its channels, and the tables made of them.
pub fn channels(bytes: &[u8]) -> Verdict {
    let any = recognise(Path::new("t"), bytes).ok().flatten();
    // Version 4 of MATLAB is recognised by the ending of the name.
    let path = Path::new(if any.is_some() { "t" } else { "t.mat" });
    let format = match recognise(path, bytes) {
        Err(error) => return told(&error),
        Ok(None) => return Verdict::Refused,
        Ok(Some(format)) => format,
    };
    match formats::read(path, bytes, format) {
        Err(error) => return told(&error),
        Ok(found) => {
            let names: BTreeSet<&str> = found.channels.iter().map(|c| &*c.name).collect();
            assert_eq!(names.len(), found.channels.len(), "names are unique");
            for channel in &found.channels {
                assert!(!channel.values.is_empty());
                if let Some(sampling) = channel.sampling {
                    assert!(sampling.time(1) >= sampling.time(0));
                }
            }
        }
    }
    match Table::parse(path, bytes) {
        Err(error) => told(&error),
        Ok(table) => {
            columns(&table);
            Verdict::Accepted
        }
    }
}

/// A file of a finished run in place of the original; its beginning determines which one it replaces.
pub fn run(bytes: &[u8]) -> Verdict {
    let folder = workshop().path("run");
    let head = &bytes[..bytes.len().min(64)];
    let has = |word: &str| head.windows(word.len()).any(|w| w == word.as_bytes());
    let name = match () {
        () if has("{") => "result.json",
        () if has("iter") => "history.csv",
        () if has("mass") => "functions.csv",
        () => "trajectory.csv",
    };
    let path = folder.join(name);
    let right = fs::read(&path).expect("a run");
    fs::write(&path, bytes).expect("room");
    let opened = Run::open(&folder);
    fs::write(&path, right).expect("room");
    match opened {
        Err(error) => told(&error),
        Ok(run) => {
            let state = State {
                displacement: 1.0,
                velocity: 0.0,
            };
            let _ = predict(&run.system, &run.coefficients, run.truth.as_ref(), &[state]);
            run.band("mass");
            Verdict::Accepted
        }
    }
}

/// Unfinished work of a killed fit: the name of a method, the lines of its journal after the heading, and that of its checkpoint,
/// all without checksums. The fit continues from it and ends with a status.
pub fn fit_journal(bytes: &[u8]) -> Verdict {
    let folder = workshop().path("fit");
    let text = bytes.to_vec();
    let method = METHODS.iter().position(|m| text.starts_with(m.as_bytes()));
    let body: Vec<u8> = match text.iter().position(|b| *b == b'\n') {
        Some(end) => text[end + 1..].to_vec(),
        None => text,
    };
    let mark = SEPARATOR.as_bytes();
    let cut = body.windows(mark.len()).position(|w| w == mark);
    let (rows, standing) = match cut {
        Some(at) => (&body[..at], &body[at + mark.len()..]),
        None => (&body[..], &[][..]),
    };
    let (heading, model) = &workshop().fits[method.unwrap_or(0)];
    for (name, lines) in [(FIT_JOURNAL, rows), (CHECKPOINT, standing)] {
        let text = with_checksums(heading, lines).expect("a heading");
        fs::write(folder.join(name), text).expect("room");
    }
    match FitJournal::resume(&folder, heading) {
        Err(error) => told(&error),
        Ok(mut journal) => {
            let found = fitted(model, &mut journal);
            assert!(found.best.evaluation.cost.is_finite());
            assert!(found.best.evaluation.nodal.mass.iter().all(|m| *m > 0.0));
            Verdict::Accepted
        }
    }
}

/// Lines of the journal of a study after the heading: the recalled analyses are printed and drawn.
pub fn study_journal(bytes: &[u8]) -> Verdict {
    let folder = workshop().path("study");
    let heading = Heading::new("study", vec!["m.yaml".into()]);
    let text = with_checksums(&heading, bytes).expect("a heading");
    fs::write(folder.join(STUDY_JOURNAL), text).expect("room");
    let mut journal = match AnalysisJournal::resume(&folder, STUDY_JOURNAL, &heading) {
        Ok(journal) => journal,
        Err(error) => return told(&error),
    };
    let mut document = StudyDocument {
        fit: kept::<Result<_, String>>(&mut journal, "fit").and_then(Result::ok),
        sensitivity: kept(&mut journal, "sensitivity"),
        bands: kept(&mut journal, "bands"),
        candidates: kept(&mut journal, "candidates").unwrap_or_default(),
        equivalent_systems: kept(&mut journal, "equivalent systems").unwrap_or_default(),
        multistart: kept(&mut journal, "starts"),
        ..StudyDocument::default()
    };
    let profile = kept::<Result<_, String>>(&mut journal, "profile 0");
    document.profiles.extend(profile.and_then(Result::ok));
    if let Some(Ok(constancy_test)) = kept::<Result<_, String>>(&mut journal, "constancy test") {
        document.constancy_test = constancy_test;
    }
    if let Some(Ok(refits)) = kept::<Result<_, String>>(&mut journal, "bootstrap") {
        document.bootstrap = refits;
    }
    if let Some((extremes, predictions)) = kept(&mut journal, "extremes") {
        document.extremes = extremes;
        document.predictions = predictions;
    }
    document.text();
    if PIECES.iter().any(|name| journal.has(name)) {
        let claim = StudyDocument::claim().journals(&[STUDY_JOURNAL]);
        let out = OutputFolder::prepare(&folder, claim).expect("a folder");
        document.write(&out, &workshop().fits[0].1).expect("room");
    }
    Verdict::Accepted
}

/// Names of the analyses.
const PIECES: [&str; 10] = [
    "fit",
    "spectrum",
    "bands",
    "candidates",
    "equivalents",
    "starts",
    "profile 0",
    "constancy test",
    "bootstrap",
    "extremes",
];

fn kept<T: Serialize + DeserializeOwned>(journal: &mut AnalysisJournal, name: &str) -> Option<T> {
    let none = || -> Option<T> { None };
    let has = journal.has(name);
    match has {
        true => journal
            .analysis(name, none, || false)
            .ok()
            .flatten()
            .flatten(),
        false => None,
    }
}
