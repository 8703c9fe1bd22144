//! The contact step (26): from ζ_n and f_n to a certified u_n.

mod accuracy;
mod certificate;

use super::{Phases, RunError, Setting, State, Step, agreed, extrapolation::Extrapolation};
use crate::{
    contact::{self, ContactError, ContactProblem, ContactReport, ContactSolver},
    fem::Stiffness,
    petsc::{PetscError, Session, Vector},
};
use nalgebra::{DMatrix, DVector};
use std::time::Instant;

/// Solves the contact problems of a run, one after the other.
pub struct Equilibrium<'a> {
    session: &'a Session,
    setting: &'a Setting,
    phases: &'a Phases,
    solver: Box<dyn ContactSolver + 'a>,
    stiffness: Stiffness,
    /// The triangle means of η_*(ζ) that K was filled with.
    zeta_mean: Vec<f64>,
    load: Vector,
    c: Vector,
    prescribed: Vec<bool>,
    rigid: DMatrix<f64>,
    work: DVector<f64>,
    /// c of the accepted steps, and the solver's warm start at the last.
    evolution: Extrapolation,
    warm_start: Vec<f64>,
    /// What the last solve took.
    report: ContactReport,
}

/// How often a solver is asked again, more precisely, when its answer misses the tolerance.
const ATTEMPTS: usize = 3;
/// A cosine between u and its elastic forces below this is more than rounding.
const NEGATIVE_ENERGY: f64 = -1e-10;

impl<'a> Equilibrium<'a> {
    /// With the contact solver called `solver`; an unknown name means the default.
    pub fn new(
        session: &'a Session,
        setting: &'a Setting,
        solver: &str,
        phases: &'a Phases,
    ) -> Result<Self, PetscError> {
        let (body, constraints) = (&setting.body, &setting.constraints);
        let owned = 2 * body.partition.owned();
        let stiffness = phases.time("stiffness pattern", || {
            Stiffness::new(session, body, &setting.elasticity, &constraints.frames)
        })?;
        Ok(Self {
            session,
            setting,
            phases,
            solver: contact::solver(
                session,
                solver,
                body.partition.ranks().any(!constraints.bounds.is_empty()),
                setting.scene().contact.penalty_duality,
            ),
            stiffness,
            zeta_mean: vec![1.0; body.triangles.len()],
            load: Vector::zeros(session, owned)?,
            c: Vector::zeros(session, owned)?,
            prescribed: constraints.is_prescribed(),
            rigid: setting.motions.normal_at(body, &constraints.bounds),
            work: DVector::zeros(setting.motions.resisted()),
            evolution: Extrapolation::new(body.partition.ranks(), owned),
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

    /// u_n at `time` for the nodal damage `zeta`, starting from where the last steps lead.
    ///
    /// # Errors
    /// The solver failed, or no answer of its met the KKT tolerance.
    pub fn solve(&mut self, step: usize, time: f64, zeta: &[f64]) -> Result<Step, RunError> {
        let started = Instant::now();
        let (setting, phases) = (self.setting, self.phases);
        self.fill(&setting.triangle_means(zeta))?;
        let external = phases.time("loads", || setting.loads.at(&setting.body, time));
        let lift = agreed(setting.body.partition.ranks(), setting.lift(time))?;
        setting.check_load(time, &external)?;
        let force_scale = self.set_load(&external, &lift)?;

        phases.time("extrapolation", || self.c.set(&self.evolution.at(time)))?;
        let mut total = ContactReport::default();
        let mut tolerance = setting.tolerance;
        let failed = |source| RunError::Contact { step, time, source };
        let mut attempts = 0;
        loop {
            attempts += 1;
            let report = self.solve_contact(force_scale, tolerance).map_err(failed)?;
            total.iterations += report.iterations;
            total.linear_iterations += report.linear_iterations;
            total.factorisations += report.factorisations;
            total.fallbacks += report.fallbacks;
            total.contraction = report.contraction;
            total.omega = report.omega;
            total.false_claims += report.false_claims;
            self.report = total;
            let u = self.displacement(&lift)?;
            let (kkt, energy, contact) =
                phases.time("certificate", || self.certify(&u, &external, force_scale));
            // Then a KKT point need not be a minimum, and which solver would notice is chance.
            if energy < NEGATIVE_ENERGY {
                return Err(failed(ContactError::NotDefinite { method: self.solver.name() }));
            }
            if kkt.within(setting.tolerance) {
                let state = State {
                    time,
                    u,
                    zeta: zeta.to_vec(),
                    zeta_mean: self.zeta_mean.clone(),
                    contact,
                };
                let mut record = phases.time("figures", || {
                    certificate::figures(setting, step, &state, &external, &total, &kkt)
                });
                record.seconds = started.elapsed().as_secs_f64();
                let unheld = self.unheld(&state.contact, force_scale);
                return Ok(Step { state, record, unheld });
            }
            if attempts == ATTEMPTS || kkt.worst().is_nan() {
                return Err(failed(ContactError::NotCertified {
                    method: self.solver.name(),
                    tolerance: setting.tolerance,
                    residuals: kkt,
                }));
            }
            tolerance *= 0.3 * setting.tolerance / kkt.worst();
        }
    }

    /// Fills K for the triangle means of η_*(ζ).
    fn fill(&mut self, zeta_mean: &[f64]) -> Result<(), PetscError> {
        if self.setting.body.partition.ranks().any(zeta_mean != self.zeta_mean) {
            let bytes = self.stiffness.refill_traffic();
            self.phases
                .time_moving("stiffness refill", bytes, || self.stiffness.refill(zeta_mean))?;
            self.zeta_mean = zeta_mean.to_vec();
        }
        Ok(())
    }

    /// The last solve, at `time`, belongs to an accepted step.
    pub fn accept(&mut self, time: f64) -> Result<(), PetscError> {
        let c = self.c.read(<[f64]>::to_vec)?;
        self.phases.time("extrapolation", || self.evolution.accept(time, c));
        self.warm_start = self.solver.warm_start();
        Ok(())
    }

    /// The solves since the last accepted step have not happened.
    pub fn undo(&mut self) -> Result<(), PetscError> {
        self.c.set(self.evolution.last())?;
        self.solver.set_warm_start(&self.warm_start);
        Ok(())
    }

    /// Sets the load of the free unknowns, f − K u_D, and returns the size of forces.
    fn set_load(&mut self, external: &[f64], lift: &[f64]) -> Result<f64, PetscError> {
        let setting = self.setting;
        let (body, frames) = (&setting.body, &setting.constraints.frames);
        let mut load = external.to_vec();
        let mut scale = body.partition.norm(&load, 2);
        if body.partition.ranks().any(lift.iter().any(|&v| v != 0.0)) {
            let mut u = lift.to_vec();
            frames.displacement_from_frame(&mut u);
            let internal = setting.elasticity.internal_force(body, &self.zeta_mean, &u);
            load.iter_mut().zip(&internal).for_each(|(f, r)| *f -= r);
            scale = body.partition.norm(&load, 2);
        }
        frames.force_to_frame(&mut load);
        load.iter_mut()
            .zip(frames.fixed())
            .for_each(|(f, fixed)| *f = if *fixed { 0.0 } else { *f });
        self.load.set(&load[..self.load.owned()])?;
        // Prescribed displacements do no work on motions that they hold.
        self.work = setting.motions.work(body, external);
        Ok(scale)
    }

    fn solve_contact(
        &mut self,
        force_scale: f64,
        tolerance: f64,
    ) -> Result<ContactReport, ContactError> {
        let setting = self.setting;
        let ranks = setting.body.partition.ranks();
        if ranks.all(self.load.read(|f| f.iter().all(|&f| f == 0.0))?) {
            // Nothing pushes and no gap is negative: the body rests.
            self.c.write(|c| c.fill(0.0))?;
            return Ok(ContactReport::default());
        }
        let problem = ContactProblem {
            stiffness: &self.stiffness.matrix,
            stiffness_scale: self.stiffness.scale,
            load: &self.load,
            bounds: &setting.constraints.bounds,
            rigid: &self.rigid,
            work: &self.work,
            force_scale,
            tolerance,
            ranks,
            phases: self.phases,
        };
        self.phases.time("contact", || self.solver.solve(&problem, &mut self.c))
    }

    /// u from the unknowns c and the prescribed ones, without free rigid motions.
    fn displacement(&self, lift: &[f64]) -> Result<Vec<f64>, PetscError> {
        let setting = self.setting;
        let mut u = lift.to_vec();
        self.c.read(|c| u.iter_mut().zip(c).for_each(|(u, c)| *u += c))?;
        setting.constraints.frames.displacement_from_frame(&mut u);
        setting.body.partition.update(&mut u, 2)?;
        setting.motions.remove_free(&setting.body, &mut u);
        Ok(u)
    }
}
