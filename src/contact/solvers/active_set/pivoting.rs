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

/// The number of updates after which the method stops, and its rescuer solves the problem. Random problems need 13 at
/// most, and slender strips about 5 (STABILITY.md).
pub(super) const MAX_PIVOTS: usize = 50;
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

/// Updates the active set by the indices that violate the conditions in its answer. Indices with a pulling force leave the
/// set. Of the indices beyond their bounds the locally deepest join it: K couples them to no deeper one.
///
/// Pivoting on all violating indices would press long parts of a slender body to an obstacle that it touches
/// in a few points. There they pull, and after their release they penetrate the opposite obstacle. The
/// locally deepest indices describe the shape, as in the algorithm of Remez. Where the body lies against the
/// obstacle, each update halves the penetrating part.
///
/// If K is singular and the active set leaves a rigid motion unconstrained, the body moves as the load drives
/// it until it reaches further bounds.
///
/// Returns false if the answer is admissible or the set does not change: the remaining violations are rounding, and the
/// certificate decides. Collective.
pub(super) fn pivot(
    problem: &ContactProblem,
    active: &mut [f64],
    answer: &AtBounds,
) -> Result<bool, PetscError> {
    let violating = violating(problem, active, answer);
    if problem.comm.count(violating.len()) == 0 {
        return Ok(false);
    }
    let old = active.to_vec();
    for one in locally_deepest(problem, &violating)? {
        active[one.index] = one.side;
    }
    constrain_rigid_motions(problem, active, &answer.c);
    Ok(problem.comm.any(*active != old[..]))
}

/// The `violating` indices with a pulling force, and those beyond their bounds that K couples to no
/// deeper one.
fn locally_deepest(
    problem: &ContactProblem,
    violating: &[Violation],
) -> Result<Vec<Violation>, PetscError> {
    let ContactProblem { stiffness, bounds, .. } = problem;
    let row = |one: &Violation| stiffness.rows().start + bounds[one.index].dof as i32;
    let mut deepest = Vec::new();
    for one in violating {
        let is_deeper = |column: &i32| {
            let other = violating.binary_search_by_key(column, row);
            other.is_ok_and(|i| violating[i].depth > (1.0 + EQUAL) * one.depth)
        };
        let pulls = one.side == 0.0;
        if pulls || !stiffness.read_stored(row(one), |columns, _| columns.iter().any(is_deeper))? {
            deepest.push(*one);
        }
    }
    Ok(deepest)
}

/// The indices that violate the conditions beyond the KKT tolerance: p = f − Kc ≥ 0 at an upper bound, p
/// ≤ 0 at a lower one, and lower ≤ c ≤ upper elsewhere.
fn violating(problem: &ContactProblem, active: &[f64], answer: &AtBounds) -> Vec<Violation> {
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

/// Updates the active set in the small problem of the bounded unknowns, from `start`, until its answer is
/// admissible. Returns false if it stops before: at a set that leaves the small problem singular. Collective.
pub(super) fn pivot_condensed(
    problem: &ContactProblem,
    active: &mut [f64],
    start: &AtBounds,
    condensed: &mut CondensedSystem,
    report: &mut ContactReport,
) -> Result<bool, PetscError> {
    for _ in 0..MAX_PIVOTS {
        let Some([x, p]) = condensed.solve(&start.changes(problem, active))? else { break };
        report.iterations += 1;
        let c = start.c.iter().zip(x).map(|(c, x)| c + x).collect();
        let answer = AtBounds { c, p, displacement: start.displacement };
        if !pivot(problem, active, &answer)? {
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
