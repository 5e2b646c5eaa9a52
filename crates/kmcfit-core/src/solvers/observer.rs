//! Observer of a fit.

use super::history::IterationRecord;
use super::settings::StartStrategy;

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

/// Callbacks for the iterations of a fit.
pub struct Observer<'a> {
    observe: &'a mut dyn FnMut(&IterationRecord),
    on_event: Option<&'a mut dyn FnMut(&IterationEvent)>,
    start: Option<StartStrategy>,
    is_shown: bool,
}

impl<'a> Observer<'a> {
    /// Observer with a callback for every iteration.
    pub fn new(observe: &'a mut dyn FnMut(&IterationRecord)) -> Self {
        Self {
            observe,
            on_event: None,
            start: None,
            is_shown: true,
        }
    }

    /// Adds a callback that receives the context of each iteration.
    #[must_use]
    pub fn with_events(mut self, on_event: &'a mut dyn FnMut(&IterationEvent)) -> Self {
        self.on_event = Some(on_event);
        self
    }

    /// Runs a search whose iterations are not reported.
    pub(super) fn unreported<T>(&mut self, search: impl FnOnce(&mut Self) -> T) -> T {
        let before = std::mem::replace(&mut self.is_shown, false);
        let result = search(self);
        self.is_shown = before;
        result
    }

    pub(super) fn observe(&mut self) -> &mut dyn FnMut(&IterationRecord) {
        self.observe
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
        if !self.is_shown {
            return;
        }
        (self.observe)(row);
        if let Some(on_event) = &mut self.on_event {
            on_event(&IterationEvent {
                row,
                start: self.start,
                violation: violation(),
            });
        }
    }
}
