//! The penalty-duality algorithm of Bermúdez and Moreno (Comput. Math. Appl. 7, 1981),
//! the paper's reference [4].

mod omega;

use super::{Anderson, ContactReport, ContactSolver, SolverEntry};
use crate::{
    ROUNDING,
    contact::{Bound, ContactError, ContactProblem, Kkt},
    linear::{CondensedSystem, LinearSolver, LinearSystem},
    petsc::{Matrix, Vector},
};
use omega::estimate_omega;
use serde::Deserialize;
use std::rc::Rc;

pub(super) const PENALTY_DUALITY: SolverEntry = SolverEntry {
    name: "penalty-duality",
    summary: "fixed-point iteration of Bermúdez and Moreno on the contact pressure, accelerated",
    variants: &["plain"],
    rescuer: Some("active-set"),
    construct: |variant, options| {
        let mut options = options.penalty_duality;
        // As published.
        options.accelerate &= variant != "plain";
        Rc::new(PenaltyDuality { options })
    },
};

/// Iterates the [`FixedPoint`] until the contact law holds to the tolerance. The answer u is the response to
/// the last pressure p.
///
/// With a condensed factor of the present K, step 1 solves only the small problem of the bounded unknowns.
/// The iterates are those of the full problem. With a factor of an earlier K an outer iteration corrects
/// them: c and p of the small problem leave the forces f − Kc − BᵀWp, which are the load of the next small
/// problem. Without condensation each step 1 is a solve with K + ωBᵀWB.
///
/// Its warm start for the next solve is the estimated ω.
struct PenaltyDuality {
    options: PenaltyOptions,
}

/// With G = ∂I₍ₗ,ᵤ₎ of the bounds l ≤ Bu ≤ u (mostly l = −∞, u = g) and its Yosida approximation
/// the contact law becomes a fixed point in q:
///
/// 1. solve (K + ω BᵀWB) u = f − BᵀW q,
/// 2. r = Bu + λq,  y = r/(1 − λω) or the bound nearest to it,  q ← (r − y)/λ.
///
/// B selects the bounded unknowns, and W has their tributary lengths. p = q + ω Bu is the contact pressure at
/// the fixed point; it gives the first q from the start u. [`Anderson`] mixes the iterates, which saves most
/// of them (SPEED.md, section 3).
struct FixedPoint<'a> {
    options: &'a PenaltyOptions,
    /// ω, Pa/m; empty before its estimate.
    omega: &'a mut Vec<f64>,
}

/// Step 1: Bu for ω and q.
type Response<'a> = &'a mut dyn FnMut(f64, &[f64]) -> Result<Vec<f64>, ContactError>;

/// The residual of the contact law is at most this fraction of the tolerance.
const EXACT: f64 = 0.1;
/// The largest number of small problems for one contact problem.
const OUTER: usize = 100;

/// The method's parameters, `[contact.penalty_duality]` of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PenaltyOptions {
    /// ω > 0, Pa/m; estimated from the boundary compliance when absent.
    pub omega: Option<f64>,
    /// λω in (0, 1). On a compliance eigenvalue s the error of q is multiplied by 1 − s/(λ(1 + ωs)) if all
    /// nodes are active, and by −λω/(1 − λω) · (1 − s/(λ(1 + ωs))) if none is. Both are at most 1 in size for
    /// every s only if λω is ½, the default.
    pub lambda_omega: f64,
    /// Does [`Anderson`] mix the iterates?
    pub accelerate: bool,
    /// The largest number of iterations for one contact problem.
    pub iterations: usize,
}

impl Default for PenaltyOptions {
    fn default() -> Self {
        Self { omega: None, lambda_omega: 0.5, accelerate: true, iterations: 20_000 }
    }
}

impl FixedPoint<'_> {
    /// Iterates from the contact forces p and Bu until the residual of the contact law is at most [`EXACT`]
    /// times the tolerance. Returns the contact forces of the answer, W (q + ω Bu), N.
    fn find(
        &self,
        problem: &ContactProblem,
        omega: f64,
        [p, start]: [&[f64]; 2],
        respond: Response,
        report: &mut ContactReport,
    ) -> Result<Vec<f64>, ContactError> {
        report.omega = Some(omega);
        let lengths = || problem.bounds.iter().map(|bound| bound.tributary_length);
        let start = p.iter().zip(start).zip(lengths());
        let mut q: Vec<f64> = start.map(|((p, u), w)| p / w - omega * u).collect();
        let mut anderson = Anderson::new(problem.comm, lengths());
        let (mut first, mut missed, mut steps) = (None, f64::NAN, 0.0);
        while report.iterations < self.options.iterations {
            report.iterations += 1;
            let normal = respond(omega, &q)?;
            let image = self.image(problem, omega, &q, &normal);
            let change: Vec<f64> = image.iter().zip(&q).map(|(image, q)| image - q).collect();
            missed = self.options.lambda_omega * of_load(problem, &change);
            if missed <= EXACT * problem.tolerance {
                let forces = q.iter().zip(&normal).zip(lengths());
                return Ok(forces.map(|((q, u), w)| w * (q + omega * u)).collect());
            }
            let first = *first.get_or_insert(missed);
            if steps > 0.0 {
                report.contraction = Some((missed / first).powf(1.0 / steps));
            }
            steps += 1.0;
            // It has diverged if the first residual and the load are rounding beside it.
            if !missed.is_finite() || ROUNDING * missed > first.max(1.0) {
                break;
            }
            q = if self.options.accelerate { anderson.next(&q, image) } else { image };
        }
        let tolerance = problem.tolerance;
        let detail = format!(
            "the tolerance {tolerance:.1e} is missed by contact pressures, whose residual {missed:.1e} is \
             {:.1e} times too large (ω = {omega:.3e})",
            missed / (EXACT * tolerance)
        );
        Err(ContactError::stopped(PENALTY_DUALITY.name, *report, Kkt::UNKNOWN, detail))
    }

    /// ω, estimated in the first solve.
    fn omega(&mut self, problem: &ContactProblem, respond: Response) -> Result<f64, ContactError> {
        if let Some(omega) = self.options.omega {
            return Ok(omega);
        }
        if self.omega.is_empty() {
            self.omega.push(estimate_omega(problem, respond)?);
        }
        Ok(self.omega[0])
    }

    /// Step 2: the next q, where Bu is `normal`.
    fn image(&self, problem: &ContactProblem, omega: f64, q: &[f64], normal: &[f64]) -> Vec<f64> {
        let lambda = self.options.lambda_omega / omega;
        let image = |((q, u), bound): ((&f64, &f64), &Bound)| {
            let r = u + lambda * q;
            let free = r / (1.0 - self.options.lambda_omega);
            (r - bound.nearest(free)) / lambda
        };
        q.iter().zip(normal).zip(problem.bounds).map(image).collect()
    }

    /// The fixed point in the small problem, from the contact forces p, where c is `start` at the bounds.
    fn find_condensed(
        &mut self,
        problem: &ContactProblem,
        p: &[f64],
        start: &[f64],
        condensed: &mut CondensedSystem,
        report: &mut ContactReport,
    ) -> Result<Vec<f64>, ContactError> {
        // The condensed unknowns are x = Bu − Bc: (S + ωW) x = b − W (q + ω Bc).
        let mut respond = |omega: f64, q: &[f64]| {
            let added = problem.bounds.iter().map(|bound| omega * bound.tributary_length);
            let forces = problem.bounds.iter().zip(q).zip(start);
            let forces = forces.map(|((bound, q), c)| bound.tributary_length * (q + omega * c));
            let x = condensed.solve_penalised(added, &forces.collect::<Vec<_>>())?;
            let x = x.ok_or(ContactError::NotDefinite { method: PENALTY_DUALITY.name })?;
            Ok(start.iter().zip(x).map(|(c, x)| c + x).collect())
        };
        let omega = self.omega(problem, &mut respond)?;
        self.find(problem, omega, [p, start], &mut respond, report)
    }
}

/// The fixed point of small problems; residuals of the full problem correct them.
fn solve_condensed(
    mut fixed_point: FixedPoint,
    problem: &ContactProblem,
    elastic: &mut LinearSolver,
    c: &mut Vector,
) -> Result<ContactReport, ContactError> {
    let (system, limit) = (problem.system(), problem.linear_residual());
    let mut report = ContactReport::default();
    elastic.start(system, problem.load, c, limit)?;
    let mut p = problem.at_bounds(elastic.residual())?;
    for _ in 0..OUTER {
        let start = problem.at_bounds(c)?;
        report.factorisations += elastic.prepare(system)?;
        let condensed = elastic.condense()?;
        let mut condensed =
            condensed.ok_or(ContactError::NotDefinite { method: PENALTY_DUALITY.name })?;
        p = fixed_point.find_condensed(problem, &p, &start, &mut condensed, &mut report)?;
        elastic.expand(system, true, c)?;
        report.linear_iterations += 1;
        // ‖f − Kc − BᵀWp‖₂: the forces without the contact forces.
        let left = elastic.residual().read(|forces| {
            let mut forces = forces.to_vec();
            problem.bounds.iter().zip(&p).for_each(|(bound, p)| forces[bound.dof] -= p);
            problem.comm.total(forces.iter().map(|f| f * f).sum()).sqrt()
        })?;
        if left <= limit {
            elastic.end_solve(report.linear_iterations, left, limit);
            return Ok(report);
        }
        if elastic.is_slow(report.linear_iterations, limit) || !left.is_finite() {
            report.factorisations += 1;
            elastic.factorise(system)?;
        }
    }
    let detail = "the forces that the condensed problem leaves over do not become small enough";
    Err(ContactError::stopped(PENALTY_DUALITY.name, report, Kkt::UNKNOWN, detail))
}

/// The fixed point with solves of all unknowns.
fn solve_whole(
    mut fixed_point: FixedPoint,
    problem: &ContactProblem,
    elastic: &mut LinearSolver,
    c: &mut Vector,
) -> Result<ContactReport, ContactError> {
    let p: Vec<f64> = problem.at_bounds(&problem.residual(c)?)?.into_iter().map(|p| -p).collect();
    let start = problem.at_bounds(c)?;
    let (mut report, mut linear) = <(ContactReport, ContactReport)>::default();
    let mut penalised: Option<(f64, Matrix)> = None;
    let mut respond = |omega: f64, q: &[f64]| {
        let at_bounds = |value: &dyn Fn(usize, f64) -> f64| {
            let mut vector = Vector::zeros(problem.session, c.owned())?;
            vector.write(|v| {
                for (i, bound) in problem.bounds.iter().enumerate() {
                    v[bound.dof] = value(i, bound.tributary_length);
                }
            })?;
            Ok::<_, ContactError>(vector)
        };
        let matrix = match &mut penalised {
            Some((of, matrix)) if *of == omega => matrix,
            other => {
                let mut matrix = problem.stiffness.duplicate()?;
                matrix.add_diagonal(&at_bounds(&|_, w| omega * w)?)?;
                &mut other.insert((omega, matrix)).1
            }
        };
        let mut rhs = at_bounds(&|i, w| -w * q[i])?;
        rhs.axpby(1.0, problem.load, 1.0)?;
        let system = LinearSystem { matrix, ..problem.system() };
        // The linear residual must be below the tolerance of the contact law, or the iteration stalls above
        // it.
        let limit = EXACT * problem.linear_residual();
        linear.add_solve(PENALTY_DUALITY.name, elastic.solve_renewing(system, &rhs, c, limit)?)?;
        Ok(problem.at_bounds(c)?)
    };
    let omega = fixed_point.omega(problem, &mut respond)?;
    fixed_point.find(problem, omega, [&p, &start], &mut respond, &mut report)?;
    let ContactReport { linear_iterations, factorisations, .. } = linear;
    Ok(ContactReport { linear_iterations, factorisations, ..report })
}

impl ContactSolver for PenaltyDuality {
    fn name(&self) -> &'static str {
        PENALTY_DUALITY.name
    }

    fn solve(
        &self,
        problem: &ContactProblem,
        elastic: &mut LinearSolver,
        warm: &mut Vec<f64>,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let fixed_point = FixedPoint { options: &self.options, omega: warm };
        match elastic.is_condensed(problem.stiffness)? {
            true => solve_condensed(fixed_point, problem, elastic, c),
            false => solve_whole(fixed_point, problem, elastic, c),
        }
    }
}

/// The forces of these pressures, over F.
fn of_load(problem: &ContactProblem, pressures: &[f64]) -> f64 {
    let forces =
        problem.bounds.iter().zip(pressures).map(|(b, p)| (b.tributary_length * p).powi(2));
    problem.comm.total(forces.sum()).sqrt() / problem.scales.force
}
