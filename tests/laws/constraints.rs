//! Conditions that meet at one node.

use crate::support::{problem, run, square};
use signorini::{
    contact::{Conflict, ConstraintError, Constraints, NodalConstraint, RowLaw, SOLVERS},
    evolution::SetupError,
    mesh::{BoundaryFace, Mesh, joined_faces},
};

const MATERIAL: &str = "material = { young = 100, poisson = 0.3, plane = 'stress' }";

/// A square with these boundaries.
fn bounded(boundaries: &str) -> Result<signorini::evolution::ObservedProblem, SetupError> {
    problem(square(4), &format!("{MATERIAL}\n{boundaries}"))
}

fn constraint_error(boundaries: &str) -> ConstraintError {
    match bounded(boundaries) {
        Err(SetupError::Constraint { source, .. }) => source,
        other => panic!("{other:?}"),
    }
}

fn node(mesh: &Mesh, place: [f64; 2]) -> usize {
    mesh.nodes.iter().position(|x| *x == place).unwrap()
}

#[test]
fn a_prescribed_node_on_the_contact_boundary_keeps_its_value() {
    // Node (0, 0) is lifted by 0.01 with the left side; the bottom next to it touches.
    for solver in SOLVERS {
        let problem = bounded(
            "boundary = [
                { name = 'left', displacement = [0.02, 0.01] },
                { name = 'bottom', gap = 0 },
                { name = 'top', traction = [0, -50] },
             ]",
        )
        .unwrap();
        let last = run(&problem, solver).last;
        for [a, b] in &problem.body.mesh.curves["left"].edges {
            for node in [a, b] {
                assert_eq!(last.state.u[2 * node..2 * node + 2], [0.02, 0.01]);
            }
        }
        // It is no contact node: it counts in no reaction.
        let prescribed = node(&problem.body.mesh, [0.0, 0.0]);
        assert_eq!(last.state.contact.len(), 4);
        assert!(last.state.contact.iter().all(|point| point.node != prescribed));
        assert!(last.record.active_nodes > 0);
    }
}

#[test]
fn a_node_prescribed_across_the_normal_still_meets_the_foundation() {
    // Horizontal displacement prescribed at the left only: (0, 0) may slide down to the gap.
    for solver in SOLVERS {
        let problem = bounded(
            "boundary = [
                { name = 'left', displacement = [0.02, 'free'] },
                { name = 'bottom', gap = 0.1 },
                { name = 'top', traction = [0, -5] },
             ]",
        )
        .unwrap();
        let state = run(&problem, solver).last.state;
        let corner = node(&problem.body.mesh, [0.0, 0.0]);
        assert_eq!(state.u[2 * corner], 0.02);
        assert!((state.u[2 * corner + 1] + 0.1).abs() < 1e-12);
        assert_eq!(state.contact.len(), 5);
    }
}

#[test]
fn a_prescribed_value_through_the_gap_is_an_error() {
    let scene = |displacement: &str, gap: &str| {
        format!(
            "time = {{ end = 1, step = 0.25 }}
             boundary = [
                {{ name = 'left', displacement = [0, {displacement}] }},
                {{ name = 'bottom', gap = {gap} }},
             ]"
        )
    };
    match constraint_error(&scene("-0.01", "0.004")) {
        ConstraintError { at, conflict: Conflict::Penetrates(depth) } => {
            assert_eq!(at, [0.0, 0.0]);
            assert!((depth - 0.006).abs() < 1e-15);
        }
        other => panic!("{other}"),
    }
    // At t = 0 all is well, at ¾ it is not; up to the gap itself it is.
    assert!(matches!(
        constraint_error(&scene("'-0.01*t'", "0.006")).conflict,
        Conflict::Penetrates(depth) if (depth - 0.0015).abs() < 1e-15
    ));
    assert!(bounded(&scene("'-0.01*t'", "0.01")).is_ok());
    assert!(bounded(&scene("0.01", "0")).is_ok());
}

#[test]
fn contradictory_values_at_a_common_node_are_an_error() {
    let scene = |left: &str, top: &str| {
        format!(
            "boundary = [
                {{ name = 'left', {left} }},
                {{ name = 'top', {top} }},
             ]"
        )
    };
    match constraint_error(&scene("displacement = [0, 0]", "displacement = [0.1, 0]")) {
        ConstraintError { at, conflict: Conflict::Contradicts { values, direction } } => {
            assert_eq!((at, values, direction), ([0.0, 1.0], [0.0, 0.1], [1.0, 0.0]));
        }
        other => panic!("{other}"),
    }
    // A symmetry axis prescribes 0 along its normal.
    let sliding = scene("symmetry = true", "displacement = [0.1, 0]");
    assert!(matches!(constraint_error(&sliding).conflict, Conflict::Contradicts { .. }));
    for agreeing in [
        scene("displacement = [0, 0]", "displacement = ['0.1*x', 0]"),
        scene("displacement = [0, 'free']", "displacement = ['free', 0.1]"),
        scene("symmetry = true", "displacement = ['0.1*x', 0]"),
    ] {
        assert!(bounded(&agreeing).is_ok(), "{agreeing}");
    }
}

/// Conditions at node 0.
fn prescribed(direction: [f64; 2]) -> NodalConstraint {
    NodalConstraint { node: 0, direction, law: RowLaw::Prescribed }
}

fn gap(direction: [f64; 2]) -> NodalConstraint {
    NodalConstraint { node: 0, direction, law: RowLaw::Rigid { tributary_length: 1.0 } }
}

#[test]
fn a_node_between_two_plates_has_one_unknown_with_two_bounds() {
    let limits = |angle: f64, lower: f64, upper: f64| {
        let n = [angle.sin(), -angle.cos()];
        let (origin, mut rows) = ([[0.0, 0.0]], [gap(n), gap(n.map(|v| -v))]);
        let constraints = Constraints::new(&origin, &mut rows, &[upper, lower]).unwrap();
        let (_, bounds) = constraints.prescribed_and_bounds(&[upper, lower], &origin).unwrap();
        let [bound] = &bounds[..] else { panic!("{constraints:?}") };
        assert_eq!((bound.normal, bound.lower, bound.upper), (n, -lower, upper));
        bound.is_equality()
    };
    for angle in [0.0, 0.4, 2.0] {
        assert!(!limits(angle, 0.2, 0.1));
        assert!(limits(angle, 0.0, 0.0), "plates that meet leave no freedom along their normal");
    }
    // Tilted by less than coordinates can tell they are parallel, by a little more nobody can say,
    // beyond that they are two conditions.
    let tilted = |tilt: f64| {
        let mut rows = [gap([0.0, -1.0]), gap([tilt.sin(), tilt.cos()])];
        Constraints::new(&[[3.0, 4.0]], &mut rows, &[0.1, 0.1])
    };
    assert_eq!(tilted(1e-12).unwrap().bounds.len(), 1);
    match tilted(1e-6).unwrap_err() {
        ConstraintError { at, conflict: Conflict::Dependent(angle) } => {
            assert_eq!(at, [3.0, 4.0]);
            assert!((angle - 1e-6).abs() < 1e-12);
        }
        other => panic!("{other}"),
    }
    assert_eq!(tilted(1e-3).unwrap().bounds.len(), 2);
}

#[test]
fn two_normals_at_a_node_with_a_prescribed_direction_bound_its_other_unknown() {
    // u_x = v is prescribed; u_y is kept by (0.6, −0.8)·u ≤ 0.2 from below and by
    // (0.8, 0.6)·u ≤ 0.1 from above.
    let origin = [[0.0, 0.0]];
    let mut rows = [prescribed([1.0, 0.0]), gap([0.6, -0.8]), gap([0.8, 0.6])];
    let constraints = Constraints::new(&origin, &mut rows, &[0.0, 0.2, 0.1]).unwrap();
    for v in [-0.3, 0.0, 0.15] {
        let (_, bounds) = constraints.prescribed_and_bounds(&[v, 0.2, 0.1], &origin).unwrap();
        let [bound] = &bounds[..] else { panic!("{bounds:?}") };
        // The unknown is the first row's normal displacement.
        let u_y = |c: f64| (0.6 * v - c) / 0.8;
        let (low, high) = ((0.6 * v - 0.2) / 0.8, (0.1 - 0.8 * v) / 0.6);
        assert!((u_y(bound.upper) - low).abs() < 1e-14 && (u_y(bound.lower) - high).abs() < 1e-14);
    }
    // Carried further there is no room between them.
    assert!(matches!(
        constraints.prescribed_and_bounds(&[0.5, 0.2, 0.1], &origin),
        Err(ConstraintError { at: [0.0, 0.0], conflict: Conflict::NoRoom(_) })
    ));
}

#[test]
fn gaps_of_one_smooth_boundary_become_one_bound_and_those_of_a_corner_two() {
    // Two normals 2α apart at one node: on a smooth line their length-weighted mean and the smaller gap, in a corner both.
    for (half, bounds) in [(0.01_f64, 1), (0.01, 2), (0.2, 1), (0.2, 2), (0.3, 1), (0.3, 2)] {
        let normal = |side: f64| [side * half.sin(), -half.cos()];
        let of_line = |side| if bounds == 1 { [0.0, -2.0] } else { normal(side) };
        let face = |side, gap: f64| {
            (
                0,
                BoundaryFace { of_line: of_line(side), ..BoundaryFace::plane(normal(side), 2.0) },
                gap,
            )
        };
        let joined = joined_faces([face(-1.0, 0.1), face(1.0, 0.2)]).remove(&0).unwrap();
        let row = |(face, gaps): (BoundaryFace, Vec<f64>)| {
            let law = RowLaw::Rigid { tributary_length: face.length };
            (NodalConstraint { node: 0, direction: face.normal, law }, gaps)
        };
        let (mut rows, gaps): (Vec<NodalConstraint>, Vec<Vec<f64>>) =
            joined.into_iter().map(row).unzip();
        assert_eq!(gaps.concat(), [0.1, 0.2]);
        let smallest: Vec<f64> = gaps.iter().map(|gaps| gaps[0]).collect();
        let constraints = Constraints::new(&[[0.0, 0.0]], &mut rows, &smallest).unwrap();
        assert_eq!(constraints.bounds.len(), bounds);
        let gaps: Vec<f64> = constraints.bounds.iter().map(|b| b.upper).collect();
        let tributary_length: f64 = constraints.bounds.iter().map(|b| b.tributary_length).sum();
        assert_eq!(tributary_length, 4.0);
        if bounds == 1 {
            assert_eq!(gaps, [0.1]);
            let [x, y] = constraints.bounds[0].normal;
            assert!(x.abs() < 1e-15 && (y + 1.0).abs() < 1e-15);
        } else {
            assert_eq!(gaps, [0.1, 0.2]);
            // Each bound is one unknown: c = D u gives u·ν of both.
            let mut u = vec![0.3, -0.7];
            constraints.bases.displacement_to_local(&mut u);
            for bound in &constraints.bounds {
                let [x, y] = bound.normal;
                assert!((u[bound.dof] - (0.3 * x - 0.7 * y)).abs() < 1e-15);
            }
        }
    }
}

#[test]
fn a_third_gap_or_a_gap_along_a_prescribed_direction_takes_no_unknown() {
    let origin = [[0.0, 0.0]];
    let mut three = [gap([0.0, -1.0]), gap([1.0, 0.0]), gap([-0.6, 0.8])];
    let refused = Constraints::new(&origin, &mut three, &[0.0; 3]).unwrap_err();
    assert!(matches!(refused.conflict, Conflict::TooMany));
    // Prescribed along the normal: no bound, but the value is checked against the gap.
    let constraints =
        Constraints::new(&origin, &mut [prescribed([0.0, -1.0]), gap([0.0, -1.0])], &[0.0, 0.1])
            .unwrap();
    assert!(constraints.bounds.is_empty());
    assert!(constraints.prescribed_and_bounds(&[0.1, 0.1], &origin).is_ok());
    assert!(constraints.prescribed_and_bounds(&[0.11, 0.1], &origin).is_err());
    // Prescribed the other way round, the same gap is on the other side.
    let constraints =
        Constraints::new(&origin, &mut [prescribed([0.0, 1.0]), gap([0.0, -1.0])], &[0.0, 0.1])
            .unwrap();
    assert!(constraints.prescribed_and_bounds(&[-0.11, 0.1], &origin).is_err());
    assert!(constraints.prescribed_and_bounds(&[0.11, 0.1], &origin).is_ok());
}

#[test]
fn a_body_carried_along_by_its_prescribed_side_feels_no_force() {
    // A rigid displacement of the left side, u = (0.3 − 0.2 y, 0.1), with nothing in the way.
    let text = "displacement = ['0.3*t - 0.2*t*y', '0.1*t + 0.2*t*x']";
    for rest in ["", "{ name = 'bottom', gap = 1 },"] {
        for solver in SOLVERS {
            let problem = bounded(&format!(
                "time = {{ end = 1, step = 0.5 }}
                 boundary = [{{ name = 'left', {text} }}, {rest}]"
            ))
            .unwrap();
            let last = run(&problem, solver).last;
            for (u, [x, y]) in last.state.u.chunks(2).zip(&problem.body.mesh.nodes) {
                assert!((u[0] - 0.3 + 0.2 * y).abs() < 1e-13);
                assert!((u[1] - 0.1 - 0.2 * x).abs() < 1e-13);
            }
            assert!(last.record.contact_force.abs() < 1e-10 && last.record.active_nodes == 0);
        }
    }
}

#[test]
fn a_body_that_is_carried_far_keeps_the_digits_of_its_deformation() {
    // The side moves by up to 1e9 times the deformation by the load.
    for far in [1.0, 1e3, 1e6] {
        let problem = bounded(&format!(
            "boundary = [{{ name = 'left', displacement = [{far:?}, {far:?}] }},
                         {{ name = 'right', traction = [1e-3, 0] }}]"
        ))
        .unwrap();
        let residuals = run(&problem, SOLVERS[0]).kkt;
        assert!(residuals.within(problem.tolerance), "{far}: {residuals}");
    }
}
