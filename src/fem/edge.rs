//! Boundary edges of the elements of u: a straight line or a parabola.

use crate::{
    ROUNDING,
    mesh::{BoundaryFace, Lines},
};
use std::{array, collections::BTreeMap};

/// The nodes of u on an edge x(s), 0 ≤ s ≤ 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// Its ends x(0) and x(1), with the body on the left of a boundary edge.
    pub ends: [usize; 2],
    /// For P2 its middle x(½).
    pub middle: Option<usize>,
}

/// The abscissae ½ ∓ 1/√12 of the two Gauss points of an edge, of weights ½.
pub const GAUSS: [f64; 2] = [0.211_324_865_405_187_08, 0.788_675_134_594_812_9];

/// The abscissae ½ and ½ ∓ √15/10 of the three Gauss points of an edge, and their weights.
pub(crate) const THREE_GAUSS: [[f64; 2]; 3] = [
    [0.112_701_665_379_258_31, 5.0 / 18.0],
    [0.5, 8.0 / 18.0],
    [0.887_298_334_620_741_7, 5.0 / 18.0],
];

/// The Gauss points of the straight edge from `p` to `q`.
pub fn gauss_points(p: [f64; 2], q: [f64; 2]) -> [[f64; 2]; 2] {
    GAUSS.map(|s| [p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1])])
}

/// x(s) on the parabola through `p` at s = 0, `m` at ½ and `q` at 1.
pub fn parabola<const D: usize>([p, m, q]: [[f64; D]; 3], s: f64) -> [f64; D] {
    let bulge = 4.0 * s * (1.0 - s);
    array::from_fn(|k| p[k] + s * (q[k] - p[k]) + bulge * (m[k] - 0.5 * (p[k] + q[k])))
}

/// An estimate of the angle between the normals of boundary edges and of the smooth curve that they
/// approximate, rad. It is the largest angle between two curved edges of a smooth line. A parabola through
/// points of a circle that subtend 2φ errs by φ³/4 at its ends, so two meet at twice this angle. A line that turns by
/// more than twice that angle is no smooth curve.
pub fn normal_error(edges: &[Edge], points: &[[f64; 2]], lines: &Lines) -> f64 {
    let mut faces = BTreeMap::<usize, Vec<(BoundaryFace, f64)>>::new();
    let mut largest = 0.0_f64;
    for edge in edges.iter().filter(|edge| edge.is_curved(points)) {
        let [[a, b], [c, d]] = [0.0, 1.0].map(|s| edge.tangent(points, s));
        let half = 0.5 * (a * d - b * c).abs().atan2(a * c + b * d);
        let at_end = 0.25 * half.powi(3);
        for (node, face) in edge.faces(points, lines) {
            let at_node = faces.entry(node).or_default();
            let smooth = at_node.iter().filter(|(other, _)| other.continues(&face));
            let angles = smooth.map(|(other, error)| (other.angle(&face), error + at_end));
            let smooth = angles.filter(|(angle, expected)| *angle <= 2.0 * expected);
            largest = smooth.map(|(angle, _)| angle).fold(largest, f64::max);
            at_node.push((face, at_end));
        }
    }
    largest
}

impl Edge {
    /// x(s), m, from the coordinates of all nodes.
    pub fn at(&self, points: &[[f64; 2]], s: f64) -> [f64; 2] {
        let [p, q] = self.ends.map(|node| points[node]);
        let middle = || [0, 1].map(|k| 0.5 * (p[k] + q[k]));
        parabola([p, self.middle.map_or_else(middle, |node| points[node]), q], s)
    }

    /// x'(s), m.
    pub fn tangent(&self, points: &[[f64; 2]], s: f64) -> [f64; 2] {
        let [p, q] = self.ends.map(|node| points[node]);
        let offset = self.offset(points);
        [0, 1].map(|k| q[k] - p[k] + 4.0 * (1.0 - 2.0 * s) * offset[k])
    }

    /// The distance of the middle from the middle of the chord, m.
    fn offset(&self, points: &[[f64; 2]]) -> [f64; 2] {
        let [p, q] = self.ends.map(|node| points[node]);
        self.middle.map_or([0.0; 2], |node| [0, 1].map(|k| points[node][k] - 0.5 * (p[k] + q[k])))
    }

    /// Is the edge curved, beyond rounding?
    fn is_curved(&self, points: &[[f64; 2]]) -> bool {
        let ([x, y], [p, q]) = (self.offset(points), self.ends.map(|node| points[node]));
        x.hypot(y) > ROUNDING * (q[0] - p[0]).hypot(q[1] - p[1])
    }

    /// The nodes with the values of their functions φ_i at s.
    pub fn values(&self, s: f64) -> impl Iterator<Item = (usize, f64)> {
        let [a, b] = self.ends;
        let r = 1.0 - s;
        match self.middle {
            None => [Some((a, r)), Some((b, s)), None],
            Some(middle) => {
                [Some((a, r * (r - s))), Some((b, s * (s - r))), Some((middle, 4.0 * r * s))]
            }
        }
        .into_iter()
        .flatten()
    }

    /// The nodes of an edge of the boundary, whose lines are `lines`, each with its outward normals and its tributary
    /// length ∫ φ_i: half of the edge for P1; for P2 1/6 of it at the ends and 4/6 in the middle (Simpson's rule).
    pub fn faces(
        &self,
        points: &[[f64; 2]],
        lines: &Lines,
    ) -> impl Iterator<Item = (usize, BoundaryFace)> {
        let [a, b] = self.ends;
        let face = |s: f64, part: f64| {
            let [x, y] = self.tangent(points, s);
            let length = x.hypot(y);
            BoundaryFace::plane([y / length, -x / length], part * length)
        };
        let end = |part: f64| {
            let ([x, y], [to_x, to_y]) = (lines.tangent(a, b), lines.tangent(b, a));
            [
                Some((a, BoundaryFace { of_line: [y, -x], ..face(0.0, part) })),
                Some((b, BoundaryFace { of_line: [-to_y, to_x], ..face(1.0, part) })),
            ]
        };
        let (ends, middle) = match self.middle {
            None => (end(0.5), None),
            Some(middle) => (end(1.0 / 6.0), Some((middle, face(0.5, 4.0 / 6.0)))),
        };
        ends.into_iter().chain([middle]).flatten()
    }
}
