//! The TOML document of a scene: the file with the `--set` arguments inserted. Every value knows the position
//! where it is written.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use serde::{Deserialize, de::IntoDeserializer};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::SceneError;
use crate::suggestion::suggestion;

/// The full path of a file.
pub(super) fn absolute(file: &Path) -> PathBuf {
    std::path::absolute(file).unwrap_or_else(|_| file.to_owned())
}

/// The tables that are lists.
const LISTS: [&str; 2] = ["boundary", "probe"];

/// The largest number of problems that are reported at once.
const MOST_SHOWN: usize = 20;

/// The position of a problem and the message.
pub(super) type Problem = (Range<usize>, String);

/// The full key of `name` in the table at `key`; of the table itself if `name` is "".
pub(super) fn below(key: &str, name: &str) -> String {
    match (key, name) {
        (key, "") => key.to_owned(),
        ("", name) => name.to_owned(),
        _ => format!("{key}.{name}"),
    }
}

/// The position of a problem that concerns the whole file.
pub(super) const NOWHERE: Range<usize> = Range { start: 1, end: 0 };

/// The text of a scene. A position in it is a range of bytes. The bytes of the file are counted from 0, the
/// bytes of the n-th `--set` argument from n times the `stride`.
#[derive(Debug, Clone, Default)]
pub(super) struct SceneText {
    pub(super) path: PathBuf,
    /// The content of the file.
    file: String,
    /// The `--set` arguments.
    sets: Vec<String>,
    /// The `--set` arguments as TOML, indented to their positions.
    arguments: Vec<String>,
    /// A number of bytes larger than the length of the file and of each argument.
    stride: usize,
    /// The positions of the values that have been read, by their full keys.
    pub(super) positions: BTreeMap<String, Range<usize>>,
    /// The values as written, from [`Self::values`].
    pub(super) document: toml::Table,
}

impl SceneText {
    /// The content of the `file` at `path` and the `--set` arguments. A value of an argument that is not TOML
    /// becomes a string, so that shells need no second pair of quotes. The name of a constant of the file stands for the
    /// constant if it is no key at the top of a scene.
    pub(super) fn new(path: &Path, file: &str, sets: &[String], is_key: fn(&str) -> bool) -> Self {
        let stride = sets.iter().map(String::len).fold(file.len(), usize::max) + 2;
        let root = DeTable::parse_recoverable(file).0.into_inner();
        let constants = root.get("constants").map(Spanned::get_ref);
        let toml = |set: &String| {
            let Some((key, value)) = set.split_once('=') else { return set.clone() };
            let name = key.trim();
            let is_constant = !is_key(name) && constants.is_some_and(|all| all.get(name).is_some());
            let of = if is_constant { "constants." } else { "" };
            match DeTable::parse(set) {
                Ok(_) => format!("{of}{set}"),
                Err(_) => format!("{of}{key}={}", toml::Value::from(value.trim())),
            }
        };
        let indented = |(i, set)| " ".repeat((i + 1) * stride) + &toml(set);
        Self {
            path: path.to_owned(),
            file: file.to_owned(),
            sets: sets.to_vec(),
            arguments: sets.iter().enumerate().map(indented).collect(),
            stride,
            ..Self::default()
        }
    }

    /// The folder to which paths are relative.
    pub(super) fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// An error that lists the `problems` in the order of the file, if there are any.
    pub(super) fn refuse(&self, mut problems: Vec<Problem>) -> Result<(), SceneError> {
        problems.sort_by_key(|(position, _)| (position.start, position.end));
        problems.truncate(MOST_SHOWN);
        let report = |(position, message): &Problem| self.report(position, message);
        let mut reports: Vec<String> = problems.iter().map(report).collect();
        let Some(last) = reports.last_mut() else { return Ok(()) };
        // A line of the file may contradict an argument of the command line.
        let of_the_file = |(position, _): &Problem| position.start < self.stride;
        if !self.sets.is_empty() && problems.iter().all(of_the_file) {
            *last += &format!("\n(the file was read with --set {})", self.sets.join(" --set "));
        }
        Err(SceneError(reports))
    }

    /// The message after its position, and below it the underlined lines of the file.
    fn report(&self, position: &Range<usize>, message: &str) -> String {
        let problem = format!("{}: {message}", self.in_words(position));
        if *position == NOWHERE || position.start >= self.stride {
            return problem;
        }
        let value = AnnotationKind::Primary.span(position.clone());
        let lines = Snippet::source(self.file.as_str()).annotation(value);
        let lines = Renderer::plain().render(&[Group::with_level(Level::ERROR).element(lines)]);
        format!("{problem}\n{lines}")
    }

    /// The position of a `place` in the text without escapes that ends at this position of the file.
    pub(super) fn within(
        &self,
        position: &Range<usize>,
        place: &Range<usize>,
    ) -> Option<Range<usize>> {
        let value = self.file.get(position.clone())?;
        let (rest, quote) =
            value.strip_suffix(['"', '\'']).map(|rest| (rest, &value[rest.len()..]))?;
        let (key, text) = rest.rsplit_once(quote).filter(|(_, text)| !text.contains('\\'))?;
        let start = position.start + key.len() + 1;
        (!place.is_empty() && place.start <= text.len())
            .then(|| start + place.start..start + place.end)
    }

    /// The number of the line that contains the byte `at`.
    fn line(&self, at: usize) -> usize {
        self.file.bytes().take(at).filter(|byte| *byte == b'\n').count() + 1
    }

    /// The file and the line, or the file and the `--set` argument.
    pub(super) fn in_words(&self, position: &Range<usize>) -> String {
        let path = self.path.display();
        match position.start / self.stride {
            _ if *position == NOWHERE => path.to_string(),
            0 => format!("{path}:{}", self.line(position.start)),
            set => format!("{path}, --set {}", self.sets[set - 1]),
        }
    }

    /// The position of the value of a key.
    pub(super) fn position(&self, key: &str) -> Range<usize> {
        self.positions.get(key).cloned().unwrap_or(NOWHERE)
    }

    /// The values of a document. They are empty if a number does not fit its type.
    pub(super) fn values(root: &DeValue) -> toml::Table {
        let root = Spanned::new(NOWHERE, root.clone()).into_deserializer();
        toml::Table::deserialize(root).unwrap_or_default()
    }

    /// The problem of a key at `position` that the file has above already, perhaps in another form.
    fn given_twice(&self, position: &Range<usize>) -> String {
        let key = self.file.get(position.clone()).unwrap_or_default();
        let is_closed = |line: &str| {
            let found = line.split_once('=').filter(|(name, _)| name.trim() == key);
            found.is_some_and(|(_, value)| value.trim_start().starts_with('{'))
        };
        match self.file.lines().any(is_closed) {
            _ if LISTS.contains(&key) => format!("{key} is a list, each begins with [[{key}]]"),
            true => format!(
                "{key} is given above in braces, which close it: write [{key}] there with a line per key, or put these \
                 keys into the braces"
            ),
            false => format!(
                "{key} is given above already; keep one, merge two tables, or give a surface another name"
            ),
        }
    }

    /// Parses the file and inserts the `--set` arguments in their order.
    pub(super) fn parse(&self) -> Result<DeValue<'_>, SceneError> {
        let (root, errors) = DeTable::parse_recoverable(&self.file);
        let is_duplicate = |error: &toml::de::Error| {
            error.message() == "duplicate key" || error.message().starts_with("cannot extend value")
        };
        let syntax = |error: &toml::de::Error| {
            let position = error.span().unwrap_or(NOWHERE);
            let problem = match is_duplicate(error) {
                true => self.given_twice(&position),
                false => format!(
                    "not valid TOML: {}; write numbers as 0.5, and expressions and texts in quotes",
                    error.message()
                ),
            };
            (position, problem)
        };
        // After an unclosed table, keys seem to be duplicates.
        let all = errors.first().is_none_or(is_duplicate);
        let reported = errors.iter().filter(|error| all || !is_duplicate(error));
        let mut problems: Vec<Problem> = reported.map(syntax).collect();
        // Further errors in a line follow from the first one.
        problems.dedup_by_key(|(position, _)| self.line(position.start));
        self.refuse(problems)?;
        let mut root = DeValue::Table(root.into_inner());
        let mut problems = Vec::new();
        for (start, argument) in (1..).map(|n| n * self.stride).zip(&self.arguments) {
            let put = match DeTable::parse(argument) {
                Ok(given) if argument.contains('=') && !argument.contains('\n') => {
                    self.put_all(&mut root, given.into_inner(), "", argument)
                }
                _ => {
                    Err("is no key, `=` and value in one line; write --set KEY=VALUE, as in --set \
                          time.step=0.005 (quote odd names: boundary.\"left side\".gap=0)"
                        .to_owned())
                }
            };
            problems.extend(put.err().map(|problem| (start..start, problem)));
        }
        self.refuse(problems).map(|()| root)
    }

    /// Replaces values in the table, or in the array of named tables, at `key` by the values `given` in an
    /// `argument`. Dotted keys reach into both. A table in braces replaces the whole old table.
    fn put_all<'t>(
        &self,
        old: &mut DeValue<'t>,
        given: DeTable<'t>,
        key: &str,
        argument: &str,
    ) -> Result<(), String> {
        for (name, value) in given {
            let key = below(key, name.get_ref());
            let position = value.span();
            let there = match old {
                DeValue::Table(table) => table.get_mut(&name),
                DeValue::Array(tables) => {
                    tables.iter_mut().find(|table| name_of(table.get_ref()) == Some(name.get_ref()))
                }
                _ => None,
            };
            let is_braced = argument[position.start..].starts_with('{');
            let earlier = there.as_deref().map_or(0, last_place) / self.stride;
            match (there.map(Spanned::get_mut), value.into_inner()) {
                (Some(there @ (DeValue::Table(_) | DeValue::Array(_))), DeValue::Table(given))
                    if !is_braced =>
                {
                    self.put_all(there, given, &key, argument)?;
                }
                _ if earlier > 0 => {
                    let earlier = &self.sets[earlier - 1];
                    return Err(format!(
                        "{key} is given twice, also by --set {earlier} or an option with this value; keep one"
                    ));
                }
                (there, value) => match (there.is_some(), &mut *old) {
                    (false, DeValue::Table(table))
                        if key.split('.').next() == Some("constants") && !is_braced =>
                    {
                        let known =
                            table.keys().filter(|_| key != "constants").map(Spanned::get_ref);
                        let suggestion = suggestion(name.get_ref(), &known.collect::<Vec<_>>());
                        return Err(format!("{key}: the file has no such constant{suggestion}"));
                    }
                    (_, DeValue::Table(table)) => {
                        // The old key takes the position of the old value.
                        table.remove(&name);
                        table.insert(name, Spanned::new(position, value));
                    }
                    (false, DeValue::Array(tables)) => {
                        let names = tables.iter().filter_map(|table| name_of(table.get_ref()));
                        let suggestion = suggestion(name.get_ref(), &names.collect::<Vec<_>>());
                        return Err(format!("unknown key {key}{suggestion}"));
                    }
                    _ => return Err(format!("{key} needs a key; write --set {key}.KEY=VALUE")),
                },
            }
        }
        Ok(())
    }
}

/// The last position of a value and of the values in it.
fn last_place(value: &Spanned<DeValue>) -> usize {
    let inner = match value.get_ref() {
        DeValue::Table(table) => table.values().map(last_place).max(),
        DeValue::Array(array) => array.iter().map(last_place).max(),
        _ => None,
    };
    value.span().start.max(inner.unwrap_or(0))
}

/// The `name` of a boundary's table.
pub(super) fn name_of<'a>(table: &'a DeValue<'_>) -> Option<&'a str> {
    table.get("name")?.get_ref().as_str()
}
