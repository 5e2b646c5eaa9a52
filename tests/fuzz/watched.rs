//! Runs inputs within limits of time and memory.

use crate::targets::{KINDS, Target, Verdict};
use peak_alloc::PeakAlloc;
use std::sync::PoisonError;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Time after which an input counts as hanging; all valid ones take less than a second.
const HANGS: Duration = Duration::from_secs(60);

/// Memory that reading may use: bytes per byte of input, and bytes independent of the input. Both are documented in
/// `docs/commands.md`.
const PER_BYTE: usize = 256;
const BESIDES: usize = 128 << 20;

/// Memory used by an input, bytes, and its result, if it ended.
type Taken = Option<(usize, Verdict)>;

/// A target whose inputs run one after another on a second thread.
pub struct Watched {
    inputs: Sender<Vec<u8>>,
    taken: Receiver<Taken>,
    name: String,
    /// Inputs that were accepted and refused.
    verdicts: [usize; 2],
    /// Largest memory of one input, bytes.
    most: (usize, String),
}

impl Watched {
    pub fn new(name: &str, target: Target) -> Self {
        let (inputs, received) = channel::<Vec<u8>>();
        let (told, taken) = channel();
        let run = move || {
            for bytes in received {
                let before = MEMORY.current_usage();
                MEMORY.reset_peak_usage();
                let held = std::panic::catch_unwind(|| target(&bytes));
                let most = MEMORY.peak_usage().saturating_sub(before);
                if told.send(held.ok().map(|verdict| (most, verdict))).is_err() {
                    return;
                }
            }
        };
        let thread = std::thread::Builder::new().name(name.to_owned());
        thread.spawn(run).expect("a thread");
        Self {
            inputs,
            taken,
            name: name.to_owned(),
            verdicts: [0; 2],
            most: (0, String::new()),
        }
    }

    /// Runs an input, which must end within the limits and without a panic.
    pub fn hold(&mut self, name: &str, bytes: Vec<u8>) {
        let length = bytes.len();
        let shown = String::from_utf8_lossy(&bytes[..length.min(4000)]).into_owned();
        self.inputs.send(bytes).expect("the thread lives");
        let taken = self.taken.recv_timeout(HANGS);
        let taken = taken.unwrap_or_else(|_| panic!("{name} hangs:\n{shown}"));
        let (taken, verdict) = taken.unwrap_or_else(|| panic!("{name} panics:\n{shown}"));
        let most = PER_BYTE * length + BESIDES;
        assert!(
            taken <= most,
            "{name} takes {taken} bytes of {most}:\n{shown}"
        );
        self.verdicts[verdict as usize] += 1;
        if taken > self.most.0 {
            self.most = (taken, name.to_owned());
        }
    }

    /// Number of kinds of messages so far.
    pub fn kinds(&self) -> usize {
        KINDS.lock().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// Counts of the results, in the form that `.ci/long` reads.
    pub fn row(&self, seed: u64) -> String {
        let [accepted, refused] = self.verdicts;
        let (most, name) = &self.most;
        format!(
            "{}: seed {seed}, {} inputs, {accepted} accepted, {refused} refused, 0 crashes, {} kinds of \
             messages, {:.1} MB at most ({name})",
            self.name,
            accepted + refused,
            self.kinds(),
            *most as f64 / 1e6
        )
    }
}
