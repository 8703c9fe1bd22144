//! One step after the other: damage (28), then contact (26).

use super::{
    ContactStep, DiscreteProblem, Outcome, Phases, RunError, State, Stop,
    bound_violation::Bounds,
    chosen::{Chosen, Plan},
    clock::Clock,
    damage_step::{DamageStep, DamageUpdate, Source},
    estimate::Estimate,
    load_curve::LoadCurve,
};
use crate::{
    petsc::Session,
    scene::{Stepping, TimeGrid},
};
use std::time::Instant;

/// What the steps of a run share.
pub(super) struct TimeLoop<'a> {
    problem: &'a DiscreteProblem,
    contact_step: ContactStep<'a>,
    damage: DamageStep<'a>,
    clock: Clock,
    /// What chosen steps have to follow, where it depends on time.
    load_curve: Option<LoadCurve<'a>>,
    /// The source at the last accepted step, once it is known.
    source: Option<Source>,
    bounds: Bounds,
    /// The delay of uniform steps, or what chosen ones need.
    estimate: Estimate<'a>,
    chosen: Option<Chosen<'a>>,
    pub(super) outcome: Outcome,
}

/// What became of a step.
#[derive(PartialEq)]
pub(super) enum Attempt {
    /// It is accepted: the last one of the outcome.
    Accepted,
    /// It is undone; a shorter one is to be tried.
    Undone,
    /// ζ_* is reached.
    Stopped,
}

/// The answer of a damage step.
struct Damaged {
    zeta: Vec<f64>,
    /// How it was found, where steps are chosen.
    plan: Option<Plan>,
    driving: DamageUpdate,
    /// min ζ and max ζ, and the bounds that the source allows.
    extremes: (f64, f64),
    allowed: Bounds,
}

impl<'a> TimeLoop<'a> {
    /// Solves (27): the displacement at t = 0, or the only one where there is no time.
    pub(super) fn start(
        session: &'a Session,
        problem: &'a DiscreteProblem,
        solver: &str,
        phases: &'a Phases,
    ) -> Result<Self, RunError> {
        let mut contact_step = ContactStep::new(session, problem, solver, phases)?;
        let first = contact_step.solve(0, problem.start(), &problem.initial_damage())?;
        contact_step.accept(problem.start())?;
        let (grid, zeta, body) = (problem.scene().time, &first.state.zeta, &problem.body);
        let chosen = match grid {
            Some(TimeGrid { end, stepping: Stepping::Auto { tolerance } }) => {
                Some(Chosen::new(body, zeta, tolerance, end))
            }
            _ => None,
        };
        let bounds = Bounds::of(body.partition.extremes(zeta));
        let mut outcome = Outcome::new(first);
        outcome.count(contact_step.report());
        Ok(Self {
            problem,
            contact_step,
            damage: DamageStep::new(session, problem, phases),
            clock: Clock::new(grid, chosen.as_ref().map_or(0.0, Chosen::first_step)),
            load_curve: chosen.as_ref().and_then(|_| LoadCurve::new(problem)),
            source: None,
            bounds,
            estimate: Estimate::new(&body.partition),
            chosen,
            outcome,
        })
    }

    /// Tries the next step; `None` at the end of time.
    ///
    /// # Errors
    /// The step failed, and shorter ones are not ours to choose or have become hopelessly small.
    pub(super) fn next(&mut self) -> Result<Option<Attempt>, RunError> {
        let Some((time, step)) = self.propose() else { return Ok(None) };
        match self.attempt(time, step) {
            Err(failure) if failure.is_of_a_step() => {
                if self.undo(step, 0.5)? {
                    Ok(Some(Attempt::Undone))
                } else {
                    Err(failure)
                }
            }
            other => other.map(Some),
        }
    }

    /// The next step's end and length, s: a chosen one follows the loads.
    fn propose(&mut self) -> Option<(f64, f64)> {
        loop {
            let (time, step) = self.clock.propose()?;
            let follows = match &mut self.load_curve {
                Some(curve) => curve.is_nearly_linear(self.outcome.last.state.time, time),
                None => true,
            };
            if follows || !self.clock.halve(step) {
                return Some((time, step));
            }
        }
    }

    /// The step of length `step` has not happened; the next is shorter by `factor`. False if it
    /// cannot be.
    fn undo(&mut self, step: f64, factor: f64) -> Result<bool, RunError> {
        self.contact_step.undo()?;
        let cut = self.clock.cut(step, factor);
        self.outcome.undone += usize::from(cut);
        Ok(cut)
    }

    fn attempt(&mut self, time: f64, step: f64) -> Result<Attempt, RunError> {
        let started = Instant::now();
        let n = self.outcome.last.record.step + 1;
        let damaged = self.damage(n, time, step)?;
        if damaged.extremes.0 <= self.problem.threshold() {
            return self.stop(&damaged, n, time, step);
        }

        // (26): u_n from ζ_n.
        let mut last = self.contact_step.solve(n, time, &damaged.zeta)?;
        let size = self.judge(&damaged, &last.state, step)?;
        if size > 1.0 {
            return match self.undo(step, Clock::reduction(size))? {
                true => Ok(Attempt::Undone),
                false => Err(RunError::Steps { step: n, time }),
            };
        }
        self.contact_step.accept(time)?;
        self.clock.accept(time, step, size);
        self.outcome.bound_violation.observe(damaged.allowed, damaged.extremes, n, time);
        let certificate = damaged.driving.certificate();
        last.record.zeta_residual = certificate.residual;
        last.record.zeta_error = certificate.error;
        last.record.seconds = started.elapsed().as_secs_f64();
        self.outcome.accept(last, damaged.driving);
        self.outcome.count(self.contact_step.report());
        Ok(Attempt::Accepted)
    }

    /// Finds the error of the step to `damaged` and u_n, over the allowed one; 0 for uniform steps.
    /// What the next step needs of this one is kept, unless the error is above 1.
    fn judge(&mut self, damaged: &Damaged, new: &State, step: f64) -> Result<f64, RunError> {
        let bounds = damaged.allowed.tightened(damaged.extremes);
        let (Some(chosen), Some(plan)) = (&mut self.chosen, &damaged.plan) else {
            self.estimate.accept(&self.outcome.last.state.zeta, &new.zeta, step);
            (self.source, self.bounds) = (None, bounds);
            return Ok(0.0);
        };
        let after = self.damage.source(&new.u, &new.zeta);
        let change = |from: &[f64]| -> Vec<f64> {
            let after = after.as_ref().map_or(&[][..], |source| &source.load);
            after.iter().zip(from).map(|(after, from)| after - from).collect()
        };
        let missed = self.damage.correction(&change(&plan.load), plan.step)?;
        let failed = RunError::Damage { step: self.outcome.last.record.step + 1, time: new.time };
        let missed = missed.ok_or(failed)?;
        let error = chosen.judge(plan, &new.zeta, &missed, [step, new.time]);
        let ratio = error.ratio;
        if ratio <= 1.0 {
            let before = self.source.as_ref().map_or(&[][..], |source| &source.load);
            chosen.accept(&new.zeta, &missed, error, step, change(before));
            self.bounds = bounds.shifted(self.problem.body.partition.extremes(&missed));
            self.source = after;
        }
        Ok(ratio)
    }

    /// The program stops when ζ_* is reached; chosen steps land there.
    fn stop(
        &mut self,
        damaged: &Damaged,
        n: usize,
        time: f64,
        step: f64,
    ) -> Result<Attempt, RunError> {
        let (reached, level) = (damaged.extremes.0, self.problem.threshold());
        let started = self.outcome.last.state.time;
        let (time, uncertainty) = match &self.chosen {
            None => {
                // The step that failed tells of the acceleration too.
                self.estimate.accept(&self.outcome.last.state.zeta, &damaged.zeta, step);
                (time, step + 2.0 * self.estimate.delay(&damaged.zeta).abs())
            }
            Some(chosen) => {
                let from = self.problem.body.partition.extremes(chosen.start()).0;
                let part = if from > level { (from - level) / (from - reached) } else { 0.0 };
                let (landing, delay) = (chosen.landing(), chosen.delay(&damaged.zeta));
                // The corrected start is not what is written.
                let written = self.outcome.last.record.zeta_min;
                if from.max(written) - level > landing && self.undo(step, (0.9 * part).max(0.01))? {
                    return Ok(Attempt::Undone);
                }
                (started + part * step, step + delay)
            }
        };
        self.outcome.bound_violation.observe(damaged.allowed, damaged.extremes, n, time);
        let floor = damaged.allowed.floor();
        self.outcome.stopped = Some(Stop { time, zeta_min: reached, floor, uncertainty });
        Ok(Attempt::Stopped)
    }

    /// (28): ζ_n from u_{n−1} and ζ_{n−1}, or as [`Chosen`] plans it.
    fn damage(&mut self, n: usize, time: f64, step: f64) -> Result<Damaged, RunError> {
        let old = &self.outcome.last.state;
        if self.source.is_none() {
            self.source = self.damage.source(&old.u, &old.zeta);
        }
        let least = self.source.as_ref().map_or(0.0, |source| source.least);
        let load = self.source.as_ref().map(|source| &source.load[..]);
        let plan = self.chosen.as_ref().zip(load).map(|(chosen, load)| chosen.plan(step, load));
        let partition = &self.problem.body.partition;
        let ((zeta, driving), allowed) = match &plan {
            None => (self.damage.advance(load, &old.zeta, step)?, self.bounds.after(least, step)),
            Some(plan) => {
                let bounds = self.bounds.shifted(partition.extremes(&plan.shift));
                let solved = self.damage.advance(Some(&plan.load), &plan.start, plan.step)?;
                (solved, bounds.after(plan.growth * least, plan.step))
            }
        };
        match driving {
            DamageUpdate::Missed(residual) => {
                Err(RunError::DamageMissed { step: n, time, residual })
            }
            DamageUpdate::Failed => Err(RunError::Damage { step: n, time }),
            _ => {
                let extremes = partition.extremes(&zeta);
                Ok(Damaged { zeta, plan, driving, extremes, allowed })
            }
        }
    }

    /// Ends the run: estimates the errors of its answers.
    pub(super) fn finish(self, phases: &Phases) -> Result<Outcome, RunError> {
        let Self { damage, contact_step, chosen, mut outcome, .. } = self;
        // Makes room for another factorisation.
        drop(damage);
        outcome.damage_error = chosen.map(|chosen| chosen.relative_error());
        let (worst, largest) = (outcome.worst.take(), outcome.largest.take());
        let estimate = || contact_step.accuracy(&outcome.last, worst.as_ref(), largest.as_ref());
        outcome.accuracy = phases.time("accuracy", estimate)?;
        Ok(outcome)
    }
}
