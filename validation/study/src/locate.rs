//! The triangle of a mesh that a point lies in.

use signorini::fem::Body;

/// The bounding box of a body in square bins, each with the triangles whose bounding boxes meet it.
pub(super) struct Locator<'a> {
    body: &'a Body,
    /// Lower left corner of the bounding box, m.
    low: [f64; 2],
    /// Width of a bin, m.
    width: f64,
    /// Bins in x and in y.
    count: [usize; 2],
    bins: Vec<Vec<usize>>,
}

impl<'a> Locator<'a> {
    /// With about as many bins as triangles.
    pub(super) fn new(body: &'a Body) -> Self {
        let (low, high) = bounds(&body.mesh.nodes);
        let size = [high[0] - low[0], high[1] - low[1]];
        let width = (size[0] * size[1] / body.triangles.len() as f64).sqrt();
        let count = size.map(|length| (length / width).ceil().max(1.0) as usize);
        let bins = vec![Vec::new(); count[0] * count[1]];
        let mut locator = Self { body, low, width, count, bins };
        for (t, nodes) in body.mesh.triangles.iter().enumerate() {
            let (low, high) = bounds(&nodes.map(|node| body.mesh.nodes[node]));
            let ([left, bottom], [right, top]) = (locator.bin(low), locator.bin(high));
            for j in bottom..=top {
                for i in left..=right {
                    locator.bins[j * count[0] + i].push(t);
                }
            }
        }
        locator
    }

    /// The triangle that `point` is in and its barycentric coordinates there; a point outside the
    /// body belongs to a triangle near it, whose functions continue to the point.
    pub(super) fn locate(&self, point: [f64; 2]) -> (usize, [f64; 3]) {
        let [i, j] = self.bin(point);
        let near = &self.bins[j * self.count[0] + i];
        let place = |t: usize| (t, self.barycentric(t, point));
        let least = |place: &(usize, [f64; 3])| place.1.into_iter().fold(f64::INFINITY, f64::min);
        let deepest = |a: &_, b: &_| least(a).total_cmp(&least(b));
        let all = 0..self.body.triangles.len();
        (near.iter().map(|&t| place(t)).max_by(deepest))
            .or_else(|| all.map(place).max_by(deepest))
            .unwrap_or_default()
    }

    fn bin(&self, point: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|axis| {
            let bin = ((point[axis] - self.low[axis]) / self.width) as usize;
            bin.min(self.count[axis] - 1)
        })
    }

    /// λ_i(x) = 1/3 + ∇λ_i·(x − c), c the centroid of triangle `t`.
    fn barycentric(&self, t: usize, [x, y]: [f64; 2]) -> [f64; 3] {
        let corners = self.body.mesh.triangles[t].map(|node| self.body.mesh.nodes[node]);
        let centroid =
            [0, 1].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 3.0);
        let gradients = &self.body.triangles[t].gradients;
        gradients.map(|[dx, dy]| 1.0 / 3.0 + dx * (x - centroid[0]) + dy * (y - centroid[1]))
    }
}

/// The lower left and upper right corners of the box around some points, m.
fn bounds(points: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    points.iter().fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(low, high), point| {
        ([0, 1].map(|i| low[i].min(point[i])), [0, 1].map(|i| high[i].max(point[i])))
    })
}
