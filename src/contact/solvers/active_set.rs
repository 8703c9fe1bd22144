//! The primal-dual active set method.

mod pivoting;

use super::{ContactReport, ContactSolver, SolverEntry};
use crate::{
    cholesky::{Factor, LinearSolver},
    contact::{Bound, ContactError, ContactProblem, Kkt, elastic::ElasticSolver},
    petsc::{PetscError, Session, Vector},
};
use pivoting::{AtBounds, Pivoting, constrain_rigid_motions, pivot_condensed};

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
/// With a condensed factor, of K at an earlier ζ, that is done first in the small problem that is left for
/// the bounded unknowns when all others are eliminated, and K decides whether the set found there is
/// right. [`Pivoting`] has the rules of both.
pub(super) struct ActiveSet<'s> {
    /// Of each bound the sign of its contact force: 1 at the upper bound, −1 at the lower one, 0
    /// where neither is active.
    active: Vec<f64>,
    elastic: ElasticSolver<'s>,
}

impl<'s> ActiveSet<'s> {
    /// Called `name`: the set of a problem without bounds is empty, and its first solve the last.
    pub(super) fn new(session: &'s Session, name: &'static str) -> Self {
        Self { active: Vec::new(), elastic: ElasticSolver::new(session, name) }
    }

    /// The set to begin with: the last one, or the bounds that the start reaches.
    fn first_guess(&mut self, problem: &ContactProblem, c: &Vector) -> Result<(), PetscError> {
        if self.active.len() != problem.bounds.len() {
            let c = problem.at_bounds(c)?;
            self.active = problem.bounds.iter().zip(c).map(|(b, c)| b.side(c)).collect();
        }
        // A lower bound may have been one for the last problem only.
        for (side, bound) in self.active.iter_mut().zip(problem.bounds) {
            if *side < 0.0 && bound.lower.is_infinite() {
                *side = 0.0;
            }
        }
        let c = problem.at_bounds(c)?;
        if !constrain_rigid_motions(problem, &mut self.active, &c) {
            self.active.fill(1.0);
        }
        Ok(())
    }

    /// Sets the active unknowns to their bounds, and returns them.
    fn prescribe(
        &self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<Vec<usize>, PetscError> {
        let values = self.values(problem);
        c.write(|c| values.iter().for_each(|&(dof, value)| c[dof] = value))?;
        Ok(values.into_iter().map(|(dof, _)| dof).collect())
    }

    /// The active unknowns and their bounds.
    fn values(&self, problem: &ContactProblem) -> Vec<(usize, f64)> {
        let sides = problem.bounds.iter().zip(&self.active);
        let at = |(bound, side): (&Bound, &f64)| Some((bound.dof, bound.at(*side)?));
        sides.filter_map(at).collect()
    }

    /// Minimises with the active unknowns at their bounds and no other bound; with `small` the active set is
    /// first found anew in the condensed problem, where the factor is condensed.
    fn solve_equality(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
        small: bool,
        report: &mut ContactReport,
    ) -> Result<AtBounds, ContactError> {
        let mut prescribed = self.prescribe(problem, c)?;
        let small = small && self.elastic.is_condensed(problem)?;
        if !small {
            let load = (problem.load, problem.linear_residual());
            self.elastic.solve(problem, problem.system_with(&prescribed), load, c, report)?;
        } else if !self.elastic.start(problem, problem.system_with(&prescribed), c)? {
            let start = AtBounds::new(problem, c, Vec::new())?;
            let Self { active, elastic } = self;
            let before = active.clone();
            let condensed = elastic.condense(problem, problem.system_with(&prescribed), report)?;
            if let Some(mut condensed) = condensed {
                pivot_condensed(problem, active, &start, &mut condensed, report)?;
                let moved = problem.comm.any(*active != before);
                prescribed = self.values(problem).into_iter().map(|(dof, _)| dof).collect();
                self.elastic.expand(problem, problem.system_with(&prescribed), moved, c)?;
            }
            self.elastic.finish(problem, problem.system_with(&prescribed), c, report)?;
        }
        let at_bounds = |p: &[f64]| problem.bounds.iter().map(|bound| p[bound.dof]).collect();
        Ok(AtBounds::new(problem, c, self.elastic.forces(at_bounds)?)?)
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

    fn factor(&mut self) -> Option<&mut Factor> {
        self.elastic.factor()
    }

    fn into_linear_solver(self: Box<Self>) -> Option<LinearSolver> {
        self.elastic.into_linear_solver()
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        let mut report = ContactReport::default();
        let mut pivoting = Pivoting::new(problem);
        self.first_guess(problem, c)?;
        for _ in 0..pivoting.limit() {
            let before = report.iterations;
            let answer = self.solve_equality(problem, c, pivoting.is_fast(), &mut report)?;
            // A guess is an iteration, or as many as it took to find another in its place.
            report.iterations = report.iterations.max(before + 1);
            if !pivoting.pivot(&mut self.active, &answer, &mut report.fallbacks)? {
                return Ok(report);
            }
        }
        let detail = "the active set still changes";
        Err(ContactError::stopped(self.name(), report, Kkt::UNKNOWN, detail))
    }
}
