//! The body: its triangulation, and the nodes and elements of u and ζ with their owners.

use super::{
    Cells, Edge, Elements, Partition, Patches, Triangle,
    element::{NODES, POINTS, Quadratic, QuadraturePoint, at_vertices, quadratic_values},
    for_elements,
};
use crate::{
    ROUNDING,
    mesh::{Mesh, Order, sorted},
    petsc::Communicator,
};
use nalgebra::{Vector2, Vector3};
use rustc_hash::FxHashMap as HashMap;
use std::{
    rc::Rc,
    sync::{Arc, OnceLock},
};

/// A triangulated body, or the subdomain of it that this rank keeps.
#[derive(Debug)]
pub struct Body {
    /// The triangulation; its nodes are the vertices.
    pub mesh: Mesh,
    /// The P1 triangles of ζ, one per triangle of the mesh, with straight sides.
    pub triangles: Vec<Triangle>,
    /// The number of triangles that belong to this rank; they come first. Every triangle belongs to one rank.
    pub own_triangles: usize,
    /// Index of each triangle in the undivided mesh.
    pub global_triangles: Vec<usize>,
    /// The number of the material of each triangle; empty if there is only one material.
    pub materials: Vec<u32>,
    /// Per vertex: is it in a triangle at a jump of a surface load? Empty without jumps.
    pub near_jumps: Vec<bool>,
    /// The nodes of ζ: the vertices.
    pub vertices: Rc<Nodes>,
    /// The nodes of u: the vertices, and for P2 the midpoints of the edges.
    pub nodes: Rc<Nodes>,
    /// The P2 elements of u; `None` for P1.
    pub(super) quadratic: Option<QuadraticElements>,
    /// |Ω| of the undivided body, m².
    pub area: f64,
    /// Its centroid x̄, m.
    pub centroid: [f64; 2],
    /// Its ∫|x − x̄|², m⁴.
    pub polar_inertia: f64,
    pub(super) patches: OnceLock<Arc<Patches>>,
}

/// The nodes of a continuous finite element space: those that this rank owns, then ghosts.
#[derive(Debug)]
pub struct Nodes {
    /// Coordinates, m.
    pub points: Vec<[f64; 2]>,
    /// ∫ φ_i, m²: the weight of each node in an integral. For P2 it is 0 at the vertices of straight
    /// triangles.
    pub weights: Vec<f64>,
    /// Σ ∫ φ_i over the undivided body, m²: its area, with straight edges for P1.
    pub area: f64,
    /// Ownership.
    pub partition: Partition,
}

/// The elements of P2.
#[derive(Debug)]
pub(super) struct QuadraticElements {
    /// Six nodes per triangle: vertices, then the midpoints of the sides 01, 12, 20.
    pub(super) nodes: Vec<[usize; 6]>,
    pub(super) elements: Vec<Quadratic>,
    /// The node in the middle of each edge, by the nodes of its ends in increasing order.
    pub(super) middle: HashMap<[usize; 2], usize>,
}

impl Nodes {
    /// All nodes on one rank.
    fn serial(points: Vec<[f64; 2]>, weights: Vec<f64>) -> Rc<Self> {
        let (area, partition) = (weights.iter().sum(), Partition::serial(points.len()));
        Rc::new(Self { points, weights, area, partition })
    }
}

impl Body {
    /// The undivided body, on one rank.
    pub fn new(mesh: Mesh, order: Order) -> Self {
        let corners = |t: &[usize; 3]| t.map(|node| mesh.nodes[node]);
        let triangles: Vec<Triangle> =
            mesh.triangles.iter().map(|t| Triangle::new(corners(t))).collect();
        let weights = linear_weights(&mesh, &triangles);
        let vertices = Nodes::serial(mesh.nodes.clone(), weights);
        let (nodes, quadratic) = match order {
            Order::Linear => (Rc::clone(&vertices), None),
            Order::Quadratic => {
                let (points, quadratic) = QuadraticElements::new(&mesh);
                let weights = quadratic.weights(points.len());
                (Nodes::serial(points, weights), Some(quadratic))
            }
        };
        let area = nodes.area;
        let mean = |of: &dyn Fn([f64; 2]) -> f64| {
            let weighted = nodes.points.iter().zip(&nodes.weights).map(|(&x, a)| a * of(x));
            weighted.sum::<f64>() / area
        };
        let centroid = [mean(&|x| x[0]), mean(&|x| x[1])];
        let polar = |[x, y]: [f64; 2]| (x - centroid[0]).powi(2) + (y - centroid[1]).powi(2);
        let polar_inertia = area * mean(&polar);
        let own_triangles = triangles.len();
        Self {
            mesh,
            triangles,
            own_triangles,
            global_triangles: (0..own_triangles).collect(),
            materials: Vec::new(),
            near_jumps: Vec::new(),
            vertices,
            nodes,
            quadratic,
            area,
            centroid,
            polar_inertia,
            patches: OnceLock::new(),
        }
    }

    /// The fits of polynomials to strains around the vertices. The first call is collective.
    pub(crate) fn patches(&self) -> &Arc<Patches> {
        self.patches.get_or_init(|| Patches::new(self).into())
    }

    /// The elements of u.
    pub fn elements(&self) -> Elements<'_> {
        match &self.quadratic {
            None => {
                Elements::Linear(Cells { nodes: &self.mesh.triangles, elements: &self.triangles })
            }
            Some(q) => Elements::Quadratic(Cells { nodes: &q.nodes, elements: &q.elements }),
        }
    }

    /// The ranks that share the body.
    pub fn comm(&self) -> Communicator {
        self.nodes.partition.comm()
    }

    /// The number of quadrature points of u in a triangle. It is known on a rank without triangles, too.
    pub fn points_per_triangle(&self) -> usize {
        if self.quadratic.is_some() { 3 } else { 1 }
    }

    /// The number of the material of triangle `t`.
    #[inline(always)]
    pub fn material(&self, t: usize) -> usize {
        self.materials.get(t).map_or(0, |&number| number as usize)
    }

    /// The order of the displacements.
    pub fn order(&self) -> Order {
        if self.quadratic.is_some() { Order::Quadratic } else { Order::Linear }
    }

    /// Does this rank know all triangles around its owned nodes? Then their parts of ∫ φ_i sum to the value
    /// in the undivided body.
    pub fn is_covered(&self) -> bool {
        let known = match &self.quadratic {
            None => linear_weights(&self.mesh, &self.triangles),
            Some(quadratic) => quadratic.weights(self.nodes.points.len()),
        };
        let mut weights = known.iter().zip(&self.nodes.weights).take(self.nodes.partition.owned());
        let least = 1e-9 * self.area / self.nodes.partition.total() as f64;
        weights.all(|(known, weight)| (known - weight).abs() <= (1e-9 * weight).max(1e-3 * least))
    }

    /// The strains (ε_xx, ε_yy, 2ε_xy) of nodal u at the quadrature points of the elements, Q in turn for each triangle.
    pub fn strains(&self, u: &[f64]) -> Vec<Vector3<f64>> {
        for_elements!(self, cells => cells.strains(u, |_, strain| strain))
    }

    /// Does a side of the element of u on triangle `t` differ from its chord, beyond rounding?
    pub fn is_curved(&self, t: usize) -> bool {
        let bends = |nodes: &[usize; 6]| {
            let at = |i: usize| Vector2::from(self.nodes.points[nodes[i]]);
            let bend = |(i, j, middle)| (at(middle) - 0.5 * (at(i) + at(j))).norm();
            let sides = [(0, 1, 3), (1, 2, 4), (2, 0, 5)];
            sides.into_iter().any(|side| bend(side) > ROUNDING * (at(side.1) - at(side.0)).norm())
        };
        self.quadratic_nodes().is_some_and(|nodes| bends(&nodes[t]))
    }

    /// The strains of nodal u at the vertices of triangle `t` and at the midpoints of its sides 01, 12, 20. Between them ε(u) is
    /// affine, and on a curved triangle of P2 quadratic up to O(h³).
    pub fn nodal_strains(&self, t: usize, u: &[f64]) -> [Vector3<f64>; 6] {
        match self.elements() {
            Elements::Linear(cells) => [cells.elements[t].points[0].strain(&cells.gather(t, u)); 6],
            Elements::Quadratic(cells) if self.is_curved(t) => {
                let nodes = cells.nodes[t].map(|node| self.nodes.points[node]);
                NODES.map(|at| QuadraturePoint::at(&nodes, at).strain(&cells.gather(t, u)))
            }
            Elements::Quadratic(cells) => {
                let points = &cells.elements[t].points;
                let [p, q, r] = at_vertices(&points.map(|point| point.strain(&cells.gather(t, u))));
                [p, q, r, 0.5 * (p + q), 0.5 * (q + r), 0.5 * (r + p)]
            }
        }
    }

    /// A nodal field of ζ at the quadrature points of the elements of u, Q in turn for each triangle.
    pub fn at_points(&self, zeta: &[f64]) -> Vec<f64> {
        let values = self.mesh.triangles.iter().map(|t| t.map(|node| zeta[node]));
        match self.elements() {
            Elements::Linear(_) => values.map(|z| z.iter().sum::<f64>() / 3.0).collect(),
            Elements::Quadratic(_) => values.flat_map(at_quadratic_points).collect(),
        }
    }

    /// A field from the vertices to the nodes of u. The midpoint of an edge gets the mean of its ends.
    pub fn at_nodes(&self, field: &[f64]) -> Vec<f64> {
        let Some(nodes) = self.quadratic_nodes() else { return field.to_vec() };
        let mut values = vec![0.0; self.nodes.points.len()];
        for (vertices, nodes) in self.mesh.triangles.iter().zip(nodes) {
            let [p, q, r] = vertices.map(|vertex| field[vertex]);
            let own = [p, q, r, 0.5 * (p + q), 0.5 * (q + r), 0.5 * (r + p)];
            nodes.iter().zip(own).for_each(|(&node, value)| values[node] = value);
        }
        values
    }

    /// The six nodes of each P2 element; `None` for P1.
    pub fn quadratic_nodes(&self) -> Option<&[[usize; 6]]> {
        self.quadratic.as_ref().map(|quadratic| &quadratic.nodes[..])
    }

    /// The node of u at each vertex.
    pub fn node_of_vertex(&self) -> Vec<usize> {
        let vertices = self.mesh.nodes.len();
        let Some(nodes) = self.quadratic_nodes() else { return (0..vertices).collect() };
        let mut node_of_vertex = vec![0; vertices];
        for (vertices, nodes) in self.mesh.triangles.iter().zip(nodes) {
            vertices.iter().zip(nodes).for_each(|(&vertex, &node)| node_of_vertex[vertex] = node);
        }
        node_of_vertex
    }

    /// r = √(∫|x − x̄|²/|Ω|), m: a rotation by 1/r moves the body as far as a unit translation.
    pub fn radius_of_gyration(&self) -> f64 {
        (self.polar_inertia / self.area).sqrt()
    }

    /// ∫ζ/|Ω| of a nodal field of ζ. Collective.
    pub fn mean(&self, zeta: &[f64]) -> f64 {
        let Nodes { weights, partition, area, .. } = &*self.vertices;
        partition.dot(weights, zeta, 1) / area
    }

    /// The nodes of u on edges of the undivided mesh, which are given by their vertices.
    pub fn edges(&self, edges: &[[usize; 2]]) -> Vec<Edge> {
        let middle = |ends| self.quadratic.as_ref().map(|q| q.middle[&sorted(ends)]);
        edges.iter().map(|&ends| Edge { ends, middle: middle(ends) }).collect()
    }
}

impl QuadraticElements {
    /// The coordinates of the nodes and the elements. Midpoints follow the vertices, in the order of the
    /// triangles.
    fn new(mesh: &Mesh) -> (Vec<[f64; 2]>, Self) {
        let mut points = mesh.nodes.clone();
        let mut middle =
            HashMap::with_capacity_and_hasher(3 * mesh.triangles.len() / 2, Default::default());
        let nodes: Vec<[usize; 6]> = (mesh.triangles.iter())
            .map(|&[a, b, c]| {
                let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|edge| {
                    *middle.entry(sorted(edge)).or_insert_with(|| {
                        points.push(mesh.midpoint(edge));
                        points.len() - 1
                    })
                });
                [a, b, c, ab, bc, ca]
            })
            .collect();
        let elements = nodes.iter().map(|n| Quadratic::new(n.map(|i| points[i]))).collect();
        (points, Self { nodes, elements, middle })
    }

    /// ∫ φ_i of each of `count` nodes, m².
    fn weights(&self, count: usize) -> Vec<f64> {
        let values = POINTS.map(quadratic_values);
        let mut weights = vec![0.0; count];
        for (nodes, element) in self.nodes.iter().zip(&self.elements) {
            for (point, values) in element.points.iter().zip(&values) {
                for (node, value) in nodes.iter().zip(values) {
                    weights[*node] += point.weight * value;
                }
            }
        }
        weights
    }
}

/// The values of an affine function at the quadrature points [`POINTS`], from those at the vertices.
pub(super) fn at_quadratic_points(vertices: [f64; 3]) -> [f64; 3] {
    let sum = vertices.iter().sum::<f64>();
    vertices.map(|value| sum / 6.0 + 0.5 * value)
}

/// ∫ λ_i over `triangles`, m²: a third of each triangle around a vertex.
fn linear_weights(mesh: &Mesh, triangles: &[Triangle]) -> Vec<f64> {
    let mut weights = vec![0.0; mesh.nodes.len()];
    for (nodes, triangle) in mesh.triangles.iter().zip(triangles) {
        nodes.iter().for_each(|&node| weights[node] += triangle.area() / 3.0);
    }
    weights
}
