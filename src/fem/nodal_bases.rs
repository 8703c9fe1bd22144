//! Local bases at constrained nodes, so that every constraint concerns one unknown.

use super::Subdomain;
use nalgebra::{Matrix2, Vector2};

/// At some nodes the unknowns are c = D u with the rows of D the constrained directions
/// (u·d_1, u·d_2), elsewhere c = u. Some unknowns are fixed: prescribed, not solved for.
///
/// D need not be orthogonal (a corner of Γ_C has two normals), so forces transform with
/// D⁻ᵀ: a force r does the work r·u = (D⁻ᵀr)·c.
#[derive(Debug, Clone)]
pub struct NodalBases {
    /// Node, D and D⁻¹.
    bases: Vec<(usize, Matrix2<f64>, Matrix2<f64>)>,
    /// The place of each node in `bases`.
    place: Vec<u32>,
    fixed: Vec<bool>,
}

/// The place of a node with c = u.
const IDENTITY: u32 = u32::MAX;

impl NodalBases {
    /// The identity at each of `nodes` nodes, nothing fixed.
    pub fn identity(nodes: usize) -> Self {
        Self { bases: Vec::new(), place: vec![IDENTITY; nodes], fixed: vec![false; 2 * nodes] }
    }

    /// The bases at the nodes of a subdomain.
    pub(crate) fn restrict(&self, subdomain: &Subdomain) -> Self {
        let fixed = subdomain.field(&self.fixed, 2);
        let mut restricted = Self { place: vec![IDENTITY; fixed.len() / 2], bases: vec![], fixed };
        for &(node, directions, inverse) in &self.bases {
            if let Some(node) = subdomain.local(node) {
                restricted.add(node, directions, inverse);
            }
        }
        restricted
    }

    /// Makes the rows of `directions` the basis at `node`; `None` if they are dependent.
    #[must_use]
    pub fn set(&mut self, node: usize, directions: Matrix2<f64>) -> Option<()> {
        self.add(node, directions, directions.try_inverse()?);
        Some(())
    }

    fn add(&mut self, node: usize, directions: Matrix2<f64>, inverse: Matrix2<f64>) {
        let basis = (node, directions, inverse);
        match self.bases.get_mut(self.place[node] as usize) {
            Some(earlier) => *earlier = basis,
            None => {
                self.place[node] = self.bases.len() as u32;
                self.bases.push(basis);
            }
        }
    }

    /// Fixes unknown `dof` (2·node + component).
    pub fn fix(&mut self, dof: usize) {
        self.fixed[dof] = true;
    }

    /// Whether each unknown is fixed.
    pub fn fixed(&self) -> &[bool] {
        &self.fixed
    }

    /// Sets the entries of the fixed unknowns to 0, in place.
    pub fn zero_fixed(&self, field: &mut [f64]) {
        field.iter_mut().zip(&self.fixed).filter(|(_, on)| **on).for_each(|(v, _)| *v = 0.0);
    }

    /// D⁻¹ at `node`, unless it is the identity: u = D⁻¹ c.
    pub fn inverse(&self, node: usize) -> Option<&Matrix2<f64>> {
        self.bases.get(self.place[node] as usize).map(|(_, _, inverse)| inverse)
    }

    /// The row of D that belongs to unknown `dof`.
    pub fn direction(&self, dof: usize) -> [f64; 2] {
        let at = self.bases.get(self.place[dof / 2] as usize);
        let d = at.map_or_else(Matrix2::identity, |&(_, d, _)| d);
        [d[(dof % 2, 0)], d[(dof % 2, 1)]]
    }

    /// c = D u, in place.
    pub fn displacement_to_local(&self, field: &mut [f64]) {
        self.transform(field, |d, _| *d);
    }

    /// u = D⁻¹ c, in place.
    pub fn displacement_to_global(&self, field: &mut [f64]) {
        self.transform(field, |_, inverse| *inverse);
    }

    /// Forces conjugate to c from forces conjugate to u: D⁻ᵀ r, in place.
    pub fn force_to_local(&self, field: &mut [f64]) {
        self.transform(field, |_, inverse| inverse.transpose());
    }

    fn transform(
        &self,
        field: &mut [f64],
        matrix: impl Fn(&Matrix2<f64>, &Matrix2<f64>) -> Matrix2<f64>,
    ) {
        for (node, d, inverse) in &self.bases {
            let v = matrix(d, inverse) * Vector2::new(field[2 * node], field[2 * node + 1]);
            field[2 * node] = v[0];
            field[2 * node + 1] = v[1];
        }
    }
}
