//! Whether a chosen step follows the loads, which solves at its two ends alone cannot tell.

use crate::evolution::DiscreteProblem;

/// The forces and prescribed displacements of a run, sampled between the ends of its steps.
///
/// Every rank samples those of the whole body, so that all ranks choose the same steps.
pub(super) struct LoadCurve<'a> {
    problem: &'a DiscreteProblem,
    /// The largest Σ|·| of the forces and of the prescribed displacements at any time sampled.
    largest: [f64; 2],
}

/// The loads of a step may deviate from a straight line in time by this part of the largest ones.
const DEVIATION: f64 = 0.05;
/// Times sampled within a step.
const POINTS: usize = 16;

impl<'a> LoadCurve<'a> {
    /// Samples the whole run; `None` where nothing depends on time.
    pub(super) fn new(problem: &'a DiscreteProblem) -> Option<Self> {
        let mut curve = Self { problem, largest: [0.0; 2] };
        let times = problem.scene().sample_times(100);
        problem.loads.depend_on_time().then(|| {
            times.into_iter().for_each(|time| _ = curve.sample(time));
            curve
        })
    }

    /// Whether loads and prescribed displacements are nearly linear in time from `start` to `end`.
    pub(super) fn is_nearly_linear(&mut self, start: f64, end: f64) -> bool {
        let (first, last) =
            (self.problem.loads.sampled_at(start), self.problem.loads.sampled_at(end));
        (1..=POINTS).all(|point| {
            let part = point as f64 / (POINTS + 1) as f64;
            let values = self.sample(start + part * (end - start));
            !(0..2).any(|kind| {
                let line = first[kind].iter().zip(&last[kind]);
                let line = line.map(|(first, last)| (1.0 - part) * first + part * last);
                let deviation = sum_abs(values[kind].iter().zip(line).map(|(v, line)| v - line));
                deviation > DEVIATION * self.largest[kind]
            })
        })
    }

    /// Forces and prescribed displacements at `time`; the largest ones are kept.
    fn sample(&mut self, time: f64) -> [Vec<f64>; 2] {
        let values = self.problem.loads.sampled_at(time);
        for (largest, values) in self.largest.iter_mut().zip(&values) {
            let sum = sum_abs(values.iter().copied());
            // An infinite one is refused as soon as a step ends there.
            if sum.is_finite() {
                *largest = largest.max(sum);
            }
        }
        values
    }
}

/// Σ|·|: unlike the maximum it hardly changes while a load rolls over the boundary.
fn sum_abs(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).sum()
}
