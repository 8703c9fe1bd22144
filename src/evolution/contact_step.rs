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
//! The way of one step: [`ContactStep::solve`] lets the chosen solver try, then perhaps the rescuer (`rescue`). A try
//! starts from the extrapolated accepted steps (`start`), solves (`minimisation`), has the answer certified
//! (`certificate`), and repeats from a moved reference or to a smaller tolerance where rounding is the reason
//! (`attempts`). Of many answers it returns the one of least displacement (`one_of_many`).

mod accuracy;
mod attempts;
mod certificate;
mod reference;
mod minimisation;
mod one_of_many;
mod rescue;

pub use accuracy::Accuracy;
use certificate::active_bounds;

use super::{
    Choices, DiscreteProblem, LoadCase, RunError, State, Step, StepFailure, StepRecord, agreed,
    extrapolation::Extrapolation,
};
use crate::{
    contact::{self, Bound, Scales, SharedSolver},
    fem::Stiffness,
    linear::{FactorState, LinearSolver, Precision},
    petsc::{PetscError, Session, Vector, stage},
    problem::SHOWN_AS_ZERO,
};
use certificate::Candidate;
use minimisation::displacement;
use nalgebra::{DMatrix, DVector};
use reference::Reference;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Solves the contact problems of a run, one after the other.
pub struct ContactStep<'a> {
    session: &'a Session,
    problem: &'a DiscreteProblem,
    solver: SharedSolver,
    /// The solver for steps in which `solver` stops short of the tolerance.
    rescuer: Option<SharedSolver>,
    /// Solves the linear systems of both solvers.
    elastic: LinearSolver,
    stiffness: Stiffness,
    /// η_*(ζ) at the quadrature points, with which K was assembled.
    zeta_at_points: Vec<f64>,
    /// The load of the free unknowns, and these unknowns c.
    load: Vector,
    c: Vector,
    /// The memory from which every solve starts, and its update in case the step is accepted.
    accepted: AcceptedState,
    next: AcceptedState,
    /// c of the accepted steps.
    extrapolation: Extrapolation,
    /// Does every rank know all triangles around its own nodes?
    covered: bool,
    /// u·ν at the bounds, one column per rigid motion that only contact constrains.
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

impl<'a> ContactStep<'a> {
    /// The contact step with the contact solver of `choices`.
    ///
    /// # Errors
    /// There is no solver of that name, or PETSc failed.
    pub fn new(
        session: &'a Session,
        problem: &'a DiscreteProblem,
        choices: &Choices,
    ) -> Result<Self, RunError> {
        let (body, constraints) = (&problem.body, &problem.constraints);
        let (comm, unknowns) = (body.nodes.partition.comm(), 2 * body.nodes.partition.owned());
        let stiffness = stage("stiffness pattern", || {
            Stiffness::new(session, body, &problem.elasticity, &constraints.bases)
        })?;
        let options = &problem.scene().contact;
        let bounded = comm.any(!constraints.bounds.is_empty());
        let (solver, rescuer) = contact::solvers(&choices.solver, bounded, options)?;
        // A preconditioner needs only single precision, which halves the bytes to read.
        let precision = Precision::Preconditioner;
        let memory = AcceptedState {
            reference: Reference::default(),
            scales: Scales { force: MIN_LOAD * problem.largest_load, displacement: 0.0 },
            forces: 0.0,
            active: vec![0.0; constraints.bounds.len()],
            warm_start: Vec::new(),
        };
        Ok(Self {
            session,
            problem,
            solver,
            rescuer,
            elastic: LinearSolver::new(session, contact::ELASTIC, unknowns, precision)?,
            stiffness,
            zeta_at_points: body.at_points(&vec![1.0; body.mesh.nodes.len()]),
            load: Vector::zeros(session, unknowns)?,
            c: Vector::zeros(session, unknowns)?,
            next: memory.clone(),
            accepted: memory,
            extrapolation: Extrapolation::default(),
            covered: comm.all(body.is_covered()),
            rigid: problem.motions.normal_at(body, &constraints.bounds),
        })
    }

    /// Sets the solver's warm start, in its own form. Active set: 1 per bound guessed to be active, else 0.
    pub fn set_warm_start(&mut self, warm_start: &[f64]) {
        self.accepted.warm_start = warm_start.to_vec();
    }

    /// u_n at `time` for the nodal damage `zeta`, by the current solver. Every solve starts from the accepted steps, and from
    /// their warm start if it `is_warm`. A rejected step leaves K and the factor of K alone behind. The next solve
    /// replaces K; another factor changes answers within the tolerance, and the iterations of a method.
    fn solve_by_one(
        &mut self,
        step: usize,
        time: f64,
        zeta: &[f64],
        is_warm: bool,
    ) -> Result<Step, RunError> {
        let started = Instant::now();
        let problem = self.problem;
        let (comm, zeta_at_points) =
            (problem.body.nodes.partition.comm(), problem.zeta_at_points(zeta));
        if comm.any(zeta_at_points != self.zeta_at_points) {
            stage("stiffness", || {
                self.stiffness.set_damage(&problem.body, &zeta_at_points);
            });
            self.zeta_at_points = zeta_at_points;
        }
        let case = agreed(comm, stage("loads", || problem.load_case(time)))?;
        self.start(&case)?;
        if !is_warm {
            self.next.warm_start.clear();
        }
        let (candidate, report) = self.solve_certified(step, &case)?;
        let Candidate { u, kkt, scales, force, unbalanced, mut contact, .. } = candidate;
        self.next.scales = scales;
        let forces = self.accepted.forces.max(candidate.forces);
        self.next.forces = forces;
        // Contact without force is rounding.
        let rounding = candidate.rounding.max(SHOWN_AS_ZERO * forces);
        for point in contact.iter_mut().filter(|point| point.force <= rounding) {
            (point.active, point.pressure) = (false, 0.0);
        }
        let limit = problem.tolerance * scales.force;
        self.next.active = active_bounds(&problem.constraints, &contact, limit);
        let unconstrained = self.unconstrained_motion(&contact, force);
        let u = self.next.reference.total(u);
        let state = State { time, u, zeta: zeta.to_vec(), contact };
        let (observation, figures) =
            stage("figures", || problem.observe(&state, &case.load, &unbalanced, rounding))?;
        let mut record = StepRecord::new(problem, step, &state, &observation, &report, &kkt);
        record.seconds = started.elapsed().as_secs_f64();
        if !(0.0..=MAX_DISPLACEMENT).contains(&record.displacement_max) {
            let source = StepFailure::TooLarge(record.displacement_max);
            return Err(RunError::Step { step, time, source });
        }
        Ok(Step {
            strains: observation.strained.strains,
            state,
            record,
            figures,
            governing: Vec::new(),
            forces,
            report,
            unconstrained,
            skipped_damage_solve: false,
        })
    }

    /// Accepts the step of the last solve, at `time`.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn accept(&mut self, time: f64) -> Result<(), PetscError> {
        let (problem, comm) = (self.problem, self.problem.body.nodes.partition.comm());
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

    /// Starts from the accepted steps: sets c, the reference and the solver's warm start. If the active bounds do
    /// not support the body, the load drives it as a rigid body until contact, and the reference follows.
    fn start(&mut self, case: &LoadCase) -> Result<(), PetscError> {
        let (problem, comm) = (self.problem, self.problem.body.nodes.partition.comm());
        let constraints = &problem.constraints;
        self.next = self.accepted.clone();
        let AcceptedState { reference, active, .. } = &mut self.next;
        let unloaded =
            comm.all(case.load.iter().chain(&case.c_prescribed).all(|&value| value == 0.0));
        if unloaded {
            *reference = Reference::default();
        }
        stage("extrapolation", || {
            let predicted = self.extrapolation.at(case.time);
            let mut c = predicted.unwrap_or_else(|| vec![0.0; self.c.owned()]);
            reference.translate(constraints, &mut c, -1.0);
            self.c.set(&c)
        })?;
        if !unloaded && !contact::unconstrained_motions(comm, &self.rigid, active).is_empty() {
            let (motions, mut active) = ((&self.rigid, &case.work), active.clone());
            let (bounds, c) = self.at_bounds(case)?;
            let amplitudes =
                contact::rigid_motion_until_contact(comm, motions, &bounds, &c, &mut active, false);
            self.move_rigidly(&amplitudes);
        }
        Ok(())
    }

    /// The bounds, measured from the reference, and c there.
    fn at_bounds(&self, case: &LoadCase) -> Result<(Vec<Bound>, Vec<f64>), PetscError> {
        let (_, bounds) =
            self.next.reference.prescribed_and_bounds(&self.problem.constraints, case);
        let c = self.c.read(|c| bounds.iter().map(|b| c[b.dof]).collect())?;
        Ok((bounds, c))
    }

    /// Adds the motions that contact alone constrains, with these amplitudes, to the reference.
    fn move_rigidly(&mut self, amplitudes: &DVector<f64>) {
        let DiscreteProblem { motions, body, constraints, .. } = self.problem;
        self.next.reference.add(constraints, &motions.combined(body, amplitudes).field(body));
    }
}
