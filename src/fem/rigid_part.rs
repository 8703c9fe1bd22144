//! The rigid part of a displacement field.

use super::Body;

/// The rigid motion a + θ e_z × (x − x̄) nearest to a field in ∫|·|², with x̄ the centroid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidPart {
    translation: [f64; 2],
    rotation: f64,
    centre: [f64; 2],
}

impl RigidPart {
    /// Of the nodal displacements u, m: a = ∫u/|Ω|, θ = ∫ (x − x̄) × u / ∫|x − x̄|². Collective.
    pub fn of(body: &Body, u: &[f64]) -> Self {
        let owned = body.partition.owned();
        let nodes = || body.mesh.nodes[..owned].iter().zip(&body.node_area);
        let mut sums = [0.0; 4];
        for (([x, y], area), u) in nodes().zip(u.chunks_exact(2)) {
            for (sum, value) in sums.iter_mut().zip([*x, *y, u[0], u[1]]) {
                *sum += area * value;
            }
        }
        let ranks = body.partition.ranks();
        ranks.sum(&mut sums);
        let [cx, cy, ax, ay] = sums.map(|sum| sum / body.area);
        let mut turns = [0.0; 2];
        for (([x, y], area), u) in nodes().zip(u.chunks_exact(2)) {
            let (dx, dy) = (x - cx, y - cy);
            turns[0] += area * (dx * (u[1] - ay) - dy * (u[0] - ax));
            turns[1] += area * (dx * dx + dy * dy);
        }
        ranks.sum(&mut turns);
        Self { translation: [ax, ay], rotation: turns[0] / turns[1], centre: [cx, cy] }
    }

    /// The motion at a point, m.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([ax, ay], [cx, cy]) = (self.translation, self.centre);
        [ax - self.rotation * (y - cy), ay + self.rotation * (x - cx)]
    }

    /// The largest |·| of the motion and of what it leaves of u, m. Collective.
    pub fn sizes(&self, body: &Body, u: &[f64]) -> [f64; 2] {
        let mut squares = [0.0_f64; 2];
        let nodes = &body.mesh.nodes[..body.partition.owned()];
        for (&point, u) in nodes.iter().zip(u.chunks_exact(2)) {
            let [x, y] = self.at(point);
            let rest = [u[0] - x, u[1] - y];
            squares[0] = squares[0].max(x * x + y * y);
            squares[1] = squares[1].max(rest[0] * rest[0] + rest[1] * rest[1]);
        }
        squares.map(|square| body.partition.ranks().max(square).sqrt())
    }
}
