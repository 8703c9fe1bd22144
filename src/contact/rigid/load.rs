//! Whether a load drives the motions that prescribed displacements do not hold.

use super::{DrivenMotion, Mover, PartMotion, RigidMotion, RigidMotions, Unheld};
use crate::{contact::nonnegative::nonnegative, fem::Body};
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

impl RigidMotions {
    /// Checks that `load` (nodal forces) does no work on free motions and can be balanced by
    /// contact forces p ≥ 0 on the resisted ones: the nearest such forces leave no remainder
    /// (Farkas; the remainder itself is the motion that the load drives).
    pub fn check(&self, body: &Body, load: &[f64]) -> Result<(), DrivenMotion> {
        if self.held() {
            return Ok(());
        }
        let sums = self.resultants(body, |i| [load[2 * i], load[2 * i + 1]]);
        let all: f64 = sums.iter().map(|sum| sum[3]).sum();
        for piece in &self.unheld {
            let size: f64 = piece.parts.iter().map(|&part| sums[part][3]).sum();
            if size <= UNLOADED * all {
                continue;
            }
            let mut free = self.free[piece.free.clone()].iter();
            if let Some(motion) = free.find(|m| m.work(&sums).abs() > BALANCED * size) {
                return Err(self.driven(piece, motion.clone(), &sums));
            }
            let resisted = &self.resisted[piece.resisted.clone()];
            let work = DVector::from_fn(resisted.len(), |i, _| resisted[i].work(&sums));
            let remainder = &work - piece.normal.transpose() * nonnegative(&piece.normal, &work);
            if remainder.norm() > REMAINDER * size {
                let motion = sum(resisted, remainder.normalize().as_slice());
                return Err(self.driven(piece, motion, &sums));
            }
        }
        Ok(())
    }

    /// The work of `load` (nodal forces) on the motions that only contact holds.
    pub fn work(&self, body: &Body, load: &[f64]) -> DVector<f64> {
        if self.resisted.is_empty() {
            return DVector::zeros(0);
        }
        let sums = self.resultants(body, |i| [load[2 * i], load[2 * i + 1]]);
        DVector::from_fn(self.resisted.len(), |i, _| self.resisted[i].work(&sums))
    }

    /// The resultants of nodal forces on all parts.
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

    fn driven(&self, piece: &Unheld, motion: RigidMotion, sums: &[Resultant]) -> DrivenMotion {
        let [x, y] = motion.largest().map_or([0.0; 2], |largest| largest.centre);
        let [mut fx, mut fy, mut moment, mut size] = [0.0; 4];
        for &part in &piece.parts {
            let ([cx, cy], [px, py, turn, all]) = (self.parts[part].centre, sums[part]);
            (fx, fy, size) = (fx + px, fy + py, size + all);
            moment += turn + (cx - x) * py - (cy - y) * px;
        }
        let force = [fx, fy].map(|f| if f.abs() > ROUNDING * size { f } else { 0.0 });
        DrivenMotion { motion, force, moment, pieces: self.pieces }
    }

    /// The motion with these shares (a unit vector) of those that only contact holds. Where it
    /// moves several pieces, what it does to the one that moves most, which is as little held.
    pub fn combined(&self, shares: &DVector<f64>) -> RigidMotion {
        let subdomain = |piece: &Unheld| &shares.as_slice()[piece.resisted.clone()];
        let square = |piece: &Unheld| subdomain(piece).iter().map(|c| c * c).sum::<f64>();
        match self.unheld.iter().max_by(|a, b| square(a).total_cmp(&square(b))) {
            Some(piece) => sum(&self.resisted[piece.resisted.clone()], subdomain(piece)),
            None => RigidMotion { parts: Vec::new(), mover: Mover::Body },
        }
    }
}

impl RigidMotion {
    /// The work of forces with these resultants on all parts.
    pub(super) fn work(&self, sums: &[Resultant]) -> f64 {
        let part = |motion: &PartMotion| {
            let [fx, fy, moment, _] = sums[motion.part];
            let [ax, ay] = motion.translation;
            ax * fx + ay * fy + motion.rotation * moment
        };
        self.parts.iter().map(part).sum()
    }
}

/// Σ share·motion of motions of one piece.
fn sum(motions: &[RigidMotion], shares: &[f64]) -> RigidMotion {
    let mut pairs = motions.iter().zip(shares);
    let Some((first, subdomain)) = pairs.next() else {
        return RigidMotion { parts: Vec::new(), mover: Mover::Body };
    };
    let mut sum = first.clone();
    sum.parts.iter_mut().for_each(|part| part.scale(*subdomain));
    for (motion, subdomain) in pairs {
        sum.parts.iter_mut().zip(&motion.parts).for_each(|(part, more)| part.add(*subdomain, more));
    }
    sum
}
