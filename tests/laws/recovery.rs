//! Strains recovered from displacements, and the error that they tell.

use crate::support::{ORDERS, distorted, layered, problem, run, square, unstructured};
use signorini::{
    contact::SOLVERS,
    estimate::RecoveredStrains,
    fem::{Body, Elasticity},
    mesh::{Mesh, Order},
    model::{Material, Plane},
};

/// u of which the strains are constant for P1, affine for P2.
fn displacement(order: Order, [x, y]: [f64; 2]) -> [f64; 2] {
    let linear = [0.3 * x - 0.7 * y, 0.2 * x + 0.4 * y];
    match order {
        Order::Linear => linear,
        Order::Quadratic => {
            [linear[0] + 0.5 * x * x - 0.3 * x * y, linear[1] - 0.6 * x * y + 0.2 * y * y]
        }
    }
}

#[test]
fn strains_of_the_degree_of_the_element_are_recovered_exactly_up_to_the_boundary() {
    let elasticity = Elasticity::new([Material {
        young: 1.0,
        poisson: 0.3,
        plane: Plane::Stress,
        density: 0.0,
    }]);
    // One cell has two triangles: no vertex has enough of them.
    for mesh in [square(1), square(2), distorted(2), distorted(6), unstructured(0.2)] {
        for order in ORDERS {
            let body = Body::new(mesh.clone(), order);
            let u: Vec<f64> =
                body.nodes.points.iter().flat_map(|&x| displacement(order, x)).collect();
            let recovered = RecoveredStrains::new(&body, &u).unwrap();
            let zeta = vec![1.0; 3 * body.triangles.len()];
            let error = recovered.energy_error(&elasticity, &zeta, &u);
            let relative = error.relative();
            assert!(relative < 1e-9, "{} triangles: {relative:.1e}", body.triangles.len());
        }
    }
}

/// A square clamped at the left and pressed on its foundation: with gaps and values of 0, and the
/// foundation touched in every node, ‖u − u_h‖² is the work that u_h lacks.
fn pressed(cells: usize, degree: usize) -> (f64, f64) {
    let text = format!(
        "discretisation.displacement = {degree}
         material = {{ young = 100, poisson = 0.3, plane = 'stress' }}
         boundary = [
            {{ name = 'left', displacement = [0, 0] }},
            {{ name = 'bottom', gap = 0 }},
            {{ name = 'top', traction = [0, '-1 - x'] }},
         ]"
    );
    let problem = problem(square(cells), &text).unwrap_or_else(|e| panic!("{e}"));
    let outcome = run(&problem, SOLVERS[0]);
    assert_eq!(outcome.last.record.active_nodes, degree * cells);
    (outcome.last.record.work, outcome.errors.displacement_mesh)
}

#[test]
fn with_contact_the_estimate_is_near_the_error_against_a_fine_quadratic_answer() {
    let (exact, _) = pressed(64, 2);
    for (degree, cells) in [(1, 8), (1, 16), (1, 32), (2, 4), (2, 8), (2, 16)] {
        let (work, estimate) = pressed(cells, degree);
        let error = ((exact - work) / exact).sqrt();
        println!("P{degree}, {cells}: {estimate:.4} estimated, {error:.4} true");
        let ratio = estimate / error;
        // An estimate that is a tenth larger or smaller is none of these.
        let expected = if degree == 1 { 0.85..0.99 } else { 1.10..1.28 };
        assert!(expected.contains(&ratio), "P{degree}, {cells}: {ratio:.3} of {error:.4}");
    }
}

#[test]
fn in_layers_one_triangle_thick_the_estimate_is_near_the_error() {
    // Two layers of two materials, bent: without contact ‖u − u_h‖² is the work that u_h lacks.
    let bent = |layers: usize, degree: usize| {
        let cells = 40 * layers;
        let mut mesh = Mesh::rectangle(20.0, 1.0, cells, 2 * layers);
        // Only the ends of these diagonals have as many as four triangles of a layer.
        for cell in [cells / 2, cells / 2 + cells * layers] {
            let [[a, b, c], [_, _, d]] = [mesh.triangles[2 * cell], mesh.triangles[2 * cell + 1]];
            (mesh.triangles[2 * cell], mesh.triangles[2 * cell + 1]) = ([a, b, d], [b, c, d]);
        }
        let text = format!(
            "discretisation.displacement = {degree}
             material = {{ young = 2e5, poisson = 0.3, plane = 'stress', upper.young = 7e4 }}
             boundary = [
                {{ name = 'left', displacement = [0, 0] }},
                {{ name = 'top', traction = [0, -0.002] }},
             ]"
        );
        let problem = problem(layered(mesh), &text).unwrap_or_else(|e| panic!("{e}"));
        let outcome = run(&problem, SOLVERS[0]);
        (outcome.last.record.work, outcome.errors.displacement_mesh)
    };
    let (exact, _) = bent(8, 2);
    for degree in [1, 2] {
        let (work, estimate) = bent(1, degree);
        let error = ((exact - work) / exact).sqrt();
        println!("P{degree}: {estimate:.4} estimated, {error:.4} true");
        let ratio = estimate / error;
        assert!((0.5..2.0).contains(&ratio), "P{degree}: {ratio:.3} of {error:.4}");
    }
}
