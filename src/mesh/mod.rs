//! Triangulations of a plane body, and where they come from.

use std::collections::BTreeMap;

mod boundary;
mod components;
mod error;
mod gmsh;
mod msh;
mod refine;

pub use boundary::{BoundaryNode, CORNER_ANGLE, Face, boundary_nodes};
pub use components::Components;
pub use error::{MeshError, Place, Problem};
pub use gmsh::{load, mesh_geo};
pub use msh::read;

/// A conforming triangulation of the body, with the named parts of its boundary.
///
/// Every node belongs to at least one triangle, every triangle is
/// counter-clockwise with positive area.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Coordinates of the nodes, m.
    pub nodes: Vec<[f64; 2]>,
    /// Three node indices per triangle, counter-clockwise.
    pub triangles: Vec<[usize; 3]>,
    /// The physical curves by name; a group without a name goes by its tag.
    pub curves: BTreeMap<String, Curve>,
}

/// One physical curve: the edges of the triangulation that lie on it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Curve {
    /// Boundary edges as node pairs, the body on their left: (dy, −dx) points outwards.
    pub edges: Vec<[usize; 2]>,
    /// How many of the curve's edges lie inside the body (these are not in `edges`).
    pub interior_edges: usize,
}

impl Mesh {
    /// Area of one triangle, m².
    #[must_use]
    pub fn triangle_area(&self, triangle: [usize; 3]) -> f64 {
        let [a, b, c] = triangle.map(|node| self.nodes[node]);
        0.5 * twice_area(a, b, c)
    }

    /// Area of the body, m².
    #[must_use]
    pub fn area(&self) -> f64 {
        self.triangles.iter().map(|&t| self.triangle_area(t)).sum()
    }

    /// Outward unit normal and length (m) of a boundary edge that has the body on its left.
    #[must_use]
    pub fn edge_normal(&self, [from, to]: [usize; 2]) -> ([f64; 2], f64) {
        let (a, b) = (self.nodes[from], self.nodes[to]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = dx.hypot(dy);
        ([dy / length, -dx / length], length)
    }

    /// Total length of a set of edges, m.
    #[must_use]
    pub fn length(&self, edges: &[[usize; 2]]) -> f64 {
        edges.iter().map(|&edge| self.edge_normal(edge).1).sum()
    }
}

/// The longer side of the box around `points`, m.
#[must_use]
pub fn extent(points: &[[f64; 2]]) -> f64 {
    let side = |axis: usize| {
        let low = points.iter().fold(f64::INFINITY, |low, point| low.min(point[axis]));
        points.iter().fold(f64::NEG_INFINITY, |high, point| high.max(point[axis])) - low
    };
    side(0).max(side(1)).max(0.0)
}

/// Twice the signed area of the triangle abc, positive when counter-clockwise.
fn twice_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}
