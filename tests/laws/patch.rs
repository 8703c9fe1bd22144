//! The patch test: a body under uniform stress is solved exactly on any mesh.

use crate::support::{
    close_relative, difference, distorted, moved, problem, run, square, turn, unstructured,
};
use signorini::{
    contact::SOLVERS,
    evolution::{ObservedProblem, State},
    mesh::Mesh,
    model::Plane,
};

const YOUNG: f64 = 200.0;
const POISSON: f64 = 0.3;
/// Round-off times the condition number, here about 10³.
const TOLERANCE: f64 = 1e-12;

/// [material] with a KKT tolerance near round-off.
fn material(plane: Plane) -> String {
    let plane = match plane {
        Plane::Stress => "stress",
        Plane::Strain => "strain",
    };
    format!(
        "material = {{ young = {YOUNG}, poisson = {POISSON}, plane = '{plane}' }}
         contact.tolerance = 1e-13\n"
    )
}

/// ε_yy and ε_xx of σ_yy = −1 alone: −1/E and ν/E in plane stress,
/// −(1−ν²)/E and ν(1+ν)/E in plane strain.
fn strain(plane: Plane) -> [f64; 2] {
    let [yy, xx] = match plane {
        Plane::Stress => [1.0, POISSON],
        Plane::Strain => [1.0 - POISSON * POISSON, POISSON * (1.0 + POISSON)],
    };
    [-yy / YOUNG, xx / YOUNG]
}

fn meshes() -> [(&'static str, Mesh); 3] {
    [("structured", square(5)), ("distorted", distorted(6)), ("unstructured", unstructured(0.15))]
}

/// Each contact node carries `pressure`.
#[track_caller]
fn check_pressures(state: &State, pressure: f64) {
    assert!(!state.contact.is_empty());
    for point in &state.contact {
        close_relative(point.pressure, pressure, 1e-9);
        assert!(point.active && point.gap.abs() < 1e-12, "{point:?}");
    }
}

/// Pressed by p from the top on a foundation, with a symmetry axis at the left; the whole
/// turned by `angle` about the origin.
fn pressed(mesh: Mesh, angle: f64, plane: Plane, p: f64, more: &str) -> ObservedProblem {
    let text = format!(
        "{more}\n{}
         boundary = [
            {{ name = 'left', symmetry = true }},
            {{ name = 'bottom', gap = 0 }},
            {{ name = 'top', traction = {:?} }},
         ]",
        material(plane),
        turn(angle, [0.0, -p]),
    );
    problem(moved(mesh, |x| turn(angle, x)), &text).unwrap_or_else(|e| panic!("{e}"))
}

/// u = p (ε_xx x, ε_yy y) turned by `angle`.
fn exact(problem: &ObservedProblem, angle: f64, p: f64, [yy, xx]: [f64; 2]) -> Vec<f64> {
    let place = |x: &[f64; 2]| {
        let [x, y] = turn(-angle, *x);
        turn(angle, [p * xx * x, p * yy * y])
    };
    problem.body.mesh.nodes.iter().flat_map(place).collect()
}

#[test]
fn uniform_pressure_on_a_foundation() {
    let p = 7.0;
    for plane in [Plane::Stress, Plane::Strain] {
        for (name, mesh) in meshes() {
            for angle in [0.0, 0.7, -2.5] {
                for solver in SOLVERS {
                    let problem = pressed(mesh.clone(), angle, plane, p, "");
                    let state = run(&problem, solver).last.state;
                    let error = difference(&state.u, &exact(&problem, angle, p, strain(plane)));
                    assert!(error < TOLERANCE, "{solver}, {name}, {angle}: {error:.1e}");
                    check_pressures(&state, p);
                }
            }
        }
    }
}

#[test]
fn uniform_damage_softens_the_whole_patch() {
    // ζ = ½: twice the displacement under the same pressure.
    let damage = "damage = { diffusion = 1, lambda_d = 0, lambda_u = 1, lambda_w = 0, \
                             strain_cap = 1, threshold = 0.01, initial = 0.5 }";
    for solver in SOLVERS {
        let problem = pressed(distorted(6), 0.7, Plane::Stress, 7.0, damage);
        let state = run(&problem, solver).last.state;
        let error = difference(&state.u, &exact(&problem, 0.7, 14.0, strain(Plane::Stress)));
        assert!(error < TOLERANCE, "{solver}: {error:.1e}");
        assert!(state.zeta.iter().all(|z| *z == 0.5));
        check_pressures(&state, 7.0);
    }
}

#[test]
fn all_round_pressure_into_a_corner_of_the_foundation() {
    // Two sides of a parallelogram on the foundation, p on the other two: σ = −p I, and the
    // body shrinks towards the corner, u = −p (1−ν)/E (x − corner) in plane stress. The
    // corner has two normals, oblique where the sides are; gaps shift the body into it.
    let p = 7.0;
    for (slope, angle) in [(0.0, 0.0), (0.4, 0.0), (-0.5, 1.1)] {
        for gaps in [[0.0, 0.0], [0.01, 0.03]] {
            // The corner is (1, 0), where the bottom meets the right side.
            let mesh = moved(distorted(6), |[x, y]| turn(angle, [x + slope * y, y]));
            let normal = |curve: &str| mesh.edge_normal(mesh.curves[curve].edges[0]).0;
            let load = |curve: &str| normal(curve).map(|n| -p * n);
            let text = format!(
                "{}
                 boundary = [
                    {{ name = 'bottom', gap = {} }},
                    {{ name = 'right', gap = {} }},
                    {{ name = 'top', traction = {:?} }},
                    {{ name = 'left', traction = {:?} }},
                 ]",
                material(Plane::Stress),
                gaps[0],
                gaps[1],
                load("top"),
                load("left"),
            );
            // The shift w that closes both gaps: w·ν_bottom = g_bottom, w·ν_right = g_right.
            let ([a, b], [c, d]) = (normal("bottom"), normal("right"));
            let w =
                [d * gaps[0] - b * gaps[1], a * gaps[1] - c * gaps[0]].map(|w| w / (a * d - b * c));
            let corner = turn(angle, [1.0, 0.0]);
            let shrink = -p * (1.0 - POISSON) / YOUNG;
            let expected: Vec<f64> = (mesh.nodes.iter())
                .flat_map(|x| [0, 1].map(|k| w[k] + shrink * (x[k] - corner[k])))
                .collect();
            for solver in SOLVERS {
                let problem = problem(mesh.clone(), &text).unwrap();
                let state = run(&problem, solver).last.state;
                let error = difference(&state.u, &expected);
                assert!(error < TOLERANCE, "{solver}, slope {slope}, {gaps:?}: {error:.1e}");
                check_pressures(&state, p);
                let corner = problem.body.mesh.curves["right"].edges[0][0];
                let faces = state.contact.iter().filter(|point| point.node == corner);
                assert_eq!(faces.count(), 2);
            }
        }
    }
}

/// Bending by c on top of the pressure p, in plane stress: σ_xx = cy, σ_yy = −p, σ_xy = 0 and
/// u = ((cxy + νpx)/E, −(cx² + cνy²)/2E − py/E), a foundation of the same curvature under the bottom.
#[test]
fn a_quadratic_field_is_solved_exactly_with_quadratic_elements() {
    let (p, c) = (7.0, 3.0);
    let text = format!(
        "discretisation.displacement = 2
         {}
         boundary = [
            {{ name = 'left', displacement = ['0', '-({c}*{POISSON}*y^2/2 + {p}*y)/{YOUNG}'] }},
            {{ name = 'right', traction = ['{c}*y', '0'] }},
            {{ name = 'bottom', gap = '{c}*x^2/2/{YOUNG}' }},
            {{ name = 'top', traction = ['0', '-{p}'] }},
         ]",
        material(Plane::Stress)
    );
    let exact = |&[x, y]: &[f64; 2]| {
        let bent = -0.5 * c * (x * x + POISSON * y * y);
        [(c * x * y + POISSON * p * x) / YOUNG, (bent - p * y) / YOUNG]
    };
    for (name, mesh) in meshes() {
        for solver in SOLVERS {
            let problem = problem(mesh.clone(), &text).unwrap_or_else(|e| panic!("{e}"));
            let state = run(&problem, solver).last.state;
            let exact: Vec<f64> = problem.body.nodes.points.iter().flat_map(exact).collect();
            let error = difference(&state.u, &exact);
            assert!(error < TOLERANCE, "{solver}, {name}: {error:.1e}");
            // At (0, 0) the displacement is prescribed.
            let vertices_and_midpoints = 2 * problem.body.mesh.curves["bottom"].edges.len();
            assert_eq!(state.contact.len(), vertices_and_midpoints);
            check_pressures(&state, p);
        }
    }
}

/// σ_yy = −(p + cx) alone, in plane stress: u = (ν(px + cx²/2) + cy²/2, −(p + cx)y)/E. Simpson's weights
/// of the nodes of an edge are exact for ∫pφ_i of an affine p.
#[test]
fn an_affine_pressure_is_exact_at_the_vertices_and_midpoints_of_any_foundation() {
    let (p, c) = (7.0, 3.0);
    for (name, mesh) in meshes() {
        for angle in [0.0_f64, 0.7, -2.5] {
            // (x, y) of the patch from the coordinates of the turned one.
            let (s, k) = angle.sin_cos();
            let (x, y) = (format!("({k}*x + {s}*y)"), format!("({k}*y - {s}*x)"));
            let pressure = format!("({p} + {c}*{x})");
            let load = turn(angle, [0.0, -1.0]).map(|f| format!("{f}*{pressure}"));
            // The left side is carried to u_x = cy²/2E, with its tangential displacement free, by
            // prescribing both components there: u_y = −py/E.
            let left = [format!("{c}*{y}^2/2/{YOUNG}"), format!("(0 - {p}*{y}/{YOUNG})")];
            let left = [
                format!("{k}*{} - {s}*{}", left[0], left[1]),
                format!("{s}*{} + {k}*{}", left[0], left[1]),
            ];
            let text = format!(
                "discretisation.displacement = 2
                 {}
                 boundary = [
                    {{ name = 'left', displacement = {left:?} }},
                    {{ name = 'bottom', gap = 0 }},
                    {{ name = 'top', traction = {load:?} }},
                 ]",
                material(Plane::Stress)
            );
            let mesh = moved(mesh.clone(), |x| turn(angle, x));
            let exact = |point: &[f64; 2]| {
                let [x, y] = turn(-angle, *point);
                let across = POISSON * (p * x + 0.5 * c * x * x) + 0.5 * c * y * y;
                turn(angle, [across / YOUNG, -(p + c * x) * y / YOUNG])
            };
            for solver in SOLVERS {
                // TAO ends at twice this tolerance, where double precision ends: another solver may answer for it.
                let text = format!("contact.rescue = {}\n{text}", solver == "tao");
                let problem = problem(mesh.clone(), &text).unwrap_or_else(|e| panic!("{e}"));
                let state = run(&problem, solver).last.state;
                let points = &problem.body.nodes.points;
                let expected: Vec<f64> = points.iter().flat_map(exact).collect();
                let error = difference(&state.u, &expected);
                assert!(error < TOLERANCE, "{solver}, {name}, {angle}: {error:.1e}");
                for point in &state.contact {
                    let [x, _] = turn(-angle, points[point.node]);
                    close_relative(point.pressure, p + c * x, 1e-9);
                }
                // The node at the clamped corner has a row, too: Γ_C has a part of the reaction there.
                let rows = problem.supports.contact.rows(&problem.body, &state).0;
                assert_eq!(rows.len(), state.contact.len() + 1);
                for row in rows {
                    let [x, _] = turn(-angle, [row.x, row.y]);
                    close_relative(row.pressure, p + c * x, 1e-9);
                }
            }
        }
    }
}
