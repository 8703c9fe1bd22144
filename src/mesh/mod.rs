//! Triangulations of a plane body, and where they come from.

use std::collections::BTreeMap;

/// A conforming triangulation of the body, with the named parts of its boundary.
///
/// Every node belongs to at least one triangle, every triangle is
/// counter-clockwise with positive area.
#[derive(Debug, Clone)]
pub struct Mesh {
    /// Coordinates of the nodes, m.
    pub nodes: Vec<[f64; 2]>,
    /// Three node indices per triangle, counter-clockwise.
    pub triangles: Vec<[usize; 3]>,
    /// The physical curves by name; a group without a name goes by its tag.
    pub curves: BTreeMap<String, Curve>,
}

/// One physical curve: the edges of the triangulation that lie on it.
#[derive(Debug, Clone, Default)]
pub struct Curve {
    /// Boundary edges as node pairs, the body on their left: (dy, −dx) points outwards.
    pub edges: Vec<[usize; 2]>,
    /// How many of the curve's edges lie inside the body (these are not in `edges`).
    pub interior_edges: usize,
}
