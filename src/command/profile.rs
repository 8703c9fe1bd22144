//! The times of the phases of a run: the closing table of `--profile`.

use comfy_table::{LineStyle, presets};
use signorini::{
    output::terminal,
    phases::{Phase, Phases},
};
use std::iter::once;

/// The table of phases and their parts, longest first, for a run of `wall` seconds. It begins with an empty line.
pub fn table(phases: &Phases, wall: f64) -> Vec<String> {
    let mut lines = Vec::new();
    for (name, phase) in rows(phases, "", wall) {
        lines.push((name.to_owned(), phase));
        let parts = rows(phases, name, phase.seconds);
        lines.extend(parts.into_iter().map(|(part, phase)| (format!("  {part}"), phase)));
    }
    lines.push(("all".to_owned(), Phase { seconds: wall, ..Phase::default() }));
    let cells = lines.into_iter().map(|(name, phase)| cells(name, phase, wall));
    let rule = LineStyle::none().fill('─').junction('─');
    let table = terminal::table(presets::NOTHING.header_separator(rule), cells, 1);
    // The table pads its last column too.
    once(String::new()).chain(table.lines().map(|line| format!(" {}", line.trim_end()))).collect()
}

/// The parts of the phase `whole`, longest first, and the rest of its `seconds`.
fn rows(phases: &Phases, whole: &str, seconds: f64) -> Vec<(&'static str, Phase)> {
    let mut rows = phases.parts(whole);
    if !rows.is_empty() {
        rows.sort_by(|(_, a), (_, b)| b.seconds.total_cmp(&a.seconds));
        let measured: f64 = rows.iter().map(|(_, phase)| phase.seconds).sum();
        rows.push(("other", Phase { seconds: seconds - measured, ..Phase::default() }));
    }
    rows
}

/// A row of the table with its titles. Cells without a measurement are empty.
fn cells(name: String, phase: Phase, wall: f64) -> [(&'static str, String); 5] {
    let Phase { calls, seconds } = phase;
    let if_called = |text: String| if calls > 0.0 { text } else { String::new() };
    [
        ("phase", name),
        ("calls", if_called(calls.to_string())),
        ("seconds", format!("{seconds:.3}")),
        ("share", format!("{:.1} %", 100.0 * seconds / wall)),
        ("ms per call", if_called(format!("{:.3}", 1e3 * seconds / calls))),
    ]
}
