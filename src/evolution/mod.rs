//! Problem VP^hk: damage and contact in turn, step by step.

mod damage_step;
mod equilibrium;
mod loads;
mod phases;
mod setting;
mod state;

pub use equilibrium::Equilibrium;
pub use loads::Loads;
pub use phases::Phases;
pub use setting::{Setting, SetupError};
pub use state::{ContactPoint, State, Step, StepRecord};

use crate::{
    contact::{ContactError, Kkt},
    output::OutputError,
    petsc::{PetscError, Session},
};
use damage_step::{DamageStep, Driving};
use std::time::Instant;

/// How a run ended that did not fail.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The last accepted step.
    pub last: Step,
    /// Time at which min ζ ≤ ζ_* was found and that min ζ, if it was.
    pub stopped: Option<(f64, f64)>,
    /// Worst KKT residuals of all steps.
    pub kkt: Kkt,
    /// Steps without a damage solve, because nothing drove the damage.
    pub undamaged_steps: usize,
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
    /// The damage system could not be solved.
    #[error(
        "step {step} (t = {time}): the damage system was not solved: its matrix is not positive definite"
    )]
    Damage {
        /// The step.
        step: usize,
        /// Its time, s.
        time: f64,
    },
    /// The scene contradicts itself at some time.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// PETSc failed.
    #[error(transparent)]
    Petsc(#[from] PetscError),
    /// The results could not be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

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
    accepted: &mut dyn FnMut(&Step) -> Result<(), OutputError>,
) -> Result<Outcome, RunError> {
    let mut equilibrium = Equilibrium::new(session, setting, solver, phases)?;
    let mut damage = DamageStep::new(session, setting, phases)?;
    let mut zeta = setting.initial_damage();

    // (27): the displacement at t = 0, or the only one where there is no time.
    let mut last = equilibrium.solve(0, setting.time(0), &zeta)?;
    accepted(&last)?;
    let mut outcome = Outcome { kkt: last.record.kkt(), last, stopped: None, undamaged_steps: 0 };

    for n in 1..=setting.steps() {
        let (time, started) = (setting.time(n), Instant::now());

        // (28): ζ_n from u_{n−1} and ζ_{n−1}; the program stops when ζ_* is reached.
        match damage.advance(&outcome.last.state.u, &mut zeta)? {
            Driving::Solved => {}
            Driving::Nothing => outcome.undamaged_steps += 1,
            Driving::Failed => return Err(RunError::Damage { step: n, time }),
        }
        if let Some(zeta_min) = setting.at_threshold(&zeta) {
            outcome.stopped = Some((time, zeta_min));
            break;
        }

        // (26): u_n from ζ_n.
        last = equilibrium.solve(n, time, &zeta)?;
        last.record.seconds = started.elapsed().as_secs_f64();
        accepted(&last)?;
        outcome.kkt = outcome.kkt.max(&last.record.kkt());
        outcome.last = last;
    }
    Ok(outcome)
}
