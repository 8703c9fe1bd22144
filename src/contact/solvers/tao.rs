//! PETSc's TAO on the contact problem.

use super::{ContactReport, ContactSolver, ProblemClass, SolverEntry};
use crate::{
    contact::{ContactError, ContactProblem, Kkt},
    petsc::{BoundedQuadratic, Matrix, PetscError, Session, Vector},
};

pub(super) const ENTRY: SolverEntry = SolverEntry {
    name: "tao",
    summary: "PETSc's TAO, trust-region Newton method tron; tao:TYPE for its other types",
    variants: &TAO_TYPES,
    solves: ProblemClass::Semidefinite,
    rescuer: Some("active-set"),
    construct: |session, kind, _| Box::new(Tao::new(session, kind)),
};

/// TAO's types for bounded variables, reached as `tao:TYPE`; some of them stall or err on
/// contact problems, which their KKT residuals then tell.
pub const TAO_TYPES: [&str; 12] = [
    "tron", "bnls", "bntr", "bntl", "gpcg", "blmvm", "bqnls", "bqnktr", "bqnktl", "bqnkls", "bncg",
    "bqpip",
];

/// One of TAO's types on a kept Cholesky factor (`-tao_type` chooses another).
///
/// TAO is called again with the U it found ([`Scaled`]) until the KKT residuals are met, each time
/// from the last answer.
struct Tao<'s> {
    session: &'s Session,
    kind: String,
    tao: Option<BoundedQuadratic>,
    /// U of the last solve, m; 0 before the first.
    displacement: f64,
}

/// Calls of TAO for one contact problem, more where the proximal term slows them; and of these how
/// many in turn may not halve the residual.
const CALLS: usize = 8;
const PROXIMAL_CALLS: usize = 40;
const STALLED: usize = 7;
/// Relative size of the proximal term that makes K definite where contact alone constrains a
/// rigid motion.
const PROXIMAL: f64 = 1e-7;
/// Stands for infinity, in units of U, where the interior-point method cannot bear it; an answer
/// that touches this box is not stationary, so the residuals reject it.
const BOX: f64 = 1e2;
/// PETSC_INFINITY.
const INFINITE: f64 = f64::MAX / 4.0;

impl<'s> Tao<'s> {
    /// With TAO's type `kind`, or `tron`.
    fn new(session: &'s Session, kind: &str) -> Self {
        let kind = if kind.is_empty() { "tron" } else { kind }.to_owned();
        Self { session, kind, tao: None, displacement: 0.0 }
    }
}

impl ContactSolver for Tao<'_> {
    fn name(&self) -> &'static str {
        ENTRY.name
    }

    fn warm_start(&self) -> Vec<f64> {
        vec![self.displacement]
    }

    fn set_warm_start(&mut self, kept: &[f64]) {
        self.displacement = kept.first().copied().unwrap_or(0.0);
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let tao = match self.tao.take() {
            Some(tao) => tao,
            None => BoundedQuadratic::new(self.session, &self.kind, c.owned())?,
        };
        let tao = self.tao.insert(tao);
        let method = || format!("tao:{}", self.kind);
        let infinite = if self.kind == "bqpip" { BOX } else { INFINITE };
        let mut scaled = Scaled::new(self.session, problem, infinite)?;
        let estimate = problem.max_norm(problem.load)? / scaled.stiffness_scale;
        let mut size = if self.displacement > 0.0 { self.displacement } else { estimate };

        let mut report = ContactReport::default();
        let (mut reason, mut residuals) = (0, Kkt::default());
        let (mut best, mut stalled) = (f64::INFINITY, 0);
        for _ in 0..if problem.definite() { CALLS } else { PROXIMAL_CALLS } {
            scaled.set(problem, c, size)?;
            let limit = problem.linear_residual() / (scaled.stiffness_scale * size);
            let Scaled { stiffness, load, lower, upper, x, .. } = &mut scaled;
            let answer = tao
                .minimise(stiffness, load, [lower, upper], x, limit)
                .map_err(|source| ContactError::Failed { method: method(), source })?;
            report.iterations += answer.iterations;
            report.linear_iterations += answer.linear_iterations;
            report.factorisations += answer.factorisations;
            reason = answer.reason;
            c.write(|c| x.read(|x| c.iter_mut().zip(x).for_each(|(c, x)| *c = x * size)))??;
            let found = problem.max_norm(x)? * size;
            if found > 0.0 {
                (size, self.displacement) = (found, found);
            }
            residuals = problem.residuals(self.session, c)?;
            if residuals.within(0.1 * problem.tolerance) {
                return Ok(report);
            }
            report.false_claims += usize::from(reason > 0 && !residuals.within(problem.tolerance));
            let worst = residuals.worst();
            stalled = if worst < 0.5 * best { 0 } else { stalled + 1 };
            best = best.min(worst);
            if worst.is_nan() || stalled == STALLED {
                break;
            }
        }
        if residuals.within(problem.tolerance) {
            return Ok(report);
        }
        Err(ContactError::NotConverged {
            method: method(),
            report: Box::new(report),
            residuals,
            detail: format!(
                "{} (TaoConvergedReason {reason}, {} false claims of convergence)",
                residuals.missed(problem.tolerance),
                report.false_claims
            ),
        })
    }
}

/// The contact problem in the units that TAO's absolute tolerances suppose: with s the size of K
/// and U that of the answer, x = c/U minimises ½ xᵀ(K/s)x − (f/(sU))ᵀx within the bounds over U.
///
/// Where K is singular, ½ρ|x − c/U|² with the last answer c is added (proximal point method,
/// Rockafellar, SIAM J. Control Optim. 14, 1976).
struct Scaled {
    stiffness: Matrix,
    load: Vector,
    lower: Vector,
    upper: Vector,
    x: Vector,
    /// s, N/m.
    stiffness_scale: f64,
    /// ρ.
    proximal: f64,
    infinite: f64,
}

impl Scaled {
    fn new(session: &Session, problem: &ContactProblem, infinite: f64) -> Result<Self, PetscError> {
        let stiffness_scale = problem.stiffness_scale;
        let proximal = if problem.definite() { 0.0 } else { PROXIMAL };
        let zeros = || Vector::zeros(session, problem.load.owned());
        Ok(Self {
            stiffness: problem.stiffness.scaled(1.0 / stiffness_scale, proximal)?,
            load: zeros()?,
            lower: zeros()?,
            upper: zeros()?,
            x: zeros()?,
            stiffness_scale,
            proximal,
            infinite,
        })
    }

    /// Sets load, bounds and start for the start `c` and U = `size`.
    fn set(&mut self, problem: &ContactProblem, c: &Vector, size: f64) -> Result<(), PetscError> {
        let start = c.read(<[f64]>::to_vec)?;
        let (s, proximal, infinite) = (self.stiffness_scale, self.proximal, self.infinite);
        self.load.write(|v| {
            problem.load.read(|f| {
                for i in 0..v.len() {
                    v[i] = f[i] / (s * size) + proximal * start[i] / size;
                }
            })
        })??;
        let limit = |value: f64| (value / size).clamp(-infinite, infinite);
        self.lower.write(|v| {
            v.fill(-infinite);
            problem.bounds.iter().for_each(|b| v[b.dof] = limit(b.lower));
        })?;
        self.upper.write(|v| {
            v.fill(infinite);
            problem.bounds.iter().for_each(|b| v[b.dof] = limit(b.upper));
        })?;
        self.x.write(|v| v.iter_mut().zip(&start).for_each(|(v, c)| *v = c / size))
    }
}
