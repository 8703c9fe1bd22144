//! Strains as a much finer mesh would have them, from the displacements of both orders.
//!
//! With the estimated error η of u₂ in the energy norm, where errors are orthogonal to what is resolved and
//! squares add up,
//!
//! |ε*|² = |ε(u₂)|² + c (|ε(u₂)|² − |ε(u₁)|²), c = η²/‖u₂ − u₁‖²,
//!
//! or c = 1 where ζ_* was reached: it is at singular points, where both orders converge alike.

use super::{RunError, State, both_orders::BothOrders};
use crate::fem::{RecoveredStrains, strains_at_nodes};
use nalgebra::Vector3;
use std::array;

/// The strains of the states of a run.
pub(super) struct BestStrains<'a> {
    orders: BothOrders<'a>,
    stopped: bool,
    c: f64,
    /// ‖u₂ − u₁‖²/‖u₁‖² for which c was found.
    relative: f64,
}

/// c is found again where ‖u₂ − u₁‖²/‖u₁‖² has changed by more than this factor.
const CHANGE: f64 = 1.5;

impl<'a> BestStrains<'a> {
    /// Of a run that may have `stopped` at ζ_*.
    pub(super) fn new(orders: BothOrders<'a>, stopped: bool) -> Self {
        Self { orders, stopped, c: 1.0, relative: 0.0 }
    }

    /// |ε*|² at the vertices and midpoints of each triangle; `None` where the active nodes do not support
    /// the body. Collective.
    ///
    /// # Errors
    /// PETSc failed, or the scene contradicts itself at the nodes of the other order.
    pub(super) fn squared(&mut self, state: &State) -> Result<Option<Vec<[f64; 6]>>, RunError> {
        let Some([u1, u2]) = self.orders.displacements(state)? else { return Ok(None) };
        let [coarse, fine] = self.orders.problems();
        let body = &coarse.body;
        let square = |e: Vector3<f64>| e[0] * e[0] + e[1] * e[1] + 0.5 * e[2] * e[2];
        let mut squares = Vec::with_capacity(body.triangles.len());
        // ‖u₂ − u₁‖² and ‖u₁‖².
        let mut energies = [0.0; 2];
        let strains = strains_at_nodes(body, &u1).zip(strains_at_nodes(&fine.body, &u2));
        for (t, (e1, e2)) in strains.enumerate() {
            if t < body.own_triangles {
                // The strains are affine: the midpoints integrate their products.
                let d = coarse.elasticity.d(body, t);
                let zeta = body.mesh.triangles[t].map(|node| state.zeta[node]);
                let weight = zeta.iter().sum::<f64>() / 9.0 * body.triangles[t].area();
                for i in 3..6 {
                    let strains = [e2[i] - e1[i], e1[i]];
                    let sums = energies.iter_mut().zip(strains);
                    sums.for_each(|(sum, e)| *sum += weight * e.dot(&(d * e)));
                }
            }
            squares.push([e1.map(square), e2.map(square)]);
        }
        body.nodes.partition.comm().sum(&mut energies);
        let [distance, energy] = energies;
        let near = self.relative / CHANGE..=self.relative * CHANGE;
        if !self.stopped && !near.contains(&(distance / energy)) {
            let recovered = RecoveredStrains::new(&fine.body, &u2)?;
            let zeta = fine.zeta_at_points(&state.zeta);
            let error = recovered.energy_error(&fine.elasticity, &zeta, &u2).error;
            (self.c, self.relative) = ((error / distance).min(1.0), distance / energy);
        }
        let best = |s1: f64, s2: f64| (s2 + self.c * (s2 - s1)).max(0.0);
        let of_triangle = |[s1, s2]: [[f64; 6]; 2]| array::from_fn(|i| best(s1[i], s2[i]));
        Ok(Some(squares.into_iter().map(of_triangle).collect()))
    }
}
