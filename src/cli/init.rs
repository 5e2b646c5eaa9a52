//! `kmcfit init`: writes a model file for records.

use super::progress::Activity;
use super::{CommandError, OK, print, schema, unwritable};
use crate::config::{ModelFile, Question, Source, Statements, questions, scaffold};
use crate::error::InputError;
use crate::escape::harmless;
use crate::report::shell_quoted;
use crate::results::write_together;
use crate::tables::SAMPLE_RATES;
use kmcfit_core::internals::functions::CoefficientKind;
use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Component, Path, PathBuf};

/// Schema file named by the comment in the first line of a model file.
const SCHEMA: &str = "kmcfit.schema.json";

/// Stage shown while the records are read.
const READING: &str = "reading the records";

/// Write a commented model file for records: columns, units, grid and bases are taken from them. On a terminal it asks for what no file
/// states.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  kmcfit init record.csv --sample-rate 250\n  kmcfit init hit_1.csv hit_2.csv --mass 4.5 --units time=ms,displacement=mm\n  kmcfit init record.wav --units \"50 g,200 N\""
)]
pub struct Arguments {
    /// Records (CSV or another text table, NumPy, MATLAB, HDF5, TDMS, WAV, UFF), one experiment each.
    #[arg(required = true)]
    data: Vec<PathBuf>,
    /// Model file [default: beside the first record, with its name].
    #[arg(long, value_name = "MODEL")]
    out: Option<PathBuf>,
    /// Sampling rate, Hz, if the file has no column of times.
    #[arg(long, value_name = "HZ")]
    sample_rate: Option<f64>,
    /// Units by quantity or column, as in `time=ms,displacement=mm` or `ch1=50 g`; or by channel of a file without names, as in
    /// `50 g,200 N`, with `-` for a channel that is not used.
    #[arg(long, value_name = "UNITS")]
    units: Vec<String>,
    /// Column of the force, by name or number.
    #[arg(long, value_name = "COLUMN")]
    force: Option<String>,
    /// Column of the motion of the base, by name or number.
    #[arg(long, value_name = "COLUMN")]
    base: Option<String>,
    /// Known mass, kg.
    #[arg(long, value_name = "KG", allow_negative_numbers = true)]
    mass: Option<String>,
    /// Known coefficient, as in `stiffness=821.96`, in its SI unit.
    #[arg(long, value_name = "NAME=VALUE")]
    fix: Vec<String>,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let mut statements = statements(arguments)?;
    let out = match (&arguments.out, arguments.data.first()) {
        (Some(out), _) => out.clone(),
        (None, Some(first)) => first.with_extension("yaml"),
        (None, None) => PathBuf::new(),
    };
    let folder = out.parent().unwrap_or(Path::new(""));
    let sources = sources(folder, &arguments.data)?;
    if out.symlink_metadata().is_ok() {
        return Err(InputError::file(&out, "the file exists already")
            .expected("another name: --out MODEL")
            .into());
    }
    if std::io::stdin().is_terminal() && std::io::stderr().is_terminal() {
        let reading = Activity::begin(READING);
        let questions = questions(&sources, &statements)?;
        drop(reading);
        ask_all(
            &questions,
            &mut statements,
            &mut std::io::stdin().lock(),
            &mut std::io::stderr(),
        )
        .map_err(|error| CommandError::Numerical(format!("standard input: {error}")))?;
    }
    let reading = Activity::begin(READING);
    let scaffold = scaffold(&sources, &statements)?;
    drop(reading);
    // The written model must be readable.
    ModelFile::parse(&out, scaffold.text.as_str())?;
    let schema = folder.join(SCHEMA);
    let is_new = schema.symlink_metadata().is_err();
    let schema_text = schema::text();
    let mut files = vec![(out.as_path(), scaffold.text.as_str())];
    if is_new {
        // The model is written last: without it the command can be repeated.
        files.insert(0, (&schema, &schema_text));
    }
    write_together(&files).map_err(|error| unwritable(&out, &error))?;
    let mut text = String::new();
    for (file, sentences) in arguments.data.iter().zip(&scaffold.found) {
        text += &format!("{}\n", file.display());
        for sentence in sentences {
            text += &format!("  {sentence}\n");
        }
    }
    if scaffold.has_unknown_mass {
        text += "  the mass is unknown: the results are ratios to it; `--mass KG` states it\n";
    }
    if is_new {
        text += &format!("  schema for editors: {}\n", schema.display());
    }
    let place = out.display();
    let argument = shell_quoted(&place.to_string());
    print(&format!(
        "{text}Model {place}; review it, then run\n  kmcfit check {argument}\n  kmcfit fit {argument}\n"
    ));
    Ok(OK)
}

/// The statements of the options.
fn statements(arguments: &Arguments) -> Result<Statements, InputError> {
    let rate = arguments.sample_rate;
    if let Some(rate) = rate.filter(|rate| !SAMPLE_RATES.contains(rate)) {
        return Err(
            InputError::argument("--sample-rate", "invalid sampling rate")
                .found(format!("{rate:?}"))
                .expected(format!(
                    "samples per second, a number from {:e} to {:e}",
                    SAMPLE_RATES.start(),
                    SAMPLE_RATES.end()
                )),
        );
    }
    let mut statements = Statements::default();
    statements.sample_rate = rate;
    statements.force.clone_from(&arguments.force);
    statements.base.clone_from(&arguments.base);
    for units in &arguments.units {
        statements.state_units(units)?;
    }
    if let Some(mass) = &arguments.mass {
        statements.know("--mass", CoefficientKind::Mass, mass)?;
    }
    for text in &arguments.fix {
        statements.fix("--fix", text)?;
    }
    Ok(statements)
}

/// The files with their names in a model file in `folder`.
fn sources(folder: &Path, files: &[PathBuf]) -> Result<Vec<Source>, InputError> {
    let source = |(i, file): (usize, &PathBuf)| {
        if file.is_dir() {
            return Err(InputError::file(file, "this is a folder").expected(
                "a record: a text table, or a file of NumPy, MATLAB, HDF5, TDMS, WAV or UFF",
            ));
        }
        if files.iter().take(i).any(|earlier| earlier == file) {
            return Err(InputError::file(file, "the file is given twice")
                .expected("each record once, as one experiment"));
        }
        Ok(Source {
            path: file.clone(),
            name: named_from(folder, file),
        })
    };
    files.iter().enumerate().map(source).collect()
}

/// Asks for the units that are assumed and for the scale, and states the answers.
fn ask_all(
    questions: &[Question],
    statements: &mut Statements,
    answers: &mut impl BufRead,
    terminal: &mut impl Write,
) -> io::Result<()> {
    for question in questions {
        let (text, default) = match question {
            Question::Unit {
                file,
                column,
                role,
                assumed,
            } => (
                format!(
                    "{}: unit of the {} in column `{column}`",
                    file.display(),
                    role.key().replace('_', " ")
                ),
                *assumed,
            ),
            Question::Scale => (
                "Mass in kg, or a known stiffness or damping as in stiffness=821.96".to_owned(),
                "unknown",
            ),
        };
        ask(&text, default, answers, terminal, |answer| match question {
            Question::Unit { column, role, .. } => {
                statements.state_unit(column, role.kind(), answer)
            }
            Question::Scale if answer == "unknown" => Ok(()),
            Question::Scale if answer.contains('=') => statements.fix("answer", answer),
            Question::Scale => statements.know("answer", CoefficientKind::Mass, answer),
        })?;
    }
    Ok(())
}

/// Asks until an answer is taken; an empty line and the end of the input leave the default.
fn ask(
    question: &str,
    default: &str,
    answers: &mut impl BufRead,
    terminal: &mut impl Write,
    mut take: impl FnMut(&str) -> Result<(), InputError>,
) -> io::Result<()> {
    loop {
        write!(terminal, "{} [{default}]: ", harmless(question))?;
        terminal.flush()?;
        let mut line = String::new();
        let length = answers.read_line(&mut line)?;
        let answer = line.trim();
        if length == 0 || answer.is_empty() {
            return Ok(());
        }
        match take(answer) {
            Ok(()) => return Ok(()),
            Err(error) => writeln!(terminal, "{}", harmless(&error.to_string()))?,
        }
    }
}

/// The path of a file relative to a folder; as given if there is none.
fn named_from(folder: &Path, file: &Path) -> String {
    let folder = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    let (Ok(folder), Ok(target)) = (folder.canonicalize(), file.canonicalize()) else {
        return file.display().to_string();
    };
    let shared = (folder.components().zip(target.components()))
        .take_while(|(a, b)| a == b)
        .count();
    let is_prefix = |c: &Component| matches!(c, Component::Prefix(_) | Component::RootDir);
    let up = folder.components().skip(shared);
    if shared == 0 || target.components().skip(shared).any(|c| is_prefix(&c)) {
        return target.display().to_string();
    }
    let path: PathBuf = (up.map(|_| Component::ParentDir))
        .chain(target.components().skip(shared))
        .collect();
    path.to_string_lossy().replace('\\', "/")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Role;

    fn asked(questions: &[Question], answers: &str) -> (Statements, String) {
        let mut statements = Statements::default();
        let mut terminal = Vec::new();
        ask_all(
            questions,
            &mut statements,
            &mut answers.as_bytes(),
            &mut terminal,
        )
        .expect("text in memory");
        (statements, String::from_utf8(terminal).expect("UTF-8"))
    }

    fn unit() -> Question {
        Question::Unit {
            file: "a.csv".into(),
            column: "y".into(),
            role: Role::Displacement,
            assumed: "m",
        }
    }

    #[test]
    fn questions_show_their_default_and_are_repeated_until_an_answer_is_taken() {
        let (statements, shown) = asked(&[unit(), Question::Scale], "kN\nmm\n-4\n4.5\n");
        assert_eq!(statements.known(CoefficientKind::Mass), Some(4.5));
        let mut stated = Statements::default();
        stated
            .state_unit("y", crate::units::Quantity::Displacement, "mm")
            .expect("a unit");
        stated
            .know("", CoefficientKind::Mass, "4.5")
            .expect("a mass");
        assert_eq!(statements, stated);
        assert_eq!(
            shown,
            "a.csv: unit of the displacement in column `y` [m]: unit of the displacement: unknown unit\n  \
            found: `kN`\n  expected: one of: m, mm, cm, µm, in, ft, rad, mrad, deg, V\n  hint: this is a unit of force\n\
            a.csv: unit of the displacement in column `y` [m]: \
            Mass in kg, or a known stiffness or damping as in stiffness=821.96 [unknown]: answer: invalid mass\n  \
            found: `-4`\n  expected: a number greater than 0, in kg\n\
            Mass in kg, or a known stiffness or damping as in stiffness=821.96 [unknown]: "
        );
    }

    #[test]
    fn an_empty_line_and_the_end_leave_the_default() {
        for answers in ["\n\n", "", "\nunknown\n"] {
            let (statements, _) = asked(&[unit(), Question::Scale], answers);
            assert_eq!(statements, Statements::default(), "{answers:?}");
        }
        let (statements, _) = asked(&[Question::Scale], "stiffness=821.96\n");
        assert_eq!(statements.known(CoefficientKind::Stiffness), Some(821.96));
    }
}
