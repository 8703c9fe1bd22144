//! `signorini keys`: the reference of all keys of a scene, in Markdown or as a JSON schema.

use super::Failure;
use serde_json::Value;
use signorini::{
    evolution::StepRecord,
    output::terminal::say,
    scene::{schema, schema_of},
};

/// What the tables of keys cannot say.
const CONVENTIONS: &str = include_str!("keys.md");

/// In the place of a default.
const REQUIRED: &str = "**required**";

/// `signorini keys [--schema]`.
pub fn keys(as_schema: bool) -> Result<(), Failure> {
    let page = match as_schema {
        true => format!("{:#}", schema()),
        false => [CONVENTIONS, &section("At the top of the file", "", "", &schema()), &columns()]
            .join("\n"),
    };
    say(&page);
    Ok(())
}

/// A section with a row for each key of a table, and sections of the tables in it. `title` is the
/// section's, `path` what stands before its keys.
fn section(title: &str, path: &str, meaning: &str, table: &Value) -> String {
    let keys = || table["properties"].as_object().into_iter().flatten();
    let is_table = |key: &Value| {
        [key, &key["items"]].into_iter().any(|content| content["properties"].is_object())
    };
    let mut page = format!("## {title}\n\n{meaning}");
    page += "| key | values | default | meaning | example |\n|---|---|---|---|---|\n";
    for (name, key) in keys().filter(|(_, key)| !is_table(key)) {
        let key = [
            format!("`{path}{name}`"),
            values(key),
            default(table, name),
            text(&key["description"]),
            format!("`{}`", text(&key["example"])),
        ];
        page += &format!("| {} |\n", key.map(|cell| cell.replace('|', "\\|")).join(" | "));
    }
    for (name, key) in keys().filter(|(_, key)| is_table(key)) {
        let meaning = text(&key["description"]);
        let meaning = match default(table, name) {
            default if default == REQUIRED => format!("{meaning} Required.\n\n"),
            default => format!("{meaning} Left out: {default}.\n\n"),
        };
        let (title, below, content) = match &key["items"] {
            Value::Null => (format!("`[{path}{name}]`"), format!("{path}{name}."), key),
            items => (format!("`[[{path}{name}]]`"), format!("{path}{name}.NAME."), items),
        };
        page += &format!("\n{}", section(&title, &below, &meaning, content));
    }
    let any = &table["additionalProperties"];
    if any["properties"].is_object() {
        let meaning = format!("{}\n\n", text(&any["description"]));
        let (title, below) = (format!("`[{path}NAME]`"), format!("{path}NAME."));
        page += &format!("\n{}", section(&title, &below, &meaning, any));
    }
    page
}

/// What a key may be, in words.
fn values(key: &Value) -> String {
    let choices = key["enum"]
        .as_array()
        .map(|names| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(" or "));
    let kind = match key["type"].as_str() {
        Some("array") => format!("two components, each: {}", values(&key["items"])),
        Some("object") => "a table of numbers".to_owned(),
        Some("boolean") => "`true` or `false`".to_owned(),
        Some(kind) => kind.to_owned(),
        None => "any".to_owned(),
    };
    key["values"].as_str().map(str::to_owned).or(choices).unwrap_or(kind)
}

/// What holds where a key of a table is left out.
fn default(table: &Value, name: &str) -> String {
    let required = table["required"].as_array().is_some_and(|names| names.contains(&name.into()));
    let key = &table["properties"][name];
    match &key["absent"] {
        _ if required => REQUIRED.to_owned(),
        Value::Null => format!("`{}`", key["default"]),
        words => text(words),
    }
}

/// A text on one line; another value as it is.
fn text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.split_whitespace().collect::<Vec<_>>().join(" "),
        other => other.to_string(),
    }
}

/// The columns of `history.csv`, from the fields that are written.
fn columns() -> String {
    let schema = schema_of::<StepRecord>();
    let columns = schema["properties"].as_object().into_iter().flatten();
    let rows =
        columns.map(|(name, column)| format!("| `{name}` | {} |\n", text(&column["description"])));
    let head = "## Columns of `history.csv`\n\nA row per accepted step.\n\n| column | meaning |\n|---|---|\n";
    head.to_owned() + rows.collect::<String>().trim_end()
}
