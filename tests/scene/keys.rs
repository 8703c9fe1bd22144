//! The schema of scenes says what their reader does.

use crate::BASE;
use serde_json::Value;
use signorini::scene::Scene;
use std::path::Path;

fn schema() -> Value {
    serde_json::from_str(include_str!("../../geo/scene.schema.json")).expect("JSON")
}

/// Paths of all keys that are no tables, with what is told of them and whether they are required.
fn keys() -> Vec<(String, Value, bool)> {
    fn walk(path: &str, table: &Value, keys: &mut Vec<(String, Value, bool)>) {
        for (name, key) in table["properties"].as_object().expect("keys") {
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
    let read = |path: &Vec<&str>| {
        let mut scene: toml::Table = BASE.parse().expect("TOML");
        let mut sets = Vec::new();
        if path[..] == ["time", "tolerance"] {
            sets.push("time.step='auto'".to_owned());
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
fn content(scene: &Scene) -> String {
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
fn every_table_has_the_keys_that_its_reader_knows_and_no_others() {
    fn check(path: &str, table: &Value) {
        let error = with(&format!("{path}zzz"), Some("1")).expect_err("unknown");
        let known = error.split_once("(known: ").and_then(|(_, rest)| rest.split_once(')'));
        let mut known: Vec<_> = known.expect(&error).0.split(", ").collect();
        let properties = table["properties"].as_object().expect("keys");
        let mut told: Vec<_> = properties.keys().map(String::as_str).collect();
        known.sort_unstable();
        told.sort_unstable();
        assert_eq!(known, told, "{path}: {error}");
        for (name, key) in properties {
            for (content, below) in [
                (key, format!("{path}{name}.")),
                (&key["items"], format!("{path}{name}.")),
                (&key["additionalProperties"], format!("{path}{name}.core.")),
            ] {
                if content["properties"].is_object() {
                    check(&below, content);
                }
            }
        }
    }
    check("", &schema());
}

#[test]
fn the_rule_of_a_number_is_the_one_that_refuses_it() {
    let numbers = keys().into_iter().filter(|(_, key, _)| {
        key["type"] == "number" && key["values"].is_string() && key["minItems"].is_null()
    });
    let checked = numbers.map(|(path, key, _)| {
        let error = with(&path, Some("nan")).expect_err(&path);
        let rule = key["values"].as_str().expect("words");
        let rule = rule.split(" (").next().expect("the rule without its unit");
        assert!(error.contains(rule), "{path}, {rule}: {error}");
    });
    assert!(checked.count() >= 15);
}
