//! The outcome of a run that did not fail.

use super::{
    Accuracy, ErrorBudget, ObservedProblem, Step, StepRecord,
    damage_step::{MAX_BALANCE, PlannedStep},
};
use crate::{
    contact::Kkt,
    fem::{Mass, RigidMotion},
    observe::Bar,
};
use serde::{Deserialize, Serialize};
use std::{mem, rc::Rc};

/// The outcome of a run that did not fail. A checkpoint omits fields that are known only at the end.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Outcome {
    /// The last accepted step.
    pub last: Step,
    /// The stop at ζ_*, if it was reached.
    pub stopped: Option<Stop>,
    /// Worst KKT residuals of all steps.
    pub kkt: Kkt,
    /// Accepted steps whose damage solve was skipped, because a uniform ζ had no source.
    pub skipped_damage_solves: usize,
    /// Rejected steps, made again shorter.
    pub rejected: usize,
    /// The number of steps in which another solver gave the answer, and its name.
    pub rescued: Option<(usize, String)>,
    /// The violation of the bounds on ζ.
    #[serde(skip)]
    pub bound_violation: BoundViolation,
    /// The number of steps in which the active nodes left a rigid motion unconstrained; the times of the first and
    /// the last such step, s; and the motion in the first.
    pub unconstrained: Option<(usize, [f64; 2], RigidMotion)>,
    /// Estimated errors of the answers.
    #[serde(skip)]
    pub accuracy: Accuracy,
    /// Where the errors of the last accepted state come from.
    #[serde(skip)]
    pub errors: ErrorBudget,
    /// The error bars of the figures; empty if they are not measured.
    #[serde(skip)]
    pub bars: Vec<Bar>,
    /// A note on contact between the nodes.
    #[serde(skip)]
    pub(crate) penetration: Option<String>,
    /// With adaptive steps: the estimated error of the last ζ from the time steps, relative to the damage done.
    #[serde(skip)]
    pub damage_error: Option<f64>,
    /// The time at which ζ may have reached ζ_*, within its error from the time steps, in a run that did not stop, s. The errors
    /// after it are unknown.
    #[serde(skip)]
    pub may_stop: Option<f64>,
    /// The step with the largest stationarity residual before the last step.
    pub(super) least_accurate: Option<Rc<Step>>,
    /// The step with the largest displacement before the last step.
    most_displaced: Option<Rc<Step>>,
}

/// The stop at ζ_*.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Stop {
    /// The time, s: the first t_n with min ζ ≤ ζ_*, or with two-step differences an interpolated time.
    pub time: f64,
    /// min ζ of the step that reached ζ_* and is not accepted.
    pub zeta_min: f64,
    /// The smallest ζ that the sources so far allow. If it is above ζ_*, the stop is too early.
    pub least_admissible: f64,
    /// The error bar of the time from the steps, s: the length of the last step, or with adaptive steps the error of the
    /// interpolation in it, plus the delay by the error of ζ. If its lower bound
    /// reached ζ_* before, the time since then plus the last step.
    pub uncertainty: f64,
    /// The measured error bar of the time from the mesh, s; `None` if it is not measured.
    pub from_mesh: Option<f64>,
}

impl Stop {
    /// The error bar of the time, s.
    pub fn bar(&self) -> f64 {
        self.uncertainty + self.from_mesh.unwrap_or(0.0)
    }
}

impl Outcome {
    /// The outcome of a run after its first solve, (27).
    pub(super) fn new(first: Step, problem: &ObservedProblem) -> Self {
        let mut outcome = Self { last: first, ..Self::default() };
        outcome.last.govern(problem, None);
        outcome.count_last();
        outcome
    }

    /// The step with the maximum displacement.
    pub(crate) fn most_displaced(&self) -> &Step {
        let of = |step: &Step| step.record.displacement_max;
        let larger = |before: &&Rc<Step>| of(before) > of(&self.last);
        self.most_displaced.as_ref().filter(larger).map_or(&self.last, Rc::as_ref)
    }

    /// The sizes of all figures in the run, from which their scales come.
    pub(crate) fn sizes(&self, problem: &ObservedProblem) -> Vec<f64> {
        let governing = self.last.governing.iter();
        problem.figures.magnitudes(governing.map(|of| of.map_or(0.0, |of| of.value)))
    }

    pub(super) fn accept(&mut self, mut step: Step, problem: &ObservedProblem) {
        step.govern(problem, Some(&self.last));
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
        if let Some(solver) = report.rescued_by {
            self.rescued.get_or_insert((0, solver.to_owned())).0 += 1;
        }
        if let Some(motion) = unconstrained {
            let first = (0, [record.time; 2], *motion);
            let (steps, [_, last], _) = self.unconstrained.get_or_insert(first);
            (*steps, *last) = (*steps + 1, record.time);
        }
    }
}

/// The violation of the bounds on ζ in a run.
///
/// Without discretisation in space, a step (28) obeys the maximum principle: φ ≤ 0, so max ζ never rises, and min ζ
/// falls by at most k |min φ|,
///
/// min ζ_{n−1} + k min φ_{n−1} ≤ ζ_n ≤ max ζ_{n−1}.
///
/// The bounds continue from step to step, so that small violations in many steps add up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct BoundViolation {
    /// Maximum of ζ minus its upper bound.
    pub above: f64,
    /// Maximum of the lower bound minus ζ.
    pub below: f64,
    /// The first step that violated a bound, and its time, s.
    pub first: Option<(usize, f64)>,
    /// k in that step, s.
    pub k: f64,
}

impl BoundViolation {
    /// Compares min ζ_n and max ζ_n with the bounds of the step, which ends at `time`.
    pub(super) fn observe(&mut self, planned: &PlannedStep, (min, max): (f64, f64), time: f64) {
        let (lower, upper) = planned.bounds;
        let (above, below) = (max - upper, lower - min);
        if above.max(below) > MAX_BALANCE {
            self.above = self.above.max(above);
            self.below = self.below.max(below);
            if self.first.is_none() {
                (self.first, self.k) = (Some((planned.n, time)), planned.k);
            }
        }
    }

    /// A note on the violation and its cure; `slowest` is min κ/h² over the body, 1/s.
    pub fn note(&self, mass: Mass, slowest: f64) -> Option<String> {
        let (step, time) = self.first?;
        let sides = [("above", self.above), ("below", self.below)].into_iter();
        let sides = sides.filter(|(_, by)| *by > MAX_BALANCE);
        let sides: Vec<String> = sides.map(|(side, by)| format!("{side} by {by:.1e}")).collect();
        let cure = if mass == Mass::Consistent && self.k * slowest < 1.0 {
            "the steps are so short that ζ diffuses less far than a triangle is wide (κk < h²); set damage.mass = \
             \"lumped\" (for meshes without obtuse angles), or refine the mesh"
        } else {
            "the mesh has obtuse angles, or the damage equation is solved too inaccurately (zeta_error in history.csv)"
        };
        Some(format!(
            "ζ left the range that the damage law allows, {}, first in step {step} (t = {time:.4e}): {cure} \
             (explain stop)",
            sides.join(" and ")
        ))
    }
}
