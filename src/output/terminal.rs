//! The common output of all commands at the terminal.

pub use comfy_table::presets::ASCII_MARKDOWN as MARKDOWN;

use comfy_table::{CellAlignment, Table, TableStyle};
use indicatif::{ProgressBar, ProgressStyle};
use std::{
    io::{self, Write},
    time::{Duration, Instant},
};

/// Prints to standard output. It is no error if the reader of a pipe has gone (`… | head`).
pub fn say(text: &str) {
    let _ = writeln!(io::stdout(), "{text}");
}

/// The smallest error bar that is shown, over its figure.
const LEAST_BAR: f64 = 1e-6;

/// A figure with its error bar, if it has one: `5.3570 ± 0.0004`, or `(1.8139 ± 0.0012)e-2`. The bar is rounded up to
/// one digit, or to two if the first one is 1 or 2. The figure has at most seven digits. `scripts/bars.py` does the
/// same.
pub fn with_bar(value: f64, bar: Option<f64>) -> String {
    let exponent = |number: f64| number.abs().log10().floor() as i32;
    let bar = bar.filter(|bar| *bar > 0.0 && bar.is_finite() && value.is_finite());
    let Some(bar) = bar else { return format!("{value:.6e}") };
    if bar > value.abs() && value != 0.0 {
        return format!("{value:.1e} ± {bar:.1e}");
    }
    let of_both = exponent(value.abs().max(bar));
    let bar = bar.max(LEAST_BAR * value.abs());
    let last = exponent(bar) - i32::from(bar / 10_f64.powi(exponent(bar)) < 3.0);
    let bar = (bar / 10_f64.powi(last) - 1e-9).ceil() * 10_f64.powi(last);
    match of_both {
        -3..5 => {
            let decimals = (-last).max(0) as usize;
            format!("{value:.decimals$} ± {bar:.decimals$}")
        }
        _ => {
            let (unit, decimals) = (10_f64.powi(of_both), (of_both - last).max(0) as usize);
            format!("({:.decimals$} ± {:.decimals$})e{of_both}", value / unit, bar / unit)
        }
    }
}

/// A number with at most this many significant digits: `0.0125`, `12.5`, or `1.25e-7`.
pub fn plain(value: f64, digits: usize) -> String {
    let rounded: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
    match rounded.abs() {
        size if size == 0.0 || (1e-3..1e7).contains(&size) => rounded.to_string(),
        _ => format!("{rounded:e}"),
    }
}

/// A progress bar of `length` after indicatif's `template`. It is silent if standard error is no terminal.
pub fn progress_bar(template: &str, length: u64) -> ProgressBar {
    let bar = ProgressBar::new(length);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}

/// The time between two lines of progress without a terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

/// Progress on standard error: a bar on a terminal, otherwise a line every few seconds.
pub struct Progress {
    bar: ProgressBar,
    started: Instant,
    last_line: Instant,
}

impl Progress {
    /// As [`progress_bar`].
    pub fn new(template: &str, length: u64) -> Self {
        let now = Instant::now();
        Self { bar: progress_bar(template, length), started: now, last_line: now }
    }

    /// Shows the `position` of the work on the length, with a message.
    pub fn show(&mut self, position: u64, message: String) {
        if !self.bar.is_hidden() {
            self.bar.set_position(position);
            self.bar.set_message(message);
        } else if self.last_line.elapsed() > BETWEEN_LINES {
            self.last_line = Instant::now();
            let part = position as f64 / self.bar.length().unwrap_or(position).max(1) as f64;
            let (percent, seconds) = (100.0 * part, self.started.elapsed().as_secs_f64());
            let left = seconds / part - seconds;
            let left = if left.is_finite() { format!(", {left:.0} s left") } else { String::new() };
            let _ =
                writeln!(io::stderr(), "  {percent:>3.0} % after {seconds:.0} s{left}  {message}");
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// A table of `rows`. Each cell comes with the title of its column. Numbers are aligned to the right in all
/// columns except the first `names`.
pub fn table<T: ToString, R: IntoIterator<Item = (T, String)>>(
    style: TableStyle,
    rows: impl IntoIterator<Item = R>,
    names: usize,
) -> String {
    let mut table = Table::new();
    table.load_style(style);
    for row in rows {
        let (titles, cells): (Vec<T>, Vec<String>) = row.into_iter().unzip();
        table.set_header(titles);
        table.add_row(cells);
    }
    for column in table.column_iter_mut().skip(names) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.to_string()
}
