//! The output of a run at the terminal: its task, a progress bar, and the result in a few lines.

use super::{figures::LastFigures, task::Task};
use signorini::{
    accuracy::Adapted,
    evolution::{Outcome, RunError, StepRecord, Stop, percent},
    mesh::extent,
    observe::{FIRST_CONTACT, in_words},
    output::terminal::{Progress, plain, say, with_bar},
    petsc::Communicator,
    printable::print_error,
    problem::Collapse,
    scene::{Scene, Scheme, Stepping, TimeGrid, rounded},
};
use std::time::Instant;

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
    let mut lines = vec![scene.title.clone(), row("mesh", mesh), row("solver", solver)];
    let steps = |grid| steps(grid, &scene.units.time, task.problem.damage().is_some());
    lines.extend(scene.time.map(|grid| row("time", steps(grid))));
    lines.extend(task.problem.large_load().map(|note| row("note", note)));
    say(&lines.join("\n"));

    let mut progress = Progress::new(LENGTH);
    progress.show(0, vec!["the first solve".to_owned()]);
    progress
}

/// Shows the meshes of the accuracy loop.
pub struct Adaptation {
    accuracy: Option<f64>,
    started: Option<Instant>,
}

impl Adaptation {
    /// Only the first rank shows them.
    pub fn new(comm: Communicator, scene: &Scene) -> Self {
        let accuracy = scene.accuracy.filter(|_| comm.is_root());
        Self { accuracy, started: Some(Instant::now()) }
    }

    /// Shows a mesh with its errors, and after the first one what the following ones may need.
    pub fn add(&mut self, mesh: &Adapted) {
        let Some(accuracy) = self.accuracy else { return };
        adapting(mesh, accuracy);
        if let Some(started) = self.started.take() {
            expected(mesh, accuracy, started.elapsed().as_secs_f64());
        }
    }
}

/// Shows a mesh of the adaptation with its errors.
fn adapting(mesh: &Adapted, accuracy: f64) {
    let (rounds, triangles, unknowns) = (mesh.rounds, mesh.mesh.triangles.len(), mesh.unknowns);
    // The norms come first, and are not repeated.
    let worst = mesh.worst.iter().filter(|(name, _)| name != "damage" && name != "displacement");
    let errors = [("error of u", Some(mesh.error)), ("damage", mesh.damage_error)]
        .into_iter()
        .chain(worst.map(|(name, error)| (&**name, Some(*error))))
        .filter_map(|(name, error)| Some(format!("{name} {}", percent(error?))));
    let text = format!(
        "mesh {rounds}: {triangles} triangles, {unknowns} unknowns, {} (accuracy {})",
        errors.collect::<Vec<_>>().join(", "),
        percent(accuracy)
    );
    print_error(&row("adapting", text));
}

/// Shows what the rounds to come may need, after the first one has taken `seconds`. The error of quadratic elements on
/// adapted meshes falls like 1/unknowns. The rounds to come take about fifteen times as long as the run on the last
/// mesh, and 11 kB for each of its unknowns.
fn expected(mesh: &Adapted, accuracy: f64, seconds: f64) {
    let growth = (mesh.error.max(mesh.damage_error.unwrap_or(0.0)) / accuracy).max(1.0);
    let unknowns = growth * mesh.unknowns as f64;
    let (seconds, megabytes) = (15.0 * growth * seconds, 50.0 + 0.011 * unknowns);
    let [unknowns, seconds] = [unknowns, seconds].map(|number| plain(number, 1));
    let text = format!("roughly {unknowns} unknowns, {seconds} s, {megabytes:.0} MB");
    print_error(&row("expected", text));
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

/// The closing lines of a run: its end, and the figures of its last accepted state. `last` is `None` if the first solve failed.
pub fn conclusion(
    task: &Task,
    last: Option<StepRecord>,
    figures: Option<&LastFigures>,
    result: Result<&Outcome, &RunError>,
    notes: &[String],
) -> Vec<String> {
    let notes = notes.iter().map(|note| row("note", note.clone()));
    let end = row("end", ending(task.problem.collapse, last, result));
    let outcome = result.ok();
    let (Some(last), Some(figures)) = (last, figures) else {
        return [end].into_iter().chain(notes).collect();
    };
    let mut lines = vec![end, row("damage", damage(task, last.step, figures, outcome))];
    lines.push(row("displacement", displacement(task, figures)));
    lines.push(row("work", figures.full_text("work")));
    lines.extend(stresses(task, figures));
    lines.extend(contact(task, last, figures));
    lines.extend(task.problem.supports.names.iter().map(|name| support(name, figures)));
    lines.extend(task.problem.scene().probes.iter().map(|of| probe(task, &of.name, figures)));
    let governing = figures.governing().enumerate().map(|(i, (label, value, time))| {
        let name = if i == 0 { "in the run" } else { "" };
        row(name, format!("{label} {value} (t = {})", rounded(time)))
    });
    lines.extend(governing);
    if let Some(outcome) = outcome {
        let names = ["errors", "", "", ""].into_iter();
        let errors = names.zip(outcome.errors.lines(outcome.stopped.as_ref()));
        lines.extend(errors.map(|(name, line)| row(name, line)));
    }
    lines.push(row("residuals", outcome.map_or(last.kkt(), |outcome| outcome.kkt).to_string()));
    lines.extend(notes);
    lines.push(row("results", task.folder.display().to_string()));
    lines
}

/// The damage of the last state.
fn damage(task: &Task, step: usize, figures: &LastFigures, outcome: Option<&Outcome>) -> String {
    let state = match (figures.value("zeta_min"), step) {
        (1.0, 1) if task.problem.damage().is_some() => "none yet: shorten time.step".to_owned(),
        (1.0, _) => "none".to_owned(),
        _ => format!("min ζ {}, mean ζ {}", figures.text("zeta_min"), figures.text("zeta_mean")),
    };
    match outcome.and_then(|outcome| outcome.stopped) {
        Some(_) => format!("min ζ reached ζ_* = {}; before: {state}", task.problem.threshold()),
        None => state,
    }
}

/// The largest displacement, and whether it is larger than the body.
fn displacement(task: &Task, figures: &LastFigures) -> String {
    let largest = format!("largest {}", figures.full_text("displacement_max"));
    match figures.value("displacement_max") / extent(&task.problem.mesh().nodes) {
        times @ 1.0.. => format!(
            "{largest}, {times:.1} times the body: NOT an answer for a real body, as strains must be small; check the units \
             of E and the loads"
        ),
        _ => largest,
    }
}

/// The region of the figures `…_away`.
const AWAY: &str = "away from singular points";

/// The lines of the extreme stresses of the body, and a line for each of several materials.
fn stresses(task: &Task, figures: &LastFigures) -> Vec<String> {
    if figures.value("von_mises_max") == 0.0 {
        return Vec::new();
    }
    let [von_mises, most, least] =
        ["von_mises_max", "principal_max", "principal_min"].map(|name| figures.full_text(name));
    let grows = match figures.singular("von_mises_max") {
        Some(place) => format!(" at {place}, grows as the mesh is refined"),
        None => String::new(),
    };
    // A line of all extremes of a part, or of the body; `away` from singular points, if there are such figures.
    let line = |part: &str, words: &str, away: &str| {
        let kinds = ["von_mises_max", "principal_max", "principal_min"];
        let names = kinds.map(|kind| format!("{part}{kind}{away}"));
        figures.get(&names[0])?;
        let [von_mises, most, least] = names.map(|name| figures.full_text(&name));
        Some(row("", format!("{words}: von Mises {von_mises}, σ₁ {most}, σ₂ {least}")))
    };
    let of_material = |name: &str| {
        let (part, words) = (format!("{name}."), in_words(name));
        let of_rest = format!("{words}, {AWAY}");
        [line(&part, words, ""), line(&part, &of_rest, "_away")].into_iter().flatten()
    };
    let materials = task.problem.materials();
    let several = materials.clone().count() > 1;
    let away = line("", AWAY, "_away").or_else(|| {
        let length = task.problem.proposed_distance().filter(|_| !grows.is_empty())?;
        let (length, unit) = (plain(length, 1), &task.problem.scene().units.length);
        let what =
            format!("`away = {length}` adds the extremes at least {length} {unit} away from");
        Some(row("", format!("{what} singular points")))
    });
    [
        row("stress", format!("largest von Mises {von_mises}{grows}")),
        row("", format!("largest σ₁ {most}")),
        row("", format!("smallest σ₂ {least}")),
    ]
    .into_iter()
    .chain(away)
    .chain(materials.filter(|_| several).flat_map(of_material))
    .collect()
}

/// The lines of contact: of the whole contact and, if there are several foundations, of each.
fn contact(task: &Task, last: StepRecord, figures: &LastFigures) -> Vec<String> {
    let foundations = &task.problem.foundations[..];
    if foundations.is_empty() {
        return Vec::new();
    }
    let (active, nodes) = (last.active_nodes, task.contact_nodes);
    let force = figures.full_text("contact_force");
    let several = if foundations.len() > 1 { foundations } else { &[] };
    let of = |foundation: Option<&String>| {
        let [prefix, name] = match foundation {
            Some(name) => [format!("{name}."), format!("{name}: ")],
            None => [String::new(), String::new()],
        };
        let [length, pressure] =
            ["contact_length", "pressure_max"].map(|of| format!("{prefix}{of}"));
        let largest = match figures.value(&pressure) {
            0.0 => String::new(),
            _ => format!(", largest pressure {}", figures.full_text(&pressure)),
        };
        row("", format!("{name}length {}{largest}", figures.full_text(&length)))
    };
    let all = [None].into_iter().chain(several.iter().map(Some)).map(of);
    let first_contact = |name: &String| {
        let [time, x, y] = FIRST_CONTACT.map(|kind| format!("{name}.{kind}"));
        figures.value(&time).is_finite().then(|| {
            let [time, x, y] = [figures.full_text(&time), figures.text(&x), figures.full_text(&y)];
            row("", format!("{name}: first contact at t = {time}, under loads of ({x}, {y})"))
        })
    };
    let first = row("contact", format!("{active} of {nodes} nodes active, force {force}"));
    let first_contacts = foundations.iter().filter_map(first_contact);
    [first].into_iter().filter(|_| nodes > 0).chain(all).chain(first_contacts).collect()
}

/// The line of a support with its resultants.
fn support(name: &str, figures: &LastFigures) -> String {
    let [x, y] = ["force_x", "force_y"].map(|of| figures.text(&format!("{name}.{of}")));
    let unit = figures.get(&format!("{name}.force_x")).map_or("", |of| &*of.unit);
    let places = ["contact_start", "contact_end", "acts_at"]
        .map(|of| figures.place(&format!("{name}.{of}")));
    let contact = match places {
        [Some(start), Some(end), Some(at)] => format!(" at {at}, contact from {start} to {end}"),
        _ => String::new(),
    };
    let moment = figures.full_text(&format!("{name}.moment"));
    row("support", format!("{name}: force ({x}, {y}) {unit}{contact}, moment {moment}"))
}

/// The line of a probe with its displacement, stresses and damage.
fn probe(task: &Task, name: &str, figures: &LastFigures) -> String {
    let [x, y, zeta] = ["u_x", "u_y", "zeta"].map(|of| figures.text(&format!("{name}.{of}")));
    let unit = &task.problem.scene().units.length;
    let von_mises = figures.full_text(&format!("{name}.von_mises"));
    let zeta = match task.problem.scene().damage {
        Some(_) => format!(", ζ {zeta}"),
        None => String::new(),
    };
    let [xx, yy, xy] = ["xx", "yy", "xy"].map(|of| figures.text(&format!("{name}.stress_{of}")));
    let stress = format!("σ_xx {xx}, σ_yy {yy}, σ_xy {xy}, von Mises {von_mises}");
    row("probe", format!("{name}: u ({x}, {y}) {unit}, {stress}{zeta}"))
}

pub fn row(name: &str, value: String) -> String {
    format!("  {name:<13} {value}")
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

/// The time of ζ_* with its error bar.
fn stop_time(stop: &Stop) -> String {
    let bar = with_bar(stop.time, Some(stop.bar()));
    match stop.from_mesh {
        _ if stop.bar() >= stop.time || stop.bar().is_nan() => format!(
            "{} (error unknown: ζ hardly falls there, or steps or triangles are too large)",
            rounded(stop.time)
        ),
        Some(_) => bar,
        None => format!("{bar} (the time steps alone)"),
    }
}

fn ending(
    collapse: Option<Collapse>,
    last: Option<StepRecord>,
    result: Result<&Outcome, &RunError>,
) -> String {
    let Some(StepRecord { step, time, .. }) = last else {
        return "FAILED at the first solve; there is no state to save".to_owned();
    };
    let end = rounded(time);
    match (result.map(|outcome| outcome.stopped), collapse) {
        (Err(RunError::Interrupted(_)), _) => {
            format!("interrupted after t = {end}; the state there is saved, --restart goes on")
        }
        (Err(_), _) => format!("FAILED after t = {end}; the state there is saved"),
        (Ok(Some(stop)), _) => format!(
            "STOPPED at t = {}: min ζ reaches ζ_* there; saved is the state before, t = {end} (step {step})",
            stop_time(&stop),
        ),
        (Ok(None), Some(Collapse { time, motion })) => format!(
            "STOPPED at t = {}: nothing supports the body against {motion} any more; saved is the state just before \
             (step {step})",
            rounded(time)
        ),
        (Ok(None), None) if step == 0 => format!("solved at t = {end}"),
        (Ok(None), None) => format!("finished at t = {end} after {step} steps"),
    }
}
