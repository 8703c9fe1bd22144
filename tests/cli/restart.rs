//! Checkpoints and restarts: the same results bit by bit, whenever a run ends and however.

use crate::{
    accuracy::write_bar,
    losses::ENDLESS,
    test_directory::{ProgramOutput, TestDirectory, signal, start, wait_until},
};
use std::{fs, process::Child};

/// A run of some seconds …
const LONG: [&str; 2] = ["--set", "time.step=2e-3"];
/// … with a checkpoint after every step, or nearly so.
const OFTEN: [&str; 4] = ["--set", "output.checkpoint=1e-9", "--set", "output.every=50"];

fn started(directory: &TestDirectory, out: &str, arguments: &[&str]) -> Child {
    start(&mut directory.command(&[&["run", "scene.toml", "--out", out], arguments].concat()))
}

#[test]
fn a_killed_run_goes_on_as_if_it_had_not_been() {
    for choice in [
        [&LONG[..], &["--solver", "active-set", "--set", "damage.mass=lumped"]],
        [&LONG, &["--solver", "penalty-duality", "--set", "time.scheme=bdf2"]],
        [&LONG, &["--solver", "tao", "--set", "discretisation.displacement=2"]],
        // The damage system has the factor of an earlier step length.
        [&["--set", "time.step=\"auto\""], &["--set", "time.tolerance=1e-5"]],
    ] {
        let directory = TestDirectory::new();
        let arguments = [&OFTEN[..], &choice.concat()].concat();
        directory.run(&[&arguments[..], &["--out", "whole"]].concat());
        let expected = directory.results("whole");
        assert!(expected.keys().all(|name| !name.starts_with("checkpoint")), "it is of no use now");

        let mut run = started(&directory, "killed", &arguments);
        for step in [60, 110] {
            wait_until(&mut run, "a checkpoint", || directory.has_checkpoint("killed", step));
            run.kill().expect("it lives");
            run.wait().expect("it ends");
            directory.frames("killed").iter().for_each(|(_, file)| {
                assert!(directory.path(&format!("killed/{file}")).exists(), "{file}");
            });
            run = started(&directory, "killed", &[&arguments[..], &["--restart"]].concat());
        }
        assert_eq!(run.wait().expect("it ends").code(), Some(0));
        assert!(directory.results("killed") == expected, "{choice:?}");
    }
}

/// A file that a run continues may have another name, elsewhere: what stands under that name stays.
#[test]
fn another_name_of_a_file_that_goes_on() {
    let (directory, arguments) = (TestDirectory::new(), [&LONG[..], &OFTEN].concat());
    let mut run = started(&directory, "killed", &arguments);
    wait_until(&mut run, "a checkpoint", || directory.has_checkpoint("killed", 60));
    run.kill().expect("it lives");
    run.wait().expect("it ends");
    let names = ["history.csv", "contact.csv", "fields.pvd"].map(|name| format!("killed/{name}"));
    let texts = names.each_ref().map(|name| {
        let other = directory.path(&name.replace("killed/", "other-"));
        fs::hard_link(directory.path(name), other).expect("a link");
        directory.read(name)
    });
    directory.run(&[&arguments[..], &["--out", "killed", "--restart"]].concat());
    for (name, text) in names.iter().zip(texts) {
        assert_eq!(directory.read(&name.replace("killed/", "other-")), text, "{name}");
        assert!(directory.read(name).len() > text.len(), "{name} has grown");
    }
}

/// A homogeneous bar whose first time steps are too long for the accuracy.
#[test]
fn a_repetition_with_shorter_steps_goes_on_as_if_it_had_not_been_interrupted() {
    let directory = TestDirectory::new();
    let damage = "diffusion = 1e-3, lambda_d = 0, lambda_u = 300";
    write_bar(&directory, 1000.0, damage, "traction = [0, '60*sin(20*t)']");
    let arguments = [&["--accuracy", "0.1"], &OFTEN[..]].concat();
    let said = directory.run(&[&arguments[..], &["--out", "whole"]].concat());
    assert!(said.out.contains("again "), "{}", said.out);
    let said = fs::File::create(directory.path("said")).expect("mine");
    let all = [&["run", "scene.toml", "--out", "ended"], &arguments[..]].concat();
    let mut run = directory.command(&all).stdout(said).spawn().expect("the program starts");
    wait_until(&mut run, "the repetition", || directory.read("said").contains("again "));
    signal(run.id(), "TERM");
    assert_eq!(run.wait().expect("it ends").code(), Some(143));
    let said = directory.run(&[&arguments[..], &["--out", "ended", "--restart"]].concat());
    let [again, restart] = ["again ", "restart "].map(|row| said.out.find(row));
    assert!(again < restart && again.is_some(), "within the repetition: {}", said.out);
    assert!(directory.results("ended") == directory.results("whole"));
}

#[test]
fn a_signal_ends_a_run_behind_a_step() {
    for (name, code) in [("INT", 130), ("TERM", 143)] {
        let directory = TestDirectory::new();
        let out = fs::File::create(directory.path("said")).expect("mine");
        let errors = out.try_clone().expect("mine");
        let mut command = directory.command(&ENDLESS);
        let mut run = command.stdout(out).stderr(errors).spawn().expect("the program starts");
        wait_until(&mut run, "a frame", || directory.path("out/scene/fields.pvd").exists());
        signal(run.id(), name);
        assert_eq!(run.wait().expect("it ends").code(), Some(code));
        let said = directory.read("said");
        assert!(said.contains(&format!("error: ended by SIG{name}; --restart goes on")), "{said}");
        let (steps, rows) =
            (directory.summary("out/scene")["steps"].clone(), directory.history("out/scene").1);
        assert_eq!(steps, rows.len() - 1, "the summary tells the last row");
        let (last, _) = directory.frames("out/scene").pop().expect("frames");
        let end = directory.summary("out/scene")["end_time"].as_f64().expect("a time");
        assert!((end - last).abs() < 1e-12, "the last state is saved");
        assert!(directory.path(&format!("out/scene/checkpoint_{steps}_0")).exists());
    }
}

#[test]
fn what_is_no_checkpoint_of_this_run_is_refused() {
    let directory = TestDirectory::new();
    // There is none: the run begins.
    let said = directory.run(&["--set", "time.end=0.1", "--restart"]);
    assert!(said.err.contains("has no checkpoint; the run begins at its start"), "{}", said.err);
    let mut run = started(&directory, "out", &[&LONG[..], &OFTEN].concat());
    wait_until(&mut run, "a checkpoint", || directory.has_checkpoint("out", 10));
    signal(run.id(), "TERM");
    run.wait().expect("it ends");
    let file = directory.names("out").into_iter().find(|name| name.starts_with("checkpoint"));
    let path = directory.path(&format!("out/{}", file.expect("a checkpoint")));
    let restart = |more: &[&str], fragment: &str| {
        let arguments = ["run", "scene.toml", "--out", "out", "--restart"];
        let before = directory.everything();
        let said = directory.say(&[&arguments, &LONG[..], &OFTEN, more].concat());
        said.fails(2, &["cannot restart from out/checkpoint_", fragment, "without --restart"]);
        assert!(directory.everything() == before, "nothing is touched");
    };
    restart(
        &["--set", "material.young=81"],
        "the scene, its tables, --set, --solver or PETSc's options have changed",
    );
    let mesh = directory.read("square.msh");
    directory.write("square.msh", &mesh.replace("0.25 0.25 0\n", "0.26 0.25 0\n"));
    restart(&[], "the mesh has changed");
    directory.write("square.msh", &mesh);
    let content = fs::read(&path).expect("the checkpoint");
    let mut damaged = content.clone();
    damaged[content.len() / 2] ^= 4;
    for (wrong, reason) in [
        (&damaged[..], "it is damaged"),
        (&content[..content.len() - 1], "it is damaged"),
        (&content[..25], "the file is cut off"),
        (b"another file", "it is no checkpoint of this version"),
    ] {
        fs::write(&path, wrong).expect("mine");
        restart(&[], reason);
    }
    // Nor one of results that are gone.
    fs::write(&path, content).expect("mine");
    let history = directory.read("out/history.csv");
    let without_a_row: Vec<_> = history.lines().enumerate().filter(|(i, _)| *i != 3).collect();
    let without_a_row: String = without_a_row.iter().map(|(_, row)| format!("{row}\n")).collect();
    let another_digit = history.replacen("\n1,0.", "\n1,1.", 1);
    let arguments =
        [&["run", "scene.toml", "--out", "out", "--restart"][..], &LONG, &OFTEN].concat();
    for changed in ["step\n", &without_a_row, &another_digit] {
        assert_ne!(history, changed);
        directory.write("out/history.csv", changed);
        let before = directory.everything();
        ProgramOutput::of(&mut directory.command(&arguments))
            .fails(1, &["out/history.csv", "changed after the checkpoint", "without --restart"]);
        assert!(directory.everything() == before, "nothing is touched");
    }
    // Pictures and reports of the interrupted run do not show the whole one.
    directory.write("out/history.csv", &history);
    directory.write("out/pressure.png", "");
    directory.write("out/report.html", "");
    directory.write("out/mine.png", "");
    directory.run(&[&["--out", "out", "--restart"], &LONG[..], &OFTEN].concat());
    let names = directory.names("out");
    let is_there = |name: &str| names.iter().any(|other| other == name);
    assert!(!is_there("pressure.png") && !is_there("report.html") && is_there("mine.png"));
}
