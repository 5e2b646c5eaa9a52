//! The fits of a shard on several threads.

use super::fit::{Limits, fit_record};
use super::folder::FleetFolder;
use super::journal::{Journal, LineName, journals, recorded};
use super::model::FleetModel;
use super::records::{Record, RecordList};
use super::shard::Shard;
use crate::error::InputError;
use kmcfit_core::internals::threads::{share, sharing, spawn_scoped};
use std::collections::HashMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Records of one system that are fitted one after another with `warm_start`. A fixed number, so that the results depend neither on the
/// threads nor on the shards.
const BLOCK: usize = 32;
/// Time between two looks at the time limits and the interrupt.
const POLL: Duration = Duration::from_millis(10);

/// How a shard is fitted.
#[derive(Debug, Clone)]
pub struct RunOptions {
    /// The shard.
    pub shard: Shard,
    /// Number of threads, at least 1.
    pub threads: usize,
    /// Longest time of a record.
    pub time: Option<Duration>,
    /// True to start a fit from the estimates of the record before of the same system.
    pub warm_start: bool,
    /// True to fit the records again whose rows have errors.
    pub retry_errors: bool,
    /// Set where the work is to end after the rows that are complete.
    pub interrupt: Arc<AtomicBool>,
}

/// Receiver of the number of rows that are written, and of all.
pub type Progress<'a> = dyn Fn(usize, usize) + Sync + 'a;

/// What a run did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunSummary {
    /// Rows that were there before.
    pub before: usize,
    /// Rows written.
    pub written: usize,
    /// Records of the shard.
    pub all: usize,
}

impl RunSummary {
    /// True if every record of the shard has its row.
    pub fn is_complete(&self) -> bool {
        self.before + self.written == self.all
    }
}

/// Fits the records of a shard that have no row yet.
///
/// # Errors
/// If the journal cannot be read or written to; the rows before are kept.
pub fn run(
    folder: &FleetFolder,
    model: &FleetModel,
    list: &RecordList,
    options: &RunOptions,
    progress: &Progress,
) -> Result<RunSummary, InputError> {
    let jobs = Jobs::of(list, options);
    let mut has_row = vec![false; list.records.len()];
    let positions = list.positions();
    let mut found = |line: &LineName| {
        if let Some(i) = positions.get(&*line.record) {
            has_row[*i] |= !(options.retry_errors && line.is_error());
        }
    };
    // Shards of another number may have fitted some of the records.
    for path in journals(&folder.path)? {
        recorded(&path, &mut found)?;
    }
    let journal = Journal::open(&folder.path, options.shard, &mut found)?;
    drop(positions);
    let own = jobs.own();
    let all = own.clone().map(<[u32]>::len).sum();
    let before = own.flatten().filter(|i| has_row[**i as usize]).count();
    let shard = ShardRun {
        model,
        list,
        options,
        has_row,
        jobs,
        next: AtomicUsize::new(0),
        journal: Mutex::new(journal),
        written: AtomicUsize::new(0),
        before,
        all,
        progress,
        watched: (0..options.threads.max(1))
            .map(|_| Watched::default())
            .collect(),
        failure: Mutex::new(None),
    };
    shard.work();
    let mut journal = shard
        .journal
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    let synced = journal.sync();
    let failure = shard
        .failure
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    if let Some(error) = failure.or(synced.err()) {
        return Err(InputError::file(&folder.path, "a row cannot be written")
            .found(error)
            .expected("room for the rows")
            .hint("the same command continues after the rows that are written"));
    }
    Ok(RunSummary {
        before,
        written: shard.written.into_inner(),
        all,
    })
}

/// Records in blocks; the fits of a block follow one another.
struct Jobs {
    order: Vec<u32>,
    blocks: Vec<Range<usize>>,
    shard: Shard,
}

impl Jobs {
    /// Single records, or with warm starts those of each system in blocks.
    fn of(list: &RecordList, options: &RunOptions) -> Self {
        let count = u32::try_from(list.records.len()).unwrap_or(u32::MAX);
        let mut order: Vec<u32> = (0..count).collect();
        let blocks = match options.warm_start {
            false => (0..order.len()).map(|i| i..i + 1).collect(),
            true => Self::blocks_of_systems(list, &mut order),
        };
        Self {
            order,
            blocks,
            shard: options.shard,
        }
    }

    /// Sorts the records by their systems, in the order of the first record of each; blocks within one system.
    fn blocks_of_systems(list: &RecordList, order: &mut [u32]) -> Vec<Range<usize>> {
        let mut first: HashMap<&str, usize> = HashMap::new();
        for record in &list.records {
            let next = first.len();
            first.entry(&record.system).or_insert(next);
        }
        let system = |i: &u32| first[list.records[*i as usize].system.as_str()];
        order.sort_by_key(system);
        let mut blocks = Vec::new();
        let mut begin = 0;
        for group in order.chunk_by(|a, b| system(a) == system(b)) {
            let end = begin + group.len();
            let starts = (begin..end).step_by(BLOCK);
            blocks.extend(starts.map(|start| start..end.min(start + BLOCK)));
            begin = end;
        }
        blocks
    }

    /// Indices of the records of each block of the shard.
    fn own(&self) -> impl Iterator<Item = &[u32]> + Clone {
        let blocks = self.blocks.iter().enumerate();
        let blocks = blocks.filter(|(i, _)| self.shard.has(*i));
        blocks.map(|(_, block)| &self.order[block.clone()])
    }
}

/// A thread whose fit is watched.
#[derive(Default)]
struct Watched {
    interrupt: Arc<AtomicBool>,
    begin: Mutex<Option<Instant>>,
}

impl Watched {
    /// Begins the fit of a record.
    fn begin(&self) {
        let mut begin = self.begin.lock().unwrap_or_else(PoisonError::into_inner);
        self.interrupt.store(false, Ordering::Relaxed);
        *begin = Some(Instant::now());
    }

    fn end(&self) {
        *self.begin.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// Ends the fit where it has taken longer; under the lock, so that it is not the next one that ends.
    fn end_after(&self, limit: Duration) {
        let begin = self.begin.lock().unwrap_or_else(PoisonError::into_inner);
        if begin.is_some_and(|begin| begin.elapsed() > limit) {
            self.interrupt.store(true, Ordering::Relaxed);
        }
    }
}

struct ShardRun<'a> {
    model: &'a FleetModel,
    list: &'a RecordList,
    options: &'a RunOptions,
    has_row: Vec<bool>,
    jobs: Jobs,
    /// Number of the next block of all shards.
    next: AtomicUsize,
    journal: Mutex<Journal>,
    written: AtomicUsize,
    before: usize,
    all: usize,
    progress: &'a Progress<'a>,
    watched: Vec<Watched>,
    failure: Mutex<Option<std::io::Error>>,
}

impl ShardRun<'_> {
    /// Fits all blocks of the shard; this thread is the first worker.
    fn work(&self) {
        let is_done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            // Without this thread, an interrupt ends the work after the records that are being fitted.
            let watch = spawn_scoped(scope, || self.watch(&is_done));
            let others = self.watched.iter().skip(1);
            let others = others.map_while(|watched| {
                let work = move || {
                    share();
                    self.blocks(watched);
                };
                spawn_scoped(scope, work).ok()
            });
            let others: Vec<_> = others.collect();
            let own = || self.blocks(&self.watched[0]);
            match others.is_empty() {
                // The fit itself may use further processors.
                true => own(),
                false => sharing(own),
            }
            for other in others {
                if let Err(panic) = other.join() {
                    is_done.store(true, Ordering::Relaxed);
                    std::panic::resume_unwind(panic);
                }
            }
            is_done.store(true, Ordering::Relaxed);
            drop(watch);
        });
    }

    /// Ends fits at their time limit, and all at an interrupt.
    fn watch(&self, is_done: &AtomicBool) {
        while !is_done.load(Ordering::Relaxed) {
            let is_interrupted = self.options.interrupt.load(Ordering::Relaxed);
            for watched in &self.watched {
                if is_interrupted {
                    watched.interrupt.store(true, Ordering::Relaxed);
                }
                if let Some(limit) = self.options.time {
                    watched.end_after(limit + POLL);
                }
            }
            std::thread::sleep(POLL);
        }
    }

    fn is_ended(&self) -> bool {
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        self.options.interrupt.load(Ordering::Relaxed) || failure.is_some()
    }

    fn blocks(&self, watched: &Watched) {
        while !self.is_ended() {
            let number = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(block) = self.jobs.blocks.get(number) else {
                return;
            };
            if self.jobs.shard.has(number) {
                self.block(&self.jobs.order[block.clone()], watched);
            }
        }
    }

    /// Fits a block. Records that have a row are fitted again where a later one starts from their estimates.
    fn block(&self, block: &[u32], watched: &Watched) {
        let lacks_row = |i: &u32| !self.has_row[*i as usize];
        let Some(last) = block.iter().rposition(lacks_row) else {
            return;
        };
        let mut from: Option<Vec<f64>> = None;
        for i in &block[..=last] {
            if self.is_ended() {
                return;
            }
            let record: &Record = &self.list.records[*i as usize];
            if !self.options.warm_start && !lacks_row(i) {
                continue;
            }
            watched.begin();
            let limits = Limits {
                interrupt: Arc::clone(&watched.interrupt),
                time: self.options.time,
            };
            let found = fit_record(self.model, record, None, from.as_deref(), &limits);
            watched.end();
            let Some(found) = found else {
                return;
            };
            if lacks_row(i) {
                let mut journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
                if let Err(error) = journal.append(&found.row, &found.curves) {
                    let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
                    failure.get_or_insert(error);
                    return;
                }
                drop(journal);
                let written = self.written.fetch_add(1, Ordering::Relaxed) + 1;
                (self.progress)(self.before + written, self.all);
            }
            // After a record without a fit the next one starts as the model states.
            from = found.parameters.filter(|_| self.options.warm_start);
        }
    }
}
