//! The way that a load drives a body until contact supports it.

use super::{Bound, problem::unheld};
use crate::petsc::Communicator;
use nalgebra::{DMatrix, DVector};

/// A rigid motion of a body that only contact supports, and the bounds it ends at.
pub(crate) struct Approach {
    /// How far along each of the motions, m.
    pub(crate) amplitudes: DVector<f64>,
    /// The bounds reached on this rank, and whether it is their upper side.
    pub(crate) reached: Vec<(usize, bool)>,
    /// Whether the active and the reached bounds support the body.
    pub(crate) supported: bool,
}

/// Work on a motion below this part of the load's work on all is rounding.
const ROUNDING: f64 = 1e-12;

/// Lets the body move from c, with u_ν kept at the `active` bounds, as the load drives it until it
/// reaches a further bound, and again until it is supported. `rigid` are the u_ν of its motions at
/// the bounds, a column each, `work` that of the load on them. Collective.
///
/// Where the load drives none of the motions left, the body stays, or if it is to be supported,
/// `whatever` drives it, any motion does.
pub(crate) fn approach(
    comm: Communicator,
    (rigid, work): (&DMatrix<f64>, &DVector<f64>),
    bounds: &[Bound],
    c: &[f64],
    mut active: Vec<bool>,
    whatever: bool,
) -> Approach {
    let mut amplitudes = DVector::zeros(rigid.ncols());
    let mut reached = Vec::new();
    loop {
        let left = unheld(comm, rigid, &active);
        let Some(any) = left.first() else {
            return Approach { amplitudes, reached, supported: true };
        };
        let driven = left.iter().map(|m| m * m.dot(work)).sum::<DVector<f64>>();
        let motion = match driven.amax() > ROUNDING * work.amax() {
            true => driven.normalize(),
            false if whatever => any.normalize(),
            false => return Approach { amplitudes, reached, supported: false },
        };
        let (speed, gone) = (rigid * &motion, rigid * &amplitudes);
        let most = comm.max(speed.iter().fold(0.0, |m: f64, v| m.max(v.abs())));
        let way = |i: usize| {
            let bound = &bounds[i];
            let value = if speed[i] > 0.0 { bound.upper } else { bound.lower };
            (i, (value - c[bound.dof] - gone[i]) / speed[i])
        };
        let moving = |i: &usize| !active[*i] && speed[*i].abs() > 1e-6 * most;
        let ways = (0..bounds.len()).filter(moving).map(way).filter(|way| way.1.is_finite());
        let nearest = ways.min_by(|a, b| a.1.total_cmp(&b.1));
        let (way, rank) = comm.min_with_rank(nearest.map_or(f64::INFINITY, |(_, way)| way));
        if way == f64::INFINITY {
            return Approach { amplitudes, reached, supported: false };
        }
        amplitudes += way * motion;
        if let Some((i, _)) = nearest.filter(|_| rank == comm.rank()) {
            active[i] = true;
            reached.push((i, speed[i] > 0.0));
        }
    }
}
