//! `kmcfit fleet`: fits one model to many records.

use super::progress::{Activity, show_jobs};
use super::{CommandError, NOT_CONVERGED, OK, Overrides, interrupt, print, say};
use crate::fleet::{FleetFolder, RecordList, Trend, check_model, finish, run as fit_records};
use std::path::PathBuf;

/// Fit one model to many records: one row of results for each, in a file that grows as the fits end.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  kmcfit fleet model.yaml \"records/*.csv\" --out fleets/bridge\n  kmcfit fleet model.yaml records.csv --out fleets/bridge --trend temperature\n\nThe same command again goes on after the rows that are written; records with errors are fitted again."
)]
pub struct Arguments {
    /// Model file (YAML) with one experiment, whose data each record replaces.
    model: PathBuf,
    /// Files, patterns in quotes, or a table with a column `file`.
    #[arg(required = true)]
    records: Vec<String>,
    /// Folder of the fleet.
    #[arg(long)]
    out: PathBuf,
    #[command(flatten)]
    set: Overrides,
    /// Number of threads; results do not depend on it [default: one per core].
    #[arg(long, value_name = "NUMBER")]
    threads: Option<usize>,
    /// Column of the table over which the page shows the estimates [default: their order].
    #[arg(long, value_name = "COLUMN")]
    trend: Option<String>,
}

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    let threads = super::study::threads(arguments.threads)?;
    let reading = Activity::begin("reading the list of records");
    let model = check_model(arguments.set.read(&arguments.model)?)?;
    let list = RecordList::read(&arguments.records)?;
    // Keys that the model does not have are errors of the table, which has a record.
    model.clone().with_overrides(&list.records[0].overrides)?;
    let trend = Trend::of(&list, arguments.trend.as_deref())?;
    let mut folder = FleetFolder::open(&arguments.out, &model)?;
    (list.records.iter()).try_for_each(|record| folder.check_record(record))?;
    drop(reading);
    let all = list.records.len();
    let activity = Activity::begin(format!("fitting {all} records"));
    let is_done = fit_records(
        &mut folder,
        &model,
        &list,
        threads,
        &interrupt::flag(),
        &show_jobs,
    )?;
    drop(activity);
    if !is_done {
        say(
            "note",
            format!(
                "interrupted; the same command goes on after the rows in {}",
                folder.path.display()
            ),
        );
        return Ok(interrupt::exit_code());
    }
    print(&finish(&folder, &list, &trend)?);
    let mut rows = list.records.iter().filter_map(|r| folder.row(&r.name));
    match rows.any(|row| row.error.is_none()) {
        true => Ok(OK),
        false => Ok(NOT_CONVERGED),
    }
}
