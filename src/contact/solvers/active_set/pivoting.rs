//! How the active set changes.

use crate::{
    contact::{Bound, ContactProblem, ContactReport, rigid_motion_until_contact},
    linear::CondensedSystem,
    petsc::{PetscError, Vector},
};

/// The answer for a guess of the active set, at the bounds of this rank.
pub(super) struct AtBounds {
    /// c, m.
    c: Vec<f64>,
    /// p, N.
    p: Vec<f64>,
    /// The largest displacement of the body, m.
    displacement: f64,
}

impl AtBounds {
    /// Takes the unknowns at the bounds from the displacements `c`, and keeps the contact forces `p`. Collective.
    pub(super) fn new(
        problem: &ContactProblem,
        c: &Vector,
        p: Vec<f64>,
    ) -> Result<Self, PetscError> {
        let displacement = problem.max_norm(c)?;
        Ok(Self { c: problem.at_bounds(c)?, p, displacement })
    }

    /// The change of each active unknown to its bound; `None` for the others.
    fn changes(&self, problem: &ContactProblem, active: &[f64]) -> Vec<Option<f64>> {
        let sides = problem.bounds.iter().zip(active).zip(&self.c);
        sides.map(|((bound, side), c)| Some(bound.at(*side)? - c)).collect()
    }
}

/// Updates the active set by the violating indices. Indices with a pulling force leave the set. Of the
/// indices beyond their bounds the locally deepest join it: K couples them to no deeper one.
///
/// Pivoting on all violating indices would press long parts of a slender body to an obstacle that it touches
/// in a few points. There they pull, and after their release they penetrate the opposite obstacle. The
/// locally deepest indices describe the shape, as in the algorithm of Remez. Where the body lies against the
/// obstacle, each update halves the penetrating part.
///
/// After many updates, perhaps in a cycle, the method solves the dual problem: it maximises the minimum
/// energy Π(p) over p ≥ 0 (as Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23). From p̄ ≥
/// 0 the forces move towards the forces p of the set, until the first decreasing ones are zero. Their indices
/// leave the set. If no force of the set pulls, the locally deepest indices join.
///
/// This ends for every convex problem. Π is concave and p is its maximum for the set, so Π increases in every
/// move of positive length. Joining indices have p̄ = 0 and ∂Π/∂p̄ > 0, their depth. Π increases towards p,
/// so some of their forces are positive. The others may leave in moves of length zero, at most as many as
/// joined. Then Π increases. So no set reaches p̄ = p twice, and there are finitely many sets.
///
/// If K is singular and the active set leaves a rigid motion unconstrained, the body moves as the load drives
/// it until it reaches further bounds.
pub(super) struct Pivoting<'p> {
    problem: &'p ContactProblem<'p>,
    /// The number of updates before the dual problem.
    primal_pivots: usize,
    /// p̄ of the dual problem, N, positive for pressing bounds.
    forces: Option<Vec<f64>>,
}

/// The number of updates before the dual problem. Slender strips need about 5 (STABILITY.md).
///
/// Tuned on the 6 plain runs. Half: nothing changes. Twice: nothing changes.
const PRIMAL_PIVOTS: usize = 20;
/// Relative difference below which two depths count as equal.
const EQUAL: f64 = 1e-6;

/// An index that violates the conditions.
#[derive(Debug, Clone, Copy)]
struct Violation {
    index: usize,
    /// The sign that its contact force should have.
    side: f64,
    /// The distance of c beyond an inactive bound, m; 0 for an active bound with a pulling force.
    depth: f64,
}

impl<'p> Pivoting<'p> {
    pub(super) fn new(problem: &'p ContactProblem<'p>) -> Self {
        debug_assert!(problem.bounds.is_sorted_by_key(|bound| bound.dof));
        Self { problem, primal_pivots: PRIMAL_PIVOTS, forces: None }
    }

    /// The number of updates after which the method gives up.
    pub(super) fn limit(&self) -> usize {
        30 + PRIMAL_PIVOTS + 5 * self.problem.bound_count()
    }

    /// True before the dual problem: the condensed problem is solved first.
    pub(super) fn is_fast(&self) -> bool {
        self.primal_pivots > 0
    }

    /// Updates the active set from its answer, and adds bounds that support the body. It returns false if the
    /// answer is admissible or the set does not change: the remaining violations are rounding, and the
    /// certificate decides. It counts the change to the dual problem in `fallbacks`. Collective.
    pub(super) fn pivot(
        &mut self,
        active: &mut [f64],
        answer: &AtBounds,
        fallbacks: &mut usize,
    ) -> Result<bool, PetscError> {
        let violating = self.violating(active, answer);
        if self.problem.comm.count(violating.len()) == 0 {
            return Ok(false);
        }
        let leaving = match self.primal_pivots {
            0 => self.ascend(active, &violating, answer),
            _ => None,
        };
        let chosen = leaving.map_or_else(|| self.locally_deepest(&violating), Ok)?;
        *fallbacks += usize::from(self.primal_pivots == 1);
        self.primal_pivots = self.primal_pivots.saturating_sub(1);
        let old = active.to_vec();
        chosen.iter().for_each(|one| active[one.index] = one.side);
        constrain_rigid_motions(self.problem, active, &answer.c);
        Ok(self.problem.comm.any(*active != old[..]))
    }

    /// Moves p̄ towards the forces of the active set. Returns the indices that leave the set, or `None` if p̄
    /// reaches these forces. Collective.
    fn ascend(
        &mut self,
        active: &[f64],
        violating: &[Violation],
        answer: &AtBounds,
    ) -> Option<Vec<Violation>> {
        let comm = self.problem.comm;
        let new: Vec<f64> = active.iter().zip(&answer.p).map(|(side, p)| side * p).collect();
        let pressing = || new.iter().map(|p| p.max(0.0)).collect();
        let forces = self.forces.get_or_insert_with(pressing);
        let part = |one: &Violation| forces[one.index] / (forces[one.index] - new[one.index]);
        let pulling = || violating.iter().filter(|one| one.side == 0.0);
        let first = pulling().map(part).fold(f64::INFINITY, f64::min);
        let (first, _) = comm.min_with_rank(first);
        if first == f64::INFINITY {
            *forces = pressing();
            return None;
        }
        let leaving: Vec<_> = pulling().filter(|one| part(one) <= first).copied().collect();
        forces.iter_mut().zip(&new).for_each(|(p, new)| *p = (*p + first * (new - *p)).max(0.0));
        leaving.iter().for_each(|one| forces[one.index] = 0.0);
        Some(leaving)
    }

    /// The `violating` indices with a pulling force, and those beyond their bounds that K couples to no
    /// deeper one.
    fn locally_deepest(&self, violating: &[Violation]) -> Result<Vec<Violation>, PetscError> {
        let ContactProblem { stiffness, bounds, .. } = self.problem;
        let row = |one: &Violation| stiffness.rows().start + bounds[one.index].dof as i32;
        let mut deepest = Vec::new();
        for one in violating {
            let is_deeper = |column: &i32| {
                let other = violating.binary_search_by_key(column, row);
                other.is_ok_and(|i| violating[i].depth > (1.0 + EQUAL) * one.depth)
            };
            let pulls = one.side == 0.0;
            if pulls
                || !stiffness.read_columns(row(one), |columns| columns.iter().any(is_deeper))?
            {
                deepest.push(*one);
            }
        }
        Ok(deepest)
    }

    /// The indices that violate the conditions beyond the KKT tolerance: p = f − Kc ≥ 0 at an upper bound, p
    /// ≤ 0 at a lower one, and lower ≤ c ≤ upper elsewhere.
    fn violating(&self, active: &[f64], answer: &AtBounds) -> Vec<Violation> {
        let problem = self.problem;
        let slack = 0.1 * problem.tolerance;
        let depth = slack * problem.scales.displacement.max(answer.displacement);
        let pull = slack * problem.scales.force / (problem.bound_count() as f64).sqrt();
        let violation = |(index, bound): (usize, &Bound)| {
            let (c, p, side) = (answer.c[index], answer.p[index], active[index]);
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
    }
}

/// Updates the active set in the small problem of the bounded unknowns, from `start`, until its answer is
/// admissible. Returns false if it stops before: at a set that leaves the small problem singular. Collective.
pub(super) fn pivot_condensed(
    problem: &ContactProblem,
    active: &mut [f64],
    start: &AtBounds,
    condensed: &mut CondensedSystem,
    report: &mut ContactReport,
) -> Result<bool, PetscError> {
    let mut pivoting = Pivoting::new(problem);
    for _ in 0..pivoting.limit() {
        let Some([x, p]) = condensed.solve(&start.changes(problem, active))? else { break };
        report.iterations += 1;
        let c = start.c.iter().zip(x).map(|(c, x)| c + x).collect();
        let answer = AtBounds { c, p, displacement: start.displacement };
        if !pivoting.pivot(active, &answer, &mut report.fallbacks)? {
            return Ok(true);
        }
    }
    Ok(false)
}

/// If the active set leaves a rigid motion unconstrained, moves the body as the load drives it, from c at the
/// bounds, and adds the bounds that it reaches. Collective.
pub(super) fn constrain_rigid_motions(problem: &ContactProblem, active: &mut [f64], c: &[f64]) {
    let motions = (problem.rigid, problem.work);
    rigid_motion_until_contact(problem.comm, motions, problem.bounds, c, active, true);
}
