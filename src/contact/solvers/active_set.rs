//! The primal-dual active set method.

mod pivoting;

use super::{ContactReport, ContactSolver, SolverEntry};
use crate::{
    contact::{Bound, ContactError, ContactProblem, Kkt},
    linear::LinearSolver,
    petsc::{PetscError, Vector},
};
use pivoting::{AtBounds, MAX_PIVOTS, constrain_rigid_motions, pivot, pivot_condensed};
use std::rc::Rc;

pub(super) const ACTIVE_SET: SolverEntry = SolverEntry {
    name: "active-set",
    summary: "primal-dual active set method, one linear solve per guess of the active nodes",
    variants: &[],
    rescuer: Some("tao"),
    construct: |_, _| Rc::new(ActiveSet { name: ACTIVE_SET.name }),
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
/// A condensed factor, perhaps of K at an earlier ζ, gives a small problem for the bounded unknowns. The
/// method first finds the active set of this problem, and then checks the set with K. [`pivot`] has the
/// rule for both.
///
/// The active set has an entry per bound: 1 if the upper bound is active, −1 if the lower one is, else 0.
pub(super) struct ActiveSet {
    /// Its name, or `linear` for a problem without bounds, which takes one linear solve.
    pub(super) name: &'static str,
}

impl ContactSolver for ActiveSet {
    fn name(&self) -> &'static str {
        self.name
    }

    fn solve(
        &self,
        problem: &ContactProblem,
        elastic: &mut LinearSolver,
        warm: &mut Vec<f64>,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let mut report = ContactReport::default();
        debug_assert!(problem.bounds.is_sorted_by_key(|bound| bound.dof));
        first_guess(problem, warm, c)?;
        for _ in 0..MAX_PIVOTS {
            let before = report.iterations;
            let answer = match elastic.is_condensed(problem.stiffness)? {
                true => self.solve_condensed(problem, elastic, warm, c, &mut report)?,
                false => self.solve_whole(problem, elastic, warm, c, &mut report)?,
            };
            // A guess counts as one iteration, or as the iterations of the small problem.
            report.iterations = report.iterations.max(before + 1);
            if !pivot(problem, warm, &answer)? {
                return Ok(report);
            }
        }
        let detail = "the set of nodes in contact still changes";
        Err(ContactError::stopped(self.name, report, Kkt::UNKNOWN, detail))
    }
}

impl ActiveSet {
    /// Solves with the active unknowns at their bounds, without other bounds.
    fn solve_whole(
        &self,
        problem: &ContactProblem,
        elastic: &mut LinearSolver,
        active: &[f64],
        c: &mut Vector,
        report: &mut ContactReport,
    ) -> Result<AtBounds, ContactError> {
        let prescribed = prescribe(problem, active, c)?;
        let (system, limit) = (problem.system_with(&prescribed), problem.linear_residual());
        let solve = elastic.solve_renewing(system, problem.load, c, limit)?;
        report.add_solve(self.name, solve)?;
        answer(problem, elastic, c)
    }

    /// The same, after finding the active set of the condensed problem. If none is found there, all unknowns decide.
    fn solve_condensed(
        &self,
        problem: &ContactProblem,
        elastic: &mut LinearSolver,
        active: &mut [f64],
        c: &mut Vector,
        report: &mut ContactReport,
    ) -> Result<AtBounds, ContactError> {
        let prescribed = prescribe(problem, active, c)?;
        let (system, limit) = (problem.system_with(&prescribed), problem.linear_residual());
        if elastic.start(system, problem.load, c, limit)? {
            return answer(problem, elastic, c);
        }
        let (start, before) = (AtBounds::new(problem, c, Vec::new())?, active.to_vec());
        report.factorisations += elastic.prepare(system)?;
        let found = match elastic.condense()? {
            Some(mut condensed) => {
                pivot_condensed(problem, active, &start, &mut condensed, report)?
            }
            None => false,
        };
        if !found {
            return self.solve_whole(problem, elastic, active, c, report);
        }
        let moved = problem.comm.any(*active != before);
        let prescribed: Vec<_> = values(problem, active).into_iter().map(|(dof, _)| dof).collect();
        let system = problem.system_with(&prescribed);
        elastic.expand(system, moved, c)?;
        let solve = elastic.finish(system, c, limit)?;
        report.add_solve(self.name, solve)?;
        answer(problem, elastic, c)
    }
}

/// The first active set: the last one, or the bounds that the start reaches.
fn first_guess(
    problem: &ContactProblem,
    active: &mut Vec<f64>,
    c: &Vector,
) -> Result<(), PetscError> {
    let c = problem.at_bounds(c)?;
    if active.len() != problem.bounds.len() {
        *active = problem.bounds.iter().zip(&c).map(|(b, c)| b.side(*c)).collect();
    }
    constrain_rigid_motions(problem, active, &c);
    Ok(())
}

/// Sets the active unknowns to their bounds, and returns them.
fn prescribe(
    problem: &ContactProblem,
    active: &[f64],
    c: &mut Vector,
) -> Result<Vec<usize>, PetscError> {
    let values = values(problem, active);
    c.write(|c| values.iter().for_each(|&(dof, value)| c[dof] = value))?;
    Ok(values.into_iter().map(|(dof, _)| dof).collect())
}

/// The active unknowns and their bounds.
fn values(problem: &ContactProblem, active: &[f64]) -> Vec<(usize, f64)> {
    let sides = problem.bounds.iter().zip(active);
    let at = |(bound, side): (&Bound, &f64)| Some((bound.dof, bound.at(*side)?));
    sides.filter_map(at).collect()
}

/// The answer of the last solve at the bounds.
fn answer(
    problem: &ContactProblem,
    elastic: &LinearSolver,
    c: &Vector,
) -> Result<AtBounds, ContactError> {
    Ok(AtBounds::new(problem, c, problem.at_bounds(elastic.residual())?)?)
}
