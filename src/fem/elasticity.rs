//! The damaged elasticity a(u, v) = (ζ Aε(u), ε(v)) of (26): stresses, internal forces and energies.

use super::{
    Body, Element, for_elements,
    stiffness::{ElementSums, Groups},
};
use crate::model::Material;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Stresses, internal forces and energies of a displacement field, triangle by triangle. `zeta` are the values of ζ at the
/// quadrature points, [`Body::at_points`].
///
/// Solvers multiply by K with `sums`; the certificate and the error estimates use the other methods. These loops are
/// independent of each other; both take the gradients of the elements, D and ζ at the quadrature points as they are here, so a fault in
/// these is seen by neither. (Solvers also take f − K u_D of prescribed displacements from [`Self::internal_force`].)
#[derive(Debug, Clone, Default)]
pub struct Elasticity {
    /// The materials by their numbers, and A of each as the matrix D of [`Material::stiffness`], Pa.
    materials: Vec<(Material, Matrix3<f64>)>,
}

impl Elasticity {
    /// The operator of undamaged `materials`, at least one, as they are numbered in
    /// [`Body::materials`].
    pub fn new(materials: impl IntoIterator<Item = Material>) -> Self {
        Self { materials: materials.into_iter().map(|m| (m, m.stiffness())).collect() }
    }

    /// The materials by their numbers.
    pub fn materials(&self) -> impl Iterator<Item = &Material> {
        self.materials.iter().map(|(material, _)| material)
    }

    /// The material of triangle `t`.
    pub fn material(&self, body: &Body, t: usize) -> &Material {
        &self.materials[body.material(t)].0
    }

    /// D of triangle `t`, Pa.
    #[inline(always)]
    pub(crate) fn d(&self, body: &Body, t: usize) -> &Matrix3<f64> {
        &self.materials[body.material(t)].1
    }

    /// σ = ζ Aε(u), Pa, the mean Σ w_q σ_q / Σ w_q over each triangle, with `zeta` the values of ζ at the
    /// quadrature points q.
    pub fn stresses(&self, body: &Body, zeta: &[f64], u: &[f64]) -> Vec<Vector3<f64>> {
        for_elements!(body, cells => {
            let mean = |(t, element): (usize, &Element<_, _>)| {
                let (local, points) = (cells.gather(t, u), &element.points);
                let parts = points.iter().zip(&zeta[points.len() * t..]);
                let parts = parts.map(|(point, zeta)| point.weight * zeta * point.strain(&local));
                self.d(body, t) * parts.sum::<Vector3<f64>>() / element.area()
            };
            cells.elements.iter().enumerate().map(mean).collect()
        })
    }

    /// σ = ζ Aε(u), Pa, in a triangle at barycentric coordinates. It is affine between the quadrature points, which have
    /// the values `zeta` of ζ.
    pub fn stress_at(
        &self,
        body: &Body,
        (t, at): (usize, [f64; 3]),
        zeta: &[f64],
        u: &[f64],
    ) -> Vector3<f64> {
        for_elements!(body, cells => {
            let (local, points) = (cells.gather(t, u), &cells.elements[t].points);
            let zeta = &zeta[points.len() * t..];
            // An affine f has the values f(x_q) = Σ f(corner)/6 + f(corner q)/2.
            let weight = |q: usize| if points.len() == 1 { 1.0 } else { 2.0 * at[q] - 1.0 / 3.0 };
            let strains = points.iter().zip(zeta).enumerate();
            let strains = strains.map(|(q, (point, zeta))| point.strain(&local) * (weight(q) * zeta));
            self.d(body, t) * strains.sum::<Vector3<f64>>()
        })
    }

    /// The strain energies (twice) w ζ Aε(u) : ε(u) at the quadrature points, N m per metre of thickness.
    pub fn energies(&self, body: &Body, zeta: &[f64], u: &[f64]) -> Vec<f64> {
        for_elements!(body, cells => {
            let points = cells.elements.iter().flat_map(|element| &element.points);
            let densities = cells.strains(u, |t, e| e.dot(&(self.d(body, t) * e)));
            let points = densities.iter().zip(points).zip(zeta);
            points.map(|((density, point), zeta)| point.weight * zeta * density).collect()
        })
    }

    /// The sums over the elements for solvers, with ζ = 0.
    pub(super) fn sums(&self, body: &Body) -> Box<dyn ElementSums> {
        for_elements!(body, cells => Box::new(Groups::new(self, cells)))
    }

    /// The internal forces F_i = a(u, φ_i) of nodal u, N per metre of thickness.
    pub fn internal_force(&self, body: &Body, zeta: &[f64], u: &[f64]) -> Vec<f64> {
        let mut force = vec![0.0; u.len()];
        for_elements!(body, cells => {
            let mut zeta = zeta.iter();
            for (t, (nodes, element)) in cells.nodes.iter().zip(cells.elements).enumerate() {
                let (local, d) = (cells.gather(t, u), self.d(body, t));
                let mut sums = cells.gather(t, &force);
                for (point, zeta) in element.points.iter().zip(&mut zeta) {
                    let stress = d * point.strain(&local) * *zeta;
                    for (sum, [fx, fy]) in sums.iter_mut().zip(point.force(&stress)) {
                        *sum = [sum[0] + fx, sum[1] + fy];
                    }
                }
                for (node, [fx, fy]) in nodes.iter().zip(sums) {
                    (force[2 * node], force[2 * node + 1]) = (fx, fy);
                }
            }
        });
        force
    }

    /// The rounding error of these forces, ε_machine Σ |K_T||u| over the elements T of a node, N per metre of thickness
    /// (Oettli and Prager, Numer. Math. 6, 1964).
    pub(crate) fn force_rounding(&self, body: &Body, zeta: &[f64], u: &[f64]) -> Vec<f64> {
        let mut rounding = vec![0.0; u.len()];
        for_elements!(body, cells => {
            let mut zeta = zeta.iter();
            for (t, (nodes, element)) in cells.nodes.iter().zip(cells.elements).enumerate() {
                let local = cells.gather(t, u).map(|[x, y]| Vector2::new(x.abs(), y.abs()));
                for (point, zeta) in element.points.iter().zip(&mut zeta) {
                    let unit = f64::EPSILON * zeta.abs();
                    for (i, &node) in nodes.iter().enumerate() {
                        for (j, u) in local.iter().enumerate() {
                            let force = point.stiffness(self.d(body, t), i, j).abs() * u;
                            rounding[2 * node] += unit * force[0];
                            rounding[2 * node + 1] += unit * force[1];
                        }
                    }
                }
            }
        });
        rounding
    }

    /// a(u, u) on the elements that belong to this rank, twice their energy, N m per metre of thickness.
    pub(crate) fn energy(&self, body: &Body, zeta: &[f64], u: &[f64]) -> f64 {
        let energies = self.energies(body, zeta, u);
        energies[..body.points_per_triangle() * body.own_triangles].iter().sum()
    }
}
