//! Wall time of a run by named phases.

use std::{cell::RefCell, collections::BTreeMap, time::Instant};

/// The measurements of one phase.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Phase {
    /// The number of calls; a forward and a backward solve alone are half a call each.
    pub calls: f64,
    /// The wall time of all calls, s.
    pub seconds: f64,
}

/// Named phases of a run. A name with a slash (`contact/products`) is a part of the phase before the slash.
/// The time of the phase includes the times of its parts.
#[derive(Debug, Default)]
pub struct Phases(RefCell<BTreeMap<&'static str, Phase>>);

impl Phases {
    /// Runs `work` and adds its wall time to the phase `name`.
    pub fn time<R>(&self, name: &'static str, work: impl FnOnce() -> R) -> R {
        self.time_part(name, 1.0, work)
    }

    /// As [`Self::time`], for work that is this part of a call.
    pub fn time_part<R>(&self, name: &'static str, call: f64, work: impl FnOnce() -> R) -> R {
        let started = Instant::now();
        let result = work();
        let seconds = started.elapsed().as_secs_f64();
        let mut phases = self.0.borrow_mut();
        let phase = phases.entry(name).or_default();
        phase.calls += call;
        phase.seconds += seconds;
        result
    }

    /// The parts of the phase `whole` by their names; for "" the phases that are not parts.
    pub fn parts(&self, whole: &str) -> Vec<(&'static str, Phase)> {
        let phases = self.0.borrow();
        let parts = phases.iter().filter_map(|(name, phase)| {
            let (before, part) = name.rsplit_once('/').unwrap_or(("", name));
            (before == whole).then_some((part, *phase))
        });
        parts.collect()
    }
}
