//! Whether a chosen step follows the loads, which a solve at its two ends alone cannot tell.

use super::DiscreteProblem;

/// The loads and prescribed displacements of a run, looked at between the ends of its steps.
///
/// Every rank looks at those of the whole body, so that all come to the same steps.
pub(super) struct LoadCurve<'a> {
    problem: &'a DiscreteProblem,
    /// Σ|·| of the forces and of the prescribed displacements, each the largest seen.
    largest: [f64; 2],
}

/// The loads of a step may deviate from a straight line in time by this part of the largest ones.
const DEVIATION: f64 = 0.05;
/// So many times are looked at within a step.
const POINTS: usize = 16;

impl<'a> LoadCurve<'a> {
    /// Looks at times of the whole run; `None` where nothing depends on time.
    pub(super) fn new(problem: &'a DiscreteProblem) -> Option<Self> {
        let mut curve = Self { problem, largest: [0.0; 2] };
        if !problem.loads.depend_on_time() {
            return None;
        }
        for time in problem.scene().sample_times(100) {
            curve.observe(&curve.values(time));
        }
        Some(curve)
    }

    /// Whether loads and prescribed displacements are nearly linear in time from `start` to `end`.
    pub(super) fn is_nearly_linear(&mut self, start: f64, end: f64) -> bool {
        let (first, last) = (self.values(start), self.values(end));
        for point in 1..=POINTS {
            let part = point as f64 / (POINTS + 1) as f64;
            let values = self.values(start + part * (end - start));
            self.observe(&values);
            let deviation = |kind: usize| {
                let line = first[kind].iter().zip(&last[kind]);
                let line = line.map(|(first, last)| (1.0 - part) * first + part * last);
                size(values[kind].iter().zip(line).map(|(value, line)| value - line))
            };
            if (0..2).any(|kind| deviation(kind) > DEVIATION * self.largest[kind]) {
                return false;
            }
        }
        true
    }

    fn observe(&mut self, values: &[Vec<f64>; 2]) {
        for (largest, values) in self.largest.iter_mut().zip(values) {
            let size = size(values.iter().copied());
            // An infinite one is refused as soon as a step ends there.
            if size.is_finite() {
                *largest = largest.max(size);
            }
        }
    }

    /// Forces and prescribed displacements at `time`.
    fn values(&self, time: f64) -> [Vec<f64>; 2] {
        let loads = &self.problem.loads;
        [loads.sampled_at(time), loads.prescribed_at(time)]
    }
}

/// Σ|·|: unlike the largest it hardly notices that a load rolls over the boundary.
fn size(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).sum()
}
