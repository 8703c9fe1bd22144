//! Solvers that miss their tolerance: exit code 1, and the state before is saved.

use crate::test_directory::{ProgramOutput, SCENE, TestDirectory, sets};
use std::process::Command;

/// At rest until t = 0.2, so that steps 0 to 2 need no solver; the third does.
pub const LATE: &str = "boundary.top.traction=[0, '-max(0, t - 0.2)']";

/// No solver meets the tolerance of the first solve.
const FIRST: [&str; 4] =
    ["--set", "boundary.top.traction=[0, -3]", "--set", "contact.tolerance=1e-30"];

#[track_caller]
fn fails_at_the_third_step(arguments: &[&str], fragments: &[&str]) {
    let test_directory = TestDirectory::new();
    let said = test_directory.say(&[&["run", "scene.toml", "--set", LATE], arguments].concat());
    said.fails(1, &[&["step 3 (t = 0.3", "times"], fragments].concat());
    assert!(said.out.contains("FAILED after t = 0.2; the state there is saved"), "{}", said.out);

    let summary = test_directory.summary("out/scene");
    let error = summary["error"].as_str().expect("the error");
    assert_eq!(said.err, format!("error: {error}\n"));
    assert_eq!((&summary["steps"], &summary["end_time"]), (&2.into(), &0.2.into()));
    assert_eq!(test_directory.history("out/scene").1.len(), 3);
    let (time, file) = test_directory.frames("out/scene").pop().expect("frames");
    assert_eq!(time, 0.2);
    assert!(test_directory.path(&format!("out/scene/{file}")).exists());
}

#[test]
fn a_solver_that_misses_its_tolerance_or_has_no_iterations() {
    for solver in ["active-set", "tao"] {
        fails_at_the_third_step(
            &["--solver", solver, "--set", "contact.tolerance=1e-30"],
            &[solver, "the tolerance 1.0e-30 is missed by", "stationarity"],
        );
    }
    fails_at_the_third_step(
        &["--solver", "tao:tron", "--", "-tao_max_funcs", "0"],
        &["tao:tron stopped after 0 iterations", "stationarity 1.0e0, 1.0e10 times too large"],
    );
    let none = sets(&["contact.penalty_duality.iterations=0", "contact.rescue=false"]);
    fails_at_the_third_step(
        &[&["--solver", "penalty-duality"], &none[..]].concat(),
        &["penalty-duality stopped after 0 iterations", "the tolerance 1.0e-10 is missed by"],
    );
}

#[test]
fn the_first_solve_fails() {
    let directory = TestDirectory::new();
    let said = directory.say(&[&["run", "scene.toml"], &FIRST[..]].concat());
    said.fails(1, &["step 0 (t = 0): active-set", "the tolerance 1.0e-30 is missed by"]);
    assert!(said.out.contains("FAILED at the first solve; there is no state to save"));
    assert!(directory.names("out/scene").is_empty(), "there is nothing to write");
}

#[test]
fn results_stay_until_there_are_others() {
    let test_directory = TestDirectory::new();
    test_directory.run(&["--set", "time.end=0.1"]);
    let before = test_directory.everything();
    let failing = [
        (1, &FIRST[..]),
        (2, &["--", "-elastic_pc_type", "none_such"]),
        (2, &["--", "-damage_pc_type", "none_such"]),
        (2, &["--", "-elastic_pc_factor_mat_solver_type", "none_such"]),
    ];
    for (code, arguments) in failing {
        let said = test_directory.say(&[&["run", "scene.toml"], arguments].concat());
        said.fails(code, &[]);
        assert!(test_directory.everything() == before, "{said:?}");
    }
}

#[test]
fn a_static_solve_fails_without_a_word_of_steps() {
    let test_directory = TestDirectory::new();
    let text = SCENE.replace("[time]\nend = 1\nstep = 0.1\n", "");
    test_directory.write("scene.toml", &text);
    let none = ["run", "scene.toml", "--solver", "tao:tron", "--", "-tao_max_funcs", "0"];
    let said = test_directory.say(&none);
    said.fails(
        1,
        &[
            "error: tao:tron stopped after 0 iterations",
            "; try a larger contact.tolerance, another contact.solver",
        ],
    );
    assert!(!said.err.contains("step"), "{}", said.err);
    // Nor of solvers where there is no contact.
    test_directory.write("scene.toml", &text.replace("gap = \"0\"", "symmetry = true"));
    let said = test_directory.say(&["run", "scene.toml", "--set", "contact.tolerance=1e-30"]);
    said.fails(1, &["error: "]);
    assert!(!said.err.contains("step") && !said.err.contains("solver"), "{}", said.err);
}

#[test]
fn a_load_that_is_not_finite_between_the_times_checked_beforehand() {
    // 10⁴ steps, of which every tenth is checked: 0.0014 to 0.0016 are not.
    let value = "-0.01*t + 0*sqrt(abs(t - 0.0015) - 0.00015)";
    for key in ["traction", "displacement"] {
        let test_directory = TestDirectory::new();
        test_directory.write(
            "scene.toml",
            &SCENE
                .replace("traction = [\"0\", \"-3*t\"]", &format!("{key} = [\"0\", \"{value}\"]")),
        );
        let said = test_directory.say(&["run", "scene.toml", "--set", "time.step=1e-4"]);
        let place = format!("scene.toml:29: boundary.top.{key}[1] is NaN at (");
        said.fails(1, &[&place, "t = 0.0014"]);
        assert!(said.out.contains("FAILED after t = 0.0013; the state there is saved"), "{said:?}");
        assert_eq!(test_directory.history("out/scene").1.len(), 14);
        let (time, _) = test_directory.frames("out/scene").pop().expect("frames");
        assert!((time - 0.0013).abs() < 1e-12);
        let error = &test_directory.summary("out/scene")["error"];
        assert_eq!(said.err, format!("error: {}\n", error.as_str().expect("the error")));
    }
}

/// A strain that makes λ_U |ε|² overflow.
const OVERFLOWING: [&str; 3] = [
    "boundary.top.traction=[0, '-1e5*max(0, t - 0.2)']",
    "damage.lambda_u=1e308",
    "damage.strain_cap=1e308",
];

#[test]
fn damage_that_is_not_finite() {
    let test_directory = TestDirectory::new();
    let overflowing = [&["run", "scene.toml"], &sets(&OVERFLOWING)[..]].concat();
    let said = test_directory.say(&overflowing);
    said.fails(1, &["step 3 (t = 0.3): the damage equation has no finite answer"]);
    assert!(said.out.contains("FAILED after t = 0.2"), "{}", said.out);
    let summary = test_directory.summary("out/scene");
    assert_eq!(
        (&summary["steps"], &summary["figures"]["zeta_min"]["value"]),
        (&2.into(), &1.0.into())
    );
    assert_eq!(test_directory.history("out/scene").1.len(), 3);

    // Chosen steps are cut until it is hopeless, and not one bad state is kept.
    let said = test_directory.say(&[&overflowing[..], &["--set", "time.step=auto"]].concat());
    said.fails(1, &["the damage equation has no finite answer"]);
    let [least, times] = ["zeta_min", "time"].map(|of| test_directory.column("out/scene", of));
    assert!(least.len() > 2 && least.iter().all(|zeta| *zeta == 1.0), "ζ as it was");
    let end = test_directory.summary("out/scene")["end_time"].as_f64().expect("a time");
    assert!((end - times.last().expect("rows")).abs() < 1e-15);
}

#[test]
fn short_memory_ends_with_a_sentence() {
    let test_directory = TestDirectory::new();
    let program = test_directory.command(&[]);
    let program = program.get_program().to_str().expect("a path");
    for limit in [250_000, 330_000] {
        let text = format!("ulimit -v {limit}; exec {program} run scene.toml --mesh fine.msh");
        test_directory.write("fine.msh", &crate::test_directory::square(160));
        let mut shell = Command::new("sh");
        shell.args(["-c", &text]).current_dir(test_directory.path("."));
        ProgramOutput::of(&mut shell).fails(1, &["not enough memory"]);
    }
}
