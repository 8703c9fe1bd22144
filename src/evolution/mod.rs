//! Problem VP^hk: damage and contact in turn, step by step.

mod bound_violation;
mod chosen;
mod clock;
mod damage_step;
mod contact_step;
mod estimate;
mod extrapolation;
mod foundation;
mod load_curve;
mod loads;
mod notes;
mod resultants;
mod discrete_problem;
mod state;
mod time_loop;

pub use crate::contact::ContactPoint;
pub use crate::phases::Phases;
pub use bound_violation::BoundViolation;
pub use contact_step::ContactStep;
pub use discrete_problem::{DiscreteProblem, SetupError};
pub use foundation::Foundation;
pub use loads::Loads;
pub use notes::Accuracy;
pub use state::{State, Step, StepRecord};

use crate::{
    contact::{ContactError, ContactReport, Kkt, RigidMotion, SolverError},
    petsc::{Communicator, PetscError, Session},
    scene::Scene,
};
use damage_step::DamageUpdate;
use time_loop::{Attempt, TimeLoop};

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
    pub skipped_damage_solves: usize,
    /// Steps undone and tried again, shorter.
    pub undone: usize,
    /// Steps in which the contact solver left its fast path.
    pub fallbacks: usize,
    /// Steps in which another solver gave the answer, and which.
    pub rescued: Option<(usize, &'static str)>,
    /// Where ζ left the bounds of its equation.
    pub bound_violation: BoundViolation,
    /// When first no pressing node held the body against a rigid motion, s, and which.
    pub unheld: Option<(f64, RigidMotion)>,
    /// Estimated errors of the answers.
    pub accuracy: Accuracy,
    /// Estimated error of the last ζ over the damage done, where steps are chosen.
    pub damage_error: Option<f64>,
    /// The accepted step before the last one whose u is likely to be the least exact, if it is less
    /// exact than the last: its stationarity residual and its fields.
    worst: Option<(f64, State)>,
    /// The largest displacement before the last step, m, if larger than in that, and its state.
    largest: Option<(f64, State)>,
}

/// The stop at ζ_*.
#[derive(Debug, Clone, Copy)]
pub struct Stop {
    /// When, s: the first t_n with min ζ ≤ ζ_*; where steps are chosen, the interpolated time.
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
    #[error("{}{source}{advice}", time.map_or(String::new(), |t| format!("step {step} (t = {t}): ")))]
    Contact {
        /// The step.
        step: usize,
        /// Its time, s; none where there is no time.
        time: Option<f64>,
        /// What failed.
        source: Box<ContactError>,
        /// What to try, to follow the source; empty where that says it.
        advice: &'static str,
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
    /// There is no contact solver of that name, or it cannot solve such problems.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// The damage solve misses its tolerance.
    #[error(
        "step {step} (t = {time}): the damage equation was solved only to a residual of {residual:.1e} \
         of its right-hand side; look for extreme numbers in [damage], for slivers in the mesh, and \
         for PETSc options that loosen -damage_ksp_"
    )]
    DamageMissed {
        /// The step.
        step: usize,
        /// Its time, s.
        time: f64,
        /// The relative residual.
        residual: f64,
    },
    /// Chosen steps cannot keep their tolerance.
    #[error(
        "step {step} (t = {time}): the damage changes too fast for time.tolerance, however short the \
         step; does a load jump there? Set time.step to a number"
    )]
    Steps {
        /// The step.
        step: usize,
        /// Its time, s.
        time: f64,
    },
    /// The scene contradicts itself at some time.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// Another rank failed where this one did not.
    #[error("another rank failed")]
    OnAnotherRank,
    /// PETSc failed.
    #[error(transparent)]
    Petsc(#[from] PetscError),
    /// Whoever was shown an accepted step could not go on (results that cannot be written).
    #[error(transparent)]
    Observer(Box<dyn std::error::Error + Send + Sync>),
}

impl RunError {
    /// The failed contact step n = `step`; its advice is of what the scene has: another solver helps
    /// where there is contact, shorter steps help after the first solve.
    fn contact(scene: &Scene, step: usize, time: f64, source: ContactError) -> Self {
        let contact = scene.boundaries.iter().any(|boundary| boundary.gap.is_some());
        let advice = match (source.is_missed(), contact, step > 0) {
            (false, ..) => "",
            (_, true, true) => {
                "; try another contact.solver, shorter steps or a larger contact.tolerance"
            }
            (_, true, false) => "; try another contact.solver or a larger contact.tolerance",
            (_, false, true) => "; try shorter steps or a larger contact.tolerance",
            (_, false, false) => "; try a larger contact.tolerance",
        };
        let time = scene.time.map(|_| time);
        Self::Contact { step, time, source: Box::new(source), advice }
    }

    /// Whether a shorter step may do better.
    fn is_of_a_step(&self) -> bool {
        matches!(self, Self::Contact { .. } | Self::Damage { .. } | Self::DamageMissed { .. })
    }
}

/// The answer of whoever is shown an accepted step: an error ends the run.
pub type Observed = Result<(), Box<dyn std::error::Error + Send + Sync>>;

/// Runs `problem` with the contact solver called `solver`; `accepted` sees every accepted
/// step, n = 0 included.
///
/// # Errors
/// See [`RunError`]; every accepted step has been seen by then.
pub fn run(
    session: &Session,
    problem: &DiscreteProblem,
    solver: &str,
    phases: &Phases,
    accepted: &mut dyn FnMut(&Step) -> Observed,
) -> Result<Outcome, RunError> {
    let mut run = TimeLoop::start(session, problem, solver, phases)?;
    let mut show = |step: &Step| {
        let shown = accepted(step).map_err(RunError::Observer);
        agreed(problem.body.partition.comm(), shown)
    };
    show(&run.outcome.last)?;
    loop {
        match run.next()? {
            Some(Attempt::Accepted) => show(&run.outcome.last)?,
            Some(Attempt::Undone) => (),
            Some(Attempt::Stopped) | None => return run.finish(phases),
        }
    }
}

/// All ranks go on, or none. Collective.
fn agreed<T, E: Into<RunError>>(comm: Communicator, result: Result<T, E>) -> Result<T, RunError> {
    let failed = comm.any(result.is_err());
    match result {
        Ok(_) if failed => Err(RunError::OnAnotherRank),
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
            skipped_damage_solves: 0,
            undone: 0,
            fallbacks: 0,
            rescued: None,
            bound_violation: BoundViolation::default(),
            accuracy: Accuracy::default(),
            damage_error: None,
            worst: None,
            largest: None,
        }
    }

    fn count(&mut self, report: &ContactReport) {
        self.fallbacks += usize::from(report.fallbacks > 0);
        if let Some(solver) = report.rescued_by {
            let before = self.rescued.map_or(0, |(steps, _)| steps);
            self.rescued = Some((before + 1, solver));
        }
    }

    fn accept(&mut self, last: Step, driving: DamageUpdate) {
        self.kkt = self.kkt.max(&last.record.kkt());
        self.skipped_damage_solves += usize::from(driving == DamageUpdate::Nothing);
        if self.unheld.is_none() {
            self.unheld = last.unheld.clone().map(|motion| (last.record.time, motion));
        }
        let before = std::mem::replace(&mut self.last, last);
        let size = before.record.displacement_max;
        if size > self.last.record.displacement_max
            && self.largest.as_ref().is_none_or(|(largest, _)| size > *largest)
        {
            self.largest = Some((size, before.state.clone()));
        }
        let residual = before.record.kkt_stationarity;
        if self.worst.as_ref().is_none_or(|(worst, _)| residual > *worst) {
            self.worst = Some((residual, before.state));
        }
    }
}
