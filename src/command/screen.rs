//! What a run shows: a progress bar, the result in a few lines, a table of phases.

use comfy_table::{CellAlignment, Table, presets};
use indicatif::{ProgressBar, ProgressStyle};
use signorini::{
    evolution::{Outcome, Setting, StepRecord},
    output::Summary,
};
use std::{collections::BTreeMap, path::Path};

/// The terminal of a run; the bar is silent when standard error is no terminal.
pub struct Screen {
    bar: ProgressBar,
    end: f64,
}

/// The bar counts thousandths of the time to be run.
const LENGTH: u64 = 1000;

impl Screen {
    pub fn new(setting: &Setting) -> Self {
        let end = setting.scene().time.map_or(1.0, |grid| grid.end);
        let bar = ProgressBar::new(LENGTH);
        let template = "{bar:30} {msg}  {elapsed} (about {eta} left)";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
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

    /// Replaces the bar by the result and where the time went.
    pub fn close(
        &self,
        summary: &Summary,
        outcome: Option<&Outcome>,
        phases: &BTreeMap<&'static str, (usize, f64)>,
        folder: &Path,
    ) {
        self.bar.finish_and_clear();
        let s = summary;
        println!("{} ({}, {} nodes, {} triangles)", s.title, s.solver, s.nodes, s.triangles);
        println!("  {}", ending(s, outcome));
        println!(
            "  min ζ {:.6}, mean ζ {:.6}, max |u| {:.6e} m, work {:.6e} J/m",
            s.zeta_min, s.zeta_mean, s.displacement_max, s.work
        );
        if s.contact_nodes > 0 {
            println!(
                "  contact: {} of {} nodes active, force {:.6e} N/m",
                s.active_nodes, s.contact_nodes, s.contact_force
            );
        }
        println!("  worst KKT residuals: {}", s.kkt);
        for note in &s.notes {
            println!("  note: {note}");
        }
        println!("{}", phase_table(phases, s.wall_seconds));
        println!("  results in {}", folder.display());
    }
}

fn ending(s: &Summary, outcome: Option<&Outcome>) -> String {
    match outcome.map(|o| o.stopped) {
        None => format!("FAILED after t = {}; the state there is saved", s.end_time),
        Some(Some(stop)) => format!(
            "STOPPED at ζ_* at t = {:.6} ± {:.1e} (min ζ would be {:.4}); \
             last admissible state t = {:.6} (step {})",
            stop.time, stop.uncertainty, stop.zeta_min, s.end_time, s.steps
        ),
        Some(None) => format!("finished at t = {} after {} steps", s.end_time, s.steps),
    }
}

fn phase_table(phases: &BTreeMap<&'static str, (usize, f64)>, wall: f64) -> Table {
    let mut rows: Vec<_> = phases.iter().map(|(name, &(calls, s))| (*name, calls, s)).collect();
    rows.sort_by(|a, b| b.2.total_cmp(&a.2));
    let rest = wall - rows.iter().map(|(_, _, s)| s).sum::<f64>();
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["phase", "calls", "seconds", "share"]);
    let share = |s: f64| format!("{:.1} %", 100.0 * s / wall);
    for (name, calls, s) in rows {
        table.add_row([name.to_owned(), calls.to_string(), format!("{s:.3}"), share(s)]);
    }
    table.add_row(["other".to_owned(), String::new(), format!("{rest:.3}"), share(rest)]);
    table.add_row(["all".to_owned(), String::new(), format!("{wall:.3}"), share(wall)]);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
