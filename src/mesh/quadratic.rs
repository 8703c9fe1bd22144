//! Quadratic (isoparametric) edges and triangles.
//!
//! An edge with ends a, b and midpoint m is the parabola x(t) = (1−t) a + t b + 4t(1−t) d, where the
//! offset d = m − (a+b)/2 vanishes if it is straight. A triangle with vertices p_i is the image
//! x(λ) = Σ_i λ_i p_i + Σ_{i<j} 4λ_iλ_j d_ij of the barycentric coordinates λ.

use super::{Lines, Mesh, sorted};
use nalgebra::Matrix2;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};

/// Relative offset |d| / length below which an edge is straight.
const STRAIGHT: f64 = 1e-9;
/// A curve that meets a straight line nearly at a right angle may go on as its mirror image, if it meets this image at most
/// at this angle, rad.
const MIRRORED: f64 = 1.0;

/// A node at which two curved edges of a line meet at an angle.
pub struct Kink {
    /// The index of the node.
    pub node: usize,
    /// The angle, rad.
    pub angle: f64,
    /// The length of the shorter of both edges, m.
    pub length: f64,
    /// Whether it is a corner of the geometry.
    pub is_corner: bool,
    /// Whether the line ends there at a straight one, nearly at a right angle. The angle is that to its mirror image.
    pub is_mirrored: bool,
}

impl Mesh {
    /// The midpoint of an edge (if curved, of its parabola), m.
    pub fn midpoint(&self, [a, b]: [usize; 2]) -> [f64; 2] {
        let curved = self.curved.get(&sorted([a, b]));
        curved.copied().unwrap_or_else(|| midpoint(self.nodes[a], self.nodes[b]))
    }

    /// Sets the offset d (m) of an edge's midpoint. The edge is straight if d is only rounding error.
    pub fn set_offset(&mut self, edge: [usize; 2], [dx, dy]: [f64; 2]) {
        let [x, y] = midpoint(self.nodes[edge[0]], self.nodes[edge[1]]);
        self.set_midpoint(edge, [x + dx, y + dy]);
    }

    /// Sets the offsets of the sides ab, bc and ca of a triangle abc that have none yet, m.
    pub(super) fn add_offsets(&mut self, [a, b, c]: [usize; 3], offsets: [[f64; 2]; 3]) {
        for (edge, offset) in [[a, b], [b, c], [c, a]].into_iter().zip(offsets) {
            if !self.curved.contains_key(&sorted(edge)) {
                self.set_offset(edge, offset);
            }
        }
    }

    /// Sets the midpoint of an edge. The edge is straight if its offset is only rounding error.
    pub(super) fn set_midpoint(&mut self, [a, b]: [usize; 2], midpoint: [f64; 2]) {
        let [dx, dy] = offset(self.nodes[a], self.nodes[b], midpoint);
        let (_, length) = self.edge_normal([a, b]);
        if dx.hypot(dy) > STRAIGHT * length {
            self.curved.insert(sorted([a, b]), midpoint);
        } else {
            self.curved.remove(&sorted([a, b]));
        }
    }

    /// The direction in which the edge from node a to node b, as the arc of a circle, leaves a. It is not normalised.
    pub fn direction(&self, a: usize, b: usize) -> [f64; 2] {
        let (p, q) = (self.nodes[a], self.nodes[b]);
        let (chord, d) = ([q[0] - p[0], q[1] - p[1]], offset(p, q, self.midpoint([a, b])));
        // The arc with sagitta d over the chord begins at the angle 2 atan(2|d|/|chord|) to it.
        let (square, cross) = (dot(chord, chord), chord[0] * d[1] - chord[1] * d[0]);
        let (sin, cos) = (2.0 * (2.0 * cross).atan2(square)).sin_cos();
        [cos * chord[0] - sin * chord[1], sin * chord[0] + cos * chord[1]]
    }

    /// The nodes at which two curved edges of the boundary, or of the line between two surfaces, meet at an angle as arcs of
    /// circles, and these angles, rad. They are zero on circles, and fall with the third power of the length of the edges on
    /// other smooth curves.
    pub fn kinks(&self) -> Vec<Kink> {
        let surfaces = self.surfaces_of_triangles();
        let lines = Lines::new(self, |triangle| &surfaces[triangle]);
        let kink = |(&node, ends): (&usize, &Vec<usize>)| {
            // Where several lines meet, none goes on.
            let &[p, q] = &ends[..] else { return None };
            let [[a, b], [x, y]] = [p, q].map(|end| self.direction(node, end));
            let turn = (b * x - a * y).atan2(-a * x - b * y).abs();
            let is_curved = [p, q].map(|end| self.curved.contains_key(&sorted([node, end])));
            let angle = match is_curved {
                [true, true] => turn,
                [false, false] => return None,
                _ => 2.0 * (turn - FRAC_PI_2).abs(),
            };
            let is_mirrored = is_curved[0] != is_curved[1];
            let is_end = is_mirrored && angle > MIRRORED;
            let [before, after] = [p, q].map(|end| self.edge_normal([node, end]).1);
            (!is_end).then(|| Kink {
                node,
                angle,
                length: before.min(after),
                is_corner: match is_mirrored {
                    true => angle > FRAC_PI_6,
                    false => !lines.is_smooth(node, [p, q]),
                },
                is_mirrored,
            })
        };
        lines.ends.iter().filter_map(kink).collect()
    }

    /// Per triangle: the numbers of its surfaces.
    pub(super) fn surfaces_of_triangles(&self) -> Vec<Vec<usize>> {
        let mut surfaces = vec![Vec::new(); self.triangles.len()];
        for (number, triangles) in self.surfaces.values().enumerate() {
            triangles.iter().for_each(|&triangle| surfaces[triangle].push(number));
        }
        surfaces
    }

    /// Whether any side of a triangle is curved.
    pub fn is_curved(&self, [a, b, c]: [usize; 3]) -> bool {
        let sides = [[a, b], [b, c], [c, a]];
        !self.curved.is_empty()
            && sides.iter().any(|&[p, q]| self.curved.contains_key(&sorted([p, q])))
    }

    /// The offsets d of the sides ab, bc and ca of a triangle abc, m.
    pub fn offsets(&self, [a, b, c]: [usize; 3]) -> [[f64; 2]; 3] {
        let nodes = &self.nodes;
        [[a, b], [b, c], [c, a]].map(|[p, q]| offset(nodes[p], nodes[q], self.midpoint([p, q])))
    }

    /// Whether a triangle [`is_unfolded`].
    pub(super) fn jacobian_exceeds(&self, bound: f64, triangle: [usize; 3]) -> bool {
        let [a, b, c] = triangle;
        let sides = [[a, b], [b, c], [c, a]].map(|side| self.midpoint(side));
        let [p, q, r] = triangle.map(|node| self.nodes[node]);
        is_unfolded(&[p, q, r, sides[0], sides[1], sides[2]], bound)
    }
}

/// Whether det ∂x/∂(λ₂, λ₃) of a triangle of six nodes is above `bound` (m²) at its vertices, at the midpoints of its
/// sides and at the points of the three-point quadrature rule inside it.
pub(super) fn is_unfolded(nodes: &[[f64; 2]; 6], bound: f64) -> bool {
    let points = [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0]];
    let mut rotated = points.into_iter().flat_map(|[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]]);
    // This is false for NaN, too.
    rotated.all(|lambda| quadratic_measure(nodes, lambda) > bound)
}

/// The derivatives of the six P2 functions by λ_1 and λ_2 (λ_0 = 1 − λ_1 − λ_2).
pub(crate) fn quadratic_derivatives([a, b, c]: [f64; 3]) -> [[f64; 2]; 6] {
    [
        [1.0 - 4.0 * a, 1.0 - 4.0 * a],
        [4.0 * b - 1.0, 0.0],
        [0.0, 4.0 * c - 1.0],
        [4.0 * (a - b), -4.0 * b],
        [4.0 * c, 4.0 * b],
        [-4.0 * c, 4.0 * (a - c)],
    ]
}

/// The Jacobian ∂x/∂λ of the isoparametric triangle of six nodes.
pub(crate) fn jacobian(nodes: &[[f64; 2]; 6], derivatives: &[[f64; 2]; 6]) -> Matrix2<f64> {
    let entry = |row: usize, column: usize| {
        nodes.iter().zip(derivatives).map(|(x, d)| x[row] * d[column]).sum()
    };
    Matrix2::from_fn(entry)
}

/// Twice the area per reference area of the isoparametric triangle of six nodes at barycentric coordinates,
/// m².
pub(crate) fn quadratic_measure(nodes: &[[f64; 2]; 6], point: [f64; 3]) -> f64 {
    jacobian(nodes, &quadratic_derivatives(point)).determinant()
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// The middle between two points, m.
pub fn midpoint(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
}

/// d = m − (a+b)/2.
fn offset(a: [f64; 2], b: [f64; 2], m: [f64; 2]) -> [f64; 2] {
    let [x, y] = midpoint(a, b);
    [m[0] - x, m[1] - y]
}
