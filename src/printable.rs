//! Text for the terminal.

use std::io::{self, Write};

/// A text whose control characters are shown as `\x1b`, and those that are not seen or turn others round as `\u{202e}` (the
/// categories Cf, Zl and Zp of Unicode): names in files of others must not command the terminal.
pub fn printable(text: &str) -> String {
    let unseen = |c: char| c.escape_unicode().to_string();
    let shown = |c: char| match c {
        '\n' | '\t' => c.to_string(),
        _ if c.is_control() => format!("\\x{:02x}", u32::from(c)),
        '\u{ad}' | '\u{600}'..='\u{605}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' => {
            unseen(c)
        }
        '\u{2028}'..='\u{202e}'
        | '\u{2060}'..='\u{206f}'
        | '\u{feff}'
        | '\u{fff9}'..='\u{fffb}' => unseen(c),
        '\u{e0001}'..='\u{e007f}' => unseen(c),
        _ => c.to_string(),
    };
    text.chars().map(shown).collect()
}

/// Prints lines to standard error in one write, so that the output of other ranks and of `mpiexec` cannot interrupt it.
pub fn print_error(lines: &str) {
    // If stderr is closed, the exit code still reports a failure.
    let _ = io::stderr().write_all(format!("{}\n", printable(lines)).as_bytes());
}
