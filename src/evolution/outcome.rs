//! How a run ended that did not fail.

use super::{Accuracy, BoundViolation, Step, StepRecord};
use crate::contact::{Kkt, RigidMotion};
use std::{mem, rc::Rc};

/// How a run ended that did not fail.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// The last accepted step.
    pub last: Step,
    /// The stop at ζ_*, if it was reached.
    pub stopped: Option<Stop>,
    /// Worst KKT residuals of all steps.
    pub kkt: Kkt,
    /// Accepted steps whose damage solve was skipped, because a uniform ζ had no source.
    pub skipped_damage_solves: usize,
    /// Steps that were made again, shorter.
    pub undone: usize,
    /// Steps in which the solver that gave the answer left its fast path.
    pub fallbacks: usize,
    /// Steps in which another solver gave the answer, and which.
    pub rescued: Option<(usize, &'static str)>,
    /// By how much ζ violated the bounds of its equation.
    pub bound_violation: BoundViolation,
    /// When first the active nodes left a rigid motion unconstrained, s, and which.
    pub unconstrained: Option<(f64, RigidMotion)>,
    /// Estimated errors of the answers.
    pub accuracy: Accuracy,
    /// Estimated error of the last ζ over the damage done, where steps are chosen.
    pub damage_error: Option<f64>,
    /// The steps of the largest stationarity residual and displacement before the last.
    pub(super) least_accurate: Option<Rc<Step>>,
    pub(super) most_displaced: Option<Rc<Step>>,
}

/// The stop at ζ_*.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// When, s: the first t_n with min ζ ≤ ζ_*; where steps are chosen, the interpolated time.
    pub time: f64,
    /// The min ζ found there, which is not accepted.
    pub zeta_min: f64,
    /// The least ζ that the sources so far allow: above ζ_* the stop comes too early.
    pub least_admissible: f64,
    /// How far off the time may be, s: the last step and twice the estimated delay of all steps.
    pub uncertainty: f64,
}

impl Outcome {
    /// Of a run whose first solve, (27), is `first`.
    pub(super) fn new(first: Step) -> Self {
        let mut outcome = Self { last: first, ..Self::default() };
        outcome.count_last();
        outcome
    }

    /// A further step is accepted.
    pub(super) fn accept(&mut self, step: Step) {
        let before = Rc::new(mem::replace(&mut self.last, step));
        let keep_larger = |kept: &mut Option<Rc<Step>>, of: fn(&StepRecord) -> f64| {
            if kept.as_ref().is_none_or(|kept| of(&before.record) > of(&kept.record)) {
                *kept = Some(before.clone());
            }
        };
        keep_larger(&mut self.least_accurate, |record| record.kkt_stationarity);
        keep_larger(&mut self.most_displaced, |record| record.displacement_max);
        self.count_last();
    }

    fn count_last(&mut self) {
        let Step { record, report, unconstrained, .. } = &self.last;
        self.kkt = self.kkt.max(&record.kkt());
        self.skipped_damage_solves += usize::from(self.last.skipped_damage_solve);
        // A rescue counts as one fallback of the step.
        let rescues = usize::from(report.rescued_by.is_some());
        self.fallbacks += usize::from(report.fallbacks > rescues);
        if let Some(solver) = report.rescued_by {
            self.rescued = Some((self.rescued.map_or(1, |(steps, _)| steps + 1), solver));
        }
        if self.unconstrained.is_none() {
            self.unconstrained = unconstrained.clone().map(|motion| (record.time, motion));
        }
    }
}
