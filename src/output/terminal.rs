//! The common output of all commands at the terminal.

use crate::printable::{print_error, printable};
use indicatif::{ProgressBar, ProgressStyle};
use std::{
    io::{self, Write},
    sync::OnceLock,
    time::{Duration, Instant},
};

/// The first error of writing to standard output.
static LOST: OnceLock<io::Error> = OnceLock::new();

/// Prints to standard output. [`lost`] has the error of it.
pub fn say(text: &str) {
    keep(writeln!(io::stdout(), "{}", printable(text)));
}

/// Keeps the error of an output for [`lost`]. It is no error if the reader of a pipe has gone (`… | head`).
pub fn keep(written: io::Result<()>) {
    let is_gone = |error: &io::Error| error.kind() == io::ErrorKind::BrokenPipe;
    written.err().filter(|error| !is_gone(error)).into_iter().for_each(|e| drop(LOST.set(e)));
}

/// The error if a part of the output could not be written.
pub fn lost() -> Option<String> {
    LOST.get().map(|error| format!("standard output: {error}"))
}

/// The smallest error bar that is shown, over its figure.
const SMALLEST_BAR: f64 = 1e-6;

/// A figure with its error bar, if it has one: `5.3570 ± 0.0004`, or `(1.8139 ± 0.0012)e-4`. The bar is rounded up to
/// one digit, or to two if the first one is 1 or 2. The figure has at most seven digits. `scripts/bars.py` does the
/// same.
pub fn with_bar(value: f64, bar: Option<f64>) -> String {
    let exponent = |number: f64| number.abs().log10().floor() as i32;
    let bar = bar.filter(|bar| *bar > 0.0 && bar.is_finite() && value.is_finite());
    let Some(bar) = bar else { return plain(value, 7) };
    if bar > value.abs() {
        return format!("{} ± {}", plain(value, 2), plain(bar, 2));
    }
    let of_both = exponent(value.abs().max(bar));
    let bar = bar.max(SMALLEST_BAR * value.abs());
    let last = exponent(bar) - i32::from(bar / 10_f64.powi(exponent(bar)) < 3.0);
    let bar = (bar / 10_f64.powi(last) - 1e-9).ceil() * 10_f64.powi(last);
    match of_both {
        -3..7 => {
            let (decimals, tens) = ((-last).max(0) as usize, 10_f64.powi(last));
            let value = if last > 0 { (value / tens).round() * tens } else { value };
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

/// The time between two lines of progress without a terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

/// The time left is shown after this time, or this part of the work: the first steps may be slower or shorter than the others.
const KNOWN_AFTER: (Duration, f64) = (Duration::from_secs(10), 0.05);

/// The least length of the bar behind the fields of progress.
const LEAST_BAR: usize = 8;

/// Progress on standard error: on a terminal a line that stays, otherwise a line every few seconds.
pub struct Progress {
    bar: ProgressBar,
    started: Instant,
    last_line: Instant,
    /// Times spent and parts of the work done: the rate since the first is that of the last half to three quarters of the time.
    marks: [(Duration, f64); 2],
}

impl Progress {
    /// Progress of work of this `length`.
    pub fn new(length: u64) -> Self {
        let (now, bar) = (Instant::now(), ProgressBar::new(length));
        if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar}") {
            bar.set_style(style);
        }
        Self { bar, started: now, last_line: now, marks: Default::default() }
    }

    /// Shows the `position` of the work on the length, with `fields`, the most important ones first.
    pub fn show(&mut self, position: u64, mut fields: Vec<String>) {
        let part = position as f64 / self.bar.length().unwrap_or(position).max(1) as f64;
        let spent = self.started.elapsed();
        let words =
            |time: Duration| humantime::format_duration(Duration::from_secs(time.as_secs()));
        if spent >= 2 * self.marks[1].0 {
            self.marks = [self.marks[1], (spent, part)];
        }
        let (since, done) = self.marks[0];
        let left = (spent - since).as_secs_f64() * (1.0 - part) / (part - done);
        let is_known = spent >= KNOWN_AFTER.0 || part >= KNOWN_AFTER.1;
        let left = Duration::try_from_secs_f64(if is_known { left } else { f64::NAN });
        let left = left.map_or_else(|_| String::new(), |left| format!(", {} left", words(left)));
        fields.insert(0, format!("{:>3.0} % after {}{left}", 100.0 * part, words(spent)));
        if !self.bar.is_hidden() {
            let columns = terminal_size::terminal_size_of(io::stderr());
            let columns = columns.map_or(usize::MAX, |(columns, _)| columns.0.into());
            self.bar.set_position(position);
            self.bar.set_message(fitting(&fields, columns.saturating_sub(LEAST_BAR)));
        } else if self.last_line.elapsed() > BETWEEN_LINES {
            self.last_line = Instant::now();
            print_error(&fitting(&fields, usize::MAX));
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// As many of the fields, from the first one, as fit into a line of `columns`. The first field is there in any case.
pub fn fitting(fields: &[String], columns: usize) -> String {
    let lengths = (0..fields.len()).map(|i| fields[..=i].join("  ").chars().count());
    let count = lengths.take_while(|length| *length <= columns).count();
    fields[..count.max(1).min(fields.len())].join("  ")
}
