//! What only the mesh can tell: names, and values at the nodes.

use super::error::{Names, SceneError};
use super::expression::Expression;
use super::source::boundary_key;
use super::{Boundary, Damage, Gap, Scene, may_start_at};
use crate::mesh::{Curve, Mesh};

/// A gap may be this much below zero, relative to the size of the body: nodes on
/// curved boundaries carry the mesh generator's rounding, differences like `0.3-0.1*3` their own.
const ROUNDING: f64 = 1e-12;
/// A fixed normal whose cosine with an edge's outward normal is at most this does not point out of
/// the body: gmsh places nodes to about 1e-8 of an edge.
const ALONG: f64 = 1e-6;

impl Scene {
    /// Checks the scene against its mesh: every boundary names a physical curve on the
    /// boundary of the body, ζ₀ is in (ζ_*, 1] and the gap not negative at their nodes, fixed
    /// normals point out of the body, and all expressions are finite where they are used, at
    /// t = 0 and at the end, or at t = 1 where there is no time.
    ///
    /// # Errors
    /// The first of these that fails, with its line, key, node and time.
    pub fn check_mesh(&self, mesh: &Mesh) -> Result<(), SceneError> {
        let all = || 0..mesh.nodes.len();
        for (i, force) in self.body_force.iter().enumerate() {
            self.finite(&format!("body.force[{i}]"), force, mesh, all())?;
        }
        if let Some(damage) = &self.damage {
            self.check_initial(damage, mesh)?;
        }
        let extent = extent(mesh);
        for boundary in &self.boundaries {
            let curve = self.curve(boundary, mesh)?;
            self.check_boundary(boundary, curve, mesh, extent)?;
        }
        Ok(())
    }

    fn curve<'m>(&self, boundary: &Boundary, mesh: &'m Mesh) -> Result<&'m Curve, SceneError> {
        let name = &boundary.name;
        let Some(curve) = mesh.curves.get(name) else {
            let known = mesh.curves.keys().cloned().collect();
            return Err(SceneError::UnknownCurve {
                place: self.source.place_of(&boundary_key(name, "name")),
                key: format!("boundary \"{name}\""),
                names: Box::new(Names::like(name, known)),
            });
        };
        let problem = match (curve.edges.len(), curve.interior_edges) {
            (_, 1..) => format!(
                "has {} edges inside the body; a physical curve used as a boundary must lie on it",
                curve.interior_edges
            ),
            (0, 0) => "has no edges in the mesh; mesh the physical curve".to_owned(),
            _ => return Ok(curve),
        };
        Err(SceneError::Invalid {
            place: self.source.place_of(&boundary_key(name, "name")),
            key: format!("boundary \"{name}\""),
            problem,
        })
    }

    fn check_initial(&self, damage: &Damage, mesh: &Mesh) -> Result<(), SceneError> {
        let key = "damage.initial";
        self.finite(key, &damage.initial, mesh, 0..mesh.nodes.len())?;
        for &[x, y] in &mesh.nodes {
            let zeta = damage.initial.eval(x, y, 0.0);
            if !may_start_at(&damage.law, zeta) {
                let least = damage.law.threshold;
                let problem = format!("is {zeta} at ({x}, {y}); it must be in ({least}, 1]");
                return Err(self.at_key(key, problem));
            }
        }
        Ok(())
    }

    fn check_boundary(
        &self,
        boundary: &Boundary,
        curve: &Curve,
        mesh: &Mesh,
        extent: f64,
    ) -> Result<(), SceneError> {
        let nodes = || curve.edges.iter().flatten().copied();
        let key = |key: &str| boundary_key(&boundary.name, key);
        for (i, component) in boundary.displacement.iter().flatten().enumerate() {
            if let Some(component) = component {
                self.finite(&key(&format!("displacement[{i}]")), component, mesh, nodes())?;
            }
        }
        for (i, component) in boundary.traction.iter().flatten().enumerate() {
            self.finite(&key(&format!("traction[{i}]")), component, mesh, nodes())?;
        }
        let Some(gap) = &boundary.gap else {
            return Ok(());
        };
        self.finite(&key("gap"), &gap.distance, mesh, nodes())?;
        for (x, y) in nodes().filter_map(|node| coordinates(mesh, node)) {
            let distance = gap.distance.eval(x, y, 0.0);
            if distance < -ROUNDING * extent {
                let problem = format!("is {distance} at ({x}, {y}); it must not be negative");
                return Err(self.at_key(&key("gap"), problem));
            }
        }
        self.check_normal(gap, &key("normal"), curve, mesh)
    }

    /// Whether the gap's normal, if fixed, points out of the body all along the curve. Elsewhere
    /// u·n ≤ g would hold the body back on the wrong side, or let it sink into the obstacle.
    fn check_normal(
        &self,
        gap: &Gap,
        key: &str,
        curve: &Curve,
        mesh: &Mesh,
    ) -> Result<(), SceneError> {
        let Some([nx, ny]) = gap.normal else { return Ok(()) };
        let cosine = |edge: &[usize; 2]| {
            let ([x, y], _) = mesh.edge_normal(*edge);
            nx * x + ny * y
        };
        let wrong = curve.edges.iter().filter(|edge| cosine(edge) <= ALONG);
        let Some(worst) = wrong.clone().min_by(|a, b| cosine(a).total_cmp(&cosine(b))) else {
            return Ok(());
        };
        let ([px, py], [qx, qy]) = (mesh.nodes[worst[0]], mesh.nodes[worst[1]]);
        let (x, y, ([vx, vy], _)) = (0.5 * (px + qx), 0.5 * (py + qy), mesh.edge_normal(*worst));
        // Adding 0 turns -0 into 0.
        let [vx, vy] = [vx + 0.0, vy + 0.0];
        let how = if cosine(worst) < -ALONG { "into the body" } else { "along the boundary" };
        let mend = match wrong.count() == curve.edges.len() {
            true => "turn it round, so that it points from the body towards the obstacle",
            false => "restrict the physical curve to where the body faces the obstacle",
        };
        let problem = format!(
            "points {how} at ({x}, {y}), where the outward normal is ({vx:.4}, {vy:.4}); {mend}"
        );
        Err(self.at_key(key, problem))
    }

    /// Whether `expression` is finite at `nodes`, at t = 0 and at the end, or at the only time.
    fn finite(
        &self,
        key: &str,
        expression: &Expression,
        mesh: &Mesh,
        nodes: impl Iterator<Item = usize>,
    ) -> Result<(), SceneError> {
        let times = self.time.map_or([1.0; 2], |time| [0.0, time.end]);
        for (x, y) in nodes.filter_map(|node| coordinates(mesh, node)) {
            for t in times {
                let value = expression.eval(x, y, t);
                if !value.is_finite() {
                    let problem = format!("is {value} at ({x}, {y}), t = {t}");
                    return Err(self.at_key(key, problem));
                }
            }
        }
        Ok(())
    }

    fn at_key(&self, key: &str, problem: String) -> SceneError {
        SceneError::Invalid { place: self.source.place_of(key), key: key.to_owned(), problem }
    }
}

fn coordinates(mesh: &Mesh, node: usize) -> Option<(f64, f64)> {
    mesh.nodes.get(node).map(|&[x, y]| (x, y))
}

/// The longer side of the box around the mesh, m.
fn extent(mesh: &Mesh) -> f64 {
    let side = |axis: usize| {
        let values = mesh.nodes.iter().map(|node| node[axis]);
        let (low, high) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        high - low
    };
    side(0).max(side(1)).max(0.0)
}
