//! Checkpoints, from which a killed fit continues to the same bits.
//!
//! A fit is a fixed sequence of units: searches, and long computations between them. Whoever goes on
//! walks the same sequence again. A unit that had ended is not computed again but recalled, the search
//! that had not ended goes on from where it last stood, and everything after it is computed. What is
//! recalled is parameters and the memory of the solver, bit by bit; responses and gradients are computed
//! from these again, and what does not come out with the bits that were noted is not used: its unit is
//! computed from its beginning. So what is kept decides how long a fit takes and never how it ends.

use super::history::IterationRecord;
use super::settings::StartStrategy;
use super::solve_counts::SolveCounts;
use super::termination::Outcome;
use super::timings::Timings;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};
use std::fmt;
use std::time::Duration;

/// Numbers that are written at once.
const PIECE: usize = 64;

/// Numbers that are kept with all their bits, also where they are not finite: as a text of 16
/// hexadecimal digits each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ExactF64s(pub Vec<f64>);

/// Where a search stands: all that decides how it goes on, but for its history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolverState {
    /// Iterations so far; the history has one row for each.
    pub iterations: u64,
    /// The best point.
    pub parameters: ExactF64s,
    /// Of the cost and the gradient there ([`Iterate::fingerprint`](super::Iterate::fingerprint)).
    pub fingerprint: u64,
    /// What the solver remembers.
    pub memory: MethodState,
    /// `J0`, the cost from which the search set out, and `G0^2`.
    pub references: ExactF64s,
    /// The points whose responses are kept for figures, by iteration.
    pub snapshots: Vec<(u64, ExactF64s)>,
    /// Work done.
    pub counts: SolveCounts,
    /// What that work took.
    pub timings: Timings,
    /// Wall-clock time so far.
    pub elapsed: Duration,
    /// How it ended, if it has.
    pub outcome: Option<Outcome>,
}

/// What a solver remembers of the iterations before.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum MethodState {
    /// Nothing.
    Nothing,
    /// Of L-BFGS.
    Lbfgs {
        /// The coordinates of the point, as the last step left them.
        x: ExactF64s,
        /// Which of them are logarithms.
        logarithmic: Vec<bool>,
        /// Step, change of the gradient, its dual, and the curvature alone in the last; the oldest first.
        pairs: Vec<[ExactF64s; 4]>,
    },
    /// Of the projected gradient: metric; first and last length.
    ProjectedGradient {
        /// The diagonal metric of the search.
        metric: ExactF64s,
        /// First and last step.
        lengths: ExactF64s,
    },
    /// Of Gauss-Newton.
    GaussNewton {
        /// Weight of the proximal term, and the cost at the first point, if there was one.
        numbers: ExactF64s,
        /// Parameters of the point whose Jacobian is used, if it is not the one where the search stands.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        made_at: Option<ExactF64s>,
    },
}

/// What was kept of a unit.
#[derive(Debug, Clone, PartialEq)]
pub enum CheckpointUnit {
    /// A search: its history and where it stood.
    Search(Vec<IterationRecord>, Box<SolverState>),
    /// Numbers that were computed between searches.
    Piece(Vec<f64>),
    /// The unit ended at once, without a result.
    Nothing,
}

/// A place where a fit keeps what it needs to go on. Trouble with the place is the keeper's to report:
/// it must not end a fit.
pub trait CheckpointStore {
    /// Begins the next unit; what was kept of it by whoever was here before. What is told of a unit that
    /// had ended is not kept twice.
    fn begin(&mut self) -> Option<CheckpointUnit>;
    /// What was recalled of the unit does not belong here: it is dropped, with all later units.
    fn refuse(&mut self);
    /// Keeps an iteration of the search.
    fn row(&mut self, row: &IterationRecord);
    /// Whether it is time to keep where a search for so many parameters stands.
    fn is_due(&self, parameters: usize) -> bool;
    /// Keeps where the search stands, in the place of where it stood before, or how it ended.
    fn stand(&mut self, standing: SolverState);
    /// Ends the unit with numbers that were computed, or with nothing.
    fn end(&mut self, piece: Option<&[f64]>);
}

/// An iteration, and where in a fit it stands.
#[derive(Debug, Clone, Copy)]
pub struct IterationEvent<'a> {
    /// The iteration.
    pub row: &'a IterationRecord,
    /// Where its search started: the strategy of its starting point, if it has one.
    pub start: Option<StartStrategy>,
    /// The largest violation of a constraint after it, relative to its row's scale; `None` without
    /// constraints.
    pub violation: Option<f64>,
}

/// Who looks on while a fit runs.
pub struct Observer<'a> {
    observe: &'a mut dyn FnMut(&IterationRecord),
    look: Option<&'a mut dyn FnMut(&IterationEvent)>,
    start: Option<StartStrategy>,
    is_shown: bool,
    keeper: Option<&'a mut dyn CheckpointStore>,
}

impl<'a> Observer<'a> {
    /// Somebody who is shown every iteration and keeps nothing.
    pub fn new(observe: &'a mut dyn FnMut(&IterationRecord)) -> Self {
        Self {
            observe,
            look: None,
            start: None,
            is_shown: true,
            keeper: None,
        }
    }

    /// And somebody who is also told where in the fit an iteration stands.
    #[must_use]
    pub fn looking(mut self, look: &'a mut dyn FnMut(&IterationEvent)) -> Self {
        self.look = Some(look);
        self
    }

    /// And a place where the fit keeps what it needs to go on.
    #[must_use]
    pub fn keeping(mut self, keeper: &'a mut dyn CheckpointStore) -> Self {
        self.keeper = Some(keeper);
        self
    }

    /// A search whose iterations are kept and not shown.
    pub(super) fn unseen<T>(&mut self, search: impl FnOnce(&mut Self) -> T) -> T {
        let before = std::mem::replace(&mut self.is_shown, false);
        let result = search(self);
        self.is_shown = before;
        result
    }

    /// Nothing is kept from here on: what follows an interrupt is not what an uninterrupted fit does.
    pub(super) fn close(&mut self) {
        self.keeper = None;
    }

    pub(super) fn observe(&mut self) -> &mut dyn FnMut(&IterationRecord) {
        self.observe
    }

    /// Begins a search; its history and standing, if they were kept.
    pub(super) fn begin_search(&mut self) -> Option<(Vec<IterationRecord>, SolverState)> {
        match self.keeper.as_mut()?.begin()? {
            CheckpointUnit::Search(rows, standing) => Some((rows, *standing)),
            CheckpointUnit::Nothing => None,
            CheckpointUnit::Piece(_) => {
                self.refuse();
                None
            }
        }
    }

    pub(super) fn refuse(&mut self) {
        if let Some(keeper) = &mut self.keeper {
            keeper.refuse();
        }
    }

    /// The searches from here on start by this strategy.
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
            if let Some(look) = &mut self.look {
                look(&IterationEvent {
                    row,
                    start: self.start,
                    violation: violation(),
                });
            }
        }
        if let Some(keeper) = &mut self.keeper {
            keeper.row(row);
        }
    }

    pub(super) fn is_due(&self, parameters: usize) -> bool {
        let keeper = self.keeper.as_ref();
        keeper.is_some_and(|keeper| keeper.is_due(parameters))
    }

    /// Keeps a standing, which is made only where there is a keeper.
    pub(super) fn stand(&mut self, standing: impl FnOnce() -> SolverState) {
        if let Some(keeper) = &mut self.keeper {
            keeper.stand(standing());
        }
    }

    /// Ends a search that could not begin.
    pub(super) fn nothing(&mut self) {
        if let Some(keeper) = &mut self.keeper {
            keeper.end(None);
        }
    }

    /// The numbers that `compute` gives, `len` of them, recalled if they were kept; what was `cut_short`
    /// is not kept.
    pub(super) fn piece(
        &mut self,
        len: usize,
        cut_short: &dyn Fn() -> bool,
        compute: impl FnOnce() -> Vec<f64>,
    ) -> Vec<f64> {
        let Some(keeper) = &mut self.keeper else {
            return compute();
        };
        match keeper.begin() {
            Some(CheckpointUnit::Piece(piece)) if piece.len() == len => return piece,
            Some(_) => keeper.refuse(),
            None => {}
        }
        let piece = compute();
        match cut_short() {
            true => self.close(),
            false => keeper.end(Some(&piece)),
        }
        piece
    }
}

impl Serialize for ExactF64s {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&Digits(&self.0))
    }
}

/// Numbers as digits, written piece by piece: long ones never stand in memory as a text.
struct Digits<'a>(&'a [f64]);

impl fmt::Display for Digits<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const DIGITS: &[u8; 16] = b"0123456789abcdef";
        let mut piece = String::with_capacity(16 * PIECE);
        for numbers in self.0.chunks(PIECE) {
            piece.clear();
            for bits in numbers.iter().map(|x| x.to_bits()) {
                let digit = |place: usize| DIGITS[(bits >> (4 * place)) as usize & 15];
                piece.extend((0..16).rev().map(|place| char::from(digit(place))));
            }
            f.write_str(&piece)?;
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
    fn bits_come_back_and_damaged_ones_do_not() {
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
