//! The contact step (26): from ζ_n and f_n to a certified u_n.

mod accuracy;

use super::{
    ContactPoint, Phases, RunError, Setting, State, Step, StepRecord, extrapolation::Extrapolation,
};
use crate::{
    contact::{self, ContactError, ContactProblem, ContactReport, ContactSolver, Kkt, RigidMotion},
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
    /// The triangle means of η_*(ζ) that K was filled with, and how often it was.
    zeta_mean: Vec<f64>,
    revision: usize,
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
                !constraints.bounds.is_empty(),
                setting.scene().contact.penalty_duality,
            ),
            stiffness,
            zeta_mean: vec![1.0; body.triangles.len()],
            revision: 0,
            load: Vector::zeros(session, owned)?,
            c: Vector::zeros(session, owned)?,
            prescribed: constraints.is_prescribed(),
            rigid: setting.motions.normal_at(body, &constraints.bounds),
            work: DVector::zeros(setting.motions.resisted()),
            evolution: Extrapolation::new(owned),
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
        let lift = setting.lift(time)?;
        setting.check_load(time, &external)?;
        let force_scale = self.set_load(&external, &lift)?;

        self.c.set(&self.evolution.at(time))?;
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
                let mut record = figures(setting, step, &state, &external, &total, &kkt);
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
        if zeta_mean != self.zeta_mean {
            let bytes = self.stiffness.refill_traffic();
            self.phases
                .time_moving("stiffness refill", bytes, || self.stiffness.refill(zeta_mean))?;
            self.revision += 1;
            self.zeta_mean = zeta_mean.to_vec();
        }
        Ok(())
    }

    /// The last solve, at `time`, belongs to an accepted step.
    pub fn accept(&mut self, time: f64) -> Result<(), PetscError> {
        self.evolution.accept(time, self.c.read(<[f64]>::to_vec)?);
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
        if lift.iter().any(|&v| v != 0.0) {
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
        if self.load.read(|f| f.iter().all(|&f| f == 0.0))? {
            // Nothing pushes and no gap is negative: the body rests.
            self.c.write(|c| c.fill(0.0))?;
            return Ok(ContactReport::default());
        }
        let problem = ContactProblem {
            stiffness: &self.stiffness.matrix,
            revision: self.revision,
            stiffness_scale: self.stiffness.scale,
            load: &self.load,
            bounds: &setting.constraints.bounds,
            rigid: &self.rigid,
            work: &self.work,
            force_scale,
            tolerance,
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
        setting.motions.remove_free(&setting.body, &mut u);
        Ok(u)
    }

    /// The KKT residuals of u by element-wise forces, the cosine between u and these forces (the
    /// sign of the energy), and the state of contact they imply. `load_size` keeps the scale of
    /// forces where a prescribed displacement carries the body along without stress.
    fn certify(
        &self,
        u: &[f64],
        external: &[f64],
        load_size: f64,
    ) -> (Kkt, f64, Vec<ContactPoint>) {
        let setting = self.setting;
        let (body, constraints) = (&setting.body, &setting.constraints);
        let internal = setting.elasticity.internal_force(body, &self.zeta_mean, u);
        let partition = &body.partition;
        let forces = partition.norm(external, 2).max(partition.norm(&internal, 2));
        let force_scale = forces.max(load_size);
        let size = largest(u);
        let energy = partition.dot(&internal, u, 2)
            / (force_scale * partition.norm(u, 2)).max(f64::MIN_POSITIVE);

        let mut residual: Vec<f64> = internal.iter().zip(external).map(|(r, f)| r - f).collect();
        let mut c = u.to_vec();
        constraints.frames.force_to_frame(&mut residual);
        constraints.frames.displacement_to_frame(&mut c);
        let bounds = &constraints.bounds;
        let kkt = Kkt::of(&residual, &c, bounds, |dof| self.prescribed[dof], force_scale, size);
        let points = bounds.iter().map(|bound| {
            let (force, gap) = (-residual[bound.dof], bound.gap - c[bound.dof]);
            let active = force * size > gap * force_scale;
            ContactPoint { node: bound.node, force, pressure: force / bound.weight, gap, active }
        });
        (kkt, energy, points.collect())
    }

    /// A rigid motion that the pressing nodes leave. A body without load rests where it is,
    /// which needs no holding.
    fn unheld(&self, contact: &[ContactPoint], force_scale: f64) -> Option<RigidMotion> {
        // A residual at the tolerance does work of up to √N times that on a motion (Cauchy and
        // Schwarz), which at the lever of one mesh width, 1/√N of the body, is a force √N times
        // as large: a smaller one holds nothing for certain.
        let nodes = self.setting.body.mesh.nodes.len() as f64;
        let least = nodes * self.setting.tolerance * force_scale;
        let pressing: Vec<bool> = contact.iter().map(|point| point.force > least).collect();
        let unheld = contact::unheld(&self.rigid, &pressing);
        let first = unheld.first().filter(|_| force_scale > 0.0)?;
        Some(self.setting.motions.combined(first))
    }
}

/// The largest nodal |u|.
fn largest(u: &[f64]) -> f64 {
    u.chunks(2).map(|u| u[0].hypot(u[1])).fold(0.0, f64::max)
}

fn figures(
    setting: &Setting,
    step: usize,
    state: &State,
    external: &[f64],
    report: &ContactReport,
    kkt: &Kkt,
) -> StepRecord {
    let mut active: Vec<usize> =
        state.contact.iter().filter(|point| point.active).map(|point| point.node).collect();
    active.dedup();
    StepRecord {
        step,
        time: state.time,
        zeta_min: state.zeta.iter().copied().fold(f64::INFINITY, f64::min),
        zeta_mean: setting.body.mean(&state.zeta),
        displacement_max: largest(&state.u),
        work: setting.body.partition.dot(external, &state.u, 2),
        // An empty sum is -0.0, and so is one of reactions of nothing.
        contact_force: state.contact.iter().map(|point| point.force).sum::<f64>() + 0.0,
        active_nodes: active.len(),
        iterations: report.iterations,
        linear_iterations: report.linear_iterations,
        factorisations: report.factorisations,
        fallbacks: report.fallbacks,
        contraction: report.contraction,
        kkt_stationarity: kkt.stationarity,
        kkt_primal: kkt.primal,
        kkt_dual: kkt.dual,
        kkt_complementarity: kkt.complementarity,
        seconds: 0.0,
    }
}
