//! A small convergence study: n = 4, 8, 16 against n = 32.

use signorini::{
    petsc::Session,
    study::{MEASURES, Plan, converge},
};

#[test]
fn orders_in_h_are_those_of_the_theory_for_a_mildly_singular_solution() {
    let folder = tempfile::tempdir().unwrap();
    let plan = Plan { cells: 32, grading: 1.0, step: 0.005 };
    let session = Session::start(&[]).unwrap();
    plan.compute(&session, folder.path(), &mut |_| ()).unwrap();
    let reference = plan.load(folder.path()).unwrap();
    let study = converge(&session, &reference, &mut |_, _| ()).unwrap();
    assert_eq!((study.cells(), study.steps()), (vec![4, 8, 16], vec![0.02, 0.01]));
    let [sum, strain, gradient, zeta, zeta_gradient] =
        MEASURES.map(|(name, measure, _)| (name, study.order_in_h(measure)));
    // First order in H¹, a little less at the corners, a little more for the reference's own
    // error; ζ in L² up to second.
    for (name, order) in [sum, strain, gradient, zeta_gradient] {
        assert!((0.7..1.2).contains(&order), "{name}: {order}");
    }
    assert!((1.3..2.1).contains(&zeta.1), "{}: {}", zeta.0, zeta.1);
    // Euler's error in ζ is of first order: it halves with k, from a positive part.
    assert!(study.growth_in_k(MEASURES[3].1) > 0.0);
    for row in &study.rows {
        assert!((row.sum - row.strain - row.zeta).abs() <= 1e-12, "largest at the same time");
        assert!(row.strain <= row.gradient * (1.0 + 1e-12), "|ε| ≤ |∇u|: {row:?}");
    }
}
