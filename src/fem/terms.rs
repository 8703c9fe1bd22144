//! The terms of K: the parts of the virtual work in (26) that are linear in u.

use super::{Body, Elasticity, Subdomain};
use crate::model::Material;
use nalgebra::Matrix2;
use std::iter::once;

/// A term a(u, v) of the virtual work of the internal forces. It adds a(φ_i, φ_j) to K_ij.
///
/// Solvers use [`Self::sums`]. The certificate and the error estimates use the other methods, which share no code with
/// it. `zeta` are the values of ζ at the quadrature points, [`Body::at_points`].
pub(crate) trait Term {
    /// The number N of nodes of an element, and the nodes of all elements, N in turn for each.
    fn nodes<'a>(&'a self, body: &'a Body) -> (usize, &'a [usize]);

    /// The term for solvers, with ζ = 0.
    fn sums(&self, body: &Body) -> Box<dyn ElementSums>;

    /// Adds the internal forces F_i = a(u, φ_i) of nodal u, N per metre of thickness.
    fn add_force(&self, body: &Body, zeta: &[f64], u: &[f64], force: &mut [f64]);

    /// Adds the rounding error of these forces, ε_machine Σ |K_T||u| over the elements T of a node, N per metre of
    /// thickness (Oettli and Prager, Numer. Math. 6, 1964).
    fn add_force_rounding(&self, body: &Body, zeta: &[f64], u: &[f64], rounding: &mut [f64]);

    /// a(u, u) on the elements that belong to this rank, twice their energy, N m per metre of thickness.
    fn energy(&self, body: &Body, zeta: &[f64], u: &[f64]) -> f64;

    /// Nodes i with directions d. A rigid motion has energy if and only if it has u_i·d ≠ 0 for one of them.
    fn resists(&self) -> Vec<(usize, [f64; 2])>;
}

/// Sums over the elements of a term, in displacements without nodal bases.
pub(crate) trait ElementSums {
    /// Takes ζ at the quadrature points.
    fn set(&mut self, body: &Body, zeta: &[f64]);

    /// Adds the internal forces of `u` to `force`.
    fn add_forces(&self, u: &[f64], force: &mut [f64]);

    /// Adds K_xx, K_xy and K_yy of each node with itself.
    fn add_diagonal(&self, diagonal: &mut [[f64; 3]]);

    /// Calls `add` for the pairs of nodes (i, j), j ≤ i, of every element: the numbers of (i, j) and of (j, i) among
    /// all pairs, the nodes, and K_ij. Element e has the pairs N² e to N² (e + 1), row by row.
    fn for_blocks(&self, add: &mut dyn FnMut([usize; 2], [usize; 2], Matrix2<f64>));

    /// The memory of these data, bytes.
    fn bytes(&self) -> usize;
}

/// All terms of K. The operator, the certificate, the energy and the rigid motions walk this list.
#[derive(Debug, Clone, Default)]
pub struct Terms {
    /// ∫ ζ Aε(u) : ε(v).
    pub elasticity: Elasticity,
}

impl Terms {
    /// The terms of a body of undamaged `materials`, at least one, as they are numbered in [`Body::materials`].
    pub fn new(materials: impl IntoIterator<Item = Material>) -> Self {
        Self { elasticity: Elasticity::new(materials) }
    }

    /// The list.
    pub(super) fn all(&self) -> impl Iterator<Item = &dyn Term> + Clone {
        let Self { elasticity } = self;
        once(elasticity as &dyn Term)
    }

    /// The terms on the subdomain of a rank. (The body has the triangles of the elasticity.)
    pub(crate) fn restrict(self, _: &Subdomain) -> Self {
        let Self { elasticity } = self;
        Self { elasticity }
    }

    /// The internal forces Ku of nodal u, by the code of the certificate.
    pub fn internal_force(&self, body: &Body, zeta: &[f64], u: &[f64]) -> Vec<f64> {
        let mut force = vec![0.0; u.len()];
        self.all().for_each(|term| term.add_force(body, zeta, u, &mut force));
        force
    }

    /// The rounding error of these forces.
    pub(crate) fn force_rounding(&self, body: &Body, zeta: &[f64], u: &[f64]) -> Vec<f64> {
        let mut rounding = vec![0.0; u.len()];
        self.all().for_each(|term| term.add_force_rounding(body, zeta, u, &mut rounding));
        rounding
    }

    /// uᵀKu, this rank's part.
    pub(crate) fn energy(&self, body: &Body, zeta: &[f64], u: &[f64]) -> f64 {
        self.all().map(|term| term.energy(body, zeta, u)).sum()
    }

    /// The nodes and directions of [`Term::resists`], on the undivided body.
    pub(crate) fn resist(&self) -> impl Iterator<Item = (usize, [f64; 2])> {
        self.all().flat_map(Term::resists)
    }
}
