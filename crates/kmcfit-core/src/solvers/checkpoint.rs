//! Checkpoints, from which an interrupted fit continues with bit-identical results.
//!
//! A fit is a fixed sequence of units: searches, and long computations between them. A continued fit repeats the sequence.
//! A completed unit is read from the checkpoint, an incomplete search continues from its last saved state, and later units
//! are computed. Checkpoints hold parameters and the state of the method with all bits; responses and gradients are
//! recomputed. If a recomputed value differs from its saved fingerprint, the checkpoint of that unit is discarded and the
//! unit is computed from its beginning. A checkpoint therefore affects the duration of a fit and never its result.

use super::history::IterationRecord;
use super::settings::StartStrategy;
use super::solve_counts::SolveCounts;
use super::termination::Outcome;
use super::timings::Timings;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};
use std::fmt;
use std::time::Duration;

/// Number of values written in one call.
const CHUNK: usize = 64;

/// Numbers stored with all their bits, also where not finite: as text of 16 hexadecimal digits each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ExactF64s(pub Vec<f64>);

/// State of a search, without its history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolverState {
    /// Iterations done; the history has one row for each.
    pub iterations: u64,
    /// The best point.
    pub parameters: ExactF64s,
    /// Fingerprint of cost and gradient at the point ([`Iterate::fingerprint`](super::Iterate::fingerprint)).
    pub fingerprint: u64,
    /// State of the method.
    pub memory: MethodState,
    /// `J0`, the cost at the start of the search, and `G0^2`.
    pub references: ExactF64s,
    /// Parameters of the response snapshots, by iteration.
    pub snapshots: Vec<(u64, ExactF64s)>,
    /// Number of solves.
    pub counts: SolveCounts,
    /// Time by kind of work.
    pub timings: Timings,
    /// Wall-clock time.
    pub elapsed: Duration,
    /// Outcome, if the search has ended.
    pub outcome: Option<Outcome>,
}

/// State of a method between iterations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum MethodState {
    /// No state.
    Nothing,
    /// L-BFGS.
    Lbfgs {
        /// Coordinates of the point.
        x: ExactF64s,
        /// True for logarithmic coordinates.
        logarithmic: Vec<bool>,
        /// Pairs, oldest first: step, change of the gradient, its dual, and the curvature alone in the last.
        pairs: Vec<[ExactF64s; 4]>,
    },
    /// Projected gradient.
    ProjectedGradient {
        /// Diagonal metric of the search.
        metric: ExactF64s,
        /// First and last step length.
        lengths: ExactF64s,
    },
    /// Gauss–Newton.
    GaussNewton {
        /// Weight of the proximal term, the cost at the first point and the change of the last step below its rounding error, if any.
        numbers: ExactF64s,
        /// Parameters at which the Jacobian in use was computed, if they differ from the current point.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        made_at: Option<ExactF64s>,
    },
}

/// Saved result of a unit.
#[derive(Debug, Clone, PartialEq)]
pub enum CheckpointUnit {
    /// A search: history and state.
    Search(Vec<IterationRecord>, Box<SolverState>),
    /// Numbers computed between searches.
    Numbers(Vec<f64>),
    /// A unit without a result.
    Nothing,
}

/// Storage of checkpoints. Storage errors are reported by the implementation and must not end a fit.
pub trait CheckpointStore {
    /// Begins the next unit and returns its saved result, if any. Results of a completed unit are not saved again.
    fn begin(&mut self) -> Option<CheckpointUnit>;
    /// Discards the saved result of the unit, and of all later units.
    fn discard(&mut self);
    /// Saves an iteration of the search.
    fn save_iteration(&mut self, row: &IterationRecord);
    /// True if the state of a search with so many parameters should be saved now.
    fn is_due(&self, parameters: usize) -> bool;
    /// Saves the state of the search, replacing the previous one, or its final state.
    fn save_state(&mut self, state: SolverState);
    /// Ends the unit with computed numbers, or without a result.
    fn end(&mut self, numbers: Option<&[f64]>);
}

/// An iteration and its context in the fit.
#[derive(Debug, Clone, Copy)]
pub struct IterationEvent<'a> {
    /// Iteration.
    pub row: &'a IterationRecord,
    /// Start strategy of the search, if any.
    pub start: Option<StartStrategy>,
    /// Largest violation of a constraint after the iteration, relative to the row's scale; `None` without constraints.
    pub violation: Option<f64>,
}

/// Observer of a fit: callbacks for iterations, and storage of checkpoints.
pub struct Observer<'a> {
    observe: &'a mut dyn FnMut(&IterationRecord),
    on_event: Option<&'a mut dyn FnMut(&IterationEvent)>,
    start: Option<StartStrategy>,
    is_shown: bool,
    store: Option<&'a mut dyn CheckpointStore>,
}

impl<'a> Observer<'a> {
    /// Observer with a callback for every iteration, without checkpoints.
    pub fn new(observe: &'a mut dyn FnMut(&IterationRecord)) -> Self {
        Self {
            observe,
            on_event: None,
            start: None,
            is_shown: true,
            store: None,
        }
    }

    /// Adds a callback that receives the context of each iteration.
    #[must_use]
    pub fn with_events(mut self, on_event: &'a mut dyn FnMut(&IterationEvent)) -> Self {
        self.on_event = Some(on_event);
        self
    }

    /// Adds storage for checkpoints.
    #[must_use]
    pub fn with_checkpoints(mut self, store: &'a mut dyn CheckpointStore) -> Self {
        self.store = Some(store);
        self
    }

    /// Runs a search whose iterations are saved but not reported.
    pub(super) fn unreported<T>(&mut self, search: impl FnOnce(&mut Self) -> T) -> T {
        let before = std::mem::replace(&mut self.is_shown, false);
        let result = search(self);
        self.is_shown = before;
        result
    }

    /// Stops saving: results after an interrupt differ from those of an uninterrupted fit.
    pub(super) fn close(&mut self) {
        self.store = None;
    }

    pub(super) fn observe(&mut self) -> &mut dyn FnMut(&IterationRecord) {
        self.observe
    }

    /// Begins a search; returns its history and state, if saved.
    pub(super) fn begin_search(&mut self) -> Option<(Vec<IterationRecord>, SolverState)> {
        match self.store.as_mut()?.begin()? {
            CheckpointUnit::Search(rows, state) => Some((rows, *state)),
            CheckpointUnit::Nothing => None,
            CheckpointUnit::Numbers(_) => {
                self.discard();
                None
            }
        }
    }

    pub(super) fn discard(&mut self) {
        if let Some(store) = &mut self.store {
            store.discard();
        }
    }

    /// Sets the start strategy of the following searches.
    pub(super) fn begin_attempt(&mut self, start: StartStrategy) {
        self.start = Some(start);
    }

    pub(super) fn iteration(
        &mut self,
        row: &IterationRecord,
        violation: impl FnOnce() -> Option<f64>,
    ) {
        if self.is_shown {
            (self.observe)(row);
            if let Some(on_event) = &mut self.on_event {
                on_event(&IterationEvent {
                    row,
                    start: self.start,
                    violation: violation(),
                });
            }
        }
        if let Some(store) = &mut self.store {
            store.save_iteration(row);
        }
    }

    pub(super) fn is_due(&self, parameters: usize) -> bool {
        let store = self.store.as_ref();
        store.is_some_and(|store| store.is_due(parameters))
    }

    /// Saves the state of the search, which is built only if checkpoints are stored.
    pub(super) fn save_state(&mut self, state: impl FnOnce() -> SolverState) {
        if let Some(store) = &mut self.store {
            store.save_state(state());
        }
    }

    /// Ends a search that could not begin.
    pub(super) fn end_without_result(&mut self) {
        if let Some(store) = &mut self.store {
            store.end(None);
        }
    }

    /// Returns `len` numbers from the checkpoint, or from `compute`; results that were `cut_short` are not saved.
    pub(super) fn numbers(
        &mut self,
        len: usize,
        cut_short: &dyn Fn() -> bool,
        compute: impl FnOnce() -> Vec<f64>,
    ) -> Vec<f64> {
        let Some(store) = &mut self.store else {
            return compute();
        };
        match store.begin() {
            Some(CheckpointUnit::Numbers(numbers)) if numbers.len() == len => return numbers,
            Some(_) => store.discard(),
            None => {}
        }
        let numbers = compute();
        match cut_short() {
            true => self.close(),
            false => store.end(Some(&numbers)),
        }
        numbers
    }
}

impl Serialize for ExactF64s {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&Digits(&self.0))
    }
}

/// Numbers as hexadecimal digits, written without a copy of the whole text in memory.
struct Digits<'a>(&'a [f64]);

impl fmt::Display for Digits<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const DIGITS: &[u8; 16] = b"0123456789abcdef";
        let mut text = String::with_capacity(16 * CHUNK);
        for numbers in self.0.chunks(CHUNK) {
            text.clear();
            for bits in numbers.iter().map(|x| x.to_bits()) {
                let digit = |place: usize| DIGITS[(bits >> (4 * place)) as usize & 15];
                text.extend((0..16).rev().map(|place| char::from(digit(place))));
            }
            f.write_str(&text)?;
        }
        Ok(())
    }
}

impl<'de> Deserialize<'de> for ExactF64s {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let number = |digits: &[u8]| {
            let text = std::str::from_utf8(digits).ok()?;
            u64::from_str_radix(text, 16).ok().map(f64::from_bits)
        };
        let whole = text.len().is_multiple_of(16);
        let numbers: Option<Vec<f64>> = text.as_bytes().chunks(16).map(number).collect();
        let numbers = numbers.filter(|_| whole);
        let numbers = numbers.ok_or_else(|| D::Error::custom("not 16 hexadecimal digits each"))?;
        Ok(Self(numbers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_numbers_are_restored_and_damaged_ones_rejected() {
        let numbers = ExactF64s(vec![-0.0, f64::INFINITY, 0.1 + 0.2, 5e-324]);
        let text = serde_json::to_string(&numbers).expect("text");
        let read: ExactF64s = serde_json::from_str(&text).expect("bits");
        let bits = |b: &ExactF64s| b.0.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read), bits(&numbers));
        for damaged in [
            &text[..text.len() - 2],
            "\"00\"",
            "\"000000000000000g\"",
            "1",
        ] {
            assert!(
                serde_json::from_str::<ExactF64s>(damaged).is_err(),
                "{damaged}"
            );
        }
    }
}
