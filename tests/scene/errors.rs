//! Scenes that are not TOML, or with unknown, missing or mistyped keys; how all refusals are checked.

use std::{path::Path, str::FromStr};

use signorini::scene::{SCHEMA, Scene};

use crate::{BASE, mesh::square};

fn refusal(text: &str) -> String {
    refusal_with(text, &[])
}

/// The same with arguments of `--set`.
fn refusal_with(text: &str, sets: &[String]) -> String {
    let scene = Scene::parse(text, Path::new("bad.toml"), sets);
    match scene.and_then(|scene| scene.check_mesh(&square())) {
        Ok(()) => panic!("this was accepted:\n{text}\n{sets:?}"),
        Err(error) => error.to_string(),
    }
}

fn first_line(text: &str) -> String {
    refusal(text).lines().next().expect("a line").to_owned()
}

#[test]
fn a_decimal_comma_is_one_problem() {
    let mesh = "[mesh]\nfile = \"base.geo\"\nsize = 0.25\n";
    assert!(BASE.contains("[mesh]\nfile"), "{BASE}");
    let text = BASE.replacen("young = 1e6", "young = -1,5", 1);
    assert_eq!(refusal(&text).matches("error").count(), 0, "only one: {}", refusal(&text));
    // What else is in the line of a table in braces only seems to be wrong.
    let text = format!("{mesh}material = {{ young = 1,5, poisson = 0.3, plane = \"strain\" }}\n");
    assert!(first_line(&text).starts_with("bad.toml:4: not valid TOML: "), "{}", refusal(&text));
    assert!(first_line(&text).contains("write numbers as 0.5"), "{}", refusal(&text));
    assert_eq!(refusal(&text).matches("bad.toml:4").count(), 1, "{}", refusal(&text));
}

/// Every row of the table is refused with its line underlined.
#[test]
fn every_rule_names_file_line_and_key() {
    let rows = include_str!("refused.txt").lines().filter(|row| !row.starts_with('#'));
    for row in rows {
        let (refusal, message) = match row.split(" => ").collect::<Vec<_>>()[..] {
            [old, new, message] => {
                let [old, new] = [old, new].map(|text| text.replace("\\n", "\n"));
                assert!(BASE.contains(&old), "the base scene has no `{old}`");
                let refusal = refusal(&BASE.replacen(&old, &new, 1));
                let is_line = |line: &str| line.contains(" | ") && line.ends_with('^');
                assert!(refusal.lines().any(is_line), "{refusal}");
                (refusal, message)
            }
            [set, message] => {
                let set = set.strip_prefix("--set ").expect("an argument");
                (refusal_with(BASE, &["title=first".to_owned(), set.to_owned()]), message)
            }
            _ => panic!("no row: {row}"),
        };
        for fragment in message.split(" & ") {
            let place = format!("bad.toml:{fragment}");
            let expected = if fragment.starts_with(char::is_numeric) { &place } else { fragment };
            assert!(refusal.contains(expected), "{row}\n{refusal}\nlacks {expected}");
        }
    }
}

#[test]
fn an_array_does_not_stand_for_a_table() {
    // serde would fill the table by position.
    let time = BASE.find("[time]").expect("in the base scene");
    let body = BASE.find("[body]").expect("in the base scene");
    let text = format!("time = [1, 0.01]\n{}{}", &BASE[..time], &BASE[body..]);
    assert_eq!(first_line(&text), "bad.toml:1: time must be a table");
    let end = BASE.find("[[boundary]]").expect("in the base scene");
    let text = format!("boundary = [\n['load']]\n{}", &BASE[..end]);
    assert_eq!(first_line(&text), "bad.toml:2: boundary[0] must be a table");
}

#[test]
fn whole_tables_may_be_missing() {
    let without = |table: &str, next: &str| {
        let start = BASE.find(table).expect("in the base scene");
        let end = BASE.find(next).expect("in the base scene");
        refusal(&format!("{}{}", &BASE[..start], &BASE[end..]))
    };
    assert_eq!(without("[mesh]", "[material]"), "bad.toml: mesh is required but missing");
    assert_eq!(without("[material]", "[damage]"), "bad.toml: material is required but missing");
    let end = BASE.find("[[boundary]]").expect("in the base scene");
    assert_eq!(refusal(&BASE[..end]), "bad.toml: boundary is required but missing");
    let none = format!("boundary = []\n{}", &BASE[..end]);
    assert_eq!(first_line(&none), "bad.toml:1: boundary must hold at least one boundary");
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let path = Path::new("nowhere/none.toml");
    let error = Scene::read(path, &[]).expect_err("there is no such file");
    assert!(error.to_string().starts_with("nowhere/none.toml: the scene cannot be read"));
}

// A misspelt key is told once: neither as missing, too, nor as a boundary with nothing in it.
#[test]
fn all_problems_are_told_at_once_with_their_lines_underlined() {
    let text = BASE
        .replace("young = 1e6", "young = -3")
        .replace("lambda_u", "lamda_u")
        .replace("step = 0.01", "step = \"fast\"")
        .replace("\"-80*t\"", "\"-80*s\"")
        .replace("symmetry = true", "symmetry = true\ngap = 0");
    assert_eq!(
        refusal(&text),
        r#"bad.toml:7: material.young must be positive, at most 1e100 (Pa), but is -3
  |
7 | young = -3
  | ^^^^^^^^^^
error: bad.toml:13: unknown key damage.lamda_u; did you mean `lambda_u`? (known: diffusion, lambda_d, lambda_u, lambda_w, strain_cap, threshold, initial, mass)
   |
13 | lamda_u = 1e3
   | ^^^^^^^^^^^^^
error: bad.toml:20: time.step must be a number: positive (s), or "auto", but is "fast"
   |
20 | step = "fast"
   | ^^^^^^^^^^^^^
error: bad.toml:33: boundary.load.traction[1] has the unknown variable `s` (known: x, y, t, pi, sin, cos, tan, sqrt, exp, log, abs, min, max, atan2, if, table, spline, pchip)
   |
33 | traction = ["0", "-80*s"]
   |                       ^
error: bad.toml:39: boundary.axis has a symmetry and a gap; an edge can have only one of them: give the other to another boundary, which may end at this one
   |
39 | [[boundary]]
   | ^^^^^^^^^^^^"#
    );
}

/// The caret stands below the wrong column, name or missing end of an expression, in both kinds of quotes; below all of it
/// where escapes move the columns.
#[test]
fn the_wrong_place_in_an_expression_is_underlined() {
    for (value, carets) in [
        (r#""x + sin(""#, "         ^"),
        (r#""xx + sin(""#, " ^^"),
        (r#"'sin(x) + s'"#, "          ^"),
        (r#""1 - (x""#, "       ^"),
        (r#""é + 3 )""#, " ^"),
        (r#""3*t )""#, "     ^"),
        (r#""\u0033 )""#, "^^^^^^^^^^"),
    ] {
        let text = BASE.replacen("\"-80*t\"", value, 1);
        let refusal = refusal(&text);
        let line = refusal.lines().find(|line| line.ends_with('^')).expect("carets");
        let place = line.split_once("| ").expect("a margin").1;
        let before = "traction = [\"0\", ";
        assert_eq!(place.strip_prefix(&" ".repeat(before.len())), Some(carets), "{refusal}");
    }
}

#[test]
fn all_syntax_errors_are_told_at_once() {
    let text = BASE.replace("young = 1e6", "young = ").replace("end = 1.0", "end 1.0");
    let message = refusal(&text);
    assert!(message.starts_with("bad.toml:7: not valid TOML: "), "{message}");
    assert!(message.contains("\nerror: bad.toml:19: not valid TOML: "), "{message}");
    assert_eq!(message.matches("not valid TOML").count(), 2, "{message}");
}

#[test]
fn of_very_many_problems_the_first_are_told() {
    let message = refusal(&"nonsense\n".repeat(100));
    assert_eq!(message.matches("not valid TOML").count(), 20, "{message}");
}

#[test]
fn names_may_look_like_keys_and_are_not_empty() {
    let name = |new: &str| {
        let text = BASE.replacen("name = \"axis\"", &format!("name = \"{new}\""), 1);
        Scene::parse(&text, Path::new("named.toml"), &[])
    };
    assert_eq!(name("foundation.gap").expect("another boundary").boundaries.len(), 4);
    let probe = ["probe=[{name='', point=[0, 0]}]".to_owned()];
    let refused = Scene::parse(BASE, Path::new("p.toml"), &probe);
    let message = refused.expect_err("no name").to_string();
    assert!(message.contains("probe[0].name must be a string that is not empty"), "{message}");
}

/// The keys of the scene's schema below a table; those of the document for "".
fn keys_of(table: &str) -> Vec<String> {
    let schema: serde_json::Value = serde_json::from_str(SCHEMA).expect("JSON");
    let keys = if table.is_empty() {
        &schema["properties"]
    } else {
        &schema["properties"][table]["properties"]
    };
    keys.as_object().expect("keys").keys().cloned().collect()
}

/// Every key of a scene in every two forms that TOML does not allow together: the message is about this key, not about
/// the grammar of TOML.
#[test]
fn a_key_in_two_forms_is_named() {
    for key in keys_of("") {
        let forms =
            ["= 1", "= { a = 1 }", "= [{ a = 1 }]", ".a = 1"].map(|rest| format!("{key} {rest}\n"));
        let headers =
            ["[K]\na = 1\n", "[[K]]\na = 1\n", "[K.part]\na = 1\n"].map(|h| h.replace('K', &key));
        for first in forms.iter().chain(&headers) {
            for second in forms.iter().filter(|_| !first.starts_with('[')).chain(&headers) {
                let text = format!("{first}{second}");
                if toml::Table::from_str(&text).is_ok() {
                    continue;
                }
                let line = 1 + first.lines().count();
                let refused = refusal(&text);
                let names = [&*key, "a", "part"].map(|of| format!("bad.toml:{line}: {of} "));
                assert!(names.iter().any(|name| refused.starts_with(name)), "{text}{refused}");
                let jargon = ["duplicate key", "extend", "inline table"];
                assert!(jargon.iter().all(|words| !refused.contains(words)), "{text}{refused}");
            }
        }
    }
}

/// No surface may have the name of a key beside its table, whether the scene has the key or not.
#[test]
fn a_surface_with_the_name_of_a_key_needs_another_name() {
    for table in ["material", "damage"] {
        for key in keys_of(table) {
            let refused = refusal(&format!("{BASE}\n[{table}.{key}]\nyoung = 1\n"));
            assert!(refused.contains("surface another name"), "{table}.{key}: {refused}");
        }
    }
}
