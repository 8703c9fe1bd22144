//! Nodal loads against the integrals they stand for.

use crate::support::{close, distorted, moved, turn};
use signorini::{
    fem::{Body, add_body_force, add_traction},
    mesh::Order,
};

/// Σ load_i and Σ x_i load_i, y_i load_i, component by component: as 1, x and y are in the
/// space, these are ∫f, ∫x f and ∫y f wherever the quadrature is exact for f times an
/// affine function.
fn moments(body: &Body, load: &[f64]) -> [[f64; 3]; 2] {
    [0, 1].map(|k| {
        let mut sums = [0.0; 3];
        for (i, [x, y]) in body.mesh.nodes.iter().enumerate() {
            for (sum, weight) in sums.iter_mut().zip([1.0, *x, *y]) {
                *sum += weight * load[2 * i + k];
            }
        }
        sums
    })
}

#[test]
fn quadratic_tractions_are_integrated_exactly() {
    // On the top, y = 1: f = (1 − 2x + 6x², 3x²).
    let body = Body::new(distorted(5), Order::Linear);
    let mut load = vec![0.0; 2 * body.mesh.nodes.len()];
    let f = |[x, _]: [f64; 2]| [1.0 - 2.0 * x + 6.0 * x * x, 3.0 * x * x];
    add_traction(&body, &body.edges(&body.mesh.curves["top"].edges), f, &mut load);
    let [horizontal, vertical] = moments(&body, &load);
    // ∫f_x = 1 − 1 + 2, ∫x f_x = 1/2 − 2/3 + 6/4; ∫f_y = 1, ∫x f_y = 3/4.
    for (value, expected) in horizontal.into_iter().zip([2.0, 4.0 / 3.0, 2.0]) {
        close(value, expected, 1e-14);
    }
    for (value, expected) in vertical.into_iter().zip([1.0, 0.75, 1.0]) {
        close(value, expected, 1e-14);
    }
}

#[test]
fn affine_body_forces_are_integrated_exactly() {
    // f = (2 − x + 3y, 6y) on the square.
    let body = Body::new(distorted(5), Order::Linear);
    let mut load = vec![0.0; 2 * body.mesh.nodes.len()];
    add_body_force(&body, |[x, y]| [2.0 - x + 3.0 * y, 6.0 * y], &mut load);
    let [horizontal, vertical] = moments(&body, &load);
    // ∫xy = 1/4, ∫x² = 1/3.
    for (value, expected) in horizontal.into_iter().zip([3.0, 17.0 / 12.0, 1.75]) {
        close(value, expected, 1e-14);
    }
    for (value, expected) in vertical.into_iter().zip([3.0, 1.5, 2.0]) {
        close(value, expected, 1e-14);
    }
}

#[test]
fn a_pressure_all_around_has_no_resultant() {
    // ∮ν = 0 and ∮x × ν = 0 for any closed outline.
    let body = Body::new(
        moved(distorted(4), |[x, y]| turn(0.5, [x + 0.3 * y, y - 0.2 * x * y])),
        Order::Linear,
    );
    let mut load = vec![0.0; 2 * body.mesh.nodes.len()];
    for curve in body.mesh.curves.values() {
        for edge in &curve.edges {
            let normal = body.mesh.edge_normal(*edge).0;
            add_traction(&body, &body.edges(&[*edge]), |_| normal, &mut load);
        }
    }
    let [[x, _, moment_x], [y, moment_y, _]] = moments(&body, &load);
    assert!(load.iter().any(|f| f.abs() > 0.1));
    assert!(x.abs() < 1e-15 && y.abs() < 1e-15 && (moment_y - moment_x).abs() < 1e-15);
}

#[test]
fn the_weights_of_the_nodes_add_up_to_the_area() {
    let body = Body::new(distorted(6), Order::Linear);
    close(body.nodes.weights.iter().sum(), 1.0, 1e-14);
    let affine: Vec<f64> = body.mesh.nodes.iter().map(|[x, y]| 1.0 + 2.0 * x - y).collect();
    close(body.mean(&affine), 1.5, 1e-14);
}
