//! Where the time of a run went: the closing table, short or with all that was measured.

use comfy_table::{CellAlignment, LineStyle, Table, presets};
use signorini::phases::Phase;
use std::{collections::BTreeMap, fs};

type Phases = BTreeMap<&'static str, Phase>;

/// What no time step can do without: K's values, a product with K, a pair of triangular solves,
/// the damage.
const UNAVOIDABLE: [&str; 4] =
    ["stiffness refill", "contact/products", "contact/triangular solves", "damage solve"];

/// The phases that are not parts of others.
pub fn whole(phases: &Phases) -> Vec<(&'static str, Phase)> {
    let whole = phases.iter().filter(|(name, _)| !name.contains('/'));
    whole.map(|(name, phase)| (*name, *phase)).collect()
}

/// The parts of the phase called `name`.
fn parts(phases: &Phases, name: &str) -> Vec<(&'static str, Phase)> {
    let part = |key: &'static str| key.strip_prefix(name)?.strip_prefix('/');
    phases.iter().filter_map(|(key, phase)| Some((part(key)?, *phase))).collect()
}

/// The table of phases, longest first, for a run of `wall` seconds.
pub fn short(phases: &Phases, wall: f64) -> Vec<String> {
    let mut table = table(["phase", "calls", "seconds", "share"]);
    let all = ("all", untold(wall));
    for (name, phase) in rows(whole(phases), wall).into_iter().chain([all]) {
        let calls = if phase.calls > 0 { phase.calls.to_string() } else { String::new() };
        table.add_row([
            name.to_owned(),
            calls,
            format!("{:.3}", phase.seconds),
            share(phase.seconds, wall),
        ]);
    }
    lines(table)
}

/// As [`short`], with the parts of phases, milliseconds per call and bytes moved; below it the
/// share of the unavoidable work in `stepping`, the seconds of `steps` steps, and the peak memory.
pub fn report(phases: &Phases, wall: f64, steps: usize, stepping: f64) -> Vec<String> {
    let columns = ["phase", "calls", "seconds", "share", "ms per call", "MB per call", "GB/s"];
    let mut table = table(columns);
    let all = ("all", untold(wall));
    for (name, phase) in rows(whole(phases), wall).into_iter().chain([all]) {
        table.add_row(measured(name, phase, wall));
        let parts = parts(phases, name);
        if !parts.is_empty() {
            for (part, phase) in rows(parts, phase.seconds) {
                table.add_row(measured(&format!("  {part}"), phase, wall));
            }
        }
    }
    let mut text = lines(table);
    text.push(String::new());
    text.extend(unavoidable(phases, steps, stepping));
    text.extend(peak_memory().map(|mb| format!(" peak memory {mb:.0} MB")));
    text
}

/// Phases, longest first, and what they leave of the `wall` seconds around them.
fn rows(mut phases: Vec<(&'static str, Phase)>, wall: f64) -> Vec<(&'static str, Phase)> {
    phases.sort_by(|a, b| b.1.seconds.total_cmp(&a.1.seconds));
    let known: f64 = phases.iter().map(|(_, phase)| phase.seconds).sum();
    phases.push(("other", untold(wall - known)));
    phases
}

/// So many seconds of which nothing else is known.
fn untold(seconds: f64) -> Phase {
    Phase { seconds, ..Phase::default() }
}

fn measured(name: &str, phase: Phase, wall: f64) -> [String; 7] {
    let told = |known: bool, text: String| if known { text } else { String::new() };
    let (calls, moved) = (phase.calls as f64, phase.bytes > 0.0);
    [
        name.to_owned(),
        told(phase.calls > 0, phase.calls.to_string()),
        format!("{:.3}", phase.seconds),
        share(phase.seconds, wall),
        told(phase.calls > 0, format!("{:.3}", 1e3 * phase.seconds / calls)),
        told(moved, format!("{:.1}", 1e-6 * phase.bytes / calls)),
        told(moved, format!("{:.1}", 1e-9 * phase.bytes / phase.seconds)),
    ]
}

/// The work that no step can avoid, once per step at the mean cost that it had here.
fn unavoidable(phases: &Phases, steps: usize, stepping: f64) -> Option<String> {
    let parts: Vec<(&str, f64)> = UNAVOIDABLE
        .iter()
        .filter_map(|&name| phases.get(name).map(|p| (name, p.seconds / p.calls.max(1) as f64)))
        .collect();
    let least: f64 = parts.iter().map(|(_, seconds)| seconds).sum();
    if steps == 0 || parts.is_empty() {
        return None;
    }
    let named: Vec<&str> =
        parts.iter().map(|(name, _)| name.rsplit('/').next().unwrap_or(name)).collect();
    Some(format!(
        " unavoidable work, once per step ({}): {:.2} ms,\n {:.0} % of the {:.2} ms that a step took",
        named.join(", "),
        1e3 * least,
        100.0 * least * steps as f64 / stepping,
        1e3 * stepping / steps as f64
    ))
}

/// The most memory this process has held, MB, where the system tells.
fn peak_memory() -> Option<f64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(1.024e-3 * kilobytes)
}

fn share(seconds: f64, wall: f64) -> String {
    format!("{:.1} %", 100.0 * seconds / wall)
}

fn table<const N: usize>(header: [&str; N]) -> Table {
    let mut table = Table::new();
    let rule = LineStyle::none().fill('─').junction('─');
    table.load_style(presets::NOTHING.header_separator(rule));
    table.set_header(header);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// The table line by line; it pads its last column too.
fn lines(table: Table) -> Vec<String> {
    table.to_string().lines().map(|line| format!(" {}", line.trim_end())).collect()
}
