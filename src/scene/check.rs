//! Checks of a scene that need the mesh: names, and values at the nodes.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use super::boundary::{Boundary, contradiction};
use super::document::{NOWHERE, Problem};
use super::error::SceneError;
use super::expression::Expression;
use super::{Damage, Probe, Scene, may_start_at, rounded};
use crate::{
    fem::gauss_points,
    mesh::{Curve, Lines, Mesh, midpoint},
    suggestion::suggestion,
};

/// A fixed normal whose cosine with an edge's outward normal is at most this does not point out of
/// the body: gmsh places nodes to about 1e-8 of an edge.
const OUTWARD: f64 = 1e-6;

/// The approximate number of triangles and times for which an expression is evaluated before a run. They take
/// about a second.
const EVALUATIONS: usize = 4_000_000;

/// The largest admissible value. The squares of larger values overflow.
const LARGEST: f64 = 1e100;

/// A condition on finite values: its text in messages, and the test.
type Rule<'a> = (&'a str, &'a dyn Fn(f64) -> bool);

/// Is the accuracy required for the figure or norm `name`, if the scene names these figures, or none? A first contact is as exact as
/// the steps before it are short, and must be named.
pub(crate) fn is_required(names: &[String], name: &str) -> bool {
    match names {
        [] => !name.ends_with("first_contact"),
        names => names.iter().any(|known| known == name),
    }
}

impl Scene {
    /// Checks the scene against its mesh:
    /// - every material of a surface names a physical surface;
    /// - every boundary names a physical curve on the boundary of the body;
    /// - boundaries that share edges do not contradict each other;
    /// - ζ₀ is in (ζ_*, 1] at the nodes, and fixed normals point out of the body;
    /// - all expressions are finite at the points and times of their use, at up to a thousand times that are
    ///   known beforehand.
    ///
    /// # Errors
    /// All problems, each with its line, key, point and time.
    pub fn check_mesh(&self, mesh: &Mesh) -> Result<(), SceneError> {
        let mut problems = Vec::new();
        for boundary in &self.boundaries {
            match self.curve(boundary, mesh) {
                Ok(curve) => problems.extend(self.check_normal(boundary, curve, mesh)),
                Err(problem) => problems.push(problem),
            }
        }
        problems.extend(self.check_shared_edges(mesh));
        problems.extend(self.check_surfaces(mesh));
        let times = (EVALUATIONS / mesh.triangles.len().max(1)).min(1000);
        problems.extend(self.bad_values(mesh, &self.sample_times(times)));
        self.text.refuse(problems)
    }

    /// Checks that all expressions are finite at `times` and at the points of their use: the midpoints of
    /// triangle sides for the body force, the Gauss points of edges for tractions, the nodes for the others.
    ///
    /// # Errors
    /// The expressions that are not finite, each with its line, key, point and time.
    pub fn check_values(&self, mesh: &Mesh, times: &[f64]) -> Result<(), SceneError> {
        self.text.refuse(self.bad_values(mesh, times))
    }

    /// Reports the probes `outside` of the body.
    ///
    /// # Errors
    /// These probes, with their lines.
    pub fn check_probes(&self, outside: &[&Probe]) -> Result<(), SceneError> {
        let problem = |probe: &&Probe| {
            let (key, [x, y]) = (format!("probe.{}.point", probe.name), probe.point);
            self.at_key(&key, &format!("({x}, {y}) lies outside the body; move it into the body"))
        };
        self.text.refuse(outside.iter().map(problem).collect())
    }

    /// Reports the numbers of materials without a node as far from singular points as their `away`.
    ///
    /// # Errors
    /// These materials, with their lines.
    pub fn check_distances(&self, empty: &[usize]) -> Result<(), SceneError> {
        let problem = |number: &usize| {
            let name = number.checked_sub(1).and_then(|i| self.surfaces.keys().nth(i));
            let [of, key] = match name {
                Some(name) => [name.clone(), format!("material.{name}.away")],
                None => ["the material".to_owned(), "away".to_owned()],
            };
            let known = self.text.positions.contains_key(&key);
            let key: &str = if known { &key } else { "away" };
            self.at_key(key, &format!("leaves no node of {of}; set a smaller length"))
        };
        self.text.refuse(empty.iter().map(problem).collect())
    }

    /// Is the accuracy required for the figure or norm `name`?
    pub fn requires_accuracy_of(&self, name: &str) -> bool {
        is_required(&self.accuracy_of, name)
    }

    /// Checks that the figures in `accuracy_of` are among the `known` ones.
    ///
    /// # Errors
    /// The unknown figures, with their lines.
    pub fn check_figures(&self, known: &[&str]) -> Result<(), SceneError> {
        let unknown = self.accuracy_of.iter().filter(|name| !known.contains(&name.as_str()));
        let problem = |name: &String| {
            let suggestion = suggestion(name, known);
            self.at_key("accuracy_of", &format!("names `{name}`, which is no figure{suggestion}"))
        };
        self.text.refuse(unknown.map(problem).collect())
    }

    /// Checks that the file of the mesh can be read.
    ///
    /// # Errors
    /// It cannot, with its line.
    pub fn check_mesh_file(&self) -> Result<(), SceneError> {
        let file = &self.mesh.file;
        let problem = fs::metadata(file).err().map(|error| {
            self.at_key("mesh.file", &format!("cannot be read: {}: {error}", file.display()))
        });
        self.text.refuse(problem.into_iter().collect())
    }

    fn bad_values(&self, mesh: &Mesh, times: &[f64]) -> Vec<Problem> {
        let mut problems = Vec::new();
        let mut check = |key: &str, of: &[Option<&Expression>], points: &[[f64; 2]], rule: Rule| {
            for (i, f) in of.iter().enumerate().filter_map(|(i, f)| Some((i, (*f)?))) {
                let key = if of.len() > 1 { format!("{key}[{i}]") } else { key.to_owned() };
                problems.extend(self.check(&key, f, points, times, rule));
            }
        };
        let finite: Rule = ("", &|_| true);
        if let Some(Damage { initial, law, .. }) = &self.damage {
            let rule = format!("; it must be in ({}, 1]", law.threshold);
            let rule: Rule = (&rule, &|zeta| may_start_at(law, zeta));
            check("damage.initial", &[Some(initial)], &mesh.nodes, rule);
        }
        let at = |[p, q]: [usize; 2]| [mesh.nodes[p], mesh.nodes[q]];
        let sides = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let midpoints: Vec<_> = sides.map(at).map(|[p, q]| midpoint(p, q)).collect();
        check("body.force", &self.body_force.each_ref().map(Some), &midpoints, finite);
        check("body.gravity", &self.gravity.each_ref().map(Some), &[[0.0; 2]], finite);
        for boundary in &self.boundaries {
            let edges = || mesh.edges_of(&boundary.name).iter().copied().map(at);
            let nodes: Vec<_> = edges().flatten().collect();
            let gauss_points: Vec<_> = edges().flat_map(|[p, q]| gauss_points(p, q)).collect();
            for condition in &boundary.conditions {
                let points = if condition.is_support() { &nodes } else { &gauss_points };
                let key = boundary_key(&boundary.name, condition.name());
                check(&key, &condition.expressions(), points, finite);
            }
        }
        problems
    }

    fn curve<'m>(&self, boundary: &Boundary, mesh: &'m Mesh) -> Result<&'m Curve, Problem> {
        let problem = match mesh.curves.get(&boundary.name) {
            Some(Curve { other_edges: others @ 1.., .. }) => format!(
                "has {others} edges inside or outside the body; a physical curve used as a boundary must lie \
                 on it, and its surface in a Physical Surface"
            ),
            Some(curve) if curve.edges.is_empty() => {
                "has no edges in the mesh; mesh the physical curve".to_owned()
            }
            Some(curve) => return Ok(curve),
            None => {
                let known: Vec<&str> = mesh.curves.keys().map(String::as_str).collect();
                let suggestion = match known.is_empty() {
                    true => no_curves(mesh, &boundary.name),
                    false => suggestion(&boundary.name, &known),
                };
                match set_without_edges(mesh, &boundary.name) {
                    Some(of) => {
                        format!("is a set of {of}, and a boundary is made of edges{suggestion}")
                    }
                    None => format!("is no physical curve of the mesh{suggestion}"),
                }
            }
        };
        Err(self.at_name(boundary, &problem))
    }

    /// Problems of surfaces with materials: the mesh does not have the surface, or two surfaces share a
    /// triangle.
    fn check_surfaces(&self, mesh: &Mesh) -> Vec<Problem> {
        let mut problems = Vec::new();
        let mut taken = BTreeMap::new();
        for name in self.surfaces.keys() {
            let keys = ["material", "damage"].map(|table| format!("{table}.{name}"));
            let key =
                keys.iter().find(|key| self.text.position(key) != NOWHERE).unwrap_or(&keys[0]);
            let Some(triangles) = mesh.surfaces.get(name) else {
                let known: Vec<&str> = mesh.surfaces.keys().map(String::as_str).collect();
                let suggestion = suggestion(name, &known);
                let problem = format!("is no physical surface of the mesh{suggestion}");
                problems.push(self.at_key(key, &problem));
                continue;
            };
            let shared = triangles.iter().find_map(|t| Some((taken.insert(*t, name)?, *t)));
            if let Some((other, t)) = shared {
                let [x, y] = mesh.nodes[mesh.triangles[t][0]];
                let problem = format!(
                    "and \"{other}\" have a triangle at ({x}, {y}) in common: it cannot be of both \
                     materials; take it out of one of the two physical surfaces"
                );
                problems.push(self.at_key(key, &problem));
            }
        }
        problems
    }

    /// The boundaries that share an edge and contradict each other there. The constraints check shared nodes.
    fn check_shared_edges(&self, mesh: &Mesh) -> Vec<Problem> {
        let mut problems = Vec::new();
        for (n, boundary) in self.boundaries.iter().enumerate() {
            for other in &self.boundaries[..n] {
                let both = contradiction(&boundary.conditions, &other.conditions);
                let Some([has, others]) = both else { continue };
                let taken: BTreeSet<_> = mesh.edges_of(&other.name).iter().collect();
                let own = mesh.edges_of(&boundary.name);
                let shared = own.iter().find(|edge| taken.contains(edge));
                let Some(&[p, q]) = shared else { continue };
                let [x, y] = midpoint(mesh.nodes[p], mesh.nodes[q]);
                let problem = format!(
                    "has {has}, but boundary \"{}\" on the same edge at ({x}, {y}) has {others}; \
                     an edge can have only one of them: take it out of one of the two boundaries",
                    other.name
                );
                problems.push(self.at_name(boundary, &problem));
            }
        }
        problems
    }

    /// Checks that a fixed normal of the gap points out of the body all along the curve. Otherwise u·n ≤ g
    /// would stop the body on the wrong side, or let it enter the obstacle.
    fn check_normal(&self, boundary: &Boundary, curve: &Curve, mesh: &Mesh) -> Option<Problem> {
        let [nx, ny] = boundary.gap()?.normal?;
        let cosine = |&[from, to]: &[usize; 2]| {
            let ([x, y], _) = mesh.edge_normal([from, to]);
            (nx * x + ny * y, [from, to])
        };
        let wrong = curve.edges.iter().map(cosine).filter(|(cosine, _)| *cosine <= OUTWARD);
        let (cosine, worst) = wrong.min_by(|(a, _), (b, _)| a.total_cmp(b))?;
        let [x, y] = midpoint(mesh.nodes[worst[0]], mesh.nodes[worst[1]]);
        // Adding 0 turns -0 into 0.
        let [vx, vy] = mesh.edge_normal(worst).0.map(|component| component + 0.0);
        let how = if cosine < -OUTWARD { "into the body" } else { "along the boundary" };
        let problem = format!(
            "points {how} at ({x}, {y}), where the outward normal is ({vx:.4}, {vy:.4}); it must point from the body \
             towards the obstacle, all along the boundary"
        );
        Some(self.at_key(&boundary_key(&boundary.name, "normal"), &problem))
    }

    /// Whether the values of `expression` at `points` and `times` are finite and obey the `rule`. An
    /// expression that does not depend on space or time is evaluated at one point or time only.
    pub(super) fn check(
        &self,
        key: &str,
        expression: &Expression,
        points: &[[f64; 2]],
        times: &[f64],
        (rule, holds): Rule,
    ) -> Option<Problem> {
        let (in_time, in_space) = (expression.depends_on_time(), expression.depends_on_space());
        let times = if in_time { times } else { &times[..times.len().min(1)] };
        let points = if in_space { points } else { &points[..points.len().min(1)] };
        for &t in times {
            for &[x, y] in points {
                let value = expression.eval(x, y, t);
                if !(value.abs() <= LARGEST && holds(value)) {
                    let is_too_large = value.is_finite() && value.abs() > LARGEST;
                    let rule = if is_too_large { "; it is too large to be squared" } else { rule };
                    let when =
                        if in_time { format!(", t = {}", rounded(t)) } else { String::new() };
                    let problem = format!("is {value} at ({x}, {y}){when}{rule}");
                    return Some(self.at_key(key, &problem));
                }
            }
        }
        None
    }

    pub(super) fn at_key(&self, key: &str, problem: &str) -> Problem {
        (self.text.position(key), format!("{key} {problem}"))
    }

    /// A problem of a boundary, placed at its name.
    fn at_name(&self, Boundary { name, .. }: &Boundary, problem: &str) -> Problem {
        let position = self.text.position(&boundary_key(name, "name"));
        (position, format!("boundary \"{name}\" {problem}"))
    }
}

/// A key of a boundary, in full.
pub(super) fn boundary_key(name: &str, key: &str) -> String {
    format!("boundary.{name}.{key}")
}

/// The contents of a set of this name, from the note of a mesh of another program on its sets without an edge.
fn set_without_edges<'m>(mesh: &'m Mesh, name: &str) -> Option<&'m str> {
    let start = format!(" {name} (");
    let mut notes = mesh.notes.iter().filter(|note| note.starts_with("no edge of the boundary"));
    notes.find_map(|note| Some(note.split_once(&start)?.1.split_once(')')?.0))
}

/// The end of a message about a mesh without physical curves: how to name them, and the corners between them.
fn no_curves(mesh: &Mesh, name: &str) -> String {
    let lines = Lines::boundary(mesh);
    let corners = lines.ends.keys().filter(|&&node| lines.is_corner(node)).take(12);
    let corners =
        corners.map(|&node| format!("({}, {})", mesh.nodes[node][0], mesh.nodes[node][1]));
    format!(
        ", which has none: name each in the .geo, as in Physical Curve(\"{name}\") = {{1}}, or select edges here, as in \
         where = \"y < 1e-6\"; the boundary has corners at {}",
        corners.collect::<Vec<_>>().join(", ")
    )
}
