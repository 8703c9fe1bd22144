//! The viewer of report.html in a browser, where Chromium and Selenium are.

use crate::test_directory::{SCENE, TestDirectory, sets, square};
use std::process::Command;

/// A beam of 200 : 1 that is clamped on its left and pressed onto a foundation below.
const SLIM_GEOMETRY: &str = r#"
Point(1) = {0, 0, 0, 1};
Point(2) = {200, 0, 0, 1};
Point(3) = {200, 1, 0, 1};
Point(4) = {0, 1, 0, 1};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Physical Curve("bottom") = {1};
Physical Curve("top") = {3};
Physical Curve("left") = {4};
Physical Surface("beam") = {1};
"#;
const SLIM: &str = r#"
mesh = { file = "slim.geo" }
material = { young = 1e6, poisson = 0.3, plane = "strain" }
discretisation = { displacement = 2 }
time = { end = 1, step = 0.5 }
boundary = [
    { name = "left", displacement = [0, 0] },
    { name = "bottom", gap = 1 },
    { name = "top", pressure = "0.05*t" },
]
"#;

/// What viewer.py finds wrong with the page of a run, then the number of compared values; `None` without a browser.
fn looked_at(directory: &TestDirectory, arguments: &[&str]) -> Option<String> {
    let python = std::env::var("PYTHON").unwrap_or("/usr/bin/python3".to_owned());
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cli/viewer.py");
    let ran =
        Command::new(python).arg(program).args(arguments).current_dir(directory.path(".")).output();
    let ran = ran.expect("Python");
    let [out, err] = [ran.stdout, ran.stderr].map(|text| String::from_utf8(text).expect("UTF-8"));
    if err.contains("No module named")
        || err.contains("NoSuchDriverException")
        || err.contains("/usr/bin/chrom")
    {
        eprintln!("skipped: {err}");
        return None;
    }
    assert!(ran.status.success(), "{out}{err}");
    Some(out)
}

/// Values under the pointer are those of the VTU, at ten places per field and frame; slider, field and range do what they
/// say; the page fetches nothing and fits into narrow windows.
#[test]
fn the_viewer_shows_the_values_of_the_frames() {
    let directory = TestDirectory::new();
    for (degree, compared) in [("1", "366"), ("2", "402")] {
        let degree = format!("discretisation.displacement={degree}");
        directory.run(&["--set", "output.every=5", "--set", &degree]);
        if directory.say_python(&["report", "out/scene"]).is_none() {
            return;
        }
        let Some(found) = looked_at(&directory, &["out/scene"]) else { return };
        assert_eq!(found.trim(), compared, "{degree}");
    }
}

/// Names that are scripts are text to the viewer. It would report an alert as an unexpected one.
#[test]
fn names_that_are_scripts_run_none() {
    let name = "</script><script>alert(1)</script><img src=x onerror=alert(2)>";
    let directory = TestDirectory::new();
    let quoted = toml::Value::from(name).to_string();
    directory.write("square.msh", &square(4).replace("\"top\"", &format!("\"{name}\"")));
    let title = toml::Value::from(format!("{name}\" onload=alert(3) '")).to_string();
    let scene = SCENE.replace("\"top\"", &quoted).replace("\"Pressed square\"", &title);
    directory.write("scene.toml", &format!("{scene}\n[units]\nlength = {title}\n"));
    directory.run(&["--set", "output.every=5"]);
    if directory.say_python(&["report", "out/scene"]).is_none() {
        return;
    }
    let Some(found) = looked_at(&directory, &["out/scene"]) else { return };
    assert!(found.trim().parse::<usize>().is_ok_and(|count| count > 100), "{found}");
}

/// No text of the picture lies over another one or the colour bar, or is cut off, in windows of three widths; the extremes have
/// labels. A body of 200 : 1 is stretched.
#[test]
fn labels_of_the_viewer_do_not_overlap() {
    let directory = TestDirectory::new();
    directory.write("slim.geo", SLIM_GEOMETRY);
    directory.write("slim.toml", SLIM);
    let [lshape, hertz] =
        ["lshape", "hertz"].map(|name| format!("{}/geo/{name}.toml", env!("CARGO_MANIFEST_DIR")));
    let coarse = ["mesh.size=1", "mesh.parameters.grading=4", "time.step=0.5"];
    let cases = [
        (&lshape[..], "lshape", &coarse[..]),
        (&hertz[..], "hertz", &[][..]),
        ("slim.toml", "slim", &[][..]),
    ];
    for (scene, folder, set) in cases {
        let said = directory.say(&[&["run", scene, "--out", folder], &sets(set)[..]].concat());
        assert_eq!(said.code, Some(0), "{said:?}");
        if directory.say_python(&["report", folder]).is_none() {
            return;
        }
        let Some(found) = looked_at(&directory, &[folder, "--labels"]) else { return };
        assert!(found.trim().parse::<usize>().is_ok_and(|count| count > 500), "{found}");
    }
}
