//! Problem VP^hk: damage and contact in turn, step by step.

mod bounds;
mod clock;
mod damage_step;
mod equilibrium;
mod estimate;
mod extrapolation;
mod foundation;
mod loads;
mod notes;
mod setting;
mod state;

pub use crate::contact::ContactPoint;
pub use crate::phases::Phases;
pub use bounds::Excess;
pub use equilibrium::Equilibrium;
pub use foundation::Foundation;
pub use loads::Loads;
pub use notes::Accuracy;
pub use setting::{Setting, SetupError};
pub use state::{State, Step, StepRecord};

use crate::{
    contact::{ContactError, ContactReport, Kkt, RigidMotion, UnknownSolver},
    petsc::{PetscError, Ranks, Session},
};
use bounds::Bounds;
use clock::Clock;
use damage_step::{DamageStep, Driving};
use estimate::Estimate;
use std::time::Instant;

/// How a run ended that did not fail.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The last accepted step.
    pub last: Step,
    /// The stop at ζ_*, if it was reached.
    pub stopped: Option<Stop>,
    /// Worst KKT residuals of all steps.
    pub kkt: Kkt,
    /// Steps without a damage solve, because nothing drove the damage.
    pub undamaged_steps: usize,
    /// Steps undone and tried again, shorter.
    pub undone: usize,
    /// Steps in which the contact solver left its fast path.
    pub fallbacks: usize,
    /// Of these, steps in which TAO gave the answer in the place of the active set.
    pub rescued: usize,
    /// Where ζ left the bounds of its equation.
    pub excess: Excess,
    /// When first no pressing node held the body against a rigid motion, s, and which.
    pub unheld: Option<(f64, RigidMotion)>,
    /// Estimated errors of the last accepted step.
    pub accuracy: Accuracy,
}

/// The stop at ζ_*.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// When, s: the first t_n with min ζ ≤ ζ_*; where steps are chosen, the interpolated time less
    /// the estimated delay of the steps.
    pub time: f64,
    /// The min ζ found there, not accepted.
    pub zeta_min: f64,
    /// The least ζ that the sources so far allow: above ζ_* the stop comes too early.
    pub floor: f64,
    /// How far off the time may be, s: the last step and twice the estimated delay of all steps.
    pub uncertainty: f64,
}

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A contact step failed; the steps before it are accepted.
    #[error("step {step} (t = {time}): {source}")]
    Contact {
        /// The step.
        step: usize,
        /// Its time, s.
        time: f64,
        /// What failed.
        source: ContactError,
    },
    /// The damage step has no answer.
    #[error(
        "step {step} (t = {time}): the damage equation has no finite answer: its source overflows \
         or its matrix is not positive definite; look for extreme numbers in [damage] and the loads"
    )]
    Damage {
        /// The step.
        step: usize,
        /// Its time, s.
        time: f64,
    },
    /// The contact solver has no such name.
    #[error(transparent)]
    Solver(#[from] UnknownSolver),
    /// The scene contradicts itself at some time.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// Another rank failed where this one did not.
    #[error("another rank failed")]
    Elsewhere,
    /// PETSc failed.
    #[error(transparent)]
    Petsc(#[from] PetscError),
    /// Whoever was shown an accepted step could not go on (results that cannot be written).
    #[error(transparent)]
    Observer(Box<dyn std::error::Error + Send + Sync>),
}

/// The answer of whoever is shown an accepted step: an error ends the run.
pub type Observed = Result<(), Box<dyn std::error::Error + Send + Sync>>;

/// Runs `setting` with the contact solver called `solver`; `accepted` sees every accepted
/// step, n = 0 included.
///
/// # Errors
/// See [`RunError`]; every accepted step has been seen by then.
pub fn run(
    session: &Session,
    setting: &Setting,
    solver: &str,
    phases: &Phases,
    accepted: &mut dyn FnMut(&Step) -> Observed,
) -> Result<Outcome, RunError> {
    let mut equilibrium = Equilibrium::new(session, setting, solver, phases)?;
    let mut damage = DamageStep::new(session, setting, phases);

    // (27): the displacement at t = 0, or the only one where there is no time.
    let last = equilibrium.solve(0, setting.start(), &setting.initial_damage())?;
    equilibrium.accept(setting.start())?;
    agreed(setting.body.partition.ranks(), accepted(&last).map_err(RunError::Observer))?;
    let mut clock = Clock::new(setting.scene().time, damage.rate(&last.state.u, &last.state.zeta));
    let partition = &setting.body.partition;
    let ranks = partition.ranks();
    let mut estimate = Estimate::new(partition);
    let mut bounds = Bounds::of(partition.extremes(&last.state.zeta));
    let mut outcome = Outcome::new(last);
    outcome.count(equilibrium.report());

    while let Some((time, step)) = clock.propose() {
        let (started, n) = (Instant::now(), outcome.last.record.step + 1);
        let old = &outcome.last.state;

        // (28): ζ_n from u_{n−1} and ζ_{n−1}.
        let mut zeta = old.zeta.clone();
        let driving = damage.advance(&old.u, &mut zeta, step)?;
        let finite = ranks.all(zeta.iter().all(|z| z.is_finite()));
        if driving == Driving::Failed || !finite {
            if clock.cut(step, 0.5) {
                outcome.undone += 1;
                continue;
            }
            return Err(RunError::Damage { step: n, time });
        }

        let extremes = partition.extremes(&zeta);
        let allowed = bounds.after(driving.least_source(), step);

        // The program stops when ζ_* is reached; chosen steps land there.
        if let Some(reached) = Some(extremes.0).filter(|least| *least <= setting.threshold()) {
            let (from, level) = (outcome.last.record.zeta_min, setting.threshold());
            let share = ((from - level) / (from - reached)).clamp(0.0, 1.0);
            let landed = clock.tolerance().is_none_or(|tolerance| from - level <= tolerance);
            if !landed && clock.cut(step, (0.9 * share).max(0.01)) {
                outcome.undone += 1;
                continue;
            }
            // The step that failed tells of the acceleration too.
            estimate.accept(estimate.of(&old.zeta, &zeta, step));
            let delay = estimate.delay(&zeta);
            let time = match clock.tolerance() {
                None => time,
                Some(_) => old.time + share * step - delay,
            };
            // The estimate of the delay is good to a factor of 2.
            let uncertainty = step + 2.0 * delay.abs();
            outcome.excess.observe(allowed, extremes, n, time);
            let floor = allowed.floor();
            outcome.stopped = Some(Stop { time, zeta_min: reached, floor, uncertainty });
            break;
        }
        let error = estimate.of(&old.zeta, &zeta, step);
        if clock.tolerance().is_some_and(|tolerance| error.largest > tolerance)
            && clock.cut(step, clock.reduction(error.largest))
        {
            outcome.undone += 1;
            continue;
        }

        // (26): u_n from ζ_n.
        let mut last = match equilibrium.solve(n, time, &zeta) {
            Ok(last) => last,
            Err(failure @ RunError::Contact { .. }) => {
                equilibrium.undo()?;
                if clock.cut(step, 0.5) {
                    outcome.undone += 1;
                    continue;
                }
                return Err(failure);
            }
            Err(other) => return Err(other),
        };
        equilibrium.accept(time)?;
        clock.accept(time, step, error.largest);
        estimate.accept(error);
        outcome.excess.observe(allowed, extremes, n, time);
        bounds = allowed.tightened(extremes);
        last.record.seconds = started.elapsed().as_secs_f64();
        agreed(ranks, accepted(&last).map_err(RunError::Observer))?;
        outcome.accept(last, driving);
        outcome.count(equilibrium.report());
    }
    // Makes room for another factorisation.
    drop(damage);
    outcome.accuracy = phases.time("accuracy", || equilibrium.accuracy(&outcome.last.state))?;
    Ok(outcome)
}

/// All ranks go on, or none. Collective.
fn agreed<T, E: Into<RunError>>(ranks: Ranks, result: Result<T, E>) -> Result<T, RunError> {
    let failed = ranks.any(result.is_err());
    match result {
        Ok(_) if failed => Err(RunError::Elsewhere),
        result => result.map_err(E::into),
    }
}

impl Outcome {
    fn new(first: Step) -> Self {
        Self {
            unheld: first.unheld.clone().map(|motion| (first.record.time, motion)),
            kkt: first.record.kkt(),
            last: first,
            stopped: None,
            undamaged_steps: 0,
            undone: 0,
            fallbacks: 0,
            rescued: 0,
            excess: Excess::default(),
            accuracy: Accuracy { displacement: 0.0, energy: 0.0 },
        }
    }

    fn count(&mut self, report: &ContactReport) {
        self.fallbacks += usize::from(report.fallbacks > 0);
        self.rescued += usize::from(report.rescues > 0);
    }

    fn accept(&mut self, last: Step, driving: Driving) {
        self.kkt = self.kkt.max(&last.record.kkt());
        self.undamaged_steps += usize::from(driving == Driving::Nothing);
        if self.unheld.is_none() {
            self.unheld = last.unheld.clone().map(|motion| (last.record.time, motion));
        }
        self.last = last;
    }
}
