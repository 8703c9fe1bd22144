//! The program in a virtual environment, where pip puts it: the Python and the gmsh are those of the environment.

use crate::test_directory::{ProgramOutput, SCENE, TestDirectory};
use std::{
    fs::{self, Permissions},
    os::unix::fs::PermissionsExt,
    path::Path,
    process::Command,
};

/// A program that writes its first path and its arguments into a file beside it, and the paths of libraries.
const NOTES: &str = "#!/bin/sh\necho \"$LD_LIBRARY_PATH|$*\" >> \"$0.calls\"\nexit 1\n";

/// The calls of the environment's Python by a program in `environment/bin`, in an environment with this file in its root.
fn calls(mark: Option<&str>, arguments: &[&str]) -> String {
    let directory = TestDirectory::new();
    directory.write("square.geo", "// empty");
    directory.write("scene.toml", &SCENE.replace("square.msh", "square.geo"));
    directory.write("environment/lib/signorini/libX11.so.6", "");
    for name in ["python3", "gmsh"] {
        directory.write(&format!("environment/bin/{name}"), NOTES);
        let file = directory.path(&format!("environment/bin/{name}"));
        fs::set_permissions(file, Permissions::from_mode(0o755)).expect("mine");
    }
    let program = directory.path("environment/bin/signorini");
    // Another process copies it: a fork of another test could keep our file open for writing, and the program would be busy.
    let copied = Command::new("cp").arg(env!("CARGO_BIN_EXE_signorini")).arg(&program).status();
    assert!(copied.expect("cp").success());
    mark.inspect(|name| directory.write(&format!("environment/{name}"), ""));
    let mut command = Command::new(program);
    command.args(arguments).current_dir(directory.path("")).env_remove("PYTHON");
    command.env("PATH", "/usr/bin:/bin").env_remove("LD_LIBRARY_PATH");
    ProgramOutput::of(&mut command);
    let root = directory.path("environment").canonicalize().expect("it is there");
    let said = fs::read_to_string(directory.path("environment/bin/python3.calls"));
    assert!(!directory.path("environment/bin/gmsh.calls").exists());
    said.unwrap_or_default().replace(&root.display().to_string(), "ENV")
}

#[test]
fn a_program_in_a_virtual_environment_uses_its_python_and_its_gmsh() {
    let meshed = calls(Some("pyvenv.cfg"), &["mesh", "scene.toml"]);
    let start = "ENV/lib/signorini|-I -X utf8 ENV/bin/gmsh -format msh41 ";
    assert!(meshed.starts_with(start), "{meshed}");
    let plotted = calls(Some("pyvenv.cfg"), &["plot", "."]);
    assert!(plotted.starts_with("|-I -X utf8 -c "), "{plotted}");
}

#[test]
fn files_beside_a_program_elsewhere_are_not_executed() {
    for arguments in [["mesh", "scene.toml"], ["plot", "."]] {
        assert_eq!(calls(None, &arguments), "");
    }
}

/// The wheel has the version of the program, through `pyproject.toml`, and all modules that Debian's package has.
#[test]
fn the_wheel_has_the_modules_of_the_package() {
    let read = |file: &str| {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        fs::read_to_string(file).expect("a file of the repository")
    };
    let wheel = read("scripts/wheel/wheel.py");
    assert!(wheel.contains("project['version']") && wheel.contains("[\"py-modules\"]"));
    let all = read("Cargo.toml");
    let packaged = all.split("\"scripts/").skip(1).filter_map(|rest| rest.split_once(".py\""));
    let packaged: Vec<_> = packaged.map(|(name, _)| name.into()).collect();
    let project: toml::Value = toml::from_str(&read("scripts/pyproject.toml")).expect("TOML");
    let modules = project["tool"]["setuptools"]["py-modules"].as_array().expect("a list");
    assert_eq!(*modules, packaged, "the Debian package and the wheel have the same modules");
}

/// Package and wheel have the guides and the tables behind them. A link of theirs leads to a file that comes with them, and a link between
/// guides, scenes and tables stays.
#[test]
fn the_links_of_installed_guides_lead_to_installed_files() {
    let root = &Path::new(env!("CARGO_MANIFEST_DIR")).canonicalize().expect("the repository");
    let directory = TestDirectory::new();
    let python = std::env::var("PYTHON").unwrap_or("/usr/bin/python3".to_owned());
    let script = root.join("scripts/pages.py");
    let made = Command::new(python).arg(script).arg(directory.path("doc")).output();
    assert!(made.as_ref().is_ok_and(|of| of.status.success()), "{made:?}");
    let links = |page: &Path| {
        let text = fs::read_to_string(page).expect("a page");
        let targets = text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next());
        let is_relative = |target: &&str| !target.is_empty() && !target.contains([':', '\n']);
        Vec::from_iter(targets.filter(is_relative).map(str::to_owned))
    };
    let mut pages = 0;
    for folder in ["", "geo", "geo/how-to", "validation"] {
        for file in fs::read_dir(directory.path("doc").join(folder)).expect("a folder").flatten() {
            let (page, own) = (file.path(), root.join(folder).join(file.file_name()));
            if page.extension().is_some_and(|ending| ending == "md") {
                let there = |link: &String| page.parent().is_some_and(|of| of.join(link).exists());
                let (before, after) = (links(&own), links(&page));
                assert!(after.iter().all(there), "{page:?}: {after:?}");
                let is_guide = |link: &&String| {
                    let file = own.parent().expect("a folder").join(link.as_str());
                    let file = file.canonicalize().expect("a file of the repository");
                    let file = file.strip_prefix(root).expect("one of them");
                    let source = file.extension().is_some_and(|ending| ending == "py");
                    !source
                        && ["geo", "validation", "examples"].iter().any(|of| file.starts_with(of))
                };
                let lost = before.iter().filter(is_guide).filter(|link| !after.contains(link));
                assert_eq!(Vec::from_iter(lost), [""; 0], "{page:?}");
                pages += 1;
            }
        }
    }
    assert!(pages > 30 && directory.path("doc/geo/lshape.geo").exists(), "{pages} pages");
    for file in ["Cargo.toml", "scripts/wheel/wheel.py"] {
        let text = fs::read_to_string(root.join(file)).expect("a file of the repository");
        assert!(text.contains("pages") && text.contains("NOTICES"), "{file}");
    }
}
