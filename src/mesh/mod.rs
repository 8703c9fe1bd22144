//! Triangulations of a plane body.
//!
//! - [`Mesh`]: nodes, triangles, named curves and surfaces, midpoints of curved edges;
//! - [`load`] meshes a `.geo` with gmsh if necessary; [`read`] reads a `.msh`;
//! - [`Refinement`] bisects triangles.
//!
//! What crosses the door: a path comes in, a [`Mesh`] goes out. It is one connected body of triangles in
//! counter-clockwise order, or a [`MeshError`] names the file and the line.

use crate::by_number;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

mod boundary;
mod convert;
mod error;
mod format;
mod gmsh;
mod lines;
mod msh;
mod numbering;
mod quadratic;
mod rectangle;
mod refine;
mod smooth;

pub use boundary::{BoundaryFace, SAME_DIRECTION, joined_faces};
pub use error::MeshError;
pub use format::{FORMATS, Format, has_arrays};
pub use gmsh::{copies, load, load_choosing, load_graded, renamed, scaling_factor};
pub(crate) use lines::CHORDS;
pub use lines::Lines;
pub use msh::{parse, read};
pub use quadratic::{Kink, midpoint};
pub(crate) use quadratic::{jacobian, quadratic_derivatives, quadratic_measure};
pub use refine::Refinement;
pub(crate) use refine::TIES;

/// The order of finite elements: of the displacements, and of the elements that gmsh makes from a `.geo`.
///
/// Vertices and triangles are the same for both. For order 2 gmsh also places the midpoints of curved edges;
/// it then takes about six times as long.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Order {
    /// Order 1, every edge straight.
    #[default]
    Linear,
    /// Order 2.
    Quadratic,
}

/// A conforming triangulation of the body, with the named parts of its boundary.
///
/// Every node belongs to at least one triangle, every triangle is
/// counter-clockwise with positive area.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Coordinates of the nodes (the vertices of the triangles), m.
    pub nodes: Vec<[f64; 2]>,
    /// Three node indices per triangle, counter-clockwise.
    pub triangles: Vec<[usize; 3]>,
    /// The physical curves by name; the tag names a group without a name.
    pub curves: BTreeMap<String, Curve>,
    /// The triangles of the physical surfaces by name, in increasing order; the tag names a group without a
    /// name. A triangle may be in several.
    pub surfaces: BTreeMap<String, Vec<usize>>,
    /// The nodes at points of the geometry, where its curves begin and end. Empty if they are unknown.
    pub points: BTreeSet<usize>,
    /// The midpoints of curved edges, m, by their ends in increasing order. All other edges are straight.
    /// Only quadratic elements use the midpoints.
    pub curved: BTreeMap<[usize; 2], [f64; 2]>,
    /// The version of gmsh that made the mesh, if this program ran gmsh.
    pub gmsh: Option<String>,
    /// Notes for the user on its file: what was left out, what looks like a mistake.
    pub notes: Vec<String>,
}

/// One physical curve: the edges of the triangulation that lie on it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Curve {
    /// Boundary edges as node pairs, the body on their left: (dy, −dx) points outwards.
    pub edges: Vec<[usize; 2]>,
    /// The number of the curve's edges inside or outside the body, which are not in `edges`.
    pub other_edges: usize,
}

impl Mesh {
    /// Outward unit normal and length (m) of a boundary edge that has the body on its left.
    pub fn edge_normal(&self, [from, to]: [usize; 2]) -> ([f64; 2], f64) {
        let (a, b) = (self.nodes[from], self.nodes[to]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = dx.hypot(dy);
        ([dy / length, -dx / length], length)
    }

    /// The edges of the physical curve `name` on the boundary; none if the mesh has no such curve.
    pub fn edges_of(&self, name: &str) -> &[[usize; 2]] {
        self.curves.get(name).map_or(&[], |curve| &curve.edges)
    }

    /// The triangle at each of these boundary edges, and the number of its side there, by the ends in increasing order.
    pub fn triangles_at(&self, edges: &[[usize; 2]]) -> HashMap<[usize; 2], (usize, usize)> {
        let wanted: HashSet<_> = edges.iter().map(|edge| sorted(*edge)).collect();
        // Few nodes are ends: most sides need no search.
        let mut is_end = vec![false; self.nodes.len()];
        edges.as_flattened().iter().for_each(|&node| is_end[node] = true);
        let sides = |(t, &[a, b, c]): (usize, &[usize; 3])| {
            [([a, b], 0), ([b, c], 1), ([c, a], 2)].map(|(side, i)| (sorted(side), (t, i)))
        };
        let sides = self.triangles.iter().enumerate().flat_map(sides);
        let is_wanted =
            |side: &[usize; 2]| side.iter().all(|&n| is_end[n]) && wanted.contains(side);
        sides.filter(|(side, _)| is_wanted(side)).collect()
    }

    /// A place as text; see [`place`].
    pub fn place(&self, at: [f64; 2]) -> String {
        place(extent(&self.nodes), at)
    }

    /// The edges of the boundary, which belong to one triangle each. The body lies on their left.
    pub fn boundary_edges(&self) -> Vec<[usize; 2]> {
        boundary_edges(&sides(&self.triangles))
    }

    /// Per node: the size that triangles shall have there, m. It is the `wanted` size where one is given, and elsewhere the
    /// mean length of the sides at the node. One sweep over the sides limits the growth from node to node to a third of their
    /// distance; against the order of the triangles it may stay larger.
    pub fn graded_sizes(&self, wanted: impl IntoIterator<Item = (usize, f64)>) -> Vec<f64> {
        let sides = || self.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut sums = vec![(0.0, 0.0); self.nodes.len()];
        for ends in sides() {
            let (_, length) = self.edge_normal(ends);
            for node in ends {
                sums[node] = (sums[node].0 + length, sums[node].1 + 1.0);
            }
        }
        let mut sizes: Vec<f64> = sums.into_iter().map(|(sum, count)| sum / count).collect();
        wanted.into_iter().for_each(|(node, size)| sizes[node] = size);
        for [p, q] in sides() {
            let third = self.edge_normal([p, q]).1 / 3.0;
            sizes[q] = sizes[q].min(sizes[p] + third);
            sizes[p] = sizes[p].min(sizes[q] + third);
        }
        sizes
    }

    /// The smallest angle of all triangles, degrees, and a corner of its triangle, m.
    pub fn smallest_angle(&self) -> (f64, [f64; 2]) {
        let corners = self.triangles.iter().map(|triangle| triangle.map(|node| self.nodes[node]));
        let angles = corners.map(|corners| (smallest_angle(corners), corners[0]));
        let least = angles.min_by(|(a, _), (b, _)| a.total_cmp(b));
        least.unwrap_or((f64::INFINITY, [0.0; 2]))
    }
}

/// The smallest angle of a triangle, degrees.
fn smallest_angle(corners: [[f64; 2]; 3]) -> f64 {
    let at = |i: usize| {
        let [a, b, c] = [0, 1, 2].map(|k| corners[(i + k) % 3]);
        let (p, q) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        // The arc cosine alone would lose small angles to rounding.
        (p[0] * q[1] - p[1] * q[0]).atan2(p[0] * q[0] + p[1] * q[1]).to_degrees()
    };
    at(0).min(at(1)).min(at(2))
}

/// One triangle's side of an edge, in half the memory of its numbers elsewhere: a mesh has three times as many as triangles.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    ends: [u32; 2],
    /// Whether the triangle lies on the left of the way from the first end to the second.
    on_left: bool,
    number: u32,
}

impl Side {
    /// The ends in increasing order.
    fn edge(&self) -> [usize; 2] {
        self.ends.map(|node| node as usize)
    }

    fn triangle(&self) -> usize {
        self.number as usize
    }

    /// The ends, the triangle on the left.
    fn directed(&self) -> [usize; 2] {
        let [p, q] = self.edge();
        if self.on_left { [p, q] } else { [q, p] }
    }
}

/// The sides of all edges, sorted: a boundary edge has one, an inner edge one on the right and one
/// on the left, in this order.
fn sides(triangles: &[[usize; 3]]) -> Vec<Side> {
    let of_triangle = |(triangle, &[a, b, c]): (usize, &[usize; 3])| {
        [[a, b], [b, c], [c, a]].map(|[p, q]| {
            let ends = sorted([p, q]).map(|n| n as u32);
            (p.min(q), Side { ends, on_left: p < q, number: triangle as u32 })
        })
    };
    let nodes = triangles.as_flattened().iter().max().map_or(0, |last| last + 1);
    let (_, mut sides) = by_number(nodes, triangles.iter().enumerate().flat_map(of_triangle));
    sides.chunk_by_mut(|a, b| a.ends[0] == b.ends[0]).for_each(<[_]>::sort_unstable);
    sides
}

/// The edges that have one of the sorted `sides` only: the boundary, with the body on the left.
fn boundary_edges(sides: &[Side]) -> Vec<[usize; 2]> {
    let single = sides.chunk_by(|a, b| a.ends == b.ends).filter(|sides| sides.len() == 1);
    single.map(|sides| sides[0].directed()).collect()
}

/// An edge by its ends in increasing order.
pub fn sorted([a, b]: [usize; 2]) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

/// The bounds of x and of y of `points`, m.
pub fn bounds<'a>(points: impl IntoIterator<Item = &'a [f64; 2]>) -> [[f64; 2]; 2] {
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for point in points {
        for (bounds, x) in bounds.iter_mut().zip(point) {
            *bounds = [bounds[0].min(*x), bounds[1].max(*x)];
        }
    }
    bounds
}

/// The longer side of the box around `points`, m.
pub fn extent(points: &[[f64; 2]]) -> f64 {
    let [x, y] = bounds(points).map(|[low, high]| high - low);
    x.max(y).max(0.0)
}

/// A place as text, to 1e-4 of the power of ten below the `extent` of the body: (6.0000, 4.0000) in a body of 8 m,
/// (2.5000, 0.0000)e-7 in a body of 0.5 µm.
pub fn place(extent: f64, at: [f64; 2]) -> String {
    let exponent = extent.log10().floor() as i32;
    let scale = 10_f64.powi(if (-3..5).contains(&exponent) { 0 } else { exponent });
    let decimals = if scale == 1.0 { (4 - exponent) as usize } else { 4 };
    // Rounded before it is printed: no -0.0000.
    let unit = 10_f64.powi(decimals as i32);
    let [x, y] = at.map(|x| (x / scale * unit).round() / unit + 0.0);
    let power = if scale == 1.0 { String::new() } else { format!("e{exponent}") };
    format!("({x:.decimals$}, {y:.decimals$}){power}")
}

/// Twice the signed area of the triangle abc, m², positive when counter-clockwise.
pub fn twice_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

/// The distance of two points, m.
pub fn distance([x, y]: [f64; 2], [v, w]: [f64; 2]) -> f64 {
    (v - x).hypot(w - y)
}

/// The longest side of a triangle, its ends in increasing order, and the opposite vertex.
pub(crate) fn longest_side(nodes: &[[f64; 2]], [a, b, c]: [usize; 3]) -> ([usize; 2], usize) {
    let length = |&([p, q], _): &([usize; 2], usize)| distance(nodes[p], nodes[q]);
    let sides = [(sorted([a, b]), c), (sorted([b, c]), a), (sorted([c, a]), b)];
    sides.into_iter().max_by(|s, t| length(s).total_cmp(&length(t))).unwrap_or(sides[0])
}
