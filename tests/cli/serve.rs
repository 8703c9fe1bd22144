//! `signorini serve`, by which `study` runs its cases: the same answers as by processes of their own, and the same ends.

use crate::{
    losses::ENDLESS,
    test_directory::{TestDirectory, signal, wait_until},
};
use std::{
    fs,
    io::{BufRead, BufReader, Write},
    process::{Child, ChildStdout, Command, Stdio},
    thread::sleep,
    time::Duration,
};

/// A server, and its answers.
struct Server(Child, BufReader<ChildStdout>);

impl Server {
    fn new(directory: &TestDirectory, environment: Option<(&str, &str)>) -> Self {
        let mut command = directory.command(&["serve"]);
        command
            .envs(environment)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().expect("it starts");
        let answers = BufReader::new(child.stdout.take().expect("a pipe"));
        Self(child, answers)
    }

    /// Begins a command.
    fn begin(&mut self, words: &[&str]) {
        let line = serde_json::to_string(words).expect("JSON");
        writeln!(self.0.stdin.as_ref().expect("a pipe"), "{line}").expect("the server reads");
    }

    /// The answer to a command.
    fn answer(&mut self) -> String {
        let mut line = String::new();
        self.1.read_line(&mut line).expect("UTF-8");
        line.trim_end().to_owned()
    }

    fn say(&mut self, words: &[&str]) -> String {
        self.begin(words);
        self.answer()
    }

    /// Ends its input. Returns its exit code and its errors.
    fn end(mut self) -> (Option<i32>, String) {
        drop(self.0.stdin.take());
        let ended = self.0.wait_with_output().expect("it ends");
        (ended.status.code(), String::from_utf8(ended.stderr).expect("UTF-8"))
    }
}

/// The processes that a process has started (ps(1)).
fn children(process: u32) -> Vec<u32> {
    let listed = Command::new("ps").args(["-o", "pid=", "--ppid", &process.to_string()]).output();
    let listed = String::from_utf8(listed.expect("ps").stdout).expect("numbers");
    listed.split_whitespace().map(|word| word.parse().expect("a number")).collect()
}

/// All files are equal byte by byte, and one run leaves nothing behind that changes the next.
#[test]
fn a_server_gives_the_same_answers_as_processes_of_their_own() {
    let directory = TestDirectory::new();
    let scene = directory.read("scene.toml");
    let part = |from: &str, to: &str| {
        let [from, to] = [from, to].map(|name| scene.find(name).expect("a table"));
        [&scene[..from], &scene[to..]].concat()
    };
    directory.write("static.toml", &part("[damage]", "[contact]").replace("-3*t", "-3"));
    let mut server = Server::new(&directory, None);
    for (k, words) in [
        &["scene.toml"][..],
        &["static.toml", "--set", "discretisation.displacement=2", "--bars"],
        &["scene.toml", "--accuracy", "0.1"],
        &["scene.toml", "--set", "output.every=1", "--solver", "tao"],
        &["static.toml"],
    ]
    .iter()
    .enumerate()
    {
        let [own, served] = ["own", "served"].map(|name| format!("out/{name}{k}"));
        let words = [&["run"], *words].concat();
        let said = directory.say(&[&words[..], &["--out", &own]].concat());
        assert_eq!(said.code, Some(0), "{said:?}");
        let all = [&words[..], &["--out", &served]].concat();
        assert_eq!(server.say(&all), "0", "{words:?}");
        assert!(directory.results(&own) == directory.results(&served), "{words:?}");
        // The results know their own command, not that of the server.
        let summary = directory.summary(&served);
        let command = summary["provenance"]["command"].as_array().expect("words");
        assert!(command[1..] == all[..], "{command:?}");
    }
    let (code, err) = server.end();
    assert!(code == Some(0) && !err.contains("error:"), "{code:?}: {err}");
}

/// Failures are reported as by a process of its own. A command that PETSc's start or other processes belong to is not forked.
#[test]
fn a_server_goes_on_after_failures_and_refuses_what_is_no_fork() {
    let directory = TestDirectory::new();
    let mut server = Server::new(&directory, None);
    let refused = ["run", "scene.toml", "--set", "material.poisson=0.7"];
    assert_eq!(server.say(&refused), "2");
    assert_eq!(server.say(&["run", "--no-such-option"]), "2");
    for words in
        [&["run", "scene.toml", "--", "-log_view"][..], &["run", "scene.toml", "--ranks=2"]]
    {
        assert_eq!(server.say(words), "null", "{words:?}");
    }
    writeln!(server.0.stdin.as_ref().expect("a pipe"), "no JSON").expect("the server reads");
    assert_eq!(server.answer(), "null");
    server.begin(&ENDLESS);
    let id = server.0.id();
    wait_until(&mut server.0, "a step", || directory.path("out/scene/history.csv").exists());
    signal(children(id)[0], "KILL");
    assert_eq!(server.answer(), "137");
    assert_eq!(server.say(&["run", "scene.toml"]), "0");
    let (code, err) = server.end();
    assert_eq!(code, Some(0));
    let own = directory.say(&refused).err;
    assert!(err.starts_with(&own) && err.contains("'--no-such-option'"), "{err}");

    let options = Some(("PETSC_OPTIONS", "-log_view"));
    assert_eq!(Server::new(&directory, options).say(&["run", "scene.toml"]), "null");
}

/// The same signal comes to the server and to its command, as `study` sends it.
#[test]
fn a_signal_ends_the_command_behind_its_step_and_then_the_server() {
    for (name, code) in [("INT", "130"), ("TERM", "143")] {
        let directory = TestDirectory::new();
        let mut server = Server::new(&directory, None);
        server.begin(&ENDLESS);
        let id = server.0.id();
        wait_until(&mut server.0, "a step", || directory.path("out/scene/history.csv").exists());
        [children(id)[0], id].iter().for_each(|process| signal(*process, name));
        assert_eq!(server.answer(), code);
        let (ended, err) = server.end();
        assert_eq!(ended.map(|code| code.to_string()).as_deref(), Some(code));
        let message = format!("error: ended by SIG{name}; --restart goes on from here");
        assert!(err.contains(&message) && directory.has_checkpoint("out/scene", 1), "{err}");
    }
}

/// A study reports a case that the system kills, runs the others, and ends on Ctrl-C with its cases behind their steps.
#[test]
fn a_study_reports_killed_cases_and_stops_on_a_signal() {
    let directory = TestDirectory::new();
    let words =
        ["study", "scene.toml", "--set", "material.young=80,160", "--set", "time.step=1e-6"];
    let Some(_) = directory.say_python(&["study", "--help"]) else { return };
    let start = |out: &str| {
        let mut command = directory.command(&[&words[..], &["--jobs", "1", "--out", out]].concat());
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
    };
    let has_begun = |folder: &str| directory.path(folder).join("history.csv").exists();

    let mut study = start("killed");
    let id = study.id();
    wait_until(&mut study, "a step", || has_begun("killed/young=80__step=1e-6"));
    signal(children(children(id)[0])[0], "KILL");
    wait_until(&mut study, "the second case", || has_begun("killed/young=160__step=1e-6"));
    // A server does not leave its command alone.
    let server = children(id)[0];
    let run = children(server)[0];
    signal(server, "KILL");
    let ended = study.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&ended.stdout).into_owned();
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert_eq!(said.matches("the run ended with exit code 137: Killed").count(), 4, "{said}");
    let is_alive = || {
        let state = fs::read_to_string(format!("/proc/{run}/stat")).unwrap_or_default();
        !state.is_empty() && !state.contains(") Z")
    };
    while is_alive() {
        sleep(Duration::from_millis(20));
    }

    let (mut study, case) = (start("stopped"), "stopped/young=80__step=1e-6");
    wait_until(&mut study, "a step", || has_begun(case));
    signal(study.id(), "INT");
    let ended = study.wait_with_output().expect("it ends");
    let err = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(
        ended.status.code() == Some(130) && err.starts_with("stopped; run the same command"),
        "{err}"
    );
    let summary = directory.summary(case);
    assert!(summary["error"].as_str().is_some_and(|e| e.contains("SIGINT")), "{summary}");
    assert!(directory.has_checkpoint(case, 1), "the case is saved");
}
