//! The time of failure, with its error bar.

use signorini::{
    contact::SOLVERS,
    evolution::{ObservedProblem, Outcome},
    mesh::Mesh,
    petsc::Session,
    scene::Scene,
};
use signorini_study::stability::problems;
use std::path::Path;

/// The printed data of Example I on 8 × 8 cells.
fn run(set: &[&str]) -> Outcome {
    let session = Session::start(&[]).unwrap();
    let set: Vec<String> = set.iter().map(|key| (*key).to_owned()).collect();
    let text = include_str!("../../../../geo/square.toml");
    let scene = Scene::parse(text, Path::new("square.toml"), &set).unwrap();
    let problem = ObservedProblem::new(scene, Mesh::rectangle(1.0, 1.0, 8, 8)).unwrap();
    problems::run(&session, &problem, SOLVERS[0]).unwrap()
}

#[test]
fn chosen_steps_land_above_the_threshold_within_the_tolerance() {
    let outcome = run(&["time.step=auto", "time.tolerance=1e-3"]);
    assert!(outcome.stopped.is_some() && outcome.rejected > 0, "an overshoot was rejected");
    let above = outcome.last.record.zeta_min - 0.01;
    assert!(0.0 < above && above <= 1e-3, "{above}");
}

#[test]
fn the_failure_time_is_right_to_its_error_bar() {
    let reference = run(&["time.step=2e-5"]).stopped.unwrap();
    for set in
        [&["time.step=auto", "time.tolerance=2e-3"][..], &["time.step=0.01"], &["time.step=1e-3"]]
    {
        let stop = run(set).stopped.unwrap();
        let off = (stop.time - reference.time).abs();
        assert!(off <= stop.uncertainty + reference.uncertainty, "{set:?}: {off} off, {stop:?}");
        assert!(stop.uncertainty < 0.5 * stop.time, "{set:?}: a bar that says nothing");
    }
}

#[test]
fn chosen_steps_are_fewer_than_uniform_ones_equally_close() {
    let limit = run(&["time.step=2e-5"]).stopped.unwrap().time;
    let off = |outcome: &Outcome| (outcome.stopped.unwrap().time / limit - 1.0).abs();
    let auto = run(&["time.step=auto"]);
    let uniform = run(&["time.step=5e-4"]);
    assert!(off(&auto) < off(&uniform), "{} against {}", off(&auto), off(&uniform));
    assert!(2 * (auto.last.record.step + auto.rejected) < uniform.last.record.step);
}
