//! What only the mesh can tell: names, and values at the nodes.

use std::collections::BTreeMap;

use super::boundaries::contradiction;
use super::error::{Names, SceneError};
use super::expression::Expression;
use super::source::boundary_key;
use super::{Boundary, Damage, Gap, Scene, may_start_at};
use crate::{
    fem::{gauss_points, midpoint},
    mesh::{Curve, Mesh},
};

/// A gap may be this much below zero, relative to the size of the body: nodes on
/// curved boundaries carry the mesh generator's rounding, differences like `0.3-0.1*3` their own.
const ROUNDING: f64 = 1e-12;
/// A fixed normal whose cosine with an edge's outward normal is at most this does not point out of
/// the body: gmsh places nodes to about 1e-8 of an edge.
const ALONG: f64 = 1e-6;

/// Evaluations of an expression in space and time before a run, about: less than a second.
const EVALUATIONS: usize = 4_000_000;

impl Scene {
    /// Checks the scene against its mesh: every boundary names a physical curve on the
    /// boundary of the body, boundaries that share edges do not contradict each other, ζ₀ is in (ζ_*, 1] and the gap not negative at their nodes, fixed
    /// normals point out of the body, and all expressions are finite where and when they are
    /// used, as far as times are known beforehand (a thousand of them at most).
    ///
    /// # Errors
    /// The first of these that fails, with its line, key, point and time.
    pub fn check_mesh(&self, mesh: &Mesh) -> Result<(), SceneError> {
        if let Some(damage) = &self.damage {
            self.check_initial(damage, mesh)?;
        }
        let extent = extent(mesh);
        for boundary in &self.boundaries {
            let curve = self.curve(boundary, mesh)?;
            if let Some(gap) = &boundary.gap {
                self.check_gap(&boundary_key(&boundary.name, "gap"), gap, curve, mesh, extent)?;
                self.check_normal(gap, &boundary_key(&boundary.name, "normal"), curve, mesh)?;
            }
        }
        self.check_shared_edges(mesh)?;
        self.check_values(mesh, &self.sample_times(1000))
    }

    /// Checks that the body force, the tractions and the prescribed displacements are finite at
    /// `times`, at the points where they are used: midpoints of triangle sides, Gauss points of
    /// edges, nodes.
    ///
    /// # Errors
    /// One that is not, with its line, key, point and time.
    pub fn check_values(&self, mesh: &Mesh, times: &[f64]) -> Result<(), SceneError> {
        let at = |nodes: [usize; 2]| nodes.map(|node| mesh.nodes[node]);
        let sides = || mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let midpoints = || sides().map(at).map(|[p, q]| midpoint(p, q));
        for (i, force) in self.body_force.iter().enumerate() {
            self.finite(&format!("body.force[{i}]"), force, midpoints(), times)?;
        }
        for boundary in &self.boundaries {
            let Some(curve) = mesh.curves.get(&boundary.name) else { continue };
            let edges = || curve.edges.iter().copied().map(at);
            let key = |what, i| boundary_key(&boundary.name, &format!("{what}[{i}]"));
            for (i, component) in boundary.displacement.iter().flatten().enumerate() {
                if let Some(component) = component {
                    self.finite(&key("displacement", i), component, edges().flatten(), times)?;
                }
            }
            for (i, component) in boundary.traction.iter().flatten().enumerate() {
                let points = edges().flat_map(|[p, q]| gauss_points(p, q));
                self.finite(&key("traction", i), component, points, times)?;
            }
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

    /// Whether boundaries of different names that share an edge can both hold there. Shared nodes,
    /// where curves meet, are the business of the constraints.
    fn check_shared_edges(&self, mesh: &Mesh) -> Result<(), SceneError> {
        let mut boundaries_of: BTreeMap<[usize; 2], Vec<&Boundary>> = BTreeMap::new();
        for boundary in &self.boundaries {
            let Some(curve) = mesh.curves.get(&boundary.name) else { continue };
            for &edge in &curve.edges {
                let others = boundaries_of.entry(edge).or_default();
                for other in others.iter() {
                    let Some([has, others]) = contradiction(boundary, other) else { continue };
                    let [x, y] = midpoint(mesh.nodes[edge[0]], mesh.nodes[edge[1]]);
                    let problem = format!(
                        "has {has}, but boundary \"{}\" on the same edge at ({x}, {y}) has \
                         {others}; only one of them can hold there: take the edge out of one of \
                         the two physical curves",
                        other.name
                    );
                    let place = self.source.place_of(&boundary_key(&boundary.name, "name"));
                    let key = format!("boundary \"{}\"", boundary.name);
                    return Err(SceneError::Invalid { place, key, problem });
                }
                others.push(boundary);
            }
        }
        Ok(())
    }

    fn check_initial(&self, damage: &Damage, mesh: &Mesh) -> Result<(), SceneError> {
        let key = "damage.initial";
        self.finite(key, &damage.initial, mesh.nodes.iter().copied(), &[0.0])?;
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

    fn check_gap(
        &self,
        key: &str,
        gap: &Gap,
        curve: &Curve,
        mesh: &Mesh,
        extent: f64,
    ) -> Result<(), SceneError> {
        let nodes = || curve.edges.iter().flatten().map(|&node| mesh.nodes[node]);
        self.finite(key, &gap.distance, nodes(), &[0.0])?;
        for [x, y] in nodes() {
            let distance = gap.distance.eval(x, y, 0.0);
            if distance < -ROUNDING * extent {
                let problem = format!("is {distance} at ({x}, {y}); it must not be negative");
                return Err(self.at_key(key, problem));
            }
        }
        Ok(())
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

    /// Whether `expression` is finite at `points` and `times`; what does not depend on one of
    /// them is evaluated once. Where these are too many, all points are taken at the first and the
    /// last time only, in between a part of them, in turn.
    fn finite(
        &self,
        key: &str,
        expression: &Expression,
        points: impl Iterator<Item = [f64; 2]>,
        times: &[f64],
    ) -> Result<(), SceneError> {
        let (in_time, in_space) = (expression.depends_on_time(), expression.depends_on_space());
        let times = if in_time { times } else { &times[..times.len().min(1)] };
        let points: Vec<_> = points.take(if in_space { usize::MAX } else { 1 }).collect();
        let parts = (points.len() * times.len()).div_ceil(EVALUATIONS).max(1);
        for (i, &t) in times.iter().enumerate() {
            let all = i == 0 || i + 1 == times.len();
            let parts = if all { 1 } else { parts };
            for &[x, y] in points.iter().skip(i % parts).step_by(parts) {
                let value = expression.eval(x, y, t);
                if !value.is_finite() {
                    let when = if in_time { format!(", t = {t}") } else { String::new() };
                    return Err(self.at_key(key, format!("is {value} at ({x}, {y}){when}")));
                }
            }
        }
        Ok(())
    }

    fn at_key(&self, key: &str, problem: String) -> SceneError {
        SceneError::Invalid { place: self.source.place_of(key), key: key.to_owned(), problem }
    }
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
