//! Whether a load drives the motions that prescribed displacements leave.

use super::{RigidMotions, nonnegative::nonnegative};
use crate::fem::{Body, RigidMotion, resultant};
use nalgebra::DVector;

/// Work of a load on a free motion that may be rounding, relative to Σ|f|.
const BALANCED: f64 = 1e-9;
/// The same where contact forces balance it.
const REMAINDER: f64 = 1e-8;
/// A component of the resultant below this, relative to Σ|f|, is shown as zero.
const ROUNDING: f64 = 1e-12;

/// The load does work on a rigid motion that nothing prevents.
#[derive(Debug, Clone, thiserror::Error)]
#[error(
    "nothing supports the body against {motion}, and the load drives it (resultant ({:.4e}, {:.4e}) N/m, \
     moment about its centre {moment:.4e} N): support it by a `displacement`, a `symmetry` axis or a \
     `gap`, or balance the load",
    force[0], force[1]
)]
pub struct DrivenMotion {
    /// The motion.
    pub motion: RigidMotion,
    /// The load's resultant, N per metre of thickness.
    pub force: [f64; 2],
    /// The load's moment about the centroid of the body, N m per metre of thickness.
    pub moment: f64,
}

impl RigidMotions {
    /// Checks that `load` (nodal forces, N) does no work on free motions, as exactly as the normals of
    /// the mesh determine these, and can be balanced by
    /// contact forces on the resisted ones: with N the u·ν of these and w the work on them, that
    /// min ‖Nᵀp − w‖ over p ≥ 0 is 0 (Farkas; the remainder itself is a motion that the load
    /// drives and contact allows). Collective.
    ///
    /// # Errors
    /// The load drives a motion, which the error names.
    pub fn check(&self, body: &Body, load: &[f64]) -> Result<(), DrivenMotion> {
        if self.all_prevented() {
            return Ok(());
        }
        let (forces, partition) = (load.as_chunks::<2>().0, &body.nodes.partition);
        let sums = resultant(body, |i| forces[i]);
        let own = forces[..partition.owned()].iter().map(|[x, y]| x.hypot(*y));
        let total = partition.comm().total(own.sum());
        let driven = |motion| {
            let [fx, fy, moment] = sums;
            let force = [fx, fy].map(|f| if f.abs() > ROUNDING * total { f } else { 0.0 });
            Err(DrivenMotion { motion, force, moment })
        };
        for (motion, error) in self.free.iter().zip(&self.free_errors) {
            if motion.work(sums).abs() > (BALANCED + error) * total {
                return driven(*motion);
            }
        }
        let work = self.work(body, |i| forces[i]);
        let remainder = &work - self.normal.transpose() * nonnegative(&self.normal, &work);
        if remainder.norm() > REMAINDER * total {
            return driven(self.combined(body, &remainder.normalize()));
        }
        Ok(())
    }

    /// The work of nodal forces, N, on the motions that contact alone constrains. Collective.
    pub fn work(&self, body: &Body, force: impl Fn(usize) -> [f64; 2]) -> DVector<f64> {
        if self.resisted.is_empty() {
            return DVector::zeros(0);
        }
        let sums = resultant(body, force);
        DVector::from_fn(self.resisted.len(), |i, _| self.resisted[i].work(sums))
    }
}
