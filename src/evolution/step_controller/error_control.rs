//! Adaptive steps: their lengths, from the estimated error of each.

use super::{PlannedStep, forecast::Forecast};
use crate::{
    ROUNDING,
    evolution::{DiscreteProblem, LoadCurve},
    fem::Body,
    maximum,
    observe::NEGLIGIBLE_DAMAGE,
    scene::{APART, Stepping},
};
use nalgebra::DVector;

/// Keeps the error of ζ below a tolerance, relative to the damage done: at the worst node and in the mean.
pub(super) struct ErrorControl<'a> {
    body: &'a Body,
    tolerance: f64,
    /// The damage expected at the end, as in [`Stepping::Auto`].
    expected: [f64; 2],
    /// T and the times at which steps end besides T, s.
    end: f64,
    times: &'a [f64],
    /// The times at which the steps of the same run on another mesh ended, s. Steps end there too, whatever their error.
    followed: &'a [f64],
    /// The loads in time; `None` if they are constant.
    load_curve: Option<LoadCurve<'a>>,
    forecast: Forecast,
    /// The length of the next step, s; infinite if it ends at the next `followed` time.
    next_length: f64,
    /// ζ₀.
    initial: DVector<f64>,
    /// max |ζ − ζ₀| and the mean of |ζ − ζ₀| of the last accepted ζ.
    damage: [f64; 2],
}

/// The longest step, as a fraction of the run.
///
/// Tuned on the 13 adapted runs. Half: 42 % more steps. Twice: 12 % fewer, and a bar of six other bodies fails.
const LONGEST_STEP: f64 = 0.05;
/// A step within which the loads are not nearly linear in time is halved, down to this fraction of the run. Shorter
/// steps would not follow a jump either.
///
/// Tuned on the 13 adapted runs. Half: nothing changes. Twice: nothing changes.
const FOLLOWING: f64 = 1.0 / 2000.0;
/// Maximum damage in a forecast. The damage of a failing body accelerates, and so do the errors of early steps.
///
/// Tuned on the 13 adapted runs. Half: `square` takes 21 steps for 19. Twice: `square` takes 18 steps.
const MAX_FORECAST: f64 = 0.1;
/// Meshes and time steps aim at this fraction of the allowed error: a mesh may miss its aim, and the error of a step
/// grows in later steps.
///
/// Tuned on the 13 adapted runs. Half: a third more triangles, 22 % more steps. Twice: 11 runs miss their accuracy.
pub const AIM: f64 = 0.7;
/// The error of one step may be this fraction of the error that the steps before have left.
///
/// Tuned on the 13 adapted runs. Half: 20 % more steps. Twice: 9 % fewer.
const STEP_SHARE: f64 = 0.35;
/// The error that the steps before have left counts as at least this fraction of the aim: they may have used it up.
///
/// Tuned on the 13 adapted runs. Half: `square` takes 21 steps for 19. Twice: `square` takes 18 steps and an eighth fewer
/// triangles.
const MIN_REST: f64 = 1.0 / 16.0;

impl<'a> ErrorControl<'a> {
    /// From ζ₀ = `initial` at t = 0; `None` if the scene has uniform steps.
    pub(super) fn new(
        problem: &'a DiscreteProblem,
        initial: &[f64],
        followed: &'a [f64],
    ) -> Option<Self> {
        let grid = problem.scene().time?;
        let Stepping::Auto { tolerance, expected } = grid.stepping else { return None };
        // The error of the first step is at most half of its damage at its last rate, which lasts for the run.
        let first_length = on_ladder(2.0 * STEP_SHARE * tolerance * grid.end, grid.end);
        let load_curve = LoadCurve::new(problem);
        Some(Self {
            body: &problem.body,
            tolerance,
            expected,
            end: grid.end,
            times: &problem.scene().output.times,
            followed,
            forecast: Forecast::new(load_curve.as_ref(), grid.end),
            load_curve,
            next_length: if followed.len() > 1 { f64::INFINITY } else { first_length },
            initial: DVector::from_column_slice(initial),
            damage: [0.0; 2],
        })
    }

    /// The state for a checkpoint: the next length, the damage, the maximum sampled loads.
    pub(super) fn state(&self) -> (f64, [f64; 2], [f64; 2]) {
        let largest = self.load_curve.as_ref().map_or([0.0; 2], |curve| curve.largest);
        (self.next_length, self.damage, largest)
    }

    /// Goes back to the state of a checkpoint.
    pub(super) fn set_state(&mut self, (next_length, damage, largest): (f64, [f64; 2], [f64; 2])) {
        (self.next_length, self.damage) = (next_length, damage);
        self.load_curve.iter_mut().for_each(|curve| curve.largest = largest);
    }

    /// The end and the length, s, of the step from `start`. Within it the loads are nearly linear in time, unless
    /// they jump. `None` at the end of the run.
    pub(super) fn next_step(&mut self, start: f64) -> Option<(f64, f64)> {
        let apart = APART * self.end;
        let is_ahead = |time: &&f64| start + apart < **time && **time < self.end - apart;
        let followed = self.followed.iter().find(|time| **time > start);
        if let (Some(&time), f64::INFINITY) = (followed, self.next_length) {
            return Some((time, time - start));
        }
        let times = self.times.iter().filter(is_ahead).chain(followed);
        let target = times.copied().fold(self.end, f64::min);
        loop {
            let rest = target - start;
            // The last two steps to a target are equal, so that neither is very short.
            let (time, length) = match rest / self.next_length {
                _ if start >= self.end => return None,
                steps if steps <= 1.0 => (target, rest),
                steps if steps < 2.0 => (start + 0.5 * rest, 0.5 * rest),
                _ => (start + self.next_length, self.next_length),
            };
            let Some(curve) = &mut self.load_curve else { return Some((time, length)) };
            if curve.is_nearly_linear(start, time) {
                return Some((time, length));
            }
            if length <= FOLLOWING * self.end {
                // The step ends at the first jump whose time is known, so that no pulse is left out.
                let known = curve.breaks(start, time).first();
                return Some(known.map_or((time, length), |&time| (time, time - start)));
            }
            self.next_length = 0.5 * length;
        }
    }

    /// Makes the next step at most `length` s long; false if that is so short that the run has failed.
    pub(super) fn shorten(&mut self, length: f64) -> bool {
        self.next_length = on_ladder(length, self.end);
        length > ROUNDING * self.end
    }

    /// Maximum distance of min ζ from ζ_* at which a run may stop.
    pub(super) fn stop_distance(&self) -> f64 {
        self.tolerance * self.damage[0].max(NEGLIGIBLE_DAMAGE)
    }

    /// Accepts a step to ζ_n = `zeta` and sets the length of the next step. At the worst node and in the mean, the
    /// error `added` by the step must be at most STEP_SHARE (AIM · tolerance · D − E).
    ///
    /// Here E = `error` is the error of the steps before. D is the damage at the end: the expected one, or else the
    /// damage so far plus the [`Forecast`] from the present `rate` = dζ/dt, 1/s. Collective.
    ///
    /// # Errors
    /// The error is too large: the ratio by which to shorten the step.
    pub(super) fn accept(
        &mut self,
        planned: &PlannedStep,
        zeta: &DVector<f64>,
        error: &DVector<f64>,
        added: &DVector<f64>,
        rate: &DVector<f64>,
    ) -> Result<(), f64> {
        let damage = self.norms(&(zeta - &self.initial));
        let [error, added, rates] = [error, added, rate].map(|field| self.norms(field));
        let ahead = self.forecast.time_ahead(planned.time);
        let ratio = |j: usize| {
            let forecast = (ahead * rates[j]).clamp(NEGLIGIBLE_DAMAGE, MAX_FORECAST);
            let reference = match self.expected[j] {
                expected if expected > 0.0 => damage[j].max(expected).max(NEGLIGIBLE_DAMAGE),
                _ => damage[j] + forecast,
            };
            let budget = AIM * self.tolerance * reference;
            added[j] / (STEP_SHARE * (budget - error[j]).max(MIN_REST * budget))
        };
        let ratio = maximum(ratio(0), ratio(1));
        if (ratio > 1.0 || ratio.is_nan()) && self.next_length < f64::INFINITY {
            return Err(growth(ratio).max(0.2));
        }
        self.damage = damage;
        let is_followed = |pair: &[f64]| pair[0] == planned.time;
        self.next_length = match self.followed.windows(2).any(is_followed) {
            true => f64::INFINITY,
            false => on_ladder(planned.length * growth(ratio).min(2.0), self.end),
        };
        Ok(())
    }

    /// An error of the last accepted ζ over the damage done. Collective.
    pub(super) fn relative(&self, error: &DVector<f64>) -> f64 {
        let error = self.norms(error);
        let relative = |j: usize| error[j] / self.damage[j].max(NEGLIGIBLE_DAMAGE);
        maximum(relative(0), relative(1))
    }

    /// max |·| over the nodes, and the mean of |·| over the body. Collective.
    fn norms(&self, field: &DVector<f64>) -> [f64; 2] {
        let (mut max, mut integral) = (0.0, 0.0);
        let nodes = field
            .iter()
            .zip(&self.body.vertices.weights)
            .take(self.body.vertices.partition.owned());
        for (value, area) in nodes {
            max = maximum(max, value.abs());
            integral += area * value.abs();
        }
        let comm = self.body.comm();
        [comm.max(max), comm.total(integral) / self.body.area]
    }
}

/// The ratio 0.9 (error/allowed error)^(−1/3) from the length of a step to the next. The error of a step is of
/// third order in its length; 0.9 is a margin.
fn growth(error_ratio: f64) -> f64 {
    0.9 / error_ratio.cbrt()
}

/// The largest of the lengths `LONGEST_STEP` T/√2^j, j = 0, 1, …, that is at most `length`, s, for a run that ends at
/// T = `end`, s. Steps of equal length share a factor of the damage system. Rounding, which differs with ranks and units,
/// hardly ever changes these lengths.
fn on_ladder(length: f64, end: f64) -> f64 {
    let longest = LONGEST_STEP * end;
    let steps_down = (2.0 * (longest / length).log2() - ROUNDING).ceil().max(0.0);
    longest * (-0.5 * steps_down).exp2()
}
