//! The loads, prescribed displacements and gaps of a scene as functions of time.

mod curve;
mod forces;
mod jumps;
mod parts;

pub(crate) use curve::LoadCurve;
pub(super) use jumps::near_jumps;
pub(super) use jumps::{jump, load_jumps};
pub(crate) use parts::{DEVIATION, centroid, edge_parts, triangle_parts, triangle_point};

use super::boundary_conditions::{BoundaryConditions, RowValue};
use crate::{
    contact::NodalConstraint,
    fem::{Body, Edge, Subdomain, for_elements},
    mesh::sorted,
    scene::{Expression, Scene},
};
use forces::{BodyForce, SurfaceForce};
use rustc_hash::FxHashMap as HashMap;
use std::mem::take;

/// A note is given if more than this fraction of a load, a displacement or a damage is missed.
pub(crate) const NOTED: f64 = 0.05;
/// Approximate number of sample times of loads, for their maximum, and of what the mesh must resolve.
pub(crate) const SAMPLE_TIMES: usize = 8;

/// The nodal loads and the values of all rows, as functions of time.
#[derive(Debug)]
pub struct Loads {
    /// f_B, if it is not zero.
    body_force: Option<BodyForce>,
    surface_forces: Vec<SurfaceForce>,
    /// Per row: its value.
    values: Vec<RowValue>,
    /// Per row: the gap at the first solve, m; 0 for a prescribed displacement.
    first_gaps: Vec<f64>,
    /// The nodal loads, if they do not depend on time.
    constant: Option<Vec<f64>>,
}

/// The loads ∫ f·φ_i of each element, N per metre of thickness.
pub(crate) struct ElementLoads {
    /// Per triangle: at its vertices, and for P2 at the midpoints of the sides 01, 12, 20.
    pub(crate) triangles: Vec<[[f64; 2]; 6]>,
    /// By the nodes at the ends of a loaded edge in increasing order: at these ends and in its middle.
    pub(crate) edges: HashMap<[usize; 2], [[f64; 2]; 3]>,
}

impl Loads {
    /// The loads of `scene` on `body`, and the values of its rows from the `conditions`.
    pub(super) fn new(body: &Body, scene: &Scene, conditions: &mut BoundaryConditions) -> Self {
        let values = take(&mut conditions.values);
        let first = |(row, value): (&NodalConstraint, &RowValue)| match row.is_gap() {
            true => value.at(scene.start()),
            false => 0.0,
        };
        let first_gaps = conditions.rows.iter().zip(&values).map(first).collect();
        let body_force = BodyForce::new(body, scene);
        let surface_forces = scene.boundaries.iter().flat_map(|boundary| {
            let edges = body.edges(body.mesh.edges_of(&boundary.name));
            let points = &body.nodes.points;
            boundary.loads().map(move |force| SurfaceForce::new(points, &edges, force))
        });
        let surface_forces = surface_forces.collect();
        let constant = None;
        let mut loads = Self { body_force, surface_forces, values, first_gaps, constant };
        if !loads.forces().any(Expression::depends_on_time) {
            loads.constant = Some(loads.assemble(body, 0.0));
        }
        loads
    }

    /// The loads on the subdomain of a rank. Every rank keeps all rows.
    pub(super) fn restrict(self, subdomain: &Subdomain) -> Self {
        let local = |force: SurfaceForce| force.restrict(subdomain);
        Self {
            surface_forces: self.surface_forces.into_iter().map(local).collect(),
            constant: self.constant.map(|load| subdomain.field(&load, 2)),
            ..self
        }
    }

    fn forces(&self) -> impl Iterator<Item = &Expression> {
        let surface = self.surface_forces.iter().flat_map(SurfaceForce::expressions);
        surface.chain(self.body_force.iter().flat_map(BodyForce::expressions))
    }

    /// Notes on loads whose integrals may miss a large part.
    pub(crate) fn notes(&self, times: &[f64]) -> Vec<String> {
        let body = self.body_force.iter();
        let body = body.map(|force| ("body force", "triangles", force.missed));
        let surface = self.surface_forces.iter().map(|force| {
            let missed = times.iter().map(|&t| force.resolved(t).missed).fold(0.0, f64::max);
            ("surface load", "edges", missed)
        });
        let note = |(name, elements, missed): (&str, &str, f64)| {
            let part = match missed < 1.0 {
                true => format!("up to {:.0} % of it", 100.0 * missed),
                false => "much of it, or all,".to_owned(),
            };
            format!(
                "the {name} changes too sharply within the mesh's {elements} to be integrated: {part} may be \
                 missed; refine the mesh where it changes (explain loads)"
            )
        };
        body.chain(surface).filter(|(.., missed)| *missed > NOTED).map(note).collect()
    }

    /// Does a load, a prescribed displacement or a gap depend on time?
    pub fn depend_on_time(&self) -> bool {
        self.constant.is_none() || self.values.iter().any(RowValue::depends_on_time)
    }

    /// Does the body force depend on time?
    pub fn body_force_depends_on_time(&self) -> bool {
        let mut body_force = self.body_force.iter().flat_map(BodyForce::expressions);
        body_force.any(Expression::depends_on_time)
    }

    /// Nodal loads at time t, N per metre of thickness.
    pub fn at(&self, body: &Body, t: f64) -> Vec<f64> {
        self.constant.clone().unwrap_or_else(|| self.assemble(body, t))
    }

    /// The estimated errors of the resultant at time t: of (F_x, F_y) and the moment about the centroid by the shape of the
    /// edges, N and N m per metre of thickness; and by the quadrature, relative to Σ|f|.
    pub(super) fn resultant_error(&self, body: &Body, t: f64) -> ([f64; 3], f64) {
        let errors = self.surface_forces.iter().map(|f| f.resultant_error(body.centroid, t));
        let sum = errors.fold([0.0; 3], |sum, error| [0, 1, 2].map(|k| sum[k] + error[k]));
        let missed = self.surface_forces.iter().map(|force| force.resolved(t).missed);
        (sum, missed.chain(self.body_force.iter().map(|force| force.missed)).fold(0.0, f64::max))
    }

    /// The estimated errors of the integrals of all loads at some times: the largest one, N per metre of thickness, and
    /// relative to the largest Σ|f|. Collective.
    pub(crate) fn integral_errors(&self, body: &Body, times: &[f64]) -> [f64; 2] {
        let partition = &body.nodes.partition;
        let [mut error, mut size] = [0.0_f64; 2];
        for &t in times {
            let surface = self.surface_forces.iter().map(|force| force.resolved(t).error);
            error = error.max(surface.chain(self.body_force.iter().map(|of| of.error)).sum());
            let own = self.at(body, t).into_iter().take(2 * partition.owned());
            size = size.max(partition.comm().total(own.map(f64::abs).sum()));
        }
        [error, if error == 0.0 { 0.0 } else { error / size }]
    }

    /// The values of all rows at time t, m: prescribed displacements u·d, and gaps.
    pub fn values_at(&self, t: f64) -> Vec<f64> {
        self.values.iter().map(|value| value.at(t)).collect()
    }

    /// Samples at time t: forces on loaded edges and some triangles, N per metre of thickness; prescribed
    /// displacements and gap changes, m. Every rank samples the whole body, which costs much less than the nodal
    /// loads.
    fn sampled_at(&self, t: f64) -> [Vec<f64>; 2] {
        let mut forces = Vec::new();
        self.surface_forces.iter().for_each(|force| force.sample(t, &mut forces));
        self.body_force.iter().for_each(|force| force.sample(t, &mut forces));
        let values = self.values.iter().zip(&self.first_gaps);
        [forces, values.map(|(value, gap)| value.at(t) - gap).collect()]
    }

    fn assemble(&self, body: &Body, t: f64) -> Vec<f64> {
        let mut load = vec![0.0; 2 * body.nodes.partition.local()];
        let mut add = |node: usize, [fx, fy]: [f64; 2]| {
            load[2 * node] += fx;
            load[2 * node + 1] += fy;
        };
        for_elements!(body, cells => {
            let mut of_triangle = |t: usize, i: usize, f| add(cells.nodes[t][i], f);
            self.body_force.iter().for_each(|force| force.add(body, t, &mut of_triangle));
        });
        let mut of_edge = |_: &Edge, node: usize, f| add(node, f);
        self.surface_forces.iter().for_each(|force| force.add(body, t, &mut of_edge));
        load
    }

    /// The loads at time t by triangles and by edges. Their sums at the nodes are [`Self::at`].
    pub(crate) fn by_elements(&self, body: &Body, t: f64) -> ElementLoads {
        let mut loads = ElementLoads {
            triangles: vec![[[0.0; 2]; 6]; body.triangles.len()],
            edges: HashMap::default(),
        };
        let add = |to: &mut [f64; 2], [fx, fy]: [f64; 2]| *to = [to[0] + fx, to[1] + fy];
        let mut of_triangle = |t: usize, i: usize, f| add(&mut loads.triangles[t][i], f);
        self.body_force.iter().for_each(|force| force.add(body, t, &mut of_triangle));
        let mut of_edge = |edge: &Edge, node: usize, f| {
            let ends = sorted(edge.ends);
            let place = ends.iter().position(|&end| end == node).unwrap_or(2);
            add(&mut loads.edges.entry(ends).or_default()[place], f);
        };
        self.surface_forces.iter().for_each(|force| force.add(body, t, &mut of_edge));
        loads
    }
}
