//! Adapted meshes: the accuracy asked for is the accuracy got, with few triangles.

use crate::support::{adapted, scene, solved, square, with_part};
use signorini::{estimate::Adapted, mesh::Mesh, scene::Scene};

/// A block under a load per area, on a foundation that ends under it: u ~ r^½ at the end, a jump of the traction besides.
fn block(accuracy: f64, load: &str) -> Scene {
    scene(&format!(
        "accuracy = {accuracy}
         material = {{ young = 1000, poisson = 0.3, plane = 'stress' }}
         boundary = [
            {{ name = 'left', symmetry = true }},
            {{ name = 'half', gap = 0 }},
            {{ name = 'top', traction = ['0', '{load}'] }},
         ]"
    ))
}

/// The unit square, of whose bottom the first half is a curve.
fn mesh() -> Mesh {
    with_part(square(2), "bottom", "half", |[x, _]| x <= 0.5)
}

/// fᵀu on a mesh: with a gap of zero fᵀu = ‖u‖², and ‖u − u_h‖² ≤ ‖u‖² − ‖u_h‖², the difference of
/// twice the energies.
fn work(mesh: Mesh) -> f64 {
    solved(block(0.1, "-1"), mesh).last.record.work
}

#[test]
fn the_error_is_at_most_the_one_asked_for_and_not_much_less() {
    let adapted = |accuracy| adapted(&block(accuracy, "-1"), mesh(), accuracy);
    let exact = work(adapted(3e-3).mesh);
    let mut triangles = Vec::new();
    for accuracy in [0.1, 0.03, 0.01] {
        let Adapted { mesh, error, short, .. } = adapted(accuracy);
        triangles.push(mesh.triangles.len() as f64);
        let truth = (1.0 - work(mesh) / exact).sqrt();
        println!("{accuracy}: estimated {error:.5}, true {truth:.5}, {triangles:?}");
        assert!(short.is_none() && error <= accuracy, "{short:?}");
        assert!(truth < accuracy && truth > 0.3 * accuracy, "{truth} for {accuracy}");
        assert!(0.7 * truth < error && error < 1.4 * truth, "{error} for {truth}");
    }
    // P2 on adapted meshes: the error falls like 1/N, on uniform ones like N^-1/4 here.
    assert!(triangles[2] < 1.5 * 10.0 * triangles[0], "{triangles:?}");
}

#[test]
fn a_load_narrower_than_the_first_triangles_is_found() {
    // ∫ exp(−((x − c)/w)²) dx = w √π.
    let (width, accuracy) = (0.004, 0.1);
    let narrow = || block(accuracy, &format!("-exp(-((x - 0.31)/{width})^2)"));
    let mesh = adapted(&narrow(), mesh(), accuracy).mesh;
    let force = solved(narrow(), mesh).last.record.contact_force;
    let exact = width * std::f64::consts::PI.sqrt();
    assert!((force - exact).abs() < accuracy * exact, "{force} is not {exact}");
}

#[test]
fn a_slender_body_reaches_every_accuracy_in_few_rounds() {
    // Of a bent strip all triangles have much the same error: either all are too large or none is by much.
    for accuracy in [0.1, 0.07, 0.05, 0.03, 0.02, 0.01] {
        let strip = scene(&format!(
            "accuracy = {accuracy}
             material = {{ young = 2e5, poisson = 0, plane = 'stress' }}
             boundary = [
                {{ name = 'left', displacement = [0, 0] }},
                {{ name = 'right', traction = [0, -0.1] }},
             ]"
        ));
        let Adapted { mesh, rounds, error, short, .. } =
            adapted(&strip, Mesh::rectangle(50.0, 1.0, 4, 1), accuracy);
        println!("{accuracy}: {error:.5}, {} triangles, mesh {rounds}", mesh.triangles.len());
        assert!(short.is_none() && error <= accuracy && rounds <= 15, "{short:?}, mesh {rounds}");
    }
}
