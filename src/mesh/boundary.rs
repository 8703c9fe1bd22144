//! Normals and lumped lengths at the nodes of a contact boundary.

use std::collections::BTreeMap;

use super::Mesh;

/// Edges whose normals differ by more than this angle (radians) meet in a corner.
pub const CORNER_ANGLE: f64 = std::f64::consts::PI / 6.0;

/// A node of a set of boundary edges.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundaryNode {
    /// Index of the node in the mesh.
    pub node: usize,
    /// The sides on which the node is constrained: one, or two at a corner. (More only
    /// where parts of the body touch in a point.)
    pub faces: Vec<Face>,
}

/// One constraint direction of a boundary node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Outward unit normal.
    pub normal: [f64; 2],
    /// Tributary length, m: half of each edge that the face stands for.
    pub length: f64,
}

impl Face {
    /// Whether the other face continues this one smoothly, at an angle of no more than
    /// [`CORNER_ANGLE`] between their normals.
    #[must_use]
    pub fn continues(&self, other: &Self) -> bool {
        let ([a, b], [c, d]) = (self.normal, other.normal);
        // The cosine alone would lose small angles to rounding.
        let angle = (a * d - b * c).abs().atan2(a * c + b * d);
        // Round-off must not decide on a boundary whose edges turn by exactly 30°.
        angle <= CORNER_ANGLE + 1e-9
    }

    /// Both faces as one: the length-weighted mean of the normals, the sum of the lengths.
    #[must_use]
    pub fn joined(&self, other: &Self) -> Self {
        let sum = [0, 1].map(|i| self.length * self.normal[i] + other.length * other.normal[i]);
        let norm = sum[0].hypot(sum[1]);
        Self { normal: sum.map(|x| x / norm), length: self.length + other.length }
    }
}

/// The nodes of a set of boundary edges, in increasing order.
///
/// A node's normal is the length-weighted mean of its edges' normals; at a corner, where
/// they differ by more than [`CORNER_ANGLE`], it keeps both. The lengths of all faces add
/// up to the length of the edges.
///
/// `edges` are node pairs with the body on their left, as in
/// [`Curve::edges`](super::Curve::edges); their indices must be nodes of `mesh`.
#[must_use]
pub fn boundary_nodes(mesh: &Mesh, edges: &[[usize; 2]]) -> Vec<BoundaryNode> {
    let mut faces: BTreeMap<usize, Vec<Face>> = BTreeMap::new();
    for &edge in edges {
        let (normal, length) = mesh.edge_normal(edge);
        let half = Face { normal, length: 0.5 * length };
        for node in edge {
            add(faces.entry(node).or_default(), half);
        }
    }
    faces.into_iter().map(|(node, faces)| BoundaryNode { node, faces }).collect()
}

/// Merges half an edge into the face it continues, or opens another face.
fn add(faces: &mut Vec<Face>, half: Face) {
    let angle = |face: &Face| {
        let ([a, b], [c, d]) = (face.normal, half.normal);
        // The cosine alone would lose small angles to rounding.
        (a * d - b * c).abs().atan2(a * c + b * d)
    };
    // Round-off must not decide on a boundary whose edges turn by exactly 30°.
    match faces.iter_mut().find(|face| angle(face) <= CORNER_ANGLE + 1e-9) {
        Some(face) => {
            let sum: [f64; 2] = std::array::from_fn(|i| {
                face.length * face.normal[i] + half.length * half.normal[i]
            });
            let norm = sum[0].hypot(sum[1]);
            face.normal = sum.map(|x| x / norm);
            face.length += half.length;
        }
        None => faces.push(half),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polygon around its first node, the centre; boundary edges counter-clockwise.
    fn fan(points: &[[f64; 2]], centre: [f64; 2]) -> (Mesh, Vec<[usize; 2]>) {
        let n = points.len();
        let edges: Vec<_> = (0..n).map(|i| [1 + i, 1 + (i + 1) % n]).collect();
        let mesh = Mesh {
            nodes: std::iter::once(centre).chain(points.iter().copied()).collect(),
            triangles: edges.iter().map(|&[a, b]| [0, a, b]).collect(),
            curves: BTreeMap::new(),
        };
        (mesh, edges)
    }

    fn total(nodes: &[BoundaryNode]) -> f64 {
        nodes.iter().flat_map(|n| &n.faces).map(|f| f.length).sum()
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-14, "{a} is not {b}");
    }

    #[test]
    fn flat_bottom_points_down_with_lumped_lengths() {
        let points = [[0.0, 0.0], [0.3, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let (mesh, edges) = fan(&points, [0.5, 0.5]);
        let bottom = boundary_nodes(&mesh, &edges[..2]);
        assert_eq!(bottom.iter().map(|n| n.node).collect::<Vec<_>>(), [1, 2, 3]);
        for (node, length) in bottom.iter().zip([0.15, 0.5, 0.35]) {
            let [face] = node.faces[..] else { panic!("one face, not {:?}", node.faces) };
            assert_eq!(face.normal, [0.0, -1.0]);
            close(face.length, length);
        }
        close(total(&bottom), 1.0);
    }

    #[test]
    fn corner_keeps_both_normals() {
        let points = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        let (mesh, edges) = fan(&points, [1.0, 0.5]);
        let nodes = boundary_nodes(&mesh, &edges[..2]);
        let corner = &nodes[1];
        assert_eq!(corner.node, 2);
        let faces: Vec<_> = corner.faces.iter().map(|f| (f.normal, f.length)).collect();
        assert_eq!(faces, [([0.0, -1.0], 1.0), ([1.0, 0.0], 0.5)]);
        // The ends of an open boundary see only their own edge.
        assert_eq!(nodes[0].faces.len(), 1);
        assert_eq!(nodes[2].faces.len(), 1);
        close(total(&nodes), 3.0);
        // A closed loop has a corner at every node.
        let all = boundary_nodes(&mesh, &edges);
        assert!(all.iter().all(|n| n.faces.len() == 2));
        close(total(&all), 6.0);
    }

    #[test]
    fn polygonal_circle_points_radially() {
        // Twelve edges turn by exactly the limit: still no corner.
        for n in [12, 13, 64] {
            let point = |i| {
                let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
                [0.05 * angle.cos(), 0.05 * angle.sin()]
            };
            let points: Vec<_> = (0..n).map(point).collect();
            let (mesh, edges) = fan(&points, [0.0, 0.0]);
            let nodes = boundary_nodes(&mesh, &edges);
            assert_eq!(nodes.len(), points.len());
            for (node, point) in nodes.iter().zip(&points) {
                assert_eq!(node.faces.len(), 1, "n = {n}");
                close(node.faces[0].normal[0], point[0] / 0.05);
                close(node.faces[0].normal[1], point[1] / 0.05);
            }
            close(total(&nodes), mesh.length(&edges));
        }
        let points: Vec<_> = (0..11)
            .map(|i| (std::f64::consts::TAU * f64::from(i) / 11.0).sin_cos().into())
            .map(|[y, x]: [f64; 2]| [x, y])
            .collect();
        let (mesh, edges) = fan(&points, [0.0, 0.0]);
        assert!(boundary_nodes(&mesh, &edges).iter().all(|n| n.faces.len() == 2));
    }

    #[test]
    fn unequal_edges_weigh_by_length() {
        let tilt = [1.0 + 3.0 * 0.1_f64.cos(), 3.0 * 0.1_f64.sin()];
        let points = [[0.0, 0.0], [1.0, 0.0], tilt, [0.0, 5.0]];
        let (mesh, edges) = fan(&points, [1.0, 1.0]);
        let nodes = boundary_nodes(&mesh, &edges[..2]);
        let normal = nodes[1].faces[0].normal;
        let expected = [3.0 * 0.1_f64.sin(), -1.0 - 3.0 * 0.1_f64.cos()];
        close(normal[0] * expected[1], normal[1] * expected[0]);
        close(normal[0].hypot(normal[1]), 1.0);
        close(nodes[1].faces[0].length, 2.0);
    }
}
