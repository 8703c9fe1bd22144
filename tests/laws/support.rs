//! Meshes, scenes and runs for the laws.

#[path = "../common/mod.rs"]
mod common;

pub use common::{Random, curved_area, square};

use nalgebra::{Matrix2, Vector3};
use signorini::{
    accuracy::{self, Adapted},
    contact::SOLVERS,
    estimate::Simulation,
    evolution::{ObservedProblem, Outcome, RunError, RunOptions, SetupError, Step},
    mesh::{self, Curve, Mesh, Order},
    model::DamageLaw,
    petsc::Session,
    scene::Scene,
};
use std::{collections::BTreeMap, fs, path::Path};
use tempfile::TempDir;

/// A damage law of which every constant counts. Tests change some of its constants.
pub const DAMAGE_LAW: DamageLaw = DamageLaw {
    diffusion: 0.7,
    lambda_d: 0.3,
    lambda_u: 2.0,
    lambda_w: 0.1,
    strain_cap: 0.8,
    threshold: 0.01,
};

/// Random strains (ε_xx, ε_yy, 2ε_xy), and |ε|² = Σ ε_ij² of each.
pub fn random_strains(random: &mut Random, count: usize) -> (Vec<Vector3<f64>>, Vec<f64>) {
    let strains: Vec<Vector3<f64>> =
        (0..count).map(|_| Vector3::from_fn(|_, _| random.next())).collect();
    let squared =
        |e: &Vector3<f64>| Matrix2::new(e[0], e[2] / 2.0, e[2] / 2.0, e[1]).norm_squared();
    let squares = strains.iter().map(squared).collect();
    (strains, squares)
}

/// The [`square`] with its inner nodes moved at random, by up to 0.3 cells in x and y, and those on
/// the sides along them.
pub fn distorted(n: usize) -> Mesh {
    let (mut mesh, mut random) = (square(n), Random::new(n as u64));
    let reach = 0.3 / n as f64;
    for node in &mut mesh.nodes {
        for x in node {
            let shift = reach * random.next();
            if *x > 0.0 && *x < 1.0 {
                *x += shift;
            }
        }
    }
    mesh
}

/// The unit square as gmsh triangulates it.
pub fn unstructured(size: f64) -> Mesh {
    let folder = folder();
    let geo = folder.path().join("square.geo");
    let corners = "Point(1) = {0,0,0}; Point(2) = {1,0,0}; Point(3) = {1,1,0}; Point(4) = {0,1,0};";
    let sides = "Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};";
    let names = ["bottom", "right", "top", "left"];
    let named: String = (names.iter().enumerate())
        .map(|(i, name)| format!("Physical Curve(\"{name}\") = {{{}}};\n", i + 1))
        .collect();
    let body = "Curve Loop(1) = {1:4}; Plane Surface(1) = {1}; Physical Surface(\"body\") = {1};";
    fs::write(&geo, [corners, sides, body, &named].join("\n")).unwrap();
    mesh::load(&geo, &[("size".to_owned(), size)].into(), Order::Linear).unwrap()
}

/// Both orders of the displacements.
pub const ORDERS: [Order; 2] = [Order::Linear, Order::Quadratic];

/// A folder of temporary files. Its place and gmsh are found by the environment, which MPI changes while it starts:
/// so this starts it, or waits until another test has done so (and must not be called by who has a session).
fn folder() -> TempDir {
    drop(Session::start(&[]).unwrap());
    tempfile::tempdir().unwrap()
}

/// `mesh` with its nodes moved; the map must keep the orientation.
pub fn moved(mut mesh: Mesh, place: impl Fn([f64; 2]) -> [f64; 2]) -> Mesh {
    mesh.nodes.iter_mut().for_each(|x| *x = place(*x));
    mesh
}

/// `mesh` with its vertices and the midpoints of its edges moved: all edges are curved.
pub fn bent(mesh: &Mesh, place: impl Fn([f64; 2]) -> [f64; 2]) -> Mesh {
    let mut bent = moved(mesh.clone(), &place);
    let mean = |p: [f64; 2], q: [f64; 2]| [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
    for [a, b, c] in &mesh.triangles {
        for [p, q] in [[*a, *b], [*b, *c], [*c, *a]] {
            let [x, y] = place(mean(mesh.nodes[p], mesh.nodes[q]));
            let straight = mean(bent.nodes[p], bent.nodes[q]);
            bent.set_offset([p, q], [x - straight[0], y - straight[1]]);
        }
    }
    bent
}

/// A square of which all edges are parabolas.
pub fn curved() -> Mesh {
    bent(&distorted(4), |[x, y]| {
        [x + 0.3 * y + 0.1 * (2.0 * y).sin(), y - 0.2 * x * y + 0.1 * x * x]
    })
}

/// x turned by `angle` about the origin.
pub fn turn(angle: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    let (s, c) = angle.sin_cos();
    [c * x - s * y, s * x + c * y]
}

/// `mesh` with the edges of the curve `of` whose nodes fulfil a condition as another curve, `name`.
pub fn with_part(mut mesh: Mesh, of: &str, name: &str, is_in: impl Fn([f64; 2]) -> bool) -> Mesh {
    let edges = mesh.curves[of].edges.iter().copied();
    let edges: Vec<_> = edges.filter(|edge| edge.iter().all(|&i| is_in(mesh.nodes[i]))).collect();
    mesh.curves.insert(name.to_owned(), Curve { edges, ..Curve::default() });
    mesh
}

/// `mesh` with its triangles above y = ½ as the physical surface `upper`.
pub fn layered(mut mesh: Mesh) -> Mesh {
    let upper = |t: &usize| mesh.triangles[*t].iter().all(|&node| mesh.nodes[node][1] >= 0.5);
    let upper = (0..mesh.triangles.len()).filter(upper).collect();
    mesh.surfaces.insert("upper".to_owned(), upper);
    mesh
}

/// No solver answers for another one in a law, unless the law says so in its scene.
const NO_RESCUE: &str = "contact.rescue=false";

/// The scene `text` on a mesh that is given later.
pub fn scene(text: &str) -> Scene {
    let sets = Vec::from_iter((!text.contains("rescue")).then(|| NO_RESCUE.to_owned()));
    let text = format!("mesh.file = 'given.msh'\n{text}");
    Scene::parse(&text, Path::new("law.toml"), &sets).unwrap_or_else(|error| panic!("{error}"))
}

/// The mesh of an accuracy, from a first one.
pub fn adapted(scene: &Scene, mesh: Mesh, accuracy: f64) -> Adapted {
    let session = Session::start(&[]).unwrap();
    let mut triangles = 0;
    let mut seen = |mesh: &Adapted| triangles = mesh.mesh.triangles.len();
    let found =
        accuracy::adapted(&session, scene, mesh, &RunOptions::of(scene), accuracy, &mut seen);
    let found = found.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(triangles, found.mesh.triangles.len(), "the last mesh shown is the answer");
    found
}

/// The answer of the first solver.
pub fn solved(scene: Scene, mesh: Mesh) -> Outcome {
    let problem = ObservedProblem::new(scene, mesh).unwrap_or_else(|error| panic!("{error}"));
    run(&problem, SOLVERS[0])
}

/// The scene `text` (TOML without `mesh`) on `mesh`.
pub fn problem(mesh: Mesh, text: &str) -> Result<ObservedProblem, SetupError> {
    ObservedProblem::new(scene(text), mesh)
}

/// A shipped scene with `--set` arguments.
pub fn shipped(name: &str, sets: &[&str]) -> ObservedProblem {
    shipped_with(name, sets, ["", ""])
}

/// The same with one text of its geometry replaced by another.
pub fn shipped_with(name: &str, sets: &[&str], [old, new]: [&str; 2]) -> ObservedProblem {
    let geo = Path::new(env!("CARGO_MANIFEST_DIR")).join("geo");
    // Meshes appear beside the geometry, so it is copied.
    let folder = folder();
    for entry in fs::read_dir(geo).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "geo" || e == "toml") {
            fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
        }
    }
    let sets: Vec<String> = sets.iter().chain(&[NO_RESCUE]).map(|s| (*s).to_owned()).collect();
    let scene = folder.path().join(name).with_extension("toml");
    let scene = Scene::read(&scene, &sets).unwrap_or_else(|e| panic!("{e}"));
    if !old.is_empty() {
        let geometry = fs::read_to_string(&scene.mesh.file).unwrap();
        assert!(geometry.contains(old));
        fs::write(&scene.mesh.file, geometry.replace(old, new)).unwrap();
    }
    let mesh = mesh::load(&scene.mesh.file, &scene.mesh.parameters, scene.order).unwrap();
    ObservedProblem::new(scene, mesh).unwrap_or_else(|e| panic!("{e}"))
}

/// The names of all shipped scenes.
pub fn shipped_names() -> Vec<String> {
    let geo = Path::new(env!("CARGO_MANIFEST_DIR")).join("geo");
    let paths = fs::read_dir(geo).unwrap().map(|entry| entry.unwrap().path());
    let scenes = paths.filter(|path| path.extension().is_some_and(|e| e == "toml"));
    let mut names: Vec<_> =
        scenes.map(|path| path.file_stem().unwrap().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// All accepted steps and the outcome.
pub fn history(problem: &ObservedProblem, solver: &str) -> (Vec<Step>, Outcome) {
    let session = Session::start(&[]).unwrap();
    let mut steps = Vec::new();
    let mut keep = |step: &Step| {
        steps.push(step.clone());
        Ok(())
    };
    let run = Simulation::new(problem).solver_named(solver).observer(&mut keep);
    let outcome = run.run(&session);
    let scene = &problem.scene().name;
    (steps, outcome.unwrap_or_else(|e| panic!("{scene} by {solver}: {e}")))
}

/// The outcome alone.
pub fn run(problem: &ObservedProblem, solver: &str) -> Outcome {
    history(problem, solver).1
}

/// The outcome or why there is none.
pub fn try_run(problem: &ObservedProblem, solver: &str) -> Result<Outcome, RunError> {
    let session = Session::start(&[]).unwrap();
    Simulation::new(problem).solver_named(solver).run(&session)
}

/// ‖a − b‖ / ‖b‖.
pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|v| v * v).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied())
}

/// The largest |v|.
pub fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |m, v| m.max(v.abs()))
}

#[track_caller]
pub fn close(value: f64, expected: f64, tolerance: f64) {
    let error = (value - expected).abs();
    // Not `error > …`: NaN must fail.
    assert!(error <= tolerance * expected.abs().max(1.0), "{value} is not {expected}");
}

/// The same against the size of `expected` alone, however small it is.
#[track_caller]
pub fn close_relative(value: f64, expected: f64, tolerance: f64) {
    let error = (value - expected).abs() / expected.abs();
    assert!(error <= tolerance, "{value} is not {expected}: {error:.1e} > {tolerance:.1e}");
}

/// The order of convergence: the fitted slope of log error over log size.
pub fn order(sizes: &[f64], errors: &[f64]) -> f64 {
    slope(sizes.iter().zip(errors).map(|(h, e)| (h.ln(), e.ln())))
}

/// Checks iterations of one problem solved twice, from factors of different age: what the methods see
/// of their linear solves differs within the tolerance, and the set that a factor foretells with its age.
pub fn same_iterations(solver: &str, a: usize, b: usize) {
    let apart = a.abs_diff(b);
    assert!(apart <= 2 + a.max(b) / 4, "{solver}: {a} and {b} iterations");
}

/// The slope of y over x by least squares, Σ(x−x̄)(y−ȳ)/Σ(x−x̄)²; not a number of fewer than two
/// points.
fn slope(points: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let points: Vec<_> = points.into_iter().collect();
    let mean =
        |value: fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (mut xy, mut xx) = (0.0, 0.0);
    for point in &points {
        xy += (point.0 - x) * (point.1 - y);
        xx += (point.0 - x) * (point.0 - x);
    }
    xy / xx
}

/// The figures of a step by their names.
pub fn figures(problem: &ObservedProblem, step: &Step) -> BTreeMap<String, f64> {
    let values = step.figures.iter().map(|of| of.value);
    problem.figures.iter().map(|of| of.name.clone()).zip(values).collect()
}
