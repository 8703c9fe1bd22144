//! Adapted meshes: the accuracy asked for is the accuracy got, with few triangles.

use crate::support::{run, square};
use signorini::{
    contact::SOLVERS,
    estimate::{self, Adapted},
    evolution::DiscreteProblem,
    mesh::Mesh,
    petsc::Session,
    scene::Scene,
};
use std::{collections::BTreeMap, path::Path};

/// A block on a foundation that ends under it: u ~ r^½ at the end, a jump of the traction besides.
fn scene(accuracy: f64) -> Scene {
    loaded(accuracy, "-1")
}

/// The same under another load per area.
fn loaded(accuracy: f64, load: &str) -> Scene {
    let text = format!(
        "accuracy = {accuracy}
         mesh.file = 'given.msh'
         material = {{ young = 1000, poisson = 0.3, plane = 'stress' }}
         boundary = [
            {{ name = 'left', symmetry = true }},
            {{ name = 'half', gap = 0 }},
            {{ name = 'top', traction = ['0', '{load}'] }},
         ]"
    );
    Scene::parse(&text, Path::new("law.toml"), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// The unit square, of whose bottom the first half is a curve of its own.
fn mesh(n: usize) -> Mesh {
    let mut mesh = square(n);
    let mut half = mesh.curves["bottom"].clone();
    half.edges.retain(|edge| edge.iter().all(|&node| mesh.nodes[node][0] <= 0.5));
    mesh.curves = BTreeMap::from([
        ("half".to_owned(), half),
        ("left".to_owned(), mesh.curves["left"].clone()),
        ("top".to_owned(), mesh.curves["top"].clone()),
    ]);
    mesh
}

fn adapted(accuracy: f64) -> Adapted {
    let session = Session::start(&[]).unwrap();
    let mut triangles = 0;
    let mut seen = |mesh: &Adapted| triangles = mesh.mesh.triangles.len();
    let found =
        estimate::adapted(&session, &scene(accuracy), mesh(2), SOLVERS[0], accuracy, &mut seen);
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(triangles, found.mesh.triangles.len(), "the last mesh shown is the answer");
    found
}

/// fᵀu on a mesh: with a gap of zero fᵀu = ‖u‖², and ‖u − u_h‖² ≤ ‖u‖² − ‖u_h‖², the difference of
/// twice the energies.
fn work(mesh: Mesh) -> f64 {
    let problem = DiscreteProblem::new(scene(0.1), mesh).unwrap_or_else(|error| panic!("{error}"));
    run(&problem, SOLVERS[0]).last.record.work
}

#[test]
fn the_error_is_at_most_the_one_asked_for_and_not_much_less() {
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
    let scene = loaded(accuracy, &format!("-exp(-((x - 0.31)/{width})^2)"));
    let session = Session::start(&[]).unwrap();
    let found = estimate::adapted(&session, &scene, mesh(2), SOLVERS[0], accuracy, &mut |_| {});
    let mesh = found.unwrap_or_else(|error| panic!("{error}")).mesh;
    drop(session);
    let problem = DiscreteProblem::new(scene, mesh).unwrap_or_else(|error| panic!("{error}"));
    let force = run(&problem, SOLVERS[0]).last.record.contact_force;
    let exact = width * std::f64::consts::PI.sqrt();
    assert!((force - exact).abs() < accuracy * exact, "{force} is not {exact}");
}

#[test]
fn a_slender_body_reaches_every_accuracy_in_few_rounds() {
    // Of a bent strip all triangles have much the same error: either all are too large or none is by much.
    for accuracy in [0.1, 0.07, 0.05, 0.03, 0.02, 0.01] {
        let text = format!(
            "accuracy = {accuracy}
             mesh.file = 'given.msh'
             material = {{ young = 2e5, poisson = 0, plane = 'stress' }}
             boundary = [
                {{ name = 'left', displacement = [0, 0] }},
                {{ name = 'right', traction = [0, -0.1] }},
             ]"
        );
        let scene =
            Scene::parse(&text, Path::new("law.toml"), &[]).unwrap_or_else(|e| panic!("{e}"));
        let session = Session::start(&[]).unwrap();
        let strip = Mesh::rectangle(50.0, 1.0, 4, 1);
        let found = estimate::adapted(&session, &scene, strip, SOLVERS[0], accuracy, &mut |_| {});
        let Adapted { mesh, rounds, error, short, .. } = found.unwrap_or_else(|e| panic!("{e}"));
        println!("{accuracy}: {error:.5}, {} triangles, mesh {rounds}", mesh.triangles.len());
        assert!(short.is_none() && error <= accuracy && rounds <= 15, "{short:?}, mesh {rounds}");
    }
}
