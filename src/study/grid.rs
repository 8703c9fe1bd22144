//! Structured grids on rectangles, meshed without gmsh.

use crate::mesh::{Curve, Mesh};

/// A rectangle cut into cells by straight lines, and each cell from lower left to upper right.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// x of the upright lines and y of the level ones, rising, m.
    lines: [Vec<f64>; 2],
}

impl Grid {
    /// The rectangle [0, width] × [0, height] in `nx` × `ny` equal cells.
    pub fn uniform([width, height]: [f64; 2], [nx, ny]: [usize; 2]) -> Self {
        let even = |size: f64, n: usize| (0..=n).map(|i| size * i as f64 / n as f64).collect();
        Self { lines: [even(width, nx), even(height, ny)] }
    }

    /// The unit square with the lines of `geo/square.geo`: `n` cells a side whose widths grow
    /// geometrically from the walls to the middle, by `grading` in all.
    pub fn square(n: usize, grading: f64) -> Self {
        let ratio = grading.powf(1.0 / (n.saturating_sub(1) / 2).max(1) as f64);
        let mut lines = vec![0.0];
        for i in 0..n {
            lines.push(lines[i] + ratio.powi(i.min(n - 1 - i) as i32));
        }
        let total = lines[n];
        lines.iter_mut().for_each(|line| *line /= total);
        Self { lines: [lines.clone(), lines] }
    }

    /// Its triangulation; the sides are the curves `left`, `right`, `bottom` and `top`.
    pub fn mesh(&self) -> Mesh {
        let [x, y] = &self.lines;
        let (nx, ny) = (x.len() - 1, y.len() - 1);
        let node = |i: usize, j: usize| j * (nx + 1) + i;
        let nodes = y.iter().flat_map(|&y| x.iter().map(move |&x| [x, y])).collect();
        let cells = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
        let triangles = cells
            .flat_map(|(i, j)| {
                let [a, b] = [node(i, j), node(i + 1, j)];
                let [c, d] = [node(i + 1, j + 1), node(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        let curve = |edges: Vec<[usize; 2]>| Curve { edges, interior_edges: 0 };
        let sides = [
            ("bottom", curve((0..nx).map(|i| [node(i, 0), node(i + 1, 0)]).collect())),
            ("right", curve((0..ny).map(|j| [node(nx, j), node(nx, j + 1)]).collect())),
            ("top", curve((0..nx).map(|i| [node(i + 1, ny), node(i, ny)]).collect())),
            ("left", curve((0..ny).map(|j| [node(0, j + 1), node(0, j)]).collect())),
        ];
        let curves = sides.map(|(name, curve)| (name.to_owned(), curve)).into();
        Mesh { nodes, triangles, curves }
    }

    /// The triangle of [`Grid::mesh`] that `point` is in and its barycentric coordinates there; a
    /// point outside belongs to the nearest cell.
    pub fn locate(&self, point: [f64; 2]) -> (usize, [f64; 3]) {
        let along = |axis: usize| {
            let lines = &self.lines[axis];
            let after = lines.partition_point(|&line| line <= point[axis]);
            let cell = after.clamp(1, lines.len() - 1) - 1;
            (cell, (point[axis] - lines[cell]) / (lines[cell + 1] - lines[cell]))
        };
        let ((i, s), (j, t)) = (along(0), along(1));
        let cell = j * (self.lines[0].len() - 1) + i;
        match s >= t {
            true => (2 * cell, [1.0 - s, s - t, t]),
            false => (2 * cell + 1, [1.0 - t, s, t - s]),
        }
    }
}

/// The rectangle [0, width] × [0, height] in `nx` × `ny` equal cells, triangulated as by
/// [`Grid::mesh`].
pub fn rectangle(width: f64, height: f64, nx: usize, ny: usize) -> Mesh {
    Grid::uniform([width, height], [nx, ny]).mesh()
}
