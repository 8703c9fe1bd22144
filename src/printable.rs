//! Text for the terminal.

use std::io::{self, Write};

/// A text whose control characters are shown as `\x1b`, and those that are not seen or turn others round as `\u{202e}` (the
/// categories Cf, Zl and Zp of Unicode): names in files of others must not command the terminal.
pub fn printable(text: &str) -> String {
    let shown = |c: char| match c {
        '\n' | '\t' => c.to_string(),
        _ if c.is_control() => format!("\\x{:02x}", u32::from(c)),
        _ if is_unseen(c) => c.escape_unicode().to_string(),
        _ => c.to_string(),
    };
    text.chars().map(shown).collect()
}

/// The categories Cf, Zl and Zp (DerivedGeneralCategory.txt of Unicode 14).
#[rustfmt::skip]
fn is_unseen(c: char) -> bool {
    matches!(c, '\u{ad}' | '\u{600}'..='\u{605}' | '\u{61c}' | '\u{6dd}' | '\u{70f}' | '\u{890}'..='\u{891}' | '\u{8e2}'
        | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{2064}' | '\u{2066}'..='\u{206f}'
        | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{110bd}' | '\u{110cd}' | '\u{13430}'..='\u{13438}'
        | '\u{1bca0}'..='\u{1bca3}' | '\u{1d173}'..='\u{1d17a}' | '\u{e0001}' | '\u{e0020}'..='\u{e007f}')
}

/// Prints lines to standard error in one write, so that the output of other ranks and of `mpiexec` cannot interrupt it.
pub fn print_error(lines: &str) {
    // If stderr is closed, the exit code still reports a failure.
    let _ = io::stderr().write_all(format!("{}\n", printable(lines)).as_bytes());
}
