//! The residuals that judge every answer: each fault shows in its own figure and no other, and a
//! fault of the unknowns that a solver works with cannot hide.

use crate::support::{close, close_relative, difference, problem, run, square, try_run};
use nalgebra::Matrix2;
use signorini::{
    contact::{Answer, Certificate, ContactPoint, Kkt, NodalConstraint, RowLaw, SOLVERS, Scales},
    evolution::ObservedProblem,
    petsc::Communicator,
};

const SCALES: Scales = Scales { force: 10.0, displacement: 2.0 };

fn gap(node: usize, direction: [f64; 2]) -> NodalConstraint {
    NodalConstraint { node, direction, law: RowLaw::Rigid { tributary_length: 1.0 } }
}

/// Judges u and f − Ku at two nodes: u_x of node 0 is prescribed (2), node 0 presses with 6 at its
/// gap along y, node 1 gapes by 0.5.
fn judge(change: impl Fn(&mut [f64], &mut [f64])) -> (Kkt, Vec<ContactPoint>) {
    let (mut unbalanced, mut u) = (vec![0.0, 6.0, 0.0, 0.0], vec![2.0, 0.25, -1.0, 0.5]);
    change(&mut unbalanced, &mut u);
    let fixed = NodalConstraint { node: 0, direction: [1.0, 0.0], law: RowLaw::Prescribed };
    let rows = [fixed, gap(0, [0.0, 1.0]), gap(1, [0.0, 1.0])];
    let values = &[2.0, 0.25, 1.0];
    let answer = Answer { rigid: &[], elastic: &u, unbalanced: &unbalanced, values };
    let (kkt, [points, _]) =
        Certificate::new(&rows).residuals(answer, 2, SCALES, Communicator::serial());
    (kkt, points)
}

#[test]
fn a_solution_has_no_residual() {
    let (kkt, points) = judge(|_, _| {});
    assert_eq!(kkt, Kkt::default());
    assert_eq!(
        points.iter().map(|p| (p.force, p.gap)).collect::<Vec<_>>(),
        [(6.0, 0.0), (0.0, 0.5)]
    );
    assert_eq!(points.iter().map(|p| p.active).collect::<Vec<_>>(), [true, false]);
    // Forces along a prescribed direction are no fault.
    assert_eq!(judge(|force, _| force[0] = 1e3).0, Kkt::default());
}

#[test]
fn each_fault_shows_in_its_own_residual_and_no_other() {
    let residuals = |change: &dyn Fn(&mut [f64], &mut [f64])| judge(change).0;
    let of = Kkt::default;
    // An unbalanced force, an overlap of node 1, a prescribed value that is missed, a pull at node 0.
    assert_eq!(residuals(&|force, _| force[2] = 0.3), Kkt { stationarity: 0.03, ..of() });
    assert_eq!(residuals(&|_, u| u[3] = 1.25), Kkt { primal: 0.125, ..of() });
    assert_eq!(residuals(&|_, u| u[0] = 2.5), Kkt { primal: 0.25, ..of() });
    assert_eq!(residuals(&|force, _| force[1] = -2.0), Kkt { dual: 0.2, ..of() });
}

#[test]
fn a_force_across_a_gap_is_judged_by_the_smaller_of_both_whatever_the_other_is() {
    // 0.8 of 10 across 0.5 of 2.
    let (kkt, _) = judge(|force, _| force[3] = 0.8);
    close_relative(kkt.complementarity, 0.08, 1e-15);
    assert_eq!((kkt.stationarity, kkt.primal, kkt.dual), (0.0, 0.0, 0.0));
    // A wider gap makes a small force no worse, a larger force a small gap no worse.
    let (kkt, _) = judge(|force, u| (force[3], u[3]) = (0.8, -1e9));
    close_relative(kkt.complementarity, 0.08, 1e-15);
    let (kkt, _) = judge(|force, u| (force[3], u[3]) = (1e9, 1.0 - 1e-3));
    close_relative(kkt.complementarity, 5e-4, 1e-12);
}

#[test]
fn a_force_in_the_cone_of_a_corners_normals_is_carried_and_no_other() {
    let normals = [[0.0, -1.0], [0.6, -0.8], [0.0, 1.0]];
    let force_of = |shares: [f64; 3]| {
        let along = |k: usize| (0..3).map(|i| shares[i] * normals[i][k]).sum();
        [along(0), along(1)]
    };
    let judged = |force: [f64; 2]| {
        let gaps = normals.map(|normal| gap(0, normal));
        let answer =
            Answer { rigid: &[], elastic: &[0.0, 0.0], unbalanced: &force, values: &[0.0; 3] };
        Certificate::new(&gaps).residuals(answer, 1, SCALES, Communicator::serial())
    };
    for shares in [[3.0, 2.0, 0.0], [0.0, 2.0, 1.0], [0.0, 0.0, 5.0], [4.0, 0.0, 0.0]] {
        let (kkt, [points, _]) = judged(force_of(shares));
        assert!(kkt.within(1e-15), "{kkt}");
        points.iter().zip(shares).for_each(|(point, share)| close(point.force, share, 1e-13));
    }
    // The nearest that the cone has to (−1, 0) is nothing.
    close_relative(judged([-1.0, 0.0]).0.dual, 0.1, 1e-15);
}

/// Comparisons and extremes drop a NaN; the residuals, their parts and the worst ones of a run keep it.
#[test]
fn what_is_not_a_number_stays_in_every_residual() {
    let nan = f64::NAN;
    for (force, left) in [(nan, 0.0), (0.0, nan), (nan, 1.0), (1.0, nan), (nan, nan)] {
        assert!(SCALES.natural(force, left).is_nan(), "natural({force}, {left})");
    }
    let good = Kkt::default();
    for kkt in [
        Kkt { stationarity: nan, ..good },
        Kkt { primal: nan, ..good },
        Kkt { dual: nan, ..good },
        Kkt { complementarity: nan, ..good },
    ] {
        for worst in [kkt.max(&good), good.max(&kkt)] {
            assert!(worst.worst().is_nan() && !worst.within(1e300), "{worst}");
        }
    }
}

#[test]
fn what_is_not_a_number_is_never_within_a_tolerance() {
    for fault in 0..4 {
        let (kkt, _) = judge(|force, _| force[fault] = f64::NAN);
        assert!(!kkt.within(1e300) && kkt.worst().is_nan(), "force {fault}: {kkt}");
    }
    for fault in [0, 1, 3] {
        let (kkt, _) = judge(|_, u| u[fault] = f64::NAN);
        assert!(!kkt.within(1e300) && kkt.worst().is_nan(), "displacement {fault}: {kkt}");
    }
}

/// A turned square on a foundation, pressed on its right half and pulled on its left.
fn turned() -> ObservedProblem {
    let text = "
        material = { young = 100, poisson = 0.3, plane = 'stress' }
        boundary = [
            { name = 'left', displacement = [0, 0] },
            { name = 'bottom', gap = '0.01*x', normal = [0.6, -0.8] },
            { name = 'top', traction = ['5', '8-20*x'] },
        ]";
    problem(square(6), text).unwrap()
}

/// What is done to a discrete problem, in words and in deed.
type Fault<'a> = (&'static str, &'a dyn Fn(&mut ObservedProblem));

#[test]
fn a_fault_in_bases_or_bounds_cannot_certify_itself() {
    for solver in SOLVERS {
        let right = run(&turned(), solver).last.state;
        assert!(right.contact.iter().any(|p| p.active) && right.contact.iter().any(|p| !p.active));
        let active = right.contact.iter().position(|p| p.active).unwrap();
        let node = right.contact[active].node;
        let faults: [Fault; 4] = [
            ("a bound is forgotten", &|s| {
                s.constraints.bounds.retain(|bound| bound.node != node);
            }),
            ("bounds are on the tangential displacements", &|s| {
                s.constraints.bounds.iter_mut().for_each(|bound| bound.dof ^= 1);
            }),
            ("a free unknown is taken for a prescribed one", &|s| {
                s.constraints.bases.fix(2 * node + 1);
            }),
            ("a basis is lost, so that the bound is one on u_x", &|s| {
                s.constraints.bases.set(node, Matrix2::identity()).unwrap();
            }),
        ];
        for (fault, plant) in faults {
            let mut faulty = turned();
            plant(&mut faulty);
            match try_run(&faulty, solver) {
                Err(error) => assert!(error.to_string().contains("tolerance"), "{fault}: {error}"),
                Ok(outcome) => {
                    let off = difference(&outcome.last.state.u, &right.u);
                    panic!("{solver} certified an answer {off:.1e} off: {fault}");
                }
            }
        }
    }
}
