//! The contact step (26), from ζ_n and f_n to a certified u_n:
//!
//! u_n minimises ½ uᵀK(ζ_n)u − f_nᵀu over u·ν ≤ g on Γ_C and u = u_D on Γ_D.
//!
//! The unknowns c are the displacements in the nodal bases, in which every condition concerns one unknown. They are
//! measured from a rigid [`Reference`] motion.
//!
//! - In: the time, the nodal damage and the load case there; the state of the last accepted step.
//! - Out: a [`Step`] whose KKT residuals the certificate has found within the tolerance, or a [`RunError`] that names
//!   the step and its reason.
//! - Callers: the loop over the steps in `evolution`, which then accepts the step or tries a shorter one.
//!
//! The way of one step is [`ContactStep::solve`]: solve (`minimisation`), certify (`certificate`), decide (`decision`). An
//! [`Attempt`] says from where its solver starts, and with which tolerance. The decision accepts its answer, changes one thing for the next
//! attempt, or gives up with a reason. Of many answers the step takes the one of least displacement (`one_of_many`).
//!
//! This table lists everything that a step tries again, and for which input. Each entry has a test in `tests`:
//!
//! | place | what changes | for which input |
//! |---|---|---|
//! | `decision` | the reference: it moves with a mostly rigid answer | a body that falls through a wide gap |
//! | `decision` | the load: the residual forces of the answer before; the tolerance | slender bodies, whose last digits bend them |
//! | `decision` | the solver: the rescuer, from the accepted steps | a fixed point that is slow where nothing stops a rotation |
//! | `StepController::decide_failure` | the length of an adaptive step | contact that a solver with few iterations loses |
//! | `contact/solvers/active_set.rs` | all unknowns in place of the condensed ones | an active set that leaves the small problem singular |
//! | `contact/solvers/tao.rs` | the unit of displacements, and the centre of the proximal term | a body that contact alone supports |
//! | `linear/linear_solver.rs` | the factor: a new one of the present K | damage that has grown since the factor was made |
//! | `accuracy/first_mesh.rs` | the size of the first mesh | curved sides of a hole that fold coarse triangles |
mod solver_error;
mod certificate;
mod decision;
mod minimisation;
mod one_of_many;
mod reference;

use certificate::active_bounds;
pub use solver_error::Accuracy;

use super::{
    DiscreteProblem, LoadCase, ObservedProblem, RunError, RunOptions, State, Step, StepFailure,
    StepRecord, agreed,
};
use crate::{
    contact::{self, Bound, Scales, SharedSolver},
    fem::Stiffness,
    linear::{Extrapolation, FactorState, LinearSolver, Precision},
    observe::{FirstContact, SHOWN_AS_ZERO},
    petsc::{PetscError, Session, Vector, stage},
};
use certificate::Candidate;
use decision::{Attempt, Decision};
use minimisation::displacement;
use nalgebra::{DMatrix, DVector};
use reference::Reference;
use serde::{Deserialize, Serialize};
use std::{ops::RangeInclusive, time::Instant};

/// Solves the contact problems of a run, one after the other.
pub struct ContactStep<'a> {
    session: &'a Session,
    pub(crate) problem: &'a ObservedProblem,
    /// The chosen solver, then the one for steps in which it stops short of the tolerance, if there is one.
    solvers: Vec<SharedSolver>,
    /// Solves the linear systems of all solvers.
    elastic: LinearSolver,
    stiffness: Stiffness,
    /// η_*(ζ) at the quadrature points, with which K was assembled.
    zeta_at_points: Vec<f64>,
    /// The load of the free unknowns, and these unknowns c.
    load: Vector,
    c: Vector,
    /// The data from which every solve starts, and their update in case the step is accepted.
    accepted: AcceptedState,
    next: AcceptedState,
    /// c of the accepted steps.
    extrapolation: Extrapolation,
    /// Does every rank know all triangles around its own nodes?
    covered: bool,
    /// u·ν at the bounds, one column per rigid motion in the null space of K.
    rigid: DMatrix<f64>,
}

/// The data that an accepted step passes to the next one.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct AcceptedState {
    /// The reference configuration of the displacements.
    reference: Reference,
    /// The maximum scales of residuals so far.
    scales: Scales,
    /// The maximum Σ|f| and Σ|Ku| so far, N per metre of thickness: the scale of resultants.
    forces: f64,
    /// Per bound: 1 if it is active, else 0.
    active: Vec<f64>,
    /// The solver's warm start, in the solver's own form.
    warm_start: Vec<f64>,
}

/// The contact steps' part of a checkpoint.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct ContactState {
    accepted: AcceptedState,
    extrapolation: Extrapolation,
    factor: FactorState,
}

/// The force scale is at least this fraction of the maximum load. Otherwise the answer to a rounded zero
/// (sin(pi) = 1.2e-16) would need as many digits as any other.
const MIN_LOAD: f64 = 1e-6;
/// The energies of larger displacements, m, overflow.
const MAX_DISPLACEMENT: f64 = 1e150;
/// Forces and displacements whose squares do not lose digits to underflow, and are finite.
const SQUARED: RangeInclusive<f64> = 1e-140..=f64::MAX;

impl<'a> ContactStep<'a> {
    /// The contact step with the contact solver of `run_options`.
    ///
    /// # Errors
    /// There is no solver of that name, or PETSc failed.
    pub fn new(
        session: &'a Session,
        problem: &'a ObservedProblem,
        run_options: &RunOptions,
    ) -> Result<Self, RunError> {
        let (body, constraints) = (&problem.body, &problem.constraints);
        let (comm, unknowns) = (body.comm(), 2 * body.nodes.partition.owned());
        let stiffness = stage("stiffness pattern", || {
            Stiffness::new(session, body, &problem.elasticity, &constraints.bases)
        })?;
        let options = &problem.scene().contact;
        let has_bounds = comm.any(!constraints.bounds.is_empty());
        let solvers = contact::solvers(&run_options.solver, has_bounds, options)?;
        // A preconditioner needs only single precision, which halves the bytes to read.
        let precision = Precision::Preconditioner;
        let accepted = AcceptedState {
            reference: Reference::default(),
            scales: Scales { force: MIN_LOAD * problem.largest_load, displacement: 0.0 },
            forces: 0.0,
            active: vec![0.0; constraints.bounds.len()],
            warm_start: Vec::new(),
        };
        Ok(Self {
            session,
            problem,
            solvers,
            elastic: LinearSolver::new(session, contact::ELASTIC, unknowns, precision)?,
            stiffness,
            zeta_at_points: body.at_points(&vec![1.0; body.mesh.nodes.len()]),
            load: Vector::zeros(session, unknowns)?,
            c: Vector::zeros(session, unknowns)?,
            next: accepted.clone(),
            accepted,
            extrapolation: Extrapolation::default(),
            covered: comm.all(body.is_covered()),
            rigid: problem.motions.normal_at(body, &constraints.bounds),
        })
    }

    /// Sets the solver's warm start, in its own form. Active set: 1 per bound guessed to be active, else 0.
    pub fn set_warm_start(&mut self, warm_start: &[f64]) {
        self.accepted.warm_start = warm_start.to_vec();
    }

    /// u_n at `time` for the nodal damage `zeta`. Every solve starts from the accepted steps. A rejected step leaves K and the
    /// factor of K alone behind. The next solve replaces K; another factor changes answers within the tolerance, and the
    /// iterations of a method.
    ///
    /// # Errors
    /// The solver failed, or neither its answers nor its rescuer's met the KKT tolerance.
    pub fn solve(&mut self, step: usize, time: f64, zeta: &[f64]) -> Result<Step, RunError> {
        let started = Instant::now();
        let problem = self.problem;
        self.set_damage(zeta);
        let comm = problem.body.comm();
        let case = agreed(comm, stage("loads", || problem.load_case(time)))?;
        let mut attempt = self.first_attempt(0, &case)?;
        let candidate = loop {
            let decision = match self.minimise(&mut attempt, &case) {
                Ok((u, stopped)) => {
                    let reference = &attempt.next.reference;
                    let candidate = stage("certificate", || self.certify(reference, u, &case));
                    self.decide(attempt, stopped, candidate, &case)?
                }
                Err(error) => self.give_up(attempt, (error, None), &case)?,
            };
            match decision {
                Decision::Accept(accepted, candidate) => {
                    attempt = accepted;
                    break candidate;
                }
                Decision::Again(changed) => attempt = changed,
                Decision::GiveUp(source) => {
                    return Err(RunError::contact(problem, step, time, source));
                }
            }
        };
        let candidate = self.of_minimum_displacement(&mut attempt.next, candidate, &case)?;
        self.step_of(attempt, candidate, (step, &case, zeta), started)
    }

    /// K(ζ) for the nodal damage `zeta`, unless K is already that of this damage. Collective.
    fn set_damage(&mut self, zeta: &[f64]) {
        let problem = self.problem;
        let zeta_at_points = problem.zeta_at_points(zeta);
        if problem.body.comm().any(zeta_at_points != self.zeta_at_points) {
            stage("stiffness", || {
                self.stiffness.set_damage(&problem.body, &zeta_at_points);
            });
            self.zeta_at_points = zeta_at_points;
        }
    }

    /// The step of an accepted answer, and the data that it passes to the next step.
    fn step_of(
        &mut self,
        attempt: Attempt,
        candidate: Candidate,
        (step, case, zeta): (usize, &LoadCase, &[f64]),
        started: Instant,
    ) -> Result<Step, RunError> {
        let (problem, time) = (self.problem, case.time);
        let Attempt { mut next, mut report, solver, .. } = attempt;
        if solver > 0 {
            report.rescued_by = Some(self.solvers[solver].name());
            report.fallbacks += 1;
            // The chosen solver cannot use the rescuer's warm start in the next step.
            next.warm_start.clear();
        }
        let Candidate { u, kkt, scales, force, unbalanced, mut contact, prescribed, .. } =
            candidate;
        next.scales = scales;
        let forces = self.accepted.forces.max(candidate.forces);
        next.forces = forces;
        // Contact without force is rounding.
        let rounding = candidate.rounding.max(SHOWN_AS_ZERO * forces);
        for point in contact.iter_mut().filter(|point| point.force <= rounding) {
            (point.active, point.pressure) = (false, 0.0);
        }
        let limit = problem.tolerance * scales.force;
        next.active = active_bounds(&problem.constraints, &contact, limit);
        let unconstrained = self.unconstrained_motion(&contact, force);
        let u = next.reference.total(u);
        self.next = next;
        let reactions = -problem.body.nodes.partition.dot(&unbalanced, &u, 2);
        let mut state = State { time, u, zeta: zeta.to_vec(), contact, prescribed };
        state.prescribed = problem.pressed(&state, &unbalanced, rounding);
        let (observation, figures) =
            stage("figures", || problem.observe(&state, &case.load, &unbalanced, rounding))?;
        let mut record = StepRecord::new(problem, step, &state, &observation, &report, &kkt);
        record.seconds = started.elapsed().as_secs_f64();
        if !(0.0..=MAX_DISPLACEMENT).contains(&record.displacement_max) {
            let source = StepFailure::TooLarge(record.displacement_max);
            return Err(RunError::Step { step, time, source });
        }
        Ok(Step {
            first_contact: FirstContact::of(&observation, time),
            strains: observation.strained.strains,
            state,
            record,
            figures,
            governing: Vec::new(),
            forces,
            report,
            prescribed_share: prescribed_share(observation.work, reactions, problem.tolerance),
            unconstrained,
            skipped_damage_solve: false,
        })
    }

    /// Checks after a run that its largest forces and displacements have squares. If these underflow, zero residuals prove nothing.
    pub(super) fn check_scales(&self, last: &Step) -> Result<(), RunError> {
        let force = self.accepted.forces.max(self.problem.largest_load);
        let displacement = self.accepted.scales.displacement;
        match [force, displacement].iter().all(|of| *of == 0.0 || SQUARED.contains(of)) {
            true => Ok(()),
            false => {
                let source = StepFailure::Unrepresentable { force, displacement };
                Err(RunError::Step { step: last.record.step, time: last.state.time, source })
            }
        }
    }

    /// Accepts the step of the last solve, at `time`.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn accept(&mut self, time: f64) -> Result<(), PetscError> {
        let (problem, comm) = (self.problem, self.problem.body.comm());
        let mut c = self.c.read(<[f64]>::to_vec)?;
        self.next.reference.translate(&problem.constraints, &mut c, 1.0);
        stage("extrapolation", || self.extrapolation.accept(comm, time, c));
        self.accepted = self.next.clone();
        Ok(())
    }

    /// The state for a checkpoint.
    pub(super) fn state(&mut self) -> ContactState {
        let (accepted, extrapolation) = (self.accepted.clone(), self.extrapolation.clone());
        ContactState { accepted, extrapolation, factor: self.elastic.factor().state() }
    }

    /// Goes back to the state of a checkpoint.
    pub(super) fn set_state(&mut self, state: ContactState) {
        let ContactState { accepted, extrapolation, factor } = state;
        (self.accepted, self.extrapolation) = (accepted, extrapolation);
        self.elastic.factor().set_state(factor);
    }

    /// The first attempt by a solver: sets c, the reference and the warm start, all from the accepted steps. If the active
    /// bounds do not support the body, the load drives it as a rigid body until contact, and the reference follows.
    fn first_attempt(&mut self, solver: usize, case: &LoadCase) -> Result<Attempt, PetscError> {
        let (problem, comm) = (self.problem, self.problem.body.comm());
        let constraints = &problem.constraints;
        let mut next = self.accepted.clone();
        let unloaded =
            comm.all(case.load.iter().chain(&case.c_prescribed).all(|&value| value == 0.0));
        if unloaded {
            next.reference = Reference::default();
        }
        if solver > 0 {
            // It cannot use the warm start of another solver.
            next.warm_start.clear();
        }
        stage("extrapolation", || {
            let predicted = self.extrapolation.at(case.time);
            let mut c = predicted.unwrap_or_else(|| vec![0.0; self.c.owned()]);
            next.reference.translate(constraints, &mut c, -1.0);
            self.c.set(&c)
        })?;
        if !unloaded && !contact::unconstrained_motions(comm, &self.rigid, &next.active).is_empty()
        {
            let (motions, mut active) = ((&self.rigid, &case.work), next.active.clone());
            let (bounds, c) = self.at_bounds(&next.reference, case)?;
            let amplitudes =
                contact::rigid_motion_until_contact(comm, motions, &bounds, &c, &mut active, false);
            self.move_rigidly(&mut next.reference, &amplitudes);
        }
        Ok(Attempt::first(solver, problem.tolerance, next))
    }

    /// The bounds, measured from a reference, and c there.
    fn at_bounds(
        &self,
        reference: &Reference,
        case: &LoadCase,
    ) -> Result<(Vec<Bound>, Vec<f64>), PetscError> {
        let (_, bounds) = reference.prescribed_and_bounds(&self.problem.constraints, case);
        let c = self.c.read(|c| bounds.iter().map(|b| c[b.dof]).collect())?;
        Ok((bounds, c))
    }

    /// Adds the motions that contact alone constrains, with these amplitudes, to a reference.
    fn move_rigidly(&self, reference: &mut Reference, amplitudes: &DVector<f64>) {
        let DiscreteProblem { motions, body, constraints, .. } = &**self.problem;
        reference.add(constraints, &motions.combined(body, amplitudes).field(body));
    }
}

/// The share of the strain energy that prescribed displacements and gaps cause, from the works of the `loads` and of the
/// `reactions` in the present state, N m per metre of thickness.
///
/// u = u_f + u_D, by the loads f and by the prescribed values, which do not work on each other's displacements:
/// fᵀu = ‖u_f‖² + fᵀu_D, ‖u‖² = ‖u_f‖² + ‖u_D‖² = fᵀu + rᵀu. If fᵀu_D = 0, the share ‖u_D‖²/‖u‖² is rᵀu/‖u‖². If one of the
/// works is negative, as when supports move a loaded body rigidly, or if the reactions work only by the `tolerance` of the solve,
/// the share is 0: errors of ζ grow most then.
fn prescribed_share(loads: f64, reactions: f64, tolerance: f64) -> f64 {
    let share = reactions / (loads + reactions);
    if loads >= 0.0 && share > Accuracy::promised(tolerance) { share.min(1.0) } else { 0.0 }
}
