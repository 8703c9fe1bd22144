//! The bounds of the damage equation, and by how much a run leaves them.

use crate::fem::Mass;

/// The range in which the damage steps (28) keep ζ when space is not discretised: φ ≤ 0, so
/// max ζ never rises, and min ζ falls by no more than k min φ in a step (maximum principle).
///
/// Both are kept from the start on: what many small steps add up is seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    floor: f64,
    ceiling: f64,
}

/// Bounds are left if it is by more than this, far above the error of the linear solver.
const ROUNDING: f64 = 1e-10;

impl Bounds {
    /// From the least and the largest ζ.
    pub(super) fn of((floor, ceiling): (f64, f64)) -> Self {
        Self { floor, ceiling }
    }

    /// After a step whose source is at least `least` (1/s), `step` s long.
    pub(super) fn after(self, least: f64, step: f64) -> Self {
        Self { floor: self.floor + step * least, ..self }
    }

    /// As tight as the extremes of the ζ that was reached show them.
    pub(super) fn tightened(self, (low, high): (f64, f64)) -> Self {
        Self { floor: self.floor.max(low), ceiling: self.ceiling.min(high) }
    }

    /// After a correction of ζ by a field of these extremes.
    pub(super) fn shifted(self, (low, high): (f64, f64)) -> Self {
        Self { floor: self.floor + low.min(0.0), ceiling: self.ceiling + high.max(0.0) }
    }

    /// The least ζ.
    pub(super) fn floor(self) -> f64 {
        self.floor
    }
}

/// By how much ζ left the bounds of its equation in a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BoundViolation {
    /// Largest ζ beyond the least max ζ before it.
    pub above: f64,
    /// Largest gap from ζ up to what the sources before it allow.
    pub below: f64,
    /// The first such step and its time, s.
    pub first: Option<(usize, f64)>,
}

impl BoundViolation {
    /// Looks at the extremes of ζ of a step.
    pub(super) fn observe(
        &mut self,
        bounds: Bounds,
        (low, high): (f64, f64),
        step: usize,
        time: f64,
    ) {
        let (above, below) = (high - bounds.ceiling, bounds.floor - low);
        if above.max(below) > ROUNDING {
            self.above = self.above.max(above);
            self.below = self.below.max(below);
            self.first = self.first.or(Some((step, time)));
        }
    }

    /// What the user should know about it, and what cures it.
    pub fn note(&self, mass: Mass) -> Option<String> {
        let (step, time) = self.first?;
        let sides = [("above", self.above), ("below", self.below)];
        let sides: Vec<String> = sides
            .iter()
            .filter(|(_, by)| *by > ROUNDING)
            .map(|(side, by)| format!("{side} by {by:.1e}"))
            .collect();
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
