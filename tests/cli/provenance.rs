//! Results tell what made them, and can be made again from what they hold.

use crate::{
    meshes::GEO,
    test_directory::{TestDirectory, square},
};
use std::{fs, path::Path, process::Command};

#[test]
fn the_scene_in_the_results_runs_again_to_the_same_answer() {
    let test_directory = TestDirectory::new();
    test_directory.write("meshes/fine.msh", &square(8));
    test_directory.write("geo/square.geo", GEO);
    test_directory.write("loads/top.csv", "0, 0\n1, -2\n");
    for (options, overridden) in [
        (vec!["--set", "time.step=0.25", "--set", "boundary.top.traction=[0, '-2*t']"], "-2*t"),
        (
            vec!["--set", "boundary.top.traction=[0, 'table(\"loads/top.csv\")']"],
            "scene-table1.csv",
        ),
        (vec!["--mesh", "meshes/fine.msh", "--solver", "tao"], "scene.msh"),
        (vec!["--set", "mesh.file=geo/square.geo", "--set", "mesh.size=0.5"], "scene.geo"),
    ] {
        test_directory.run(&[&options[..], &["--out", "first"]].concat());
        let scene = test_directory.read("first/scene.toml");
        assert!(scene.contains(overridden), "{scene}");
        let full = test_directory.path(".").display().to_string();
        assert!(!scene.contains(full.trim_end_matches('.')), "{scene}");
        // It is moved to a place where nothing else of the first run is.
        let elsewhere = TestDirectory::new();
        for name in test_directory.names("first").iter().filter(|name| name.starts_with("scene")) {
            elsewhere
                .write(&format!("first/{name}"), &test_directory.read(&format!("first/{name}")));
        }
        let again = elsewhere.say(&["run", "first/scene.toml", "--out", "again"]);
        assert_eq!(again.code, Some(0), "{again:?}");
        for name in ["history.csv", "summary.json"] {
            let [first, second] = [test_directory.results("first"), elsewhere.results("again")]
                .map(|mut r| r.remove(name));
            assert!(first == second, "{name}: {first:?} {second:?}");
        }
        assert_eq!(elsewhere.read("again/scene.toml"), scene);
    }
}

#[test]
fn a_scene_of_the_user_is_not_overwritten() {
    let test_directory = TestDirectory::new();
    let before = test_directory.everything();
    let refused = test_directory.say(&["run", "scene.toml", "--out", "."]);
    refused.fails(2, &["scene.toml", "no run left it there", "--out"]);
    assert_eq!(test_directory.everything(), before);
    test_directory.write("mine/history.csv", "of another program");
    let refused = test_directory.say(&["run", "scene.toml", "--out", "mine"]);
    refused.fails(2, &["mine/history.csv", "no run left it there"]);
    let mesh = test_directory.read("square.msh");
    test_directory.write("meshes/mesh.msh", &mesh);
    let arguments = ["run", "scene.toml", "--accuracy", "0.1", "--out", "meshes"];
    test_directory.say(&arguments).fails(2, &["meshes/mesh.msh was left there by no run", "--out"]);
    assert!(test_directory.names("meshes") == ["mesh.msh"]);
    assert!(test_directory.read("meshes/mesh.msh") == mesh);
    assert_eq!(test_directory.read("mine/history.csv"), "of another program");
    // That of an earlier run is replaced, also by itself.
    test_directory.run(&["--out", "out"]);
    let again = test_directory.say(&["run", "out/scene.toml", "--out", "out"]);
    assert_eq!(again.code, Some(0), "{again:?}");
}

#[test]
fn the_summary_tells_the_program_the_time_the_place_and_the_command() {
    let test_directory = TestDirectory::new();
    test_directory.run(&["--set", "time.step=0.5"]);
    let provenance = &test_directory.summary("out/scene")["provenance"];
    assert_eq!(provenance["version"], env!("CARGO_PKG_VERSION"));
    let date = provenance["date"].as_str().expect("a date");
    assert!(date.len() == 20 && date.starts_with("20") && date.ends_with('Z'), "{date}");
    let command = provenance["command"].as_array().expect("words");
    assert_eq!(command[1..], ["run", "scene.toml", "--set", "time.step=0.5"]);
    let directory = provenance["directory"].as_str().expect("a path");
    assert!(Path::new(directory).join("scene.toml").exists(), "{directory}");
    assert!(provenance["machine"]["cores"].as_u64() > Some(0));
}

/// The version and the date of a release stand in several files, because other programs read these, and in the tag. After a release the
/// version is X.Y.Z-dev, above the released one; it has no date.
#[test]
fn all_files_and_the_tag_have_one_version_and_one_date_of_the_release() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let lines_of = |file: &str| {
        let text = fs::read_to_string(root.join(file));
        text.expect("a file of the repository").lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let after = |file: &str, start: &str| {
        let lines = lines_of(file).into_iter();
        let found = lines.filter_map(|line| Some(line.strip_prefix(start)?.replace('"', "")));
        found.collect::<Vec<_>>()
    };
    let version = env!("CARGO_PKG_VERSION");
    // The form of Python (PEP 440).
    assert_eq!(after("scripts/pyproject.toml", "version = "), [version.replace("-dev", ".dev0")]);
    assert_eq!(after("CITATION.cff", "version: "), [version]);
    for file in ["Cargo.toml", "validation/study/Cargo.toml"] {
        assert!(lines_of(file).contains(&"version.workspace = true".to_owned()), "{file}");
    }
    let (dates, headings) =
        (after("CITATION.cff", "date-released: "), after("CHANGELOG.md", "## "));
    let numbers = |of: &str| {
        let number = of.split(['-', ' ']).next().expect("a word");
        Vec::from_iter(number.split('.').map(|part| part.parse::<u32>().expect(of)))
    };
    if version.ends_with("-dev") {
        assert!(headings[0] == "Unreleased" && dates.is_empty(), "{}, {dates:?}", headings[0]);
        assert!(numbers(&headings[1]) < numbers(version), "{version} is after {}", headings[1]);
    } else {
        assert_eq!(headings[0], format!("{version} ({})", dates[0]));
    }
    // The tag of this commit, if it has one and nothing was changed since.
    let mut git = Command::new("git");
    git.args(["describe", "--tags", "--exact-match", "--dirty", "--match", "v[0-9]*"]);
    let tag =
        git.current_dir(root).output().map(|of| String::from_utf8_lossy(&of.stdout).into_owned());
    let tag = tag.unwrap_or_default();
    let is_tag =
        |tag: &str| tag.is_empty() || tag.ends_with("-dirty") || tag == format!("v{version}");
    assert!(is_tag(tag.trim()), "the tag {tag} of version {version}");
}

#[test]
fn the_long_version_tells_the_commit_and_the_petsc_that_computes() {
    let test_directory = TestDirectory::new();
    let [short, long] = ["-V", "--version"].map(|option| test_directory.say(&[option]).out);
    assert_eq!(short, format!("signorini {}\n", env!("CARGO_PKG_VERSION")));
    let lines: Vec<_> = long.lines().collect();
    let [first, commit, petsc, licence] = lines[..] else { panic!("{long}") };
    assert!(format!("{first}\n") == short && commit.starts_with("commit "), "{long}");
    assert!(
        licence.starts_with("licence GPL-3.0-or-later") && licence.ends_with("NOTICES"),
        "{long}"
    );
    let (version, file) =
        petsc.strip_prefix("PETSc ").and_then(|of| of.split_once(": ")).expect(petsc);
    assert!(version.split('.').all(|part| part.parse::<u8>().is_ok()), "{long}");
    let name = Path::new(file).file_name().expect("a file").to_string_lossy().into_owned();
    assert!(Path::new(file).is_file() && name.ends_with(version), "{long}");
    test_directory.run(&["--set", "time.step=0.5"]);
    let libraries = &test_directory.summary("out/scene")["provenance"]["libraries"];
    assert!(libraries.as_array().expect("names").contains(&name.into()), "{libraries}");
}
