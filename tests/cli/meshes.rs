//! `signorini mesh`, and scenes that name a `.geo`.

use crate::test_directory::{SCENE, TestDirectory};

pub const GEO: &str = r#"
DefineConstant[ size = 0.5 ];
Point(1) = {0, 0, 0, size}; Point(2) = {1, 0, 0, size};
Point(3) = {1, 1, 0, size}; Point(4) = {0, 1, 0, size};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Physical Surface("body") = {1};
Physical Curve("bottom") = {1}; Physical Curve("top") = {3}; Physical Curve("left") = {4};
"#;

fn test_directory() -> TestDirectory {
    let test_directory = TestDirectory::new();
    test_directory.write("geo/square.geo", GEO);
    test_directory.write("geo/scene.toml", &SCENE.replace("square.msh", "square.geo"));
    test_directory
}

#[test]
fn meshes_appear_beside_their_geo() {
    let test_directory = test_directory();
    test_directory
        .write("geo/fine.toml", &SCENE.replace("\"square.msh\"", "\"square.geo\"\nsize = 0.25"));
    let said = test_directory.say(&["mesh", "geo/scene.toml", "geo/fine.toml"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let lines: Vec<&str> = said.out.lines().collect();
    assert!(lines[0].starts_with("scene: ") && lines[0].contains(" nodes, "), "{lines:?}");
    assert!(lines[1].starts_with("fine: "), "{lines:?}");
    let files = ["fine.toml", "scene.toml", "square-size=0.25.msh", "square.geo", "square.msh"];
    assert_eq!(test_directory.names("geo"), files);
    assert!(!test_directory.path("out").exists());
}

#[test]
fn a_geo_that_gmsh_scales_is_adapted_as_if_it_did_not() {
    // The same square, drawn in km.
    let pairs = [("{1, 0,", "{1e-3, 0,"), ("{1, 1,", "{1e-3, 1e-3,"), ("{0, 1,", "{0, 1e-3,")];
    let drawn = pairs.iter().fold(GEO.replace("0.5", "5e-4"), |geo, (m, km)| geo.replace(m, km));
    let triangles = |geo: &str| {
        let test_directory = test_directory();
        test_directory.write("geo/square.geo", geo);
        let said = test_directory.say(&["run", "geo/scene.toml", "--accuracy", "0.1"]);
        assert_eq!(said.code, Some(0), "{said:?}");
        test_directory.summary("out/scene")["triangles"].as_u64().expect("a number")
    };
    let scaled = triangles(&format!("Mesh.ScalingFactor = 1000; // m\n{drawn}"));
    assert_eq!(scaled, triangles(GEO));

    let test_directory = test_directory();
    test_directory.write("geo/square.geo", &format!("Mesh.ScalingFactor = 10^3;\n{drawn}"));
    let said = test_directory.say(&["run", "geo/scene.toml", "--accuracy", "0.1"]);
    said.fails(2, &["square.geo", "Mesh.ScalingFactor must be a number"]);
}

/// The square with names by its physical curves, and with names by `where`.
fn selecting(file: &str) -> String {
    let selections = [("bottom", "y < 1e-6"), ("top", "y > 1 - 1e-6"), ("left", "x < 1e-6")];
    let scene = SCENE.replace("square.msh", file);
    selections.iter().fold(scene, |scene, (name, place)| {
        let name = format!("name = \"{name}\"\n");
        scene.replace(&name, &format!("{name}where = \"{place}\"\n"))
    })
}

/// Writes the square as a geometry without names in the format of this extension.
fn write_geometry(test_directory: &TestDirectory, name: &str) {
    let square = "SetFactory(\"OpenCASCADE\");\nRectangle(1) = {0, 0, 0, 1, 1};\n";
    test_directory.write("occ.geo", square);
    let mut gmsh = std::process::Command::new("gmsh");
    gmsh.arg("-0").arg(test_directory.path("occ.geo")).arg("-o").arg(test_directory.path(name));
    assert!(gmsh.output().expect("gmsh").status.success());
}

#[test]
fn a_geometry_without_names_gives_the_answer_of_the_named_one() {
    let test_directory = test_directory();
    write_geometry(&test_directory, "geo/part.step");
    write_geometry(&test_directory, "geo/part.brep");
    test_directory.write("geo/merged.geo", "Merge \"part.step\";\nMesh.MeshSizeMax = 0.5;\n");
    for file in ["square.geo", "part.step", "part.brep", "merged.geo"] {
        let is_named = file == "square.geo";
        let scene = if is_named { SCENE.replace("square.msh", file) } else { selecting(file) };
        let path = format!("geo/{file}.toml");
        test_directory.write(&path, &scene);
        for (n, arguments) in [["--set", "mesh.size=0.5"], ["--accuracy", "0.1"]].iter().enumerate()
        {
            let out = format!("out/{file}{n}");
            let said =
                test_directory.say(&[&["run", &path, "--out", &out][..], arguments].concat());
            assert_eq!(said.code, Some(0), "{said:?}");
        }
        let figure = |out: &str, name: &str| test_directory.column(out, name).pop().expect("a row");
        let [own, accurate] = ["0", "1"].map(|n| figure(&format!("out/{file}{n}"), "work"));
        let [other, other_accurate] =
            ["0", "1"].map(|n| figure(&format!("out/square.geo{n}"), "work"));
        // The meshes are alike, and the accurate works differ by at most both errors.
        assert!((own / other - 1.0).abs() < 0.1, "{file}: {own} is not {other}");
        assert!(
            (accurate / other_accurate - 1.0).abs() < 0.02,
            "{file}: {accurate} is not {other_accurate}"
        );
    }
}

#[test]
fn the_scene_of_a_run_has_all_files_beside_it() {
    let test_directory = TestDirectory::new();
    test_directory.write("geo/lib/size.geo", "Mesh.MeshSizeMax = 0.3;\n");
    write_geometry(&test_directory, "geo/lib/part.step");
    // Names of files in comments and of groups are no files to read.
    test_directory.write(
        "geo/outer.geo",
        "Include \"lib/size.geo\"; // not \"lib/lost.geo\"\nMerge \"lib/part.step\";\n\
         Physical Surface(\"outer.geo\") = {1};\n",
    );
    test_directory.write("geo/scene.toml", &selecting("outer.geo"));
    let run = |scene: &str, out: &str| {
        let said = test_directory.say(&["run", scene, "--out", out]);
        assert_eq!(said.code, Some(0), "{said:?}");
        test_directory.column(out, "work")
    };
    let works = run("geo/scene.toml", "first");
    let copies = |folder: &str| {
        let names = test_directory.names(folder).into_iter();
        names.filter(|name| name.starts_with("scene") && !name.contains(".msh")).collect::<Vec<_>>()
    };
    assert_eq!(copies("first"), ["scene-mesh1.geo", "scene-mesh2.step", "scene.geo", "scene.toml"]);
    assert!(test_directory.read("first/scene.geo").contains("Physical Surface(\"outer.geo\")"));
    std::fs::remove_dir_all(test_directory.path("geo")).expect("it is there");
    // Elsewhere, and in its own folder.
    assert_eq!(run("first/scene.toml", "second"), works);
    assert_eq!(run("first/scene.toml", "first"), works);
    assert_eq!(copies("first"), copies("second"));
    assert_eq!(run("first/scene.toml", "second"), works);
}

#[test]
fn a_mesh_of_another_program_is_run_and_copied() {
    let test_directory = TestDirectory::new();
    test_directory
        .write("part.inp", "*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n*ELEMENT,TYPE=CPS4\n1,1,2,3,4\n");
    test_directory.write("scene.toml", &selecting("part.inp"));
    let said = test_directory.say(&["run", "scene.toml"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(said.out.contains("its 1 quadrilaterals are cut"), "{said:?}");
    let again =
        test_directory.say(&["run", "out/scene/scene.toml", "--out", "again", "--accuracy", "0.2"]);
    assert_eq!(again.code, Some(0), "{again:?}");
    test_directory.say(&["run", "part.inp"]).fails(2, &["it is a mesh, and what runs is a scene"]);
    let size = ["check", "scene.toml", "--set", "mesh.size=0.1"];
    test_directory.say(&size).fails(2, &["mesh.size has no effect", "name its geometry"]);
}

#[test]
fn a_frame_of_two_materials_is_the_mesh_of_its_run() {
    let test_directory = TestDirectory::new();
    let plate = include_str!("../fixtures/msh/plate-22.msh");
    test_directory.write("plate.msh", plate);
    let scene = |mesh: &str, surface: &str| {
        format!(
            "mesh = {{ file = \"{mesh}\" }}\n\
             material = {{ young = 1e6, poisson = 0.3, plane = \"stress\", \"{surface}\" = {{ young = 2e6 }} }}\n\
             [[boundary]]\nname = \"base\"\nwhere = \"y < 1e-6\"\ndisplacement = [0, 0]\n\
             [[boundary]]\nname = \"head\"\nwhere = \"y > 1 - 1e-6\"\ntraction = [0, -80]\n"
        )
    };
    let work = |name: &str, text: &str| {
        test_directory.write(&format!("{name}.toml"), text);
        let said = test_directory.say(&["run", &format!("{name}.toml"), "--out", name]);
        assert_eq!(said.code, Some(0), "{said:?}");
        test_directory.summary(name)["figures"]["work"]["value"].as_f64().expect("a number")
    };
    let own = work("own", &scene("plate.msh", "left part"));
    let frame = test_directory.names("own").into_iter().find(|name| name.starts_with("fields_"));
    let of_frame = work("frame", &scene(&format!("own/{}", frame.expect("a frame")), "1"));
    assert!((own - of_frame).abs() <= 1e-12 * own, "{own} is not {of_frame}");
}
