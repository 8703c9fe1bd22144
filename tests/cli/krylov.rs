//! The KSP types of PETSc: each solves at most three times as often as conjugate gradients, or is refused by its name.

use crate::test_directory::TestDirectory;

/// The applications of preconditioners in PETSc's log, of all stages.
fn solves(out: &str) -> usize {
    let rows = out.lines().filter_map(|line| line.strip_prefix("PCApply "));
    let counts = rows.map(|row| row.split_whitespace().next().and_then(|count| count.parse().ok()));
    let all: usize = counts.map(|count: Option<usize>| count.expect("a row of the log")).sum();
    assert!(all > 0, "no log: {out}");
    all
}

#[test]
fn every_krylov_solver_of_petsc_serves_or_is_refused() {
    let directory = TestDirectory::new();
    // Contact that opens at the left end, and a damage system in every step.
    let scene =
        crate::test_directory::SCENE.replace("symmetry = true", "displacement = [0, '0.01*t']");
    directory.write("scene.toml", &scene);
    let arguments = ["run", "scene.toml", "--set", "time.step=0.25", "--", "-log_view"];
    let run = |options: &[&str]| directory.say(&[&arguments[..], options].concat());
    let help = run(&["-help"]).out;
    let types = help.split("-elastic_ksp_type").nth(1).and_then(|of| of.split("(one of) ").nth(1));
    let types = types.and_then(|of| of.split(" (KSPSetType)").next()).expect("the list of PETSc");
    let types: Vec<&str> = types.split_whitespace().collect();
    assert!(types.len() > 30, "{types:?}");

    let of_cg = run(&["-elastic_ksp_type", "cg", "-damage_ksp_type", "cg"]);
    let (most, work) = (3 * solves(&of_cg.out), directory.column("out/scene", "work"));
    let mut serving = Vec::new();
    for kind in types {
        let said = run(&["-elastic_ksp_type", kind, "-damage_ksp_type", kind]);
        if said.code == Some(2) {
            said.fails(2, &[&format!("-elastic_ksp_type {kind} "), "cg"]);
            continue;
        }
        assert_eq!(said.code, Some(0), "{kind}: {}", said.err);
        assert!(!said.out.contains("gave the answer"), "{kind}: {}", said.out);
        assert!(solves(&said.out) <= most, "{kind}: {} solves for {}", solves(&said.out), most / 3);
        for (found, expected) in directory.column("out/scene", "work").iter().zip(&work) {
            assert!((found - expected).abs() <= 1e-8 * work[work.len() - 1], "{kind}");
        }
        serving.push(kind);
    }
    assert!(serving.len() > 10 && serving.contains(&"gmres"), "{serving:?}");
    // The refusal names those that work.
    let refused = run(&["-damage_ksp_type", "lsqr"]);
    refused.fails(2, &["-damage_ksp_type lsqr", "gmres", "minres"]);
}
