//! The elements of u, of either order.

use super::element::Element;
use nalgebra::{Matrix2, Vector3};

/// Elements with N nodes and Q quadrature points, one per triangle of the mesh.
#[derive(Debug, Clone, Copy)]
pub struct Cells<'a, const N: usize, const Q: usize> {
    /// The nodes of each element.
    pub nodes: &'a [[usize; N]],
    /// The elements.
    pub elements: &'a [Element<N, Q>],
}

/// The elements of u.
#[derive(Debug, Clone, Copy)]
pub enum Elements<'a> {
    /// P1.
    Linear(Cells<'a, 3, 1>),
    /// P2.
    Quadratic(Cells<'a, 6, 3>),
}

/// Evaluates an expression of `cells` for the elements of a body, whatever their order.
macro_rules! for_elements {
    ($body:expr, $cells:ident => $value:expr) => {
        match $body.elements() {
            $crate::fem::Elements::Linear($cells) => $value,
            $crate::fem::Elements::Quadratic($cells) => $value,
        }
    };
}
pub(crate) use for_elements;

impl<'a, const N: usize, const Q: usize> Cells<'a, N, Q> {
    /// N and the nodes of all elements, N in turn for each.
    pub(crate) fn flat_nodes(self) -> (usize, &'a [usize]) {
        (N, self.nodes.as_flattened())
    }

    /// The displacements of the nodes of element `t`.
    #[inline(always)]
    pub fn gather(&self, t: usize, u: &[f64]) -> [[f64; 2]; N] {
        self.nodes[t].map(|node| [u[2 * node], u[2 * node + 1]])
    }

    /// ∇u at the first quadrature point of each triangle.
    pub fn gradients(&self, u: &[f64]) -> Vec<Matrix2<f64>> {
        let elements = self.elements.iter().enumerate();
        elements.map(|(t, element)| element.points[0].gradient(&self.gather(t, u))).collect()
    }

    /// Values of a function of the triangle and the strain (ε_xx, ε_yy, 2ε_xy) of nodal u, at all quadrature
    /// points, triangle by triangle.
    #[inline(always)]
    pub fn strains<T>(&self, u: &[f64], of: impl Fn(usize, Vector3<f64>) -> T) -> Vec<T> {
        let mut values = Vec::with_capacity(Q * self.elements.len());
        for (t, element) in self.elements.iter().enumerate() {
            let local = self.gather(t, u);
            for point in &element.points {
                values.push(of(t, point.strain(&local)));
            }
        }
        values
    }
}
