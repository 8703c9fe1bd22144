//! Where the time of a run went: the closing table, short or with all that was measured.

use comfy_table::{CellAlignment, LineStyle, Table, presets};
use signorini::phases::{Phase, Phases};
use std::fs;

/// What no time step can do without: the values of K, a product with K, a pair of triangular solves,
/// and the damage.
const UNAVOIDABLE: [&str; 4] =
    ["stiffness refill", "contact/products", "contact/triangular solves", "damage solve"];

/// The columns of the table; the short one has the first [`SHORT`] of them.
const COLUMNS: [&str; 7] =
    ["phase", "calls", "seconds", "share", "ms per call", "MB per call", "GB/s"];
const SHORT: usize = 4;

/// The table of phases, longest first, for a run of `wall` seconds; in full it has the parts of
/// phases too, milliseconds per call and bytes moved.
pub fn table(phases: &Phases, wall: f64, full: bool) -> Vec<String> {
    let columns = if full { COLUMNS.len() } else { SHORT };
    let mut table = Table::new();
    let rule = LineStyle::none().fill('─').junction('─');
    table.load_style(presets::NOTHING.header_separator(rule));
    table.set_header(&COLUMNS[..columns]);
    let mut add = |name: &str, phase: Phase| {
        table.add_row(cells(name, phase, wall).into_iter().take(columns));
    };
    for (name, phase) in rows(phases, "", wall) {
        add(name, phase);
        let parts = if full { rows(phases, name, phase.seconds) } else { Vec::new() };
        parts.into_iter().for_each(|(part, phase)| add(&format!("  {part}"), phase));
    }
    add("all", Phase { seconds: wall, ..Phase::default() });
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    // The table pads its last column too.
    table.to_string().lines().map(|line| format!(" {}", line.trim_end())).collect()
}

/// The parts of the phase called `whole`, longest first, and what they leave of its `seconds`.
fn rows(phases: &Phases, whole: &str, seconds: f64) -> Vec<(&'static str, Phase)> {
    let mut rows = phases.parts(whole);
    if !rows.is_empty() {
        rows.sort_by(|(_, a), (_, b)| b.seconds.total_cmp(&a.seconds));
        let measured: f64 = rows.iter().map(|(_, phase)| phase.seconds).sum();
        rows.push(("other", Phase { seconds: seconds - measured, ..Phase::default() }));
    }
    rows
}

/// A row of the table; cells of what was not measured are empty.
fn cells(name: &str, phase: Phase, wall: f64) -> [String; COLUMNS.len()] {
    let Phase { calls, seconds, bytes } = phase;
    let if_called = |text: String| if calls > 0 { text } else { String::new() };
    let if_moved = |text: String| if bytes > 0.0 { text } else { String::new() };
    [
        name.to_owned(),
        if_called(calls.to_string()),
        format!("{seconds:.3}"),
        format!("{:.1} %", 100.0 * seconds / wall),
        if_called(format!("{:.3}", 1e3 * seconds / calls as f64)),
        if_moved(format!("{:.1}", 1e-6 * bytes / calls as f64)),
        if_moved(format!("{:.1}", 1e-9 * bytes / seconds)),
    ]
}

/// The share of the unavoidable work in `stepping`, the seconds of `steps` steps, and the peak memory.
pub fn remarks(phases: &Phases, steps: usize, stepping: f64) -> Vec<String> {
    let mut remarks = Vec::new();
    let mean = |name| phases.get(name).map(|p| (name, p.seconds / p.calls.max(1) as f64));
    let parts: Vec<(&str, f64)> = UNAVOIDABLE.into_iter().filter_map(mean).collect();
    if steps > 0 && !parts.is_empty() {
        let unavoidable: f64 = parts.iter().map(|(_, seconds)| seconds).sum();
        let names: Vec<&str> =
            parts.iter().map(|(name, _)| name.trim_start_matches("contact/")).collect();
        remarks.push(format!(
            " unavoidable work, once per step ({}): {:.2} ms,\n {:.0} % of the {:.2} ms that a step took",
            names.join(", "),
            1e3 * unavoidable,
            100.0 * unavoidable * steps as f64 / stepping,
            1e3 * stepping / steps as f64
        ));
    }
    remarks.extend(peak_memory().map(|mb| format!(" peak memory {mb:.0} MB")));
    remarks
}

/// The most memory this process has held, MB, where Linux tells (proc(5), VmHWM).
fn peak_memory() -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(1.024e-3 * kilobytes)
}
