//! `signorini run --accuracy`.

use crate::test_directory::{SCENE, TestDirectory};

#[test]
fn an_accuracy_is_reached_and_its_mesh_is_kept() {
    let test_directory = TestDirectory::new();
    let said = test_directory.run(&["--accuracy", "0.05", "--out", "out/first"]);
    assert!(said.out.contains("accuracy 0.05 reached: P2 on "), "{}", said.out);
    let first = test_directory.summary("out/first");
    let error = first["errors"]["displacement_mesh"].as_f64().unwrap();
    assert!(error > 0.0 && error < 0.05, "{error}");

    // The same run on the mesh that was kept.
    let arguments = [
        "--mesh",
        "out/first/mesh.msh",
        "--set",
        "discretisation.displacement=2",
        "--set",
        "time.step='auto'",
        "--set",
        "time.tolerance=0.015",
        "--out",
        "out/again",
    ];
    test_directory.run(&arguments);
    let again = test_directory.summary("out/again");
    for key in ["triangles", "steps", "displacement_max", "work", "zeta_min", "active_nodes"] {
        assert_eq!(first[key], again[key], "{key}");
    }

    // A run on the mesh of its own folder leaves it there, one on another mesh does not.
    let mesh = test_directory.path("out/first/mesh.msh");
    test_directory.run(&["--mesh", "out/first/mesh.msh", "--out", "out/first"]);
    assert!(mesh.exists());
    test_directory.run(&["--out", "out/first"]);
    assert!(!mesh.exists());
}

#[test]
fn an_accuracy_may_stand_in_the_scene_and_must_make_sense() {
    let test_directory = TestDirectory::new();
    test_directory.write("scene.toml", &format!("accuracy = 0.1\n{SCENE}"));
    let said = test_directory.run(&[]);
    assert!(said.out.contains("accuracy 0.1 reached"), "{}", said.out);
    for bad in ["0", "2", "nan"] {
        let said = test_directory.say(&["run", "scene.toml", "--accuracy", bad]);
        said.fails(2, &["accuracy"]);
    }
}
