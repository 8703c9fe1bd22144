//! Output on a terminal of any width.

use crate::test_directory::TestDirectory;
use signorini::output::terminal::fitting;
use std::process::Command;

/// The lines that a command shows on a terminal of so many columns, without escape codes.
fn shown(directory: &TestDirectory, columns: usize, arguments: &str) -> Vec<String> {
    let program = env!("CARGO_BIN_EXE_signorini");
    let output = Command::new("script")
        .args([
            "-qec",
            &format!("stty rows 24 cols {columns}; '{program}' {arguments}"),
            "/dev/null",
        ])
        .current_dir(directory.path("."))
        .env("TERM", "xterm")
        .output()
        .expect("script(1)");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let mut plain = String::new();
    for (n, part) in text.split("\x1b[").enumerate() {
        let code = if n == 0 { 0 } else { part.find(char::is_alphabetic).map_or(0, |end| end + 1) };
        plain.push_str(&part[code..]);
    }
    plain
        .split(['\r', '\n'])
        .map(|line| line.trim_end().to_owned())
        .filter(|line| !line.is_empty())
        .collect()
}

/// The first fields that fit, whole; always the first one.
#[test]
fn fields_are_shown_whole_or_not_at_all() {
    let fields =
        ["50 % after 21s", "t = 0.5", "step 77", "min ζ = 0.9", "active 77"].map(str::to_owned);
    let all = fields.join("  ");
    let mut last = 0;
    for columns in 0..=all.chars().count() {
        let line = fitting(&fields, columns);
        let parts: Vec<&str> = line.split("  ").collect();
        assert_eq!(parts, fields[..parts.len()], "{columns}");
        assert!(parts.len() >= last && (line.chars().count() <= columns || parts.len() == 1));
        last = parts.len();
    }
    assert_eq!(last, fields.len());
}

/// Messages, help and progress on a terminal have no colours if the user wants none or the terminal has none.
#[test]
fn colours_are_optional() {
    let directory = TestDirectory::new();
    directory.write("wrong.toml", "materal = 3\n");
    let program = env!("CARGO_BIN_EXE_signorini");
    let has_colours = |variable: &str, arguments: &str| {
        let mut command = Command::new("script");
        command.args(["-qec", &format!("{variable} '{program}' {arguments}"), "/dev/null"]);
        // These variables decide on colours as well; continuous integration, for one, sets CI.
        for other in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE", "CI"] {
            command.env_remove(other);
        }
        let output = command.env("TERM", "xterm").current_dir(directory.path(".")).output();
        let text = output.expect("script(1)").stdout;
        let text = String::from_utf8_lossy(&text).into_owned();
        // "Select graphic rendition": ESC [ numbers m.
        let mut codes = text.split("\x1b[").skip(1);
        codes.any(|code| {
            code.trim_start_matches(|c: char| c.is_ascii_digit() || c == ';').starts_with('m')
        })
    };
    assert!(has_colours("", "unknown"), "there are no colours to switch off");
    let commands =
        ["unknown", "run --help", "check wrong.toml", "check scene.toml", "run scene.toml"];
    for (variable, command) in
        ["NO_COLOR=1", "TERM=dumb"].iter().flat_map(|v| commands.map(|c| (v, c)))
    {
        assert!(!has_colours(variable, command), "{variable} signorini {command}");
    }
}

#[test]
fn progress_and_help_fit_any_terminal() {
    let directory = TestDirectory::new();
    for columns in [30, 60, 80, 110] {
        let run =
            shown(&directory, columns, "run scene.toml --set time.step=0.002 --set output.every=0");
        let progress: Vec<_> = run.iter().filter(|line| line.contains(" % after ")).collect();
        assert!(progress.len() > 1, "{run:?}");
        let begin = ["t = ", "step ", "min ζ = ", "active ", "iterations ", "the first solve"];
        for line in progress {
            // The rate of the first steps is not that of the others.
            let percent = line.split('%').next().and_then(|part| part.trim().parse::<u32>().ok());
            let is_early = percent.expect("a part") < 5 && line.contains(" after 0s");
            assert!(!(is_early && line.contains(" left")), "{line}");
            assert!(line.chars().count() <= columns, "{columns}: {line}");
            let fields =
                line.trim_end_matches(['█', '░', ' ']).split("  ").filter(|f| !f.contains('%'));
            // Only the last field may be cut, and none is.
            let is_whole = |field: &str| begin.iter().any(|name| field.trim().starts_with(name));
            assert!(fields.filter(|field| !field.is_empty()).all(is_whole), "{columns}: {line}");
        }
        for command in ["", "run", "check", "mesh"] {
            let help = shown(&directory, columns, &format!("{command} --help"));
            // The usage and a path have no place to break.
            let is_long = |line: &&String| {
                line.chars().count() > columns
                    && !line.contains("Usage")
                    && !line.contains(".local/")
            };
            assert_eq!(help.iter().find(is_long), None, "{command} on {columns} columns");
        }
    }
}
