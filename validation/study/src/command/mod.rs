//! What the subcommands do.

mod chart;
mod converge;
mod reference;
mod stability;

pub use chart::speed_chart;
pub use converge::convergence;
pub use reference::{ReferenceArguments, StudyArguments, reference};
pub use stability::{StabilityArguments, stability};

use comfy_table::{CellAlignment, Table, presets};
use indicatif::{ProgressBar, ProgressStyle};
use signorini::petsc::Session;
use signorini_study::StudyError;
use std::io::{self, Write};

/// Makes a study while PETSc runs.
fn with_petsc<T>(
    options: &[String],
    study: impl FnOnce(&Session) -> Result<T, StudyError>,
) -> Result<T, StudyError> {
    let session = Session::start(options)?;
    let made = study(&session);
    session.finalize()?;
    made
}

/// A progress bar; silent when standard error is no terminal.
fn progress(template: &str) -> ProgressBar {
    let bar = ProgressBar::new(1);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}

/// The bar of many runs, moved by telling it how many of how many are done.
fn run_progress() -> (ProgressBar, impl FnMut(usize, usize)) {
    let bar = progress("{bar:20} {pos} of {len} runs {elapsed}, {eta} left");
    let told = bar.clone();
    let tell = move |done: usize, all: usize| {
        told.set_length(all as u64);
        told.set_position(done as u64);
    };
    (bar, tell)
}

/// A table in Markdown, numbers to the right in all columns but the first `names`.
fn table<C: ToString>(
    header: impl IntoIterator<Item = impl ToString>,
    rows: impl IntoIterator<Item = Vec<C>>,
    names: usize,
) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(header.into_iter().map(|cell| cell.to_string()));
    for row in rows {
        table.add_row(row.into_iter().map(|cell| cell.to_string()));
    }
    for column in table.column_iter_mut().skip(names) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Prints to standard output; a reader that has gone (`… | head`) is no reason to panic.
fn say(text: &str) {
    let _ = writeln!(io::stdout(), "{text}");
}
