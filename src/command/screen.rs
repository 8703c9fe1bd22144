//! What a run shows: a progress bar, the result in a few lines, a table of phases.

use indicatif::{ProgressBar, ProgressStyle};
use signorini::{
    evolution::{DiscreteProblem, Outcome, StepRecord},
    output::Summary,
    scene::{Stepping, TimeGrid},
};
use std::{
    io::{self, Write},
    path::Path,
};

/// The terminal of a run; the bar is silent when standard error is no terminal.
pub struct Screen {
    bar: ProgressBar,
    end: f64,
}

/// The bar counts thousandths of the time to be run.
const LENGTH: u64 = 1000;

impl Screen {
    /// Shows what is to be solved, at once.
    pub fn open(
        problem: &DiscreteProblem,
        solver: &str,
        triangles: usize,
        contact_nodes: usize,
    ) -> Self {
        let (scene, partition) = (problem.scene(), &problem.body.partition);
        let mut mesh = format!("{} nodes, {triangles} triangles", partition.total());
        if !partition.comm().is_serial() {
            mesh += &format!(", on {} ranks", partition.comm().size());
        }
        let solver = match contact_nodes {
            0 => format!("{solver} (no contact: one linear solve a step)"),
            _ => solver.to_owned(),
        };
        let lines = [scene.title.clone(), row("mesh", mesh), row("solver", solver)];
        let time = scene.time.map(|grid| row("time", steps(grid)));
        say(&lines.into_iter().chain(time).collect::<Vec<_>>().join("\n"));
        let end = scene.time.map_or(1.0, |grid| grid.end);
        let bar = ProgressBar::new(LENGTH);
        let template = "{bar:20} {wide_msg} {elapsed}, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.set_message("the first solve");
        Self { bar, end }
    }

    /// Time, min ζ, active nodes and iterations of an accepted step.
    pub fn show(&self, record: &StepRecord) {
        self.bar.set_position((LENGTH as f64 * record.time / self.end) as u64);
        self.bar.set_message(format!(
            "step {}  t = {:.4}  min ζ = {:.6}  active {}  iterations {}",
            record.step, record.time, record.zeta_min, record.active_nodes, record.iterations
        ));
    }

    /// Replaces the bar by the result and the table of `phases`.
    pub fn close(
        &self,
        summary: &Summary,
        outcome: Option<&Outcome>,
        phases: &[String],
        folder: &Path,
    ) {
        self.bar.finish_and_clear();
        say(&report(summary, outcome, phases, folder));
    }
}

/// Prints to standard output; a reader that has gone (`… | head`) is no reason to panic.
pub fn say(text: &str) {
    let _ = writeln!(io::stdout(), "{text}");
}

fn report(s: &Summary, outcome: Option<&Outcome>, phases: &[String], folder: &Path) -> String {
    let mut lines = vec![row("end", ending(s, outcome))];
    lines.extend(result(s).into_iter().flatten());
    lines.extend(s.notes.iter().map(|note| row("note", note.clone())));
    lines.push(row("results", folder.display().to_string()));
    lines.push(String::new());
    lines.extend_from_slice(phases);
    lines.join("\n")
}

fn steps(grid: TimeGrid) -> String {
    let end = grid.end;
    match grid.stepping {
        Stepping::Uniform { steps } => {
            format!("{steps} steps of {} s to t = {end}", time(end / steps as f64))
        }
        Stepping::Auto { tolerance } => {
            format!("to t = {end} in steps as the error of ζ, {tolerance:e} each, allows")
        }
    }
}

/// What the last accepted state tells, if there is one.
fn result(s: &Summary) -> Option<Vec<String>> {
    let mut lines = vec![
        match s.zeta_min? {
            1.0 => row("damage", "none".to_owned()),
            least => row("damage", format!("min ζ {least:.6}, mean ζ {:.6}", s.zeta_mean?)),
        },
        row("displacement", format!("largest {:.6e} m", s.displacement_max?)),
        row("work", format!("{:.6e} J/m", s.work?)),
    ];
    if s.contact_nodes > 0 {
        let (active, nodes, force) = (s.active_nodes?, s.contact_nodes, s.contact_force?);
        lines.push(row(
            "contact",
            format!("{active} of {nodes} nodes active, force {force:.6e} N/m"),
        ));
    }
    lines.push(row("residuals", s.kkt?.to_string()));
    Some(lines)
}

fn row(name: &str, value: String) -> String {
    format!("  {name:<13} {value}")
}

fn ending(s: &Summary, outcome: Option<&Outcome>) -> String {
    let Some(end) = s.end_time.map(time) else {
        return "FAILED at the first solve; there is no state to save".to_owned();
    };
    match outcome.map(|o| o.stopped) {
        None => format!("FAILED after t = {end}; the state there is saved"),
        Some(Some(stop)) => format!(
            "STOPPED at t = {} ± {:.1e}: min ζ = {:.4} there reaches ζ_*; \
             saved is the state before, t = {end} (step {})",
            time(stop.time),
            stop.uncertainty,
            stop.zeta_min,
            s.steps
        ),
        Some(None) if s.steps == 0 => format!("solved at t = {end}"),
        Some(None) => format!("finished at t = {end} after {} steps", s.steps),
    }
}

/// A time without the rounding of its last digits: 0.0248, not 0.024800000000000003.
fn time(t: f64) -> f64 {
    format!("{t:.9e}").parse().unwrap_or(t)
}
