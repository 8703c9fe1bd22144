//! Structured triangulations of rectangles, without gmsh.

use super::{Curve, Mesh};

impl Mesh {
    /// The rectangle [0, `width`] × [0, `height`] (m) in `nx` × `ny` equal cells. A diagonal from lower left
    /// to upper right cuts each cell. The sides are the curves `left`, `right`, `bottom` and `top`.
    pub fn rectangle(width: f64, height: f64, nx: usize, ny: usize) -> Self {
        let at = |size: f64, i: usize, n: usize| size * i as f64 / n as f64;
        let points = (0..=ny).flat_map(|j| (0..=nx).map(move |i| (i, j)));
        let nodes = points.map(|(i, j)| [at(width, i, nx), at(height, j, ny)]).collect();
        let node = |i: usize, j: usize| j * (nx + 1) + i;
        let cells = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
        let triangles = cells
            .flat_map(|(i, j)| {
                let [a, b] = [node(i, j), node(i + 1, j)];
                let [c, d] = [node(i + 1, j + 1), node(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        let curve = |edges: Vec<[usize; 2]>| Curve { edges, other_edges: 0 };
        let sides = [
            ("bottom", curve((0..nx).map(|i| [node(i, 0), node(i + 1, 0)]).collect())),
            ("right", curve((0..ny).map(|j| [node(nx, j), node(nx, j + 1)]).collect())),
            ("top", curve((0..nx).map(|i| [node(i + 1, ny), node(i, ny)]).collect())),
            ("left", curve((0..ny).map(|j| [node(0, j + 1), node(0, j)]).collect())),
        ];
        let curves = sides.map(|(name, curve)| (name.to_owned(), curve)).into();
        Self { nodes, triangles, curves, ..Self::default() }
    }
}
