//! The penalty-duality algorithm of Bermúdez and Moreno (Comput. Math. Appl. 7, 1981),
//! the paper's reference [4].

use super::{Anderson, ContactReport, ContactSolver, SolverEntry};
use crate::{
    archive::{Archive, ArchiveError},
    cholesky::{Factor, LinearSystem},
    contact::{Bound, ContactError, ContactProblem, Kkt, elastic::ElasticSolver},
    petsc::{Session, Vector},
};
use nalgebra::DMatrix;
use serde::Deserialize;

pub(super) const ENTRY: SolverEntry = SolverEntry {
    name: "penalty-duality",
    summary: "fixed-point iteration of Bermúdez and Moreno on the contact pressure, accelerated",
    variants: &[],
    rescuer: Some("active-set"),
    construct: |session, _, options| {
        Box::new(PenaltyDuality::new(session, options.penalty_duality))
    },
};

/// With G = ∂I₍ₗ,ᵤ₎ of the bounds l ≤ Bu ≤ u (mostly l = −∞, u = g) and its Yosida approximation
/// the contact law becomes a fixed point in q:
///
/// 1. solve (K + ω BᵀWB) u = f − BᵀW q,
/// 2. r = Bu + λq,  y = r/(1 − λω) or the bound nearest to it,  q ← (r − y)/λ.
///
/// B picks the bounded unknowns, W their tributary lengths; p = q + ω Bu is the contact pressure
/// at the fixed point, which gives the first q from the start u. [`Anderson`] mixes the iterates:
/// measured on this project's scenes, 11 to 30 iterations instead of 200 to 600.
struct PenaltyDuality<'s> {
    session: &'s Session,
    options: PenaltyOptions,
    /// ω, Pa/m, once estimated.
    omega: Option<f64>,
    elastic: ElasticSolver<'s>,
}

/// ω√(s_min s_max), with s the extreme eigenvalues of the boundary compliance: measured best.
const OMEGA_COMPLIANCE: f64 = 3.0;
/// A change of q this many times the first one, and the mean pressure of the load, means that
/// the iteration diverges.
const DIVERGED: f64 = 1e12;
/// Steps of the Lanczos process that estimates the compliance.
const LANCZOS: usize = 25;

/// The method's parameters, `[contact.penalty_duality]` of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PenaltyOptions {
    /// ω > 0, Pa/m; estimated from the boundary compliance when absent.
    pub omega: Option<f64>,
    /// λω in (0, 1). On a compliance eigenvalue s the error of q is multiplied by
    /// 1 − s/(λ(1 + ωs)) where all nodes are active and by −λω/(1 − λω) · (1 − s/(λ(1 + ωs)))
    /// where none are: at most 1 in size for every s only if λω is ½, the default.
    pub lambda_omega: f64,
    /// Whether Anderson mixes the iterates.
    pub accelerate: bool,
    /// Iterations allowed for one contact problem.
    pub iterations: usize,
}

impl Default for PenaltyOptions {
    fn default() -> Self {
        Self { omega: None, lambda_omega: 0.5, accelerate: true, iterations: 20_000 }
    }
}

impl<'s> PenaltyDuality<'s> {
    fn new(session: &'s Session, options: PenaltyOptions) -> Self {
        Self {
            session,
            options,
            omega: options.omega,
            elastic: ElasticSolver::new(session, ENTRY.name),
        }
    }

    /// Solves (K + ω BᵀWB) u = f − BᵀW q from the start u.
    fn response(
        &mut self,
        problem: &ContactProblem,
        omega: f64,
        f: Option<&Vector>,
        q: &[f64],
        u: &mut Vector,
        report: &mut ContactReport,
    ) -> Result<(), ContactError> {
        let mut rhs = Vector::zeros(self.session, u.owned())?;
        if let Some(f) = f {
            rhs.axpby(1.0, f, 0.0)?;
        }
        rhs.write(|rhs| {
            problem.bounds.iter().zip(q).for_each(|(b, q)| rhs[b.dof] -= b.tributary_length * q);
        })?;
        let limit = match f {
            Some(_) => problem.linear_residual(),
            None => 1e-10 * rhs.norm()?,
        };
        let added: Vec<_> =
            problem.bounds.iter().map(|b| (b.dof, omega * b.tributary_length)).collect();
        let system = LinearSystem { added: Some(&added), ..problem.system() };
        self.elastic.solve(problem.bounds, system, (&rhs, limit), u, None, report)
    }

    /// ω = 3/√(s_min s_max) from the extreme eigenvalues of the compliance S = B K⁻¹BᵀW (normal
    /// displacement per pressure), by the eigenvalues θ = s/(1 + ωs) of [`Self::lanczos`].
    fn estimate_omega(
        &mut self,
        problem: &ContactProblem,
        report: &mut ContactReport,
    ) -> Result<f64, ContactError> {
        let trial = problem.stiffness_scale / contact_length(problem);
        let eigenvalues = self.lanczos(problem, trial, report)?.symmetric_eigenvalues();
        let compliance = |theta: f64| theta / (1.0 - trial * theta);
        // Rigid motions that contact alone constrains have s = ∞ and do not count.
        let finite = || eigenvalues.iter().filter(|theta| 1.0 - trial * **theta > 1e-6);
        let least = compliance(finite().copied().fold(f64::INFINITY, f64::min));
        let most = compliance(finite().copied().fold(0.0, f64::max));
        let omega = OMEGA_COMPLIANCE / (least * most).sqrt();
        Ok(if omega.is_finite() && omega > 0.0 { omega } else { trial })
    }

    /// The tridiagonal matrix of the Lanczos process, reorthogonalised twice (Golub and Van Loan,
    /// Matrix Computations, ch. 10), on S_ω = B (K + ω BᵀWB)⁻¹ BᵀW, which is self-adjoint in the inner
    /// product of W. With the compliance S = B K⁻¹ BᵀW it is S (1 + ωS)⁻¹, but K may be singular.
    fn lanczos(
        &mut self,
        problem: &ContactProblem,
        omega: f64,
        report: &mut ContactReport,
    ) -> Result<DMatrix<f64>, ContactError> {
        let bounds = problem.bounds;
        let dot = |a: &[f64], b: &[f64]| -> f64 {
            let products =
                bounds.iter().enumerate().map(|(i, bound)| bound.tributary_length * a[i] * b[i]);
            problem.comm.total(products.sum())
        };
        let mut u = Vector::zeros(self.session, problem.load.owned())?;
        // A start with all frequencies in it: smooth plus alternating.
        let mut v: Vec<f64> = (0..bounds.len())
            .map(|i| 1.0 + 0.3 * (i as f64).sin() + if i % 2 == 0 { 1.0 } else { -1.0 })
            .collect();
        let mut basis: Vec<Vec<f64>> = Vec::new();
        let (mut alpha, mut beta) = (Vec::new(), Vec::<f64>::new());
        for _ in 0..LANCZOS.min(problem.bound_count()) {
            let norm = dot(&v, &v).sqrt();
            if norm <= 1e-10 * alpha.iter().fold(0.0, |m: f64, a: &f64| m.max(a.abs())) {
                break;
            }
            beta.push(norm);
            v.iter_mut().for_each(|v| *v /= norm);
            basis.push(v.clone());
            self.response(problem, omega, None, &v, &mut u, report)?;
            let mut w: Vec<f64> = problem.at_bounds(&u)?.iter().map(|u| -u).collect();
            alpha.push(dot(&w, &v));
            for earlier in basis.iter().rev().chain(basis.iter().rev()) {
                let component = dot(&w, earlier);
                w.iter_mut().zip(earlier).for_each(|(w, e)| *w -= component * e);
            }
            v = w;
        }
        // β_i couples vector i to the one before; β_0 is the norm of the start.
        Ok(DMatrix::from_fn(alpha.len(), alpha.len(), |i, j| match i.abs_diff(j) {
            0 => alpha[i],
            1 => beta[i.max(j)],
            _ => 0.0,
        }))
    }

    /// The images (r − y)/λ of q, where Bu is `normal`.
    fn image(&self, problem: &ContactProblem, omega: f64, q: &[f64], normal: &[f64]) -> Vec<f64> {
        let lambda = self.options.lambda_omega / omega;
        let image = |((q, u), bound): ((&f64, &f64), &Bound)| {
            let r = u + lambda * q;
            let y = bound.nearest(r / (1.0 - self.options.lambda_omega));
            (r - y) / lambda
        };
        q.iter().zip(normal).zip(problem.bounds).map(image).collect()
    }
}

impl ContactSolver for PenaltyDuality<'_> {
    fn name(&self) -> &'static str {
        ENTRY.name
    }

    fn archive(&mut self, archive: &mut Archive) -> Result<(), ArchiveError> {
        archive.value(&mut self.omega)?;
        self.elastic.archive(archive)
    }

    fn into_factor(self: Box<Self>) -> Option<Factor> {
        self.elastic.into_factor()
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let mut report = ContactReport::default();
        let omega = match self.omega {
            Some(omega) => omega,
            None => self.estimate_omega(problem, &mut report)?,
        };
        self.omega = Some(omega);
        report.omega = Some(omega);
        // q = p − ω Bu with the contact pressure p = W⁻¹B (f − Ku) of the start u.
        let residual = problem.at_bounds(&problem.residual(self.session, c)?)?;
        let start = residual.iter().zip(problem.at_bounds(c)?).zip(problem.bounds);
        let mut q: Vec<f64> =
            start.map(|((r, u), bound)| -r / bound.tributary_length - omega * u).collect();

        let (mut residuals, mut first_change) = (Kkt::default(), 0.0_f64);
        let pressure = problem.scales.force / contact_length(problem);
        let mut anderson =
            Anderson::new(problem.comm, problem.bounds.iter().map(|b| b.tributary_length));
        while report.iterations < self.options.iterations {
            self.response(problem, omega, Some(problem.load), &q, c, &mut report)?;
            report.iterations += 1;
            let normal = problem.at_bounds(c)?;
            // The equation is solved: only the contact conditions are left to judge, with the
            // contact forces W (q + ω Bu).
            let at_bound = |((q, u), bound): ((&f64, &f64), &Bound)| {
                (bound.tributary_length * (q + omega * u), *u)
            };
            let bounded = q.iter().zip(&normal).zip(problem.bounds).map(at_bound);
            residuals = problem.kkt(0.0, bounded, problem.scales_at(c)?);
            if residuals.within(0.1 * problem.tolerance) {
                return Ok(report);
            }
            let image = self.image(problem, omega, &q, &normal);
            let change = image.iter().zip(&q).fold(0.0_f64, |m, (t, q)| m.max((t - q).abs()));
            let change = problem.comm.max(change);
            if report.iterations == 1 {
                first_change = change;
            } else if !change.is_finite() || change > DIVERGED * first_change.max(pressure) {
                break;
            } else if change > 0.0 {
                let steps = (report.iterations - 1) as f64;
                report.contraction = Some((change / first_change).powf(1.0 / steps));
            }
            q = if self.options.accelerate { anderson.next(&q, image) } else { image };
        }
        if residuals.within(problem.tolerance) {
            return Ok(report);
        }
        let detail = format!("{} (ω = {omega:.3e} Pa/m)", residuals.missed(problem.tolerance));
        Err(ContactError::stopped(ENTRY.name, report, residuals, detail))
    }
}

/// |Γ_C|, m.
fn contact_length(problem: &ContactProblem) -> f64 {
    problem.comm.total(problem.bounds.iter().map(|b| b.tributary_length).sum())
}
