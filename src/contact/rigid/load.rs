//! Whether a load drives the motions that prescribed displacements leave.

use super::{Extent, MovablePiece, RigidMotion, RigidMotions, nonnegative::nonnegative};
use crate::fem::Body;
use nalgebra::DVector;

/// Of nodal forces on a part: f_x, f_y, the moment about the part's centre, Σ|f|.
pub(super) type Resultant = [f64; 4];

/// Work of a load on a free motion that may be rounding, relative to Σ|f| on the piece.
const BALANCED: f64 = 1e-9;
/// The same where contact forces balance it.
const REMAINDER: f64 = 1e-8;
/// A piece that carries less than this of all the load carries rounding.
const UNLOADED: f64 = 1e-14;
/// A component of the resultant below this, relative to Σ|f|, is not told.
const ROUNDING: f64 = 1e-12;

/// The load does work on a rigid motion that nothing prevents.
#[derive(Debug, Clone, thiserror::Error)]
#[error(
    "{}nothing holds {} against {}, and the load drives it (resultant ({:.4e}, {:.4e}) N/m, \
     moment about its centre {moment:.4e} N): hold it by a `displacement`, a `symmetry` axis or a `gap`, \
     or balance the load",
    disjoint(*pieces, motion.extent), motion.what_moves(), motion.how_it_moves(), force[0], force[1]
)]
pub struct DrivenMotion {
    /// The motion.
    pub motion: RigidMotion,
    /// The load's resultant on what moves and hangs on it, N per metre of thickness.
    pub force: [f64; 2],
    /// The load's moment about the centre of what moves, N m per metre of thickness.
    pub moment: f64,
    /// Number of pieces of the mesh.
    pub pieces: usize,
}

fn disjoint(pieces: usize, extent: Extent) -> String {
    match (pieces, extent) {
        (_, Extent::Parts) => "parts of the mesh meet in single nodes only; ".to_owned(),
        (1, _) => String::new(),
        _ => format!("the mesh has {pieces} pieces (gmsh: Coherence joins those that touch); "),
    }
}

impl RigidMotions {
    /// Checks that `load` (nodal forces, N) does no work on free motions and can be balanced by
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
        for piece in &self.movable {
            let sum: f64 = piece.parts.iter().map(|&part| sums[part][3]).sum();
            if sum <= UNLOADED * total {
                continue;
            }
            let mut free = self.free[piece.free.clone()].iter();
            if let Some(motion) = free.find(|m| m.work(&sums).abs() > BALANCED * sum) {
                return Err(self.driven(piece, motion.clone(), &sums));
            }
            let resisted = &self.resisted[piece.resisted.clone()];
            let work = DVector::from_fn(resisted.len(), |i, _| resisted[i].work(&sums));
            let remainder = &work - piece.normal.transpose() * nonnegative(&piece.normal, &work);
            if remainder.norm() > REMAINDER * sum {
                let motion = RigidMotion::combination(resisted, remainder.normalize().as_slice());
                return Err(self.driven(piece, motion, &sums));
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
        for node in 0..body.partition.owned() {
            let part = self.part_of_node[node];
            let ([x, y], [cx, cy]) = (body.mesh.nodes[node], self.parts[part].centre);
            let [fx, fy] = force(node);
            let more = [fx, fy, (x - cx) * fy - (y - cy) * fx, fx.hypot(fy)];
            sums[part].iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        }
        body.partition.comm().sum(sums.as_flattened_mut());
        sums
    }

    fn driven(
        &self,
        piece: &MovablePiece,
        motion: RigidMotion,
        sums: &[Resultant],
    ) -> DrivenMotion {
        let [x, y] = motion.largest().map_or([0.0; 2], |largest| largest.centre);
        let [mut fx, mut fy, mut moment, mut total] = [0.0; 4];
        for &part in &piece.parts {
            let ([cx, cy], [px, py, turn, all]) = (self.parts[part].centre, sums[part]);
            (fx, fy, total) = (fx + px, fy + py, total + all);
            moment += turn + (cx - x) * py - (cy - y) * px;
        }
        let force = [fx, fy].map(|f| if f.abs() > ROUNDING * total { f } else { 0.0 });
        DrivenMotion { motion, force, moment, pieces: self.pieces }
    }

    /// The motion with these amplitudes (a unit vector) of those that contact alone constrains.
    /// Where it moves several pieces, what it does to the one that moves most.
    pub fn combined(&self, amplitudes: &DVector<f64>) -> RigidMotion {
        let own = |piece: &MovablePiece| &amplitudes.as_slice()[piece.resisted.clone()];
        let square = |piece: &MovablePiece| own(piece).iter().map(|c| c * c).sum::<f64>();
        let most = self.movable.iter().max_by(|a, b| square(a).total_cmp(&square(b)));
        most.map_or_else(RigidMotion::default, |piece| {
            RigidMotion::combination(&self.resisted[piece.resisted.clone()], own(piece))
        })
    }
}

impl RigidMotion {
    /// The work of forces with these resultants on all parts, a·F + θM.
    pub(super) fn work(&self, sums: &[Resultant]) -> f64 {
        let part = |motion: &super::PartMotion| {
            let [fx, fy, moment, _] = sums[motion.part];
            let [ax, ay] = motion.translation;
            ax * fx + ay * fy + motion.rotation * moment
        };
        self.parts.iter().map(part).sum()
    }
}
