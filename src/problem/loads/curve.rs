//! Loads, prescribed displacements and gaps as functions of time, for the choice of steps.

use crate::{
    mesh::bounds,
    problem::DiscreteProblem,
    scene::{APART, Condition, Expression, Stepping, TimeGrid},
};

/// Loads count as linear in time if they deviate from a straight line by at most this fraction of the largest.
///
/// Tuned on the 13 adapted runs. Half: 5 % more steps, 18 % more for `beam`. Twice: nothing changes.
const NONLINEARITY: f64 = 0.05;
/// Loads pass by within a step if their sum deviates from a straight line by more than this fraction.
const PASSING: f64 = 0.5;
/// Number of uniform steps sampled for the note about loads within a step.
const STEPS: usize = 50;
/// Times within a step are sampled at intervals of at most this fraction of the run. A step has 4 to 17 intervals: 4 show
/// also loads that turn twice within it.
const INTERVAL: f64 = 1.0 / 340.0;
/// Number of parts of a boundary searched for pulses and jumps. One pulse may hide another in the same part.
const BOXES: usize = 4;

/// Times, s, at which a load, a prescribed displacement or a gap of `problem` may not be smooth, with one time
/// between each two. They increase and differ by more than rounding. See [`Expression::breaks`].
fn breaks(problem: &DiscreteProblem, end: f64) -> Vec<f64> {
    let (scene, mesh) = (problem.scene(), problem.mesh());
    let mut breaks = Vec::new();
    let mut add = |f: &Expression, boxes: &[[[f64; 2]; 2]]| {
        let boxes = if f.depends_on_space() { boxes } else { &boxes[..boxes.len().min(1)] };
        breaks.extend(boxes.iter().flat_map(|space| f.breaks(*space, end)));
    };
    let triangles = mesh.triangles.chunks(mesh.triangles.len().div_ceil(BOXES).max(1));
    let at = |node: &usize| &mesh.nodes[*node];
    let boxes: Vec<_> = triangles.map(|t| bounds(t.iter().flatten().map(at))).collect();
    scene.body_force.iter().chain(&scene.gravity).for_each(|f| add(f, &boxes));
    for boundary in &scene.boundaries {
        let edges = mesh.edges_of(&boundary.name);
        let parts = edges.chunks(edges.len().div_ceil(BOXES).max(1));
        let boxes: Vec<_> = parts.map(|edges| bounds(edges.iter().flatten().map(at))).collect();
        let of_conditions = boundary.conditions.iter().flat_map(Condition::expressions);
        of_conditions.flatten().for_each(|f| add(f, &boxes));
    }
    breaks.retain(|t| 0.0 < *t && *t < end);
    breaks.sort_by(f64::total_cmp);
    breaks.dedup_by(|next, t| *next - *t < APART * end);
    let between: Vec<f64> = breaks.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    breaks.extend(between);
    breaks.sort_by(f64::total_cmp);
    breaks
}

/// The forces, prescribed displacements and changes of gaps of a run, sampled in time.
///
/// Every rank samples the whole body, so that all ranks choose the same steps.
pub(crate) struct LoadCurve<'a> {
    problem: &'a DiscreteProblem,
    /// max Σ|·| of the forces and of the displacements over the sampled times.
    pub(crate) largest: [f64; 2],
    /// Times that must be sampled, s, in increasing order.
    breaks: Vec<f64>,
    /// Increasing times of the whole run, s, each with Σ|·| of the forces and of the displacements.
    sums: Vec<(f64, [f64; 2])>,
    /// The end of the run, s.
    end: f64,
}

impl<'a> LoadCurve<'a> {
    /// Samples the whole run; `None` if nothing depends on time.
    pub(crate) fn new(problem: &'a DiscreteProblem) -> Option<Self> {
        let end = problem.scene().time?.end;
        problem.loads.depend_on_time().then(|| {
            let breaks = breaks(problem, end);
            let mut times = [problem.scene().sample_times(100), breaks.clone()].concat();
            times.sort_by(f64::total_cmp);
            let mut curve = Self { problem, largest: [0.0; 2], breaks, sums: Vec::new(), end };
            let sums = |time| (time, curve.sample(time).map(|values| sum_abs(values.into_iter())));
            curve.sums = times.into_iter().map(sums).collect();
            curve
        })
    }

    /// The breaks between two times.
    pub(crate) fn breaks(&self, start: f64, end: f64) -> &[f64] {
        let apart = APART * self.end;
        let place = |time: f64| self.breaks.partition_point(|other| *other <= time);
        let (first, last) = (place(start + apart), place(end - apart));
        &self.breaks[first..last.max(first)]
    }

    /// Increasing times of the whole run, s, each with s², the sum of squares of Σ|·| of the forces and of the
    /// displacements, relative to the maximum sums. The part of a kind is 0 if its maximum is 0.
    pub(crate) fn squares(&self) -> Vec<(f64, f64)> {
        let square = |sums: &[f64; 2]| {
            let sizes = sums.iter().zip(&self.largest).map(|(sum, largest)| sum / largest);
            sizes.filter(|size| size.is_finite()).map(|size| size * size).sum()
        };
        self.sums.iter().map(|(time, sums)| (*time, square(sums))).collect()
    }

    /// Are loads, prescribed displacements and gaps nearly linear in time from `start` to `end`?
    pub(crate) fn is_nearly_linear(&mut self, start: f64, end: f64) -> bool {
        let deviations = self.deviations(start, end, <[f64]>::to_vec);
        (0..2).all(|kind| deviations[kind] <= NONLINEARITY * self.largest[kind])
    }

    /// Deviations of `of`(forces) and `of`(displacements) from straight lines in time: max Σ|·| over the samples.
    fn deviations(&mut self, start: f64, end: f64, of: impl Fn(&[f64]) -> Vec<f64>) -> [f64; 2] {
        let [first, last] = [start, end].map(|time| self.sample(time).map(|values| of(&values)));
        let intervals = ((end - start) / (INTERVAL * self.end)).ceil().clamp(4.0, 17.0);
        let parts = (1..intervals as usize).map(|point| point as f64 / intervals);
        let breaks = self.breaks(start, end).iter().map(|time| (time - start) / (end - start));
        let mut deviations = [0.0_f64; 2];
        for part in parts.chain(breaks).collect::<Vec<f64>>() {
            let values = self.sample(start + part * (end - start)).map(|values| of(&values));
            for (kind, deviation) in deviations.iter_mut().enumerate() {
                let line = first[kind].iter().zip(&last[kind]);
                let line = line.map(|(first, last)| (1.0 - part) * first + part * last);
                *deviation =
                    deviation.max(sum_abs(values[kind].iter().zip(line).map(|(v, l)| v - l)));
            }
        }
        deviations
    }

    /// The ends, s, of the first sampled uniform step within which the loads are not nearly linear. The samples are
    /// evenly spaced steps and all steps with breaks. A run evaluates the loads only at the ends of a step.
    pub(crate) fn unresolved_step(problem: &'a DiscreteProblem) -> Option<[f64; 2]> {
        let (grid, steps) = uniform_steps(problem)?;
        let mut curve = Self::new(problem)?;
        let evenly = steps.min(STEPS);
        let mut sampled: Vec<usize> = (0..evenly).map(|i| i * steps / evenly).collect();
        let step = |time: &f64| ((time / grid.end * steps as f64) as usize).min(steps - 1);
        sampled.extend(curve.breaks.iter().map(step));
        sampled.sort_unstable();
        sampled.dedup();
        // A jump at the very end belongs to the next step.
        let before = 2.0 * APART * grid.end;
        let ends = sampled.into_iter().map(|n| [grid.time(n, steps), grid.time(n + 1, steps)]);
        ends.into_iter().find(|[start, end]| !curve.is_nearly_linear(*start, end - before))
    }

    /// Do loads come and go within a uniform step? Then the sum of all forces, or of all displacements and gaps,
    /// deviates from a straight line by more than [`PASSING`] of the maximum sum. A load that moves keeps its sum.
    pub(crate) fn pass_within_steps(problem: &'a DiscreteProblem) -> bool {
        let Some((grid, steps)) = uniform_steps(problem) else { return false };
        let Some(mut curve) = Self::new(problem) else { return false };
        let size = |values: &[f64]| vec![sum_abs(values.iter().copied())];
        (0..steps).any(|n| {
            let swings = curve.deviations(grid.time(n, steps), grid.time(n + 1, steps), size);
            (0..2).any(|kind| swings[kind] > PASSING * curve.largest[kind])
        })
    }

    /// The forces and displacements at `time`. Updates the maximum sums.
    fn sample(&mut self, time: f64) -> [Vec<f64>; 2] {
        let values = self.problem.loads.sampled_at(time);
        for (largest, values) in self.largest.iter_mut().zip(&values) {
            let sum = sum_abs(values.iter().copied());
            // An infinite load is rejected as soon as a step ends there.
            if sum.is_finite() {
                *largest = largest.max(sum);
            }
        }
        values
    }
}

/// The time grid of a scene with uniform steps, and their number.
fn uniform_steps(problem: &DiscreteProblem) -> Option<(TimeGrid, usize)> {
    let grid = problem.scene().time?;
    match grid.stepping {
        Stepping::Uniform { steps } => Some((grid, steps)),
        Stepping::Auto { .. } => None,
    }
}

/// Σ|·|. Unlike the maximum, it hardly changes while a load rolls over the boundary.
fn sum_abs(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).sum()
}
