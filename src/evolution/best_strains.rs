//! Strains as a much finer mesh would have them, from the displacements of both orders.
//!
//! With the estimated error η of u₂ in the energy norm, where errors are orthogonal to what is resolved and
//! squares add up,
//!
//! |ε*|² = |ε(u₂)|² + c (|ε(u₂)|² − |ε(u₁)|²), c = η²/‖u₂ − u₁‖²,
//!
//! or c = 1 where ζ_* was reached: it is at singular points, where both orders converge alike.

use super::{RunError, State, both_orders::BothOrders};
use crate::fem::{RecoveredStrains, mean_product, strains_at_nodes};
use nalgebra::Vector3;
use std::array;

/// The strains of the states of a run.
pub(super) struct BestStrains<'a> {
    orders: BothOrders<'a>,
    stopped: bool,
    c: f64,
    /// ‖u₂ − u₁‖² for which c was found, N m per metre of thickness.
    distance: f64,
}

/// c is found again where ‖u₂ − u₁‖² has changed by more than this factor.
const CHANGE: f64 = 1.2;

impl<'a> BestStrains<'a> {
    /// Of a run that may have `stopped` at ζ_*.
    pub(super) fn new(orders: BothOrders<'a>, stopped: bool) -> Self {
        Self { orders, stopped, c: 1.0, distance: 0.0 }
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
        let strains = || strains_at_nodes(body, &u1).zip(strains_at_nodes(&fine.body, &u2));
        let distance = strains().take(body.own_triangles).enumerate().map(|(t, (e1, e2))| {
            let difference: [Vector3<f64>; 6] = array::from_fn(|i| e2[i] - e1[i]);
            let stress = difference.map(|strain| coarse.elasticity.d(body, t) * strain);
            let zeta = body.mesh.triangles[t].map(|node| state.zeta[node]);
            let mean = zeta.iter().sum::<f64>() / 3.0;
            mean * body.triangles[t].area() * mean_product(&difference, &stress, Vector3::dot)
        });
        let distance = body.nodes.partition.comm().total(distance.sum());
        let near = self.distance / CHANGE..=self.distance * CHANGE;
        if !self.stopped && !near.contains(&distance) {
            let recovered = RecoveredStrains::new(&fine.body, &u2)?;
            let zeta = fine.zeta_at_points(&state.zeta);
            let error = recovered.energy_error(&fine.elasticity, &zeta, &u2).error;
            (self.c, self.distance) = ((error / distance).min(1.0), distance);
        }
        let square = |e: &Vector3<f64>| e[0] * e[0] + e[1] * e[1] + 0.5 * e[2] * e[2];
        let best = |e1: Vector3<f64>, e2: Vector3<f64>| {
            let [s1, s2] = [square(&e1), square(&e2)];
            (s2 + self.c * (s2 - s1)).max(0.0)
        };
        let of_triangle = strains().map(|(e1, e2)| array::from_fn(|i| best(e1[i], e2[i])));
        Ok(Some(of_triangle.collect()))
    }
}
