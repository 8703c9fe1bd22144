//! The loads and prescribed displacements of a scene as functions of time.

use crate::{
    fem::{Body, Share, add_body_force, add_traction},
    scene::{Boundary, Expression, Scene},
};

/// (f(t), ·)_V and the values of the fixed rows.
#[derive(Debug)]
pub struct Loads {
    body_force: Option<[Expression; 2]>,
    tractions: Vec<(Vec<[usize; 2]>, [Expression; 2])>,
    /// Of each fixed row: the point and the component's expression, `None` for a symmetry's 0.
    prescribed: Vec<Option<([f64; 2], Expression)>>,
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
            .filter_map(|b| b.traction.as_ref().map(|f| (edges(b), f.clone())))
            .collect();
        let body_force = (!zero(&scene.body_force)).then(|| scene.body_force.clone());
        let mut loads = Self { body_force, tractions, prescribed, constant: None };
        let all = loads.body_force.iter().chain(loads.tractions.iter().map(|(_, f)| f));
        if !all.flatten().any(Expression::depends_on_time) {
            loads.constant = Some(loads.assemble(body, 0.0));
        }
        loads
    }

    /// The loads on a rank's share. Values of the fixed rows are needed wherever one is known.
    pub fn share(self, share: &Share) -> Self {
        let edges = |(edges, f): (Vec<[usize; 2]>, _)| (share.edges(&edges), f);
        Self {
            tractions: self.tractions.into_iter().map(edges).collect(),
            constant: self.constant.map(|load| share.field(&load, 2)),
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
