//! The loads and prescribed displacements of a scene as functions of time.

use crate::{
    fem::{Body, Subdomain, add_body_force, add_traction, midpoint},
    scene::{Boundary, Expression, Scene},
};

/// The midpoint and the length or area, m or m², of an edge or triangle.
type Sample = ([f64; 2], f64);

/// The body force is sampled in at most so many triangles.
const TRIANGLES: usize = 500;

/// (f(t), ·)_V and the values of the fixed rows.
#[derive(Debug)]
pub struct Loads {
    body_force: Option<[Expression; 2]>,
    tractions: Vec<(Vec<[usize; 2]>, [Expression; 2])>,
    /// Of each fixed row: the point and the component's expression, `None` for a symmetry's 0.
    prescribed: Vec<Option<([f64; 2], Expression)>>,
    /// Where each load is sampled.
    samples: Vec<(Vec<Sample>, [Expression; 2])>,
    /// The load, where it does not depend on time.
    constant: Option<Vec<f64>>,
}

impl Loads {
    /// The loads of `scene` on `body`, whose mesh has all curves the scene names.
    pub fn new(
        scene: &Scene,
        body: &Body,
        prescribed: Vec<Option<([f64; 2], Expression)>>,
    ) -> Self {
        let zero = |f: &[Expression; 2]| f.iter().all(|e| e.as_constant() == Some(0.0));
        let edges = |b: &Boundary| {
            body.mesh.curves.get(&b.name).map(|curve| curve.edges.clone()).unwrap_or_default()
        };
        let tractions: Vec<_> = (scene.boundaries.iter())
            .filter_map(|b| b.traction().map(|f| (edges(b), f.clone())))
            .collect();
        let body_force = (!zero(&scene.body_force)).then(|| scene.body_force.clone());
        let samples = (tractions.iter())
            .map(|(edges, f)| (edge_samples(body, edges), f.clone()))
            .chain(body_force.iter().map(|f| (triangle_samples(body), f.clone())))
            .collect();
        let mut loads = Self { body_force, tractions, prescribed, samples, constant: None };
        let all = loads.body_force.iter().chain(loads.tractions.iter().map(|(_, f)| f));
        if !all.flatten().any(Expression::depends_on_time) {
            loads.constant = Some(loads.assemble(body, 0.0));
        }
        loads
    }

    /// The loads on a rank's share. Values of the fixed rows are needed wherever one is known.
    pub fn restrict(self, subdomain: &Subdomain) -> Self {
        let edges = |(edges, f): (Vec<[usize; 2]>, _)| (subdomain.edges(&edges), f);
        Self {
            tractions: self.tractions.into_iter().map(edges).collect(),
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

    /// Forces at time t, N per metre of thickness, on each edge under traction and on a sample of the
    /// triangles, of the whole body on every rank: much less work than the nodal loads.
    pub fn sampled_at(&self, t: f64) -> Vec<f64> {
        let force = |f: &Expression, [x, y]: [f64; 2], size: f64| size * f.eval(x, y, t);
        (self.samples.iter())
            .flat_map(|(places, f)| places.iter().map(move |place| (place, f)))
            .flat_map(|(&(x, size), f)| [force(&f[0], x, size), force(&f[1], x, size)])
            .collect()
    }

    /// u·d of each fixed row at time t, m.
    pub fn prescribed_at(&self, t: f64) -> Vec<f64> {
        let value = |row: &Option<([f64; 2], Expression)>| match row {
            Some(([x, y], expression)) => expression.eval(*x, *y, t),
            None => 0.0,
        };
        self.prescribed.iter().map(value).collect()
    }

    fn assemble(&self, body: &Body, t: f64) -> Vec<f64> {
        let mut load = vec![0.0; 2 * body.partition.local()];
        let at = |f: &[Expression; 2], [x, y]: [f64; 2]| [f[0].eval(x, y, t), f[1].eval(x, y, t)];
        if let Some(force) = &self.body_force {
            add_body_force(body, |x| at(force, x), &mut load);
        }
        for (edges, traction) in &self.tractions {
            add_traction(body, edges, |x| at(traction, x), &mut load);
        }
        load
    }
}

fn edge_samples(body: &Body, edges: &[[usize; 2]]) -> Vec<Sample> {
    let ends = edges.iter().map(|edge| edge.map(|node| body.mesh.nodes[node]));
    ends.map(|[p, q]| (midpoint(p, q), (q[0] - p[0]).hypot(q[1] - p[1]))).collect()
}

/// Every so many triangles, which stand for those between them.
fn triangle_samples(body: &Body) -> Vec<Sample> {
    let stride = body.triangles.len().div_ceil(TRIANGLES).max(1);
    (body.mesh.triangles.iter().zip(&body.triangles))
        .step_by(stride)
        .map(|(nodes, triangle)| {
            let [a, b, c] = nodes.map(|node| body.mesh.nodes[node]);
            let centroid = [0, 1].map(|k| (a[k] + b[k] + c[k]) / 3.0);
            (centroid, stride as f64 * triangle.area)
        })
        .collect()
}
