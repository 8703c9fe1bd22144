//! What the commands of the program and of the studies share at the terminal.

pub use comfy_table::presets::ASCII_MARKDOWN as MARKDOWN;

use comfy_table::{CellAlignment, Table, TableStyle};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, Write};

/// Prints to standard output; a reader that has gone (`… | head`) is no reason to panic.
pub fn say(text: &str) {
    let _ = writeln!(io::stdout(), "{text}");
}

/// A progress bar of `length` that looks as indicatif's `template` says; silent when standard error is
/// no terminal.
pub fn progress_bar(template: &str, length: u64) -> ProgressBar {
    let bar = ProgressBar::new(length);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}

/// A table of `rows`, whose cells bring the titles of their columns, with numbers to the right in all
/// columns but the first `names`.
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
