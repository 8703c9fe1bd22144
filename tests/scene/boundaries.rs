//! Malformed boundaries and the expressions on them.

use crate::{BASE, errors::check};
use signorini::scene::Scene;
use std::path::Path;

#[test]
fn every_rule_names_file_line_and_boundary() {
    check(&[
        ("\"-80*t\"", "\"1/0\"", &["bad.toml:33: boundary.load.traction[1] must be finite"]),
        (
            "\"-80*t\"",
            "nan",
            &["bad.toml:33: boundary.load.traction[1] must be finite, but is NaN"],
        ),
        ("\"-80*t\"", "\"free\"", &["bad.toml:33: boundary.load.traction[1] has the unknown"]),
        ("\"-80*t\"", "\"sn(t)\"", &["bad.toml:33", "unknown function `sn`; did you mean `sin`?"]),
        (
            "name = \"load\"",
            "name = \"clamp\"",
            &["bad.toml:31: boundary.clamp is given twice, first at bad.toml:28"],
        ),
        (
            "displacement = [\"0\", \"0\"]",
            "displacement = [\"free\", \"free\"]",
            &["bad.toml:30: boundary.clamp.displacement is \"free\" in both components"],
        ),
        (
            "displacement = [\"0\", \"0\"]",
            "displacement = [\"0\"]",
            &["bad.toml:30: boundary.clamp.displacement must have two components, but has 1"],
        ),
        (
            "displacement = [\"0\", \"0\"]",
            "displacement = [0, 0]\ngap = 0",
            &["bad.toml:28: boundary.clamp has a displacement and a gap"],
        ),
        (
            "displacement = [\"0\", \"0\"]",
            "displacement = [0, 0]\nsymmetry = true",
            &["bad.toml:28: boundary.clamp has a displacement and a symmetry"],
        ),
        (
            "displacement = [\"0\", \"0\"]",
            "displacement = [0, 0]\ntraction = [0, 1]",
            &[
                "bad.toml:28: boundary.clamp has both displacements prescribed",
                "and a traction; only",
            ],
        ),
        ("displacement = [\"0\", \"0\"]", "", &["bad.toml:28: boundary.clamp has nothing in it"]),
        ("symmetry = true", "symmetry = false", &["bad.toml:39: boundary.axis has nothing in it"]),
        (
            "symmetry = true",
            "symmetry = true\ngap = 0",
            &["bad.toml:39: boundary.axis has a symmetry and a gap"],
        ),
        ("gap = \"x^2\"\n", "", &["bad.toml:36: boundary.foundation.normal needs a gap"]),
        (
            "[\"3\", \"-4\"]",
            "[0, \"1-1\"]",
            &["bad.toml:37: boundary.foundation.normal has no direction"],
        ),
        (
            "[\"3\", \"-4\"]",
            "[0, \"x\"]",
            &["bad.toml:37: boundary.foundation.normal[1] must be a constant"],
        ),
    ]);
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
    assert!(message.contains("probe[0].name is empty"), "{message}");
}
