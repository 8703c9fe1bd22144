//! Runs that start themselves on several ranks.

use super::{
    example, on_ranks,
    repeat::results,
    test_directory::{ProgramOutput, TestDirectory},
};
use std::{
    fs::File,
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

/// So many steps that the run lasts until it is ended.
const ENDLESS: [&str; 4] = ["run", "scene.toml", "--set", "time.step=1e-6"];

/// Starts an endless run with more arguments, and waits for its first frame.
fn start(directory: &TestDirectory, arguments: &[&str]) -> Child {
    let mut command = directory.command(&[&ENDLESS[..], arguments].concat());
    let out = File::create(directory.path("said")).expect("a file");
    let child = command.stdout(out).stderr(Stdio::null()).spawn().expect("the program starts");
    let started = Instant::now();
    while !directory.path("out/scene/fields.pvd").exists() {
        assert!(started.elapsed() < Duration::from_secs(60), "no frame appears");
        sleep(Duration::from_millis(5));
    }
    child
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args(["-s", name, &child.id().to_string()]).status();
    assert!(status.expect("kill").success());
}

#[test]
fn ranks_that_are_asked_for_give_what_those_of_mpiexec_give() {
    let directory = example("lshape-rolling");
    let few = ["run", "scene.toml", "--set", "mesh.size=0.5", "--set", "time.step=0.1"];
    let asked = directory.say(&[&few[..], &["--ranks", "2", "--out", "asked"]].concat());
    let given = [&few[..], &["--out", "given"]].concat();
    let given = ProgramOutput::of(&mut on_ranks(&directory, 2, &given));
    assert_eq!((asked.code, given.code), (Some(0), Some(0)), "{asked:?} {given:?}");
    assert!(asked.err.is_empty() && asked.out.contains("on 2 ranks"), "{asked:?}");
    assert_eq!(results(&directory, "asked"), results(&directory, "given"));
}

#[test]
fn failures_of_ranks_are_told_once_with_their_exit_code() {
    let directory = TestDirectory::new();
    let run =
        |more: &[&str]| directory.say(&[&["run", "scene.toml", "--ranks", "2"], more].concat());
    for (code, arguments, fragment) in [
        (2, &["--set", "material.young=-1"][..], "material.young"),
        (1, &["--set", "contact.tolerance=1e-30"], "the tolerance 1.0e-30 is missed"),
    ] {
        let said = run(arguments);
        said.fails(code, &[fragment]);
        assert_eq!(said.err.matches("error: ").count(), 1, "{said:?}");
    }
    let given = ["run", "scene.toml", "--ranks", "3"];
    let said = ProgramOutput::of(&mut on_ranks(&directory, 2, &given));
    super::one_message(&said, 2, "--ranks 3 has no effect where mpiexec has started 2");
}

#[test]
fn signals_end_ranks_with_their_state_and_a_restart_takes_as_many() {
    let directory = TestDirectory::new();
    for (name, code, arguments) in
        [("INT", 130, &["--ranks", "2"][..]), ("TERM", 143, &["--restart"])]
    {
        let mut child = start(&directory, arguments);
        sleep(Duration::from_millis(if code == 143 { 2000 } else { 0 }));
        signal(&child, name);
        assert_eq!(child.wait().expect("it ends").code(), Some(code));
        let said = directory.read("said");
        assert!(said.contains("on 2 ranks") && said.contains("the state there is saved"), "{said}");
        let error = directory.summary("out/scene")["error"].to_string();
        assert!(error.contains(&format!("SIG{name}")), "{error}");
        assert!(directory.names("out/scene").iter().any(|file| file.starts_with("checkpoint_")));
    }
    assert!(directory.read("said").contains("restart       from step"));
}

#[test]
fn ranks_end_with_the_process_that_was_typed() {
    let directory = TestDirectory::new();
    let mut child = start(&directory, &["--ranks", "2"]);
    signal(&child, "KILL");
    assert_eq!(child.wait().expect("it ends").code(), None);
    // While they live they keep other runs out of the folder.
    let started = Instant::now();
    while directory.say(&["run", "scene.toml"]).code != Some(0) {
        assert!(started.elapsed() < Duration::from_secs(20), "the ranks live on");
        sleep(Duration::from_millis(100));
    }
}
