//! `--set`: what it reaches, and how it is refused.

use std::path::Path;

use signorini::fem::Mass;
use signorini::model::Plane;
use signorini::scene::{Condition, Scene, Scheme, TimeGrid};

use crate::{BASE, traction};

fn with(sets: &[&str]) -> Result<Scene, String> {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    Scene::parse(BASE, Path::new("dir/base.toml"), &sets).map_err(|e| e.to_string())
}

#[test]
fn set_replaces_adds_and_reaches_boundaries_by_name() {
    let scene = with(&[
        "material.plane=strain",
        "damage.initial=1-0.2*y",
        "boundary.load.traction=[\"0\", \"-40*t\"]",
        "boundary.\"clamp\".displacement=['free', 0.5]",
        "title=Another, with blanks",
        "time.step=0.05",
        "mesh={file='other.geo'}",
        "mesh.parameters.grading=4",
        "mesh.parameters.radius = 2",
    ])
    .unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(scene.time, Some(TimeGrid::uniform(1.0, 0.05, Scheme::Bdf2)));
    assert_eq!(scene.material.plane, Plane::Strain);
    // A table in braces takes the place of the old one, dotted keys add to it.
    let parameters = [("grading", 4.0), ("radius", 2.0)].map(|(name, v)| (name.to_owned(), v));
    assert_eq!(scene.mesh.parameters, parameters.into());
    assert_eq!(scene.damage.expect("given").initial.eval(0.0, 1.0, 0.0), 0.8);
    assert_eq!(scene.title, "Another, with blanks");
    let [_, y] = traction(&scene.boundaries[1]);
    assert_eq!(y.eval(0.0, 0.0, 1.0), -40.0);
    let clamp = &scene.boundaries[0].conditions[..];
    assert!(matches!(clamp, [Condition::Displacement([None, Some(_)])]), "{clamp:?}");
}

#[test]
fn the_mass_is_chosen_by_its_name() {
    let scene = with(&["damage.mass=lumped"]).expect("complete");
    assert_eq!(scene.damage.expect("given").mass, Mass::Lumped);
}

/// Two arguments for one key, in any two forms of the key: the second one is refused and names the first.
#[test]
fn a_key_is_given_once() {
    for [first, second] in [
        ["time.end=1", "time.end=2"],
        ["time.end=1", "\"time\" . end = 2"],
        ["time.end=1", "time={end=1, step=0.1}"],
        ["time={end=1, step=0.1}", "time.step=0.2"],
        ["boundary.load.traction=[0, 1]", "boundary.'load'.traction=[0, 2]"],
        ["mesh.parameters.grading=2", "mesh={file='a.geo'}"],
    ] {
        let refused = with(&[first, second]).expect_err("given twice").to_string();
        let key = second.split(['=', '{']).next().expect("a key").replace(['"', '\'', ' '], "");
        let text = format!("--set {second}: {key} is given twice, also by --set {first}");
        assert!(refused.contains(&text), "{refused} lacks {text}");
    }
    // A table in braces may be completed.
    with(&["time={end=1, step=0.1}", "time.scheme=euler"]).expect("each key once");
}
