//! Observers of a run: they see its accepted steps and decide how it goes on.

use super::{RunState, Step};
use crate::interrupt::{self, Signal};

/// The answer of an observer: an error ends the run.
pub type Observed<T = ()> = Result<T, Box<dyn std::error::Error + Send + Sync>>;

/// How a run goes on after an accepted step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// The next step follows.
    Step,
    /// A checkpoint is written, then the next step follows.
    Checkpoint,
    /// This signal has come: a checkpoint is written, and the run ends.
    End(Signal),
}

impl Next {
    /// The observers of the ranks may disagree; the largest urgency decides. Signals have numbers above 1.
    pub(super) fn urgency(self) -> f64 {
        match self {
            Self::Step => 0.0,
            Self::Checkpoint => 1.0,
            Self::End(Signal(number)) => f64::from(number),
        }
    }

    pub(super) fn of_urgency(urgency: f64) -> Self {
        match urgency as i32 {
            0 => Self::Step,
            1 => Self::Checkpoint,
            number => Self::End(Signal(number)),
        }
    }
}

/// Sees the accepted steps of a run. Every function is called on all ranks. By default `keep` stores nothing.
pub trait Observer {
    /// Sees an accepted step and decides how the run goes on.
    ///
    /// # Errors
    /// The observer failed; the run ends.
    fn accept(&mut self, step: &Step) -> Observed<Next>;

    /// Keeps a checkpoint.
    ///
    /// # Errors
    /// It cannot be written.
    fn keep(&mut self, _state: RunState) -> Observed {
        Ok(())
    }
}

/// A function as an observer. A deferred signal ends the run.
impl<F: FnMut(&Step) -> Observed> Observer for F {
    fn accept(&mut self, step: &Step) -> Observed<Next> {
        self(step).map(|()| interrupt::received().map_or(Next::Step, Next::End))
    }
}
