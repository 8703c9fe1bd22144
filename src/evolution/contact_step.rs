//! The contact step (26), from ζ_n and f_n to a certified u_n:
//!
//! u_n minimises ½ uᵀK(ζ_n)u − f_nᵀu over u·ν ≤ g on Γ_C and u = u_D on Γ_D.
//!
//! The unknowns are c, the displacements in the nodal bases, where every condition concerns one
//! unknown, measured from a rigid [`Datum`].

mod accuracy;
mod certificate;
mod datum;
mod rescue;

pub use accuracy::Accuracy;

use super::{
    DiscreteProblem, Phases, RunError, State, Step, StepRecord, agreed, discrete_problem::LoadCase,
    extrapolation::Extrapolation,
};
use crate::{
    contact::{self, Bound, ContactError, ContactProblem, ContactReport, ContactSolver, Scales},
    fem::Stiffness,
    petsc::{PetscError, Session, Vector},
};
use certificate::Judged;
use datum::Datum;
use nalgebra::DMatrix;
use std::time::Instant;

/// Solves the contact problems of a run, one after the other.
pub struct ContactStep<'a> {
    session: &'a Session,
    problem: &'a DiscreteProblem,
    phases: &'a Phases,
    solver: Box<dyn ContactSolver + 'a>,
    /// Who is asked where the solver stops short.
    rescuer: Option<Box<dyn ContactSolver + 'a>>,
    stiffness: Stiffness,
    /// The triangle means of η_*(ζ) that K was filled with.
    zeta_mean: Vec<f64>,
    /// The load of the free unknowns, and these.
    load: Vector,
    c: Vector,
    /// What every solve starts from, and what the last solve will leave if its step is accepted.
    accepted: Memory,
    next: Memory,
    /// c of the accepted steps.
    extrapolation: Extrapolation,
    /// Whether this rank knows all triangles around its nodes.
    covered: bool,
    /// u·ν at the bounds of the rigid motions that only contact constrains, a column each.
    rigid: DMatrix<f64>,
}

/// What a step leaves to the next one.
#[derive(Debug, Clone)]
struct Memory {
    /// Where displacements are measured from.
    datum: Datum,
    /// The largest scales of residuals so far.
    scales: Scales,
    /// Of each bound 1 if it is active, else 0.
    active: Vec<f64>,
    /// The solver's warm start.
    warm_start: Vec<f64>,
}

/// How often a solver is asked for one answer, more precisely or from another datum.
const ATTEMPTS: usize = 3;
/// An answer is mostly rigid if its rigid part is so many times the rest.
const DOMINANT: f64 = 10.0;
/// … and so far from a datum that was chosen before that even a certified answer is measured anew.
const FAR: f64 = 1e3;
/// A force scale below this part of the forces that prescribed displacements cause is rounding.
const LIFTED: f64 = 1e-2;
/// Loads below this part of the largest of the run count as so much, or an answer to rounding
/// (sin(pi) = 1.2e-16) would have to have as many digits as any other.
const LEAST_LOAD: f64 = 1e-6;

impl<'a> ContactStep<'a> {
    /// With the contact solver called `solver`.
    ///
    /// # Errors
    /// There is no solver of that name, or PETSc failed.
    pub fn new(
        session: &'a Session,
        problem: &'a DiscreteProblem,
        solver: &str,
        phases: &'a Phases,
    ) -> Result<Self, RunError> {
        let (body, constraints) = (&problem.body, &problem.constraints);
        let (comm, unknowns) = (body.partition.comm(), 2 * body.partition.owned());
        let stiffness = phases.time("stiffness pattern", || {
            Stiffness::new(session, body, &problem.elasticity, &constraints.bases)
        })?;
        let options = &problem.scene().contact;
        let bounded = comm.any(!constraints.bounds.is_empty());
        let (solver, rescuer) = contact::solvers(session, solver, bounded, options)?;
        let memory = Memory {
            datum: Datum::default(),
            scales: Scales { force: LEAST_LOAD * problem.largest_load, displacement: 0.0 },
            active: vec![0.0; constraints.bounds.len()],
            warm_start: Vec::new(),
        };
        Ok(Self {
            session,
            problem,
            phases,
            solver,
            rescuer,
            stiffness,
            zeta_mean: vec![1.0; body.triangles.len()],
            load: Vector::zeros(session, unknowns)?,
            c: Vector::zeros(session, unknowns)?,
            next: memory.clone(),
            accepted: memory,
            extrapolation: Extrapolation::default(),
            covered: comm.all(body.is_covered()),
            rigid: problem.motions.normal_at(body, &constraints.bounds),
        })
    }

    /// Gives the solver a warm start as its own `warm_start` would: for the active set a 1
    /// for each bound that is guessed to be active, else 0.
    pub fn set_warm_start(&mut self, warm_start: &[f64]) {
        self.accepted.warm_start = warm_start.to_vec();
    }

    /// u_n at `time` for the nodal damage `zeta`, by the present solver. Every solve starts from the
    /// accepted steps, whatever was solved since the last of them.
    fn solve_by_one(&mut self, step: usize, time: f64, zeta: &[f64]) -> Result<Step, RunError> {
        let started = Instant::now();
        let (problem, phases) = (self.problem, self.phases);
        let (comm, zeta_mean) = (problem.body.partition.comm(), problem.triangle_means(zeta));
        if comm.any(zeta_mean != self.zeta_mean) {
            let bytes = self.stiffness.refill_traffic();
            phases.time_moving("stiffness refill", bytes, || self.stiffness.refill(&zeta_mean))?;
            self.zeta_mean = zeta_mean;
        }
        let case = agreed(comm, phases.time("loads", || problem.load_case(time)))?;
        self.start(&case)?;
        let (Judged { u, kkt, scales, force, contact, .. }, report) =
            self.solve_certified(step, &case)?;
        self.next.scales = scales;
        self.next.active = self.active_bounds(&contact, 0.0);
        let unconstrained = self.unconstrained_motion(&contact, force);
        let u = self.next.datum.total(u);
        let state = State { time, u, zeta: zeta.to_vec(), contact };
        let mut record = phases.time("step record", || {
            StepRecord::new(problem, step, &state, &case.load, &report, &kkt)
        });
        record.seconds = started.elapsed().as_secs_f64();
        Ok(Step { state, record, report, unconstrained, skipped_damage_solve: false })
    }

    /// The last solve, at `time`, belongs to an accepted step.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn accept(&mut self, time: f64) -> Result<(), PetscError> {
        let c = self.c.read(<[f64]>::to_vec)?;
        let c = self.next.datum.shifted(self.problem, c, 1.0);
        let comm = self.problem.body.partition.comm();
        self.phases.time("extrapolation", || self.extrapolation.accept(comm, time, c));
        self.next.warm_start = self.solver.warm_start();
        self.accepted = self.next.clone();
        Ok(())
    }

    /// Starts from the accepted steps: sets c, the datum and the solver's warm start.
    fn start(&mut self, case: &LoadCase) -> Result<(), PetscError> {
        let problem = self.problem;
        self.next = self.accepted.clone();
        self.solver.set_warm_start(&self.next.warm_start);
        let zero = case.load.iter().chain(&case.lift).all(|&value| value == 0.0);
        let unloaded = problem.body.partition.comm().all(zero);
        if unloaded {
            self.next.datum = Datum::default();
        }
        self.phases.time("extrapolation", || {
            let predicted = self.extrapolation.at(case.time);
            let c = predicted.unwrap_or_else(|| vec![0.0; self.c.owned()]);
            self.c.set(&self.next.datum.shifted(problem, c, -1.0))
        })?;
        if unloaded { Ok(()) } else { self.approach(case) }
    }

    /// Where the active bounds do not support the body, moves the datum, and c with it, to where the
    /// load drives the body as a rigid one.
    fn approach(&mut self, case: &LoadCase) -> Result<(), PetscError> {
        let problem = self.problem;
        let (body, comm) = (&problem.body, problem.body.partition.comm());
        if contact::unconstrained_motions(comm, &self.rigid, &self.next.active).is_empty() {
            return Ok(());
        }
        let (_, bounds) = self.next.datum.pose(problem, case);
        let motions = (&self.rigid, &case.work);
        let mut active = self.next.active.clone();
        let (amplitudes, _) = self.c.read(|c| {
            contact::rigid_motion_until_contact(comm, motions, &bounds, c, &mut active, false)
        })?;
        self.next.datum.add(problem, &problem.motions.displacement(body, &amplitudes));
        Ok(())
    }

    /// Solves until the certificate accepts the answer: more precisely, or from another datum, where
    /// it does not. What the solver thinks of an answer does not matter then.
    fn solve_certified(
        &mut self,
        step: usize,
        case: &LoadCase,
    ) -> Result<(Judged, ContactReport), RunError> {
        let problem = self.problem;
        let failed = |source| RunError::contact(problem, step, case.time, source);
        let mut report = ContactReport::default();
        let mut tolerance = problem.tolerance;
        let mut attempt = 1;
        loop {
            let (lift, bounds) = self.next.datum.pose(problem, case);
            let force = self.set_load(&case.load, &lift)?;
            let solved = match self.solve_contact(case, &bounds, force, tolerance) {
                // All ranks know that the method stopped short; other errors may be one rank's.
                Err(error) if !error.stopped_short() => return Err(failed(error)),
                solved => solved,
            };
            let u = displacement(problem, lift, &self.c)?;
            let judged = self.phases.time("certificate", || self.certify(u, case));
            let certified = judged.kkt.within(problem.tolerance);
            let far = !self.next.datum.is_zero() && judged.rigid_max > FAR * judged.elastic_max;
            if (far || !certified) && attempt < ATTEMPTS && self.move_datum(&judged)? {
                attempt += 1;
                continue;
            }
            match solved {
                Ok(solved) => report.add(&solved),
                Err(error) if !certified => return Err(failed(self.limited(error, &judged))),
                Err(_) => {}
            }
            let method = self.solver.name();
            // Then a KKT point need not be a minimum, and which solver would notice is chance.
            if judged.is_indefinite() {
                return Err(failed(ContactError::NotDefinite { method }));
            }
            if certified {
                return Ok((judged, report));
            }
            if attempt == ATTEMPTS || judged.kkt.worst().is_nan() {
                let (tolerance, residuals) = (problem.tolerance, judged.kkt);
                let error = ContactError::NotCertified { method, tolerance, residuals };
                return Err(failed(self.limited(error, &judged)));
            }
            tolerance *= 0.3 * problem.tolerance / judged.kkt.worst();
            attempt += 1;
        }
    }

    /// Moves the datum by the rigid part of an answer, if the answer is mostly that.
    fn move_datum(&mut self, judged: &Judged) -> Result<bool, PetscError> {
        if judged.rigid_max <= DOMINANT * judged.elastic_max {
            return Ok(false);
        }
        let c = self.c.read(<[f64]>::to_vec)?;
        let c = self.next.datum.shifted(self.problem, c, 1.0);
        let nodes = &self.problem.body.mesh.nodes;
        let motion: Vec<f64> = nodes.iter().flat_map(|&x| judged.rigid.at(x)).collect();
        self.next.datum.add(self.problem, &motion);
        self.c.set(&self.next.datum.shifted(self.problem, c, -1.0))?;
        Ok(true)
    }

    /// Sets the load of the free unknowns, f − K u_D, and returns the scale of forces.
    fn set_load(&mut self, external: &[f64], lift: &[f64]) -> Result<f64, PetscError> {
        let problem = self.problem;
        let (body, bases) = (&problem.body, &problem.constraints.bases);
        let mut load = external.to_vec();
        let mut scale = body.partition.norm(&load, 2);
        if body.partition.comm().any(lift.iter().any(|&v| v != 0.0)) {
            let mut u = lift.to_vec();
            bases.displacement_to_global(&mut u);
            let internal = problem.elasticity.internal_force(body, &self.zeta_mean, &u);
            load.iter_mut().zip(&internal).for_each(|(f, r)| *f -= r);
            scale = scale.max(LIFTED * body.partition.norm(&load, 2));
        }
        bases.force_to_local(&mut load);
        bases.zero_fixed(&mut load);
        self.load.set(&load[..self.load.owned()])?;
        Ok(scale)
    }

    /// Replaces c by the solution of (26); forces of `force` N per metre of thickness count as 1.
    fn solve_contact(
        &mut self,
        case: &LoadCase,
        bounds: &[Bound],
        force: f64,
        tolerance: f64,
    ) -> Result<ContactReport, ContactError> {
        let comm = self.problem.body.partition.comm();
        let admits_zero = |bound: &Bound| bound.nearest(0.0) == 0.0;
        let unloaded = self.load.read(|f| f.iter().all(|&f| f == 0.0))?;
        if comm.all(unloaded && bounds.iter().all(admits_zero)) {
            self.c.write(|c| c.fill(0.0))?;
            return Ok(ContactReport::default());
        }
        let contact = ContactProblem {
            stiffness: &self.stiffness.matrix,
            stiffness_scale: self.stiffness.scale,
            load: &self.load,
            bounds,
            rigid: &self.rigid,
            work: &case.work,
            scales: self.run_scales(Scales { force, displacement: 0.0 }),
            tolerance,
            comm,
            phases: self.phases,
        };
        self.phases.time("contact", || self.solver.solve(&contact, &mut self.c))
    }
}

/// u from the unknowns c and the prescribed ones, `lift`, without free rigid motions. Collective.
fn displacement(
    problem: &DiscreteProblem,
    lift: Vec<f64>,
    c: &Vector,
) -> Result<Vec<f64>, PetscError> {
    let mut u = lift;
    c.read(|c| u.iter_mut().zip(c).for_each(|(u, c)| *u += c))?;
    problem.constraints.bases.displacement_to_global(&mut u);
    problem.body.partition.update(&mut u, 2)?;
    problem.motions.remove_free(&problem.body, &mut u);
    Ok(u)
}
