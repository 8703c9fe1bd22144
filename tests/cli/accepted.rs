//! Runs that go well: exit code 0, what is said, and the files.

use crate::test_directory::{ProgramOutput, TestDirectory, sets, square};
use serde_json::Value;
use signorini::contact::SOLVERS;
use std::{fs, process::Stdio};

/// The keys of `summary.json`, which scripts of users read.
const KEYS: &str = "provenance scene title solver ranks nodes triangles contact_nodes steps end_time active_nodes \
    figures kkt errors wall_seconds seconds_per_step phases boundaries units notes peak_megabytes stopped_by stopped_at stopped_uncertainty collapse";

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

#[test]
fn summary() {
    let test_directory = TestDirectory::new();
    let said = test_directory.run(&[]);
    assert_eq!(said.err, "", "nothing to warn of, and no bar without a terminal");
    for fragment in
        ["Pressed square", "finished at t = 1 after 10 steps", "sum of contact reactions 3 N/m"]
    {
        assert!(said.out.contains(fragment), "{}", said.out);
    }
    assert!(!said.out.contains("phase") && said.out.contains("results       out/scene"));
    assert!(said.out.lines().all(|line| line.trim_end() == line), "blanks at line ends");

    let summary = test_directory.summary("out/scene");
    let keys: Vec<&str> = summary.as_object().expect("an object").keys().map(|k| &**k).collect();
    assert_eq!(keys.join(" "), KEYS);
    let page = include_str!("../../geo/RESULTS.md");
    let absent = Vec::from_iter(keys.iter().filter(|key| !page.contains(&format!("`{key}"))));
    assert_eq!(absent, Vec::<&&str>::new(), "geo/RESULTS.md describes every entry");
    let kkt = summary["kkt"].as_object().expect("an object");
    assert!(kkt.len() == 4 && kkt.values().all(|v| number(v) <= 1e-10));
    assert_eq!(summary["scene"], "scene");
    assert_eq!(summary["title"], "Pressed square");
    assert_eq!(summary["solver"], "active-set");
    assert_eq!((&summary["nodes"], &summary["triangles"]), (&25.into(), &32.into()));
    assert_eq!((&summary["steps"], &summary["end_time"]), (&10.into(), &1.0.into()));
    assert_eq!(summary["stopped_at"], Value::Null);
    assert_eq!((&summary["contact_nodes"], &summary["active_nodes"]), (&5.into(), &5.into()));
    assert!((number(&summary["figures"]["contact_force"]["value"]) - 3.0).abs() < 1e-8);
    let (least, mean) = (
        number(&summary["figures"]["zeta_min"]["value"]),
        number(&summary["figures"]["zeta_mean"]["value"]),
    );
    assert!(0.9 < least && least <= mean && mean < 1.0, "{least} {mean}");
    // u_y = −p y/(ζE) at the top, u_x = νp x/(ζE): ζ is uniform here.
    let top = 3.0 / 80.0 * 1.0_f64.hypot(0.3) / mean;
    assert!((number(&summary["figures"]["displacement_max"]["value"]) / top - 1.0).abs() < 1e-6);
    assert!(
        (number(&summary["figures"]["work"]["value"]) / (9.0 / 80.0 / mean) - 1.0).abs() < 1e-6
    );
    let phases = summary["phases"].as_object().expect("an object");
    let whole = phases.iter().filter(|(name, _)| !name.contains('/'));
    let seconds: f64 = whole.map(|(_, seconds)| number(seconds)).sum();
    let wall = number(&summary["wall_seconds"]);
    assert!(phases.contains_key("contact") && seconds <= wall);
    assert!((number(&summary["seconds_per_step"]) * 10.0 / wall - 1.0).abs() < 1e-9);
    assert!(summary["notes"].as_array().is_some());
}

#[test]
fn history() {
    let test_directory = TestDirectory::new();
    test_directory.run(&[]);
    let (names, rows) = test_directory.history("out/scene");
    assert_eq!(rows.len(), 11);
    let column = |name: &str| names.iter().position(|n| n == name).expect("a column");
    for (n, row) in rows.iter().enumerate() {
        assert_eq!(row[column("step")], n as f64);
        assert!((row[column("time")] - 0.1 * n as f64).abs() < 1e-12);
        assert!((row[column("contact_force")] - 0.3 * n as f64).abs() < 1e-8);
    }
    let summary = test_directory.summary("out/scene");
    let last = rows.last().expect("rows");
    for name in summary["figures"].as_object().expect("figures").keys() {
        // serde_json's numbers may be off in the last digit.
        let (a, b) = (number(&summary["figures"][name]["value"]), last[column(name)]);
        assert!((a - b).abs() <= 1e-15 * b.abs(), "{name}: {a} is not {b}");
    }
    assert!((number(&summary["figures"]["bottom.force_y"]["value"]) - 3.0).abs() < 1e-8);
}

#[test]
fn stopped_at_the_threshold() {
    let test_directory = TestDirectory::new();
    let sets = ["damage.lambda_u=1e4", "time.scheme=euler"];
    let said = test_directory.run(&self::sets(&sets));
    assert!(said.out.contains("STOPPED") && said.out.contains("ζ_*"), "{}", said.out);
    let summary = test_directory.summary("out/scene");
    let (stopped, end) = (number(&summary["stopped_at"]), number(&summary["end_time"]));
    assert!(0.0 < end && end < stopped && stopped < 1.0);
    assert!((stopped - end - 0.1).abs() < 1e-12, "one step after the state kept");
    assert!(
        number(&summary["figures"]["zeta_min"]["value"]) > 0.01,
        "the state kept is admissible"
    );
    assert!(summary["error"].is_null());
    let (_, rows) = test_directory.history("out/scene");
    assert_eq!(rows.len() as u64, summary["steps"].as_u64().expect("a number") + 1);
    assert_eq!(test_directory.frames("out/scene").last().expect("frames").0, end);
}

#[test]
fn static_and_elastic() {
    let test_directory = TestDirectory::new();
    let scene = test_directory.read("scene.toml");
    let (damage, contact) = (scene.find("[damage]"), scene.find("[contact]"));
    let (damage, contact) = (damage.expect("a table"), contact.expect("a table"));
    test_directory.write("scene.toml", &format!("{}{}", &scene[..damage], &scene[contact..]));
    let said = test_directory.run(&[]);
    assert!(said.out.contains("solved at t = 1"), "{}", said.out);
    let summary = test_directory.summary("out/scene");
    assert_eq!((&summary["steps"], &summary["end_time"]), (&0.into(), &1.0.into()));
    assert!(
        (number(&summary["figures"]["displacement_max"]["value"]) - 3.0 / 80.0 * 1.09_f64.sqrt())
            .abs()
            < 1e-12
    );
    assert_eq!(test_directory.frames("out/scene").len(), 1);
    assert_eq!(test_directory.history("out/scene").1.len(), 1);
}

#[test]
fn options_are_honoured() {
    let directory = TestDirectory::new();
    directory.write("other/fine.msh", &square(6));
    let keys = sets(&["time.step=0.25", "boundary.top.traction=[0, '-8*t']"]);
    let options =
        ["--mesh", "other/fine.msh", "--out", "my/results", "--solver", "penalty-duality"];
    let said = directory.run(&[&options, &keys[..]].concat());
    assert!(said.out.contains("results       my/results"), "{}", said.out);
    assert!(!directory.path("out").exists());
    let summary = directory.summary("my/results");
    assert_eq!((&summary["nodes"], &summary["steps"]), (&49.into(), &4.into()));
    assert_eq!(summary["solver"], "penalty-duality");
    assert!((number(&summary["figures"]["contact_force"]["value"]) - 8.0).abs() < 1e-6);
}

/// Pressed on one half of the top and pulled on the other.
const PARTLY_OPEN: [&str; 4] = [
    "--set",
    "boundary.top.traction=[0, '-40 + 50*max(0, min(1, 1e9*(x - 0.5)))']",
    "--set",
    "time.end=0.2",
];

#[test]
fn solvers_and_petsc_options_agree() {
    let test_directory = TestDirectory::new();
    test_directory.write("square.msh", &square(8));
    let mut answers = Vec::new();
    for arguments in [
        &["--solver", "active-set"][..],
        &["--solver", "penalty-duality"],
        &["--solver", "tao"],
        &["--solver", "tao", "--", "-tao_type", "bnls"],
        // Its last factor is of a part of K, which the estimate of the errors cannot use.
        &["--solver", "tao:bntr"],
        &["--", "-elastic_ksp_type", "preonly", "-elastic_pc_type", "cholesky"],
        &["--", "-elastic_ksp_type", "minres", "-elastic_pc_type", "jacobi"],
        // Not enough for the tolerance: TAO, with a factor of its own, answers.
        &["--", "-elastic_ksp_type", "preonly", "-elastic_pc_type", "jacobi"],
    ] {
        let said = test_directory.run(&[&PARTLY_OPEN[..], arguments].concat());
        assert_eq!(said.err, "", "{arguments:?}");
        let gives_up = arguments.ends_with(&["preonly", "-elastic_pc_type", "jacobi"]);
        assert_eq!(said.out.contains("PETSc's KSP ended with CONVERGED_ITS"), gives_up);
        let summary = test_directory.summary("out/scene");
        let active = number(&summary["active_nodes"]);
        assert!(0.0 < active && active < number(&summary["contact_nodes"]), "{active}");
        answers.push([
            number(&summary["figures"]["displacement_max"]["value"]),
            number(&summary["figures"]["work"]["value"]),
            number(&summary["figures"]["zeta_min"]["value"]),
            active,
        ]);
    }
    for answer in &answers[1..] {
        for (a, b) in answer.iter().zip(&answers[0]) {
            assert!((a / b - 1.0).abs() < 1e-7, "{answers:?}");
        }
    }
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let test_directory = TestDirectory::new();
    let mut command = test_directory.command(&["run", "scene.toml"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("an end");
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn unused_petsc_options_are_told() {
    let test_directory = TestDirectory::new();
    let said = test_directory.run(&["--", "-tao_monitr", "-no_such_thing", "3"]);
    assert!(said.err.starts_with("warning: PETSc options that nothing read: "), "{}", said.err);
    assert!(said.err.contains("-tao_monitr") && said.err.contains("-no_such_thing"));
    assert_eq!(said.err.lines().count(), 1);
}

#[test]
fn a_step_that_does_not_divide_the_end_is_noted() {
    let test_directory = TestDirectory::new();
    let note = "time.step = 0.3 does not divide time.end = 1: 4 steps of 0.25 are made";
    let said = test_directory.run(&["--set", "time.step=0.3"]);
    assert!(said.out.contains(note), "{said:?}");
    assert!(said.out.contains("time          4 steps of 0.25 s to t = 1"), "{said:?}");
    assert!(test_directory.summary("out/scene")["notes"].to_string().contains(note));
    // Written with rounding, thirds divide the end.
    for step in ["0.1", "0.333333333333"] {
        let said = test_directory.run(&["--set", &format!("time.step={step}")]);
        assert!(!said.out.contains("does not divide"), "{said:?}");
    }
}

#[test]
fn shells_complete_commands_and_options() {
    let test_directory = TestDirectory::new();
    for shell in ["bash", "zsh", "fish"] {
        let said = test_directory.say(&["completions", shell]);
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{shell}");
        assert!(["compare", "accuracy"].iter().all(|word| said.out.contains(word)), "{shell}");
    }
}

#[test]
fn every_command_of_the_help_has_a_manual_page() {
    let test_directory = TestDirectory::new();
    fs::create_dir(test_directory.path("man")).expect("writable");
    assert_eq!(test_directory.say(&["man", "man"]).code, Some(0));
    let help = test_directory.say(&["-h"]).out;
    let (_, commands) = help.split_once("Commands:\n").expect("the list");
    let lines = commands.lines().take_while(|line| !line.is_empty());
    let named = lines
        .filter(|line| !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next());
    let mut pages: Vec<_> =
        named.filter(|name| *name != "help").map(|name| format!("signorini-{name}.1")).collect();
    assert!(pages.len() > 10, "{help}");
    pages.push("signorini.1".to_owned());
    pages.sort();
    assert_eq!(test_directory.names("man"), pages);
    assert!(test_directory.read("man/signorini-run.1").contains("accuracy\\-of"));
}

/// Stages are PETSc's: its log has them by their names, and the summary has their parts.
#[test]
fn petscs_log_has_the_stages_of_a_run_and_the_parts_of_a_stage_are_within_it() {
    let directory = TestDirectory::new();
    let moving = ["--set", "boundary.top.traction=[0, '-1 - sin(6*t)']", "--", "-log_view"];
    let out = directory.run(&moving).out;
    let phases = directory.summary("out/scene")["phases"].clone();
    let seconds = |name: &str| number(&phases[name]);
    let names = ["factorisation", "triangular solves", "products"];
    let parts = names.map(|name| seconds(&format!("contact/{name}")));
    assert!(parts.iter().sum::<f64>() <= seconds("contact"), "{parts:?}: {phases}");
    for name in names.iter().chain(&["contact", "damage solve", "stiffness"]) {
        assert!(out.contains(&format!(": {name:>15}: ")), "no `{name}` in: {out}");
    }
}

#[test]
fn a_process_alone_needs_no_home_and_no_directory_of_temporary_files() {
    // Open MPI's is common to all processes of a user, who would make and remove it at the same time.
    let test_directory = TestDirectory::new();
    for (name, value) in
        [("TMPDIR", Some("/proc/none")), ("HOME", Some("/proc/none")), ("HOME", None)]
    {
        let mut command = test_directory.command(&["run", "scene.toml"]);
        command.env_remove(name).envs(value.map(|value| (name, value)));
        let said = ProgramOutput::of(&mut command);
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""), "{name} {value:?}: {said:?}");
    }
}

#[test]
fn the_solvers_are_listed_with_what_they_do() {
    let said = TestDirectory::new().say(&["solvers"]);
    assert_eq!(said.code, Some(0));
    let names: Vec<_> = said.out.lines().map(|line| line.split_once('\t').unwrap().0).collect();
    assert_eq!(names, SOLVERS);
    let help = TestDirectory::new().say(&["run", "--help"]);
    assert!(SOLVERS.iter().all(|name| help.out.contains(name)), "{}", help.out);
}
