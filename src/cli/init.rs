//! `kmcfit init`: writes a model file for records.

use super::progress::Activity;
use super::{CommandError, OK, print, schema, unwritable};
use crate::config::{ModelFile, Source, Statements, scaffold};
use crate::error::InputError;
use crate::escape::shell_quoted;
use crate::results::write_together;
use crate::tables::{SAMPLE_RATES, sample_rates};
use std::path::{Component, Path, PathBuf};

/// Schema file named by the comment in the first line of a model file.
const SCHEMA: &str = "kmcfit.schema.json";

/// Write a commented model file for records: columns, units and grid are taken from them, and all coefficients are constants.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  kmcfit init record.csv --sample-rate 250\n  kmcfit init hit_1.csv hit_2.csv --mass 4.5 --units time=ms,displacement=mm\n  kmcfit init record.wav --units \"1=50 g,2=200 N\""
)]
pub struct Arguments {
    /// Records (CSV or another text table, NumPy, MATLAB, HDF5, TDMS, WAV, UFF), one experiment each.
    #[arg(required = true)]
    data: Vec<PathBuf>,
    /// Model file [default: beside the first record, with its name].
    #[arg(long, value_name = "MODEL")]
    out: Option<PathBuf>,
    /// Sampling rate, Hz, if the file has no column of times.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    sample_rate: Option<f64>,
    /// Units by quantity or column, as in `time=ms,displacement=mm` or `ch1=50 g`; of a column without a name by its number, `1=50 g`.
    #[arg(long, value_name = "UNITS")]
    units: Vec<String>,
    /// Column of the times, by name or number.
    #[arg(long, value_name = "COLUMN")]
    time: Option<String>,
    /// Column of a response, with its quantity where neither name nor unit states it, as in `acceleration=ch1`.
    #[arg(long, value_name = "COLUMN")]
    response: Vec<String>,
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
    let statements = statements(arguments)?;
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
    let reading = Activity::begin("reading the records");
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
    for (file, sentences) in &scaffold.found {
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
    let location = out.display();
    let argument = shell_quoted(&location.to_string());
    print(&format!(
        "{text}Model {location}; review it, then run\n  kmcfit check {argument}\n  kmcfit fit {argument}\n"
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
                .expected(sample_rates()),
        );
    }
    let mut statements = Statements::default();
    statements.sample_rate = rate;
    for units in &arguments.units {
        statements.state_units(units)?;
    }
    statements.time.clone_from(&arguments.time);
    statements.responses.clone_from(&arguments.response);
    statements.force.clone_from(&arguments.force);
    statements.base.clone_from(&arguments.base);
    if let Some(text) = &arguments.mass {
        statements.fix("--mass", "mass", text)?;
    }
    for text in &arguments.fix {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        statements.fix("--fix", name, value)?;
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
        Ok(Source::file(file, named_from(folder, file)))
    };
    files.iter().enumerate().map(source).collect()
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
