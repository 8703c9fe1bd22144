//! The loads, prescribed displacements and gaps of a scene as functions of time.

use super::{
    DiscreteProblem,
    boundary_conditions::{BoundaryConditions, MovingGap, Traction},
};
use crate::{
    archive::{Archive, ArchiveError},
    fem::{Body, Edge, Subdomain, add_body_force, add_traction, midpoint},
    scene::{Expression, Scene, Stepping},
};

/// The midpoint and the length or area, m or m², of an edge or triangle.
type Sample = ([f64; 2], f64);

/// The body force is sampled in at most so many triangles.
const TRIANGLES: usize = 500;
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

/// (f(t), ·)_V and the values of the fixed rows and of the gap rows.
#[derive(Debug)]
pub struct Loads {
    /// f_B, N/m³, if it is not zero.
    body_force: Option<[Expression; 2]>,
    tractions: Vec<Traction>,
    /// Of each fixed row: the point and the component's expression, `None` for a symmetry's 0.
    prescribed: Vec<Option<([f64; 2], Expression)>>,
    /// The gaps of all gap rows at the first solve, m, and those that depend on time.
    gaps: Vec<f64>,
    moving: Vec<MovingGap>,
    /// Where each load of the whole body is sampled.
    samples: Vec<(Vec<Sample>, Vec<Expression>)>,
    /// The load, where it does not depend on time.
    constant: Option<Vec<f64>>,
}

impl Loads {
    /// The loads on `body`, and the values of its fixed rows.
    pub(super) fn new(body: &Body, scene: &Scene, conditions: BoundaryConditions) -> Self {
        let BoundaryConditions { tractions, prescribed, gaps, moving, .. } = conditions;
        let gaps = gaps.iter().map(|row| row.gap).collect();
        let zero = scene.body_force.iter().all(|f| f.as_constant() == Some(0.0));
        let body_force = (!zero).then(|| scene.body_force.clone());
        let samples = (tractions.iter())
            .map(|load| (edge_samples(body, &load.edges), load.force.expressions().to_vec()))
            .chain(body_force.iter().map(|f| (triangle_samples(body), f.to_vec())))
            .collect();
        let constant = None;
        let mut loads = Self { body_force, tractions, prescribed, gaps, moving, samples, constant };
        if !loads.samples.iter().flat_map(|(_, f)| f).any(Expression::depends_on_time) {
            loads.constant = Some(loads.assemble(body, 0.0));
        }
        loads
    }

    /// The loads on a rank's subdomain. Values of the fixed rows are needed wherever one is known.
    pub(super) fn restrict(self, subdomain: &Subdomain) -> Self {
        let local =
            |traction: Traction| Traction { edges: subdomain.edges(&traction.edges), ..traction };
        Self {
            tractions: self.tractions.into_iter().map(local).collect(),
            constant: self.constant.map(|load| subdomain.field(&load, 2)),
            ..self
        }
    }

    /// Whether a load, a prescribed displacement or a gap depends on time.
    pub fn depend_on_time(&self) -> bool {
        let mut prescribed = self.prescribed.iter().flatten().map(|(_, expression)| expression);
        self.constant.is_none()
            || !self.moving.is_empty()
            || prescribed.any(Expression::depends_on_time)
    }

    /// Whether the body force depends on time.
    pub fn body_force_depends_on_time(&self) -> bool {
        self.body_force.iter().flatten().any(Expression::depends_on_time)
    }

    /// Nodal loads at time t, N per metre of thickness.
    pub fn at(&self, body: &Body, t: f64) -> Vec<f64> {
        self.constant.clone().unwrap_or_else(|| self.assemble(body, t))
    }

    /// u·d of each fixed row at time t, m.
    pub fn prescribed_at(&self, t: f64) -> Vec<f64> {
        let value = |([x, y], u): &([f64; 2], Expression)| u.eval(*x, *y, t);
        self.prescribed.iter().map(|row| row.as_ref().map_or(0.0, value)).collect()
    }

    /// The gaps of all gap rows at time t, m; none where no gap depends on time.
    pub fn gaps_at(&self, t: f64) -> Vec<f64> {
        let mut gaps = if self.moving.is_empty() { Vec::new() } else { self.gaps.clone() };
        self.moving.iter().for_each(|gap| gaps[gap.number] = gap.at(t));
        gaps
    }

    /// Times within a run at which what depends on time is known not to be smooth, and one between
    /// each two of them, s: rising, further apart than rounding of the `end`.
    fn breaks(&self, end: f64) -> Vec<f64> {
        let loads = self.samples.iter().flat_map(|(_, f)| f);
        let prescribed = self.prescribed.iter().flatten().map(|(_, expression)| expression);
        let gaps = self.moving.iter().flat_map(|gap| &gap.distances);
        let all = loads.chain(prescribed).chain(gaps).flat_map(|f| f.breaks(end));
        let mut breaks: Vec<f64> = all.filter(|t| 0.0 < *t && *t < end).collect();
        breaks.sort_by(f64::total_cmp);
        breaks.dedup_by(|next, t| *next - *t < APART * end);
        let between: Vec<f64> = breaks.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        breaks.extend(between);
        breaks.sort_by(f64::total_cmp);
        breaks
    }

    /// The forces at time t, N per metre of thickness, on each edge under traction and on a sample of
    /// the triangles, and the prescribed displacements and the changes of gaps, m. On every rank those
    /// of the whole body: much less work than the nodal loads.
    fn sampled_at(&self, t: f64) -> [Vec<f64>; 2] {
        let forces = (self.samples.iter())
            .flat_map(|(places, f)| places.iter().map(move |place| (place, f)))
            .flat_map(|(([x, y], size), f)| f.iter().map(move |f| size * f.eval(*x, *y, t)))
            .collect();
        let mut displacements = self.prescribed_at(t);
        displacements.extend(self.moving.iter().map(|gap| gap.at(t) - self.gaps[gap.number]));
        [forces, displacements]
    }

    fn assemble(&self, body: &Body, t: f64) -> Vec<f64> {
        let mut load = vec![0.0; 2 * body.nodes.partition.local()];
        if let Some(force) = &self.body_force {
            let at = |[x, y]: [f64; 2]| force.each_ref().map(|f| f.eval(x, y, t));
            add_body_force(body, at, &mut load);
        }
        for Traction { edges, force, parts, .. } in &self.tractions {
            add_traction(body, edges, *parts, |x, normal| force.at(x, normal, t), &mut load);
        }
        load
    }
}

fn edge_samples(body: &Body, edges: &[Edge]) -> Vec<Sample> {
    let nodes = &body.nodes.points;
    let sample = |&Edge { ends: [a, b], .. }: &Edge| {
        (midpoint(nodes[a], nodes[b]), body.mesh.edge_normal([a, b]).1)
    };
    edges.iter().map(sample).collect()
}

/// Every so many triangles, which stand for those between them.
fn triangle_samples(body: &Body) -> Vec<Sample> {
    let stride = body.triangles.len().div_ceil(TRIANGLES).max(1);
    (body.mesh.triangles.iter().zip(&body.triangles))
        .step_by(stride)
        .map(|(nodes, triangle)| {
            let [a, b, c] = nodes.map(|node| body.mesh.nodes[node]);
            let centroid = [0, 1].map(|k| (a[k] + b[k] + c[k]) / 3.0);
            (centroid, stride as f64 * triangle.area())
        })
        .collect()
}

/// The forces, prescribed displacements and changes of gaps of a run, sampled between the ends of its
/// steps.
///
/// Every rank samples those of the whole body, so that all ranks choose the same steps.
pub(super) struct LoadCurve<'a> {
    problem: &'a DiscreteProblem,
    /// The largest Σ|·| of the forces and of the displacements at any time sampled.
    largest: [f64; 2],
    /// Times that must be looked at, rising, s.
    breaks: Vec<f64>,
    /// The end of the run, s.
    end: f64,
}

impl<'a> LoadCurve<'a> {
    /// Samples the whole run; `None` where nothing depends on time.
    pub(super) fn new(problem: &'a DiscreteProblem) -> Option<Self> {
        let end = problem.scene().time?.end;
        problem.loads.depend_on_time().then(|| {
            let breaks = problem.loads.breaks(end);
            let mut curve = Self { problem, largest: [0.0; 2], breaks: breaks.clone(), end };
            let times = problem.scene().sample_times(100).into_iter().chain(breaks);
            times.for_each(|time| _ = curve.sample(time));
            curve
        })
    }

    /// Saves or loads the largest values so far.
    pub(super) fn archive(&mut self, archive: &mut Archive) -> Result<(), ArchiveError> {
        archive.value(&mut self.largest)
    }

    /// The breaks between two times.
    pub(super) fn breaks(&self, start: f64, end: f64) -> &[f64] {
        let apart = APART * self.end;
        let place = |time: f64| self.breaks.partition_point(|other| *other <= time);
        let (first, last) = (place(start + apart), place(end - apart));
        &self.breaks[first..last.max(first)]
    }

    /// Σ|·| of the forces and of the displacements at `time` over the largest ones; 0 where all are 0.
    pub(super) fn sizes(&self, time: f64) -> [f64; 2] {
        let values = self.problem.loads.sampled_at(time);
        let size = |kind: usize| sum_abs(values[kind].iter().copied()) / self.largest[kind];
        [size(0), size(1)].map(|size| if size.is_finite() { size } else { 0.0 })
    }

    /// Whether loads, prescribed displacements and gaps are nearly linear in time from `start` to `end`.
    pub(super) fn is_nearly_linear(&mut self, start: f64, end: f64) -> bool {
        let [first, last] = [start, end].map(|time| self.problem.loads.sampled_at(time));
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
    pub(super) fn unresolved_step(problem: &'a DiscreteProblem) -> Option<[f64; 2]> {
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
    pub(super) fn pass_within_steps(problem: &'a DiscreteProblem) -> bool {
        let Some(grid) = problem.scene().time else { return false };
        let Stepping::Uniform { steps } = grid.stepping else { return false };
        let Some(mut curve) = Self::new(problem) else { return false };
        let size = |values: &Vec<f64>| sum_abs(values.iter().copied());
        let mut sizes = |time: f64| curve.sample(time).each_ref().map(size);
        let mut swings = [0.0_f64; 2];
        for n in 0..steps {
            let [start, end] = [grid.time(n, steps), grid.time(n + 1, steps)];
            let [first, last] = [sizes(start), sizes(end)];
            for point in 1..=POINTS {
                let part = point as f64 / (POINTS + 1) as f64;
                let now = sizes(start + part * (end - start));
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
