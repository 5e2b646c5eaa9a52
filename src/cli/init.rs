//! `kmcfit init`: writes a model file for a record.

use super::{CommandError, OK, print, schema, unwritable};
use crate::config::{ModelFile, scaffold};
use crate::error::InputError;
use crate::report::shell_quoted;
use crate::results::write_together;
use crate::tables::SAMPLE_RATES;
use std::path::{Component, Path, PathBuf};

/// Schema file named by the comment in the first line of a model file.
const SCHEMA: &str = "kmcfit.schema.json";

/// Write a commented model file for a record: columns, units, grid, bases and start values are taken from it.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  kmcfit init record.csv --sample-rate 250")]
pub struct Arguments {
    /// Record (CSV or another text table, NumPy, MATLAB, TDMS, WAV, UFF).
    data: PathBuf,
    /// Model file [default: beside the record, with its name].
    #[arg(long, value_name = "MODEL")]
    out: Option<PathBuf>,
    /// Sampling rate, Hz, if the file has no column of times.
    #[arg(long, value_name = "HZ")]
    sample_rate: Option<f64>,
    /// Full scale of each channel of a file without units, as in `"50 g,200 N"`; `-` for a channel that is not used.
    #[arg(long, value_name = "UNITS")]
    units: Option<String>,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let rate = arguments.sample_rate;
    if let Some(rate) = rate.filter(|rate| !SAMPLE_RATES.contains(rate)) {
        return Err(
            InputError::argument("--sample-rate", "invalid sampling rate")
                .found(format!("{rate:?}"))
                .expected(format!(
                    "samples per second, a number from {:e} to {:e}",
                    SAMPLE_RATES.start(),
                    SAMPLE_RATES.end()
                ))
                .into(),
        );
    }
    if arguments.data.is_dir() {
        return Err(InputError::file(&arguments.data, "this is a folder")
            .expected("a record: a text table, or a file of NumPy, MATLAB, TDMS, WAV or UFF")
            .into());
    }
    let out = match &arguments.out {
        Some(out) => out.clone(),
        None => arguments.data.with_extension("yaml"),
    };
    if out.symlink_metadata().is_ok() {
        return Err(InputError::file(&out, "the file exists already")
            .expected("another name: --out MODEL")
            .into());
    }
    let folder = out.parent().unwrap_or(Path::new(""));
    let data = named_from(folder, &arguments.data);
    let scaffold = scaffold(&arguments.data, &data, rate, arguments.units.as_deref())?;
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
    let mut text = format!("{}\n", arguments.data.display());
    for sentence in &scaffold.found {
        text += &format!("  {sentence}\n");
    }
    if is_new {
        text += &format!("  schema for editors: {}\n", schema.display());
    }
    let place = out.display();
    let argument = shell_quoted(&place.to_string());
    print(&format!(
        "{text}Model {place}; review it, then run\n  kmcfit check {argument} --no-gradient\n  \
         kmcfit fit {argument}\n"
    ));
    Ok(OK)
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
