//! What a scene finds wrong with its mesh.

use std::collections::BTreeMap;
use std::path::Path;

use signorini::mesh::{Curve, Mesh, Refinement};
use signorini::scene::{Scene, SceneError};

use crate::BASE;

/// The square [0, 2]² in two triangles, a side for each boundary of the base scene.
pub fn square() -> Mesh {
    let side = |a, b| Curve { edges: vec![[a, b]], other_edges: 0 };
    Mesh {
        nodes: vec![[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        curves: BTreeMap::from([
            ("foundation".into(), side(0, 1)),
            ("clamp".into(), side(1, 2)),
            ("load".into(), side(2, 3)),
            ("axis".into(), side(3, 0)),
        ]),
        ..Mesh::default()
    }
}

fn first_line(error: &SceneError) -> String {
    error.to_string().lines().next().expect("a line").to_owned()
}

/// What is said first about the base scene with one text replaced, on this mesh.
fn verdict(old: &str, new: &str, mesh: &Mesh) -> Result<(), String> {
    assert!(BASE.contains(old), "the base scene has no `{old}`");
    let text = BASE.replacen(old, new, 1);
    let scene = Scene::parse(&text, Path::new("bad.toml"), &[]).unwrap_or_else(|e| panic!("{e}"));
    scene.check_mesh(mesh).map_err(|e| first_line(&e))
}

#[test]
fn a_fitting_mesh_is_accepted() {
    assert_eq!(verdict("", "", &square()), Ok(()));
}

#[test]
fn values_are_checked_at_all_times_known_beforehand() {
    let at = |load: &str, time: &str| {
        let sets = ["boundary.load.traction=[0, 'LOAD']", "time=TIME"];
        let sets = sets.map(|set| set.replace("LOAD", load).replace("TIME", time));
        let scene = Scene::parse(BASE, Path::new("base.toml"), &sets);
        let scene = scene.unwrap_or_else(|e| panic!("{e}"));
        scene.check_mesh(&square()).map_err(|e| first_line(&e))
    };
    let refused = |load: &str, time: &str, at_time: &str| {
        let message = at(load, time).expect_err(time);
        assert!(message.contains("boundary.load.traction[1] is "), "{message}");
        assert!(message.ends_with(&format!(", t = {at_time}")), "{message}");
    };
    // Every t_n, 1/3 too, and no other.
    refused("1/(t - 0.37)", "{ end = 1, step = 0.01 }", "0.37");
    refused("1/(t - 1/3)", "{ end = 1, step = 0.333333333333 }", "0.3333333333");
    assert_eq!(at("1/(t - 0.37)", "{ end = 1, step = 0.1 }"), Ok(()));
    // A thousand of too many, the ends among them; a hundred where steps are chosen.
    refused("1/(t - 0.5)", "{ end = 1, step = 1e-9 }", "0.5");
    refused("1/(1 - t)", "{ end = 1, step = 1.1e-4 }", "1");
    refused("sqrt(0.555 - t)", "{ end = 1, step = 'auto' }", "0.56");
}

#[test]
fn what_is_undefined_elsewhere_does_not_matter() {
    assert_eq!(verdict("x^2", "1/(2-y)", &square()), Ok(()));
    // Infinite at a node, but tractions are taken at Gauss points.
    assert_eq!(verdict("\"-80*t\"", "\"1/sqrt(x)\"", &square()), Ok(()));
    // Rounding in the nodes of a curved foundation is no penetration.
    assert_eq!(verdict("x^2", "-1e-15*x", &square()), Ok(()));
}

#[test]
fn a_fixed_normal_points_out_of_the_body_all_along_its_curve() {
    let mut mesh = square();
    mesh.curves.insert("foundation".into(), Curve { edges: vec![[0, 1], [3, 0]], other_edges: 0 });
    // The axis out of the way.
    mesh.curves.insert("axis".into(), Curve { edges: vec![[2, 3]], other_edges: 0 });
    let normal = |normal: &str| verdict("[\"3\", \"-4\"]", normal, &mesh);
    let refused = |text: &str, how: &str| {
        let message = normal(text).expect_err("a normal that does not point out");
        let place = format!("foundation.normal points {how} at (0, 1), where the outward");
        assert!(message.contains(&place), "{message}");
        assert!(
            message.contains("normal is (-1.0000, 0.0000); it must point from the body"),
            "{message}"
        );
    };
    refused("[3, -4]", "into the body");
    // Along the left side, exactly or by rounding; a thousandth out of it is enough.
    refused("[0, -1]", "along the boundary");
    refused("[-1e-9, -1]", "along the boundary");
    assert_eq!(normal("[-1e-3, -1]"), Ok(()));
    assert_eq!(normal("[-3, -4]"), Ok(()));
}

#[test]
fn a_curve_must_be_there_and_on_the_boundary() {
    let mut mesh = square();
    mesh.curves.insert("load".into(), Curve::default());
    let message = verdict("", "", &mesh).expect_err("an empty curve");
    assert!(message.starts_with("bad.toml:32: boundary \"load\" has no edges"), "{message}");

    mesh.curves.insert("load".into(), Curve { edges: vec![[2, 3]], other_edges: 2 });
    let message = verdict("", "", &mesh).expect_err("a curve inside");
    assert!(message.contains("\"load\" has 2 edges inside or outside the body"), "{message}");

    mesh.curves.clear();
    let message = verdict("", "", &mesh).expect_err("no curves");
    assert!(message.contains("which has none: name each in the .geo"), "{message}");
    assert!(message.ends_with("corners at (0, 0), (2, 0), (2, 2), (0, 2)"), "{message}");
}

#[test]
fn boundaries_that_share_an_edge_do_not_contradict_each_other() {
    let mut mesh = square();
    // All around the body, in the place of the axis; the curves of the others lie on it.
    let edges = vec![[1, 2], [2, 3], [3, 0], [0, 1]];
    mesh.curves.insert("axis".into(), Curve { edges, other_edges: 0 });
    let around = |what: &str| verdict("symmetry = true", what, &mesh);
    let refused = |what: &str, told: &str| {
        let message = around(what).expect_err(what);
        assert!(message.starts_with("bad.toml:40: boundary \"axis\" has "), "{message}");
        assert!(message.contains(told), "{message}");
    };
    refused(
        "symmetry = true",
        "has a symmetry, but boundary \"clamp\" on the same edge at (2, 1) has a displacement; \
         an edge can have only one of them: take it out of one of the two boundaries",
    );
    refused("gap = 0", "a gap, but boundary \"clamp\" on the same edge at (2, 1) has a disp");
    refused("traction = [0, 1]", "\"clamp\" on the same edge at (2, 1) has both displacements");
    refused("displacement = [0, \"free\"]", "\"foundation\" on the same edge at (1, 0) has a gap");
    // Without the clamp: tractions add up, and one acts beside the gap.
    let edges = vec![[0, 1], [2, 3], [3, 0]];
    mesh.curves.insert("axis".into(), Curve { edges, other_edges: 0 });
    assert_eq!(verdict("symmetry = true", "traction = [0, 1]", &mesh), Ok(()));
    let message = verdict("", "", &mesh).expect_err("a symmetry and a gap");
    assert!(message.contains("a symmetry, but boundary \"foundation\""), "{message}");
}

#[test]
fn a_value_from_the_command_line_is_named_as_such() {
    let sets = ["boundary.load.traction=[0, 'log(x-1)']".to_owned()];
    let scene = Scene::parse(BASE, Path::new("base.toml"), &sets).expect("well formed");
    let message = scene.check_mesh(&square()).expect_err("log(-0.6)").to_string();
    assert_eq!(
        message,
        "base.toml, --set boundary.load.traction=[0, 'log(x-1)']: \
         boundary.load.traction[1] is NaN at (0.42264973081037427, 2)"
    );
}

#[test]
fn all_that_is_wrong_is_told_at_once() {
    let text = BASE
        .replace("\"1 - 0.1*x\"", "\"1 - 0.5*x\"")
        .replace("\"x^2\"", "\"1/(x - 2)\"")
        .replace("name = \"axis\"", "name = \"axes\"");
    let scene = Scene::parse(&text, Path::new("bad.toml"), &[]).expect("well formed");
    let message = scene.check_mesh(&square()).expect_err("three problems").to_string();
    let places: Vec<_> = message.lines().filter(|line| line.contains("bad.toml:")).collect();
    assert_eq!(places.len(), 3, "{message}");
    assert!(places[0].starts_with("bad.toml:17: damage.initial is 0"), "{message}");
    assert!(places[1].starts_with("error: bad.toml:36: boundary.foundation.gap is inf"));
    assert!(places[2].starts_with("error: bad.toml:40: boundary \"axes\" is no physical"));
}

/// Parses the base scene with `keys` in place of the axis, names the edges of `mesh`, and checks it.
fn named(keys: &str, sets: &[&str], mesh: &mut Mesh) -> Result<(), String> {
    let text = BASE.replacen("name = \"axis\"", keys, 1);
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let scene = Scene::parse(&text, Path::new("bad.toml"), &sets).unwrap_or_else(|e| panic!("{e}"));
    scene.name_edges(mesh).and_then(|()| scene.check_mesh(mesh)).map_err(|e| first_line(&e))
}

#[test]
fn a_boundary_is_selected_by_the_midpoints_of_its_edges() {
    // The left side of the square, by expressions that are true there alone.
    for selection in [
        "x < 1e-6",
        "x == 0",
        "1 - min(1, 1e6*x)",
        "x < 0.001 and y > 0.999",
        "0.5 > x + abs(y - 1)",
    ] {
        let (mut mesh, selected) = (square(), format!("name = \"axis\"\nwhere = \"{selection}\""));
        mesh.curves.remove("axis");
        let notes = if selection.contains('y') { 1 } else { 0 };
        assert_eq!(named(&selected, &[], &mut mesh), Ok(()), "{selection}");
        assert_eq!(mesh.edges_of("axis"), square().edges_of("axis"), "{selection}");
        // An end within an edge is noted, and refused where an accuracy is asked for.
        assert_eq!(mesh.notes.len(), notes, "{:?}", mesh.notes);
        let accurate = named(&selected, &["accuracy=0.1"], &mut mesh);
        let is_refused =
            accurate.is_err_and(|e| e.contains("boundary.axis.where changes within the edge"));
        assert_eq!(is_refused, notes > 0, "{selection}");
    }
    let refused = |selection: &str, mesh: &mut Mesh, told: &str| {
        let message = named(&format!("name = \"axis\"\nwhere = \"{selection}\""), &[], mesh)
            .expect_err(selection);
        assert!(message.contains(told), "{message}");
    };
    let mut mesh = square();
    mesh.curves.remove("axis");
    refused(
        "x < 0",
        &mut mesh.clone(),
        "is true at no midpoint of the edges, which lie from (0.0000, 0.0000) to (2.0000, 2.0000)",
    );
    refused("1/x", &mut mesh.clone(), "boundary.axis.where is inf at (0, 1)");
    refused("sqrt(y - 1) < 1", &mut mesh.clone(), "boundary.axis.where is NaN at (1, 0)");
    refused(
        "y < 1e-6",
        &mut mesh,
        "boundary \"axis\" has a symmetry, but boundary \"foundation\" on the same edge at (1, 0) has a gap",
    );
    refused(
        "y > 1.9",
        &mut square(),
        "is true at other edges than those of the physical curve of this name",
    );
    assert_eq!(named("name = \"axis\"\nwhere = \"x < 1e-6\"", &[], &mut square()), Ok(()));
}

#[test]
fn refined_meshes_keep_the_edges_that_were_selected() {
    let mut mesh = square();
    mesh.curves.remove("axis");
    // The tolerance is larger than the edges of the last mesh.
    named("name = \"axis\"\nwhere = \"x < 1e-2\"", &[], &mut mesh).expect("a selection");
    let mut refinement = Refinement::start(mesh);
    for _ in 0..20 {
        // Towards the corner at node 0.
        let marked: Vec<bool> = refinement.mesh.triangles.iter().map(|t| t.contains(&0)).collect();
        refinement = refinement.refine(&marked).expect("straight edges");
    }
    let mesh = &refinement.mesh;
    let edges = mesh.edges_of("axis");
    assert!(edges.len() > 8, "{}", edges.len());
    assert!(edges.iter().flatten().all(|&node| mesh.nodes[node][0] == 0.0));
    let length: f64 = edges.iter().map(|&edge| mesh.edge_normal(edge).1).sum();
    assert!((length - 2.0).abs() < 1e-12, "{length}");
}
