//! The residuals that judge every answer: each fault shows in its own figure and no other.

use crate::support::close_to;
use signorini::{
    contact::{Bound, Kkt},
    petsc::Ranks,
};

/// Four unknowns with bounds on 1 and 3, forces in units of 10 and displacements of 2:
/// unknown 1 presses with 6 at its gap, 3 gapes by 0.5.
fn judge(change: impl Fn(&mut [f64], &mut [f64])) -> Kkt {
    let bound =
        |dof: usize, gap: f64| Bound { dof, node: dof / 2, normal: [0.0, 1.0], gap, weight: 1.0 };
    // The residual Ku − f is minus the contact force.
    let (mut residual, mut c) = (vec![0.0, -6.0, 0.0, 0.0], vec![2.0, 0.25, -1.0, 0.5]);
    change(&mut residual, &mut c);
    Kkt::of(
        &residual,
        &c,
        &[bound(1, 0.25), bound(3, 1.0)],
        |dof| dof == 0,
        10.0,
        2.0,
        Ranks::alone(),
    )
}

#[test]
fn a_solution_has_no_residual() {
    assert_eq!(judge(|_, _| {}), Kkt::default());
    // Forces that hold a prescribed unknown are no fault.
    assert_eq!(judge(|residual, _| residual[0] = 1e3), Kkt::default());
}

#[test]
fn a_free_unknown_out_of_balance_shows_in_stationarity() {
    let kkt = judge(|residual, _| residual[2] = 0.3);
    assert_eq!(kkt, Kkt { stationarity: 0.03, ..Kkt::default() });
}

#[test]
fn an_overlap_shows_in_the_primal_residual() {
    // Unknown 3, without force: its overlap alone counts.
    let kkt = judge(|_, c| c[3] = 1.25);
    assert_eq!(kkt, Kkt { primal: 0.125, ..Kkt::default() });
}

#[test]
fn a_pull_shows_in_the_dual_residual() {
    // At a closed gap, so that it does no complementary work.
    let kkt = judge(|residual, _| residual[1] = 2.0);
    assert_eq!(kkt, Kkt { dual: 0.2, ..Kkt::default() });
}

#[test]
fn a_force_across_a_gap_shows_in_complementarity() {
    // 0.8 over 0.5, relative to 10 · 2; overlap times force counts as well.
    let kkt = judge(|residual, _| residual[3] = -0.8);
    close_to(kkt.complementarity, 0.02, 1e-15);
    assert_eq!((kkt.stationarity, kkt.primal, kkt.dual), (0.0, 0.0, 0.0));
    let kkt = judge(|_, c| c[1] = 0.35);
    close_to(kkt.complementarity, 0.03, 1e-14);
    close_to(kkt.primal, 0.05, 1e-14);
}

#[test]
fn what_is_not_a_number_is_never_within_a_tolerance() {
    for fault in 0..4 {
        let kkt = judge(|residual, _| residual[fault] = f64::NAN);
        assert_eq!(kkt.within(1e300), fault == 0, "residual {fault}: {kkt}");
        assert_eq!(kkt.worst().is_nan(), fault != 0, "residual {fault}: {kkt}");
    }
    for fault in [1, 3] {
        let kkt = judge(|_, c| c[fault] = f64::NAN);
        assert!(!kkt.within(1e300) && kkt.worst().is_nan(), "unknown {fault}: {kkt}");
    }
}
