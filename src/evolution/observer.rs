//! Whoever is shown the accepted steps of a run, and how the run goes on.

use super::{RunState, Step};
use crate::interrupt::{self, Signal};

/// The answer of an observer: an error ends the run.
pub type Observed<T = ()> = Result<T, Box<dyn std::error::Error + Send + Sync>>;

/// How a run goes on behind an accepted step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// With the next step.
    Step,
    /// With a checkpoint, then the next step.
    Checkpoint,
    /// It ends with a checkpoint, because this signal has come.
    End(Signal),
}

impl Next {
    /// Of what several ranks want the most urgent is done. Signals have numbers above 1.
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

/// Is shown the accepted steps of a run on its rank. Every function is called on all ranks. An
/// observer that only looks has nothing for checkpoints.
pub trait Observer {
    /// Sees an accepted step and says how to go on.
    ///
    /// # Errors
    /// The run is to end.
    fn accept(&mut self, step: &Step) -> Observed<Next>;

    /// Keeps a checkpoint.
    ///
    /// # Errors
    /// It cannot be written.
    fn keep(&mut self, _state: RunState) -> Observed {
        Ok(())
    }
}

/// An observer that only looks; a signal, where these are deferred, ends the run.
pub(super) struct Shown<'a>(pub(super) &'a mut dyn FnMut(&Step) -> Observed);

impl Observer for Shown<'_> {
    fn accept(&mut self, step: &Step) -> Observed<Next> {
        (self.0)(step).map(|()| interrupt::received().map_or(Next::Step, Next::End))
    }
}
