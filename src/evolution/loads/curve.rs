//! How loads, prescribed displacements and gaps change between the ends of steps.

use crate::{
    archive::{Archive, ArchiveError},
    evolution::DiscreteProblem,
    scene::{Condition, Expression, Stepping},
};

/// The loads of a step may deviate from a straight line in time by this part of the largest ones.
const DEVIATION: f64 = 0.05;
/// Loads pass within a step if they swing by more than this part of the largest ones.
const PASSING: f64 = 0.5;
/// Times that differ by less than this part of the run are one.
const APART: f64 = 1e-9;
/// Uniform steps that are looked at.
const STEPS: usize = 50;
/// Times sampled within a step.
const POINTS: usize = 16;
/// Times at which loads are looked at whether they vary within edges, besides those of pulses and jumps.
const LOOKS: usize = 16;
/// A boundary is looked at for pulses and jumps in so many parts: what happens in one at some time may undo
/// what happens in another.
const BOXES: usize = 4;

/// Times within the run of `problem` at which what depends on time is not nearly linear, and one between
/// each two of them, s: rising, further apart than rounding of the `end`. See [`Expression::breaks`].
fn breaks(problem: &DiscreteProblem, end: f64) -> Vec<f64> {
    let (scene, mesh) = (problem.scene(), problem.mesh());
    let mut breaks = Vec::new();
    let mut add = |f: &Expression, boxes: &[[[f64; 2]; 2]]| {
        let boxes = if f.depends_on_space() { boxes } else { &boxes[..boxes.len().min(1)] };
        breaks.extend(boxes.iter().flat_map(|space| f.breaks(*space, end)));
    };
    let triangles = mesh.triangles.chunks(mesh.triangles.len().div_ceil(BOXES).max(1));
    let boxes: Vec<_> = triangles.map(|t| mesh.bounds(t.iter().flatten())).collect();
    scene.body_force.iter().for_each(|f| add(f, &boxes));
    for boundary in &scene.boundaries {
        let Some(curve) = mesh.curves.get(&boundary.name) else { continue };
        let edges = curve.edges.chunks(curve.edges.len().div_ceil(BOXES).max(1));
        let boxes: Vec<_> = edges.map(|edges| mesh.bounds(edges.iter().flatten())).collect();
        for condition in &boundary.conditions {
            match condition {
                Condition::Displacement(u) => u.iter().flatten().for_each(|u| add(u, &boxes)),
                Condition::Load(load) => load.expressions().iter().for_each(|f| add(f, &boxes)),
                Condition::Gap(gap) => add(&gap.distance, &boxes),
                Condition::Symmetry => {}
            }
        }
    }
    breaks.retain(|t| 0.0 < *t && *t < end);
    breaks.sort_by(f64::total_cmp);
    breaks.dedup_by(|next, t| *next - *t < APART * end);
    let between: Vec<f64> = breaks.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    breaks.extend(between);
    breaks.sort_by(f64::total_cmp);
    breaks
}

/// The forces, prescribed displacements and changes of gaps of a run, sampled between the ends of its
/// steps.
///
/// Every rank samples those of the whole body, so that all ranks choose the same steps.
pub(crate) struct LoadCurve<'a> {
    problem: &'a DiscreteProblem,
    /// The largest Σ|·| of the forces and of the displacements at any time sampled.
    largest: [f64; 2],
    /// Times that must be looked at, rising, s.
    breaks: Vec<f64>,
    /// Per surface load whether it varies within edges.
    narrow: Vec<bool>,
    /// The end of the run, s.
    end: f64,
}

impl<'a> LoadCurve<'a> {
    /// Samples the whole run; `None` where nothing depends on time.
    pub(crate) fn new(problem: &'a DiscreteProblem) -> Option<Self> {
        let end = problem.scene().time?.end;
        problem.loads.depend_on_time().then(|| {
            let breaks = breaks(problem, end);
            let looks = [problem.scene().sample_times(LOOKS), breaks.clone()].concat();
            let surface_forces = problem.loads.surface_forces.iter();
            let narrow = surface_forces.map(|force| force.is_narrow(&looks)).collect();
            let (largest, known) = ([0.0; 2], breaks.clone());
            let mut curve = Self { problem, largest, breaks: known, narrow, end };
            let times = problem.scene().sample_times(100).into_iter().chain(breaks);
            times.for_each(|time| _ = curve.sample(time));
            curve
        })
    }

    /// Saves or loads the largest values so far.
    pub(crate) fn archive(&mut self, archive: &mut Archive) -> Result<(), ArchiveError> {
        archive.value(&mut self.largest)
    }

    /// The breaks between two times.
    pub(crate) fn breaks(&self, start: f64, end: f64) -> &[f64] {
        let apart = APART * self.end;
        let place = |time: f64| self.breaks.partition_point(|other| *other <= time);
        let (first, last) = (place(start + apart), place(end - apart));
        &self.breaks[first..last.max(first)]
    }

    /// Σ|·| of the forces and of the displacements at `time` over the largest ones; 0 where all are 0.
    pub(crate) fn sizes(&self, time: f64) -> [f64; 2] {
        let values = self.problem.loads.sampled_at(time, &self.narrow);
        let size = |kind: usize| sum_abs(values[kind].iter().copied()) / self.largest[kind];
        [size(0), size(1)].map(|size| if size.is_finite() { size } else { 0.0 })
    }

    /// Whether loads, prescribed displacements and gaps are nearly linear in time from `start` to `end`.
    pub(crate) fn is_nearly_linear(&mut self, start: f64, end: f64) -> bool {
        let [first, last] =
            [start, end].map(|time| self.problem.loads.sampled_at(time, &self.narrow));
        let parts = (1..=POINTS).map(|point| point as f64 / (POINTS + 1) as f64);
        let breaks = self.breaks(start, end).iter().map(|time| (time - start) / (end - start));
        let parts: Vec<f64> = parts.chain(breaks).collect();
        parts.into_iter().all(|part| {
            let values = self.sample(start + part * (end - start));
            !(0..2).any(|kind| {
                let line = first[kind].iter().zip(&last[kind]);
                let line = line.map(|(first, last)| (1.0 - part) * first + part * last);
                let deviation = sum_abs(values[kind].iter().zip(line).map(|(v, line)| v - line));
                deviation > DEVIATION * self.largest[kind]
            })
        })
    }

    /// The first uniform step within which they are not nearly linear, s, of some evenly chosen ones and
    /// those with breaks: what happens there counts only at its ends.
    pub(crate) fn unresolved_step(problem: &'a DiscreteProblem) -> Option<[f64; 2]> {
        let grid = problem.scene().time?;
        let Stepping::Uniform { steps } = grid.stepping else { return None };
        let mut curve = Self::new(problem)?;
        let evenly = steps.min(STEPS);
        let mut looked_at: Vec<usize> = (0..evenly).map(|i| i * steps / evenly).collect();
        let step = |time: &f64| ((time / grid.end * steps as f64) as usize).min(steps - 1);
        looked_at.extend(curve.breaks.iter().map(step));
        looked_at.sort_unstable();
        looked_at.dedup();
        let ends = |n: usize| [grid.time(n, steps), grid.time(n + 1, steps)];
        // A jump at the very end belongs to the next step.
        let before = 2.0 * APART * grid.end;
        looked_at
            .into_iter()
            .map(ends)
            .find(|[start, end]| !curve.is_nearly_linear(*start, end - before))
    }

    /// Whether the sum of all forces, or of all displacements and gaps, swings within a uniform step by more
    /// than [`PASSING`] of the largest: a load that comes and goes between two steps, not one that moves.
    pub(crate) fn pass_within_steps(problem: &'a DiscreteProblem) -> bool {
        let Some(grid) = problem.scene().time else { return false };
        let Stepping::Uniform { steps } = grid.stepping else { return false };
        let Some(mut curve) = Self::new(problem) else { return false };
        let size = |values: &Vec<f64>| sum_abs(values.iter().copied());
        let mut swings = [0.0_f64; 2];
        for n in 0..steps {
            let [start, end] = [grid.time(n, steps), grid.time(n + 1, steps)];
            let [first, last] = [start, end].map(|time| curve.sample(time).each_ref().map(size));
            let parts = (1..=POINTS).map(|point| point as f64 / (POINTS + 1) as f64);
            let breaks = curve.breaks(start, end).iter().map(|time| (time - start) / (end - start));
            for part in parts.chain(breaks).collect::<Vec<f64>>() {
                let now = curve.sample(start + part * (end - start)).each_ref().map(size);
                for kind in 0..2 {
                    let line = (1.0 - part) * first[kind] + part * last[kind];
                    swings[kind] = swings[kind].max((now[kind] - line).abs());
                }
            }
        }
        (0..2).any(|kind| swings[kind] > PASSING * curve.largest[kind])
    }

    /// Forces and displacements at `time`; the largest ones are kept.
    fn sample(&mut self, time: f64) -> [Vec<f64>; 2] {
        let values = self.problem.loads.sampled_at(time, &self.narrow);
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
