//! `--set`: what it reaches, and how it is refused.

use std::path::Path;

use signorini::fem::Mass;
use signorini::model::Plane;
use signorini::scene::{Condition, Scene, TimeGrid};

use crate::{BASE, traction};

fn with(sets: &[&str]) -> Result<Scene, String> {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    Scene::parse(BASE, Path::new("dir/base.toml"), &sets).map_err(|e| e.to_string())
}

#[test]
fn set_replaces_adds_and_reaches_boundaries_by_name() {
    let scene = with(&[
        "time.step=0.005",
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
    assert_eq!(scene.time, Some(TimeGrid::uniform(1.0, 0.05)), "the last one holds");
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
fn a_bad_set_is_named() {
    for (set, fragments) in [
        (
            "time.stp=1",
            ["base.toml, --set time.stp=1: unknown key time.stp", "did you mean `step`"],
        ),
        ("tyme.step=1", ["--set tyme.step=1: unknown key tyme", "did you mean `time`"]),
        ("time.step=-1", ["base.toml, --set time.step=-1: time.step must be positive", "is -1"]),
        ("time.step=fast", ["--set time.step=fast: time.step must be a number", "\"auto\""]),
        ("time.step", ["--set time.step: is no key, `=` and value", "--set KEY=VALUE"]),
        ("", ["--set : is no key, `=` and value", "--set KEY=VALUE"]),
        ("[time]", ["--set [time]: is no key, `=` and value", "--set KEY=VALUE"]),
        ("=3", ["--set =3: is no key, `=` and value", "--set KEY=VALUE"]),
        ("a b=3", ["--set a b=3: is no key, `=` and value", "quote odd names"]),
        ("time=3", ["--set time=3: time must be a table", "--set time=3"]),
        (
            "boundary.lod.gap=0",
            ["--set boundary.lod.gap=0: unknown key boundary.lod", "mean `load`"],
        ),
        (
            "boundary.load.gaap=0",
            ["--set boundary.load.gaap=0: unknown key boundary.load.gaap", "mean `gap`"],
        ),
        ("damage.initial=t", ["--set damage.initial=t: damage.initial depends", "on t"]),
        ("boundary.load=3", ["boundary.load needs a key", "boundary.load.KEY=VALUE"]),
        (
            "boundary.load.traction=[2*x,0]",
            ["load.traction must be an array of two", "[\"2*x\", 0]"],
        ),
        (
            "output.every=99999999999999999999",
            ["output.every is a number beyond 64", "--set output"],
        ),
        ("boundary=3", ["--set boundary=3: boundary must be an array", "--set boundary=3"]),
        (
            "boundary.load.traction=[0,\"q\"]",
            ["boundary.load.traction[1] has the unknown variable `q`", "--set boundary.load"],
        ),
    ] {
        match with(&["time.step=0.02", set]) {
            Ok(_) => panic!("{set} was accepted"),
            Err(message) => {
                for fragment in fragments {
                    assert!(message.contains(fragment), "{set}\n{message}\nlacks {fragment}");
                }
            }
        }
    }
}

#[test]
fn the_mass_is_chosen_by_its_name() {
    let scene = with(&["damage.mass=lumped"]).expect("complete");
    assert_eq!(scene.damage.expect("given").mass, Mass::Lumped);
}
