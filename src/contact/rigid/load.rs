//! Checks whether a load drives a rigid motion without support.

use super::{RigidMotions, nonnegative::nonnegative};
use crate::{
    ROUNDING,
    fem::{Body, RigidMotion, resultant},
};
use nalgebra::DVector;

/// Relative to Σ|f|: work of a load on a motion without support up to this is rounding.
const BALANCED: f64 = 1e-8;
/// The error of a load's resultant is at most this many times its estimate: the curve through coarse edges is not exact.
const OVER_ESTIMATE: f64 = 2.0;

/// The load does work on a rigid motion without support.
#[derive(Debug, Clone, thiserror::Error)]
#[error(
    "nothing supports the body against {motion}, and the load drives it (resultant ({:.4e}, {:.4e}), \
     moment about the centroid of the body {moment:.4e}): support it by a `displacement`, a `symmetry` axis or a \
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
    /// Checks two conditions on `load` (nodal forces, N). It does no work on free motions, within the accuracy of the
    /// normals of the mesh and of the load: `error` is the estimated error of its resultant, and another one relative to
    /// Σ|f|. Contact forces can balance it on the resisted motions: min ‖Nᵀp − w‖ over p ≥ 0 is 0, with u·ν of the
    /// motions in N and the work on them in w. Otherwise the remainder is a motion that the load drives and contact
    /// allows (lemma of Farkas). Collective.
    ///
    /// # Errors
    /// The load drives a motion; the error names it.
    pub fn check(
        &self,
        body: &Body,
        load: &[f64],
        error: impl Fn() -> ([f64; 3], f64),
    ) -> Result<(), DrivenMotion> {
        if self.all_prevented() {
            return Ok(());
        }
        let (forces, partition) = (load.as_chunks::<2>().0, &body.nodes.partition);
        let sums = resultant(body, |i| forces[i]);
        let own = forces[..partition.owned()].iter().map(|[x, y]| x.hypot(*y));
        let total = partition.comm().total(own.sum());
        let driven = |motion| {
            let [fx, fy, moment] = sums;
            // A smaller component is shown as zero.
            let force = [fx, fy].map(|f| if f.abs() > ROUNDING * total { f } else { 0.0 });
            Err(DrivenMotion { motion, force, moment })
        };
        for (motion, of_normals) in self.free.iter().zip(&self.free_errors) {
            let work = motion.work(sums).abs() - (BALANCED + of_normals) * total;
            if work > 0.0 {
                let (of_load, relative) = error();
                if work > OVER_ESTIMATE * motion.work(of_load).abs() + relative * total {
                    return driven(*motion);
                }
            }
        }
        let work = self.work(body, |i| forces[i]);
        let remainder = &work - self.normal.transpose() * nonnegative(&self.normal, &work);
        if remainder.norm() > BALANCED * total {
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
