//! Where the time goes.

use std::{cell::RefCell, collections::BTreeMap, time::Instant};

/// Seconds and calls of named phases of a run.
#[derive(Debug, Default)]
pub struct Phases(RefCell<BTreeMap<&'static str, (usize, f64)>>);

impl Phases {
    /// Runs `work` and books its wall time under `name`.
    pub fn time<R>(&self, name: &'static str, work: impl FnOnce() -> R) -> R {
        let started = Instant::now();
        let result = work();
        let mut phases = self.0.borrow_mut();
        let (calls, seconds) = phases.entry(name).or_default();
        *calls += 1;
        *seconds += started.elapsed().as_secs_f64();
        result
    }

    /// Calls and seconds by name.
    pub fn table(&self) -> BTreeMap<&'static str, (usize, f64)> {
        self.0.borrow().clone()
    }
}
