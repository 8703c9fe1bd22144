//! Tractions on the sides of the triangles that balance each of them, star by star.
//!
//! Let ψ be the hat function of a vertex. In each triangle of its star, the forces of the tractions on both sides there are to
//! balance the rest (Ladevèze and Leguillon, SIAM J. Numer. Anal. 20, 1983):
//!
//! ∫_first τn ψ + ∫_last τn ψ = ρ = ∫ σ_h ∇ψ − ∫ f_B ψ.
//!
//! With the side between the triangles j and j + 1 as the force m_j on the first of them, m_j = m_{j−1} + ρ_j. The sum of
//! all ρ is the load of the boundary, because u_h is in equilibrium. The remaining constant minimises Σ w_j |m_j − m̄_j|²,
//! with the mean m̄ of the forces of σ_h on both sides, weighted by 1/(μζ), and w the sum of these.

use super::composite::SideForces;
use crate::mesh::sorted;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use rustc_hash::FxHashMap as HashMap;

/// A triangle with the computed stress in it, affine.
pub(super) struct StressedTriangle {
    /// The nodes of u at the vertices, and these points, m.
    pub(super) nodes: [usize; 3],
    pub(super) corners: [Vector2<f64>; 3],
    /// ∇ψ, 1/m, and the area, m².
    pub(super) gradients: [[f64; 2]; 3],
    pub(super) area: f64,
    /// (σ_xx, σ_yy, σ_xy) at the vertices, Pa.
    pub(super) stresses: [Vector3<f64>; 3],
    /// 1/(μζ), 1/Pa, the mean of ζ, and A⁻¹ as a matrix, 1/Pa.
    pub(super) flexibility: f64,
    pub(super) zeta: f64,
    pub(super) compliance: Matrix3<f64>,
    /// ∫ f_B ψ of the vertices, and ∫ f_B b of the bubbles b = 4ψψ of the sides 01, 12, 20.
    pub(super) body: [Vector2<f64>; 3],
    pub(super) bubbles: [Vector2<f64>; 3],
}

/// An edge of the boundary, where the traction is known except for the reactions of supports.
#[derive(Default)]
pub(super) struct BoundaryEdge {
    /// The directions in which supports give reactions.
    pub(super) supported: Vec<Vector2<f64>>,
    /// The other forces ∫ τn ψ, of the ends in increasing order.
    pub(super) forces: [Vector2<f64>; 2],
}

impl BoundaryEdge {
    /// Unit vectors that span the directions without reactions.
    pub(super) fn known(&self) -> Vec<Vector2<f64>> {
        let perpendicular = |d: &Vector2<f64>| Vector2::new(-d.y, d.x).normalize();
        match &self.supported[..] {
            [] => vec![Vector2::x(), Vector2::y()],
            [first, others @ ..] => {
                let across = perpendicular(first);
                let is_line = others.iter().all(|d| across.dot(d).abs() < 1e-6);
                if is_line { vec![across] } else { Vec::new() }
            }
        }
    }
}

impl StressedTriangle {
    /// The product σ v of a stress and a vector.
    fn apply(stress: &Vector3<f64>, [x, y]: [f64; 2]) -> Vector2<f64> {
        Vector2::new(stress[0] * x + stress[2] * y, stress[2] * x + stress[1] * y)
    }

    /// The force ρ that both sides at the vertex i have to bear, N per metre of thickness.
    fn rest(&self, i: usize) -> Vector2<f64> {
        let mean = self.stresses.iter().sum::<Vector3<f64>>() / 3.0;
        self.area * Self::apply(&mean, self.gradients[i]) - self.body[i]
    }

    /// The force of σ_h on the side from `start` to `end` with the hat function of the vertex i at one of them.
    pub(super) fn force(&self, start: usize, end: usize, i: usize) -> Vector2<f64> {
        let along = self.corners[end] - self.corners[start];
        let other = start + end - i;
        Self::apply(&(self.stresses[i] / 3.0 + self.stresses[other] / 6.0), [along.y, -along.x])
    }

    /// The force of σ_h on the side from `start` to `end` with its bubble.
    pub(super) fn bubble_force(&self, start: usize, end: usize) -> Vector2<f64> {
        let along = self.corners[end] - self.corners[start];
        Self::apply(&((self.stresses[start] + self.stresses[end]) / 3.0), [along.y, -along.x])
    }

    /// div σ_h, N/m³.
    pub(super) fn divergence(&self) -> Vector2<f64> {
        self.stresses.iter().zip(self.gradients).map(|(stress, g)| Self::apply(stress, g)).sum()
    }

    /// ∫ τn b = ∫ σ_h ∇b − ∫ f_B b for the bubble b = 4ψ_iψ_j of the side from i to j: b vanishes on the other sides.
    pub(super) fn bubble(&self, i: usize, j: usize) -> Vector2<f64> {
        let sum = self.stresses.iter().sum::<Vector3<f64>>();
        let part = |i: usize, j: usize| {
            Self::apply(&((sum + self.stresses[i]) * (self.area / 3.0)), self.gradients[j])
        };
        part(i, j) + part(j, i) - self.bubbles[i]
    }
}

/// The triangles around a vertex, counter-clockwise, each with the number of the vertex in it.
pub(super) struct Star {
    pub(super) node: usize,
    pub(super) triangles: Vec<(usize, usize)>,
    /// Does the last triangle meet the first one? Otherwise the first and the last side are on the boundary.
    pub(super) is_closed: bool,
}

impl Star {
    /// The stars of the first `owned` nodes, with the nodes at the vertices of all triangles. `None` if a vertex has two stars, where
    /// parts of the body touch in a point.
    pub(super) fn all(nodes: &[[usize; 3]], owned: usize) -> Option<Vec<Self>> {
        let mut around = vec![Vec::new(); owned];
        for (t, of) in nodes.iter().enumerate() {
            for (i, node) in of.iter().enumerate().filter(|(_, node)| **node < owned) {
                around[*node].push((t, i));
            }
        }
        let star = |(node, mut triangles): (usize, Vec<(usize, usize)>)| {
            let other = |(t, i): (usize, usize), k: usize| nodes[t][(i + k) % 3];
            let is_first =
                |j: &usize| triangles.iter().all(|&of| other(of, 2) != other(triangles[*j], 1));
            let first = (0..triangles.len()).find(is_first);
            triangles.swap(0, first.unwrap_or(0));
            for j in 1..triangles.len() {
                let end = other(triangles[j - 1], 2);
                let next = (j..triangles.len()).find(|&k| other(triangles[k], 1) == end)?;
                triangles.swap(j, next);
            }
            Some(Self { node, triangles, is_closed: first.is_none() })
        };
        let vertices = around.into_iter().enumerate().filter(|(_, around)| !around.is_empty());
        vertices.map(star).collect()
    }

    /// The sides of its triangles on the boundary: the triangle, and the number of the vertex at which the side starts.
    pub(super) fn boundary_sides(&self) -> impl Iterator<Item = (usize, usize)> {
        let ends = [
            self.triangles.first().copied(),
            self.triangles.last().map(|&(t, i)| (t, (i + 2) % 3)),
        ];
        ends.into_iter().flatten().filter(|_| !self.is_closed)
    }

    /// The node at the other end of the first side of triangle j, or of the last side of the last triangle.
    pub(super) fn end(&self, triangles: &[StressedTriangle], j: usize) -> usize {
        match self.triangles.get(j) {
            Some(&(t, i)) => triangles[t].nodes[(i + 1) % 3],
            None => {
                let (t, i) = self.triangles[j - 1];
                triangles[t].nodes[(i + 2) % 3]
            }
        }
    }
}

/// The tractions in the stars without their bubbles, and Σ |imbalance|² of these stars, N². `None` if a part of the boundary is not known.
pub(super) fn tractions(
    triangles: &[StressedTriangle],
    stars: &[Star],
    boundary: &HashMap<[usize; 2], BoundaryEdge>,
) -> Option<(Vec<SideForces>, f64)> {
    let mut forces = vec![SideForces::default(); triangles.len()];
    let mut imbalance = 0.0;
    for star in stars {
        imbalance += add_star(triangles, star, boundary, &mut forces)?;
    }
    Some((forces, imbalance))
}

/// Adds the tractions of a star to `forces`. Returns the square of the force without balance, N², or `None` if nothing is known of
/// an edge of the boundary.
fn add_star(
    triangles: &[StressedTriangle],
    of: &Star,
    boundary: &HashMap<[usize; 2], BoundaryEdge>,
    forces: &mut [SideForces],
) -> Option<f64> {
    let (star, is_closed) = (&of.triangles, of.is_closed);
    // The mean of σ_h's forces at m_{j−1}, and its weight: the first side of triangle j and the last one of the triangle before.
    let mean = |j: usize| {
        let (mut sum, mut weight) = (Vector2::zeros(), 0.0);
        if j < star.len() {
            let (t, i) = star[j];
            let w = triangles[t].flexibility;
            (sum, weight) = (sum - w * triangles[t].force(i, (i + 1) % 3, i), weight + w);
        }
        let before =
            if is_closed { Some((j + star.len() - 1) % star.len()) } else { j.checked_sub(1) };
        if let Some(before) = before {
            let (t, i) = star[before];
            let w = triangles[t].flexibility;
            (sum, weight) = (sum + w * triangles[t].force((i + 2) % 3, i, i), weight + w);
        }
        (sum, weight)
    };
    let (mut sum, mut rests, mut best, mut weights) =
        (Vector2::zeros(), Vec::new(), Vector2::zeros(), 0.0);
    for j in 0..star.len() + usize::from(!is_closed) {
        let (of_mean, weight) = mean(j);
        (best, weights) = (best + of_mean - weight * sum, weights + weight);
        rests.push(sum);
        if let Some(&(t, i)) = star.get(j) {
            sum += triangles[t].rest(i);
        }
    }
    let mut constant = best / weights;
    let mut imbalance = if is_closed { sum.norm_squared() } else { 0.0 };
    if !is_closed {
        // The known components of −m_{−1} and of the last m.
        let of_edge = |j: usize| {
            let end = of.end(triangles, j);
            let edge = boundary.get(&sorted([of.node, end]))?;
            Some((edge.known(), edge.forces[usize::from(of.node > end)]))
        };
        let (first, last) = (of_edge(0)?, of_edge(star.len())?);
        let (mut gram, mut right) = (Matrix2::zeros(), Vector2::zeros());
        let conditions =
            first.0.iter().map(|n| (*n, -first.1)).chain(last.0.iter().map(|n| (*n, last.1 - sum)));
        let conditions: Vec<_> = conditions.collect();
        for (n, value) in &conditions {
            gram += n * n.transpose();
            right += n * n.dot(value);
        }
        let inverse = gram.pseudo_inverse(1e-9).ok()?;
        constant += inverse * (right - gram * constant);
        let off = conditions.iter().map(|(n, value)| n.dot(&(constant - value)).powi(2));
        imbalance = off.sum();
    }
    for (j, &(t, i)) in star.iter().enumerate() {
        let [before, after] = [constant + rests[j], constant + rests[j] + triangles[t].rest(i)];
        forces[t][i][0] = -before;
        forces[t][(i + 2) % 3][1] = after;
    }
    Some(imbalance)
}
