//! The numbering of nodes and triangles.

use super::{Mesh, bounds, extent, sorted};

impl Mesh {
    /// Numbers the nodes along Morton's curve (G. M. Morton, *A computer oriented geodetic data base*, IBM,
    /// 1966), and the triangles by their first node. Neighbouring nodes are then close in memory, and the
    /// assembly of large matrices takes half the time.
    pub fn in_morton_order(self) -> Self {
        let low = bounds(&self.nodes).map(|[low, _]| low);
        let scale = f64::from(u32::MAX) / extent(&self.nodes);
        let key = |&node: &usize| {
            let [x, y] = [0, 1].map(|axis| ((self.nodes[node][axis] - low[axis]) * scale) as u32);
            spread(x) | spread(y) << 1
        };
        let mut nodes: Vec<usize> = (0..self.nodes.len()).collect();
        nodes.sort_by_cached_key(key);
        let number = inverse(&nodes);
        let renumbered = |triangle: &[usize; 3]| triangle.map(|node| number[node]);
        let mut triangles: Vec<usize> = (0..self.triangles.len()).collect();
        triangles.sort_by_cached_key(|&t| renumbered(&self.triangles[t]).into_iter().min());
        let number_of_triangle = inverse(&triangles);
        let edge = |edge: [usize; 2]| edge.map(|node| number[node]);
        let Self { mut curves, mut surfaces, .. } = self;
        for curve in curves.values_mut() {
            curve.edges.iter_mut().for_each(|ends| *ends = edge(*ends));
        }
        for surface in surfaces.values_mut() {
            surface.iter_mut().for_each(|t| *t = number_of_triangle[*t]);
            surface.sort_unstable();
        }
        Self {
            nodes: nodes.iter().map(|&node| self.nodes[node]).collect(),
            triangles: triangles.iter().map(|&t| renumbered(&self.triangles[t])).collect(),
            curves,
            surfaces,
            points: self.points.iter().map(|&node| number[node]).collect(),
            curved: self.curved.iter().map(|(&ends, &at)| (sorted(edge(ends)), at)).collect(),
            gmsh: self.gmsh,
            notes: self.notes,
        }
    }
}

/// The bits of a number with a zero bit before each of them.
fn spread(number: u32) -> u64 {
    (0..32).fold(0, |bits, i| bits | u64::from(number >> i & 1) << (2 * i))
}

/// The position of each number in a permutation.
fn inverse(permutation: &[usize]) -> Vec<usize> {
    let mut positions = vec![0; permutation.len()];
    permutation.iter().enumerate().for_each(|(position, &number)| positions[number] = position);
    positions
}
