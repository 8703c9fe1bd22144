//! `signorini run --accuracy`.

use crate::{
    losses::signal,
    test_directory::{SCENE, TestDirectory, square},
};
use std::{process::Stdio, thread::sleep, time::Duration};

#[test]
fn an_accuracy_is_reached_and_its_mesh_is_kept() {
    let test_directory = TestDirectory::new();
    let said = test_directory.run(&["--accuracy", "0.05", "--out", "out/first"]);
    assert!(said.out.contains("accuracy 0.05 reached: P2 on "), "{}", said.out);
    let first = test_directory.summary("out/first");
    let error = first["errors"]["displacement_mesh"].as_f64().unwrap();
    assert!(error > 0.0 && error < 0.05, "{error}");

    // A run on the mesh that was kept agrees within the error bars.
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
    assert_eq!(first["triangles"], again["triangles"]);
    for key in ["displacement_max", "work", "zeta_min", "zeta_mean", "contact_force"] {
        let [a, b] = [&first, &again].map(|summary| summary[key].as_f64().unwrap());
        let bar = first["errors"]["figures"][key].as_f64().unwrap();
        assert!((a - b).abs() <= bar && bar <= 0.05 * a.abs().max(1.0), "{key}: {a}, {b} ± {bar}");
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

#[test]
fn error_bars_are_measured_where_they_are_asked_for() {
    let test_directory = TestDirectory::new();
    let said = test_directory.run(&["--bars"]);
    assert!(said.out.contains("± "), "{}", said.out);
    let summary = test_directory.summary("out/scene");
    let bars = summary["errors"]["figures"].as_object().unwrap();
    for key in ["work", "displacement_max", "zeta_min", "bottom.force_y"] {
        assert!(bars[key].as_f64().unwrap() > 0.0, "{key}");
    }
    // One step does not show what it does to ζ.
    test_directory.run(&["--bars", "--set", "time.step=1"]);
    assert_eq!(test_directory.summary("out/scene")["errors"]["figures"], serde_json::json!({}));
    test_directory.run(&[]);
    assert_eq!(test_directory.summary("out/scene")["errors"]["figures"], serde_json::json!({}));
}

#[test]
fn a_signal_while_meshes_are_tried_says_so() {
    for asked in [&["--accuracy", "1e-5"][..], &["--bars", "--mesh", "fine.msh"]] {
        let directory = TestDirectory::new();
        directory.write("fine.msh", &square(192));
        // Where the load ends the answer is singular: no mesh is soon good enough.
        let load = ["--set", "boundary.top.traction=[0, '-3*t*if(x < 0.5, 1, 0)']"];
        let mut command = directory.command(&[&["run", "scene.toml"], asked, &load].concat());
        let run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let run = run.expect("the program starts");
        sleep(Duration::from_secs(3));
        signal(&run, "INT");
        let said = run.wait_with_output().expect("it ends");
        assert_eq!(said.status.code(), Some(130));
        let error = String::from_utf8_lossy(&said.stderr);
        assert!(error.contains("error: ended by SIGINT before the run began"), "{error}");
        assert!(!directory.path("out/scene/history.csv").exists(), "nothing is written");
    }
}

#[test]
fn figures_asked_for_are_those_of_the_scene() {
    let test_directory = TestDirectory::new();
    let said = test_directory.run(&["--accuracy", "0.1", "--accuracy-of", "work"]);
    assert!(said.out.contains("accuracy 0.1 of work reached"), "{}", said.out);
    let wrong = ["run", "scene.toml", "--accuracy", "0.1", "--accuracy-of", "wrk"];
    test_directory.say(&wrong).fails(2, &["accuracy_of", "`wrk`", "did you mean `work`"]);
    let alone = ["run", "scene.toml", "--accuracy-of", "work"];
    test_directory.say(&alone).fails(2, &["accuracy_of has no effect without accuracy"]);
}
