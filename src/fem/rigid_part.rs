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
    /// The rigid part of the nodal displacements u, m: a = ∫u/|Ω|, θ = ∫ (x − x̄) × u / ∫|x − x̄|².
    /// Collective.
    pub fn of(body: &Body, u: &[f64]) -> Self {
        let [cx, cy] = body.centroid;
        let mut sums = [0.0; 3];
        let nodes = body.nodes.points.iter().zip(&body.nodes.weights).zip(u.as_chunks::<2>().0);
        for ((&[x, y], area), &[ux, uy]) in nodes.take(body.nodes.partition.owned()) {
            sums[0] += area * ux;
            sums[1] += area * uy;
            sums[2] += area * ((x - cx) * uy - (y - cy) * ux);
        }
        body.nodes.partition.comm().sum(&mut sums);
        let translation = [sums[0] / body.area, sums[1] / body.area];
        Self { translation, rotation: sums[2] / body.polar_inertia, centre: body.centroid }
    }

    /// The motion at a point, m.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let ([ax, ay], [cx, cy]) = (self.translation, self.centre);
        [ax - self.rotation * (y - cy), ay + self.rotation * (x - cx)]
    }

    /// The largest nodal |·| of the motion and of u less the motion, m. Collective.
    pub fn max_norms(&self, body: &Body, u: &[f64]) -> [f64; 2] {
        let (mut rigid, mut rest) = (0.0_f64, 0.0_f64);
        let nodes = body.nodes.points.iter().zip(u.as_chunks::<2>().0);
        for (&point, &[ux, uy]) in nodes.take(body.nodes.partition.owned()) {
            let [x, y] = self.at(point);
            rigid = rigid.max(x * x + y * y);
            rest = rest.max((ux - x) * (ux - x) + (uy - y) * (uy - y));
        }
        [rigid, rest].map(|square| body.nodes.partition.comm().max(square).sqrt())
    }
}
