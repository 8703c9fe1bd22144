//! The triangle of a mesh that a point lies in.

use nalgebra::Vector3;
use rstar::{
    RTree,
    primitives::{GeomWithData, Rectangle},
};
use signorini::fem::Body;

/// The triangles of a body, found by their bounding boxes.
pub(super) struct Locator<'a> {
    body: &'a Body,
    boxes: RTree<GeomWithData<Rectangle<[f64; 2]>, usize>>,
}

impl<'a> Locator<'a> {
    pub(super) fn new(body: &'a Body) -> Self {
        let triangles = body.mesh.triangles.iter().enumerate();
        let boxes = triangles.map(|(t, nodes)| {
            let [a, b, c] = nodes.map(|node| body.mesh.nodes[node]);
            let low = [0, 1].map(|axis| a[axis].min(b[axis]).min(c[axis]));
            let high = [0, 1].map(|axis| a[axis].max(b[axis]).max(c[axis]));
            GeomWithData::new(Rectangle::from_corners(low, high), t)
        });
        Self { body, boxes: RTree::bulk_load(boxes.collect()) }
    }

    /// The triangle that `point` is in and its barycentric coordinates there; a point outside the
    /// body belongs to a triangle near it, whose functions continue to the point.
    pub(super) fn locate(&self, point: [f64; 2]) -> (usize, Vector3<f64>) {
        let around = self.boxes.locate_all_at_point(point);
        let place = |t: usize| (t, self.barycentric(t, point));
        (around.map(|found| place(found.data)).max_by(|a, b| a.1.min().total_cmp(&b.1.min())))
            .or_else(|| self.boxes.nearest_neighbor(point).map(|found| place(found.data)))
            .unwrap_or_default()
    }

    /// λ_i(x) = 1/3 + ∇λ_i·(x − c), c the centroid of triangle `t`.
    fn barycentric(&self, t: usize, [x, y]: [f64; 2]) -> Vector3<f64> {
        let corners = self.body.mesh.triangles[t].map(|node| self.body.mesh.nodes[node]);
        let centroid =
            [0, 1].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 3.0);
        let gradients = &self.body.triangles[t].gradients();
        gradients.map(|[dx, dy]| 1.0 / 3.0 + dx * (x - centroid[0]) + dy * (y - centroid[1])).into()
    }
}
