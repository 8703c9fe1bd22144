//! The rigid motion of a body that contact alone constrains, until contact stops it.

use super::null_space;
use crate::{ROUNDING, contact::Bound, petsc::Communicator};
use nalgebra::{DMatrix, DVector};

/// The orthonormal combinations of rigid motions that the `active` bounds allow: the null space of the rows
/// of `rigid` at active bounds. `rigid` has u·ν at the bounds, a column per motion. The entry of `active` is
/// 1 at an active upper bound, −1 at an active lower one, else 0. Collective.
pub(crate) fn unconstrained_motions(
    comm: Communicator,
    rigid: &DMatrix<f64>,
    active: &[f64],
) -> Vec<DVector<f64>> {
    let motions = rigid.ncols();
    if motions == 0 {
        return Vec::new();
    }
    let rows = rigid.row_iter().zip(active).filter(|(_, side)| **side != 0.0);
    let mut gram =
        rows.fold(DMatrix::zeros(motions, motions), |sum, (row, _)| sum + row.transpose() * row);
    comm.sum(gram.as_mut_slice());
    null_space(gram, 1e-10 * comm.total(rigid.norm_squared()))
}

/// Moves the body as the load drives it, with fixed u·ν at the `active` bounds, until it reaches a further
/// bound. This bound becomes active. The function repeats this until no rigid motion remains. `c` is the
/// start at the bounds, `rigid` has u·ν of the motions there, a column each, and `work` the load's work on
/// them. Returns the amplitude of each motion, m. Collective.
///
/// If the load drives none of the remaining motions, the body stays. With `undriven` it takes one of them. Rounding may
/// then decide its direction, so the body turns back if no bound lies ahead.
pub(crate) fn rigid_motion_until_contact(
    comm: Communicator,
    (rigid, work): (&DMatrix<f64>, &DVector<f64>),
    bounds: &[Bound],
    c: &[f64],
    active: &mut [f64],
    undriven: bool,
) -> DVector<f64> {
    let mut amplitudes = DVector::zeros(rigid.ncols());
    loop {
        let left = unconstrained_motions(comm, rigid, active);
        let Some(any) = left.first() else { return amplitudes };
        let driven = left.iter().map(|m| m * m.dot(work)).sum::<DVector<f64>>();
        let motion = match driven.amax() > ROUNDING * work.amax() {
            true => driven.normalize(),
            false if undriven => any.normalize(),
            false => return amplitudes,
        };
        let gone = rigid * &amplitudes;
        let ways = [motion.clone(), -motion];
        let stopped = ways.into_iter().take(1 + usize::from(undriven)).find_map(|motion| {
            let speed = rigid * &motion;
            let fastest = comm.max(speed.amax());
            let distance = |i: usize| {
                let value = if speed[i] > 0.0 { bounds[i].upper } else { bounds[i].lower };
                (i, (value - c[i] - gone[i]) / speed[i])
            };
            let moving = |i: &usize| active[*i] == 0.0 && speed[*i].abs() > 1e-6 * fastest;
            let nearest = (0..bounds.len())
                .filter(moving)
                .map(distance)
                .filter(|(_, distance)| distance.is_finite())
                .min_by(|a, b| a.1.total_cmp(&b.1));
            let (distance, rank) = comm.min_with_rank(nearest.map_or(f64::INFINITY, |(_, d)| d));
            let own = nearest.filter(|_| rank == comm.rank()).map(|(i, _)| (i, speed[i].signum()));
            (distance < f64::INFINITY).then_some((distance * motion, own))
        });
        let Some((step, own)) = stopped else { return amplitudes };
        amplitudes += step;
        if let Some((i, side)) = own {
            active[i] = side;
        }
    }
}
