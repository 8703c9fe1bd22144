//! The bounds on ζ that the damage equation implies, and by how much a run violates them.

use super::step_controller::PlannedStep;
use crate::fem::Mass;

/// By how much ζ violated the bounds of its equation in a run.
///
/// A step (28) that is not discretised in space obeys the maximum principle: φ ≤ 0, so max ζ never
/// rises, and min ζ falls by no more than k min φ,
///
/// min ζ_{n−1} + k min φ_{n−1} ≤ ζ_n ≤ max ζ_{n−1}.
///
/// Both bounds are carried on from the first step, so that small violations in many steps add up.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BoundViolation {
    /// The largest ζ above its upper bound.
    pub above: f64,
    /// The largest distance of a ζ below its lower bound.
    pub below: f64,
    /// The first step in which one was violated, and its time, s.
    pub first: Option<(usize, f64)>,
}

/// A violation counts above this, which is far above the error of the linear solver.
const ROUNDING: f64 = 1e-10;

impl BoundViolation {
    /// Compares min ζ_n and max ζ_n with the bounds of the step, which ends at `time`.
    pub(super) fn observe(&mut self, planned: &PlannedStep, (min, max): (f64, f64), time: f64) {
        let (lower, upper) = planned.bounds;
        let (above, below) = (max - upper, lower - min);
        if above.max(below) > ROUNDING {
            self.above = self.above.max(above);
            self.below = self.below.max(below);
            self.first = self.first.or(Some((planned.n, time)));
        }
    }

    /// What the user should know about the violation, and what cures it.
    pub fn note(&self, mass: Mass) -> Option<String> {
        let (step, time) = self.first?;
        let sides = [("above", self.above), ("below", self.below)].into_iter();
        let sides = sides.filter(|(_, by)| *by > ROUNDING);
        let sides: Vec<String> = sides.map(|(side, by)| format!("{side} by {by:.1e}")).collect();
        let cure = match mass {
            Mass::Consistent => {
                "κk is too small against h² for the consistent mass; set damage.mass = \
                 \"lumped\" (for meshes without obtuse angles), or refine the mesh there"
            }
            Mass::Lumped => "the mesh has obtuse angles, of which the lumped mass takes no care",
        };
        Some(format!(
            "ζ left the bounds of the damage equation, {}, first in step {step} (t = {time:.4e}): \
             {cure}",
            sides.join(" and ")
        ))
    }
}
