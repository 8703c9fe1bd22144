//! The linear systems inside contact solvers, on a factor that is kept while that pays.

use super::{ContactProblem, ContactReport};
use crate::petsc::{Factor, Matrix, PetscError, Precision, Refactorisation, Session, Vector};

/// (K + D) c = f on the unknowns that are not held.
#[derive(Clone, Copy)]
pub(super) struct System<'a> {
    /// The unknowns that keep the values they have in c.
    pub held: &'a [usize],
    /// The nonzero entries of the diagonal D, N/m; `None` where it has none on any rank.
    pub added: Option<&'a [(usize, f64)]>,
}

/// Conjugate gradients, preconditioned by the Cholesky factor of an earlier system: other damage,
/// other held unknowns, another diagonal. [`Refactorisation`] tells when to renew it.
pub(super) struct ElasticSolver<'s> {
    session: &'s Session,
    engine: Option<Engine>,
}

impl<'s> ElasticSolver<'s> {
    pub(super) fn new(session: &'s Session) -> Self {
        Self { session, engine: None }
    }

    /// Solves from the start `c` for the load `f` until the forces left on the free unknowns are
    /// at most `limit` in ‖·‖₂, N. False if they do not get there: the system is not positive
    /// definite, or too ill-conditioned for this limit.
    ///
    /// # Errors
    /// PETSc failed.
    pub(super) fn solve(
        &mut self,
        problem: &ContactProblem,
        system: System,
        f: &Vector,
        c: &mut Vector,
        limit: f64,
        report: &mut ContactReport,
    ) -> Result<bool, PetscError> {
        let mut engine = match self.engine.take() {
            Some(engine) => engine,
            None => Engine::new(self.session, problem)?,
        };
        engine.start(problem, system, f, c)?;
        let mut solved = engine.remaining(system)? <= limit;
        if !solved && !engine.policy.due() {
            let most = engine.policy.iteration_limit();
            let iterations;
            (solved, iterations) = engine.iterate(problem, system, c, limit, most)?;
            engine.policy.solved(iterations);
            report.linear_iterations += iterations;
        }
        if !solved {
            report.factorisations += 1;
            if problem.phases.time("contact/factorisation", || engine.renew(problem, system))? {
                let iterations;
                (solved, iterations) = engine.iterate(problem, system, c, limit, FRESH)?;
                engine.policy.solved(iterations);
                report.linear_iterations += iterations;
            }
        }
        self.engine = Some(engine);
        Ok(solved)
    }

    /// f − (K + D)c of the last solve, N, on all unknowns: on held ones the forces that hold them.
    pub(super) fn forces<R>(&self, reader: impl FnOnce(&[f64]) -> R) -> Result<R, PetscError> {
        match &self.engine {
            Some(engine) => engine.residual.read(reader),
            None => Ok(reader(&[])),
        }
    }
}

/// CG iterations that a factor of the system itself may need: it removes the factor's rounding
/// error, which is large where the stiffness varies by many orders.
const FRESH: usize = 200;

struct Engine {
    factor: Factor,
    /// The system that was factorised.
    matrix: Matrix,
    policy: Refactorisation,
    residual: Vector,
    /// The residual with 0 on held unknowns.
    free: Vector,
    preconditioned: Vector,
    direction: Vector,
    image: Vector,
}

impl Engine {
    fn new(session: &Session, problem: &ContactProblem) -> Result<Self, PetscError> {
        let zeros = || Vector::zeros(session, problem.stiffness.owned());
        let unknowns = problem.comm.count(problem.stiffness.owned());
        Ok(Self {
            factor: Factor::new(session, "elastic_", unknowns, Precision::Preconditioner)?,
            matrix: problem.stiffness.duplicate()?,
            policy: Refactorisation::default(),
            residual: zeros()?,
            free: zeros()?,
            preconditioned: zeros()?,
            direction: zeros()?,
            image: zeros()?,
        })
    }

    /// The residual of the start.
    fn start(
        &mut self,
        problem: &ContactProblem,
        system: System,
        f: &Vector,
        c: &Vector,
    ) -> Result<(), PetscError> {
        multiply(problem, system, c, &mut self.residual)?;
        self.residual.scale_add(-1.0, f)
    }

    /// ‖residual‖₂ on the free unknowns.
    fn remaining(&mut self, system: System) -> Result<f64, PetscError> {
        self.free.copy(&self.residual)?;
        clear(&mut self.free, system.held)?;
        self.free.norm()
    }

    /// Factorises the system at hand; false if it is not positive definite.
    fn renew(&mut self, problem: &ContactProblem, system: System) -> Result<bool, PetscError> {
        self.matrix.copy(problem.stiffness)?;
        if let Some(added) = system.added {
            self.image.write(|d| {
                d.fill(0.0);
                added.iter().for_each(|&(dof, value)| d[dof] += value);
            })?;
            self.matrix.add_diagonal(&self.image)?;
        }
        self.matrix.hold(system.held, problem.stiffness_scale)?;
        let definite = self.factor.factorise(&self.matrix)?;
        match definite {
            true => self.policy.done(self.factor.cost()),
            false => self.policy = Refactorisation::default(),
        }
        Ok(definite)
    }

    /// Conjugate gradients (Hestenes and Stiefel, J. Res. Nat. Bur. Standards 49, 1952) on the
    /// free unknowns: whether the limit was reached, and after how many iterations.
    fn iterate(
        &mut self,
        problem: &ContactProblem,
        system: System,
        c: &mut Vector,
        limit: f64,
        most: usize,
    ) -> Result<(bool, usize), PetscError> {
        let mut energy = 0.0;
        for iteration in 1..=most {
            let traffic = self.factor.traffic();
            problem.phases.time_moving("contact/triangular solves", traffic, || {
                self.factor.apply(&self.free, &mut self.preconditioned)
            })?;
            clear(&mut self.preconditioned, system.held)?;
            let previous = energy;
            energy = self.free.dot(&self.preconditioned)?;
            match iteration {
                1 => self.direction.copy(&self.preconditioned)?,
                _ => self.direction.scale_add(energy / previous, &self.preconditioned)?,
            }
            multiply(problem, system, &self.direction, &mut self.image)?;
            let stiffness = self.direction.dot(&self.image)?;
            if !(stiffness > 0.0 && energy > 0.0) {
                return Ok((false, iteration));
            }
            c.add(energy / stiffness, &self.direction)?;
            self.residual.add(-energy / stiffness, &self.image)?;
            if self.remaining(system)? <= limit {
                return Ok((true, iteration));
            }
        }
        Ok((false, most))
    }
}

/// `y` ← (K + D) `x`.
fn multiply(
    problem: &ContactProblem,
    system: System,
    x: &Vector,
    y: &mut Vector,
) -> Result<(), PetscError> {
    let traffic = problem.stiffness.traffic();
    problem.phases.time_moving("contact/products", traffic, || problem.stiffness.multiply(x, y))?;
    match system.added {
        None => Ok(()),
        Some(added) => {
            x.read(|x| y.write(|y| added.iter().for_each(|&(i, d)| y[i] += d * x[i])))?
        }
    }
}

fn clear(vector: &mut Vector, held: &[usize]) -> Result<(), PetscError> {
    vector.write(|v| held.iter().for_each(|&dof| v[dof] = 0.0))
}
