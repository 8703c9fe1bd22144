//! The mesh of a `.geo` is kept beside it, and read again only if gmsh would make it again.

use crate::{
    meshes::GEO,
    test_directory::{ProgramOutput, SCENE, TestDirectory, start},
};
use std::{
    fs::{self, File, Permissions},
    os::unix::fs::PermissionsExt,
    process::Command,
    time::{Duration, SystemTime},
};

/// Bodies of other sizes, as the parameters say.
const BODY: &str = r#"
DefineConstant[ r = 1, r1 = 1, size = 0.5 ];
Point(1) = {0, 0, 0}; Point(2) = {r, 0, 0}; Point(3) = {r, r1, 0}; Point(4) = {0, r1, 0};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1}; Physical Surface("body") = {1};
Physical Curve("bottom") = {1}; Physical Curve("top") = {3}; Physical Curve("left") = {4};
Mesh.MeshSizeMax = size;
"#;

/// A folder with a scene and its `.geo`, and a gmsh that counts.
struct Folder(TestDirectory);

impl Folder {
    fn new() -> Self {
        let folder = Self(TestDirectory::new());
        folder.0.write("geo/square.geo", GEO);
        folder.scene("");
        folder.gmsh("");
        folder
    }

    fn scene(&self, keys: &str) {
        let mesh = format!("\"square.geo\"\n{keys}");
        self.0.write("geo/scene.toml", &SCENE.replace("\"square.msh\"", &mesh));
    }

    /// gmsh runs after these commands.
    fn gmsh(&self, before: &str) {
        let script = format!(
            "#!/bin/sh\n{before}\ncase \"$1\" in --version) ;; *) echo >> \"$0.count\";; esac\n\
             /usr/bin/gmsh \"$@\" || exit $?\n[ -z \"$CUT\" ] && exit\n\
             while [ \"$1\" != -o ]; do shift; done\ntruncate -s \"$CUT\" \"$2\"\n"
        );
        self.0.write("bin/gmsh", &script);
        fs::set_permissions(self.0.path("bin/gmsh"), Permissions::from_mode(0o755)).expect("mine");
    }

    fn say_with(&self, variables: &[(&str, &str)], arguments: &[&str]) -> ProgramOutput {
        ProgramOutput::of(self.command(arguments).envs(variables.iter().copied()))
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let path = format!("{}:/usr/bin:/bin", self.0.path("bin").display());
        let mut command = self.0.command(arguments);
        command.env("PATH", path);
        command
    }

    /// How often `signorini mesh` starts gmsh, and what it says.
    #[track_caller]
    fn mesh(&self) -> (usize, ProgramOutput) {
        let said = self.say_with(&[], &["mesh", "geo/scene.toml"]);
        assert_eq!(said.code, Some(0), "{said:?}");
        let count = fs::read(self.0.path("bin/gmsh.count")).map_or(0, |lines| lines.len());
        let _ = fs::remove_file(self.0.path("bin/gmsh.count"));
        (count, said)
    }

    fn meshes(&self) -> Vec<String> {
        self.0.names("geo").into_iter().filter(|name| name.contains("msh")).collect()
    }
}

/// Runs in one folder and each in a folder of its own say the same, in any order.
#[test]
fn no_two_meshes_have_one_name() {
    let all = [
        "",
        "r=12",
        "r1=2",
        "r=1\nr1=2",
        "r=1.2",
        "r=1e-3",
        "r=0.12",
        "r1=21",
        "r=1\nsize=2",
        "size=0.12",
    ];
    let together = Folder::new();
    together.0.write("geo/square.geo", BODY);
    let meshes = |folder: &Folder, parameters: &str| {
        let keys = parameters.replace("r=", "parameters.r=").replace("r1=", "parameters.r1=");
        folder.scene(&keys);
        folder.mesh()
    };
    let alone = all.map(|parameters| {
        let alone = Folder::new();
        alone.0.write("geo/square.geo", BODY);
        let (_, said) = meshes(&alone, parameters);
        let [name] = &alone.meshes()[..] else { panic!("{:?}", alone.meshes()) };
        let path = format!("geo/{name}");
        (parameters, said.out, alone.0.read(&path), path)
    });
    for (expected, all) in [(1, Vec::from_iter(&alone)), (0, alone.iter().rev().collect())] {
        for (parameters, out, mesh, path) in all {
            let (count, said) = meshes(&together, parameters);
            assert_eq!((count, &said.out), (expected, out), "{parameters}");
            // The signature also names the gmsh of each folder.
            let made = |kept: &str| kept[..kept.rfind("$Comments").unwrap()].to_owned();
            assert_eq!(made(&together.0.read(path)), made(mesh), "{parameters}");
        }
    }
    assert_eq!(together.meshes().len(), all.len());
}

#[test]
fn each_change_of_an_input_is_meshed_once_and_nothing_else_is() {
    let folder = Folder::new();
    folder.0.write("geo/square.geo", "Include \"parts/square.geo\";\nMerge \"empty.geo\";\n");
    folder.0.write("geo/parts/square.geo", "part = \"body.geo\";\nInclude \"body.geo\";\n");
    folder.0.write("geo/parts/body.geo", GEO);
    folder.0.write("geo/empty.geo", "// nothing\n");
    assert_eq!(folder.mesh().0, 1);
    let changes: [&dyn Fn(); 8] = [
        &|| folder.0.write("geo/parts/body.geo", &GEO.replace("size = 0.5", "size = 0.25")),
        &|| folder.0.write("geo/empty.geo", "Mesh.Algorithm = 5;\n"),
        &|| folder.0.write("geo/parts/square.geo", "Include \"body.geo\";\n"),
        &|| folder.0.write("geo/square.geo.opt", "Mesh.Algorithm = 6;\n"),
        &|| folder.scene("size = 0.2"),
        &|| folder.scene("size = 0.2\n[discretisation]\ndisplacement = 2"),
        &|| {
            folder
                .0
                .write("geo/square.geo", "Include \"parts/square.geo\";\nMerge \"empty.geo\"; \n")
        },
        &|| folder.gmsh("[ \"$1\" = --version ] && echo 0.0.1 && exit"),
    ];
    for (number, change) in changes.iter().enumerate() {
        assert_eq!(folder.mesh().0, 0, "before change {number}");
        change();
        for (name, years) in [("square.geo", 1), ("square.msh", 2), ("parts/body.geo", 3)] {
            // Files that are copied or restored are of any age.
            let time = SystemTime::now() - Duration::from_secs(years * 30_000_000);
            let file = File::options().append(true).open(folder.0.path(&format!("geo/{name}")));
            file.expect("it exists").set_modified(time).expect("mine");
        }
        assert_eq!(folder.mesh().0, 1, "after change {number}");
    }
    // Files whose names gmsh computes may change unseen.
    folder.gmsh("");
    folder.0.write("geo/square.geo", "Include StrCat(\"parts/\", \"body.geo\");\n");
    assert_eq!([folder.mesh().0, folder.mesh().0], [1, 1]);
}

#[test]
fn a_kept_mesh_needs_no_gmsh() {
    let folder = Folder::new();
    folder.mesh();
    let without = [("PATH", "/nowhere")];
    let said = folder.say_with(&without, &["mesh", "geo/scene.toml"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    folder.0.write("geo/square.geo", &format!("{GEO}// other\n"));
    folder
        .say_with(&without, &["mesh", "geo/scene.toml"])
        .fails(2, &["square.geo: gmsh is needed"]);
}

#[test]
fn files_of_the_user_stay() {
    let folder = Folder::new();
    folder.mesh();
    let kept = folder.0.read("geo/square.msh");
    let moved = kept.replace("$Nodes", "$Nodes ");
    let (mesh, _) = kept.split_at(kept.rfind("$Comments").expect("the signature"));
    for theirs in [&moved, mesh, &kept[..kept.len() / 2], "", "mine"] {
        folder.0.write("geo/square.msh", theirs);
        for _ in 0..2 {
            let (count, said) = folder.mesh();
            assert_eq!(count, 1, "it is not used");
            assert!(
                said.err.contains("square.msh: it is not as this program wrote it"),
                "{said:?}"
            );
            assert_eq!(folder.0.read("geo/square.msh"), theirs);
        }
    }
    fs::remove_file(folder.0.path("geo/square.msh")).expect("mine");
    assert!(folder.mesh().1.err.is_empty());
    assert_eq!(folder.0.read("geo/square.msh"), kept);
}

#[test]
fn meshing_at_the_same_time() {
    let folder = Folder::new();
    let start = || start(&mut folder.command(&["mesh", "geo/scene.toml"]));
    let runs: Vec<_> = (0..4).map(|_| start()).collect();
    for mut run in runs {
        assert!(run.wait().expect("it ends").success());
    }
    assert_eq!(folder.meshes(), ["square.msh"]);
    let _ = fs::remove_file(folder.0.path("bin/gmsh.count"));
    assert_eq!(folder.mesh().0, 0);
}

/// gmsh does not notice a full disk: its file then ends anywhere.
#[test]
fn a_mesh_that_was_cut_off_replaces_nothing() {
    let folder = Folder::new();
    folder.mesh();
    let kept = folder.0.read("geo/square.msh");
    folder.0.write("geo/square.geo", &format!("{GEO}// other\n"));
    let length = kept.find("$Comments").expect("the end of gmsh's part");
    for part in [0, 3, 20, length / 3, length / 2, length - 20, length - 2] {
        let said = folder.say_with(&[("CUT", &part.to_string())], &["mesh", "geo/scene.toml"]);
        let folder_of_gmsh = std::env::temp_dir();
        let told = [
            "square.geo: ",
            "cut off",
            "disk may be full",
            "TMPDIR",
            &folder_of_gmsh.to_string_lossy(),
        ];
        said.fails(2, &told);
        assert_eq!(folder.0.read("geo/square.msh"), kept);
        assert_eq!(folder.0.names("geo"), ["scene.toml", "square.geo", "square.msh"]);
    }
    let _ = fs::remove_file(folder.0.path("bin/gmsh.count"));
    assert_eq!(folder.mesh().0, 1);
}
