//! What a run shows: what is to be solved, a progress bar, and the result in a few lines.

use super::{launch, task::Task};
use signorini::{
    estimate::Adapted,
    evolution::{Outcome, StepRecord},
    output::terminal::{Progress, say, with_bar},
    scene::{Scheme, Stepping, TimeGrid, Units, rounded},
};
use std::io::{self, IsTerminal, Write};

/// The progress bar counts thousandths of [0, T].
const LENGTH: u64 = 1000;

/// Shows what is to be solved, and a progress bar.
pub fn open(task: &Task) -> Progress {
    let (scene, partition) = (task.problem.scene(), &task.problem.body.nodes.partition);
    let mut mesh = format!("{} nodes, {} triangles", partition.total(), task.triangles);
    let (ranks, cores) = (partition.comm().size(), launch::cores());
    if ranks > 1 {
        mesh += &format!(", on {ranks} ranks");
    }
    if ranks > cores {
        mesh += &format!(" that take turns on {cores} cores: --ranks {cores} would be faster");
    }
    let solver = match task.contact_nodes {
        0 => format!("{} (no contact: one linear solve a step)", task.solver),
        _ => task.solver.clone(),
    };
    let mut lines = vec![scene.title.clone(), row("mesh", mesh), row("solver", solver)];
    let can_be_damaged = task.problem.damage().is_some();
    lines
        .extend(scene.time.map(|grid| row("time", steps(grid, &scene.units.time, can_be_damaged))));
    say(&lines.join("\n"));

    let mut progress = Progress::new("{bar:20} {wide_msg} {elapsed}, {eta} left", LENGTH);
    progress.show(0, "the first solve".to_owned());
    progress
}

/// Shows on a terminal a mesh that was tried for an accuracy, with its errors.
pub fn adapting(mesh: &Adapted, accuracy: f64) {
    if !io::stderr().is_terminal() {
        return;
    }
    let percent = |error: f64| format!("{:.2} %", 100.0 * error);
    let of_damage = mesh.damage_error.map_or(String::new(), |e| format!(", damage {}", percent(e)));
    let measured = mesh.worst.as_ref();
    let measured = measured.map(|(name, error)| format!("; measured: {name} {}", percent(*error)));
    let (rounds, triangles, unknowns) = (mesh.rounds, mesh.mesh.triangles.len(), mesh.unknowns);
    let _ = writeln!(
        io::stderr(),
        "  adapting      mesh {rounds}: {triangles} triangles, {unknowns} unknowns, error of u {}{of_damage}{} \
         (accuracy {})",
        percent(mesh.error),
        measured.unwrap_or_default(),
        percent(accuracy)
    );
}

/// Shows an accepted step of a run to t = `end`.
pub fn progress(bar: &mut Progress, record: &StepRecord, end: f64) {
    let message = format!(
        "step {}  t = {:.4}  min ζ = {:.6}  active {}  iterations {}",
        record.step, record.time, record.zeta_min, record.active_nodes, record.iterations
    );
    bar.show((LENGTH as f64 * record.time / end) as u64, message);
}

/// How a run ended and what its last accepted state tells, a line each; `outcome` is none if the run
/// failed, `last` if it failed at the first solve.
pub fn conclusion(
    task: &Task,
    last: Option<StepRecord>,
    quantities: &[(String, f64)],
    outcome: Option<&Outcome>,
    notes: &[String],
) -> Vec<String> {
    let mut lines = vec![row("end", ending(last, outcome))];
    if let Some(last) = last {
        let bar = |name: &str| outcome.and_then(|of| of.errors.figures.get(name).copied());
        let damage = match last.zeta_min {
            1.0 => "none".to_owned(),
            least => match (bar("zeta_min"), bar("zeta_mean")) {
                (None, None) => format!("min ζ {least:.6}, mean ζ {:.6}", last.zeta_mean),
                (of_least, of_mean) => format!(
                    "min ζ {}, mean ζ {}",
                    with_bar(least, of_least),
                    with_bar(last.zeta_mean, of_mean)
                ),
            },
        };
        lines.push(row("damage", damage));
        let units = &task.problem.scene().units;
        let (length, force) = (&units.length, &units.force);
        lines.push(row(
            "displacement",
            format!(
                "largest {} {length}",
                with_bar(last.displacement_max, bar("displacement_max"))
            ),
        ));
        lines.push(row("work", format!("{} {}", with_bar(last.work, bar("work")), units.work())));
        if task.contact_nodes > 0 {
            let (active, nodes) = (last.active_nodes, task.contact_nodes);
            let sum = with_bar(last.contact_force, bar("contact_force"));
            let contact = format!("{active} of {nodes} nodes active, force {sum} {force}/{length}");
            lines.push(row("contact", contact));
        }
        lines.extend(supports(task, quantities, &bar));
        if let Some(outcome) = outcome {
            let [first, rest @ ..] = outcome.errors.lines(outcome.stopped.as_ref());
            lines.push(row("errors", first));
            lines.extend(rest.map(|line| row("", line)));
        }
        let kkt = outcome.map_or(last.kkt(), |outcome| outcome.kkt);
        lines.push(row("residuals", kkt.to_string()));
    }
    lines.extend(notes.iter().map(|note| row("note", note.clone())));
    if last.is_some() {
        lines.push(row("results", task.folder.display().to_string()));
    }
    lines
}

/// The resultants of the supports, a line each, with the error bars that `bar` knows by name.
fn supports(
    task: &Task,
    quantities: &[(String, f64)],
    bar: &dyn Fn(&str) -> Option<f64>,
) -> Vec<String> {
    let Units { length, force, .. } = &task.problem.scene().units;
    let mut lines = Vec::new();
    // Resultants come first, three for each support.
    let supports = &task.problem.supports.names;
    let resultants = quantities.chunks_exact(3).take(supports.len());
    let resultants = resultants.map(|of| [0, 1, 2].map(|i| of[i].1));
    for (name, [x, y, moment]) in supports.iter().zip(resultants) {
        let figure = |value: f64, of: &str| match bar(&format!("{name}.{of}")) {
            None => format!("{value:.4e}"),
            bar => with_bar(value, bar),
        };
        let (x, y) = (figure(x, "force_x"), figure(y, "force_y"));
        let resultant = format!("force ({x}, {y}) {force}/{length}");
        let moment = figure(moment, "moment");
        lines.push(row("support", format!("{name}: {resultant}, moment {moment} {force}")));
    }
    lines
}

pub fn row(name: &str, value: String) -> String {
    format!("  {name:<13} {value}")
}

fn steps(grid: TimeGrid, unit: &str, can_be_damaged: bool) -> String {
    let end = grid.end;
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
            format!("to t = {end} in steps chosen for an error of ζ of {tolerance:e}")
        }
    }
}

fn ending(last: Option<StepRecord>, outcome: Option<&Outcome>) -> String {
    let Some(StepRecord { step, time, .. }) = last else {
        return "FAILED at the first solve; there is no state to save".to_owned();
    };
    let end = rounded(time);
    match outcome.map(|outcome| outcome.stopped) {
        None => format!("FAILED after t = {end}; the state there is saved"),
        Some(Some(stop)) => format!(
            "STOPPED at t = {} ± {:.1e}{}: min ζ = {:.4} there reaches ζ_*; \
             saved is the state before, t = {end} (step {step})",
            rounded(stop.time),
            stop.bar(),
            if stop.from_mesh.is_some() { "" } else { " (the time steps alone)" },
            stop.zeta_min,
        ),
        Some(None) if step == 0 => format!("solved at t = {end}"),
        Some(None) => format!("finished at t = {end} after {step} steps"),
    }
}
