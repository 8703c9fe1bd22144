//! The output of a run at the terminal: its task, a progress bar, and the result in a few lines.

use super::{figures::LastFigures, ranks::paying, task::Task};
use signorini::{
    accuracy::Adapted,
    evolution::{Outcome, RunError, StepRecord, percent},
    output::terminal::{Progress, plain, say, with_bar},
    printable::print_error,
    problem::Collapse,
    scene::{Scheme, Stepping, TimeGrid, rounded},
};
use std::{collections::BTreeSet, time::Instant};

/// The length of the progress bar: it counts parts of [0, T], as many as a run may have steps.
const LENGTH: u64 = 1_000_000_000;

/// Shows the task and a progress bar.
pub fn open(task: &Task) -> Progress {
    let (scene, partition) = (task.problem.scene(), &task.problem.body.nodes.partition);
    let mut mesh = format!("{} nodes, {} triangles", partition.total(), task.triangles);
    let ranks = partition.comm().size();
    if ranks > 1 {
        mesh += &format!(", on {ranks} ranks");
    }
    let solver = scene.contact.solver_name();
    let solver = match task.contact_nodes {
        0 => format!("{solver} (no contact: one linear solve a step)"),
        _ => solver.to_owned(),
    };
    let mut lines = vec![scene.title.clone(), row("mesh", &mesh), row("solver", &solver)];
    let steps = |grid| steps(grid, &scene.units.time, task.problem.damage().is_some());
    lines.extend(scene.time.map(|grid| row("time", &steps(grid))));
    let note = task.problem.large_load().filter(|_| !task.accuracy.repeats);
    lines.extend(note.map(|note| row("note", &note)));
    let mut progress = Progress::new(LENGTH);
    if !task.quiet {
        say(&lines.join("\n"));
        progress.show(0, vec!["the first solve".to_owned()]);
    }
    progress
}

/// Shows a mesh of the accuracy loop with its errors, and after the first one, which `started` then, what the rounds to come may
/// need. The error of quadratic elements on adapted meshes falls like 1/unknowns. The rounds to come take about fifteen times as
/// long as the run on the last mesh, and 11 kB for each of its unknowns.
pub fn adapting(mesh: &Adapted, accuracy: f64, started: Option<Instant>) {
    let (rounds, triangles, unknowns) = (mesh.rounds, mesh.mesh.triangles.len(), mesh.unknowns);
    // The norms come first, and are not repeated.
    let worst = mesh.worst.iter().filter(|(name, _)| name != "damage" && name != "displacement");
    let errors = [("u", Some(mesh.error)), ("damage", mesh.damage_error)]
        .into_iter()
        .chain(worst.map(|(name, error)| (&**name, Some(*error))))
        .filter_map(|(name, error)| Some(format!("{name} {}", percent(error?))));
    let errors = Vec::from_iter(errors).join(", ");
    let text =
        format!("mesh {rounds}: {triangles} triangles, {unknowns} unknowns, errors: {errors}");
    print_error(&row("adapting", &text));
    if let Some(started) = started {
        let growth = (mesh.error.max(mesh.damage_error.unwrap_or(0.0)) / accuracy).max(1.0);
        let unknowns = growth * mesh.unknowns as f64;
        let seconds = 15.0 * growth * started.elapsed().as_secs_f64();
        let [count, seconds] = [unknowns, seconds].map(|number| plain(number, 1));
        let megabytes = 50.0 + 0.011 * unknowns;
        let text =
            format!("roughly {count} unknowns, {seconds} s, {megabytes:.0} MB for the accuracy");
        print_error(&row("expected", &text));
    }
}

/// Shows an accepted step of a run to t = `end`.
pub fn progress(bar: &mut Progress, record: &StepRecord, end: f64) {
    let fields = vec![
        format!("t = {}", plain(record.time, 5)),
        format!("step {}", record.step),
        format!("min ζ = {:.6}", record.zeta_min),
        format!("active {}", record.active_nodes),
        format!("iterations {}", record.iterations),
    ];
    bar.show((LENGTH as f64 * record.time / end) as u64, fields);
}

/// The closing lines of a run: how it ended, the figures of its last accepted state, their errors, notes, and the next step.
/// `last` is `None` if the first solve failed. The run took `wall` seconds, `memory` MB on all ranks, and these iterations of the
/// contact solver, and of the linear solvers in it.
pub fn conclusion(
    task: &Task,
    last: Option<StepRecord>,
    figures: Option<&LastFigures>,
    result: Result<&Outcome, &RunError>,
    notes: &[String],
    ([wall, memory], [iterations, linear]): ([f64; 2], [usize; 2]),
) -> Vec<String> {
    let (outcome, problem, folder) = (result.ok(), &task.problem, task.folder.display());
    let end = ending(problem.collapse, problem.threshold(), last, result);
    let of_accuracy = task.accuracy.conclusion(problem, outcome).map_or_else(Vec::new, |of| of.1);
    if task.quiet {
        let answers = end.iter().take(1).chain(of_accuracy.iter().take(1)).cloned();
        let warned = (!notes.is_empty()).then(|| format!("notes: {}", notes.len()));
        let all = Vec::from_iter(answers.chain(warned).chain([format!("results in {folder}")]));
        return vec![format!("{}: {}", problem.scene().name, all.join(", "))];
    }
    // This note was shown at the start.
    let large_load = problem.large_load();
    let notes = notes.iter().filter(|note| Some(*note) != large_load.as_ref());
    let end = end.into_iter().chain(of_accuracy);
    let mut facts = Vec::from_iter(end.map(|fact| ("end", fact)));
    let errors = outcome.map(|outcome| outcome.errors.lines(outcome.stopped.as_ref()));
    let (errors, next) = errors.unwrap_or_default();
    if let (Some(last), Some(figures)) = (last, figures) {
        facts.extend(figures.facts(task, last.step));
        facts.extend(figures.governing().map(|fact| ("in the run", fact)));
        facts.extend(errors.into_iter().map(|fact| ("errors", fact)));
        if task.verbose {
            let kkt = outcome.map_or(last.kkt(), |outcome| outcome.kkt).to_string();
            facts.extend(kkt.split(", ").map(|fact| ("residuals", fact.to_owned())));
            facts.extend(outcome.map(|of| {
                ("solver", format!("relative error of u about {:.0e}", of.errors.solver))
            }));
            facts.push((
                "solver",
                format!("{iterations} iterations, {linear} of the linear solvers"),
            ));
            let active =
                format!("{} of {} nodes in contact", last.active_nodes, task.contact_nodes);
            facts.push(("solver", active));
        }
    }
    facts.extend(notes.clone().map(|note| ("note", note.clone())));
    facts.extend(last.map(|_| ("results", folder.to_string())));
    facts.push(("cost", format!("{wall:.2} s, {memory:.0} MB")));
    let partition = &problem.body.nodes.partition;
    if wall > 30.0 && partition.comm().is_serial() && paying(2 * partition.total()) > 1 {
        facts.push(("cost", "--ranks auto is faster: it uses several cores".to_owned()));
    }
    // The topics that notes end with.
    let topic =
        |note: &String| Some(note.rsplit_once(" (explain ")?.1.trim_end_matches(')').to_owned());
    let topics = Vec::from_iter(BTreeSet::from_iter(notes.filter_map(topic)));
    if !topics.is_empty() {
        facts.push(("more", format!("signorini explain {}", topics.join(" "))));
    }
    facts.extend(next.filter(|_| task.accuracy.adapted.is_none()).map(|next| ("next", next)));
    // The name of a group stands before its first fact; notes are apart.
    let name = |i: usize| {
        if i > 0 && facts[i - 1].0 == facts[i].0 && facts[i].0 != "note" { "" } else { facts[i].0 }
    };
    facts.iter().enumerate().map(|(i, (_, fact))| row(name(i), fact)).collect()
}

/// The number of columns of a line, and the column at which a long fact goes on in further lines.
const COLUMNS: usize = 80;
const FURTHER: usize = 18;

/// The lines of a fact.
pub fn row(name: &str, fact: &str) -> String {
    // A number and its percent sign stay together.
    let fact = fact.replace(" %", "\u{a0}%");
    let mut words = fact.split(' ');
    let mut text = format!("  {name:<13} {}", words.next().unwrap_or_default());
    let mut columns = text.chars().count();
    for word in words {
        columns += 1 + word.chars().count();
        if columns > COLUMNS {
            text += &format!("\n{:FURTHER$}{word}", "");
            columns = FURTHER + word.chars().count();
        } else {
            text += &format!(" {word}");
        }
    }
    text.replace('\u{a0}', " ")
}

fn steps(grid: TimeGrid, unit: &str, can_be_damaged: bool) -> String {
    let end = rounded(grid.end);
    match grid.stepping {
        Stepping::Uniform { steps } => {
            let scheme = if grid.scheme == Scheme::Bdf2 { " (bdf2)" } else { "" };
            let noun = if steps == 1 { "step" } else { "steps" };
            format!("{steps} {noun} of {} {unit} to t = {end}{scheme}", rounded(end / steps as f64))
        }
        Stepping::Auto { .. } if !can_be_damaged => {
            format!("to t = {end} in steps that follow the loads")
        }
        Stepping::Auto { tolerance, .. } => {
            format!("to t = {end} in steps chosen for an error of ζ of {tolerance:.0e}")
        }
    }
}

/// How the run ended, and what follows from it for its results.
fn ending(
    collapse: Option<Collapse>,
    threshold: f64,
    last: Option<StepRecord>,
    result: Result<&Outcome, &RunError>,
) -> Vec<String> {
    let Some(StepRecord { step, time, .. }) = last else {
        return vec!["FAILED at the first solve; there is no state to save".to_owned()];
    };
    let end = rounded(time);
    let before = format!("the results show the state before: step {step}, t = {end}");
    match (result.map(|outcome| outcome.stopped), collapse) {
        (Err(error), _) => {
            let how =
                if matches!(error, RunError::Interrupted(_)) { "interrupted" } else { "FAILED" };
            vec![format!("{how} after t = {end}; the state there is saved")]
        }
        (Ok(Some(stop)), _) => {
            let is_known = stop.bar() < stop.time;
            let time = if is_known {
                with_bar(stop.time, Some(stop.bar()))
            } else {
                rounded(stop.time).to_string()
            };
            let reached = format!("STOPPED at t = {time}: the least ζ reaches ζ_* = {threshold}");
            let error = match (is_known, stop.from_mesh) {
                (false, _) => {
                    "the error of this time is unknown: shorten the steps or refine the mesh"
                }
                (true, Some(_)) => return vec![reached, before],
                (true, None) => "± is the error of the time steps alone; --bars adds the mesh",
            };
            vec![reached, error.to_owned(), before]
        }
        (Ok(None), Some(Collapse { time, motion })) => vec![
            format!("STOPPED at t = {}: nothing supports the body against {motion}", rounded(time)),
            format!("the results show the state just before, step {step}"),
        ],
        (Ok(None), None) if step == 0 => vec![format!("solved at t = {end}")],
        (Ok(None), None) => vec![format!("finished at t = {end} after {step} steps")],
    }
}
