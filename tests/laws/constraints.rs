//! Conditions that meet at one node.

use crate::support::{moved, run, setting, square, turn};
use signorini::{
    contact::{ConstraintError, Constraints, FixedRow, GapRow, SOLVERS},
    evolution::SetupError,
    mesh::Mesh,
};

const MATERIAL: &str = "material = { young = 100, poisson = 0.3, plane = 'stress' }";

/// A square with these boundaries.
fn bounded(boundaries: &str) -> Result<signorini::evolution::Setting, SetupError> {
    setting(square(4), &format!("{MATERIAL}\n{boundaries}"))
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
fn a_held_node_on_the_contact_boundary_keeps_its_value() {
    // Node (0, 0) is lifted by 0.01 with the left side; the bottom next to it touches.
    for solver in SOLVERS {
        let setting = bounded(
            "boundary = [
                { name = 'left', displacement = [0.02, 0.01] },
                { name = 'bottom', gap = 0 },
                { name = 'top', traction = [0, -50] },
             ]",
        )
        .unwrap();
        let last = run(&setting, solver).last;
        for [a, b] in &setting.body.mesh.curves["left"].edges {
            for node in [a, b] {
                assert_eq!(last.state.u[2 * node..2 * node + 2], [0.02, 0.01]);
            }
        }
        // It is no contact node: it counts in no reaction.
        let held = node(&setting.body.mesh, [0.0, 0.0]);
        assert_eq!(last.state.contact.len(), 4);
        assert!(last.state.contact.iter().all(|point| point.node != held));
        assert!(last.record.active_nodes > 0);
    }
}

#[test]
fn a_node_held_across_the_normal_still_meets_the_foundation() {
    // Horizontal displacement prescribed at the left only: (0, 0) may slide down to the gap.
    for solver in SOLVERS {
        let setting = bounded(
            "boundary = [
                { name = 'left', displacement = [0.02, 'free'] },
                { name = 'bottom', gap = 0.1 },
                { name = 'top', traction = [0, -5] },
             ]",
        )
        .unwrap();
        let state = run(&setting, solver).last.state;
        let corner = node(&setting.body.mesh, [0.0, 0.0]);
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
        ConstraintError::Penetrates { x, y, depth } => {
            assert_eq!((x, y), (0.0, 0.0));
            assert!((depth - 0.006).abs() < 1e-15);
        }
        other => panic!("{other}"),
    }
    // At t = 0 all is well, at ¾ it is not; up to the gap itself it is.
    assert!(matches!(
        constraint_error(&scene("'-0.01*t'", "0.006")),
        ConstraintError::Penetrates { depth, .. } if (depth - 0.0015).abs() < 1e-15
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
        ConstraintError::Contradicts { x, y, first, second, dx, dy } => {
            assert_eq!([x, y, first, second, dx, dy], [0.0, 1.0, 0.0, 0.1, 1.0, 0.0]);
        }
        other => panic!("{other}"),
    }
    // A symmetry axis prescribes 0 along its normal.
    let sliding = scene("symmetry = true", "displacement = [0.1, 0]");
    assert!(matches!(constraint_error(&sliding), ConstraintError::Contradicts { .. }));
    for agreeing in [
        scene("displacement = [0, 0]", "displacement = ['0.1*x', 0]"),
        scene("displacement = [0, 'free']", "displacement = ['free', 0.1]"),
        scene("symmetry = true", "displacement = ['0.1*x', 0]"),
    ] {
        assert!(bounded(&agreeing).is_ok(), "{agreeing}");
    }
}

#[test]
fn three_independent_conditions_at_a_node_are_an_error() {
    // The corner (1, 0) of a turned square: two contact normals and a held direction that
    // is neither. The held side is a curve of its own that ends in the corner.
    let mut mesh = moved(square(4), |x| turn(0.3, x));
    let corner = mesh.curves["right"].edges[0];
    let end = signorini::mesh::Curve { edges: vec![corner], interior_edges: 0 };
    mesh.curves.insert("end".into(), end);
    let text = format!(
        "{MATERIAL}
         boundary = [
            {{ name = 'end', displacement = [0, 'free'] }},
            {{ name = 'right', gap = 0 }},
            {{ name = 'bottom', gap = 0 }},
         ]"
    );
    let [x, y] = mesh.nodes[corner[0]];
    match setting(mesh, &text) {
        Err(SetupError::Constraint {
            source: ConstraintError::TooMany { x: at_x, y: at_y },
            ..
        }) => assert_eq!((at_x, at_y), (x, y)),
        other => panic!("{other:?}"),
    }
}

#[test]
fn gaps_of_one_smooth_boundary_become_one_bound_and_those_of_a_corner_two() {
    // Two normals 2α apart at one node: below 30° their length-weighted mean and the
    // smaller gap, above it both.
    for (half, bounds) in [(0.2_f64, 1), (0.3, 2)] {
        let normal = |side: f64| [side * half.sin(), -half.cos()];
        let rows = [
            GapRow { node: 0, normal: normal(-1.0), gap: 0.1, weight: 2.0 },
            GapRow { node: 0, normal: normal(1.0), gap: 0.2, weight: 2.0 },
        ];
        let constraints = Constraints::new(&[[0.0, 0.0]], &[], &rows).unwrap();
        assert_eq!(constraints.bounds.len(), bounds);
        let gaps: Vec<f64> = constraints.bounds.iter().map(|b| b.gap).collect();
        let weight: f64 = constraints.bounds.iter().map(|b| b.weight).sum();
        assert_eq!(weight, 4.0);
        if bounds == 1 {
            assert_eq!(gaps, [0.1]);
            let [x, y] = constraints.bounds[0].normal;
            assert!(x.abs() < 1e-15 && (y + 1.0).abs() < 1e-15);
        } else {
            assert_eq!(gaps, [0.1, 0.2]);
            // Each bound is one unknown: c = D u gives u·ν of both.
            let mut u = vec![0.3, -0.7];
            constraints.frames.displacement_to_frame(&mut u);
            for bound in &constraints.bounds {
                let [x, y] = bound.normal;
                assert!((u[bound.dof] - (0.3 * x - 0.7 * y)).abs() < 1e-15);
            }
        }
    }
}

#[test]
fn a_third_gap_or_a_gap_along_a_held_direction_takes_no_unknown() {
    let gap = |normal, gap| GapRow { node: 0, normal, gap, weight: 1.0 };
    let held = |direction| FixedRow { node: 0, direction };
    let origin = [[0.0, 0.0]];
    let three = [gap([0.0, -1.0], 0.0), gap([1.0, 0.0], 0.0), gap([-1.0, 0.0], 0.0)];
    assert!(matches!(Constraints::new(&origin, &[], &three), Err(ConstraintError::TooMany { .. })));
    // Held along the normal: no bound, but the value is checked against the gap.
    let constraints =
        Constraints::new(&origin, &[held([0.0, -1.0])], &[gap([0.0, -1.0], 0.1)]).unwrap();
    assert!(constraints.bounds.is_empty());
    assert!(constraints.lift(&[0.1], &origin).is_ok());
    assert!(constraints.lift(&[0.11], &origin).is_err());
    // Held the other way round, the same gap is on the other side.
    let constraints =
        Constraints::new(&origin, &[held([0.0, 1.0])], &[gap([0.0, -1.0], 0.1)]).unwrap();
    assert!(constraints.lift(&[-0.11], &origin).is_err());
    assert!(constraints.lift(&[0.11], &origin).is_ok());
}

#[test]
fn a_body_carried_along_by_its_prescribed_side_feels_no_force() {
    // A rigid displacement of the left side, u = (0.3 − 0.2 y, 0.1), with nothing in the way.
    let text = "displacement = ['0.3*t - 0.2*t*y', '0.1*t + 0.2*t*x']";
    for rest in ["", "{ name = 'bottom', gap = 1 },"] {
        for solver in SOLVERS {
            let setting = bounded(&format!(
                "time = {{ end = 1, step = 0.5 }}
                 boundary = [{{ name = 'left', {text} }}, {rest}]"
            ))
            .unwrap();
            let last = run(&setting, solver).last;
            for (u, [x, y]) in last.state.u.chunks(2).zip(&setting.body.mesh.nodes) {
                assert!((u[0] - 0.3 + 0.2 * y).abs() < 1e-13);
                assert!((u[1] - 0.1 - 0.2 * x).abs() < 1e-13);
            }
            assert!(last.record.contact_force.abs() < 1e-10 && last.record.active_nodes == 0);
        }
    }
}
