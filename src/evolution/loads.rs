//! The loads and prescribed displacements of a scene as functions of time.

use super::{
    DiscreteProblem,
    boundary_conditions::{BoundaryConditions, Traction},
};
use crate::{
    fem::{Body, Edge, Subdomain, add_body_force, add_traction, midpoint},
    scene::{Expression, Scene},
};

/// The midpoint and the length or area, m or m², of an edge or triangle.
type Sample = ([f64; 2], f64);

/// The body force is sampled in at most so many triangles.
const TRIANGLES: usize = 500;
/// The loads of a step may deviate from a straight line in time by this part of the largest ones.
const DEVIATION: f64 = 0.05;
/// Times sampled within a step.
const POINTS: usize = 16;

/// (f(t), ·)_V and the values of the fixed rows.
#[derive(Debug)]
pub struct Loads {
    /// f_B, N/m³, if it is not zero.
    body_force: Option<[Expression; 2]>,
    tractions: Vec<Traction>,
    /// Of each fixed row: the point and the component's expression, `None` for a symmetry's 0.
    prescribed: Vec<Option<([f64; 2], Expression)>>,
    /// Where each load of the whole body is sampled.
    samples: Vec<(Vec<Sample>, [Expression; 2])>,
    /// The load, where it does not depend on time.
    constant: Option<Vec<f64>>,
}

impl Loads {
    /// The loads on `body`, and the values of its fixed rows.
    pub(super) fn new(body: &Body, scene: &Scene, conditions: BoundaryConditions) -> Self {
        let BoundaryConditions { tractions, prescribed, .. } = conditions;
        let zero = scene.body_force.iter().all(|f| f.as_constant() == Some(0.0));
        let body_force = (!zero).then(|| scene.body_force.clone());
        let samples = (tractions.iter())
            .map(|traction| (edge_samples(body, &traction.edges), traction.force.clone()))
            .chain(body_force.iter().map(|f| (triangle_samples(body), f.clone())))
            .collect();
        let mut loads = Self { body_force, tractions, prescribed, samples, constant: None };
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

    /// Whether a load or a prescribed displacement depends on time.
    pub fn depend_on_time(&self) -> bool {
        let mut prescribed = self.prescribed.iter().flatten().map(|(_, expression)| expression);
        self.constant.is_none() || prescribed.any(Expression::depends_on_time)
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

    /// The forces at time t, N per metre of thickness, on each edge under traction and on a sample of
    /// the triangles, and the prescribed displacements, m. On every rank those of the whole body:
    /// much less work than the nodal loads.
    fn sampled_at(&self, t: f64) -> [Vec<f64>; 2] {
        let forces = (self.samples.iter())
            .flat_map(|(places, f)| places.iter().map(move |place| (place, f)))
            .flat_map(|(([x, y], size), f)| f.each_ref().map(|f| size * f.eval(*x, *y, t)))
            .collect();
        [forces, self.prescribed_at(t)]
    }

    fn assemble(&self, body: &Body, t: f64) -> Vec<f64> {
        let mut load = vec![0.0; 2 * body.nodes.partition.local()];
        let at = |f: &[Expression; 2], [x, y]: [f64; 2]| f.each_ref().map(|f| f.eval(x, y, t));
        if let Some(force) = &self.body_force {
            add_body_force(body, |x| at(force, x), &mut load);
        }
        for Traction { edges, force, .. } in &self.tractions {
            add_traction(body, edges, |x| at(force, x), &mut load);
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

/// The forces and prescribed displacements of a run, sampled between the ends of its steps.
///
/// Every rank samples those of the whole body, so that all ranks choose the same steps.
pub(super) struct LoadCurve<'a> {
    problem: &'a DiscreteProblem,
    /// The largest Σ|·| of the forces and of the prescribed displacements at any time sampled.
    largest: [f64; 2],
}

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
        let [first, last] = [start, end].map(|time| self.problem.loads.sampled_at(time));
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
