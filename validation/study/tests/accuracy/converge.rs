//! Small convergence studies: three meshes against the next finer one.

use super::{Study, options};
use signorini::petsc::Session;
use signorini_study::{Convergence, MEASURES, ReferenceOptions, ReferenceSpec, converge};

fn run(study: &Study, spec: &ReferenceSpec) -> Convergence {
    study.compute(spec);
    let session = Session::start(&[]).unwrap();
    converge(&session, &study.load(spec), &mut |_, _| ()).unwrap()
}

#[test]
fn orders_in_h_are_those_of_the_theory_for_a_mildly_singular_solution() {
    let study = Study::of("square-mild", "square.geo");
    let uniform = ReferenceOptions { grading: Some(1.0), ..options(0.25, 3, 0.005) };
    let study = run(&study, &study.spec(uniform));
    assert_eq!((study.meshes().len(), study.steps()), (3, vec![0.02, 0.01, 0.005]));
    assert!(study.rows.iter().all(|row| row.printed.is_none()), "the numbers of another scene");
    let [sum, nodal, strain, gradient, zeta, zeta_gradient] =
        MEASURES.map(|(name, measure, _)| (name, study.order_in_h(measure)));
    // First order in H¹, a little less at the corners, a little more for the reference's own
    // error; ζ in L² up to second.
    for (name, order) in [sum, strain, gradient, zeta_gradient] {
        assert!((0.7..1.2).contains(&order), "{name}: {order}");
    }
    // So does u at the nodes of nested meshes, nearer to its interpolant than to u itself.
    for (name, order) in [nodal, zeta] {
        assert!((1.2..2.1).contains(&order), "{name}: {order}");
    }
    // Euler's error in ζ is of first order: it halves with k, from a positive part.
    assert!(study.growth_in_k(MEASURES[4].1) > 0.0);
    for row in &study.rows {
        assert!((row.sum - row.strain - row.zeta).abs() <= 1e-12, "largest at the same time");
        assert!(row.strain <= row.gradient * (1.0 + 1e-12), "|ε| ≤ |∇u|: {row:?}");
    }
}

/// The rows of Table 1 that a reference of n = 32 leaves room for: n = 4 and 8.
#[test]
fn example_i_pushed_level_with_half_the_force_has_the_errors_of_table_1() {
    let study = Study::of("square-table1", "square.geo");
    let spec = study.spec(options(0.25, 3, 0.001));
    let study = run(&study, &spec);
    let rows: Vec<_> = study.rows.iter().filter(|row| row.refinements < 2).collect();
    assert_eq!(rows.len(), 10, "n = 4 and 8, k = 0.02, 0.01, 0.005, 0.002 and 0.001");
    // The reference's own error takes its part: against n = 256 the ratios are 0.98 to 1.10.
    for row in &rows {
        let ratio = row.sum / row.printed.unwrap();
        assert!((0.8..1.2).contains(&ratio), "{row:?}: {ratio}");
    }
    // Here the damage depends on k, as in the paper.
    assert!(study.growth_in_k(MEASURES[4].1) > 0.05);
}

/// Meshes that gmsh made without a structure, refined; a body with a re-entrant corner.
#[test]
fn errors_fall_on_the_nested_meshes_of_any_scene() {
    let study = Study::of("lshape", "lshape.geo");
    let study =
        run(&study, &study.spec(ReferenceOptions { grading: Some(1.0), ..options(2.0, 3, 0.01) }));
    assert!(study.rows.iter().all(|row| row.printed.is_none()), "no numbers of the paper");
    for (name, measure, _) in MEASURES {
        let order = study.order_in_h(measure);
        assert!((0.4..2.0).contains(&order), "{name}: {order}");
    }
    for pair in study.meshes().windows(2) {
        assert!((pair[0] / pair[1] - 2.0).abs() < 1e-12, "h halves");
    }
}
