//! The output of a run at the terminal: its task, a progress bar, and the result in a few lines.

use super::{check::short, extremes, task::Task};
use signorini::{
    estimate::{Adapted, Extremes},
    evolution::{Outcome, RunError, StepRecord, Stop, percent},
    mesh::Mesh,
    output::terminal::{Progress, say, with_bar},
    problem::Collapse,
    scene::{Probe, Scheme, Stepping, TimeGrid, Units, rounded},
};
use std::{
    collections::BTreeMap,
    io::{self, Write},
    num::NonZero,
    thread,
};

/// The length of the progress bar: it counts parts of [0, T], as many as a run may have steps.
const LENGTH: u64 = 1_000_000_000;

/// The number of nodes from which two ranks pay: 100,000 unknowns of the displacements (SPEED.md, section 2).
const MANY_NODES: usize = 50_000;

/// Shows the task and a progress bar.
pub fn open(task: &Task) -> Progress {
    let (scene, partition) = (task.problem.scene(), &task.problem.body.nodes.partition);
    let mut mesh = format!("{} nodes, {} triangles", partition.total(), task.triangles);
    let ranks = partition.comm().size();
    if ranks > 1 {
        mesh += &format!(", on {ranks} ranks");
    } else if partition.total() >= MANY_NODES && cores() > 1 {
        mesh += ", on one core (several: mpiexec -n 2 signorini run …)";
    }
    let solver = match task.contact_nodes {
        0 => format!("{} (no contact: one linear solve a step)", task.solver),
        _ => task.solver.clone(),
    };
    let mut lines = vec![scene.title.clone(), row("mesh", mesh), row("solver", solver)];
    let steps = |grid| steps(grid, &scene.units.time, task.problem.damage().is_some());
    lines.extend(scene.time.map(|grid| row("time", steps(grid))));
    say(&lines.join("\n"));

    let mut progress = Progress::new("{bar:20} {wide_msg} {elapsed}, {eta} left", LENGTH);
    progress.show(0, "the first solve".to_owned());
    progress
}

/// The number of cores that this process may use, 1 if it is not known.
fn cores() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get)
}

/// Shows a mesh of the adaptation with its errors.
pub fn adapting(mesh: &Adapted, accuracy: f64) {
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
    let _ = writeln!(io::stderr(), "{}", row("adapting", text));
}

/// Shows what the rounds to come may need, after the first one has taken `seconds`. The error of quadratic elements on
/// adapted meshes falls like 1/unknowns. The rounds to come take about fifteen times as long as the run on the last
/// mesh, and 11 kB for each of its unknowns.
pub fn expected(mesh: &Adapted, accuracy: f64, seconds: f64) {
    let growth = (mesh.error.max(mesh.damage_error.unwrap_or(0.0)) / accuracy).max(1.0);
    let unknowns = growth * mesh.unknowns as f64;
    let (seconds, megabytes) = (15.0 * growth * seconds, 50.0 + 0.011 * unknowns);
    let text = format!("roughly {unknowns:.0e} unknowns, {seconds:.0e} s, {megabytes:.0} MB");
    let _ = writeln!(io::stderr(), "{}", row("expected", text));
}

/// Shows an accepted step of a run to t = `end`.
pub fn progress(bar: &mut Progress, record: &StepRecord, end: f64) {
    let message = format!(
        "step {}  t = {}  min ζ = {:.6}  active {}  iterations {}",
        record.step,
        short(record.time),
        record.zeta_min,
        record.active_nodes,
        record.iterations
    );
    bar.show((LENGTH as f64 * record.time / end) as u64, message);
}

/// The closing lines of a run: its end, and the quantities of its last accepted state. `last` is `None` if the
/// first solve failed.
pub fn conclusion(
    task: &Task,
    last: Option<StepRecord>,
    extremes: Option<&Extremes>,
    quantities: &[(String, f64)],
    result: Result<&Outcome, &RunError>,
    notes: &[String],
) -> Vec<String> {
    let notes = notes.iter().map(|note| row("note", note.clone()));
    let end = row("end", ending(task.problem.collapse, last, result));
    let outcome = result.ok();
    let Some(last) = last else { return [end].into_iter().chain(notes).collect() };
    let shown = Shown::new(task, outcome);
    let figure = |value: f64, name: &str| shown.figure(value, name, 6);
    let zeta = |value: f64, name: &str| match (shown.bar("zeta_min"), shown.bar("zeta_mean")) {
        (None, None) => format!("{value:.*}", shown.digits(6)),
        _ => figure(value, name),
    };
    let damage = match (last.zeta_min, last.zeta_mean) {
        (1.0, _) => "none".to_owned(),
        (min, mean) => {
            format!("min ζ {}, mean ζ {}", zeta(min, "zeta_min"), zeta(mean, "zeta_mean"))
        }
    };
    let units = &task.problem.scene().units;
    let (length, force) = (&units.length, &units.force);
    let displacement = figure(last.displacement_max, "displacement_max");
    let mut lines = vec![
        end,
        row("damage", damage),
        row("displacement", format!("largest {displacement} {length}")),
        row("work", format!("{} {}", figure(last.work, "work"), units.work())),
    ];
    lines.extend(extremes.into_iter().flat_map(|of| extremes::stresses(of, units, &shown)));
    if task.contact_nodes > 0 {
        let (active, nodes) = (last.active_nodes, task.contact_nodes);
        let sum = figure(last.contact_force, "contact_force");
        let contact = format!("{active} of {nodes} nodes active, force {sum} {force}/{length}");
        lines.push(row("contact", contact));
    }
    lines.extend(extremes.into_iter().flat_map(|of| extremes::contact(of, units, &shown)));
    lines.extend(supports(task, quantities, &shown));
    lines.extend(probes(task, quantities, &shown));
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

/// How figures are shown.
pub(super) struct Shown<'a> {
    bars: Option<&'a BTreeMap<String, f64>>,
    /// Whether the errors were measured.
    is_measured: bool,
    /// The estimated error of u from the mesh, relative, in the energy norm: the stresses are hardly more exact.
    error: f64,
    pub(super) mesh: &'a Mesh,
}

impl<'a> Shown<'a> {
    fn new(task: &'a Task, outcome: Option<&'a Outcome>) -> Self {
        let measured = &task.measured;
        let is_measured =
            task.adapted.is_some() || !measured.bars.is_empty() || measured.stop.is_some();
        let mesh = task.problem.mesh();
        let errors = outcome.map(|of| &of.errors);
        let error = errors.map_or(0.0, |errors| errors.displacement_mesh);
        Self { bars: errors.map(|errors| &errors.figures), is_measured, error, mesh }
    }

    fn bar(&self, name: &str) -> Option<f64> {
        self.bars?.get(name).copied()
    }

    /// The decimals of a figure without a bar: `usual` ones, or two if the measurement of the errors gave none for it.
    fn digits(&self, usual: usize) -> usize {
        if self.is_measured { 2 } else { usual }
    }

    /// A figure with its bar or, without one, with its [`Shown::digits`].
    pub(super) fn figure(&self, value: f64, name: &str, usual: usize) -> String {
        match self.bar(name) {
            None => format!("{value:.*e}", self.digits(usual)),
            bar => with_bar(value, bar),
        }
    }

    /// An extreme with its bar or, without one, with the decimals that the estimated error leaves, at most four.
    pub(super) fn extreme(&self, value: f64, name: &str) -> String {
        self.figure(value, name, (-self.error.log10()).ceil().clamp(1.0, 4.0) as usize)
    }
}

/// Per support: a line with its resultants and their error bars.
fn supports(task: &Task, quantities: &[(String, f64)], shown: &Shown) -> Vec<String> {
    let Units { length, force, .. } = &task.problem.scene().units;
    // Resultants come first, three for each support.
    let line = |(name, of): (&String, &[(String, f64)])| {
        let figure = |i: usize, part: &str| shown.figure(of[i].1, &format!("{name}.{part}"), 4);
        let [x, y, moment] = [figure(0, "force_x"), figure(1, "force_y"), figure(2, "moment")];
        let [start, end, at] = ["contact_start_x", "contact_end_x", "acts_at_x"]
            .map(|of| extremes::place(quantities, &format!("{name}.{of}"), shown));
        let contact = match (start, end, at) {
            (Some(start), Some(end), Some(at)) => {
                format!(" at {at}, contact from {start} to {end}")
            }
            _ => String::new(),
        };
        let resultant = format!("force ({x}, {y}) {force}/{length}{contact}");
        row("support", format!("{name}: {resultant}, moment {moment} {force}"))
    };
    task.problem.supports.names.iter().zip(quantities.chunks_exact(3)).map(line).collect()
}

/// Per probe: a line with its displacement, von Mises stress and damage, and their error bars.
fn probes(task: &Task, quantities: &[(String, f64)], shown: &Shown) -> Vec<String> {
    let scene = task.problem.scene();
    let Units { length, stress, .. } = &scene.units;
    let line = |probe: &Probe| {
        let figure = |part: &str| {
            let name = format!("{}.{part}", probe.name);
            let value = quantities.iter().find(|(other, _)| *other == name);
            value.map_or_else(String::new, |(_, value)| shown.figure(*value, &name, 4))
        };
        let [x, y, von_mises] = ["u_x", "u_y", "von_mises"].map(figure);
        let zeta = match scene.damage {
            Some(_) => format!(", ζ {}", figure("zeta")),
            None => String::new(),
        };
        let values = format!("u ({x}, {y}) {length}, von Mises {von_mises} {stress}{zeta}");
        row("probe", format!("{}: {values}", probe.name))
    };
    scene.probes.iter().map(line).collect()
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
    let time = rounded(stop.time);
    match (stop.from_mesh, stop.uncertainty) {
        (_, steps) if steps >= stop.time || steps.is_nan() => {
            format!("{time} (error unknown: ζ hardly falls there, or the time steps are too long)")
        }
        (Some(mesh), _) if stop.bar() >= stop.time => {
            format!("{time} (error unknown: with a finer mesh the time may differ by {mesh:.1e})")
        }
        (Some(_), _) => with_bar(stop.time, Some(stop.bar())),
        (None, steps) => format!("{} (the time steps alone)", with_bar(stop.time, Some(steps))),
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
