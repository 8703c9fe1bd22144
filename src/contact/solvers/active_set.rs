//! The primal-dual active set method.

use super::{ContactReport, ContactSolver, SolverEntry};
use crate::{
    archive::{Archive, ArchiveError},
    cholesky::LinearSystem,
    contact::{
        Bound, ContactError, ContactProblem, Kkt, elastic::ElasticSolver,
        rigid_motion_until_contact,
    },
    petsc::{Communicator, PetscError, Session, Vector},
};

pub(super) const ENTRY: SolverEntry = SolverEntry {
    name: "active-set",
    summary: "primal-dual active set method, one linear solve per guess of the active nodes",
    variants: &[],
    rescuer: Some("tao"),
    construct: |session, _, _| Box::new(ActiveSet::new(session, "active-set")),
};

/// With p = f − Kc, the contact force, the conditions of an unknown with an upper bound are
///
/// ```text
/// c ≤ g,  p ≥ 0,  p (c − g) = 0
/// ```
///
/// Guess the active set A, solve Kc = f with c = g on A, and pivot on the indices that violate the
/// conditions: those of A with p < 0 leave it, those outside with c > g join it (Hintermüller, Ito,
/// Kunisch, SIAM J. Optim. 13, 2003: a semismooth Newton method). The active set of the last step
/// is the first of this one.
///
/// Pivoting on all violating indices may return to an earlier set, and where a slender body bends to its
/// obstacle it does. Where their number has not fallen for a few times, the set begins again empty, and all
/// indices that pull leave it or, if none does, the deepest one joins it. Where that takes too long only
/// the last violating index is pivoted on (block principal pivoting, Júdice and Pires, Comput. Oper.
/// Res. 21, 1994, with Murty's rule, finite for positive definite K). Where K
/// is singular and A leaves a rigid motion unconstrained, the body moves as the load drives it
/// until further bounds are reached.
pub(super) struct ActiveSet<'s> {
    /// Of each bound the sign of its contact force: 1 at the upper bound, −1 at the lower one, 0
    /// where neither is active.
    active: Vec<f64>,
    elastic: ElasticSolver<'s>,
}

/// Times that the number of violating indices may fail to fall before the set begins again.
const PATIENCE: usize = 5;
/// Iterations that it then grows by one index at a time.
const GROWTH: usize = 100;

/// An index that violates the conditions.
#[derive(Debug, Clone, Copy)]
struct Violation {
    index: usize,
    /// The sign that its contact force should have.
    side: f64,
    /// How far c is beyond a bound that is not active, m; 0 for an active one, which pulls.
    depth: f64,
}

impl<'s> ActiveSet<'s> {
    /// Called `name`: the set of a problem without bounds is empty, and its first solve the last.
    pub(super) fn new(session: &'s Session, name: &'static str) -> Self {
        Self { active: Vec::new(), elastic: ElasticSolver::new(session, name) }
    }

    /// The set to begin with: the last one, or the bounds that the start reaches.
    fn first_guess(&mut self, problem: &ContactProblem, c: &Vector) -> Result<(), PetscError> {
        if self.active.len() != problem.bounds.len() {
            let reached = |bound: &Bound, c: f64| {
                if c >= bound.upper { 1.0 } else { -f64::from(c <= bound.lower) }
            };
            let c = problem.at_bounds(c)?;
            self.active = problem.bounds.iter().zip(c).map(|(b, c)| reached(b, c)).collect();
        }
        // A lower bound may have been one for the last problem only.
        for (side, bound) in self.active.iter_mut().zip(problem.bounds) {
            if *side < 0.0 && bound.lower.is_infinite() {
                *side = 0.0;
            }
        }
        if !self.constrain_rigid_motions(problem, c)? {
            self.active.fill(1.0);
        }
        Ok(())
    }

    /// Where the active set leaves a rigid motion unconstrained: lets the body move as the load
    /// drives it until it reaches a further bound. False if there is none; the load being balanced,
    /// it is then rounding that drives the motion.
    fn constrain_rigid_motions(
        &mut self,
        problem: &ContactProblem,
        c: &Vector,
    ) -> Result<bool, PetscError> {
        let motions = (problem.rigid, problem.work);
        let (_, constrained) = c.read(|c| {
            let active = &mut self.active;
            rigid_motion_until_contact(problem.comm, motions, problem.bounds, c, active, true)
        })?;
        Ok(constrained)
    }

    /// Minimises with the active unknowns at their bounds and no other bound.
    fn solve_equality(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
        report: &mut ContactReport,
    ) -> Result<(), ContactError> {
        let active = problem.bounds.iter().zip(&self.active).filter(|(_, side)| **side != 0.0);
        let value = |(bound, side): (&Bound, &f64)| {
            (bound.dof, if *side > 0.0 { bound.upper } else { bound.lower })
        };
        let active: Vec<(usize, f64)> = active.map(value).collect();
        let prescribed: Vec<usize> = active.iter().map(|(dof, _)| *dof).collect();
        c.write(|c| active.iter().for_each(|&(dof, value)| c[dof] = value))?;
        let prescribed = (problem.bound_count() > 0).then_some(&prescribed[..]);
        let system = LinearSystem { prescribed, ..problem.system() };
        self.elastic.solve(system, problem.load, c, problem.linear_residual(), report)
    }

    /// The indices that violate the conditions beyond what the KKT tolerance allows: p = f − Kc is at
    /// least 0 at an upper bound and at most 0 at a lower one, and lower ≤ c ≤ upper elsewhere.
    fn violating(
        &self,
        problem: &ContactProblem,
        c: &Vector,
    ) -> Result<Vec<Violation>, PetscError> {
        let slack = 0.1 * problem.tolerance;
        let depth = slack * problem.scales_at(c)?.displacement;
        let pull = slack * problem.scales.force / (problem.bound_count() as f64).sqrt();
        c.read(|c| {
            self.elastic.forces(|p| {
                let violation = |(index, bound): (usize, &Bound)| {
                    let (c, p, side) = (c[bound.dof], p[bound.dof], self.active[index]);
                    let (above, below) = (c - bound.upper, bound.lower - c);
                    let (side, depth) = match side != 0.0 {
                        // An equality carries a force of either sign.
                        true if bound.is_equality() || side * p >= -pull => return None,
                        true => (0.0, 0.0),
                        false if above > depth => (1.0, above),
                        false if below > depth => (-1.0, below),
                        false => return None,
                    };
                    Some(Violation { index, side, depth })
                };
                problem.bounds.iter().enumerate().filter_map(violation).collect()
            })
        })?
    }

    /// Pivots on the chosen indices; false if that changes nothing.
    fn pivot(
        &mut self,
        problem: &ContactProblem,
        c: &Vector,
        chosen: &[Violation],
    ) -> Result<bool, PetscError> {
        let old = self.active.clone();
        chosen.iter().for_each(|one| self.active[one.index] = one.side);
        if !self.constrain_rigid_motions(problem, c)? {
            // No index leaves the active set: only open ones join it.
            for (new, old) in self.active.iter_mut().zip(&old) {
                *new = if *new == 0.0 { *old } else { *new };
            }
        }
        Ok(problem.comm.any(self.active != old))
    }
}

impl ContactSolver for ActiveSet<'_> {
    fn name(&self) -> &'static str {
        self.elastic.method
    }

    fn warm_start(&self) -> Vec<f64> {
        self.active.clone()
    }

    fn set_warm_start(&mut self, kept: &[f64]) {
        self.active = kept.to_vec();
    }

    fn archive(&mut self, archive: &mut Archive) -> Result<(), ArchiveError> {
        self.elastic.archive(archive)
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let mut report = ContactReport::default();
        let (mut fewest, mut patience) = (usize::MAX, PATIENCE);
        // Iterations that the set may still grow by one index at a time, once it has begun again.
        let mut growth = None;
        self.first_guess(problem, c)?;
        for _ in 0..30 + GROWTH + 5 * problem.bound_count() {
            report.iterations += 1;
            self.solve_equality(problem, c, &mut report)?;
            let violating = self.violating(problem, c)?;
            let count = problem.comm.count(violating.len());
            if count == 0 {
                return Ok(report);
            }
            let stuck = count >= fewest && patience == 0;
            (fewest, patience) = match count < fewest {
                true => (count, PATIENCE),
                false => (fewest, patience.saturating_sub(1)),
            };
            if stuck && growth.is_none() {
                growth = Some(GROWTH);
                report.fallbacks += 1;
                self.active.fill(0.0);
                self.constrain_rigid_motions(problem, c)?;
                continue;
            }
            let chosen = match &mut growth {
                Some(0) if stuck => last(problem.comm, &violating),
                None | Some(0) => &violating,
                Some(left) => {
                    *left -= 1;
                    &careful(problem.comm, &violating)
                }
            };
            if !self.pivot(problem, c, chosen)? {
                // The forces of bounds that support a balanced body are rounding; the certificate
                // judges them.
                return Ok(report);
            }
        }
        let detail = "the active set still changes";
        Err(ContactError::stopped(self.name(), report, Kkt::UNKNOWN, detail))
    }
}

/// Of all ranks' `violating` indices those that pull, or if none does the deepest one.
fn careful(comm: Communicator, violating: &[Violation]) -> Vec<Violation> {
    if comm.any(violating.iter().any(|one| one.side == 0.0)) {
        return violating.iter().filter(|one| one.side == 0.0).copied().collect();
    }
    let deepest = violating.iter().copied().max_by(|a, b| a.depth.total_cmp(&b.depth));
    let (_, owner) = comm.min_with_rank(deepest.map_or(f64::INFINITY, |one| -one.depth));
    deepest.filter(|_| owner == comm.rank()).into_iter().collect()
}

/// The last of all ranks' `violating` indices, which are numbered rank by rank; nothing on the
/// others.
fn last<T>(comm: Communicator, violating: &[T]) -> &[T] {
    let owner = if violating.is_empty() { -1.0 } else { comm.rank() as f64 };
    let is_owner = comm.max(owner) == comm.rank() as f64;
    if is_owner { &violating[violating.len().saturating_sub(1)..] } else { &[] }
}
