//! Whether a load drives the motions that prescribed displacements leave.

use super::{PartMotion, RigidMotion, RigidMotions, nonnegative::nonnegative};
use crate::fem::Body;
use nalgebra::DVector;
use std::ops::Range;

/// Of nodal forces on a part: f_x, f_y, the moment about the part's centre, Σ|f|.
pub(super) type Resultant = [f64; 4];

/// Work of a load on a free motion that may be rounding, relative to Σ|f| on the piece.
const BALANCED: f64 = 1e-9;
/// The same where contact forces balance it.
const REMAINDER: f64 = 1e-8;
/// A piece that carries less than this of all the load carries rounding.
const UNLOADED: f64 = 1e-14;
/// A component of the resultant below this, relative to Σ|f|, is shown as zero.
const ROUNDING: f64 = 1e-12;

/// The load does work on a rigid motion that nothing prevents.
#[derive(Debug, Clone, thiserror::Error)]
#[error(
    "{}nothing supports {} against {}, and the load drives it (resultant ({:.4e}, {:.4e}) N/m, \
     moment about its centre {moment:.4e} N): support it by a `displacement`, a `symmetry` axis or a \
     `gap`, or balance the load",
    disjoint(motion), motion.what_moves(), motion.largest(), force[0], force[1]
)]
pub struct DrivenMotion {
    /// The motion.
    pub motion: RigidMotion,
    /// The load's resultant on what moves and hangs on it, N per metre of thickness.
    pub force: [f64; 2],
    /// The load's moment about the centre of what moves, N m per metre of thickness.
    pub moment: f64,
}

fn disjoint(motion: &RigidMotion) -> String {
    match (motion.parts.len(), motion.pieces) {
        (1, 1) => String::new(),
        (1, n) => format!("the mesh has {n} pieces (gmsh: Coherence joins those that touch); "),
        _ => "parts of the mesh meet in single nodes only; ".to_owned(),
    }
}

impl RigidMotions {
    /// Checks that `load` (nodal forces, N) does no work on free motions, as exactly as the normals of
    /// the mesh determine these, and can be balanced by
    /// contact forces on the resisted ones: with N the u·ν of these and w the work on them, that
    /// min ‖Nᵀp − w‖ over p ≥ 0 is 0 (Farkas; the remainder itself is a motion that the load
    /// drives and contact allows).
    ///
    /// # Errors
    /// The load drives a motion, which the error names.
    pub fn check(&self, body: &Body, load: &[f64]) -> Result<(), DrivenMotion> {
        if self.all_prevented() {
            return Ok(());
        }
        let sums = self.resultants(body, |i| [load[2 * i], load[2 * i + 1]]);
        let total: f64 = sums.iter().map(|sum| sum[3]).sum();
        // Σ|f| on the piece of a motion, if it is not rounding.
        let loaded = |motion: &RigidMotion| {
            let sum: f64 = motion.parts.iter().map(|part| sums[part.part][3]).sum();
            (sum > UNLOADED * total).then_some(sum)
        };
        for (motion, error) in self.free.iter().zip(&self.free_errors) {
            let balanced = BALANCED + error;
            if loaded(motion).is_some_and(|sum| motion.work(&sums).abs() > balanced * sum) {
                return Err(self.driven(motion.clone(), &sums));
            }
        }
        for (places, motions) in self.resisted_by_piece() {
            let Some(sum) = loaded(&motions[0]) else { continue };
            let normal = self.normal.columns_range(places).into_owned();
            let work = DVector::from_fn(motions.len(), |i, _| motions[i].work(&sums));
            let remainder = &work - normal.transpose() * nonnegative(&normal, &work);
            if remainder.norm() > REMAINDER * sum {
                let motion = RigidMotion::combination(motions, remainder.normalize().as_slice());
                return Err(self.driven(motion, &sums));
            }
        }
        Ok(())
    }

    /// The work of `load` (nodal forces, N) on the motions that contact alone constrains.
    pub fn work(&self, body: &Body, load: &[f64]) -> DVector<f64> {
        if self.resisted.is_empty() {
            return DVector::zeros(0);
        }
        let sums = self.resultants(body, |i| [load[2 * i], load[2 * i + 1]]);
        DVector::from_fn(self.resisted.len(), |i, _| self.resisted[i].work(&sums))
    }

    /// The resultants of nodal forces on all parts. Collective.
    pub(super) fn resultants(
        &self,
        body: &Body,
        force: impl Fn(usize) -> [f64; 2],
    ) -> Vec<Resultant> {
        let mut sums = vec![[0.0; 4]; self.parts.len()];
        for node in 0..body.nodes.partition.owned() {
            let part = self.part_of_node[node];
            let ([x, y], [cx, cy]) = (body.nodes.points[node], self.parts[part].centre);
            let [fx, fy] = force(node);
            let more = [fx, fy, (x - cx) * fy - (y - cy) * fx, fx.hypot(fy)];
            sums[part].iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        }
        body.nodes.partition.comm().sum(sums.as_flattened_mut());
        sums
    }

    fn driven(&self, motion: RigidMotion, sums: &[Resultant]) -> DrivenMotion {
        let [x, y] = motion.largest().centre;
        let [mut fx, mut fy, mut moment, mut total] = [0.0; 4];
        for &PartMotion { part, centre: [cx, cy], .. } in &motion.parts {
            let [px, py, turn, all] = sums[part];
            (fx, fy, total) = (fx + px, fy + py, total + all);
            moment += turn + (cx - x) * py - (cy - y) * px;
        }
        let force = [fx, fy].map(|f| if f.abs() > ROUNDING * total { f } else { 0.0 });
        DrivenMotion { motion, force, moment }
    }

    /// Σ a_i m_i of the motions m_i that contact alone resists, with these amplitudes a (a unit vector),
    /// on the one piece of the body whose motions have the largest.
    pub fn combined(&self, amplitudes: &DVector<f64>) -> Option<RigidMotion> {
        let of_piece = |(places, motions): (Range<usize>, _)| {
            let own = &amplitudes.as_slice()[places];
            (own.iter().map(|c| c * c).sum::<f64>(), own, motions)
        };
        let pieces = self.resisted_by_piece().map(of_piece);
        let most = pieces.max_by(|a, b| a.0.total_cmp(&b.0));
        most.map(|(_, own, motions)| RigidMotion::combination(motions, own))
    }
}

impl RigidMotion {
    /// The work of forces with these resultants on all parts, a·F + θM.
    pub(super) fn work(&self, sums: &[Resultant]) -> f64 {
        let part = |motion: &PartMotion| {
            let [fx, fy, moment, _] = sums[motion.part];
            let [ax, ay] = motion.translation;
            ax * fx + ay * fy + motion.rotation * moment
        };
        self.parts.iter().map(part).sum()
    }
}
