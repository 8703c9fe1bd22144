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
