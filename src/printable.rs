//! Text for the terminal.

use std::io::{self, Write};

/// A text whose control characters are shown as `\x1b`: names in files of others must not command the terminal.
pub fn printable(text: &str) -> String {
    let shown = |c: char| match c {
        '\n' | '\t' => c.to_string(),
        _ if c.is_control() => format!("\\x{:02x}", u32::from(c)),
        _ => c.to_string(),
    };
    text.chars().map(shown).collect()
}

/// Prints lines to standard error in one write, so that the output of other ranks and of `mpiexec` cannot interrupt it.
pub fn print_error(lines: &str) {
    // If stderr is closed, the exit code still reports a failure.
    let _ = io::stderr().write_all(format!("{}\n", printable(lines)).as_bytes());
}
