//! Values of finite element functions at a point of the body.

use super::{Body, Elements, element::quadratic_values};
use nalgebra::Vector3;

/// A point of the body: its triangle and the barycentric coordinates λ in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// Index of the triangle in the undivided mesh.
    pub triangle: usize,
    /// λ; in a curved triangle that of x(λ) = Σ x_i φ_i(λ).
    pub barycentric: [f64; 3],
}

/// Displacement, damage and strain at a point.
#[derive(Debug, Clone, Copy)]
pub struct PointValues {
    /// u, m.
    pub u: [f64; 2],
    /// ζ.
    pub zeta: f64,
    /// (ε_xx, ε_yy, 2ε_xy).
    pub strain: Vector3<f64>,
}

/// A point between a chord and its arc may lie outside the triangle by this fraction of its height.
const OUTSIDE: f64 = 0.05;
/// A triangle is a candidate if the point lies outside its chords by at most this fraction of its height.
const NEAR: f64 = 0.5;
/// The rounding of λ at points on the sides of a triangle.
pub(crate) const ON_SIDE: f64 = 1e-9;
/// The number of Newton steps for λ in a curved triangle.
const CORRECTIONS: usize = 8;

impl Location {
    /// The locations of `point`, m, in the undivided `body`: in all triangles of one material that contain it, as at a vertex.
    /// Empty if it lies outside.
    pub fn of(point: [f64; 2], body: &Body) -> Vec<Self> {
        let depth = |of: &Self| of.barycentric.iter().copied().fold(f64::INFINITY, f64::min);
        let locations = (0..body.triangles.len()).map(|triangle| {
            let vertex = body.mesh.nodes[body.mesh.triangles[triangle][0]];
            let barycentric = barycentric(body, triangle, point, [1.0, 0.0, 0.0], vertex);
            Self { triangle, barycentric }
        });
        // The point may lie between a chord and its arc.
        let near = locations.filter(|of| depth(of) > -NEAR).map(|of| of.corrected(point, body));
        let mut near: Vec<Self> = near.collect();
        near.sort_by(|a, b| depth(b).total_cmp(&depth(a)));
        let Some(best) = near.first().copied().filter(|of| depth(of) >= -OUTSIDE) else {
            return Vec::new();
        };
        let material = |of: &Self| body.material(of.triangle);
        near.retain(|of| {
            depth(of) >= depth(&best).min(0.0) - ON_SIDE && material(of) == material(&best)
        });
        near
    }

    /// The vertex with the largest λ, by its number in the undivided mesh.
    pub fn nearest(&self, body: &Body) -> usize {
        let largest = (0..3).max_by(|&i, &j| self.barycentric[i].total_cmp(&self.barycentric[j]));
        body.mesh.triangles[self.triangle][largest.unwrap_or(0)]
    }

    /// Newton's method for x(λ) = `point` with the Jacobian of the straight triangle.
    fn corrected(mut self, point: [f64; 2], body: &Body) -> Self {
        if let Elements::Quadratic(cells) = body.elements() {
            for _ in 0..CORRECTIONS {
                let values = quadratic_values(self.barycentric);
                let nodes = cells.nodes[self.triangle].map(|node| body.nodes.points[node]);
                let image = [0, 1].map(|k| values.iter().zip(&nodes).map(|(v, x)| v * x[k]).sum());
                self.barycentric = barycentric(body, self.triangle, point, self.barycentric, image);
            }
        }
        self
    }

    /// u, ζ and ε(u) there, from nodal fields, in triangle `t` of this rank. The strain is constant in a
    /// triangle where u is linear, and affine between the quadrature points where it is quadratic.
    pub fn values(&self, body: &Body, t: usize, u: &[f64], zeta: &[f64]) -> PointValues {
        let lambda = self.barycentric;
        let displacement = |nodes: &[[f64; 2]], values: &[f64]| {
            [0, 1].map(|k| nodes.iter().zip(values).map(|(u, value)| u[k] * value).sum())
        };
        let (u, strain) = match body.elements() {
            Elements::Linear(cells) => {
                let local = cells.gather(t, u);
                (displacement(&local, &lambda), cells.elements[t].points[0].strain(&local))
            }
            Elements::Quadratic(cells) => {
                let local = cells.gather(t, u);
                // The affine function with the value 1 at one quadrature point and 0 at the others.
                let parts = cells.elements[t].points.iter().enumerate();
                let strain = parts.map(|(i, q)| q.strain(&local) * (2.0 * lambda[i] - 1.0 / 3.0));
                (displacement(&local, &quadratic_values(lambda)), strain.sum())
            }
        };
        let vertices = body.mesh.triangles[t].map(|node| zeta[node]);
        PointValues { u, zeta: vertices.iter().zip(&lambda).map(|(z, l)| z * l).sum(), strain }
    }
}

/// λ of `point` in the straight triangle `t`, in which λ = `at` has the place `image`.
fn barycentric(body: &Body, t: usize, point: [f64; 2], at: [f64; 3], image: [f64; 2]) -> [f64; 3] {
    let gradients = body.triangles[t].gradients();
    let [dx, dy] = [point[0] - image[0], point[1] - image[1]];
    [0, 1, 2].map(|i| at[i] + gradients[i][0] * dx + gradients[i][1] * dy)
}
