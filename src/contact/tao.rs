//! PETSc's TAO on the contact problem.

use super::{ContactError, ContactProblem, ContactReport, ContactSolver, Kkt};
use crate::{
    cholesky::{Factor, Precision},
    petsc::{BoundedQuadratic, Session, Vector},
};

/// TAO's trust-region Newton method `tron` on a kept Cholesky factor; `-tao_type` chooses another.
///
/// TAO holds absolute tolerances, so it is given K/s, f/(sU) and c/U with s the size of K
/// and U the size of the answer. U is unknown at first: TAO is called again with the U it
/// found until the KKT residuals are met. Each call starts from the last answer.
pub(super) struct Tao<'s> {
    session: &'s Session,
    method: String,
    tao: Option<BoundedQuadratic<Factor>>,
    /// U of the last solve, m.
    size: f64,
}

/// Calls of TAO for one contact problem, more where the proximal term slows them; and of these how
/// many in turn may not halve the residual.
const CALLS: usize = 8;
const PROXIMAL_CALLS: usize = 40;
const STALLED: usize = 7;
/// Relative size of the proximal term that makes K definite where only contact holds the body.
const PROXIMAL: f64 = 1e-7;

impl<'s> Tao<'s> {
    /// With TAO's type `method` (`-tao_type` overrules it).
    pub(super) fn new(session: &'s Session, method: &str) -> Self {
        Self { session, method: method.to_owned(), tao: None, size: 0.0 }
    }
}

impl ContactSolver for Tao<'_> {
    fn name(&self) -> &'static str {
        "tao"
    }

    fn warm_start(&self) -> Vec<f64> {
        vec![self.size]
    }

    fn set_warm_start(&mut self, kept: &[f64]) {
        self.size = kept.first().copied().unwrap_or(0.0);
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let tao = match self.tao.take() {
            Some(tao) => tao,
            None => BoundedQuadratic::new(self.session, &self.method, c.owned(), || {
                Factor::new(self.session, "elastic_", Precision::Preconditioner)
            })?,
        };
        let tao = self.tao.insert(tao);
        let mut report = ContactReport::default();
        let owned = c.owned();
        let load = problem.load.read(<[f64]>::to_vec)?;
        let load_size = problem.size(problem.load)?;

        let s = problem.stiffness_scale;
        let proximal = if problem.definite() { 0.0 } else { PROXIMAL };
        let stiffness = problem.stiffness.scaled(1.0 / s, proximal)?;
        let mut x = Vector::zeros(self.session, owned)?;
        let mut f = Vector::zeros(self.session, owned)?;
        let mut lower = Vector::zeros(self.session, owned)?;
        let mut upper = Vector::zeros(self.session, owned)?;
        let infinite = match self.method.as_str() {
            "bqpip" => BOX,
            _ => INFINITE,
        };

        let mut size = if self.size > 0.0 { self.size } else { load_size / s };
        let (mut reason, mut residuals) = (0, Kkt::default());
        let (mut best, mut stalled) = (f64::INFINITY, 0);
        let calls = if problem.definite() { CALLS } else { PROXIMAL_CALLS };
        for _ in 0..calls {
            let start = c.read(<[f64]>::to_vec)?;
            f.write(|v| {
                for i in 0..owned {
                    v[i] = load[i] / (s * size) + proximal * start[i] / size;
                }
            })?;
            let limit = |value: f64| (value / size).clamp(-infinite, infinite);
            lower.write(|v| {
                v.fill(-infinite);
                problem.bounds.iter().for_each(|b| v[b.dof] = limit(b.lower));
            })?;
            upper.write(|v| {
                v.fill(infinite);
                problem.bounds.iter().for_each(|b| v[b.dof] = limit(b.upper));
            })?;
            x.write(|v| v.iter_mut().zip(&start).for_each(|(v, c)| *v = c / size))?;
            let limit = problem.linear_residual() / (s * size);
            let answer = tao
                .minimise(&stiffness, &f, [&lower, &upper], &mut x, limit)
                .map_err(|source| ContactError::TaoFailed { kind: self.method.clone(), source })?;
            report.iterations += answer.iterations;
            report.linear_iterations += answer.linear_iterations;
            report.factorisations += answer.factorisations;
            reason = answer.reason;

            let largest = problem.size(&x)? * size;
            let scale = size;
            c.write(|c| x.read(|x| c.iter_mut().zip(x).for_each(|(c, x)| *c = x * scale)))??;
            if largest > 0.0 {
                size = largest;
                self.size = largest;
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
        Err(ContactError::TaoStopped {
            kind: self.method.clone(),
            iterations: report.iterations,
            linear_iterations: report.linear_iterations,
            reason,
            false_claims: report.false_claims,
            tolerance: problem.tolerance,
            residuals,
        })
    }
}

/// Stands for infinity, in sizes of the answer, where the interior-point method cannot bear it;
/// an answer that touches this box is not stationary, so the residuals reject it.
const BOX: f64 = 1e2;
/// PETSC_INFINITY.
const INFINITE: f64 = f64::MAX / 4.0;
