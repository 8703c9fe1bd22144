//! The contact step (26): from ζ_n and f_n to a certified u_n.

mod accuracy;
mod certificate;
mod datum;

use super::{DiscreteProblem, Phases, RunError, State, Step, agreed, extrapolation::Extrapolation};
use crate::{
    contact::{
        self, Bound, ContactError, ContactProblem, ContactReport, ContactSolver, ProblemClass,
        Scales,
    },
    fem::Stiffness,
    petsc::{PetscError, Session, Vector},
};
use certificate::Judged;
use datum::Datum;
use nalgebra::{DMatrix, DVector};
use std::time::Instant;

/// Solves the contact problems of a run, one after the other.
pub struct ContactStep<'a> {
    session: &'a Session,
    problem: &'a DiscreteProblem,
    phases: &'a Phases,
    solver: Box<dyn ContactSolver + 'a>,
    /// Who is asked where that one stops short.
    rescuer: Option<Box<dyn ContactSolver + 'a>>,
    stiffness: Stiffness,
    /// The triangle means of η_*(ζ) that K was filled with.
    zeta_mean: Vec<f64>,
    load: Vector,
    c: Vector,
    /// Where c is measured from, now and at the last accepted step.
    datum: Datum,
    accepted_datum: Datum,
    /// The scales of the accepted steps, and with the last solve.
    scales: Scales,
    next_scales: Scales,
    /// The bounds active at the last accepted step, and after the last solve.
    active: Vec<bool>,
    next_active: Vec<bool>,
    /// Whether this rank knows all triangles around its nodes.
    covered: bool,
    rigid: DMatrix<f64>,
    work: DVector<f64>,
    /// c of the accepted steps, and the solver's warm start at the last.
    evolution: Extrapolation,
    warm_start: Vec<f64>,
    /// What the last solve took.
    report: ContactReport,
}

/// The rigid part of an answer is worth removing if it is so many times the rest.
const DOMINANT: f64 = 10.0;
/// … and from a datum that has been left behind, u is measured anew from so many times on.
const FAR: f64 = 1e3;
/// A deformation below this part of the way that a body is carried is rounding.
const CARRIED: f64 = 1e-14;
/// How often displacements may be measured from another datum for one answer.
const FOLLOWED: usize = 3;
/// A force limit below this part of the forces that prescribed displacements cause is rounding.
const LIFTED: f64 = 1e-2;
/// Loads below this part of the largest of the run count as so much, or an answer to rounding
/// (sin(pi) = 1.2e-16) would have to have as many digits as any other.
const LEAST_LOAD: f64 = 1e-6;
/// Residuals are refused by rounding if they are no more than this many times its estimate.
const ROUNDED: f64 = 10.0;
/// How often a solver is asked again, more precisely, when its answer misses the tolerance.
const ATTEMPTS: usize = 3;
/// A cosine between u and its elastic forces below this is more than rounding.
const NEGATIVE_ENERGY: f64 = -1e-10;

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
        let owned = 2 * body.partition.owned();
        let stiffness = phases.time("stiffness pattern", || {
            Stiffness::new(session, body, &problem.elasticity, &constraints.bases)
        })?;
        let options = &problem.scene().contact;
        let bounded = body.partition.comm().any(!constraints.bounds.is_empty());
        let class = match (bounded, problem.motions.resisted()) {
            (false, _) => ProblemClass::Linear,
            (true, 0) => ProblemClass::Definite,
            (true, _) => ProblemClass::Semidefinite,
        };
        Ok(Self {
            session,
            problem,
            phases,
            solver: contact::solver(session, solver, class, options)?,
            rescuer: contact::rescuer(session, solver, class, options)?,
            stiffness,
            zeta_mean: vec![1.0; body.triangles.len()],
            load: Vector::zeros(session, owned)?,
            c: Vector::zeros(session, owned)?,
            datum: Datum::default(),
            accepted_datum: Datum::default(),
            scales: Scales { force: LEAST_LOAD * problem.largest_load, displacement: 0.0 },
            next_scales: Scales { force: 0.0, displacement: 0.0 },
            active: vec![false; constraints.bounds.len()],
            next_active: Vec::new(),
            covered: body.partition.comm().all(body.is_covered()),
            rigid: problem.motions.normal_at(body, &constraints.bounds),
            work: DVector::zeros(problem.motions.resisted()),
            evolution: Extrapolation::new(body.partition.comm(), owned),
            warm_start: Vec::new(),
            report: ContactReport::default(),
        })
    }

    /// The name of the method in use.
    pub fn method(&self) -> &'static str {
        self.solver.name()
    }

    /// Gives the solver a warm start as its own `warm_start` would: for the active set a 1
    /// for each bound that is guessed to press, else 0.
    pub fn set_warm_start(&mut self, kept: &[f64]) {
        self.solver.set_warm_start(kept);
    }

    /// What the last solve took that gave an answer.
    pub fn report(&self) -> &ContactReport {
        &self.report
    }

    /// u_n at `time` for the nodal damage `zeta`, starting from where the last steps lead. Where
    /// the solver stops short, its rescuer is asked instead, as if the solver had not been.
    ///
    /// # Errors
    /// The solver failed, or no answer of its met the KKT tolerance, nor one of its rescuer.
    pub fn solve(&mut self, step: usize, time: f64, zeta: &[f64]) -> Result<Step, RunError> {
        let comm = self.problem.body.partition.comm();
        let solved = self.solve_by_one(step, time, zeta);
        let missed = |error: &RunError| match error {
            RunError::Contact { source, .. } => source.may_be_rescued(comm),
            _ => false,
        };
        let Some(rescuer) = self.rescuer.take_if(|_| solved.as_ref().is_err_and(missed)) else {
            return solved;
        };
        let limited =
            matches!(&solved, Err(RunError::Contact { source, .. }) if source.is_limited());
        self.undo()?;
        let asked = std::mem::replace(&mut self.solver, rescuer);
        self.solver.set_warm_start(&[]);
        let rescued = self.solve_by_one(step, time, zeta);
        let rescuer = self.rescuer.insert(std::mem::replace(&mut self.solver, asked));
        // What it believed has misled it.
        self.solver.set_warm_start(&[]);
        match rescued {
            // What rounding allows is worth telling, if only the rescuer has found it.
            Err(RunError::Contact { source, .. }) if limited || !source.is_limited() => solved,
            Err(other) => Err(other),
            Ok(mut step) => {
                self.report.rescued_by = Some(rescuer.name());
                self.report.fallbacks += 1;
                step.record.fallbacks += 1;
                Ok(step)
            }
        }
    }

    /// u_n by the present solver.
    fn solve_by_one(&mut self, step: usize, time: f64, zeta: &[f64]) -> Result<Step, RunError> {
        let started = Instant::now();
        let (problem, phases) = (self.problem, self.phases);
        self.fill(&problem.triangle_means(zeta))?;
        let external = phases.time("loads", || problem.load(time));
        problem.check_load(time, &external)?;
        let external = problem.motions.balanced(&problem.body, external);
        let prescribed = problem.loads.prescribed_at(time);
        let posed = agreed(problem.body.partition.comm(), problem.posed(time))?;

        self.start(time, &external, &posed)?;
        let failed = |source| RunError::contact(problem.scene(), step, time, source);
        let mut total = ContactReport::default();
        let (mut tolerance, mut attempts) = (problem.tolerance, 0);
        loop {
            attempts += 1;
            let (lift, bounds) = self.datum.pose(problem, &posed);
            let force = self.set_load(&external, &lift)?;
            let solved = match self.solve_contact(&bounds, force, tolerance) {
                // All ranks know that the method stopped short; other errors may be one rank's.
                Err(error) if error.stopped_short() => Err(error),
                other => Ok(other.map_err(failed)?),
            };
            let u = self.displacement(&lift)?;
            let judged = phases.time("certificate", || self.certify(&u, &external, &prescribed));
            // Rounding of a long way hides a small deformation: measured from the way's end it
            // has all its digits.
            let certified = judged.kkt.within(problem.tolerance);
            let far = !self.datum.field.is_empty() && judged.sizes[0] > FAR * judged.sizes[1];
            if (far || !certified) && attempts < FOLLOWED && self.follow(&judged)? {
                continue;
            }
            match solved {
                Ok(report) => total.add(&report),
                // What a solver thinks of its answer is not asked if the certificate holds.
                Err(_) if certified => {}
                Err(error) => return Err(failed(self.limited(error, &judged, &u))),
            }
            self.report = total;
            // Then a KKT point need not be a minimum, and which solver would notice is chance.
            if judged.energy < NEGATIVE_ENERGY {
                return Err(failed(ContactError::NotDefinite { method: self.solver.name() }));
            }
            if certified {
                let Judged { kkt, scales, force, contact, .. } = judged;
                self.next_scales = scales;
                self.next_active = self.active_bounds(&contact, 0.0);
                let unheld = self.unheld(&contact, force);
                let (u, zeta_mean) = (self.datum.total(u), self.zeta_mean.clone());
                let state = State { time, u, zeta: zeta.to_vec(), zeta_mean, contact };
                let mut record = phases.time("figures", || {
                    certificate::figures(problem, step, &state, &external, &total, &kkt)
                });
                record.seconds = started.elapsed().as_secs_f64();
                return Ok(Step { state, record, unheld });
            }
            if attempts == ATTEMPTS || judged.kkt.worst().is_nan() {
                let (method, tolerance) = (self.solver.name(), problem.tolerance);
                let residuals = judged.kkt;
                let error = ContactError::NotCertified { method, tolerance, residuals };
                return Err(failed(self.limited(error, &judged, &u)));
            }
            tolerance *= 0.3 * problem.tolerance / judged.kkt.worst();
        }
    }

    /// The scales of an answer, not below those of the run so far, nor below rounding: of the way of
    /// the datum (a body that is only carried along has no other scales), and with displacements not
    /// below those that the forces cause at least.
    fn with_floors(&self, own: Scales) -> Scales {
        let way = match self.datum.field[..] {
            [] => 0.0,
            _ => CARRIED * self.problem.body.partition.largest(&self.datum.field),
        };
        let force = own.force.max(self.scales.force).max(self.stiffness.scale * way);
        let least = way.max(force / self.stiffness.scale);
        Scales { force, displacement: own.displacement.max(self.scales.displacement).max(least) }
    }

    /// Sets the start c of a solve at `time`, and where displacements are measured from.
    fn start(
        &mut self,
        time: f64,
        external: &[f64],
        posed: &(Vec<f64>, Vec<Bound>),
    ) -> Result<(), PetscError> {
        let problem = self.problem;
        let nothing = external.iter().chain(&posed.0).all(|&value| value == 0.0);
        let rests = problem.body.partition.comm().all(nothing);
        if rests {
            self.datum = Datum::default();
        }
        self.phases.time("extrapolation", || {
            self.c.set(&self.datum.relative(problem, self.evolution.at(time)))
        })?;
        if rests { Ok(()) } else { self.approach(external, posed) }
    }

    /// Fills K for the triangle means of η_*(ζ).
    fn fill(&mut self, zeta_mean: &[f64]) -> Result<(), PetscError> {
        if self.problem.body.partition.comm().any(zeta_mean != self.zeta_mean) {
            let bytes = self.stiffness.refill_traffic();
            self.phases
                .time_moving("stiffness refill", bytes, || self.stiffness.refill(zeta_mean))?;
            self.zeta_mean = zeta_mean.to_vec();
        }
        Ok(())
    }

    /// The last solve, at `time`, belongs to an accepted step.
    pub fn accept(&mut self, time: f64) -> Result<(), PetscError> {
        let c = self.datum.absolute(self.problem, self.c.read(<[f64]>::to_vec)?);
        self.accepted_datum = self.datum.clone();
        self.scales = self.next_scales;
        self.active.clone_from(&self.next_active);
        self.phases.time("extrapolation", || self.evolution.accept(time, c));
        self.warm_start = self.solver.warm_start();
        Ok(())
    }

    /// The solves since the last accepted step have not happened.
    pub fn undo(&mut self) -> Result<(), PetscError> {
        self.c.set(self.evolution.last())?;
        self.datum = self.accepted_datum.clone();
        self.solver.set_warm_start(&self.warm_start);
        Ok(())
    }

    /// Where the bounds active so far do not support the body: measures displacements from where
    /// the load drives it as a rigid one.
    fn approach(
        &mut self,
        external: &[f64],
        posed: &(Vec<f64>, Vec<Bound>),
    ) -> Result<(), PetscError> {
        let problem = self.problem;
        let (body, comm) = (&problem.body, problem.body.partition.comm());
        if contact::unconstrained_motions(comm, &self.rigid, &self.active).is_empty() {
            return Ok(());
        }
        // Prescribed displacements do no work on motions that they prevent.
        let work = problem.motions.work(body, external);
        let (_, bounds) = self.datum.pose(problem, posed);
        let motions = (&self.rigid, &work);
        let moved = self.c.read(|c| {
            let active = self.active.clone();
            contact::rigid_motion_until_contact(comm, motions, &bounds, c, active, false)
        })?;
        // The start c moves along.
        self.datum.add(problem, &problem.motions.displacement(body, &moved.amplitudes));
        Ok(())
    }

    /// Measures displacements from further on if the answer is mostly a rigid motion.
    fn follow(&mut self, judged: &Judged) -> Result<bool, PetscError> {
        let c = self.datum.absolute(self.problem, self.c.read(<[f64]>::to_vec)?);
        let [rigid, rest] = judged.sizes;
        if rigid <= DOMINANT * rest {
            return Ok(false);
        }
        let nodes = &self.problem.body.mesh.nodes;
        let motion: Vec<f64> = nodes.iter().flat_map(|&x| judged.rigid.at(x)).collect();
        self.datum.add(self.problem, &motion);
        self.c.set(&self.datum.relative(self.problem, c))?;
        Ok(true)
    }

    /// Sets the load of the free unknowns, f − K u_D, and returns the size of forces.
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
        load.iter_mut()
            .zip(bases.fixed())
            .for_each(|(f, fixed)| *f = if *fixed { 0.0 } else { *f });
        self.load.set(&load[..self.load.owned()])?;
        // Prescribed displacements do no work on motions that they hold.
        self.work = problem.motions.work(body, external);
        Ok(scale)
    }

    /// From c to the c that answers (26), where forces of size `force` count as 1.
    fn solve_contact(
        &mut self,
        bounds: &[Bound],
        force: f64,
        tolerance: f64,
    ) -> Result<ContactReport, ContactError> {
        let problem = self.problem;
        let comm = problem.body.partition.comm();
        let rests = |bound: &Bound| bound.nearest(0.0) == 0.0;
        if comm.all(self.load.read(|f| f.iter().all(|&f| f == 0.0))? && bounds.iter().all(rests)) {
            // Nothing pushes and no obstacle is in the way: the body rests.
            self.c.write(|c| c.fill(0.0))?;
            return Ok(ContactReport::default());
        }
        let contact = ContactProblem {
            stiffness: &self.stiffness.matrix,
            stiffness_scale: self.stiffness.scale,
            load: &self.load,
            bounds,
            rigid: &self.rigid,
            work: &self.work,
            scales: self.with_floors(Scales { force, displacement: 0.0 }),
            tolerance,
            comm,
            phases: self.phases,
        };
        self.phases.time("contact", || self.solver.solve(&contact, &mut self.c))
    }

    /// u from the unknowns c and the prescribed ones, without free rigid motions.
    fn displacement(&self, lift: &[f64]) -> Result<Vec<f64>, PetscError> {
        let problem = self.problem;
        let mut u = lift.to_vec();
        self.c.read(|c| u.iter_mut().zip(c).for_each(|(u, c)| *u += c))?;
        problem.constraints.bases.displacement_to_global(&mut u);
        problem.body.partition.update(&mut u, 2)?;
        problem.motions.remove_free(&problem.body, &mut u);
        Ok(u)
    }
}
