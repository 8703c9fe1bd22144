//! `summary.json`: what a run has found, and what it cost.

use super::{figures::LastFigure, provenance::provenance, task::Task};
use serde_json::{Map, Value, json};
use signorini::{
    evolution::{Outcome, RunError, StepRecord},
    observe::ObservedProblem,
    petsc::stage_seconds,
};

/// `summary.json` of a run that took `wall` seconds and `memory` MB.
pub(super) fn summary(
    task: &Task,
    last: Option<StepRecord>,
    figures: &[LastFigure],
    result: Result<&Outcome, &RunError>,
    notes: &[String],
    [wall, memory]: [f64; 2],
) -> Value {
    let Task { problem, triangles, contact_nodes, .. } = task;
    let (scene, partition) = (problem.scene(), &problem.body.nodes.partition);
    let outcome = result.ok();
    let steps = last.map_or(0, |record| record.step);
    let mut summary = json!({
        "provenance": provenance(problem.mesh().gmsh.as_deref()),
        "scene": scene.name,
        "title": scene.title,
        "solver": problem.scene().contact.solver_name(),
        "ranks": partition.comm().size(),
        // Numbers of the whole body. Contact nodes have a gap condition and no prescribed displacement.
        "nodes": partition.total(),
        "triangles": triangles,
        "contact_nodes": contact_nodes,
        // Accepted steps after t = 0, and the last time, s.
        "steps": steps,
        "end_time": last.map(|record| record.time),
        "active_nodes": last.map(|record| record.active_nodes),
        // By their names, in their order.
        "figures": figures.iter().map(|of| (of.figure.name.clone(), json!(of))).collect::<Map<_, _>>(),
        // The maxima over all steps.
        "kkt": outcome.map(|outcome| outcome.kkt).or(last.map(|record| record.kkt())),
        // Estimated relative errors of the last state.
        "errors": outcome.map(|outcome| &outcome.errors),
        "wall_seconds": wall,
        "seconds_per_step": wall / steps.max(1) as f64,
        // The wall time of each stage, s; that of `contact` contains its parts, as `contact/products`.
        "phases": stage_seconds(),
        // The named curves of the mesh as segments [[x, y], [x, y]], m, the body on their left.
        "boundaries": problem.boundaries(),
        "units": scene.units,
    });
    let conclusion = task.accuracy.conclusion(problem, outcome);
    let of_accuracy = conclusion.iter().map(|(_, lines)| lines.join("; "));
    summary["notes"] = json!(Vec::from_iter(of_accuracy.chain(notes.iter().cloned())));
    if let Some((reached, _)) = conclusion {
        summary["reached"] = json!(reached);
    }
    if let Err(error) = result {
        summary["error"] = json!(error.to_string());
    }
    summary["peak_megabytes"] = json!(memory);
    add_stop(&mut summary, problem, outcome);
    summary
}

/// Adds to the summary why the run stopped before its end, at which time, s, and the error of this time; null if it
/// did not.
fn add_stop(summary: &mut Value, problem: &ObservedProblem, outcome: Option<&Outcome>) {
    let stopped = outcome.and_then(|outcome| outcome.stopped);
    let collapse = problem.collapse.filter(|_| outcome.is_some() && stopped.is_none());
    let end = problem.scene().time.map_or(0.0, |grid| grid.end);
    let stop = stopped.map(|stop| ("damage", stop.time, stop.bar()));
    let stop = stop.or(collapse.map(|of| ("collapse", of.time, of.time - end)));
    summary["stopped_by"] = json!(stop.map(|(by, ..)| by));
    summary["stopped_at"] = json!(stop.map(|(_, time, _)| time));
    summary["stopped_uncertainty"] = json!(stop.map(|(.., off)| off));
    summary["collapse"] = json!(
        collapse.map(|of| { json!({ "motion": of.motion.to_string(), "velocity": of.motion }) })
    );
}
