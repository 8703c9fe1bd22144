//! The primal-dual active set method.

use super::{
    ContactError, ContactProblem, ContactReport, ContactSolver,
    elastic::{ElasticSolver, System},
    problem::unheld,
    tao::Tao,
};
use crate::petsc::{PetscError, Ranks, Session, Vector};
use nalgebra::DVector;

/// Guess which nodes press, solve with u_ν = g there, and exchange the nodes where the guess was
/// wrong: pressing ones that are pulled, open ones that penetrate (Hintermüller, Ito, Kunisch,
/// SIAM J. Optim. 13, 2003: a semismooth Newton method). The guess of the last step is the
/// first of this one.
///
/// Exchanging all wrong nodes may return to an earlier set. [`Exchange`] sees that the number
/// of wrong nodes falls, and else exchanges one at a time, which ends for every positive
/// definite K. Where K is singular (only contact holds the body) and a set does not hold it,
/// the body moves as the load drives it until further nodes press. If the exchanges run out,
/// TAO solves the problem instead.
pub(super) struct ActiveSet<'s> {
    pressing: Vec<bool>,
    elastic: ElasticSolver<'s>,
    rescue: Tao<'s>,
}

impl<'s> ActiveSet<'s> {
    pub(super) fn new(session: &'s Session) -> Self {
        Self {
            pressing: Vec::new(),
            elastic: ElasticSolver::new(session),
            rescue: Tao::new(session, "tron"),
        }
    }

    /// The set to begin with: the last one, or the nodes that touch at the start.
    fn first_guess(&mut self, problem: &ContactProblem, c: &Vector) -> Result<(), PetscError> {
        if self.pressing.len() != problem.bounds.len() {
            let touches = |c: &[f64]| problem.bounds.iter().map(|b| c[b.dof] >= b.gap).collect();
            self.pressing = c.read(touches)?;
        }
        if !self.hold(problem, c)? {
            self.pressing.fill(true);
        }
        Ok(())
    }

    /// Where the pressing nodes leave the body a rigid motion: lets it move as the load drives
    /// it until a further node closes its gap. False if none does; the load being balanced, it
    /// is then rounding that drives the motion.
    fn hold(&mut self, problem: &ContactProblem, c: &Vector) -> Result<bool, PetscError> {
        loop {
            let left = unheld(problem.ranks, problem.rigid, &self.pressing);
            let Some(any) = left.first() else { return Ok(true) };
            let driven = left.iter().map(|m| m * m.dot(problem.work)).sum::<DVector<f64>>();
            // Where the load drives none of them, any will do.
            let motion = if driven.amax() > 0.0 { driven } else { any.clone() };
            let normal = problem.rigid * motion.normalize();
            let most = problem.ranks.max(normal.iter().fold(0.0, |m: f64, v| m.max(v.abs())));
            let closing = |i: &usize| !self.pressing[*i] && normal[*i] > 1e-6 * most;
            let nearest = c.read(|c| {
                let way = |i: usize| {
                    let bound = &problem.bounds[i];
                    (i, (bound.gap - c[bound.dof]) / normal[i])
                };
                let ways = (0..normal.len()).filter(closing).map(way);
                ways.min_by(|a, b| a.1.total_cmp(&b.1))
            })?;
            let (way, rank) = problem.ranks.least(nearest.map_or(f64::INFINITY, |(_, way)| way));
            match nearest {
                _ if way == f64::INFINITY => return Ok(false),
                Some((node, _)) if rank == problem.ranks.rank() => self.pressing[node] = true,
                _ => {}
            }
        }
    }

    /// Minimises with c = g on the pressing nodes and no other bound; false if that failed.
    fn solve_pressing(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
        report: &mut ContactReport,
    ) -> Result<bool, PetscError> {
        let pressing = || problem.bounds.iter().zip(&self.pressing).filter(|(_, on)| **on);
        let held: Vec<usize> = pressing().map(|(bound, _)| bound.dof).collect();
        c.write(|c| pressing().for_each(|(bound, _)| c[bound.dof] = bound.gap))?;
        let system = System { held: &held, added: None };
        self.elastic.solve(problem, system, problem.load, c, problem.linear_residual(), report)
    }

    /// The nodes where the guess was wrong, beyond what the KKT tolerance allows.
    fn wrong(&self, problem: &ContactProblem, c: &Vector) -> Result<Vec<usize>, PetscError> {
        let size = problem.size(c)?;
        let slack = 0.1 * problem.tolerance;
        let pull = slack * problem.force_scale / (problem.all_bounds() as f64).sqrt();
        c.read(|c| {
            self.elastic.forces(|p| {
                let wrong = |i: &usize| {
                    let bound = &problem.bounds[*i];
                    match self.pressing[*i] {
                        true => p[bound.dof] < -pull,
                        false => c[bound.dof] - bound.gap > slack * size,
                    }
                };
                (0..problem.bounds.len()).filter(wrong).collect()
            })
        })?
    }

    /// Exchanges the chosen nodes; false if that changes nothing.
    fn exchange(
        &mut self,
        problem: &ContactProblem,
        c: &Vector,
        nodes: &[usize],
    ) -> Result<bool, PetscError> {
        let old = self.pressing.clone();
        nodes.iter().for_each(|&i| self.pressing[i] = !self.pressing[i]);
        if !self.hold(problem, c)? {
            // Keep those that were pressing: only close gaps.
            self.pressing.iter_mut().zip(&old).for_each(|(new, old)| *new |= *old);
        }
        Ok(problem.ranks.any(self.pressing != old))
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
        let touches = |c: &[f64]| problem.bounds.iter().map(|b| c[b.dof] >= b.gap).collect();
        self.pressing = c.read(touches)?;
        Ok(report)
    }
}

impl ContactSolver for ActiveSet<'_> {
    fn name(&self) -> &'static str {
        "active-set"
    }

    fn warm_start(&self) -> Vec<f64> {
        self.pressing.iter().map(|&on| if on { 1.0 } else { 0.0 }).collect()
    }

    fn set_warm_start(&mut self, kept: &[f64]) {
        self.pressing = kept.iter().map(|&on| on != 0.0).collect();
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let mut report = ContactReport::default();
        let mut choice = Exchange::new();
        self.first_guess(problem, c)?;
        let most = 30 + 5 * problem.all_bounds();
        while report.iterations < most {
            report.iterations += 1;
            if !self.solve_pressing(problem, c, &mut report)? {
                break;
            }
            let wrong = self.wrong(problem, c)?;
            let all_wrong = problem.ranks.count(wrong.len());
            if all_wrong == 0 {
                return Ok(report);
            }
            let single = choice.single(all_wrong);
            report.fallbacks += usize::from(single && all_wrong > 1);
            let chosen = if single { last(problem.ranks, &wrong) } else { &wrong };
            if !self.exchange(problem, c, chosen)? {
                // The forces of nodes that hold a balanced body are rounding; the certificate
                // judges them.
                return Ok(report);
            }
        }
        self.rescue(problem, c, report)
    }
}

/// Block principal pivoting (Júdice and Pires, Comput. Oper. Res. 21, 1994): all wrong nodes
/// are exchanged while their number falls, or for a few times more; then only the last of them
/// (Murty's rule, finite for positive definite matrices) until it has fallen.
struct Exchange {
    fewest: usize,
    patience: usize,
}

const PATIENCE: usize = 5;

impl Exchange {
    fn new() -> Self {
        Self { fewest: usize::MAX, patience: PATIENCE }
    }

    /// Whether only one of so many wrong nodes is to be exchanged.
    fn single(&mut self, wrong: usize) -> bool {
        if wrong < self.fewest {
            (self.fewest, self.patience) = (wrong, PATIENCE);
            return false;
        }
        let single = self.patience == 0;
        self.patience = self.patience.saturating_sub(1);
        single
    }
}

/// The last of all ranks' `wrong` nodes, which are numbered rank by rank; nothing on the others.
fn last(ranks: Ranks, wrong: &[usize]) -> &[usize] {
    let holder = if wrong.is_empty() { -1.0 } else { ranks.rank() as f64 };
    let holds = ranks.max(holder) == ranks.rank() as f64;
    if holds { &wrong[wrong.len().saturating_sub(1)..] } else { &[] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exchanges_one_node_when_the_number_of_wrong_ones_stops_falling() {
        let mut choice = Exchange::new();
        assert!(!choice.single(3));
        for _ in 0..PATIENCE {
            assert!(!choice.single(3));
        }
        assert!(choice.single(3));
        assert_eq!(last(Ranks::alone(), &[3, 4, 5]), [5]);
        assert!(!choice.single(2), "progress restores the block exchange");
    }
}
