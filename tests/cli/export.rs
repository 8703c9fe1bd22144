//! The matrices of `signorini export`, solved by programs of other authors.

use crate::test_directory::{TestDirectory, sets};
use std::{collections::BTreeSet, fs, process::Command};

/// Two squares of different materials side by side, turned by 27°, so that no normal is parallel to an axis.
const BLOCK: &str = "c = Cos(0.47); s = Sin(0.47); h = 0.25;
Point(1) = {0, 0, 0, h}; Point(2) = {c, s, 0, h}; Point(3) = {2*c, 2*s, 0, h};
Point(4) = {2*c - s, 2*s + c, 0, h}; Point(5) = {c - s, s + c, 0, h}; Point(6) = {-s, c, 0, h};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 5}; Line(5) = {5, 6};
Line(6) = {6, 1}; Line(7) = {2, 5};
Curve Loop(1) = {1, 7, 5, 6}; Curve Loop(2) = {2, 3, 4, -7};
Plane Surface(1) = {1}; Plane Surface(2) = {2};
Physical Curve(\"base\") = {1, 2}; Physical Curve(\"end\") = {3}; Physical Curve(\"top\") = {4, 5};
Physical Curve(\"axis\") = {6}; Physical Surface(\"soft\") = {1}; Physical Surface(\"hard\") = {2};
";

const SCENE: &str = "mesh = { file = \"block.geo\" }
material = { young = 80, poisson = 0.3, plane = \"stress\", hard = { young = 200 } }
damage = { diffusion = 0.02, lambda_d = 0.1, lambda_u = 5e3, hard = { diffusion = 0.05 } }
time = { end = 0.4, step = 0.1, scheme = \"euler\" }
contact = { tolerance = 1e-11 }
[[boundary]]
name = \"top\"
pressure = \"3*t*(1 + x)\"
[[boundary]]
name = \"base\"
gap = \"0.03*(x - 0.6)^2\"
";

/// The answers of SciPy and NumPy to the exported matrices are those of the run, in u and in ζ: P1 and P2, with a symmetry
/// axis, prescribed displacements, a foundation with a normal of its own, two obstacles opposite each other, and a body
/// that nothing but its weight keeps from sliding.
#[test]
fn the_exported_matrices_have_the_answers_of_the_run() {
    let directory = TestDirectory::new();
    directory.write("block.geo", BLOCK);
    let supports = [
        ("axis", "[[boundary]]\nname = \"axis\"\nsymmetry = true\n"),
        ("pushed", "[[boundary]]\nname = \"end\"\ndisplacement = [\"-0.01*t\", \"0.004*t\"]\n"),
        (
            "between",
            "[[boundary]]\nname = \"end\"\ngap = \"0.01 - 0.05*t\"\n[[boundary]]\nname = \"axis\"\ngap = 0\nnormal = [-1, 0]\n",
        ),
        ("free", ""),
    ];
    let mut folders = Vec::new();
    for (name, support) in supports {
        let scene = format!("{SCENE}{support}");
        // Nothing resists sliding along a flat base: the pressure must not push that way.
        let scene = if name == "free" { scene.replace("0.03*(x - 0.6)^2", "0") } else { scene };
        directory.write(&format!("{name}.toml"), &scene);
        for (order, mass) in [("1", "consistent"), ("2", "lumped")] {
            let folder = format!("{name}{order}");
            let order = format!("discretisation.displacement={order}");
            let mass = format!("damage.mass=\"{mass}\"");
            let scene = format!("{name}.toml");
            let words = ["export", &scene, "--time", "0.3", "--out", &folder];
            let said = directory.say(&[&words[..], &sets(&[&order, &mass])].concat());
            assert_eq!(said.code, Some(0), "{said:?}");
            assert!(said.out.contains("t = 0.3: "), "{said:?}");
            folders.push(folder);
        }
    }
    let late = directory.say(&["export", "axis.toml", "--time", "0.5", "--out", "late"]);
    late.fails(2, &["--time 0.5: the run ends before, at t = 0.4"]);
    let python = std::env::var("PYTHON").unwrap_or("/usr/bin/python3".to_owned());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cli/export.py");
    let mut solver = Command::new(python);
    let solver = solver.arg(script).args(&folders).current_dir(directory.path("."));
    let solved = solver.output().expect("Python");
    let [out, err] = [solved.stdout, solved.stderr].map(|text| String::from_utf8(text).unwrap());
    if err.contains("No module named 'scipy'") {
        return eprintln!("skipped: no scipy (Debian: python3-scipy)");
    }
    assert!(solved.status.success() && !out.contains("WRONG"), "{out}{err}");
    assert!(out.contains(" open closed"), "{out}");
}

/// A folder has the files of the last export alone, and files of the user.
#[test]
fn an_export_replaces_the_one_before() {
    let directory = TestDirectory::new();
    directory.write("block.geo", BLOCK);
    let held = "[[boundary]]\nname = \"end\"\ndisplacement = [\"-0.01*t\", 0]\n";
    directory.write("whole.toml", &format!("{SCENE}{held}"));
    let without =
        |line: &&str| !["damage", "time", "contact"].iter().any(|of| line.starts_with(of));
    let [sound, _] = SCENE.split_once("[[boundary]]\nname = \"base\"").expect("a gap").into();
    let sound = Vec::from_iter(sound.lines().filter(without)).join("\n");
    let held = "[[boundary]]\nname = \"base\"\ndisplacement = [0, 0]\n";
    directory.write("sound.toml", &format!("{sound}\n{held}").replace("*t*", "*"));
    for (scene, has_damage) in [("whole.toml", true), ("sound.toml", false)] {
        let said = directory.say(&["export", scene, "--out", "ex"]);
        assert_eq!(said.code, Some(0), "{said:?}");
        directory.write("ex/notes.txt", "mine");
        let about: serde_json::Value =
            serde_json::from_str(&directory.read("ex/export.json")).expect("JSON");
        let files = about["files"].as_array().expect("names").iter();
        let files = files.map(|name| name.as_str().expect("a name").to_owned());
        let expected = files.chain(["README.md", "export.json", "notes.txt"].map(str::to_owned));
        let found = fs::read_dir(directory.path("ex")).expect("a folder");
        let found = found.map(|of| of.expect("an entry").file_name().into_string().expect("UTF-8"));
        let sorted = |names: &mut dyn Iterator<Item = String>| BTreeSet::from_iter(names);
        assert_eq!(sorted(&mut { found }), sorted(&mut { expected }), "{scene}");
        assert_eq!(directory.path("ex/M.mtx").exists(), has_damage);
        assert_eq!(directory.path("ex/g.mtx").exists(), has_damage);
    }
}

/// K has no entries for PETSc's viewers, which would write an empty file.
#[test]
fn a_viewer_of_k_is_refused_with_the_way_to_its_entries() {
    let directory = TestDirectory::new();
    let viewer = ["run", "scene.toml", "--", "-elastic_ksp_view_mat", "binary:K.bin"];
    directory.say(&viewer).fails(2, &["-elastic_ksp_view_mat", "signorini export"]);
    assert!(!directory.path("K.bin").exists());
}
