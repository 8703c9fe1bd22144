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
    directions: Vec<(usize, Matrix2<f64>, Matrix2<f64>)>,
    index: Vec<u32>,
    fixed: Vec<bool>,
}

const IDENTITY: u32 = u32::MAX;

impl NodalBases {
    /// The identity at each of `nodes` nodes, nothing fixed.
    pub fn identity(nodes: usize) -> Self {
        Self { directions: Vec::new(), index: vec![IDENTITY; nodes], fixed: vec![false; 2 * nodes] }
    }

    /// The frames of the nodes of a rank's share.
    pub(crate) fn restrict(&self, subdomain: &Subdomain) -> Self {
        let mut bases = Self {
            directions: Vec::new(),
            index: subdomain.field(&vec![IDENTITY; self.index.len()], 1),
            fixed: subdomain.field(&self.fixed, 2),
        };
        for (node, directions, inverse) in &self.directions {
            if let Some(node) = subdomain.local(*node) {
                bases.add(node, *directions, *inverse);
            }
        }
        bases
    }

    /// Makes the rows of `directions` the basis at `node`; `None` if they are dependent.
    #[must_use]
    pub fn set(&mut self, node: usize, directions: Matrix2<f64>) -> Option<()> {
        self.add(node, directions, directions.try_inverse()?);
        Some(())
    }

    fn add(&mut self, node: usize, directions: Matrix2<f64>, inverse: Matrix2<f64>) {
        self.index[node] = self.directions.len() as u32;
        self.directions.push((node, directions, inverse));
    }

    /// Takes unknown `dof` (2·node + component) out of the system.
    pub fn fix(&mut self, dof: usize) {
        self.fixed[dof] = true;
    }

    /// Whether each unknown is fixed.
    pub fn fixed(&self) -> &[bool] {
        &self.fixed
    }

    /// D⁻¹ at `node`, unless it is the identity: u = D⁻¹ c.
    pub fn inverse(&self, node: usize) -> Option<&Matrix2<f64>> {
        self.directions.get(self.index[node] as usize).map(|(_, _, inverse)| inverse)
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
        for (node, d, inverse) in &self.directions {
            let v = matrix(d, inverse) * Vector2::new(field[2 * node], field[2 * node + 1]);
            field[2 * node] = v[0];
            field[2 * node + 1] = v[1];
        }
    }
}
