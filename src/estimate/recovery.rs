//! Recovered strains, to estimate the discretisation error of displacements.

use crate::{
    fem::{Body, Elasticity, Fits},
    petsc::PetscError,
};
use nalgebra::{Matrix6, Matrix6x3, Vector3};

/// An estimate of the error of u in the energy norm, ‖v‖² = vᵀKv. The error is that of the strains.
#[derive(Debug, Clone)]
pub struct EnergyError {
    /// ‖ε* − ε(u)‖² on each triangle that belongs to this rank, N m per metre of thickness.
    pub squares: Vec<f64>,
    /// The sum of these squares and ‖u‖², over the undivided body.
    pub error: f64,
    /// See `error`.
    pub energy: f64,
}

impl EnergyError {
    /// The error relative to the energy norm of u.
    pub fn relative(&self) -> f64 {
        if self.error == 0.0 { 0.0 } else { (self.error / self.energy).sqrt() }
    }
}

/// Strains recovered from nodal u (Zienkiewicz and Zhu, Int. J. Numer. Meth. Eng. 33, 1992:
/// superconvergent patch recovery), from the fits of `Patches`. At a vertex ε* is the value of its fit, and at a
/// midpoint the mean of the fits of both ends.
pub struct RecoveredStrains<'a> {
    body: &'a Body,
    u: &'a [f64],
    /// Per material: the fits of the vertices.
    fits: Vec<Fits>,
}

impl<'a> RecoveredStrains<'a> {
    /// Recovers the strains of nodal u. Collective.
    ///
    /// # Errors
    /// PETSc failed.
    pub fn new(body: &'a Body, u: &'a [f64]) -> Result<Self, PetscError> {
        let fits = body.patches().fits(&body.strains(u), Some(&body.vertices.partition))?;
        Ok(Self { body, u, fits })
    }

    /// Estimates the error of u in the energy norm; `zeta` is ζ at the quadrature points. Collective.
    pub fn energy_error(&self, elasticity: &Elasticity, zeta: &[f64], u: &[f64]) -> EnergyError {
        let (body, per_triangle) = (self.body, self.body.points_per_triangle());
        let square = |t: usize| {
            let own = per_triangle * t..per_triangle * (t + 1);
            let mean = zeta[own].iter().sum::<f64>() / per_triangle as f64;
            // ∫ e_i e_j of the components of e = ε* − ε(u).
            let difference = self.difference(t).map(|strain| strain.transpose());
            let difference = Matrix6x3::from_rows(&difference);
            let products = difference.transpose() * mass() * difference;
            mean * body.triangles[t].area() * elasticity.d(body, t).dot(&products)
        };
        let squares: Vec<f64> = (0..body.own_triangles).map(square).collect();
        let mut sums = [squares.iter().sum(), elasticity.energy(body, zeta, u)];
        body.comm().sum(&mut sums);
        EnergyError { squares, error: sums[0], energy: sums[1] }
    }

    /// ε* − ε(u) on triangle `t`, at the vertices and the midpoints of the sides 01, 12, 20.
    pub(super) fn difference(&self, t: usize) -> [Vector3<f64>; 6] {
        let (body, triangle) = (self.body, self.body.mesh.triangles[t]);
        let fits = &self.fits[body.material(t)];
        let computed = body.nodal_strains(t, self.u);
        let recovered = |i: usize, [x, y]: [f64; 2]| {
            let [vx, vy] = body.mesh.nodes[triangle[i]];
            fits.value(triangle[i], [x - vx, y - vy])
        };
        let vertex = |i: usize| recovered(i, body.mesh.nodes[triangle[i]]) - computed[i];
        let middle = |i: usize, j: usize| {
            let Some(nodes) = body.quadratic_nodes() else { return 0.5 * (vertex(i) + vertex(j)) };
            let x = body.nodes.points[nodes[t][3 + i]];
            0.5 * (recovered(i, x) + recovered(j, x)) - computed[3 + i]
        };
        [vertex(0), vertex(1), vertex(2), middle(0, 1), middle(1, 2), middle(2, 0)]
    }
}

/// ∫ N_i N_j / |T| of the quadratic shape functions on a straight triangle: of the vertices, and of the midpoints of
/// the sides 01, 12, 20.
pub(crate) fn mass() -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| match (i.min(j), i.max(j)) {
        (i, j) if i == j => [6.0, 32.0][i / 3],
        (..3, ..3) => -1.0,
        // The side with the midpoint j does not end at the vertex i.
        (i, j @ 3..) if i == (j - 1) % 3 => -4.0,
        (..3, _) => 0.0,
        _ => 16.0,
    }) / 180.0
}
