//! Newest-vertex bisection of marked triangles (W. F. Mitchell, J. Comput. Appl. Math. 36, 1991).
//!
//! A triangle [a, b, c] is bisected across its reference edge ab: with m between a and b its children
//! are [c, a, m] and [b, c, m], their reference edges lie opposite the new vertex. The first reference
//! edge of each triangle is its longest. All descendants of a straight triangle then have one of four
//! shapes, whose angles are at least half its smallest one (I. G. Rosenberg, F. Stenger, SIAM J.
//! Numer. Anal. 12, 1975), and those of a right isosceles triangle are right isosceles.

use super::{Mesh, MeshError, sides, sorted, twice_area};

/// Slightly below 1: sizes whose ratio is between this and 1 are equal up to rounding. So meshes do not depend on units.
pub(crate) const TIES: f64 = 1.0 - 1e-9;

/// A mesh that is refined repeatedly.
#[derive(Debug, Clone, PartialEq)]
pub struct Refinement {
    /// The mesh; the first two nodes of each triangle are the ends of its reference edge.
    pub mesh: Mesh,
    /// Per triangle: the triangle of the previous mesh that is the same or contains it.
    pub parent_of_triangle: Vec<usize>,
    /// Per new node: the ends of the edge that it halves. Old nodes keep their numbers, and new nodes follow
    /// them.
    pub halved_edges: Vec<[usize; 2]>,
}

impl Refinement {
    /// A mesh before its first refinement. Nodes and triangles keep their numbers; the nodes of a triangle
    /// may be rotated.
    pub fn start(mut mesh: Mesh) -> Self {
        let mut triangles = std::mem::take(&mut mesh.triangles);
        for triangle in &mut triangles {
            let sides = [0, 1, 2].map(|i| mesh.edge_normal([triangle[i], triangle[(i + 1) % 3]]).1);
            let longest = sides.into_iter().fold(0.0, f64::max);
            // The first of equal sides, up to rounding, so that meshes do not depend on units.
            let first = sides.iter().position(|side| *side >= TIES * longest);
            triangle.rotate_left(first.unwrap_or(0));
        }
        let parent_of_triangle = (0..triangles.len()).collect();
        mesh.triangles = triangles;
        Self { mesh, parent_of_triangle, halved_edges: Vec::new() }
    }

    /// Bisects the `marked` triangles, and others as far as the mesh needs it to stay conforming. A triangle
    /// has at most four parts.
    ///
    /// The edges of curves are halved with their triangles. The halves of a curved edge lie on the circle through
    /// its ends and its midpoint, so that refined arcs of circles stay on them. The number of other edges of a
    /// curve does not change, as they are not listed.
    ///
    /// # Errors
    /// The vertices of a part of a quadratic triangle are not counter-clockwise, because its sides are too
    /// curved.
    pub fn refine(&self, marked: &[bool]) -> Result<Self, MeshError> {
        let edges = Edges::of(&self.mesh.triangles);
        let halved = edges.halved_with(marked);
        self.halve(&edges, &halved)
    }

    /// Divides every triangle into four parts of half its size: bisects the triangle and its halves.
    ///
    /// # Errors
    /// See [`Refinement::refine`].
    pub fn refine_everywhere(&self) -> Result<Self, MeshError> {
        let edges = Edges::of(&self.mesh.triangles);
        self.halve(&edges, &Vec::from_iter(0..edges.ends.len()))
    }

    /// Halves the edges `halved`. They include the reference edges of all their triangles.
    fn halve(&self, edges: &Edges, halved: &[usize]) -> Result<Self, MeshError> {
        let mut new_node = vec![None; edges.ends.len()];
        for (edge, node) in halved.iter().zip(self.mesh.nodes.len()..) {
            new_node[*edge] = Some(node);
        }
        let halved_edges: Vec<[usize; 2]> = halved.iter().map(|&edge| edges.ends[edge]).collect();

        let mut mesh = Mesh { triangles: Vec::new(), ..self.mesh.clone() };
        mesh.nodes.extend(halved_edges.iter().map(|&ends| self.mesh.midpoint(ends)));
        for curve in mesh.curves.values_mut() {
            let halves = |&[a, b]: &[usize; 2]| {
                let middle =
                    edges.ends.binary_search(&sorted([a, b])).ok().and_then(|edge| new_node[edge]);
                middle.map_or(vec![[a, b]], |m| vec![[a, m], [m, b]])
            };
            curve.edges = curve.edges.iter().flat_map(halves).collect();
        }
        for (&[a, b], middle) in halved_edges.iter().zip(self.mesh.nodes.len()..) {
            if mesh.curved.remove(&[a, b]).is_some() {
                let [p, m, q] = [a, middle, b].map(|node| mesh.nodes[node]);
                mesh.set_offset([a, middle], arc_offset(p, m, q));
                mesh.set_offset([middle, b], arc_offset(q, m, p));
            }
        }
        let mut parent_of_triangle = Vec::new();
        for (parent, &nodes) in self.mesh.triangles.iter().enumerate() {
            let is_curved = self.mesh.is_curved(nodes);
            let offsets = if is_curved { self.mesh.offsets(nodes) } else { [[0.0; 2]; 3] };
            let [ab, bc, ca] = edges.of_triangle[parent].map(|edge| new_node[edge]);
            for (child, middle) in bisected(Triangle { nodes, offsets }, ab).zip([ca, bc]) {
                for Triangle { nodes, offsets } in bisected(child, middle) {
                    mesh.triangles.push(nodes);
                    parent_of_triangle.push(parent);
                    if is_curved {
                        mesh.add_offsets(nodes, offsets);
                        let [a, b, c] = nodes.map(|node| mesh.nodes[node]);
                        if twice_area(a, b, c) <= 0.0 {
                            return Err(MeshError::TooCurved(a));
                        }
                    }
                }
            }
        }
        for triangles in mesh.surfaces.values_mut() {
            let inside = |t: &usize| triangles.binary_search(&parent_of_triangle[*t]).is_ok();
            *triangles = (0..parent_of_triangle.len()).filter(inside).collect();
        }
        Ok(Self { mesh, parent_of_triangle, halved_edges })
    }
}

/// The nodes of a triangle and the offsets d of its sides ab, bc, ca.
struct Triangle {
    nodes: [usize; 3],
    offsets: [[f64; 2]; 3],
}

/// The offset of the midpoint of the arc from a to m, on the circle through a, m and b.
///
/// The chord am is seen from b at the angle θ. So the sagitta of its arc is |am|/2 tan(θ/2).
fn arc_offset(a: [f64; 2], m: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let [q, r, chord] =
        [[a, b], [m, b], [m, a]].map(|[to, from]| [to[0] - from[0], to[1] - from[1]]);
    let (cross, dot) = (q[0] * r[1] - q[1] * r[0], q[0] * r[0] + q[1] * r[1]);
    let tangent = cross / (q[0].hypot(q[1]) * r[0].hypot(r[1]) + dot);
    [0.5 * tangent * chord[1], -0.5 * tangent * chord[0]]
}

/// The children of a triangle that is bisected at the node `middle`; without one, the triangle itself.
///
/// Halves of ab have the offset d_ab/4. The new side mc is x(λ) between m, λ = (½, ½, 0), and c; its
/// offset from the straight one is x(¼, ¼, ½) − (m + c)/2 = (d_bc + d_ca)/2 − d_ab/4.
fn bisected(triangle: Triangle, middle: Option<usize>) -> impl Iterator<Item = Triangle> {
    let Some(m) = middle else { return [Some(triangle), None].into_iter().flatten() };
    let Triangle { nodes: [a, b, c], offsets: [ab, bc, ca] } = triangle;
    let half = ab.map(|d| 0.25 * d);
    let cut = [0, 1].map(|i| 0.5 * (bc[i] + ca[i]) - half[i]);
    let first = Triangle { nodes: [c, a, m], offsets: [ca, half, cut] };
    let second = Triangle { nodes: [b, c, m], offsets: [bc, cut, half] };
    [Some(first), Some(second)].into_iter().flatten()
}

/// The edges of a triangulation, in increasing order of their ends.
struct Edges {
    /// Per edge: its ends in increasing order.
    ends: Vec<[usize; 2]>,
    /// Per edge: the triangles on both sides. A boundary edge has its triangle twice.
    triangles: Vec<[usize; 2]>,
    /// Per triangle abc: its edges ab, bc, ca.
    of_triangle: Vec<[usize; 3]>,
}

impl Edges {
    fn of(triangles: &[[usize; 3]]) -> Self {
        let of_triangle = vec![[0; 3]; triangles.len()];
        let mut edges = Self { ends: Vec::new(), triangles: Vec::new(), of_triangle };
        for side in sides(triangles) {
            let ([low, high], triangle) = (side.edge(), side.triangle());
            if edges.ends.last() != Some(&[low, high]) {
                edges.ends.push([low, high]);
                edges.triangles.push([triangle; 2]);
            }
            let last = edges.ends.len() - 1;
            edges.triangles[last][1] = triangle;
            let from = if side.on_left { low } else { high };
            for (node, edge) in triangles[triangle].iter().zip(&mut edges.of_triangle[triangle]) {
                if *node == from {
                    *edge = last;
                }
            }
        }
        edges
    }

    /// The edges to halve, in increasing order: the reference edges of the `marked` triangles and of all
    /// triangles that have an edge to halve.
    fn halved_with(&self, marked: &[bool]) -> Vec<usize> {
        let mut is_halved = vec![false; self.ends.len()];
        let marked = self.of_triangle.iter().zip(marked).filter(|(_, marked)| **marked);
        let mut references: Vec<usize> = marked.map(|(edges, _)| edges[0]).collect();
        while let Some(edge) = references.pop() {
            if !is_halved[edge] {
                is_halved[edge] = true;
                references
                    .extend(self.triangles[edge].map(|triangle| self.of_triangle[triangle][0]));
            }
        }
        (0..self.ends.len()).filter(|&edge| is_halved[edge]).collect()
    }
}
