//! Bad input: exit code 2, a message that names the place, and nothing touched.

use crate::{
    meshes::GEO,
    test_directory::{ProgramOutput, SCENE, TestDirectory, msh, square},
};

/// Runs the scene twice, over the results of an earlier run and into a new folder: both must
/// be refused and change nothing.
#[track_caller]
fn refused(test_directory: &TestDirectory, arguments: &[&str], fragments: &[&str]) {
    for name in ["fields.pvd", "fields_0000.vtu", "history.csv", "summary.json"] {
        test_directory.write(&format!("out/scene/{name}"), "of an earlier run");
    }
    let before = test_directory.everything();
    for out in [&[][..], &["--out", "new/folder"]] {
        let said = test_directory.say(&[&["run", "scene.toml"], out, arguments].concat());
        said.fails(2, fragments);
        assert_eq!(said.out, "");
        assert!(test_directory.everything() == before, "files were touched: {fragments:?}");
    }
}

/// The scene with one text replaced by another.
fn changed(old: &str, new: &str) -> TestDirectory {
    assert!(SCENE.contains(old), "the scene has no `{old}`");
    let test_directory = TestDirectory::new();
    test_directory.write("scene.toml", &SCENE.replacen(old, new, 1));
    test_directory
}

/// A case of each kind (a text of the scene, its replacement, parts of the message). All that a scene may have wrong is
/// in tests/scene.
const SCENES: &[(&str, &str, &[&str])] = &[
    ("young", "yuong", &["scene.toml:5: unknown key material.yuong", "did you mean `young`?"]),
    ("\"-3*t\"", "\"table('load.csv')\"", &["scene.toml:29: ", "load.csv: No such file"]),
    ("square.msh", "none.msh", &["scene.toml:", "none.msh: No such file"]),
    ("square.msh", "none.geo", &["scene.toml:", "none.geo: No such file"]),
    ("name = \"top\"", "name = \"toop\"", &["scene.toml:28: ", "no physical curve", "`top`"]),
    ("gap = \"0\"", "gap = \"1/(t-0.5)\"", &["scene.toml:26: ", "gap is inf at (", "t = 0.5"]),
    (
        "\"-3*t\"",
        "\"3*t\"",
        &["scene.toml: at t = 0.1, nothing supports the body against the vert"],
    ),
    // The lower left node is prescribed below the foundation.
    ("symmetry = true", "displacement = [0, \"-t\"]", &["scene.toml: ", "(0, 0)"]),
];

#[test]
fn scenes() {
    for (old, new, fragments) in SCENES {
        refused(&changed(old, new), &[], fragments);
    }
}

/// tests/mesh has all that a mesh may have wrong.
#[test]
fn a_mesh_of_two_bodies() {
    let corners = ["1 0 0 0", "2 1 0 0", "3 1 1 0", "4 3 0 0", "5 4 0 0", "6 4 1 0"];
    let directory = TestDirectory::new();
    directory.write("square.msh", &msh(&corners, &["1 2 5 1 2 3", "2 2 5 4 5 6"]));
    let problem =
        "square.msh: the mesh has 2 pieces without common edges, as around (0.6667, 0.3333) and";
    directory.say(&["check", "scene.toml"]).fails(2, &[problem, "solve them one by one"]);
    refused(&directory, &[], &[problem]);
}

#[test]
fn arguments() {
    let test_directory = TestDirectory::new();
    for (arguments, fragments) in [
        (
            &["--solver", "simplex"][..],
            &["contact.solver is unknown", "`simplex`", "active-set", "tao"][..],
        ),
        (
            &["--solver", "tao:gpcg"],
            &["contact.solver is unknown", "tao:tron, tao:bnls, tao:bntr, tao:bntl)"],
        ),
        (&["--set", "time.stp=1"], &["--set time.stp=1: unknown key time.stp", "`step`"]),
        (&["--mesh", "none.msh"], &["none.msh: No such file"]),
        (&["--mesh", "scene.toml"], &["scene.toml: a mesh is a .msh, a geometry for gmsh"]),
        (&["--mesh", "square.geo", "--set", "mesh.size=1"], &["--set mesh.size=1 has no effect"]),
        (
            &["--set", "time.end=1", "--set", "time.end = 2"],
            &["--set time.end = 2: time.end is given twice"],
        ),
        (
            &["--", "-tao_type", "none"],
            &["-tao_type: `none` is none of TAO's types", "tron, bnls, bntr, bntl"],
        ),
        (&["--", "-elastic_pc_type", "cholesy"], &["-elastic_", "requested PC type cholesy"]),
        (&["--accuracy", "1e-9"], &["accuracy must be between 1e-5 and 0.5, but is 1e-9"]),
        (&["--", "tao_monitor"], &["PETSc options begin with a dash", "`tao_monitor`"]),
        (&["--slver", "tao"], &["unexpected argument '--slver'", "'--solver'"]),
    ] {
        refused(&test_directory, arguments, fragments);
    }
    let said = test_directory.say(&["compare", "scene.toml", "--solvers", "tao,simplex"]);
    said.fails(
        2,
        &["contact.solver is unknown", "`simplex`", "active-set, penalty-duality", "tao:tron"],
    );
    assert!(!test_directory.path("out/compare").exists());
    test_directory.say(&["run"]).fails(2, &["<SCENE>"]);
    for word in ["rnu", "urn", "runn", "ru"] {
        let problem = format!("unrecognized subcommand '{word}'");
        let said = test_directory.say(&[word, "scene.toml"]);
        said.fails(2, &[&problem, "a similar subcommand exists: 'run'"]);
    }
    assert!(!test_directory.say(&["xyz"]).err.contains("similar"));
    test_directory.say(&["run", "none.toml"]).fails(2, &["none.toml: the scene cannot be read"]);
    let none = test_directory.say(&["mesh", "scene.toml", "--set", "mesh.file=none.msh"]);
    none.fails(2, &["scene.toml, --set mesh.file=none.msh: mesh.file cannot be read: none.msh"]);
    test_directory.say(&["mesh", "none.toml"]).fails(2, &["none.toml: the scene cannot be read"]);
    assert_eq!(test_directory.say(&[]).code, Some(2));
}

/// An option and the key that it sets.
#[test]
fn an_option_beside_its_key() {
    let directory = TestDirectory::new();
    for (option, value, key) in [
        ("--accuracy", "0.1", "accuracy"),
        ("--accuracy-of", "work", "accuracy_of"),
        ("--max-memory", "100", "max_memory"),
        ("--max-seconds", "10", "max_seconds"),
        ("--solver", "tao", "contact.solver"),
    ] {
        let set = if option == "--accuracy-of" {
            format!("{key}=['work']")
        } else {
            format!("{key}={value}")
        };
        let problem = format!("{key} is given twice, also by --set {set}");
        refused(&directory, &[option, value, "--set", &set], &[&problem]);
    }
    directory
        .say(&["mesh", "scene.toml", "--set", "mesh.sze=1"])
        .fails(2, &["did you mean `size`?"]);
}

/// A text in each encoding but UTF-8, as every file that a user writes: one sentence names the file and UTF-8. A byte
/// order mark before UTF-8 does no harm.
#[test]
fn encodings() {
    let table = "time,load\n0,0\n1,-3\n";
    let scene = SCENE.replacen("\"-3*t\"", "\"table('load.csv')\"", 1);
    let geo = GEO.to_owned();
    let set_geo = ["--set", "mesh.file='square.geo'"];
    let mesh = square(4);
    let files = [
        ("scene.toml", &scene),
        ("load.csv", &table.to_owned()),
        ("square.geo", &geo),
        ("square.msh", &mesh),
    ];
    for (name, content) in files {
        let directory = TestDirectory::new();
        files.iter().for_each(|(name, content)| directory.write(name, content));
        let sets = if name == "square.geo" { &set_geo[..] } else { &[] };
        let check = || directory.say(&[&["check", "scene.toml"], sets].concat());
        directory.write(name, &format!("\u{feff}{content}"));
        assert_eq!(check().code, Some(0), "{name}: {:?}", check());
        for mark in ["\u{feff}", ""] {
            let words: Vec<u16> = format!("{mark}{content}").encode_utf16().collect();
            for bytes in [u16::to_le_bytes, u16::to_be_bytes] {
                std::fs::write(
                    directory.path(name),
                    words.iter().flat_map(|w| bytes(*w)).collect::<Vec<_>>(),
                )
                .expect("written");
                let sentence =
                    if name == "square.msh" { "not a gmsh mesh" } else { "is in UTF-16" };
                check().fails(2, &[name, sentence]);
            }
        }
    }
}

#[test]
fn help_and_version_are_no_errors() {
    let test_directory = TestDirectory::new();
    for (arguments, fragment) in
        [(&["--help"][..], "Exit codes"), (&["run", "--help"], "--set"), (&["--version"], "0.")]
    {
        let said = test_directory.say(arguments);
        assert_eq!(said.code, Some(0));
        assert!(said.out.contains(fragment) && said.err.is_empty(), "{said:?}");
    }
}

/// `help NAME` is `NAME --help` for each subcommand, also where a script has the help.
#[test]
fn help_of_a_subcommand_is_its_own() {
    let directory = TestDirectory::new();
    for name in ["run", "check", "study", "table", "plot"] {
        let [before, after] = [["help", name], [name, "--help"]].map(|of| directory.say(&of));
        assert_eq!((before.code, &before.out), (after.code, &after.out), "{name}");
    }
    if let Some(said) = directory.say_python(&["help", "study"]) {
        assert!(said.out.contains("--cases FILE.csv"), "{said:?}");
    }
}

/// Completions offer the names that `signorini solvers` lists, and a run takes others as well.
#[test]
fn completions_offer_the_solvers() {
    let directory = TestDirectory::new();
    let solvers = directory.say(&["solvers"]).out;
    let names: Vec<&str> = solvers.lines().filter_map(|line| line.split('\t').next()).collect();
    let script = directory.say(&["completions", "bash"]).out;
    let offered = script.split("--solver)").nth(1).and_then(|rest| rest.lines().nth(1));
    let offered = offered.expect("the values of --solver");
    assert!(offered.contains(&names.join(" ")), "{offered}");
    directory.run(&["--solver", "tao:bnls"]);
}

#[test]
fn folders_nobody_can_write_to() {
    // Root may write anywhere; below a file nobody can.
    let test_directory = TestDirectory::new();
    let before = test_directory.everything();
    let said = test_directory.say(&["run", "scene.toml", "--out", "scene.toml/results"]);
    said.fails(2, &["cannot write scene.toml/results: Not a directory"]);
    assert!(test_directory.everything() == before);

    test_directory.write("out", "a file");
    test_directory.say(&["run", "scene.toml"]).fails(2, &["cannot write out/scene: "]);
    assert_eq!(test_directory.read("out"), "a file");
}

#[test]
fn the_root_folder_for_the_results() {
    // A test that fails must not write there, even as root: the load has an unknown name.
    let scene = ["run", "scene.toml", "--set", "boundary.top.traction=[0, 's']", "--out"];
    for root in ["/", "/../", "//"] {
        let said = TestDirectory::new().say(&[&scene[..], &[root]].concat());
        said.fails(2, &["--out: the results cannot go into the root folder"]);
    }
}

#[test]
fn gmsh_missing_or_failing() {
    let test_directory = changed("square.msh", "square.geo");
    test_directory.write("square.geo", "Point(1) = {0, 0, 0};\nLine(1) = {1, ;\n");
    refused(&test_directory, &[], &["square.geo: gmsh could not mesh it", "line 2"]);
    let before = test_directory.everything();
    for arguments in [["run", "scene.toml"], ["mesh", "scene.toml"]] {
        let said = ProgramOutput::of(test_directory.command(&arguments).env("PATH", ""));
        said.fails(2, &["square.geo: gmsh is needed", "make deps", "apt install gmsh"]);
    }
    assert!(test_directory.everything() == before);
}
