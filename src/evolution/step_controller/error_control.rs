//! The lengths of chosen steps, from the estimated error of each.

use super::PlannedStep;
use crate::{
    archive::{Archive, ArchiveError},
    evolution::{DiscreteProblem, loads::LoadCurve},
    fem::Body,
    scene::Stepping,
};
use nalgebra::DVector;

/// Keeps the error of ζ, over the damage done, below a tolerance: at the worst node and in the mean.
pub(super) struct ErrorControl<'a> {
    body: &'a Body,
    tolerance: f64,
    /// T, s.
    end: f64,
    /// What steps must follow, where it depends on time.
    load_curve: Option<LoadCurve<'a>>,
    /// The length of the next step, s.
    next_length: f64,
    /// ζ₀.
    initial: DVector<f64>,
    /// Per node, the sum of the truncation errors of the accepted steps.
    truncation: DVector<f64>,
    /// max |ζ − ζ₀| of the last accepted ζ.
    damage: f64,
    /// The estimated error of the last accepted ζ over the damage done.
    pub(super) relative_error: f64,
}

/// A step is at most this part of the run.
const COARSEST: f64 = 0.05;
/// Steps that do not follow the loads are halved down to this part: no step follows a jump.
const FOLLOWING: f64 = 1.0 / 2000.0;
/// A run whose step falls below this part has failed.
const FINEST: f64 = 1e-12;
/// Damage below this is negligible: its error is judged as if it were so large.
const NEGLIGIBLE: f64 = 1e-6;
/// At the beginning of a run there is no damage yet to compare an error with, so what the present
/// rate will do in this part of the run is added to it …
const HORIZON: f64 = 0.1;
/// … but in no more than so many steps: the rate in a pulse, which takes short ones, does not last;
const STEPS: f64 = 20.0;
/// … and no more than this: a body that fails does so faster and faster, and early errors grow.
const FORESEEN: f64 = 0.1;
/// The error of a step may be this part of the tolerance, as truncation errors add up.
const SHARE: f64 = 0.25;

impl<'a> ErrorControl<'a> {
    /// From ζ₀ = `initial` at t = 0; `None` if the scene does not choose its steps.
    pub(super) fn new(problem: &'a DiscreteProblem, initial: &[f64]) -> Option<Self> {
        let grid = problem.scene().time?;
        let Stepping::Auto { tolerance } = grid.stepping else { return None };
        // The error of the first step may be half of what its last rate does in it.
        let first_length = 2.0 * SHARE * tolerance * HORIZON * grid.end;
        Some(Self {
            body: &problem.body,
            tolerance,
            end: grid.end,
            load_curve: LoadCurve::new(problem),
            next_length: first_length.min(COARSEST * grid.end),
            initial: DVector::from_column_slice(initial),
            truncation: DVector::zeros(initial.len()),
            damage: 0.0,
            relative_error: 0.0,
        })
    }

    /// Saves or loads what the accepted steps have left.
    pub(super) fn archive(&mut self, archive: &mut Archive) -> Result<(), ArchiveError> {
        self.load_curve.iter_mut().try_for_each(|curve| curve.archive(archive))?;
        archive.value(&mut self.next_length)?;
        archive.value(&mut self.truncation)?;
        archive.value(&mut self.damage)?;
        archive.value(&mut self.relative_error)
    }

    /// The end and the length, s, of the step from `start`, which follows the loads if one can;
    /// `None` at the end of time.
    pub(super) fn choose(&mut self, start: f64) -> Option<(f64, f64)> {
        loop {
            let rest = self.end - start;
            // The last two steps are equal rather than one of them small.
            let (time, length) = match rest / self.next_length {
                _ if start >= self.end => return None,
                steps if steps <= 1.0 => (self.end, rest),
                steps if steps < 2.0 => (start + 0.5 * rest, 0.5 * rest),
                _ => (start + self.next_length, self.next_length),
            };
            let Some(curve) = &mut self.load_curve else { return Some((time, length)) };
            if curve.is_nearly_linear(start, time) {
                return Some((time, length));
            }
            if length <= FOLLOWING * self.end {
                // Where it is known when a load jumps, no pulse is left out.
                let known = curve.breaks(start, time).first();
                return Some(known.map_or((time, length), |&time| (time, time - start)));
            }
            self.next_length = 0.5 * length;
        }
    }

    /// Makes the next step `length` s long; false where so short a step means that the run has failed.
    pub(super) fn shorten(&mut self, length: f64) -> bool {
        self.next_length = length;
        length > FINEST * self.end
    }

    /// How near ζ_* a run must land.
    pub(super) fn landing(&self) -> f64 {
        self.tolerance * self.damage.max(NEGLIGIBLE)
    }

    /// Compares the error of ζ_n = `zeta`, that is e_n and the truncation error, with the allowed one,
    /// and chooses the length of the next step. `rate` is dζ/dt at t_n, 1/s. Collective.
    ///
    /// # Errors
    /// The error is too large: the factor by which to shorten the step.
    pub(super) fn judge(
        &mut self,
        planned: &PlannedStep,
        zeta: &DVector<f64>,
        [correction, truncation]: [&DVector<f64>; 2],
        rate: &DVector<f64>,
    ) -> Result<(), f64> {
        let damage = self.norms(&(zeta - &self.initial));
        let error = self.norms(&(correction + truncation));
        let rates = self.norms(rate);
        let ahead = (HORIZON * self.end).min(STEPS * planned.length).min(self.end - planned.time);
        let ratio = |j: usize| {
            let reference = damage[j] + (ahead * rates[j]).clamp(NEGLIGIBLE, FORESEEN);
            error[j] / (SHARE * self.tolerance * reference)
        };
        let ratio = ratio(0).max(ratio(1));
        if ratio > 1.0 {
            return Err(growth(ratio).clamp(0.2, 0.9));
        }
        self.truncation += truncation;
        let total = self.norms(&(&self.truncation + correction));
        let relative = |j: usize| total[j] / damage[j].max(NEGLIGIBLE);
        self.relative_error = relative(0).max(relative(1));
        self.damage = damage[0];
        self.next_length = (planned.length * growth(ratio).min(2.0)).min(COARSEST * self.end);
        Ok(())
    }

    /// max |·| over the nodes, and the mean of |·| over the body. Collective.
    fn norms(&self, field: &DVector<f64>) -> [f64; 2] {
        let (mut max, mut integral) = (0.0_f64, 0.0);
        let nodes = field
            .iter()
            .zip(&self.body.vertices.weights)
            .take(self.body.vertices.partition.owned());
        for (value, area) in nodes {
            max = max.max(value.abs());
            integral += area * value.abs();
        }
        let comm = self.body.vertices.partition.comm();
        [comm.max(max), comm.total(integral) / self.body.area]
    }
}

/// 0.9 (error over the allowed one)^(−1/3): by this factor a step becomes one with the allowed error,
/// which is of third order in its length, less a margin. It is cut to 32nds: rounding, which differs
/// with ranks and units, then hardly ever changes steps.
fn growth(error_ratio: f64) -> f64 {
    (32.0 * 0.9 / error_ratio.max(1e-300).cbrt()).floor() / 32.0
}
