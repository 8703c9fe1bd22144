//! Step control: plans steps, and accepts or rejects them.
//!
//! Steps are uniform or adaptive. Uniform ones are Euler's (25) or, with the scheme "bdf2", two-step backward
//! differences with an extrapolated source (Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations
//! I*, III.5). Adaptive ones are two-step differences whose lengths follow their errors. With the step
//! k_n = ω k_{n−1},
//!
//! (M + kκL) ζ_n = M (ζ̃_{n−1} + β (ζ̃_{n−1} − ζ̃_{n−2})) + k b̂_n,
//! k = k_n (1+ω)/(1+2ω), β = ω²/(1+2ω), b̂_n = b_{n−1} + ω (b_{n−1} − b_{n−2}),
//!
//! which is a step (28) of length k from another start with another source. Once u_n and b_n are known, the next
//! step corrects the error of the extrapolation b̂_n: ζ̃_n = ζ_n + e_n with (M + kκL) e_n = k (b_n − b̂_n). Euler's
//! steps (28) and the first step of a run are the same formula with ω = 0. Euler's steps have no correction.

mod error_control;
mod forecast;
mod step_error;

use super::{
    BoundViolation, DiscreteProblem, RunError, Step, StepFailure, Stop,
    damage_step::{DamageStep, DamageUpdate, PlannedStep, SourceLoad},
};
use crate::{
    model::DamageSource,
    scene::{Scheme, Stepping},
};
pub use error_control::AIM;
use error_control::ErrorControl;
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

/// The decision about a step.
pub(super) enum Decision {
    /// The step is accepted.
    Accept(Box<Step>),
    /// The step is rejected and made again, shorter.
    Retry,
    /// ζ_* is reached: the run ends before this step.
    Stop(Stop),
}

/// Plans the steps of a run, and accepts or rejects them. A rejected step changes the length of the next one and nothing else.
/// The damage system may keep its factor, see `ContactStep::solve`.
pub(crate) struct StepController<'a> {
    problem: &'a DiscreteProblem,
    law: &'a dyn DamageSource,
    /// Error control of the damage; `None` for uniform steps.
    error_control: Option<ErrorControl<'a>>,
    /// Are the steps two-step backward differences? Otherwise they are Euler's.
    two_step: bool,
    history: StepState,
}

/// The controller's history of the accepted steps, which checkpoints keep.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct StepState {
    /// k_{n−1}, s; infinite before the first step, so that ω = 0.
    length: f64,
    /// ζ̃_{n−1}, ζ̃_{n−1} − ζ̃_{n−2}, and the rate of the formula at t_{n−1}, 1/s.
    zeta: DVector<f64>,
    change: DVector<f64>,
    rate: Option<DVector<f64>>,
    /// The change of this rate since t_{n−2}, for two-step differences, 1/s.
    rate_change: DVector<f64>,
    /// The damage source at t_{n−1}, and b_{n−1} − b_{n−2}, m²/s.
    source: SourceLoad,
    load_change: DVector<f64>,
    /// The lower and the upper bound on the error of ζ̃ from the steps so far, and their changes in the last step, of which these are
    /// its own errors; for Euler's steps the changes of the source by the bounds, 1/s.
    errors: [DVector<f64>; 2],
    error_changes: [DVector<f64>; 2],
    step_errors: [DVector<f64>; 2],
    error_rates: [DVector<f64>; 2],
    /// The times of the accepted steps, s, and min ζ then.
    path: Vec<[f64; 2]>,
    /// The time at which the lower bound reached ζ_*, if it did, s.
    may_stop: Option<f64>,
    /// e_n of the last step, which ζ_n lacks.
    last_error: DVector<f64>,
    /// Bounds on ζ̃_{n−1} by the maximum principle, see [`BoundViolation`].
    bounds: (f64, f64),
    violation: BoundViolation,
    /// The state of the error control for adaptive steps; set only in checkpoints.
    error_control: Option<(f64, [f64; 2], [f64; 2])>,
}

/// The ratio of the error of a step to its difference from the trapezoidal rule. In a smooth evolution with equal
/// steps, the increments of the formula are off by ⅓ k³ζ‴, and the trapezoidal rule is off by 1/12 k³ζ‴. This error
/// controls the lengths of the steps; a rule of third order estimates their accumulated error.
const TRUNCATION: f64 = 4.0 / 3.0;
/// The last term of the rule of third order over k_n (Δ_n − Δ_{n−1}), for equal steps. The error of the rule counts as at least
/// this term.
const LAST_TERM: f64 = 1.0 / 12.0;

impl<'a> StepController<'a> {
    /// After (27), from ζ₀ = `zeta` and its damage source. Adaptive steps end at the times `followed`.
    pub(super) fn new(
        problem: &'a DiscreteProblem,
        law: &'a dyn DamageSource,
        zeta: &[f64],
        source: SourceLoad,
        followed: &'a [f64],
    ) -> Self {
        let zeros = DVector::zeros(zeta.len());
        let error_control = ErrorControl::new(problem, zeta, followed);
        let history = StepState {
            length: f64::INFINITY,
            zeta: DVector::from_column_slice(zeta),
            change: zeros.clone(),
            rate: None,
            rate_change: zeros.clone(),
            source,
            load_change: zeros.clone(),
            errors: [zeros.clone(), zeros.clone()],
            error_changes: [zeros.clone(), zeros.clone()],
            step_errors: [zeros.clone(), zeros.clone()],
            error_rates: [zeros.clone(), zeros.clone()],
            path: Vec::new(),
            may_stop: None,
            last_error: zeros,
            bounds: problem.body.vertices.partition.min_max(zeta),
            violation: BoundViolation::default(),
            error_control: None,
        };
        let bdf2 = problem.scene().time.is_some_and(|grid| grid.scheme == Scheme::Bdf2);
        Self { problem, law, two_step: bdf2 || error_control.is_some(), error_control, history }
    }

    /// The state for a checkpoint.
    pub(super) fn state(&self) -> StepState {
        let error_control = self.error_control.as_ref().map(ErrorControl::state);
        StepState { error_control, ..self.history.clone() }
    }

    /// Goes back to the state of a checkpoint.
    pub(super) fn set_state(&mut self, state: StepState) {
        if let (Some(error_control), Some(state)) = (&mut self.error_control, state.error_control) {
            error_control.set_state(state);
        }
        self.history = state;
    }

    /// Plans the step after the accepted step `last`; `None` at the end of the run.
    pub(super) fn plan(&mut self, last: &Step) -> Option<PlannedStep> {
        let (grid, n) = (self.problem.scene().time?, last.record.step + 1);
        let (time, length) = match (&mut self.error_control, grid.stepping) {
            (Some(error_control), _) => error_control.next_step(last.state.time)?,
            (None, Stepping::Uniform { steps }) if n <= steps => {
                (grid.time(n, steps), grid.end / steps as f64)
            }
            _ => return None,
        };
        let omega = if self.two_step { length / self.history.length } else { 0.0 };
        let beta = omega * omega / (1.0 + 2.0 * omega);
        let k = length * (1.0 + omega) / (1.0 + 2.0 * omega);
        let shift = beta * &self.history.change;
        let (lower, upper) = shifted(
            self.history.bounds,
            self.problem.body.vertices.partition.min_max(shift.as_slice()),
        );
        // φ ≤ 0, so b ≤ 0 and b̂_n ≥ (1 + ω) b_{n−1}. NaN must stay NaN.
        let lower = lower + k * ((1.0 + omega) * self.history.source.min);
        let load = (&self.history.source.load + omega * &self.history.load_change)
            .map(|b| if b > 0.0 { 0.0 } else { b });
        let (start, bounds) = (&self.history.zeta + shift, (lower, upper));
        Some(PlannedStep { n, time, length, k, start, load, bounds })
    }

    /// Accepts or rejects a step whose ζ_n and u_n are known.
    ///
    /// # Errors
    /// The error is too large however short the step is, or the correction e_n has no answer.
    pub(super) fn decide(
        &mut self,
        planned: &PlannedStep,
        damage: &DamageUpdate,
        mut step: Box<Step>,
        damage_step: &mut DamageStep,
    ) -> Result<Decision, RunError> {
        let source = damage_step.source(&mut step)?;
        let missing = if self.two_step { &source.load - &planned.load } else { DVector::zeros(0) };
        let correction = damage_step.correction(planned, missing.as_slice())?;
        let correction = correction.ok_or_else(|| planned.failed(StepFailure::Damage))?;
        let corrected = &damage.zeta + &correction;
        let rate = planned.rate(&corrected);
        let reaches = if self.two_step {
            // The rate before the first step follows from its source, without correction.
            let first = || &rate - &correction / planned.k;
            let change = &rate - self.history.rate.clone().unwrap_or_else(first);
            let increment = &corrected - &self.history.zeta;
            let trapezoidal = planned.length * (&rate - 0.5 * &change);
            let truncation = TRUNCATION * (&trapezoidal - &increment);
            let added = &correction + truncation;
            let of_steps = self.error();
            if let Some(error_control) = &mut self.error_control
                && let Err(ratio) =
                    error_control.accept(planned, &damage.zeta, &of_steps, &added, &rate)
            {
                let shorter = self.retry(planned, ratio);
                return shorter.ok_or_else(|| planned.failed(StepFailure::TooShort));
            }
            // ∫ ζ' to third order is k (f_n − ½ Δ_n − ω/(6 (1+ω)) (Δ_n − ω Δ_{n−1})), Δ_n = f_n − f_{n−1}.
            let omega = planned.length / self.history.length;
            let before = omega * &self.history.rate_change;
            let turn = &change - &before;
            let error =
                trapezoidal - increment - planned.length * omega / (6.0 * (1.0 + omega)) * &turn;
            // A rate that jumps within the step is integrated with an error of up to ½ k_n times the jump. Then Δ_n or Δ_{n−1} vanishes
            // beside the other; in a smooth evolution they are nearly equal. The first step has no Δ_{n−1}.
            let of_jump = if omega > 0.0 { 0.5 } else { 0.0 };
            let jumps = of_jump * turn.abs().component_div(&(change.abs() + before.abs()));
            let doubt = jumps.map(|jumps| LAST_TERM.max(jumps)).component_mul(&turn.abs());
            let doubt = planned.length * doubt;
            let state = (&damage.zeta, &source, &correction);
            let errors = [&error - &doubt, &error + &doubt];
            self.history.rate_change = change;
            self.add_error(planned, errors, state, damage_step)?
        } else {
            // The error is 0 or twice its estimate if the rate jumps near an end of the step.
            let twice = self.twice_euler_error(planned, &source, &rate)?;
            let errors = [twice.map(|of| of.min(0.0)), twice.map(|of| of.max(0.0))];
            self.add_error(planned, errors, (&damage.zeta, &source, &correction), damage_step)?
        };
        self.history.violation.observe(planned, damage.min_max, planned.time);
        let (lower, upper) = planned.bounds;
        let tightened = (lower.max(damage.min_max.0), upper.min(damage.min_max.1));
        let partition = &self.problem.body.vertices.partition;
        self.history.bounds = shifted(tightened, partition.min_max(correction.as_slice()));
        self.history.length = planned.length;
        self.history.last_error = correction;
        self.history.path.push([planned.time, damage.min_max.0]);
        if reaches {
            self.history.may_stop.get_or_insert(planned.time);
        }
        self.history.change = &corrected - &self.history.zeta;
        self.history.zeta = corrected;
        self.history.rate = Some(rate);
        self.history.load_change = &source.load - &self.history.source.load;
        self.history.source = source;
        Ok(Decision::Accept(step))
    }

    /// Decides about a step from `last` that reaches ζ_*: the run stops, or a shorter step ends nearer to ζ_*.
    pub(super) fn decide_stop(
        &mut self,
        planned: &PlannedStep,
        damage: &DamageUpdate,
        last: &Step,
    ) -> Decision {
        let (zeta_min, threshold) = (damage.min_max.0, self.problem.threshold());
        let rate = planned.rate(&damage.zeta);
        let time = if self.two_step {
            let from = self.problem.body.vertices.partition.min_max(self.history.zeta.as_slice()).0;
            // The fraction of the step after which ζ falls to ζ_*.
            let fraction =
                if from > threshold { (from - threshold) / (from - zeta_min) } else { 0.0 };
            // Both the last written ζ and its correction ζ̃ must be near ζ_*. A shorter step is to end a tenth before ζ_* is
            // reached, as ζ falls faster near it, but has at least a hundredth of the length.
            if let Some(error_control) = &self.error_control
                && from.max(last.record.zeta_min) - threshold > error_control.stop_distance()
                && let Some(shorter) = self.retry(planned, (0.9 * fraction).max(0.01))
            {
                return shorter;
            }
            last.state.time + fraction * planned.length
        } else {
            planned.time
        };
        self.history.violation.observe(planned, damage.min_max, time);
        let [bar, rate, rate_before] = self.at_weakest_node(&damage.zeta, &rate);
        // The time is interpolated with a constant rate. If the rate changes linearly from `rate_before` to `rate`, it is off
        // by at most half of their relative difference, as a fraction of the step. With uniform steps the last step is the bar.
        let of_step = match self.error_control {
            Some(_) => (0.5 * ((rate - rate_before) / rate).abs()).min(1.0),
            None => 1.0,
        };
        let delay = self.delay(bar, rate.abs().min(0.5 * (rate + rate_before).abs()), time);
        let uncertainty = match self.history.may_stop {
            // The lower bound reached ζ_* in an earlier step, where it ends.
            Some(earliest) => planned.length + delay.max(time - earliest),
            None => of_step * planned.length + delay,
        };
        let least_admissible = planned.bounds.0;
        let stop = Stop { time, zeta_min, least_admissible, uncertainty, from_mesh: None };
        Decision::Stop(stop)
    }

    /// By how much an `error` of min ζ delays a stop at `time`, s: by the larger one of two times. This run took the first one from
    /// ζ_* + `error` to ζ_*, and would have taken longer if it had been less damaged. With the present `rate` ζ falls by the error in the second
    /// one, which is long if the load passes: the body may survive.
    fn delay(&self, error: f64, rate: f64, time: f64) -> f64 {
        let (threshold, mut after) = (self.problem.threshold(), [time, 0.0]);
        for &[earlier, zeta] in self.history.path.iter().rev() {
            let before = [earlier, zeta - threshold];
            if before[1] >= error {
                let part = (error - after[1]) / (before[1] - after[1]);
                return (time - after[0] + part * (after[0] - earlier)).max(error / rate);
            }
            after = before;
        }
        time.max(error / rate)
    }

    /// Decides about a step whose solves failed: with adaptive steps, a shorter one may succeed.
    ///
    /// # Errors
    /// `failure`, if no shorter step is to be tried.
    pub(super) fn decide_failure(
        &mut self,
        planned: &PlannedStep,
        failure: RunError,
    ) -> Result<Decision, RunError> {
        let shorter = match failure {
            // No step is short enough for a wrong law, or for numbers without squares.
            RunError::Step {
                source:
                    StepFailure::TooShort | StepFailure::Source(_) | StepFailure::Unrepresentable { .. },
                ..
            } => None,
            RunError::Contact { .. } | RunError::Step { .. } => self.retry(planned, 0.5),
            _ => None,
        };
        shorter.ok_or(failure)
    }

    /// The time at which ζ may have reached ζ_*, within its error from the time steps, s.
    pub(crate) fn may_stop(&self) -> Option<f64> {
        self.history.may_stop
    }

    pub(crate) fn violation(&self) -> BoundViolation {
        self.history.violation
    }

    /// The estimated error of the last accepted ζ over the damage done, for adaptive steps.
    pub(crate) fn damage_error(&self) -> Option<f64> {
        let error_control = self.error_control.as_ref()?;
        Some(error_control.relative(&self.step_error()))
    }

    /// Rejects the step for one shorter by the `ratio`; `None` if steps are uniform or this step would be too short.
    fn retry(&mut self, planned: &PlannedStep, ratio: f64) -> Option<Decision> {
        let possible = self.error_control.as_mut()?.shorten(planned.length * ratio);
        possible.then_some(Decision::Retry)
    }
}

/// Bounds on ζ after a correction of ζ by a field with this minimum and maximum.
fn shifted((lower, upper): (f64, f64), (min, max): (f64, f64)) -> (f64, f64) {
    (lower + min.min(0.0), upper + max.max(0.0))
}
