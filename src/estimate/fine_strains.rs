//! Estimated strains on a much finer mesh, from the displacements u₁ in P1 and u₂ in P2.
//!
//! In the energy norm, errors are orthogonal to the mesh functions; squares add up. With the estimated error η of
//! u₂,
//!
//! |ε*|² = |ε(u₂)|² + c (|ε(u₂)|² − |ε(u₁)|²), c = η²/‖u₂ − u₁‖², but at most 1.
//!
//! A run reaches ζ_* at a singular point, where both orders converge at the same rate; then c = 1.

use super::{
    order_pair::OrderPair,
    recovery::{RecoveredStrains, strains_at_nodes},
};
use crate::{evolution::RunError, problem::State};
use nalgebra::{Vector3, Vector6};

/// The strains of the states of a run.
pub(super) struct FineStrains<'a> {
    pair: OrderPair<'a>,
    /// Did the run stop at ζ_*?
    stopped: bool,
    /// c, and ‖u₂ − u₁‖²/‖u₁‖² at the state for which c was computed.
    c: f64,
    relative: f64,
}

/// c is computed again when ‖u₂ − u₁‖²/‖u₁‖² has changed by more than this factor.
const CHANGE: f64 = 1.5;

impl<'a> FineStrains<'a> {
    pub(super) fn new(pair: OrderPair<'a>, stopped: bool) -> Self {
        Self { pair, stopped, c: 1.0, relative: 0.0 }
    }

    /// |ε*|² at the six nodes of each triangle. `None` if the active nodes do not support the body. Collective.
    ///
    /// # Errors
    /// PETSc failed, or the scene contradicts itself at the nodes of the other order.
    pub(super) fn squared(&mut self, state: &State) -> Result<Option<Vec<Vector6<f64>>>, RunError> {
        let Some([u1, u2]) = self.pair.displacements(state)? else { return Ok(None) };
        let [coarse, fine] = self.pair.problems();
        let body = &coarse.body;
        let square = |e: Vector3<f64>| e[0] * e[0] + e[1] * e[1] + 0.5 * e[2] * e[2];
        let mut squares = Vec::with_capacity(body.triangles.len());
        // ‖u₂ − u₁‖² and ‖u₁‖².
        let mut energies = [0.0; 2];
        let strains = strains_at_nodes(body, &u1).zip(strains_at_nodes(&fine.body, &u2));
        for (t, (e1, e2)) in strains.enumerate() {
            if t < body.own_triangles {
                // Strains are affine, so the midpoints integrate their products exactly.
                let d = coarse.elasticity.d(body, t);
                let zeta = body.mesh.triangles[t].map(|node| state.zeta[node]);
                let weight = zeta.iter().sum::<f64>() / 9.0 * body.triangles[t].area();
                for (sum, e) in (3..6).flat_map(|i| [(0, e2[i] - e1[i]), (1, e1[i])]) {
                    energies[sum] += weight * e.dot(&(d * e));
                }
            }
            squares.push([e1, e2].map(|e| Vector6::from(e.map(square))));
        }
        body.nodes.partition.comm().sum(&mut energies);
        let relative = energies[0] / energies[1];
        let near = self.relative / CHANGE..=self.relative * CHANGE;
        if !self.stopped && !near.contains(&relative) {
            let recovered = RecoveredStrains::new(&fine.body, &u2)?;
            let zeta = fine.zeta_at_points(&state.zeta);
            let error = recovered.energy_error(&fine.elasticity, &zeta, &u2).error;
            (self.c, self.relative) = ((error / energies[0]).min(1.0), relative);
        }
        let c = self.c;
        let fine = |[s1, s2]: [Vector6<f64>; 2]| (s2 + c * (s2 - s1)).map(|square| square.max(0.0));
        Ok(Some(squares.into_iter().map(fine).collect()))
    }
}
