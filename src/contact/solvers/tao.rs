//! PETSc's TAO on the contact problem.

use super::{ContactReport, ContactSolver, SolverEntry};
use crate::{
    contact::{Bound, ContactError, ContactProblem},
    linear::{Factor, LinearSolver, Reduction},
    petsc::{BoundedQuadratic, Matrix, PetscError, ShellPreconditioner, TaoReport, Vector},
};
use std::rc::Rc;

pub(super) const TAO: SolverEntry = SolverEntry {
    name: "tao",
    summary: "PETSc's TAO, trust-region Newton method tron; also tao:bnls, tao:bntr, tao:bntl",
    variants: &TAO_TYPES,
    rescuer: Some("active-set"),
    construct: |kind, _| {
        Rc::new(Tao { kind: if kind.is_empty() { "tron" } else { kind }.to_owned() })
    },
};

/// TAO's types for bounded variables that solve contact problems, reached as `tao:TYPE`: Newton's methods. The others stall on
/// slender bodies or on bodies that contact alone supports (STABILITY.md).
pub const TAO_TYPES: [&str; 4] = ["tron", "bnls", "bntr", "bntl"];

/// One of TAO's types on a kept Cholesky factor (`-tao_type` chooses another).
///
/// TAO's tolerances are absolute, so the problem is scaled by the size s of K and the size U of the answer:
///
/// ```text
/// x = c/U minimises ½ xᵀ(K/s)x − (f/(sU))ᵀx within the bounds over U.
/// ```
///
/// If K is singular, the term ½ρ|x − c/U|² with the last answer c is added (proximal point method,
/// Rockafellar, SIAM J. Control Optim. 14, 1976). TAO is called again from the last answer, with the new U, until
/// the KKT residuals are small enough. The warm start of the next solve is U.
struct Tao {
    kind: String,
}

/// TAO gives up after this number of consecutive calls, none of which halved the residual.
const STALLED: usize = 7;
/// Maximum number of iterations in a call.
const ITERATIONS: usize = 200;
/// ρ if contact alone constrains a rigid motion.
const PROXIMAL: f64 = 1e-9;
/// PETSC_INFINITY.
const INFINITE: f64 = f64::MAX / 4.0;

impl Tao {
    /// The solver's name, with its variant.
    fn method(&self) -> String {
        format!("{}:{}", TAO.name, self.kind)
    }

    /// Calls TAO from c for K/s + ρI = `stiffness` and U = `unit`, and leaves its answer in c.
    fn minimise(
        &self,
        problem: &ContactProblem,
        (tao, preconditioner): (&mut BoundedQuadratic, &mut TaoPreconditioner),
        proximal: f64,
        unit: f64,
        c: &mut Vector,
    ) -> Result<TaoReport, ContactError> {
        let vector = |values: Vec<f64>| -> Result<Vector, PetscError> {
            let mut vector = Vector::zeros(problem.session, values.len())?;
            vector.set(&values)?;
            Ok(vector)
        };
        let (start, force) = (c.read(<[f64]>::to_vec)?, problem.stiffness_scale * unit);
        let load = |(f, c): (&f64, &f64)| f / force + proximal * c / unit;
        let load = problem.load.read(|f| vector(f.iter().zip(&start).map(load).collect()))??;
        let limits = |unbounded: f64, side: fn(&Bound) -> f64| {
            let mut limits = vec![unbounded; start.len()];
            for bound in problem.bounds {
                limits[bound.dof] = (side(bound) / unit).clamp(-INFINITE, INFINITE);
            }
            vector(limits)
        };
        let lower = limits(-INFINITE, |bound| bound.lower)?;
        let upper = limits(INFINITE, |bound| bound.upper)?;
        let mut x = vector(start.iter().map(|c| c / unit).collect())?;
        let goal = (problem.linear_residual() / force, ITERATIONS);
        let bounds = [&lower, &upper];
        let answer = tao.minimise(preconditioner.k, &load, bounds, &mut x, goal, preconditioner);
        let method = self.method();
        let answer = answer.map_err(|source| ContactError::Failed { method, source })?;
        c.write(|c| x.read(|x| c.iter_mut().zip(x).for_each(|(c, x)| *c = x * unit)))??;
        Ok(answer)
    }
}

impl ContactSolver for Tao {
    fn name(&self) -> &'static str {
        TAO.name
    }

    fn solve(
        &self,
        problem: &ContactProblem,
        elastic: &mut LinearSolver,
        warm: &mut Vec<f64>,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let proximal = if problem.definite() { 0.0 } else { PROXIMAL };
        let stiffness = problem.stiffness.scaled(1.0 / problem.stiffness_scale, proximal)?;
        let mut unit = match warm.first() {
            Some(unit) => *unit,
            None => first_unit(problem)?,
        };
        let factor = elastic.factor();
        let mut tao = BoundedQuadratic::new(problem.session, &self.kind)?;
        let mut preconditioner = TaoPreconditioner { k: &stiffness, factor };
        let mut report = ContactReport::default();
        let (mut best, mut stalled) = (f64::INFINITY, 0);
        let (reason, residuals) = loop {
            let factorisations = preconditioner.factor.factorisations();
            let call = (&mut tao, &mut preconditioner);
            let answer = self.minimise(problem, call, proximal, unit, c)?;
            report.iterations += answer.iterations;
            report.linear_iterations += answer.linear_iterations;
            report.factorisations += preconditioner.factor.factorisations() - factorisations;
            let found = problem.max_norm(c)?;
            if found > 0.0 {
                (unit, *warm) = (found, vec![found]);
            }
            let residuals = problem.residuals(c)?;
            if residuals.within(problem.tolerance) {
                return Ok(report);
            }
            report.false_claims += usize::from(answer.reason > 0);
            let worst = residuals.worst();
            stalled = if worst < 0.5 * best { 0 } else { stalled + 1 };
            best = best.min(worst);
            if worst.is_nan() || stalled == STALLED {
                break (answer.reason, residuals);
            }
        };
        let detail = format!(
            "{} (TaoConvergedReason {reason}, {} false claims of convergence)",
            residuals.missed(problem.tolerance),
            report.false_claims
        );
        Err(ContactError::stopped(&self.method(), report, residuals, detail))
    }
}

/// The first estimate of U, from the load and from the obstacles that move the body.
fn first_unit(problem: &ContactProblem) -> Result<f64, PetscError> {
    let pushed = problem.bounds.iter().map(|bound| bound.nearest(0.0).abs()).fold(0.0, f64::max);
    let loaded = problem.max_norm(problem.load)? / problem.stiffness_scale;
    Ok(loaded.max(problem.comm.max(pushed)))
}

/// The factor inside TAO's methods.
struct TaoPreconditioner<'a> {
    k: &'a Matrix,
    factor: &'a mut Factor,
}

/// Every new operator begins a solve. Where bounds are active it is K with the rows and columns of their
/// unknowns set to 0 but for the diagonal; or, of some types, without them: then it has a factor of its own.
impl ShellPreconditioner for TaoPreconditioner<'_> {
    fn set_up(&mut self, operator: &Matrix) -> Result<bool, PetscError> {
        let (k, factor) = (self.k, &mut *self.factor);
        let rows = operator.size()?;
        let condensed = rows == k.size()? && factor.analyse(k)? && factor.is_condensed();
        let factored = if condensed { k } else { operator };
        factor.remake(factored)?;
        // All its solves need about the same reduction.
        factor.end_solve(None, Reduction { asked: 1.0, reached: 1.0 });
        let prescribed = if condensed { factor.prescribed_in(k, operator)? } else { Vec::new() };
        let fits = factor.is_for(rows);
        let usable = fits
            && factor.iteration_limit(1.0).is_some()
            && (!condensed || factor.prescribe(&prescribed)?);
        Ok(usable
            || factor.factorise(factored)? && (!condensed || factor.prescribe(&prescribed)?))
    }

    fn apply(&mut self, r: &Vector, z: &mut Vector) -> Result<(), PetscError> {
        self.factor.apply(r, z)
    }
}
