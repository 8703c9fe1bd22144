//! Names and paths that are unusual and allowed: bytes that are not UTF-8, signs that separate lists and folders.

use crate::test_directory::{ProgramOutput, SCENE, TestDirectory, msh, square};
use std::{
    ffi::{OsStr, OsString},
    fs,
    os::unix::ffi::OsStrExt,
    path::Path,
};

/// A name in Latin-1.
fn latin(ending: &str) -> OsString {
    OsStr::from_bytes(&[b"b\xe4r", ending.as_bytes()].concat()).to_owned()
}

/// Scene, mesh, results and the working folder have such names: every command works, or says one sentence.
#[test]
fn paths_that_are_not_utf_8() {
    let directory = TestDirectory::new();
    let folder = directory.path(".").join(latin(""));
    fs::create_dir(&folder).expect("a folder");
    fs::write(folder.join(latin(".toml")), SCENE).expect("written");
    fs::write(folder.join("square.msh"), square(4)).expect("written");
    fs::write(folder.join(latin(".msh")), square(4)).expect("written");
    let say = |words: &[&OsStr]| {
        let mut command = directory.command(&[]);
        // Only standard output has names; a message shows them with replacements.
        let output = command.args(words).current_dir(&folder).output().expect("the program starts");
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        let out = String::from_utf8_lossy(&output.stdout).into_owned();
        ProgramOutput { code: output.status.code(), out, err }
    };
    let (scene, out, mesh) = (latin(".toml"), latin("-out"), latin(".msh"));
    let words = |words: &[&str]| words.iter().map(OsString::from).collect::<Vec<_>>();
    let after = |first: &str, second: &OsStr, rest: &[&str]| {
        [words(&[first]), vec![second.to_owned()], words(rest)].concat()
    };
    let run = [after("run", &scene, &["--out"]), vec![out.clone(), "--mesh".into(), mesh]].concat();
    let python = ["info", "table"].map(|name| after(name, &out, &[]));
    let figures = [&["--along", "top"][..], &["--together"]];
    let figures = figures.map(|arguments| after("plot", &out, arguments));
    let study = after("study", &scene, &["--set", "time.end=0.5,1"]);
    let again = vec![
        "run".into(),
        Path::new(&out).join("scene.toml").into(),
        "--out".into(),
        "again".into(),
    ];
    let commands = [run, after("check", &scene, &[]), again, study];
    for command in commands.iter().chain(&figures).chain(&python) {
        let said = say(&Vec::from_iter(command.iter().map(OsString::as_os_str)));
        if said.err.contains("apt install python3-matplotlib") {
            continue;
        }
        assert!(
            ["panicked", "Traceback", "Warning"].iter().all(|word| !said.err.contains(word)),
            "{command:?}: {said:?}"
        );
        assert_eq!(said.code, Some(0), "{command:?}: {said:?}");
    }
    // The scene of the results names its tables by full paths, which TOML writes in UTF-8.
    fs::write(folder.join("load.csv"), "0,0\n1,-3\n").expect("written");
    let set = ["--set", "boundary.top.traction=[0, \"table('load.csv')\"]"];
    let with_table = after("run", &scene, &set);
    let said = say(&Vec::from_iter(with_table.iter().map(OsString::as_os_str)));
    said.fails(2, &["load.csv: the name of a folder is not in UTF-8; rename the folder"]);
}

/// Signs that separate names in lists, folders in paths, keys and sentences.
#[test]
fn names_of_boundaries_with_signs() {
    let directory = TestDirectory::new();
    let sides = [("bottom", "a,b"), ("top", "free/edge"), ("left", "it's {x} %s")];
    let renamed = |text: &str| {
        sides.iter().fold(text.to_owned(), |text, (side, name)| {
            text.replace(&format!("\"{side}\""), &format!("\"{name}\""))
        })
    };
    directory.write("scene.toml", &renamed(SCENE));
    directory.write("square.msh", &renamed(&square(4)));
    let figures = "\"a,b.force_y\",it's {x} %s.force_x";
    directory.run(&["--accuracy", "0.5", "--accuracy-of", figures]);
    let columns = "\"a,b.force_y\",it's {x} %s.force_x,work";
    let Some(said) = directory.say_python(&["table", "out/scene", "--columns", columns]) else {
        return;
    };
    assert!(said.code == Some(0) && said.out.contains("a,b.force_y"), "{said:?}");
    for (_, name) in sides {
        let along = ["plot", "out/scene", "--along", name, "--format", "svg"];
        let said = directory.say(&along);
        assert_eq!(said.code, Some(0), "{said:?}");
        assert_eq!(said.out.lines().count(), 2, "{said:?}");
        assert!(said.out.lines().all(|path| directory.path(path).exists()), "{said:?}");
    }
}

/// Runs of a study that differ in any sign have different folders; equal ones are named.
#[test]
fn equal_and_similar_runs_of_a_study() {
    let directory = TestDirectory::new();
    directory.write("cases.csv", "title,time.end\na/b,1\na:b,1\na b,1\n");
    let Some(said) = directory.say_python(&["study", "scene.toml", "--cases", "cases.csv"]) else {
        return;
    };
    assert!(said.code == Some(0) && said.out.contains("3/3"), "{said:?}");
    directory.write("cases.csv", "title,time.end\na,1\n\nb,1\n a,1\n");
    let said = directory.say(&["study", "scene.toml", "--cases", "cases.csv"]);
    assert!(
        said.code == Some(2) && said.err.contains("cases.csv: lines 2 and 5 are the same run"),
        "{said:?}"
    );
    let said = directory.say(&["study", "scene.toml", "--set", "time.end=1,2,1"]);
    assert!(
        said.code == Some(2) && said.err.contains("time.end has the value 1 twice"),
        "{said:?}"
    );
    let words: Vec<u8> = "time.end\n1\n2\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    fs::write(directory.path("cases.csv"), words).expect("written");
    let said = directory.say(&["study", "scene.toml", "--cases", "cases.csv"]);
    assert!(said.code == Some(2) && said.err.contains("cases.csv: is not in UTF-8"), "{said:?}");
}

/// The surfaces without a table of their own are the rest of the body, whatever the names of the others.
#[test]
fn the_rest_of_the_body_has_no_name_of_a_key() {
    let corners = ["1 0 0 0", "2 1 0 0", "3 1 1 0", "4 0 1 0"];
    let sides = ["1 1 1 1 2", "2 1 3 3 4", "3 1 4 4 1"];
    let mesh = msh(&corners, &[&sides[..], &["4 2 5 1 2 3", "5 2 6 1 3 4"]].concat());
    for own in ["body", "6"] {
        let directory = TestDirectory::new();
        directory.write("square.msh", &mesh);
        let said = directory.run(&["--set", &format!("material.{own}.young=100")]);
        for name in [own, "the rest of the body"] {
            assert!(
                said.out.contains(&format!("largest von Mises stress in {name} ")),
                "{name}: {said:?}"
            );
        }
        assert!(!said.out.contains(" material: "), "{said:?}");
    }
}
