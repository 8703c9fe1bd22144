//! Scenes: the shipped ones, and what they turn into.

mod constants;
mod errors;
mod expression;
mod keys;
mod mesh;
mod set;

use std::path::{Path, PathBuf};

use signorini::fem::Mass;
use signorini::mesh::Order;
use signorini::model::Plane;
use signorini::scene::{
    Boundary, Condition, Expression, MeshSource, Scene, Scheme, Stepping, SurfaceLoad, TimeGrid,
    Units,
};

/// A complete scene; a test changes a line of it.
const BASE: &str = include_str!("base.toml");

fn geo(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("geo").join(file)
}

fn shipped(name: &str) -> Scene {
    Scene::read(&geo(&format!("{name}.toml")), &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// The traction on a boundary.
fn traction(boundary: &Boundary) -> &[Expression; 2] {
    match boundary.loads().next() {
        Some(SurfaceLoad::Traction(f)) => f,
        other => panic!("{other:?} is no traction"),
    }
}

#[test]
fn every_shipped_scene_is_read() {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(geo("")).expect("geo/ is there") {
        let path = entry.expect("geo/ is readable").path();
        if path.extension().is_some_and(|e| e == "toml") {
            let scene = Scene::read(&path, &[]).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(scene.mesh.file.extension().expect("a file"), "geo");
            assert_eq!(scene.mesh.file.parent(), path.parent());
            names.push(scene.name);
        }
    }
    for name in
        ["square", "square-table1", "square-mild", "lshape", "bridge", "bridge-half", "hertz"]
    {
        assert!(names.iter().any(|n| n == name), "{name} is missing");
    }
}

#[test]
fn the_examples_carry_the_printed_data() {
    type Example = (&'static str, [f64; 4], usize, &'static [&'static str]);
    // (scene, [E, κ, λ_D, λ_U], steps, curves)
    let examples: [Example; 6] = [
        ("square", [80.0, 0.01, 0.1, 100.0], 5000, &["left", "bottom", "right"]),
        ("square-table1", [80.0, 0.01, 0.1, 100.0], 100, &["left", "bottom", "right"]),
        ("square-mild", [80.0, 0.01, 0.1, 2.0], 100, &["left", "bottom", "right"]),
        ("lshape", [1e5, 1.0, 0.25, 1e3], 100, &["clamp", "foundation", "load"]),
        ("bridge", [1e6, 1.0, 0.25, 1e3], 100, &["foundation", "load"]),
        ("bridge-half", [1e6, 1.0, 0.25, 1e3], 100, &["axis", "foundation", "load"]),
    ];
    for (name, [young, diffusion, lambda_d, lambda_u], steps, curves) in examples {
        let scene = shipped(name);
        let law = scene.damage.as_ref().expect(name).law;
        assert_eq!((scene.material.young, scene.material.poisson), (young, 0.3), "{name}");
        assert_eq!(scene.material.plane, Plane::Stress, "{name}");
        assert_eq!((law.diffusion, law.threshold), (diffusion, 0.01), "{name}");
        assert_eq!((law.lambda_d, law.lambda_u, law.lambda_w), (lambda_d, lambda_u, 0.0));
        assert_eq!(law.strain_cap, 1000.0, "{name}");
        assert_eq!(
            scene.time,
            Some(TimeGrid::uniform(1.0, 1.0 / steps as f64, Scheme::Euler)),
            "{name}"
        );
        let names: Vec<&str> = scene.boundaries.iter().map(|b| b.name.as_str()).collect();
        assert_eq!(names, curves, "{name}");
        let load = scene.boundaries.iter().find_map(|b| b.loads().next());
        let load = load.expect("a load").at([1.0, 1.0], [f64::NAN; 2], 0.5);
        let expected = match name {
            // Not the printed one: see the scene.
            "square-table1" => [-5.0, 0.0],
            "square" | "square-mild" => [-10.0, -10.0],
            _ => [0.0, -40.0],
        };
        assert_eq!(load, expected, "{name}");
    }
}

#[test]
fn hertz_is_elastic_static_and_carries_half_the_load() {
    let scene = shipped("hertz");
    assert!(scene.damage.is_none() && scene.time.is_none());
    assert_eq!(scene.material.plane, Plane::Strain);
    let boundary = |name: &str| {
        let found = scene.boundaries.iter().find(|b| b.name == name);
        found.unwrap_or_else(|| panic!("{name} is missing"))
    };
    assert!(matches!(boundary("axis").conditions[..], [Condition::Symmetry]));
    let gap = boundary("foundation").gap().expect("a gap");
    assert_eq!(gap.normal, Some([0.0, -1.0]));
    assert_eq!(gap.distance.eval(0.01, 0.002, 1.0), 0.002);
    let [_, y] = traction(boundary("top"));
    let force = y.as_constant().expect("uniform") * 0.05;
    assert!((force + 17.5e6).abs() < 1e-6, "{force}");
}

#[test]
fn what_is_left_out_has_a_default() {
    let text = "
        mesh.file = 'm.msh'
        material = { young = 1, poisson = 0, plane = 'strain' }
        boundary = [{ name = 'b', displacement = ['free', 2], traction = ['x', 0] }]
    ";
    let parse = |sets: &[String]| Scene::parse(text, Path::new("dir/tiny.toml"), sets);
    let scene = parse(&[]).expect("complete");
    assert_eq!((scene.name.as_str(), scene.title.as_str()), ("tiny", "tiny"));
    assert_eq!(scene.mesh, MeshSource::from_path("dir/m.msh"));
    assert!(scene.damage.is_none() && scene.time.is_none());
    assert!(scene.body_force.iter().all(|f| f.as_constant() == Some(0.0)));
    assert_eq!((scene.contact.solver, scene.contact.tolerance), (None, 1e-10));
    assert_eq!(scene.output.every, None);
    assert_eq!((&scene.units, scene.order), (&Units::default(), Order::Linear));
    let [Condition::Displacement([None, Some(y)]), Condition::Load(_)] =
        &scene.boundaries[0].conditions[..]
    else {
        panic!("a displacement, free in x, and a traction")
    };
    assert_eq!(y.as_constant(), Some(2.0));
    // The damage law has the constants of the paper.
    let damage = "damage={ diffusion = 1, lambda_d = 0.5, lambda_u = 2 }".to_owned();
    let order = "discretisation.displacement=2".to_owned();
    let scene = parse(&[damage, order]).expect("complete");
    let damage = scene.damage.expect("given");
    let law = damage.law;
    assert_eq!((law.lambda_w, law.strain_cap, law.threshold), (0.0, 1000.0, 0.01));
    assert_eq!((damage.initial.as_constant(), scene.order), (Some(1.0), Order::Quadratic));
}

#[test]
fn units_are_names() {
    for (units, expected) in [
        ("", ["m", "N", "s", "Pa", "J/m"]),
        ("units = { time = 'h' }", ["m", "N", "h", "Pa", "N·m/m"]),
        ("units = { length = 'mm' }", ["mm", "N", "s", "N/mm²", "N·mm/mm"]),
        ("units = { length = 'mm', stress = 'MPa' }", ["mm", "N", "s", "MPa", "N·mm/mm"]),
        ("units = { length = 'mm', force = 'kN' }", ["mm", "kN", "s", "kN/mm²", "kN·mm/mm"]),
    ] {
        let text = format!("{units}\n{BASE}");
        let scene =
            Scene::parse(&text, Path::new("base.toml"), &[]).unwrap_or_else(|e| panic!("{e}"));
        let Units { length, force, time, stress } = &scene.units;
        assert_eq!([length, force, time, stress, &scene.units.work()], expected.each_ref());
        assert_eq!(scene.material.young, 1e6, "nothing is converted");
    }
    let refused = Scene::parse(BASE, Path::new("base.toml"), &["units.lenght=mm".into()]);
    assert!(refused.expect_err("refused").to_string().contains("did you mean `length`?"));
}

#[test]
fn everything_written_is_read() {
    let scene = Scene::parse(BASE, Path::new("dir/base.toml"), &[]).expect("complete");
    assert_eq!(scene.title, "Base");
    assert_eq!(scene.path, Path::new("dir/base.toml"));
    assert_eq!(scene.mesh.file, Path::new("dir/base.geo"));
    let parameters = scene.mesh.parameters.iter().map(|(k, v)| (k.as_str(), *v));
    assert_eq!(parameters.collect::<Vec<_>>(), [("grading", 3.0), ("size", 0.25)]);
    assert_eq!(scene.body_force[1].eval(0.0, 0.0, 2.0), -2.0);
    assert_eq!(scene.contact.solver.as_deref(), Some("tao:tron"));
    assert_eq!(scene.contact.tolerance, 1e-8);
    assert_eq!(scene.output.every, Some(5));
    let damage = scene.damage.expect("given");
    assert_eq!(damage.initial.eval(0.5, 0.0, 0.0), 0.95);
    assert_eq!(damage.mass, Mass::Consistent, "as in the paper unless told otherwise");
    let gap = scene.boundaries[2].gap().expect("given");
    assert_eq!(gap.normal, Some([0.6, -0.8]), "scaled to length 1");
    assert!(scene.boundaries[2].loads().next().is_some(), "beside the gap");
}

#[test]
fn the_time_grid_is_uniform_and_not_coarser_than_asked() {
    for (end, step, steps) in [
        (1.0, 0.01, 100),
        (1.0, 0.001, 1000),
        (0.3, 0.1, 3), // 0.3/0.1 rounds to 2.999…96 or 3.000…04: still three steps
        (0.7, 0.1, 7),
        (1.0, 0.3, 4),
        (1.0, 1.0, 1),
        (2.0, 1.999, 2),
    ] {
        let grid = TimeGrid::uniform(end, step, Scheme::Bdf2);
        assert_eq!(grid.stepping, Stepping::Uniform { steps }, "{end} by {step}");
        assert!(end / steps as f64 <= step * (1.0 + 1e-8));
        assert_eq!(grid.end, end);
    }
}
