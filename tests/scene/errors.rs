//! Scenes that are not TOML, or with unknown, missing or mistyped keys; how all refusals are checked.

use std::path::Path;

use signorini::scene::Scene;

use crate::BASE;

fn refusal(text: &str) -> String {
    match Scene::parse(text, Path::new("bad.toml"), &[]) {
        Ok(_) => panic!("this was accepted:\n{text}"),
        Err(error) => error.to_string(),
    }
}

fn first_line(text: &str) -> String {
    refusal(text).lines().next().expect("a line").to_owned()
}

/// (a text of the base scene, what replaces it, what the message says, from the place on)
const CASES: &[(&str, &str, &[&str])] = &[
    // Not TOML, unknown, missing, of the wrong type.
    ("[mesh]", "[mesh", &["bad.toml:2: not valid TOML"]),
    ("young = 1e6", "young = 1e6\nyoung = 2e6", &["bad.toml:8: not valid TOML: duplicate key"]),
    (
        "lambda_u",
        "lamda_u",
        &["bad.toml:13: unknown key damage.lamda_u", "did you mean `lambda_u`?", "strain_cap"],
    ),
    ("[contact]", "[contcat]", &["bad.toml:23: unknown key contcat", "did you mean `contact`?"]),
    ("every", "evry", &["bad.toml:27: unknown key output.evry", "did you mean `every`?"]),
    (
        "solver",
        "qqq",
        &[
            "bad.toml:24: unknown key contact.qqq (known: solver, tolerance, rescue, penalty_duality)",
        ],
    ),
    (
        "traction = [\"0\", \"-80*t\"]",
        "tracton = [\"0\", \"-80*t\"]",
        &["bad.toml:33: unknown key boundary.load.tracton", "did you mean `traction`?"],
    ),
    ("young = 1e6\n", "", &["bad.toml:6: material.young is required but missing"]),
    ("step = 0.01\n", "", &["bad.toml:18: time.step is required but missing"]),
    ("file = \"base.geo\"\n", "", &["bad.toml:2: mesh.file is required but missing"]),
    ("plane = \"stress\"\n", "", &["bad.toml:6: material.plane is required but missing"]),
    ("name = \"load\"\n", "", &["bad.toml:31: boundary[1].name is required but missing"]),
    ("[material]", "[body.extra]", &["bad.toml:6: unknown key body.extra"]),
    ("young = 1e6", "young = \"1e6\"", &["bad.toml:7: material.young must be a number"]),
    ("\"stress\"", "\"strss\"", &["bad.toml:9: material.plane must be \"stress\" or \"strain\""]),
    (
        "\"1 - 0.1*x\"",
        "\"1 - 0.1*x\"\nmass = \"lump\"",
        &["bad.toml:18: damage.mass must be \"consistent\" or \"lumped\""],
    ),
    (
        "tao:tron",
        "tao:trn",
        &["bad.toml:24: contact.solver is unknown: there is no contact solver `tao:trn`", "bqpip"],
    ),
    (
        "every = 5",
        "every = 0.5",
        &["bad.toml:27: output.every must be a whole number, at least 1, but is "],
    ),
    (
        "every = 5",
        "every = -5",
        &["bad.toml:27: output.every must be a whole number, at least 1, but is "],
    ),
    (
        "every = 5",
        "every = 0",
        &["bad.toml:27: output.every must be a whole number, at least 1, but is 0"],
    ),
    ("[body]\nforce", "[[body]]\nforce", &["bad.toml:21: body must be a table"]),
    (
        "symmetry = true",
        "symmetry = \"yes\"",
        &["bad.toml:41: boundary.axis.symmetry must be true or false"],
    ),
    (
        "gap = \"x^2\"",
        "gap = true",
        &["bad.toml:36: boundary.foundation.gap must be a number or an expression"],
    ),
    (
        "step = 0.01",
        "step = 0.01\nscheme = \"bdf3\"",
        &["bad.toml:21: time.scheme must be \"euler\" or \"bdf2\""],
    ),
    (
        "step = 0.01",
        "step = \"auto\"\nscheme = \"euler\"",
        &["bad.toml:21: time.scheme must be \"bdf2\" where step = \"auto\""],
    ),
    ("[0, \"-t\"]", "\"-t\"", &["bad.toml:22: body.force must be an array"]),
    ("[0, \"-t\"]", "[0, 1, 2]", &["bad.toml:22: body.force must have two components, but has 3"]),
    ("[0, \"-t\"]", "[0, [1]]", &["bad.toml:22: body.force[1] must be a number or an expression"]),
    ("end = 1.0\nstep = 0.01", "", &["bad.toml:18: time.end is required but missing"]),
    (
        "[material]",
        "[discretisation]\ndisplacement = \"2\"\n[material]",
        &["bad.toml:7: discretisation.displacement must be 1 or 2, but is \"2\""],
    ),
    (
        "[material]",
        "[discretisation]\ndisplacment = 2\n[material]",
        &["bad.toml:7: unknown key discretisation.displacment", "did you mean `displacement`?"],
    ),
    (
        "[material]",
        "[discretization]\ndisplacement = 2\n[material]",
        &["bad.toml:6: unknown key discretization", "did you mean `discretisation`?"],
    ),
    ("[mesh]", "discretisation = 2\n[mesh]", &["bad.toml:2: discretisation must be a table"]),
    ("title = \"Base\"", "title = 3", &["bad.toml:1: title must be a string"]),
    // Decimal commas.
    (
        "young = 1e6",
        "young = 1,5e6 # Pa",
        &["bad.toml:7: young is 1,5e6: write a decimal point, young = 1.5e6"],
    ),
    (
        "force = [0, \"-t\"]",
        "force = [0, \"-0,5*t\"]",
        &["bad.toml:22: body.force[1] has `,` at column 3", "expected; write a decimal point"],
    ),
    ("young = 1e6", "young = \"1,5\"", &["but is \"1,5\": write a decimal point"]),
];

#[test]
fn a_decimal_comma_is_one_problem() {
    let mesh = "[mesh]\nfile = \"base.geo\"\nsize = 0.25\n";
    assert!(BASE.contains("[mesh]\nfile"), "{BASE}");
    let text = BASE.replacen("young = 1e6", "young = -1,5", 1);
    assert_eq!(refusal(&text).matches("error").count(), 0, "only one: {}", refusal(&text));
    // What else is in the line of a table in braces only seems to be wrong.
    let text = format!("{mesh}material = {{ young = 1,5, poisson = 0.3, plane = \"strain\" }}\n");
    assert_eq!(first_line(&text), "bad.toml:4: young is 1,5: write a decimal point, young = 1.5");
    assert!(!refusal(&text).contains("not valid TOML"), "{}", refusal(&text));
}

/// Changes one text of the base scene at a time and looks for what is said about it, the line
/// underlined.
pub fn check(cases: &[(&str, &str, &[&str])]) {
    for (old, new, fragments) in cases {
        assert!(BASE.contains(old), "the base scene has no `{old}`");
        let message = refusal(&BASE.replacen(old, new, 1));
        assert!(
            message.lines().any(|line| line.contains(" | ") && line.ends_with('^')),
            "{message}"
        );
        for fragment in *fragments {
            assert!(message.contains(fragment), "`{old}` → `{new}`\n{message}\nlacks {fragment}");
        }
    }
}

#[test]
fn every_rule_names_file_line_and_key() {
    check(CASES);
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
error: bad.toml:33: boundary.load.traction[1] has the unknown variable `s` (known: x, y, t, pi, sin, cos, tan, sqrt, exp, log, abs, min, max, atan2, if, table)
   |
33 | traction = ["0", "-80*s"]
   |                  ^^^^^^^
error: bad.toml:39: boundary.axis has a symmetry and a gap; only one of them can hold
   |
39 | [[boundary]]
   | ^^^^^^^^^^^^"#
    );
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
fn very_many_problems_are_counted() {
    let text = "nonsense\n".repeat(100);
    let message = refusal(&text);
    assert!(message.ends_with("error: there are 80 more problems"), "{message}");
}
