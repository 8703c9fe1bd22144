//! `[constants]`: names for expressions and numbers.

use crate::{BASE, keys::content};
use signorini::scene::Scene;
use std::path::Path;
use toml::{Table, Value};

/// The base scene with keys of all kinds: lists of numbers, points, a whole number, material of a surface.
const MORE: &str = "\n[[probe]]\nname = 'p'\npoint = [0.5, -1]\n[material.core]\nyoung = 2e6\ndensity = 3\n\
                    [contact.penalty_duality]\niterations = 7\n[discretisation]\ndisplacement = 2\n";

fn scene() -> Table {
    let mut scene: Table = format!("{BASE}{MORE}").parse().expect("TOML");
    let mut insert = |table: &str, key: &str, values: [Value; 2]| {
        let table = scene[table].as_table_mut().expect("a table");
        table.insert(key.to_owned(), values.to_vec().into());
    };
    insert("output", "times", [0.25.into(), 0.5.into()]);
    insert("body", "gravity", [0.into(), "-9.81*t".into()]);
    scene
}

fn parse(text: &str, sets: &[&str]) -> Result<Scene, String> {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    Scene::parse(text, Path::new("dir/base.toml"), &sets).map_err(|error| error.to_string())
}

fn read(text: &str, sets: &[&str]) -> Scene {
    parse(text, sets).unwrap_or_else(|error| panic!("{text}\n{error}"))
}

/// Replaces all numbers v of a scene by names nᵢ = 2mᵢ of constants mᵢ = v/2.
fn name_numbers(value: &mut Value, constants: &mut Table) {
    let number = value.as_float().or(value.as_integer().map(|number| number as f64));
    match (number, value) {
        (Some(number), value) => {
            let i = constants.len() / 2;
            constants.insert(format!("n{i}"), format!("2*m_{i}").into());
            constants.insert(format!("m_{i}"), (0.5 * number).into());
            *value = format!(" n{i}").into();
        }
        (None, Value::Array(values)) => {
            values.iter_mut().for_each(|value| name_numbers(value, constants))
        }
        (None, Value::Table(table)) => {
            table.iter_mut().for_each(|(_, value)| name_numbers(value, constants));
        }
        _ => {}
    }
}

/// Constants stand for their values in the place of every number, in any order, also in the file in the results.
#[test]
fn a_scene_with_constants_is_the_scene_with_their_values() {
    let plain = scene();
    let (mut named, mut constants) = (plain.clone(), Table::new());
    named.iter_mut().for_each(|(_, value)| name_numbers(value, &mut constants));
    assert!(constants.len() > 40, "{constants:?}");
    named.insert("constants".into(), constants.into());
    let plain = content(&read(&plain.to_string(), &[]));
    let named = read(&named.to_string(), &[]);
    assert_eq!(content(&named), plain);
    let text = named.as_run().text;
    assert!(text.contains("[constants]") && text.contains("young = \" n"), "{text}");
    let again = read(&text.replace("scene.msh", "base.geo").replace("scene.geo", "base.geo"), &[]);
    assert_eq!(content(&again).split("parameters:").nth(1), plain.split("parameters:").nth(1));
}

/// In expressions constants are names beside x, y and t. A scene as run keeps them.
#[test]
fn expressions_know_constants_and_arguments_change_them() {
    let text = BASE
        .replace("-80*t", "-load*t + table('no.csv', 0*width)*0")
        .replace("x^2", "e*(x/width)^2 + 1e-3*e")
        .replace("+ table('no.csv', 0*width)*0", "")
        .replace(
            "[time]",
            "[constants]\nload = '4*e'\ne = 20\nwidth = 'sqrt(4)'\ntitle = 1\n[time]",
        );
    let load = |text: &str, sets: &[&str]| {
        let scene = read(text, sets);
        let gap = scene.boundaries[2].gap().expect("a gap").distance.eval(3.0, 0.0, 0.0);
        [crate::traction(&scene.boundaries[1])[1].eval(0.0, 0.0, 1.0), gap]
    };
    assert_eq!(load(&text, &[]), [-80.0, 45.02]);
    for set in ["e=10", "constants.e=10", " e = 'sqrt(100)'", "constants.e='5 + pi/pi*5'"] {
        assert_eq!(load(&text, &[set]), [-40.0, 22.51], "{set}");
        let as_run = read(&text, &[set]).as_run().text;
        assert_eq!(load(&as_run, &["width=1"]), [-40.0, 90.01], "{set}");
    }
    // A key is itself also where a constant has its name.
    let scene = read(&text, &["title=Other", "constants.title=2"]);
    assert_eq!(scene.title, "Other");
}

#[test]
fn wrong_constants_are_refused_in_a_sentence() {
    let with = |constants: &str, sets: &[&str]| {
        let text = BASE.replace("young = 1e6", "young = 'E'");
        parse(&format!("{text}\n[constants]\n{constants}"), sets).expect_err(constants)
    };
    for (constants, fragments) in [
        ("E = 'F'\nF = 'E'", &["constants.E has the constant `F` without a value"][..]),
        ("E = 'E + 1'", &["constants.E has the constant `E` without a value"]),
        (
            "E = 'wdth'\nwidth = 2",
            &["constants.E has the unknown variable `wdth`; did you mean `width`?"],
        ),
        ("E = '2*x'", &["constants.E must be a constant, without x, y and t"]),
        ("E = '1/0'", &["constants.E must be finite, but is inf"]),
        ("E = true", &["constants.E must be a number or an expression"]),
        ("E = [1]", &["constants.E must be a number or an expression"]),
        ("E = 1\nx = 2", &["constants.x has a name that expressions use for something else"]),
        ("E = 1\nsin = 2", &["constants.sin has a name that expressions use"]),
        ("E = 1\nand = 2", &["constants.and has a name that expressions use"]),
        ("E = 1\nspline = 2", &["constants.spline has a name that expressions use"]),
        ("E = 1\n2a = 2", &["constants.2a is no name for expressions"]),
        ("E = 1\n'a b' = 2", &["constants.a b is no name for expressions"]),
        ("E = 1\nnu-1 = 2", &["constants.nu-1 is no name for expressions"]),
        // The value that is wrong, and the text that gave it.
        ("E = -3", &["material.young must be positive, at most 1e100 (Pa), but is \"E\" = -3"]),
        ("e = 3", &["bad.toml:7", "but \"E\" has the unknown variable `E`; did you mean `e`?"]),
        ("E = '(1'", &["constants.E has the end at column 3"]),
    ] {
        let refused = with(constants, &[]).replace("dir/base.toml", "bad.toml");
        assert!(fragments.iter().all(|of| refused.contains(of)), "{constants}: {refused}");
        // The keys that need a wrong constant are not reported.
        let is_shown =
            fragments.iter().any(|of| of.contains("material.young") || of.contains("bad.toml:7"));
        assert_eq!(refused.contains("young"), is_shown, "{constants}: {refused}");
    }
    for (set, fragment) in [
        ("constants.width=2", "constants.width: the file has no such constant (known: E)"),
        ("width=2", "unknown key width"),
        ("EE=2", "unknown key EE; did you mean `E`?"),
        ("E='F'", "constants.E has the unknown variable `F`"),
        (
            "time.step='E*x'",
            "time.step must be a number: positive (s), or \"auto\", but \"E*x\" must be a constant",
        ),
    ] {
        let refused = with("E = 3", &[set]);
        assert!(
            refused.contains(fragment) && refused.contains(&format!("--set {set}")),
            "{refused}"
        );
    }
    let none = parse(BASE, &["constants.v=2"]).expect_err("there are no constants");
    assert!(none.contains("constants: the file has no such constant (there are none)"), "{none}");
}
