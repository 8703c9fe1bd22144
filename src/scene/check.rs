//! What only the mesh can tell: names, and values at the nodes.

use std::collections::BTreeMap;

use super::boundary::{Boundary, Condition, Gap, boundary_key, contradiction};
use super::document::Problem;
use super::error::{SceneError, suggestion};
use super::expression::Expression;
use super::{Damage, Scene, may_start_at};
use crate::{
    fem::{gauss_points, midpoint},
    mesh::{Curve, Mesh, extent},
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
    /// boundary of the body, boundaries that share edges do not contradict each other, ζ₀ is in
    /// (ζ_*, 1] and the gap not negative at their nodes, fixed normals point out of the body, and
    /// all expressions are finite where and when they are used, as far as times are known
    /// beforehand (a thousand of them at most).
    ///
    /// # Errors
    /// All that is wrong, each with its line, key, point and time.
    pub fn check_mesh(&self, mesh: &Mesh) -> Result<(), SceneError> {
        let mut problems = Vec::new();
        if let Some(Damage { initial, law, .. }) = &self.damage {
            let nodes = mesh.nodes.iter().copied();
            let rule = format!("; it must be in ({}, 1]", law.threshold);
            let holds = |zeta| may_start_at(law, zeta);
            problems.extend(self.check("damage.initial", initial, nodes, &[0.0], &rule, holds));
        }
        let least = -ROUNDING * extent(&mesh.nodes);
        for boundary in &self.boundaries {
            match (self.curve(boundary, mesh), boundary.gap()) {
                (Err(problem), _) => problems.push(problem),
                (Ok(curve), Some(gap)) => {
                    let key = boundary_key(&boundary.name, "gap");
                    let nodes = curve.edges.iter().flatten().map(|&node| mesh.nodes[node]);
                    let rule = "; it must be finite and not negative";
                    let holds = |distance| distance >= least;
                    problems.extend(self.check(&key, &gap.distance, nodes, &[0.0], rule, holds));
                    problems.extend(self.check_normal(&boundary.name, gap, curve, mesh));
                }
                (Ok(_), None) => {}
            }
        }
        problems.extend(self.check_shared_edges(mesh));
        problems.extend(self.values_not_finite(mesh, &self.sample_times(1000)));
        self.text.verdict(problems)
    }

    /// Checks that the body force, the tractions and the prescribed displacements are finite at
    /// `times`, at the points where they are used: midpoints of triangle sides, Gauss points of
    /// edges, nodes.
    ///
    /// # Errors
    /// Those that are not, each with its line, key, point and time.
    pub fn check_values(&self, mesh: &Mesh, times: &[f64]) -> Result<(), SceneError> {
        self.text.verdict(self.values_not_finite(mesh, times))
    }

    fn values_not_finite(&self, mesh: &Mesh, times: &[f64]) -> Vec<Problem> {
        let at = |nodes: [usize; 2]| nodes.map(|node| mesh.nodes[node]);
        let sides = || mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let midpoints = || sides().map(at).map(|[p, q]| midpoint(p, q));
        let finite = |key: &str, expression, points: &mut dyn Iterator<Item = [f64; 2]>| {
            self.check(key, expression, points, times, "", |_| true)
        };
        let mut problems = Vec::new();
        for (i, force) in self.body_force.iter().enumerate() {
            problems.extend(finite(&format!("body.force[{i}]"), force, &mut midpoints()));
        }
        for boundary in &self.boundaries {
            let Some(curve) = mesh.curves.get(&boundary.name) else { continue };
            let edges = || curve.edges.iter().copied().map(at);
            let gauss_points = || edges().flat_map(|[p, q]| gauss_points(p, q));
            for (condition, i) in boundary.conditions.iter().flat_map(|c| [(c, 0), (c, 1)]) {
                let key = |what| boundary_key(&boundary.name, &format!("{what}[{i}]"));
                problems.extend(match condition {
                    Condition::Displacement(u) => u[i]
                        .as_ref()
                        .and_then(|u| finite(&key("displacement"), u, &mut edges().flatten())),
                    Condition::Traction(f) => finite(&key("traction"), &f[i], &mut gauss_points()),
                    Condition::Symmetry | Condition::Gap(_) => None,
                });
            }
        }
        problems
    }

    fn curve<'m>(&self, boundary: &Boundary, mesh: &'m Mesh) -> Result<&'m Curve, Problem> {
        let problem = match mesh.curves.get(&boundary.name) {
            Some(Curve { interior_edges: inside @ 1.., .. }) => format!(
                "has {inside} edges inside the body; a physical curve used as a boundary must lie \
                 on it"
            ),
            Some(curve) if curve.edges.is_empty() => {
                "has no edges in the mesh; mesh the physical curve".to_owned()
            }
            Some(curve) => return Ok(curve),
            None => {
                let known: Vec<&str> = mesh.curves.keys().map(String::as_str).collect();
                let suggestion = suggestion(&boundary.name, &known);
                format!("is no physical curve of the mesh{suggestion}")
            }
        };
        Err(self.at_name(boundary, &problem))
    }

    /// Whether boundaries of different names that share an edge can both hold there; the first
    /// that cannot. Shared nodes, where curves meet, are the business of the constraints.
    fn check_shared_edges(&self, mesh: &Mesh) -> Option<Problem> {
        let mut boundaries_of: BTreeMap<[usize; 2], Vec<&Boundary>> = BTreeMap::new();
        for boundary in &self.boundaries {
            let Some(curve) = mesh.curves.get(&boundary.name) else { continue };
            for &edge in &curve.edges {
                let others = boundaries_of.entry(edge).or_default();
                for other in others.iter() {
                    let both = contradiction(&boundary.conditions, &other.conditions);
                    let Some([has, others]) = both else { continue };
                    let [x, y] = midpoint(mesh.nodes[edge[0]], mesh.nodes[edge[1]]);
                    let problem = format!(
                        "has {has}, but boundary \"{}\" on the same edge at ({x}, {y}) has \
                         {others}; only one of them can hold there: take the edge out of one of \
                         the two physical curves",
                        other.name
                    );
                    return Some(self.at_name(boundary, &problem));
                }
                others.push(boundary);
            }
        }
        None
    }

    /// Whether the gap's normal, if fixed, points out of the body all along the curve. Elsewhere
    /// u·n ≤ g would hold the body back on the wrong side, or let it sink into the obstacle.
    fn check_normal(&self, name: &str, gap: &Gap, curve: &Curve, mesh: &Mesh) -> Option<Problem> {
        let [nx, ny] = gap.normal?;
        let cosine = |edge: &[usize; 2]| {
            let ([x, y], _) = mesh.edge_normal(*edge);
            nx * x + ny * y
        };
        let wrong = curve.edges.iter().filter(|edge| cosine(edge) <= ALONG);
        let worst = wrong.clone().min_by(|a, b| cosine(a).total_cmp(&cosine(b)))?;
        let [x, y] = midpoint(mesh.nodes[worst[0]], mesh.nodes[worst[1]]);
        let ([vx, vy], _) = mesh.edge_normal(*worst);
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
        Some(self.at_key(&boundary_key(name, "normal"), &problem))
    }

    /// Whether the values of `expression` at `points` and `times` are finite and such that it
    /// `holds`, as the `rule` says in words. What does not depend on the points or the times is
    /// evaluated once. Where these are too many, all points are taken at the first and the last
    /// time only, in between a part of them, in turn.
    fn check(
        &self,
        key: &str,
        expression: &Expression,
        points: impl Iterator<Item = [f64; 2]>,
        times: &[f64],
        rule: &str,
        holds: impl Fn(f64) -> bool,
    ) -> Option<Problem> {
        let (in_time, in_space) = (expression.depends_on_time(), expression.depends_on_space());
        let times = if in_time { times } else { &times[..times.len().min(1)] };
        let points: Vec<_> = points.take(if in_space { usize::MAX } else { 1 }).collect();
        let parts = (points.len() * times.len()).div_ceil(EVALUATIONS).max(1);
        for (i, &t) in times.iter().enumerate() {
            let all = i == 0 || i + 1 == times.len();
            let parts = if all { 1 } else { parts };
            for &[x, y] in points.iter().skip(i % parts).step_by(parts) {
                let value = expression.eval(x, y, t);
                if !(value.is_finite() && holds(value)) {
                    let when = if in_time { format!(", t = {t}") } else { String::new() };
                    let problem = format!("is {value} at ({x}, {y}){when}{rule}");
                    return Some(self.at_key(key, &problem));
                }
            }
        }
        None
    }

    fn at_key(&self, key: &str, problem: &str) -> Problem {
        (self.text.origin(key), format!("{key} {problem}"))
    }

    /// A problem of a boundary, placed at its name.
    fn at_name(&self, boundary: &Boundary, problem: &str) -> Problem {
        let origin = self.text.origin(&boundary_key(&boundary.name, "name"));
        (origin, format!("boundary \"{}\" {problem}", boundary.name))
    }
}
