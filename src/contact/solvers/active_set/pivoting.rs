//! How the active set changes.

use crate::{
    cholesky::Condensed,
    contact::{Bound, ContactProblem, rigid_motion_until_contact},
    petsc::{Communicator, PetscError, Vector},
};

/// The answer for a guess of the active set, at the bounds of this rank.
pub(in super::super) struct AtBounds {
    /// c, m.
    pub(in super::super) c: Vec<f64>,
    /// p, N.
    p: Vec<f64>,
    /// The largest displacement of the body, m.
    pub(in super::super) displacement: f64,
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
    pub(in super::super) fn changes(
        &self,
        problem: &ContactProblem,
        active: &[f64],
    ) -> Vec<Option<f64>> {
        let sides = problem.bounds.iter().zip(active).zip(&self.c);
        sides.map(|((bound, side), c)| Some(bound.at(*side)? - c)).collect()
    }
}

/// Changes of the active set by what violates the conditions.
///
/// Pivoting on all violating indices may return to an earlier set, and where a slender body bends to its
/// obstacle it does. Where their number has not fallen for a few times, the set begins again empty, and all
/// indices that pull leave it or, if none does, the deepest one joins it. Where that takes too long only
/// the last violating index is pivoted on (block principal pivoting, Júdice and Pires, Comput. Oper.
/// Res. 21, 1994, with Murty's rule, finite for positive definite K). Where K
/// is singular and A leaves a rigid motion unconstrained, the body moves as the load drives it
/// until further bounds are reached.
pub(super) struct Pivoting<'p> {
    problem: &'p ContactProblem<'p>,
    /// The fewest violating indices so far, and how many times their number may still fail to fall.
    fewest: usize,
    patience: usize,
    /// Iterations that the set may still grow by one index at a time, once it has begun again.
    growth: Option<usize>,
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

impl<'p> Pivoting<'p> {
    pub(super) fn new(problem: &'p ContactProblem<'p>) -> Self {
        Self { problem, fewest: usize::MAX, patience: PATIENCE, growth: None }
    }

    /// Changes after which it is given up.
    pub(super) fn limit(&self) -> usize {
        30 + GROWTH + 5 * self.problem.bound_count()
    }

    /// Whether the number of violating indices has fallen every time.
    pub(super) fn is_fast(&self) -> bool {
        self.growth.is_none() && self.patience == PATIENCE
    }

    /// Changes the active set, whose answer is given; false if that is admissible, or nothing changes: the
    /// forces of bounds that support a balanced body are rounding, and the certificate judges them.
    /// Counts a set that begins again among the `fallbacks`. Collective.
    pub(super) fn pivot(
        &mut self,
        active: &mut [f64],
        answer: &AtBounds,
        fallbacks: &mut usize,
    ) -> Result<bool, PetscError> {
        let (problem, violating) = (self.problem, self.violating(active, answer));
        let count = problem.comm.count(violating.len());
        if count == 0 {
            return Ok(false);
        }
        let stuck = count >= self.fewest && self.patience == 0;
        (self.fewest, self.patience) = match count < self.fewest {
            true => (count, PATIENCE),
            false => (self.fewest, self.patience.saturating_sub(1)),
        };
        if stuck && self.growth.is_none() {
            self.growth = Some(GROWTH);
            *fallbacks += 1;
            active.fill(0.0);
            constrain_rigid_motions(problem, active, &answer.c);
            return Ok(true);
        }
        let chosen = match &mut self.growth {
            Some(0) if stuck => last(problem.comm, &violating),
            None | Some(0) => &violating,
            Some(left) => {
                *left -= 1;
                &careful(problem.comm, &violating)
            }
        };
        let old = active.to_vec();
        chosen.iter().for_each(|one| active[one.index] = one.side);
        support(problem, active, &old, &answer.c);
        Ok(problem.comm.any(*active != old[..]))
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
    fallbacks: &mut usize,
) -> Result<(), PetscError> {
    let changes = |active: &[f64]| start.changes(problem, active);
    let (mut best, mut pivoting) = (active.clone(), Pivoting::new(problem));
    for _ in 0..pivoting.limit() {
        let Some([x, p]) = condensed.solve(&changes(active))? else { break };
        best.clone_from(active);
        let c = start.c.iter().zip(x).map(|(c, x)| c + x).collect();
        let answer = AtBounds { c, p, displacement: start.displacement };
        if !pivoting.pivot(active, &answer, fallbacks)? {
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
pub(in super::super) fn support(
    problem: &ContactProblem,
    active: &mut [f64],
    old: &[f64],
    c: &[f64],
) {
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
