//! `signorini info`: what a folder of results holds.

use super::Failure;
use serde_json::Value;
use signorini::{output::terminal::say, scene::rounded};
use std::{fs, path::Path};

/// `signorini info OUT`: the summary on the screen, a line for each entry, then frames and files.
pub fn info(folder: &Path) -> Result<(), Failure> {
    let path = folder.join("summary.json");
    let refuse = |problem: String| {
        Failure::input(format!(
            "{}: {problem}; name a folder of results, out/SCENE",
            path.display()
        ))
    };
    let text = fs::read_to_string(&path).map_err(|error| refuse(error.to_string()))?;
    let summary: Value = serde_json::from_str(&text).map_err(|error| refuse(error.to_string()))?;
    let mut lines = Vec::new();
    for (name, value) in summary.as_object().into_iter().flatten() {
        if name != "phases" {
            lines.extend(entry(name, value));
        }
    }
    let list = fs::read_to_string(folder.join("fields.pvd")).unwrap_or_default();
    let times = list.split("timestep=\"").skip(1).filter_map(|rest| rest.split('"').next());
    let times: Vec<f64> = times.filter_map(|time| time.parse().ok()).map(rounded).collect();
    if let [first, .., last] = times[..] {
        lines.push(row("frames", &format!("{}, from t = {first} to {last}", times.len())));
    }
    let names = fs::read_dir(folder).into_iter().flatten().flatten().map(|file| file.file_name());
    let names = names.map(|name| name.to_string_lossy().into_owned());
    let mut names: Vec<_> = names.filter(|name| !is_frame(name)).collect();
    names.sort();
    lines.push(row("files", &names.join(" ")));
    say(&lines.join("\n"));
    Ok(())
}

fn is_frame(name: &str) -> bool {
    ["fields_", "contact_"].iter().any(|frame| name.starts_with(frame))
}

/// The lines of an entry; of a table those of its entries.
fn entry(name: &str, value: &Value) -> Vec<String> {
    match value {
        Value::Object(table) => {
            let name = |below: &String| format!("{name}.{below}");
            table.iter().flat_map(|(below, value)| entry(&name(below), value)).collect()
        }
        Value::Array(words) if name.ends_with("command") => {
            let words: Vec<_> = words.iter().filter_map(Value::as_str).collect();
            vec![row(name, &words.join(" "))]
        }
        // Others than notes are for figures.
        Value::Array(values) => {
            values.iter().filter_map(Value::as_str).map(|text| row(name, text)).collect()
        }
        Value::String(text) => vec![row(name, text)],
        Value::Null => Vec::new(),
        other => vec![row(name, &other.to_string())],
    }
}

fn row(name: &str, value: &str) -> String {
    format!("  {name:<30} {value}")
}
