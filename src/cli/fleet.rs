//! `kmcfit fleet`: fits one model to many records.

use super::progress::{Activity, show_jobs};
use super::{CommandError, OK, Overrides, interrupt, print, say, unwritable};
use crate::config::{ModelFile, Override};
use crate::error::InputError;
use crate::fleet::{
    FleetFolder, FleetModel, RecordList, RowIndex, RunOptions, Shard, Trend, collect, fleet_page,
    fleet_summary, page_folder, run as run_shard,
};
use crate::results::{Heading, RESULT, RequestedFiles, write_whole};
use crate::spelling::nearest;
use crate::text_io::{one_of, quote, read_text};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Fit one model to many records: one row of results for each, in files that grow as the fits end.
#[derive(Debug, clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:\n  kmcfit fleet model.yaml \"records/*.csv\" --out fleets/bridge\n  kmcfit fleet model.yaml records.csv --out fleets/bridge --shard 2/10\n  kmcfit fleet collect fleets/bridge\n\nThe same command again continues after the rows that are written."
)]
pub struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    /// Model file (YAML) with one experiment, whose data each record replaces.
    #[arg(required = true)]
    model: Option<PathBuf>,
    /// Files, patterns in quotes, or a table with a column `file`.
    #[arg(required = true)]
    records: Vec<String>,
    /// Folder of the fleet.
    #[arg(long, required = true)]
    out: Option<PathBuf>,
    #[command(flatten)]
    set: Overrides,
    /// Fit shard I of N, as 2/10; `kmcfit fleet collect` joins the shards.
    #[arg(long, value_name = "I/N")]
    shard: Option<String>,
    /// Number of threads; results do not depend on it [default: one per core].
    #[arg(long, value_name = "NUMBER")]
    threads: Option<usize>,
    /// Longest time of a record; its row then has an error.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    time_limit: Option<f64>,
    /// Fit the records again whose rows have errors, as after a file was repaired or with another time limit.
    #[arg(long)]
    retry_errors: bool,
    /// Start each fit from the estimates of the record before, of the same `system` where the table has that column.
    #[arg(long)]
    warm_start: bool,
    /// Column of the table over which the page shows the estimates [default: `date`, else the first one of numbers].
    #[arg(long, value_name = "COLUMN")]
    trend: Option<String>,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Join the shards of a fleet: tables, statistics and page.
    Collect(Collect),
    /// Fit one record of a fleet again and write its page.
    Page(Page),
}

#[derive(Debug, clap::Args)]
struct Collect {
    /// Folder of the fleet.
    folder: PathBuf,
    /// Column of the table over which the page shows the estimates [default: `date`, else the first one of numbers].
    #[arg(long, value_name = "COLUMN")]
    trend: Option<String>,
}

#[derive(Debug, clap::Args)]
struct Page {
    /// Folder of the fleet.
    folder: PathBuf,
    /// The record, as its row names it.
    record: String,
}

/// Longest time limit, s.
const LONGEST: f64 = 1e9;
/// Most threads.
const MOST_THREADS: usize = 256;
/// Longest result document of a record, bytes.
const LONGEST_RESULT: u64 = 1 << 30;

pub fn run(arguments: &Arguments) -> Result<u8, CommandError> {
    match (&arguments.command, &arguments.model, &arguments.out) {
        (Some(Command::Collect(arguments)), ..) => {
            let folder = FleetFolder::open(&arguments.folder)?;
            let list = folder.records()?;
            let trend = arguments.trend.as_deref();
            let trend = trend.or(folder.identity.trend.as_deref());
            let trend = trend_of(trend, &list)?;
            collected(&folder, list, &trend)?;
            Ok(OK)
        }
        (Some(Command::Page(arguments)), ..) => page(arguments),
        (None, Some(model), Some(out)) => fit(arguments, model, out),
        // The parser requires both.
        (None, ..) => Err(InputError::argument("MODEL", "no model").into()),
    }
}

fn fit(arguments: &Arguments, model: &Path, out: &Path) -> Result<u8, CommandError> {
    let shard: Shard = match &arguments.shard {
        Some(text) => text.parse()?,
        None => Shard::ALL,
    };
    let threads = match arguments.threads {
        Some(threads) if !(1..=MOST_THREADS).contains(&threads) => {
            return Err(
                InputError::argument("--threads", "invalid number of threads")
                    .found(threads)
                    .expected(format!("1 to {MOST_THREADS}"))
                    .into(),
            );
        }
        Some(threads) => threads,
        None => std::thread::available_parallelism().map_or(1, usize::from),
    };
    let seconds = arguments.time_limit;
    if let Some(seconds) = seconds.filter(|s| !(*s > 0.0 && *s <= LONGEST)) {
        return Err(InputError::argument("--time-limit", "invalid time")
            .found(seconds)
            .expected("seconds, greater than 0")
            .into());
    }
    let reading = Activity::begin("reading the list of records");
    let model = FleetModel::new(arguments.set.read(model)?)?;
    let list = RecordList::read(&arguments.records)?;
    trend_of(arguments.trend.as_deref(), &list)?;
    let folder = FleetFolder::prepare(out, &model, &list, arguments.warm_start)?;
    let folder = folder.with_trend(arguments.trend.as_deref())?;
    let trend = trend_of(folder.identity.trend.as_deref(), &list)?;
    drop(reading);
    if !list.uses.is_empty() {
        say("note", format!("columns: {}", list.uses.join("; ")));
    }
    let options = RunOptions {
        shard,
        threads,
        time: seconds.map(Duration::from_secs_f64),
        warm_start: arguments.warm_start,
        retry_errors: arguments.retry_errors,
        interrupt: interrupt::flag(),
    };
    let activity = Activity::begin(format!("fitting {} records", list.records.len()));
    let done = run_shard(&folder, &model, &list, &options, &show_jobs)?;
    drop(activity);
    if done.before > 0 {
        say(
            "note",
            format!(
                "{} of {} records had their row before",
                done.before, done.all
            ),
        );
    }
    if !done.is_complete() {
        let rows = done.before + done.written;
        say(
            "note",
            format!(
                "{rows} of {} records have their row; the same command continues after them",
                done.all
            ),
        );
        return Ok(interrupt::exit_code());
    }
    match shard == Shard::ALL {
        true => collected(&folder, list, &trend)?,
        false => print(&format!(
            "{} records of shard {}/{} have their row; `kmcfit fleet collect {}` joins the shards\n",
            done.all,
            shard.number,
            shard.of,
            out.display()
        )),
    }
    Ok(OK)
}

/// The column `name`, or without a name the one that suits best.
fn trend_of(name: Option<&str>, list: &RecordList) -> Result<Trend, InputError> {
    if let Some(trend) = Trend::of(list, name) {
        return Ok(trend);
    }
    let name = name.unwrap_or_default();
    let known = list.columns.iter().map(String::as_str);
    if known.clone().any(|column| column == name) {
        return Err(InputError::argument("--trend", "the column holds neither numbers nor dates")
            .found(quote(name))
            .expected("a column of which at least half of the cells are numbers, or dates such as 2026-03-02"));
    }
    let expected = match list.columns.is_empty() {
        true => "a table of records with further columns".to_owned(),
        false => one_of(known.clone()),
    };
    Err(InputError::argument("--trend", "no such column")
        .found(quote(name))
        .expected(expected)
        .hint_if(nearest(name, known).map(|near| format!("did you mean `{near}`?"))))
}

/// Joins the shards, writes the page and prints the summary.
fn collected(folder: &FleetFolder, list: RecordList, trend: &Trend) -> Result<(), CommandError> {
    let activity = Activity::begin("collecting the rows");
    let found = collect(folder, list, trend)?;
    let text = fleet_page(folder, &found, trend);
    let path = folder.path.join("fleet.html");
    write_whole(&path, &text).map_err(|error| unwritable(&folder.path, &error))?;
    drop(activity);
    print(&fleet_summary(folder, &found, trend));
    Ok(())
}

/// Fits one record of a fleet into a folder of its own within that of the fleet.
fn page(arguments: &Page) -> Result<u8, CommandError> {
    let folder = FleetFolder::open(&arguments.folder)?;
    let list = folder.records()?;
    let Some(index) = position_of(&list, &arguments.record) else {
        let names = list.records.iter().map(|record| record.name.as_str());
        return Err(
            InputError::argument("RECORD", "no such record in this fleet")
                .found(quote(&arguments.record))
                .expected("a record as its row names it")
                .hint_if(
                    nearest(&arguments.record, names).map(|near| format!("did you mean `{near}`?")),
                )
                .into(),
        );
    };
    let record = &list.records[index];
    if record.is_in_memory() {
        return Err(
            InputError::argument("RECORD", "the record was in memory, not in a file")
                .found(quote(&record.name))
                .expected("a record of a file")
                .into(),
        );
    }
    let own = Override::parse_all(&folder.identity.overrides)?;
    let model = ModelFile::read_with_overrides(&folder.identity.model, &own)?;
    folder.check_model(model.effective_text())?;
    let data = format!("experiments.0.data={}", quoted_scalar(&record.path));
    let mut overrides = folder.identity.overrides.clone();
    overrides.extend(record.overrides.iter().map(Override::to_string));
    overrides.push(data);
    if !record.name.contains(char::is_control) {
        overrides.push(format!("title={}", quoted_scalar(Path::new(&record.name))));
    }
    let overrides = Override::parse_all(&overrides)?;
    let file = ModelFile::read_with_overrides(&folder.identity.model, &overrides)?;
    let heading = Heading::of_model("fit", &file, RequestedFiles::figures(), None);
    let out = folder.path.join(page_folder(index));
    let code = super::fit::fit_record_page(&file, &heading, &out)?;
    if !agrees_with_row(&folder, &record.name, &out)? {
        say(
            "warning",
            "the results differ from the row of the record: its file has changed since, or the row has an error".to_owned(),
        );
    }
    Ok(code)
}

/// The record of this name, or the only one whose path ends with it.
fn position_of(list: &RecordList, name: &str) -> Option<usize> {
    let records = list.records.iter().enumerate();
    let exact = records.clone().find(|(_, record)| record.name == name);
    let mut near = records.filter(|(_, record)| Path::new(&record.name).ends_with(name));
    let only = near.next().filter(|_| near.next().is_none());
    exact.or(only).map(|(index, _)| index)
}

/// True if the estimates of a page are those of the row of the record, or there is no row.
fn agrees_with_row(folder: &FleetFolder, name: &str, page: &Path) -> Result<bool, InputError> {
    let Some(line) = RowIndex::read(&folder.path)?.line(name)? else {
        return Ok(true);
    };
    let estimates = |text: &str| {
        let document: Option<serde_json::Value> = serde_json::from_str(text).ok();
        document.map(|document| document["estimates"].clone())
    };
    let result = read_text(&page.join(RESULT), "the result of a fit", LONGEST_RESULT)?;
    Ok(estimates(&line) == estimates(&result))
}

/// A path as a scalar of YAML in single quotes.
fn quoted_scalar(path: &Path) -> String {
    format!("'{}'", path.display().to_string().replace('\'', "''"))
}
