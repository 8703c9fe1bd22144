//! The primal-dual active set method.

mod pivoting;

use super::{ContactReport, ContactSolver, SolverEntry};
use crate::{
    archive::{Archive, ArchiveError},
    cholesky::{Choose, Condensed, Factor, LinearSystem},
    contact::{Bound, ContactError, ContactProblem, Kkt, elastic::ElasticSolver},
    petsc::{PetscError, Session, Vector},
};
pub(super) use pivoting::{AtBounds, support};
use pivoting::{Pivoting, constrain_rigid_motions, pivot_condensed};

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
    pub(super) elastic: ElasticSolver<'s>,
}

/// Replaces the active set by that of the condensed problem, whose last solve must be with it, given the
/// displacements at the start of the solve. Collective.
pub(super) type Chooser<'a> = &'a mut dyn FnMut(
    &mut Vec<f64>,
    &AtBounds,
    &mut Condensed,
    &mut ContactReport,
) -> Result<(), ContactError>;

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

    /// Minimises with the active unknowns at their bounds and no other bound; with a chooser the active set
    /// is first chosen anew where the factor is condensed.
    fn solve_equality(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
        chooser: Option<Chooser>,
        report: &mut ContactReport,
    ) -> Result<AtBounds, ContactError> {
        let Self { active, elastic } = self;
        let sides = problem.bounds.iter().zip(&*active);
        let at = |(bound, side): (&Bound, &f64)| Some((bound.dof, bound.at(*side)?));
        let values: Vec<(usize, f64)> = sides.filter_map(at).collect();
        let prescribed: Vec<usize> = values.iter().map(|(dof, _)| *dof).collect();
        c.write(|c| values.iter().for_each(|&(dof, value)| c[dof] = value))?;
        let prescribed = (problem.bound_count() > 0).then_some(&prescribed[..]);
        let system = LinearSystem { prescribed, ..problem.system() };
        let start = AtBounds::new(problem, c, Vec::new())?;
        let (first, mut chosen) = (active.clone(), *report);
        let mut choose = chooser.map(|chooser| {
            |condensed: &mut Condensed| {
                chooser(active, &start, condensed, &mut chosen)?;
                Ok(problem.comm.any(*active != first).then(|| start.changes(problem, active)))
            }
        });
        let choose = choose.as_mut().map(|choose| choose as Choose<ContactError>);
        let load = (problem.load, problem.linear_residual());
        elastic.solve(problem.bounds, system, load, c, choose, report)?;
        let ContactReport { linear_iterations, factorisations, .. } = *report;
        *report = ContactReport { linear_iterations, factorisations, ..chosen };
        let at_bounds = |p: &[f64]| problem.bounds.iter().map(|bound| p[bound.dof]).collect();
        Ok(AtBounds::new(problem, c, elastic.forces(at_bounds)?)?)
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

    fn into_factor(self: Box<Self>) -> Option<Factor> {
        self.elastic.into_factor()
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
    ) -> Result<ContactReport, ContactError> {
        self.solve_by(problem, c, &mut |active, start, condensed, report| {
            Ok(pivot_condensed(problem, active, start, condensed, &mut report.fallbacks)?)
        })
    }
}

impl ActiveSet<'_> {
    /// Solves with the active set that `chooser` finds in the condensed problem, pivoting on where K shows
    /// that another is needed.
    pub(super) fn solve_by(
        &mut self,
        problem: &ContactProblem,
        c: &mut Vector,
        chooser: Chooser,
    ) -> Result<ContactReport, ContactError> {
        let mut report = ContactReport::default();
        let mut pivoting = Pivoting::new(problem);
        self.first_guess(problem, c)?;
        for _ in 0..pivoting.limit() {
            let before = report.iterations;
            let chooser: Option<Chooser> = if pivoting.is_fast() { Some(chooser) } else { None };
            let answer = self.solve_equality(problem, c, chooser, &mut report)?;
            // A guess is an iteration, or as many as it took to choose another in its place.
            report.iterations = report.iterations.max(before + 1);
            if !pivoting.pivot(&mut self.active, &answer, &mut report.fallbacks)? {
                return Ok(report);
            }
        }
        let detail = "the active set still changes";
        Err(ContactError::stopped(self.name(), report, Kkt::UNKNOWN, detail))
    }
}
