//! The primal-dual active set method.

use super::{
    Bound, ContactError, ContactProblem, ContactReport, ContactSolver, approach::approach,
    elastic::ElasticSolver, tao::Tao,
};
use crate::cholesky::LinearSystem;
use crate::petsc::{Communicator, PetscError, Session, Vector};

/// Guess which bounds are active, solve with u_ν at these bounds, and pivot on the indices that
/// violate the conditions: release active ones that are pulled, fix open ones that penetrate
/// (Hintermüller, Ito, Kunisch, SIAM J. Optim. 13, 2003: a semismooth Newton method). The active
/// set of the last step is the first of this one.
///
/// Pivoting on all violating indices may return to an earlier set. [`Pivoting`] sees that their
/// number falls, and else takes one at a time, which ends for every positive definite K. Where K
/// is singular (only contact holds the body) and a set does not hold it, the body moves as the
/// load drives it until further bounds are reached. If the pivots run out, TAO solves the problem
/// instead.
pub(super) struct ActiveSet<'s> {
    active: Vec<Side>,
    elastic: ElasticSolver<'s>,
    rescue: Tao<'s>,
}

/// Where an unknown is, by the present guess.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Lower,
    Open,
    Upper,
}

impl Side {
    /// Where `c` is.
    fn of(bound: &Bound, c: f64) -> Self {
        match c {
            _ if c >= bound.upper => Self::Upper,
            _ if c <= bound.lower => Self::Lower,
            _ => Self::Open,
        }
    }

    /// The value of an active unknown.
    fn value(self, bound: &Bound) -> Option<f64> {
        match self {
            Self::Lower => Some(bound.lower),
            Self::Open => None,
            Self::Upper => Some(bound.upper),
        }
    }
}

impl<'s> ActiveSet<'s> {
    pub(super) fn new(session: &'s Session) -> Self {
        Self {
            active: Vec::new(),
            elastic: ElasticSolver::new(session),
            rescue: Tao::new(session, "tron"),
        }
    }

    /// The set to begin with: the last one, or the bounds that the start reaches.
    fn first_guess(&mut self, problem: &ContactProblem, c: &Vector) -> Result<(), PetscError> {
        if self.active.len() != problem.bounds.len() {
            self.active = reached(problem, c)?;
        }
        // A lower bound may have been one for the last problem only.
        for (side, bound) in self.active.iter_mut().zip(problem.bounds) {
            if *side == Side::Lower && bound.lower.is_infinite() {
                *side = Side::Open;
            }
        }
        if !self.support(problem, c)? {
            self.active.fill(Side::Upper);
        }
        Ok(())
    }

    /// Where the active set leaves the body a rigid motion: lets it move as the load drives it
    /// until it reaches a further bound. False if there is none; the load being balanced, it is
    /// then rounding that drives the motion.
    fn support(&mut self, problem: &ContactProblem, c: &Vector) -> Result<bool, PetscError> {
        let active = self.active.iter().map(|side| *side != Side::Open).collect();
        let motions = (problem.rigid, problem.work);
        let way = c.read(|c| approach(problem.comm, motions, problem.bounds, c, active, true))?;
        for (i, upper) in way.reached {
            self.active[i] = if upper { Side::Upper } else { Side::Lower };
        }
        Ok(way.supported)
    }

    /// Minimises with the active unknowns at their bounds and no other bound; false if that failed.
    fn solve_equality(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
        report: &mut ContactReport,
    ) -> Result<bool, PetscError> {
        let value = |(bound, side): (&Bound, &Side)| Some((bound.dof, side.value(bound)?));
        let active: Vec<(usize, f64)> =
            problem.bounds.iter().zip(&self.active).filter_map(value).collect();
        let prescribed: Vec<usize> = active.iter().map(|(dof, _)| *dof).collect();
        c.write(|c| active.iter().for_each(|&(dof, value)| c[dof] = value))?;
        let system = LinearSystem { prescribed: Some(&prescribed), ..problem.system() };
        self.elastic.solve(system, problem.load, c, problem.linear_residual(), report)
    }

    /// Where the guess violates the conditions, beyond what the KKT tolerance allows, and the side
    /// that each of these indices belongs to: p = f − Kc is at least 0 at an upper bound and at
    /// most 0 at a lower one, and lower ≤ c ≤ upper elsewhere.
    fn violating(
        &self,
        problem: &ContactProblem,
        c: &Vector,
    ) -> Result<Vec<(usize, Side)>, PetscError> {
        let slack = 0.1 * problem.tolerance;
        let depth = slack * problem.scales(c)?.displacement;
        let pull = slack * problem.scales.force / (problem.all_bounds() as f64).sqrt();
        c.read(|c| {
            self.elastic.forces(|p| {
                let violation = |i: usize| {
                    let bound = &problem.bounds[i];
                    let (c, p) = (c[bound.dof], p[bound.dof]);
                    let other = match self.active[i] {
                        // Either side carries a force of either sign.
                        Side::Upper | Side::Lower if bound.is_equality() => return None,
                        Side::Upper => (p < -pull).then_some(Side::Open),
                        Side::Lower => (p > pull).then_some(Side::Open),
                        Side::Open if c - bound.upper > depth => Some(Side::Upper),
                        Side::Open => (bound.lower - c > depth).then_some(Side::Lower),
                    };
                    other.map(|side| (i, side))
                };
                (0..problem.bounds.len()).filter_map(violation).collect()
            })
        })?
    }

    /// Pivots on the chosen indices; false if that changes nothing.
    fn pivot(
        &mut self,
        problem: &ContactProblem,
        c: &Vector,
        chosen: &[(usize, Side)],
    ) -> Result<bool, PetscError> {
        let old = self.active.clone();
        chosen.iter().for_each(|&(i, side)| self.active[i] = side);
        if !self.support(problem, c)? {
            // Keep those that were active: only fix open ones.
            for (new, old) in self.active.iter_mut().zip(&old) {
                *new = if *new == Side::Open { *old } else { *new };
            }
        }
        Ok(problem.comm.any(self.active != old))
    }

    fn rescue(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
        mut report: ContactReport,
    ) -> Result<ContactReport, ContactError> {
        // From nothing, so that the answer does not depend on steps that were undone.
        c.write(|c| c.fill(0.0))?;
        self.rescue.set_warm_start(&[]);
        let rescued = self.rescue.solve(problem, c)?;
        report.iterations += rescued.iterations;
        report.linear_iterations += rescued.linear_iterations;
        report.fallbacks += 1;
        report.rescues += 1;
        self.active = reached(problem, c)?;
        Ok(report)
    }
}

impl ContactSolver for ActiveSet<'_> {
    fn name(&self) -> &'static str {
        "active-set"
    }

    fn warm_start(&self) -> Vec<f64> {
        let value = |side: &Side| match side {
            Side::Lower => -1.0,
            Side::Open => 0.0,
            Side::Upper => 1.0,
        };
        self.active.iter().map(value).collect()
    }

    fn set_warm_start(&mut self, kept: &[f64]) {
        let side = |&kept: &f64| match kept {
            _ if kept > 0.0 => Side::Upper,
            _ if kept < 0.0 => Side::Lower,
            _ => Side::Open,
        };
        self.active = kept.iter().map(side).collect();
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let mut report = ContactReport::default();
        let mut rule = Pivoting::new();
        self.first_guess(problem, c)?;
        let most = 30 + 5 * problem.all_bounds();
        while report.iterations < most {
            report.iterations += 1;
            if !self.solve_equality(problem, c, &mut report)? {
                break;
            }
            let violating = self.violating(problem, c)?;
            let count = problem.comm.count(violating.len());
            if count == 0 {
                return Ok(report);
            }
            let single = rule.single(count);
            report.fallbacks += usize::from(single && count > 1);
            let chosen = if single { last(problem.comm, &violating) } else { &violating };
            if !self.pivot(problem, c, chosen)? {
                // The forces of bounds that support a balanced body are rounding; the certificate
                // judges them.
                return Ok(report);
            }
        }
        self.rescue(problem, c, report)
    }
}

/// The bounds that `c` has reached.
fn reached(problem: &ContactProblem, c: &Vector) -> Result<Vec<Side>, PetscError> {
    c.read(|c| problem.bounds.iter().map(|bound| Side::of(bound, c[bound.dof])).collect())
}

/// Block principal pivoting (Júdice and Pires, Comput. Oper. Res. 21, 1994): on all violating
/// indices while their number falls, or for a few times more; then only on the last of them
/// (Murty's rule, finite for positive definite matrices) until it has fallen.
struct Pivoting {
    fewest: usize,
    patience: usize,
}

const PATIENCE: usize = 5;

impl Pivoting {
    fn new() -> Self {
        Self { fewest: usize::MAX, patience: PATIENCE }
    }

    /// Whether to pivot on only one of so many violating indices.
    fn single(&mut self, violating: usize) -> bool {
        if violating < self.fewest {
            (self.fewest, self.patience) = (violating, PATIENCE);
            return false;
        }
        let single = self.patience == 0;
        self.patience = self.patience.saturating_sub(1);
        single
    }
}

/// The last of all ranks' `violating` indices, which are numbered rank by rank; nothing on the
/// others.
fn last<T>(comm: Communicator, violating: &[T]) -> &[T] {
    let holder = if violating.is_empty() { -1.0 } else { comm.rank() as f64 };
    let holds = comm.max(holder) == comm.rank() as f64;
    if holds { &violating[violating.len().saturating_sub(1)..] } else { &[] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pivots_on_one_index_when_the_number_of_violating_ones_stops_falling() {
        let mut choice = Pivoting::new();
        assert!(!choice.single(3));
        for _ in 0..PATIENCE {
            assert!(!choice.single(3));
        }
        assert!(choice.single(3));
        assert_eq!(last(Communicator::serial(), &[3, 4, 5]), [5]);
        assert!(!choice.single(2), "progress restores the block pivots");
    }
}
