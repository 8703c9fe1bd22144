//! Where the time of a run went: the closing table, short or with all that was measured.

use comfy_table::{CellAlignment, LineStyle, Table, presets};
use signorini::phases::Phase;
use std::{collections::BTreeMap, fs};

type Phases = BTreeMap<&'static str, Phase>;

/// What no time step can do without: the values of K, a product with K, a pair of triangular solves,
/// and the damage.
const UNAVOIDABLE: [&str; 4] =
    ["stiffness refill", "contact/products", "contact/triangular solves", "damage solve"];

/// The columns of the table; the short one has the first [`SHORT`] of them.
const COLUMNS: [&str; 7] =
    ["phase", "calls", "seconds", "share", "ms per call", "MB per call", "GB/s"];
const SHORT: usize = 4;

/// The phases whose names are `prefix` and one more word, by that word: with the prefix "" those that
/// are not parts of others, with "contact/" the parts of the phase "contact".
pub fn parts(phases: &Phases, prefix: &str) -> Vec<(&'static str, Phase)> {
    let parts = phases.iter().filter_map(|(name, phase)| {
        let part = name.strip_prefix(prefix)?;
        (!part.contains('/')).then_some((part, *phase))
    });
    parts.collect()
}

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
    for (name, phase) in with_rest(parts(phases, ""), wall) {
        add(name, phase);
        let parts = parts(phases, &format!("{name}/"));
        if full && !parts.is_empty() {
            for (part, phase) in with_rest(parts, phase.seconds) {
                add(&format!("  {part}"), phase);
            }
        }
    }
    add("all", Phase { seconds: wall, ..Phase::default() });
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    // The table pads its last column too.
    table.to_string().lines().map(|line| format!(" {}", line.trim_end())).collect()
}

/// Phases, longest first, and what they leave of the `wall` seconds around them.
fn with_rest(mut phases: Vec<(&'static str, Phase)>, wall: f64) -> Vec<(&'static str, Phase)> {
    phases.sort_by(|a, b| b.1.seconds.total_cmp(&a.1.seconds));
    let measured: f64 = phases.iter().map(|(_, phase)| phase.seconds).sum();
    phases.push(("other", Phase { seconds: wall - measured, ..Phase::default() }));
    phases
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
