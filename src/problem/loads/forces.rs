//! Surface loads and body forces, integrated over parts of edges and triangles that resolve them.

use super::parts::{
    EdgePart, Parts, TrianglePart, WHOLE, centroid, edge_parts, triangle_parts, triangle_points,
};
use crate::{
    fem::{Body, Edge, GAUSS, Subdomain, TriangleParts, add_body_force, add_traction, parabola},
    mesh::{BoundaryFace, CHORDS},
    scene::{Expression, Scene, SurfaceLoad},
};
use nalgebra::Vector2;
use std::collections::BTreeMap;

/// Allowed errors of resultants relative to ∫|f|: for assembled surface loads …
const RESULTANT_ERROR: f64 = 1e-6;
/// … and for surface loads that are only sampled.
const SAMPLED: f64 = 0.02;
/// Maximum number of triangle parts added for a body force: one that depends on time, and a constant one.
const MORE: [f64; 2] = [10_000.0, 50_000.0];
/// The approximate number of times at which a body force is sampled to divide triangles.
const BODY_FORCE_TIMES: usize = 4;
/// Maximum number of undivided triangles in which a body force is sampled, and of parts of divided ones.
const MAX_SAMPLES: usize = 500;

#[derive(Debug)]
pub(super) struct SurfaceForce {
    /// f_N, N/m².
    force: SurfaceLoad,
    /// Its edges in the undivided body: ends and middles, m. All ranks divide them in the same way.
    lines: Vec<[[f64; 2]; 3]>,
    /// The halves of the same edges as parts of a smooth curve.
    smooth: Vec<[[f64; 2]; 3]>,
    /// The same edges on this rank; `None` for edges of other ranks.
    edges: Vec<Option<Edge>>,
}

impl SurfaceForce {
    pub(super) fn new(points: &[[f64; 2]], edges: &[Edge], force: &SurfaceLoad) -> Self {
        let line = |edge: &Edge| [0.0, 0.5, 1.0].map(|s| edge.at(points, s));
        let lines = edges.iter().map(line).collect();
        let smooth = smooth_halves(edges, points);
        let (force, edges) = (force.clone(), edges.iter().copied().map(Some).collect());
        Self { force, lines, smooth, edges }
    }

    pub(super) fn restrict(self, subdomain: &Subdomain) -> Self {
        let local = |edge: &Option<Edge>| subdomain.edges(edge.as_slice()).pop();
        Self { edges: self.edges.iter().map(local).collect(), ..self }
    }

    pub(super) fn expressions(&self) -> impl Iterator<Item = &Expression> {
        self.force.expressions().iter()
    }

    fn parts(&self, t: f64, deviation: f64) -> Parts<EdgePart> {
        edge_parts(&self.lines, self.force.expressions(), t, deviation)
    }

    /// The parts of its edges for the nodal loads at time t.
    pub(super) fn resolved(&self, t: f64) -> Parts<EdgePart> {
        self.parts(t, RESULTANT_ERROR)
    }

    /// Calls `add` with the forces at the nodes of its edges at time t.
    pub(super) fn add(&self, body: &Body, t: f64, add: &mut dyn FnMut(&Edge, usize, [f64; 2])) {
        let parts = self.resolved(t).parts.into_iter();
        let parts = parts.filter_map(|(edge, part)| Some((self.edges[edge]?, part)));
        add_traction(&body.nodes.points, parts, |x, normal| self.force.at(x, normal, t), add);
    }

    /// The estimated error of the resultant (F_x, F_y) and the moment about `centre` at time t by the shape of the edges:
    /// their change from the edges to the halves of the smooth curve.
    pub(super) fn resultant_error(&self, centre: [f64; 2], t: f64) -> [f64; 3] {
        let [edges, smooth] = [&self.lines, &self.smooth].map(|l| self.resultant(l, centre, t));
        [0, 1, 2].map(|k| smooth[k] - edges[k])
    }

    fn resultant(&self, lines: &[[[f64; 2]; 3]], [cx, cy]: [f64; 2], t: f64) -> [f64; 3] {
        let parts =
            edge_parts(lines, self.force.expressions(), t, RESULTANT_ERROR).parts.into_iter();
        let edge = |edge| Edge { ends: [3 * edge, 3 * edge + 2], middle: Some(3 * edge + 1) };
        let (points, parts) = (lines.as_flattened(), parts.map(|(line, part)| (edge(line), part)));
        let mut sums = [0.0; 3];
        let mut add = |_: &Edge, node: usize, [fx, fy]: [f64; 2]| {
            let [x, y] = points[node];
            let parts = [fx, fy, (x - cx) * fy - (y - cy) * fx];
            sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
        };
        add_traction(points, parts, |x, normal| self.force.at(x, normal, t), &mut add);
        sums
    }

    /// The forces on all edges at time t, by expression.
    pub(super) fn sample(&self, t: f64, forces: &mut Vec<f64>) {
        let (first, expressions) = (forces.len(), self.force.expressions());
        forces.resize(first + expressions.len() * self.lines.len(), 0.0);
        for (edge, [from, to]) in self.parts(t, SAMPLED).parts {
            let [[px, py], _, [qx, qy]] = self.lines[edge];
            let weight = 0.5 * (to - from) * (qx - px).hypot(qy - py);
            for s in GAUSS {
                let [x, y] = parabola(self.lines[edge], from + s * (to - from));
                for (i, f) in expressions.iter().enumerate() {
                    forces[first + expressions.len() * edge + i] += weight * f.eval(x, y, t);
                }
            }
        }
    }
}

/// The halves of `edges`, each a parabola, of a curve that is smooth where they turn by at most [`CHORDS`]. They may be
/// arcs of a single edge there, which do not show their shape.
///
/// The tangents of both edges at a node err in opposite senses, by the length ℓ of a straight edge or the square of the
/// length of a parabola. Their mean with the weights of the other edge is exact for a circle. At an end of the curve, the
/// edge turns as at its other end. With the changes d and e of the tangents at s = 0 and 1 and r = 1 − s, the curve is
/// x(s) + s r² d − s² r e for a straight edge, and x(s) + s r (r − s) (r d + s e) for a parabola, which keeps its middle.
fn smooth_halves(edges: &[Edge], points: &[[f64; 2]]) -> Vec<[[f64; 2]; 3]> {
    // |x'| and the normal with the weight of the tangent.
    let end = |edge: &Edge, s: f64| {
        let [x, y] = edge.tangent(points, s);
        let length = x.hypot(y);
        let weight = if edge.middle.is_some() { length * length } else { length };
        (length, BoundaryFace::plane([y / length, -x / length], weight))
    };
    let mut faces = BTreeMap::<usize, Vec<(usize, BoundaryFace)>>::new();
    for (number, edge) in edges.iter().enumerate() {
        for (node, s) in edge.ends.into_iter().zip([0.0, 1.0]) {
            faces.entry(node).or_default().push((number, end(edge, s).1));
        }
    }
    let halves = |(number, edge): (usize, &Edge)| {
        let changes = [0.0, 1.0].map(|s| {
            let (length, own) = end(edge, s);
            let mut others = faces[&edge.ends[s as usize]].iter();
            let (_, other) = others.find(|(n, face)| *n != number && face.angle(&own) <= CHORDS)?;
            let swapped = [(own, other.length), (*other, own.length)];
            let [own_part, part] = swapped.map(|(face, length)| BoundaryFace { length, ..face });
            let [nx, ny] = own_part.joined(&part).normal;
            Some([length * (own.normal[1] - ny), length * (nx - own.normal[0])])
        });
        let [p, q] = edge.ends.map(|node| Vector2::from(points[node]));
        let chord = (q - p).normalize();
        let mirrored = |change: Option<[f64; 2]>| {
            let change = Vector2::from(change?);
            Some((2.0 * change.dot(&chord) * chord - change).into())
        };
        let d = changes[0].or_else(|| mirrored(changes[1])).unwrap_or_default();
        let e = changes[1].or_else(|| mirrored(changes[0])).unwrap_or_default();
        let at = |s: f64| {
            let (x, r) = (edge.at(points, s), 1.0 - s);
            let [a, b] = if edge.middle.is_some() { [r - s; 2] } else { [1.0, -1.0] };
            [0, 1].map(|k| x[k] + s * r * (a * r * d[k] + b * s * e[k]))
        };
        [[0.0, 0.25, 0.5], [0.5, 0.75, 1.0]].map(|half| half.map(at))
    };
    edges.iter().enumerate().flat_map(halves).collect()
}

#[derive(Debug)]
pub(super) struct BodyForce {
    /// f_B, N/m³.
    force: [Expression; 2],
    /// Gravity, m/s², a function of time, and the densities of the materials by their numbers, kg/m³.
    gravity: [Expression; 2],
    densities: Vec<f64>,
    /// The parts of the triangles in which it is not resolved.
    parts_of_triangles: TriangleParts,
    /// The sample points, m, each with the area that it represents, m², and the density there.
    samples: Vec<([f64; 2], [f64; 2])>,
    /// The fraction of ∫|f_B| that may be missed, and the error of ∫f_B, N per metre of thickness.
    pub(super) missed: f64,
    pub(super) error: f64,
}

impl BodyForce {
    /// `None` if it is zero. Triangles are divided once, for all times.
    pub(super) fn new(body: &Body, scene: &Scene) -> Option<Self> {
        let (force, gravity) = (scene.body_force.clone(), scene.gravity.clone());
        if force.iter().chain(&gravity).all(|f| f.as_constant() == Some(0.0)) {
            return None;
        }
        let densities: Vec<f64> = scene.materials().map(|material| material.density).collect();
        let times = scene.sample_times(BODY_FORCE_TIMES);
        let in_time = force.iter().any(Expression::depends_on_time);
        let (times, more) = if in_time { (&times[..], MORE[0]) } else { (&times[..1], MORE[1]) };
        let in_space = force.iter().any(Expression::depends_on_space);
        let triangles = triangle_points(body);
        let Parts { parts, missed, error } = match in_space {
            true => triangle_parts(&triangles, (&force, 0.0), times, more),
            false => {
                let parts = (0..triangles.len()).map(|triangle| (triangle, WHOLE)).collect();
                Parts { parts, missed: 0.0, error: 0.0 }
            }
        };
        let (whole, parts): (Vec<_>, Vec<_>) = parts.into_iter().partition(|part| part.1 == WHOLE);
        let mut parts_of_triangles = TriangleParts::default();
        for (triangle, part) in &parts {
            parts_of_triangles.entry(*triangle).or_default().push(*part);
        }
        let density = |triangle| densities[body.material(triangle)];
        let samples = [whole, parts];
        let samples = samples.iter().flat_map(|parts| self::samples(&triangles, parts, density));
        let samples = samples.collect();
        Some(Self { force, gravity, densities, parts_of_triangles, samples, missed, error })
    }

    pub(super) fn expressions(&self) -> impl Iterator<Item = &Expression> {
        self.force.iter().chain(&self.gravity)
    }

    /// Calls `add` with the forces at the nodes of the triangles at time t.
    pub(super) fn add(&self, body: &Body, t: f64, add: &mut dyn FnMut(usize, usize, [f64; 2])) {
        let gravity = self.gravity.each_ref().map(|g| g.eval(0.0, 0.0, t));
        let at = |triangle: usize, [x, y]: [f64; 2]| {
            let density = self.densities[body.material(triangle)];
            [0, 1].map(|k| self.force[k].eval(x, y, t) + density * gravity[k])
        };
        add_body_force(body, &self.parts_of_triangles, at, add);
    }

    /// The forces on some triangles at time t, by component.
    pub(super) fn sample(&self, t: f64, forces: &mut Vec<f64>) {
        let gravity = self.gravity.each_ref().map(|g| g.eval(0.0, 0.0, t));
        let at = |([x, y], [area, density]): &([f64; 2], [f64; 2])| {
            [0, 1].map(|k| area * (self.force[k].eval(*x, *y, t) + density * gravity[k]))
        };
        forces.extend(self.samples.iter().flat_map(at));
    }
}

/// The centroids of evenly spread parts, each with the area that it represents and the density of its triangle.
fn samples(
    triangles: &[[[f64; 2]; 6]],
    parts: &[TrianglePart],
    density: impl Fn(usize) -> f64,
) -> Vec<([f64; 2], [f64; 2])> {
    let stride = parts.len().div_ceil(MAX_SAMPLES).max(1);
    let sample = |part: &TrianglePart| {
        let (centroid, area) = centroid(triangles, part);
        (centroid, [stride as f64 * area, density(part.0)])
    };
    parts.iter().step_by(stride).map(sample).collect()
}
