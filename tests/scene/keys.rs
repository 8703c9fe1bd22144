//! The schema of scenes, by which they are read, is complete.

use crate::BASE;
use serde_json::Value;
use signorini::scene::Scene;
use std::path::Path;

fn schema() -> Value {
    serde_json::from_str(include_str!("../../geo/scene.schema.json")).expect("JSON")
}

/// A key, or the key that it refers to without its default, as it is in a surface.
fn resolved(key: &Value) -> Value {
    let Some(path) = key["$ref"].as_str() else { return key.clone() };
    let mut resolved = schema().pointer(&path[1..]).expect("a key").clone();
    let of = resolved.as_object_mut().expect("a key");
    of.remove("default");
    of.extend(key.as_object().expect("a key").clone());
    resolved
}

/// Paths of all keys that are no tables, with what is told of them and whether they are required.
fn keys() -> Vec<(String, Value, bool)> {
    fn walk(path: &str, table: &Value, keys: &mut Vec<(String, Value, bool)>) {
        for (name, key) in table["properties"].as_object().expect("keys") {
            let key = &resolved(key);
            let required =
                table["required"].as_array().is_some_and(|r| r.contains(&name.as_str().into()));
            assert!(key["description"].is_string(), "{path}{name} has no meaning");
            let told = !key["default"].is_null() || !key["absent"].is_null();
            assert!(required != told, "{path}{name}: either required, or its default is told");
            match [key, &key["items"]].into_iter().find(|table| table["properties"].is_object()) {
                Some(table) => walk(&format!("{path}{name}."), table, keys),
                None => keys.push((format!("{path}{name}"), key.clone(), required)),
            }
            let named = &key["additionalProperties"];
            if named["properties"].is_object() {
                assert!(named["description"].is_string(), "{path}{name}.* has no meaning");
                walk(&format!("{path}{name}.core."), named, keys);
            }
        }
    }
    let mut all = Vec::new();
    walk("", &schema(), &mut all);
    all
}

/// The complete scene with a key of it set to a value, or without it; of a boundary's key on the one
/// where it can stand.
fn with(path: &str, value: Option<&str>) -> Result<Scene, String> {
    let paths: Vec<Vec<&str>> = match path.strip_prefix("boundary.") {
        None => vec![path.split('.').collect()],
        Some(key) => {
            ["clamp", "load", "foundation", "axis"].map(|at| vec!["boundary", at, key]).to_vec()
        }
    };
    if let Some(key) = path.strip_prefix("probe.") {
        let all = [("name", "'p'"), ("point", "[0, 0]")].into_iter().chain(value.map(|v| (key, v)));
        let given = all.enumerate().filter(|(i, (name, _))| *i == 2 || *name != key);
        let given = given.map(|(_, (name, value))| format!("{name} = {value}"));
        let set = format!("probe = [{{ {} }}]", given.collect::<Vec<_>>().join(", "));
        let scene = Scene::parse(BASE, Path::new("base.toml"), &[set]);
        return scene.map_err(|error| error.to_string());
    }
    // Only a mesh with arrays has this key, and only geometries have the others.
    let base = match path {
        "mesh.materials" => {
            BASE.replace("\"base.geo\"\nsize = 0.25\nparameters = { grading = 3 }", "\"base.vtu\"")
        }
        _ => BASE.to_owned(),
    };
    let read = |path: &Vec<&str>| {
        let mut scene: toml::Table = base.parse().expect("TOML");
        let mut sets = Vec::new();
        if path[..] == ["time", "tolerance"] {
            sets.push("time.step='auto'".to_owned());
        }
        if path[..] == ["body", "gravity"] {
            sets.push("material.density=1".to_owned());
        }
        match value {
            Some(value) => sets.push(format!("{}={value}", path.join("."))),
            None => remove(&mut scene, path),
        }
        Scene::parse(&scene.to_string(), Path::new("base.toml"), &sets)
    };
    let scenes = paths.iter().map(|path| read(path).map_err(|error| error.to_string()));
    scenes.reduce(Result::or).expect("a path")
}

fn remove(scene: &mut toml::Table, path: &[&str]) {
    match path {
        [key] => _ = scene.remove(*key),
        ["boundary", name, key] => {
            let all = scene["boundary"].as_array_mut().expect("boundaries").iter_mut();
            let mut all = all.map(|boundary| boundary.as_table_mut().expect("a table"));
            all.find(|boundary| boundary["name"].as_str() == Some(name))
                .expect("named")
                .remove(*key);
        }
        [table, below @ ..] => {
            if let Some(toml::Value::Table(table)) = scene.get_mut(*table) {
                remove(table, below);
            }
        }
        [] => {}
    }
}

/// All that a scene says, without the text it was read from.
pub fn content(scene: &Scene) -> String {
    format!("{scene:?}").split("text: SceneText").next().expect("a part").to_owned()
}

#[test]
fn every_key_has_a_meaning_and_an_example_that_is_read() {
    for (path, key, _) in keys() {
        let example = key["example"].as_str().unwrap_or_else(|| panic!("{path}: no example"));
        with(&path, Some(example)).unwrap_or_else(|error| panic!("{path} = {example}: {error}"));
    }
}

#[test]
fn defaults_are_what_is_read_where_a_key_is_left_out() {
    let checked = keys().into_iter().filter(|(path, key, required)| {
        let (absent, default) = (with(path, None), &key["default"]);
        if *required {
            // A boundary without its name is none of the four.
            assert!(absent.is_err() || path == "boundary.name", "{path} is not required");
        } else if !default.is_null() && !path.starts_with("boundary.") {
            let absent = absent.unwrap_or_else(|error| panic!("{path} left out: {error}"));
            let default = with(path, Some(&default.to_string())).expect("the default is read");
            assert_eq!(content(&absent), content(&default), "{path}");
            return true;
        }
        false
    });
    assert!(checked.count() >= 7);
}

#[test]
fn the_rule_of_a_number_in_words_is_that_of_its_bounds() {
    let bounds = ["minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum"];
    let numbers = keys()
        .into_iter()
        .filter(|(_, key, _)| key["type"][0] == "number" && key["format"].is_null());
    let checked = numbers.map(|(path, key, _)| {
        let rule = key["values"].as_str().expect("words").split(" (").next().expect("a rule");
        let expected = match rule {
            "positive" => [None, Some(0.0), None, None],
            "positive, at most 1e100" => [None, Some(0.0), Some(1e100), None],
            "at least 0" => [Some(0.0), None, None, None],
            "at least 0, at most 1e100" => [Some(0.0), None, Some(1e100), None],
            "at least 1e-5" => [Some(1e-5), None, None, Some(1.0)],
            "between 1e-5 and 0.5" => [Some(1e-5), None, Some(0.5), None],
            "between 0 and 1, both excluded" => [None, Some(0.0), None, Some(1.0)],
            "between -1 and 0.5, both excluded" => [None, Some(-1.0), None, Some(0.5)],
            "1 or 2" => [None; 4],
            other => panic!("{path}: {other}"),
        };
        assert_eq!(bounds.map(|bound| key[bound].as_f64()), expected, "{path}: {rule}");
    });
    assert!(checked.count() >= 15);
}
