//! How the active set changes.

use crate::{
    contact::{Bound, ContactProblem, ContactReport, rigid_motion_until_contact},
    linear::Condensed,
    petsc::{Communicator, PetscError, Vector},
};

/// The answer for a guess of the active set, at the bounds of this rank.
pub(super) struct AtBounds {
    /// c, m.
    pub(super) c: Vec<f64>,
    /// p, N.
    p: Vec<f64>,
    /// The largest displacement of the body, m.
    pub(super) displacement: f64,
}

impl AtBounds {
    /// Of the displacements `c` with the contact forces `p`. Collective.
    pub(super) fn new(
        problem: &ContactProblem,
        c: &Vector,
        p: Vec<f64>,
    ) -> Result<Self, PetscError> {
        let displacement = problem.max_norm(c)?;
        Ok(Self { c: problem.at_bounds(c)?, p, displacement })
    }

    /// By how much each active unknown changes to its bound; `None` for the others.
    pub(super) fn changes(&self, problem: &ContactProblem, active: &[f64]) -> Vec<Option<f64>> {
        let sides = problem.bounds.iter().zip(active).zip(&self.c);
        sides.map(|((bound, side), c)| Some(bound.at(*side)? - c)).collect()
    }
}

/// Changes of the active set by what violates the conditions: indices that pull leave it, and of those
/// beyond their bounds the locally deepest join it, to which K couples none that is deeper.
///
/// Pivoting on all violating indices would press whole stretches of a slender body to an obstacle that it
/// touches in a point or two: there they pull, and when released go through the opposite obstacle. The locally
/// deepest tell the shape (as in the algorithm of Remez), and what does lie against the obstacle is halved
/// each time.
///
/// Where that takes long it may be a cycle, and the dual problem is solved: max over p ≥ 0 of the least energy
/// Π(p) (as Lawson and Hanson do, Solving Least Squares Problems, 1974, chapter 23). From p̄ ≥ 0 the forces
/// move towards those of the set, p, until the first that are to pull are zero. Their indices leave the set;
/// where none pulls, the locally deepest join.
///
/// This ends for every convex problem. Π is concave and p its maximum for the set, so Π rises with every move
/// that is not of length zero. Those that join have p̄ = 0, and ∂Π/∂p̄ > 0 is their depth: as Π rises towards
/// p, some of their forces are positive. The others may leave by moves of length zero, at most as many as
/// joined, and then Π rises. So no set has its p̄ = p a second time, and there are finitely many sets.
///
/// Where K is singular and A leaves a rigid motion unconstrained, the body moves as the load drives it
/// until further bounds are reached.
pub(super) struct Pivoting<'p> {
    problem: &'p ContactProblem<'p>,
    /// Pivots that may still be made before the dual problem is solved.
    primal_pivots: usize,
    /// p̄ of the dual problem, N, positive where a bound presses.
    forces: Option<Vec<f64>>,
}

/// Pivots before the dual problem is solved: on 1800 steps of strips 40 to 200 times as long as high the
/// median was 5.
const PRIMAL_PIVOTS: usize = 20;
/// Up to so many the condensed problem is asked before each.
const FAST: usize = 5;
/// Depths that differ by less than this, relatively, are equal.
const EQUAL: f64 = 1e-6;

/// An index that violates the conditions.
#[derive(Debug, Clone, Copy)]
struct Violation {
    index: usize,
    /// The sign that its contact force should have.
    side: f64,
    /// How far c is beyond a bound that is not active, m; 0 for an active one, which pulls.
    depth: f64,
}

impl<'p> Pivoting<'p> {
    pub(super) fn new(problem: &'p ContactProblem<'p>) -> Self {
        debug_assert!(problem.bounds.is_sorted_by_key(|bound| bound.dof));
        Self { problem, primal_pivots: PRIMAL_PIVOTS, forces: None }
    }

    /// Changes after which it is given up.
    pub(super) fn limit(&self) -> usize {
        30 + PRIMAL_PIVOTS + 5 * self.problem.bound_count()
    }

    /// Whether few changes were made yet.
    pub(super) fn is_fast(&self) -> bool {
        self.primal_pivots + FAST > PRIMAL_PIVOTS
    }

    /// Changes the active set, whose answer is given; false if that is admissible, or nothing changes: the
    /// forces of bounds that support a balanced body are rounding, and the certificate judges them.
    /// Counts the change to the dual problem among the `fallbacks`. Collective.
    pub(super) fn pivot(
        &mut self,
        active: &mut [f64],
        answer: &AtBounds,
        fallbacks: &mut usize,
    ) -> Result<bool, PetscError> {
        let (comm, violating) = (self.problem.comm, self.violating(active, answer));
        let count = comm.count(violating.len());
        if count == 0 {
            return Ok(false);
        }
        let deepest = self.locally_deepest(&violating)?;
        let chosen = match self.primal_pivots {
            0 => self.ascend(active, &violating, answer).unwrap_or_else(|| deepest.clone()),
            _ => deepest.clone(),
        };
        *fallbacks += usize::from(self.primal_pivots == 1);
        self.primal_pivots = self.primal_pivots.saturating_sub(1);
        let choices = [&chosen, &deepest, last(comm, &violating)];
        Ok(choices.into_iter().any(|chosen| self.change(active, chosen, answer)))
    }

    /// Moves p̄ towards the forces of the active set, and returns the indices that are to leave it; `None` if
    /// it gets there. Collective.
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

    /// Gives the `chosen` indices their sides, and the body the support that it then lacks; whether the
    /// active set is then another. Collective.
    fn change(&self, active: &mut [f64], chosen: &[Violation], answer: &AtBounds) -> bool {
        let old = active.to_vec();
        chosen.iter().for_each(|one| active[one.index] = one.side);
        support(self.problem, active, &old, &answer.c);
        self.problem.comm.any(*active != old[..])
    }

    /// Of the `violating` indices those that pull, and those beyond their bounds to which K couples none that
    /// is deeper.
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
            if pulls || !stiffness.read_row(row(one), |columns, _| columns.iter().any(is_deeper))? {
                deepest.push(*one);
            }
        }
        Ok(deepest)
    }

    /// The indices that violate the conditions beyond what the KKT tolerance allows: p = f − Kc is at
    /// least 0 at an upper bound and at most 0 at a lower one, and lower ≤ c ≤ upper elsewhere.
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

/// Pivots in the problem of the bounded unknowns alone, from `start`, with the active set at its bounds,
/// until that is admissible there. Collective.
pub(super) fn pivot_condensed(
    problem: &ContactProblem,
    active: &mut Vec<f64>,
    start: &AtBounds,
    condensed: &mut Condensed,
    report: &mut ContactReport,
) -> Result<(), PetscError> {
    let changes = |active: &[f64]| start.changes(problem, active);
    let (mut best, mut pivoting) = (active.clone(), Pivoting::new(problem));
    for _ in 0..pivoting.limit() {
        let Some([x, p]) = condensed.solve(&changes(active))? else { break };
        best.clone_from(active);
        report.iterations += 1;
        let c = start.c.iter().zip(x).map(|(c, x)| c + x).collect();
        let answer = AtBounds { c, p, displacement: start.displacement };
        if !pivoting.pivot(active, &answer, &mut report.fallbacks)? {
            break;
        }
    }
    if problem.comm.any(*active != best) {
        active.clone_from(&best);
        condensed.solve(&changes(active))?;
    }
    Ok(())
}

/// As [`constrain_rigid_motions`]; where it finds no bound, no index leaves the `old` active set, which open
/// ones only join.
pub(super) fn support(problem: &ContactProblem, active: &mut [f64], old: &[f64], c: &[f64]) {
    if !constrain_rigid_motions(problem, active, c) {
        for (new, old) in active.iter_mut().zip(old) {
            *new = if *new == 0.0 { *old } else { *new };
        }
    }
}

/// Where the active set leaves a rigid motion unconstrained: lets the body move as the load drives it,
/// from c at the bounds, until it reaches a further bound. False if there is none; the load being
/// balanced, it is then rounding that drives the motion. Collective.
pub(super) fn constrain_rigid_motions(
    problem: &ContactProblem,
    active: &mut [f64],
    c: &[f64],
) -> bool {
    let motions = (problem.rigid, problem.work);
    rigid_motion_until_contact(problem.comm, motions, problem.bounds, c, active, true).1
}

/// The last of all ranks' `violating` indices, which are numbered rank by rank; nothing on the
/// others.
fn last<T>(comm: Communicator, violating: &[T]) -> &[T] {
    let owner = if violating.is_empty() { -1.0 } else { comm.rank() as f64 };
    let is_owner = comm.max(owner) == comm.rank() as f64;
    if is_owner { &violating[violating.len().saturating_sub(1)..] } else { &[] }
}
