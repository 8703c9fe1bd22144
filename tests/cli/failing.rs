//! Solvers that miss their tolerance: exit code 1, and the state before is saved.

use crate::desk::Desk;

/// At rest until t = 0.2, so that steps 0 to 2 need no solver; the third does.
const LATE: &str = "boundary.top.traction=[0, '-max(0, t - 0.2)']";

#[track_caller]
fn fails_at_the_third_step(arguments: &[&str], fragments: &[&str]) {
    let desk = Desk::new();
    let said = desk.say(&[&["run", "scene.toml", "--set", LATE], arguments].concat());
    said.fails(1, &[&["step 3 (t = 0.3", " times it)"], fragments].concat());
    assert!(said.out.contains("FAILED after t = 0.2; the state there is saved"), "{}", said.out);

    let summary = desk.summary("out/scene");
    let error = summary["error"].as_str().expect("the error");
    assert_eq!(said.err, format!("error: {error}\n"));
    assert_eq!((&summary["steps"], &summary["end_time"]), (&2.into(), &0.2.into()));
    assert_eq!(desk.history("out/scene").1.len(), 3);
    let (time, file) = desk.frames("out/scene").pop().expect("frames");
    assert_eq!(time, 0.2);
    assert!(desk.path(&format!("out/scene/{file}")).exists());
}

#[test]
fn a_tolerance_below_rounding() {
    for solver in ["active-set", "tao"] {
        fails_at_the_third_step(
            &["--solver", solver, "--set", "contact.tolerance=1e-30"],
            &[solver, "the tolerance 1.0e-30 is missed by", "stationarity"],
        );
    }
}

#[test]
fn a_solver_kept_from_iterating() {
    fails_at_the_third_step(
        &["--solver", "tao", "--", "-tao_max_it", "0"],
        &["tao:tron stopped after 0 iterations", "stationarity 1.0e0 (1.0e10 times it)"],
    );
}

#[test]
fn a_method_petsc_does_not_have() {
    let desk = Desk::new();
    let said = desk.say(&["run", "scene.toml", "--solver", "tao", "--", "-tao_type", "none"]);
    said.fails(1, &["PETSc error", "Unable to find requested Tao type none"]);
}
