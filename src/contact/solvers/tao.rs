//! PETSc's TAO on the contact problem.

use super::{ContactReport, ContactSolver, SolverEntry};
use crate::{
    cholesky::{Factor, Precision},
    contact::{ContactError, ContactProblem, Kkt},
    petsc::{BoundedQuadratic, Matrix, PetscError, Session, TaoReport, Vector},
};

pub(super) const ENTRY: SolverEntry = SolverEntry {
    name: "tao",
    summary: "PETSc's TAO, trust-region Newton method tron; tao:TYPE for its other types",
    variants: &TAO_TYPES,
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
    factor: Factor,
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
        let factor = Factor::new(session, "elastic_", Precision::Preconditioner);
        Self { session, kind, tao: None, factor, displacement: 0.0 }
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
            None => BoundedQuadratic::new::<Factor>(self.session, &self.kind, c.owned())?,
        };
        let tao = self.tao.insert(tao);
        let method = || format!("tao:{}", self.kind);
        let infinite = if self.kind == "bqpip" { BOX } else { INFINITE };
        let mut scaled = Scaled::new(self.session, problem, infinite)?;
        let estimate = problem.max_norm(problem.load)? / problem.stiffness_scale;
        let mut unit = if self.displacement > 0.0 { self.displacement } else { estimate };

        let mut report = ContactReport::default();
        let (mut reason, mut residuals) = (0, Kkt::default());
        let (mut best, mut stalled) = (f64::INFINITY, 0);
        for _ in 0..if problem.definite() { CALLS } else { PROXIMAL_CALLS } {
            scaled.set(problem, c, unit)?;
            let limit = problem.linear_residual() / (problem.stiffness_scale * unit);
            let factorisations = self.factor.factorisations();
            let answer = scaled
                .minimise(tao, &mut self.factor, limit)
                .map_err(|source| ContactError::Failed { method: method(), source })?;
            report.iterations += answer.iterations;
            report.linear_iterations += answer.linear_iterations;
            report.factorisations += self.factor.factorisations() - factorisations;
            reason = answer.reason;
            c.write(|c| scaled.x.read(|x| c.iter_mut().zip(x).for_each(|(c, x)| *c = x * unit)))??;
            let found = problem.max_norm(&scaled.x)? * unit;
            if found > 0.0 {
                (unit, self.displacement) = (found, found);
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
    /// The lower bounds, and the upper ones.
    bounds: [Vector; 2],
    x: Vector,
    /// ρ.
    proximal: f64,
    infinite: f64,
}

impl Scaled {
    fn new(session: &Session, problem: &ContactProblem, infinite: f64) -> Result<Self, PetscError> {
        let proximal = if problem.definite() { 0.0 } else { PROXIMAL };
        let zeros = || Vector::zeros(session, problem.load.owned());
        Ok(Self {
            stiffness: problem.stiffness.scaled(1.0 / problem.stiffness_scale, proximal)?,
            load: zeros()?,
            bounds: [zeros()?, zeros()?],
            x: zeros()?,
            proximal,
            infinite,
        })
    }

    /// Sets load, bounds and start for the start `c` and U = `unit`.
    fn set(&mut self, problem: &ContactProblem, c: &Vector, unit: f64) -> Result<(), PetscError> {
        let start = c.read(<[f64]>::to_vec)?;
        let (s, proximal, infinite) = (problem.stiffness_scale, self.proximal, self.infinite);
        self.load.write(|v| {
            problem.load.read(|f| {
                for i in 0..v.len() {
                    v[i] = f[i] / (s * unit) + proximal * start[i] / unit;
                }
            })
        })??;
        let limit = |value: f64| (value / unit).clamp(-infinite, infinite);
        let [lower, upper] = &mut self.bounds;
        lower.write(|v| {
            v.fill(-infinite);
            problem.bounds.iter().for_each(|b| v[b.dof] = limit(b.lower));
        })?;
        upper.write(|v| {
            v.fill(infinite);
            problem.bounds.iter().for_each(|b| v[b.dof] = limit(b.upper));
        })?;
        self.x.write(|v| v.iter_mut().zip(&start).for_each(|(v, c)| *v = c / unit))
    }

    /// Minimises with TAO until the gradient is about `limit` in ‖·‖₂.
    fn minimise(
        &mut self,
        tao: &mut BoundedQuadratic,
        factor: &mut Factor,
        limit: f64,
    ) -> Result<TaoReport, PetscError> {
        let bounds = self.bounds.each_ref();
        tao.minimise(&self.stiffness, &self.load, bounds, &mut self.x, limit, factor)
    }
}
